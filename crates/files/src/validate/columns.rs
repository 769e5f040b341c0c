//! Results of a validation as they are written to files, and the columns of its tables.

use serde::Serialize;
use serde_json::Value;

use super::posterior::PosteriorStudy;
use super::scored::JOINT_TILT;
use super::{Scored, ScoredBaseline};
use crate::report::ByMuscle;
use crate::report::column::Column;
use tongue_input::measured::Vowel;

#[cfg(test)]
use serde::Deserialize;

pub type BaselineScore<'s> = (&'s ScoredBaseline, &'s Scored);

pub fn opponents(study: &ValidationStudy) -> Vec<Column<'_, ScoredOpponent>> {
    type RowColumn<'a> = Column<'a, ScoredOpponent>;
    vec![
        RowColumn::named("name", |o| o.name.as_str().into())
            .with_heading("opponent")
            .with_text(|o| o.name.replace('_', " ")),
        RowColumn::named("tuned_parameters", |o| o.tuned_parameters.into()).with_heading("tuned"),
        RowColumn::named("rms", |o| o.rms.into()).with_heading("RMS").decimals(3),
        RowColumn::named("low", |o| o.low.into())
            .with_heading("95 % of bootstraps")
            .with_text_on_the_left(|o| format!("{:.3}–{:.3}", o.low, o.high)),
        RowColumn::named("high", |o| o.high.into()).in_csv_alone(),
        RowColumn::named("worse_than_no_change", |o| o.worse_than_no_change.into())
            .with_text(|o| format!("{} of {}", o.worse_than_no_change, study.fits)),
        RowColumn::named("better_than_constant", |o| o.better_than_constant.into())
            .with_heading("better than the constant")
            .per_cent(1),
        RowColumn::named("correlation", |o| o.correlation.into()).with_heading("r").decimals(2),
    ]
}

pub fn predictions(study: &ValidationStudy) -> Vec<Column<'_, Prediction>> {
    type RowColumn<'a> = Column<'a, Prediction>;
    let mut columns = vec![
        RowColumn::named("subject", |p| p.subject.as_str().into()),
        RowColumn::named("vowel", |p| p.vowel.to_string().into()),
        RowColumn::named("muscle", |p| p.muscle.as_str().into()),
        RowColumn::named("measured", |p| brief(p.measured)),
    ];
    columns.extend(study.opponents.iter().map(|o| {
        let predicted = move |p: &Prediction| p.predicted.get(&o.name).map_or(Value::Null, |v| brief(*v));
        RowColumn::named(o.name.clone(), predicted)
    }));
    columns
}

/// A stretch, without decimals where it is whole.
fn brief(stretch: f64) -> Value {
    if stretch.fract() == 0.0 { Value::from(stretch as i64) } else { stretch.into() }
}

pub fn scores<'a>() -> Vec<Column<'a, Scored>> {
    scores_in(|scored| scored)
}

/// The columns of the scores for rows that contain them.
fn scores_in<'a, R: 'a>(scored: fn(&R) -> &Scored) -> Vec<Column<'a, R>> {
    vec![
        Column::of_page("opponent", move |r| format!("`{}`", scored(r).name).into()),
        Column::of_page("RMS", move |r| scored(r).rms.into()).decimals(3),
        Column::of_page("CRPS", move |r| scored(r).crps.into()).decimals(3),
        Column::of_page("log score", move |r| scored(r).log_score.into()).decimals(2),
        Column::of_page("in 50 %", move |r| scored(r).coverage_50.into()).per_cent(0),
        Column::of_page("in 95 %", move |r| scored(r).coverage_95.into()).per_cent(0),
        Column::of_page("muscles", move |r| scored(r).predictions.into()),
    ]
}

/// Scores with other baselines, and where the best posterior is not reliable the reason.
pub fn baseline_scores<'s>() -> Vec<Column<'s, BaselineScore<'s>>> {
    type RowColumn<'s> = Column<'s, BaselineScore<'s>>;
    let mut columns: Vec<RowColumn<'s>> = vec![
        RowColumn::of_page("baseline", |r| format!("/{}/", r.0.baseline).into()),
        RowColumn::of_page("subjects", |r| r.0.subjects.join(", ").into()),
    ];
    columns.extend(scores_in(|r: &BaselineScore<'s>| r.1));
    // The warning is about the posterior of a speaker's rows with a hyoid that tilts.
    let warning = move |r: &BaselineScore<'s>| {
        if r.1.name == JOINT_TILT { r.0.warning.clone() } else { String::new() }
    };
    columns.push(RowColumn::of_page("", move |r| warning(r).into()).with_text(warning));
    columns
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(Deserialize))]
pub struct ScoredOpponent {
    pub name: String,
    pub what: String,
    /// Numbers learned from the other subjects.
    pub tuned_parameters: usize,
    /// Root mean square error over fits.
    pub rms: f64,
    /// Lower end of the middle 95 % of bootstraps over fits.
    pub low: f64,
    pub high: f64,
    /// Number of fits in which it is worse than no change.
    pub worse_than_no_change: usize,
    /// Part of the bootstraps in which it is better than the constant.
    pub better_than_constant: f64,
    /// Pearson's correlation of predicted and measured stretches; null if the predictions do not vary.
    pub correlation: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(Deserialize))]
pub struct Prediction {
    pub subject: String,
    pub vowel: Vowel,
    pub muscle: String,
    pub measured: f64,
    #[serde(flatten)]
    #[cfg_attr(test, serde(deserialize_with = "in_order"))]
    pub predicted: ByMuscle<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(Deserialize))]
pub struct ValidationStudy {
    pub data: String,
    pub baseline: Vowel,
    pub poisson_ratio: f64,
    pub subjects: Vec<String>,
    pub fits: usize,
    pub seed: u64,
    pub opponents: Vec<ScoredOpponent>,
    pub predictions: Vec<Prediction>,
    /// Every muscle predicted as a distribution from all others; null if it was not asked for, or if the body has no hyoid.
    pub posterior: Option<PosteriorStudy>,
}

#[cfg(test)]
fn in_order<'de, D: serde::Deserializer<'de>>(from: D) -> Result<ByMuscle<f64>, D::Error> {
    let all = serde_json::Map::deserialize(from)?;
    Ok(ByMuscle(all.into_iter().filter_map(|(name, value)| Some((name, value.as_f64()?))).collect()))
}
