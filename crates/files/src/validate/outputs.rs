//! Results of a validation as they are written: the records, the columns of their tables, the files and the page.

use std::fmt::Write as _;

use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;

use super::posterior::PosteriorStudy;
use super::scored::JOINT_TILT;
use super::{Scored, ScoredBaseline};
use crate::report::column::{Column, markdown, table};
use crate::report::{ByMuscle, Files, Rows, Scatter, Svg, scatter};
use tongue_core::statistics::distinct;
use tongue_input::measured::Vowel;

type BaselineScore<'s> = (&'s ScoredBaseline, &'s Scored);

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

fn predictions(study: &ValidationStudy) -> Vec<Column<'_, Prediction>> {
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
fn baseline_scores<'s>() -> Vec<Column<'s, BaselineScore<'s>>> {
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

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    pub subject: String,
    pub vowel: Vowel,
    pub muscle: String,
    pub measured: f64,
    #[serde(flatten, deserialize_with = "in_order")]
    pub predicted: ByMuscle<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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

/// Predictions in the order of the text, which is that of the opponents.
fn in_order<'de, D: Deserializer<'de>>(from: D) -> Result<ByMuscle<f64>, D::Error> {
    let all = serde_json::Map::deserialize(from)?;
    Ok(ByMuscle(all.into_iter().filter_map(|(name, value)| Some((name, value.as_f64()?))).collect()))
}

pub fn files(study: &ValidationStudy) -> Files<'_> {
    let mut files: Files<'_> = vec![
        ("opponents.csv", Box::new(table(&opponents(study), &study.opponents))),
        ("predictions.csv", Box::new(table(&predictions(study), &study.predictions))),
        ("predicted.svg", Box::new(picture(study))),
    ];
    if let Some(posterior) = &study.posterior {
        files.push(("posterior_predictions.csv", Box::new(Rows(&posterior.predictions))));
    }
    files
}

fn picture(study: &ValidationStudy) -> Svg {
    let muscles: Vec<String> = distinct(study.predictions.iter().map(|p| p.muscle.clone()));
    // The first opponent predicts no change, which does not vary.
    let panels = study.opponents.iter().skip(1).map(|o| Scatter {
        title: match o.name.as_str() {
            "constant" => "one constant".to_owned(),
            "thesis" => "the thesis’s model".to_owned(),
            "most_probable" => "most probable point".to_owned(),
            "most_probable_passive" => "longer muscles do not pull".to_owned(),
            other => other.replace('_', " "),
        },
        line: format!(
            "RMS {:.3}, r {}",
            o.rms,
            o.correlation.map_or("–".into(), |r| format!("{r:.2}").replace('-', "\u{2212}"))
        ),
        points: study
            .predictions
            .iter()
            .filter_map(|p| {
                let muscle = muscles.iter().position(|m| *m == p.muscle)?;
                Some((muscle, p.measured, *p.predicted.get(&o.name)?))
            })
            .collect(),
    });
    let panels: Vec<Scatter> = panels.collect();
    scatter(&muscles, &panels, "Passive muscles: predicted from the other subjects, against measured")
}

pub fn page(study: &ValidationStudy, command: &str) -> String {
    let mut p = format!(
        "# Muscles that were not fitted\n\n\
         Made by `{command}`. A fit sees the muscles that are shorter than in /{}/ and predicts the others: here the passive stretches of {} \
         fits of {} subjects ({}), ν = {}. The constant is learned from the other subjects alone. The error of a fit is the root mean square \
         over its passive muscles, that of an opponent over fits.\n\n",
        study.baseline,
        study.fits,
        study.subjects.len(),
        study.subjects.join(", "),
        study.poisson_ratio,
    );
    let columns = opponents(study).into_iter().map(|column| match &*column.name {
        "name" => column.with_text(|o| format!("`{}` {}", o.name, o.what)),
        "rms" => column.with_text(|o| format!("**{:.3}**", o.rms)),
        _ => column,
    });
    p += &markdown(&columns.collect::<Vec<_>>(), &study.opponents);
    p += "\nTuned: numbers learned from the other subjects. Bootstraps draw fits with repetition, so they say nothing of subjects that were \
          not measured.\n\n![Predicted against measured](predicted.svg)\n\n\
          The thesis's fit and the most probable points learn nothing from the other subjects. But that the baseline has tensions and the hyoid \
          moves, and the priors of both, were found on all three subjects of Takano and Honda (2007), S1 to S3, so figures of that table \
          are somewhat optimistic. They are three speakers of one study.\n\n";
    if let Some(posterior) = &study.posterior {
        distributions(&mut p, posterior);
        let _ = writeln!(p, "\n**{}**", posterior.verdict);
    }
    p
}

fn distributions(p: &mut String, study: &PosteriorStudy) {
    let _ = writeln!(
        p,
        "## Distributions of a muscle left out\n\nThe posterior (`--posterior`; ν = {}) predicts every muscle of every fit from the others, with all that is not \
         known: tensions in the vowel and in the baseline, the hyoid, ends of muscles, outline, compressibility, a discrepancy of {} ({} more \
         for a row against a baseline other than /ɯ/) and rounding. `posterior` sees the seven other muscles of the same row, `posterior_joint` all other stretches of the speaker, \
         both with a hyoid that does not tilt (that of a fit may tilt); `posterior_joint_tilt` is `posterior_joint` with a hyoid that may tilt \
         as it moves back; `control_other_speakers` puts one row of every \
         speaker together, as if they were of one speaker. The discrepancy and the scales of tensions were found on S1 to S3, the tilt and the \
         discrepancy of other baselines, in which the hyoid moves too, on S1 to S4: a fifth speaker has to confirm them. `gaussian` is a normal distribution of the other subjects' stretches, shrunk as is \
         best inside the fold; `no_change` has the spread of theirs. CRPS: the smaller the better; log score: the larger. Every prediction is \
         in `posterior_predictions.csv`.\n",
        study.poisson_ratio, study.priors.discrepancy.sd, study.priors.discrepancy.sd_of_baseline
    );
    *p += &markdown(&scores(), &study.scores);
    let [gain, error] = study.log_score_gain;
    let _ = writeln!(
        p,
        "\nThe best posterior's log score exceeds that of the normal distribution by {gain:.2} ± {error:.2} (standard error over fits)."
    );
    if !study.permuted_rms.is_empty() {
        let least = study.permuted_rms.iter().copied().fold(f64::INFINITY, f64::min);
        let most = study.permuted_rms.iter().copied().fold(0.0, f64::max);
        let best = study.permuted_log_score.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let _ = writeln!(
            p,
            "With {} permutations of the muscles' names its RMS is {least:.3} to {most:.3}, its log score at most {best:.2}.",
            study.permuted_rms.len()
        );
    }
    let all = study.other_baselines.iter().flat_map(|row| row.scores.iter().map(move |s| (row, s)));
    let rows: Vec<_> = all.filter(|(_, s)| s.name != "no_change").collect();
    let _ = writeln!(p, "\n{}", markdown(&baseline_scores(), &rows));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{Export, Markdown, Provenance};

    #[test]
    fn the_committed_page_tables_and_figure_are_those_of_the_committed_study() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../results/validate");
        let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
        let json: Value = serde_json::from_str(&read("validate.json")).unwrap();
        let text = |key: &str| &*json[key].as_str().unwrap().to_owned().leak();
        let by = Provenance {
            version: text("version"),
            tissue: Some(text("tissue")),
            body: Some(text("body")),
            ..Provenance::new(text("command"))
        };
        let study: ValidationStudy = serde_json::from_value(json.clone()).unwrap();
        // The page leaves out the folder in the command.
        let command = text("command").trim_end_matches(" --out results/validate");
        let page = Markdown(page(&study, command));
        assert_eq!(page.text(&by).unwrap(), read("README.md"));
        for (name, file) in files(&study) {
            if name != "posterior_predictions.csv" {
                assert_eq!(file.text(&by).unwrap(), read(name), "{name}");
            }
        }
    }
}
