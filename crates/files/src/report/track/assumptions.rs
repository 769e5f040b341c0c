//! Assumptions of tracking (prior, placement), its repeatability, and the formants of tracked frames.

use std::collections::BTreeMap;
use std::io::Write;

use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use super::{TrackRecord, TrackResults, tally};
use crate::report::column::Column;
use crate::report::with_decimals;
use crate::report::{Export, Provenance, csv, joined, names_or_none};
use tongue_core::statistics::{TWO_SIDED_95, median};
use tongue_infer::acoustics::{Articulation, TRACT_SD, Tract};
use tongue_infer::adapt::Placement;
use tongue_infer::track::{
    BaselinePredictor, CourseSummary, FrameStatus, Interval, Repeatability, Repeated, TrackSettings, Tracked,
};

/// Ends of the 95 % interval of a tension without data, N per metre of thickness.
pub fn prior_interval_n(settings: &TrackSettings) -> [f64; 2] {
    [-TWO_SIDED_95, TWO_SIDED_95].map(|z| settings.link.prior_quantile(z))
}

/// The prior: standard deviations of a muscle's level, which is the same in all frames, and of its course, both before the link; median and
/// 95 % interval of a tension without data, all in N per metre of thickness; standard deviations, mm, of the errors of a contour that last
/// for `memory_s`, and of those that all frames share; seed and number of the draws.
pub(super) fn prior<S: Serializer>(settings: &TrackSettings, serializer: S) -> Result<S::Ok, S::Error> {
    let TrackSettings { link, memory_s, errors, seed, draws, .. } = settings;
    let record = json!({
        "scale_n": link.scale_n(),
        "memory_s": memory_s,
        "level_sd_n": link.level_sd_n,
        "course_sd_n": link.deviation_sd_n,
        "median_n": link.prior_quantile(0.0),
        "interval_n": prior_interval_n(settings),
        "slow_error_mm": errors.slow_mm,
        "static_error_mm": errors.static_mm,
        "seed": seed,
        "draws": draws,
    });
    record.serialize(serializer)
}

/// Where coils placed the body, each number with the ends of its 95 % interval: its size over that before, its turn from the axes of the
/// recording from back towards up, and the place of the middle of its outline; and each coil's distance behind the tip along the body at
/// rest.
pub(super) fn placement<S: Serializer>(
    placement: &Option<Placement>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let record = placement.as_ref().map(|placement| {
        let [back, up, turn, scale] = placement.intervals();
        let coils = placement.coils.iter().map(|(name, behind)| (name, 1e3 * behind));
        json!({
            "scale": scale,
            "turn_deg": turn.map(f64::to_degrees),
            "back_mm": back.map(|m| 1e3 * m),
            "up_mm": up.map(|m| 1e3 * m),
            "coils_mm": coils.collect::<BTreeMap<_, _>>(),
        })
    });
    record.serialize(serializer)
}

/// Part of the displacement of the midsagittal contour that a plane misses after the best scaling: the median over the muscles of the
/// built-in body in space (`results/plane`). A test of the studies compares it with their result.
pub const MISSED_BY_PLANE: f64 = 0.20;

pub fn limit_of_plane() -> String {
    let missed =
        format!("A plane misses {:.0} % of the motion of a tongue in space", 100.0 * MISSED_BY_PLANE);
    missed + " (the median muscle; results/plane)."
}

pub fn placement_sentence(placement: &Placement) -> String {
    let [back, up, turn, [scale, smallest, largest]] = placement.intervals();
    let [back, up] = [back, up].map(|[_, low, high]| 0.5 * (1e3 * high - 1e3 * low));
    let [turn, low, high] = turn.map(f64::to_degrees);
    let coils = placement.coils.iter().map(|(name, m)| format!("{name} {:.0}", 1e3 * m));
    let mut coils: Vec<String> = coils.collect();
    coils.sort();
    let (known_mm, coils) = (back.max(up), coils.join(", "));
    format!(
        "placed by coils: scale {scale:.2} ({smallest:.2} to {largest:.2}), turned by {turn:.0}° ({low:.0} to {high:.0}), known to \
         {known_mm:.0} mm; coils behind the tip, mm: {coils}"
    )
}

pub fn repetitions_sentence(repeats: &Repeatability) -> String {
    let labels = repeats.labels.iter().map(|(name, n)| format!("{name} {n} times"));
    format!("repetitions of {}: {}", repeats.tier, joined(labels, ", "))
}

/// The columns of `repeats.csv`; the page and the terminal show those with a heading.
pub fn repeats_columns(repeats: &Repeatability) -> Vec<Column<'_, (String, Repeated)>> {
    type RowColumn<'a> = Column<'a, (String, Repeated)>;
    let (count, repetitions) = (repeats.labels.len(), repeats.labels.values().sum::<usize>());
    fn number<'a>(name: &'static str, heading: &'static str, value: fn(&Repeated) -> f64) -> RowColumn<'a> {
        let column = RowColumn::new(name, "", "", move |(_, r)| value(r).into());
        let column = column.with_heading(heading).with_text(move |(_, r)| with_decimals(value(r), 2));
        if heading.is_empty() { column.in_csv_alone() } else { column }
    }
    vec![
        RowColumn::new("muscle", "", "", |(muscle, _)| muscle.as_str().into()),
        number("icc", "ICC of its course", |r| r.icc),
        number("by_chance", "", |r| r.by_chance),
        number("chance_95", "95 % by shifts", |r| r.chance_95),
        number("by_exchange", "", |r| r.by_exchange),
        number("exchange_95", "by exchanges", |r| r.exchange_95),
        number("of_label", "ICC of the label", |r| r.of_label),
        number("of_label_95", "95 % by exchanges", |r| r.of_label_95),
        RowColumn::new("tier", "", "", |_| repeats.tier.as_str().into()).in_csv_alone(),
        RowColumn::new("labels", "", "", move |_| count.into()).in_csv_alone(),
        RowColumn::new("repetitions", "", "", move |_| repetitions.into()).in_csv_alone(),
    ]
}

/// The page's and the terminal's table of muscles; tensions are medians over the frames.
pub fn courses_columns(record: &TrackRecord) -> Vec<Column<'_, CourseSummary>> {
    type RowColumn<'a> = Column<'a, CourseSummary>;
    fn tension(record: &TrackRecord, c: &CourseSummary, end: fn(&Interval) -> f64) -> f64 {
        let number = record.results.muscles.iter().position(|m| *m == c.muscle);
        let ends = record.results.frames().filter_map(|(_, f)| Some(end(&f.tensions[number?])));
        median(ends).unwrap_or(f64::NAN)
    }
    fn known(of: &CourseSummary) -> Value {
        if of.known { "known" } else { "NOT KNOWN" }.into()
    }
    let mut columns: Vec<RowColumn<'_>> = vec![
        RowColumn::of_page("muscle", |c| c.muscle.as_str().into()),
        RowColumn::of_page("tension, N/m", |c| tension(record, c, |l| l.median).into()).decimals(1),
        RowColumn::of_page("95 %", |c| {
            let [low, high] = [tension(record, c, |l| l.low), tension(record, c, |l| l.high)];
            format!("{low:.1} to {high:.1}").into()
        }),
        RowColumn::of_page("course width, N/m", |c| c.course_width_n.into()).decimals(1),
        RowColumn::of_page("reliability", |c| c.reliability.into()).decimals(2),
        RowColumn::of_page("course", known),
    ];
    columns.extend(record.comparisons.first().map(|compared| {
        RowColumn::of_page("labels", |c| {
            compared.muscles.iter().find(|m| m.muscle == c.muscle).map_or(Value::Null, known)
        })
    }));
    columns
}

/// How well held-out points were predicted, by the model and by other predictors.
pub fn held_out_columns<'a>() -> Vec<Column<'a, BaselinePredictor>> {
    type RowColumn<'a> = Column<'a, BaselinePredictor>;
    vec![
        RowColumn::of_page("predicted by", |o| o.name.as_str().into()),
        RowColumn::of_page("points", |o| o.points.into()),
        RowColumn::of_page("median, mm", |o| o.median_mm.into()).decimals(2),
        RowColumn::of_page("pooled, mm", |o| o.pooled_mm.into()).decimals(2),
    ]
}

/// The tract and the lips of the formants of a run, and how well the formants are known.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FormantsRecord {
    pub tract: String,
    pub lip_opening_mm: f64,
    pub lip_protrusion_mm: f64,
    pub frames: usize,
    /// Number of frames without formants, by the reason.
    pub without: BTreeMap<&'static str, usize>,
    pub sd_hz_is: &'static str,
    /// Standard deviation that errors of the walls cause, as a part of the frequency; it is not in `sd_hz`.
    pub tract_sd_part: f64,
    /// Medians over the frames: frequency and `sd_hz` of each formant.
    pub medians_hz: Vec<[f64; 2]>,
}

impl FormantsRecord {
    pub fn new(tract: &Tract, lips: &Articulation, results: &TrackResults) -> Self {
        let frames = results.frames().map(|(_, frame)| frame);
        let (without, with_formants): (Vec<&Tracked>, Vec<&Tracked>) =
            frames.partition(|f| f.formants.is_empty());
        let count = with_formants.first().map_or(0, |f| f.formants.len());
        let median =
            |of: &dyn Fn(&Tracked) -> f64| median(with_formants.iter().map(|f| of(f))).unwrap_or(f64::NAN);
        Self {
            tract: tract.name.clone(),
            lip_opening_mm: lips.lip_opening_mm,
            lip_protrusion_mm: lips.lip_protrusion_mm,
            frames: with_formants.len(),
            without: tally(without.into_iter().map(why_none)),
            sd_hz_is: "spread of the draws between walls that count as known",
            tract_sd_part: TRACT_SD,
            medians_hz: (0..count)
                .map(|i| [median(&|f| f.formants[i].hz), median(&|f| f.formants[i].sd_hz)])
                .collect(),
        }
    }

    pub fn sentence(&self, of: usize) -> String {
        let all = self.medians_hz.iter().enumerate();
        let all = all.map(|(i, [hz, sd])| format!("F{} {hz:.0} Hz (sd {sd:.0})", i + 1));
        let without: String = self.without.iter().map(|(why, count)| format!(" ({count}: {why})")).collect();
        let (Self { frames, tract, .. }, medians, percent) =
            (self, names_or_none(all), 100.0 * self.tract_sd_part);
        format!(
            "formants of {frames} of {of} frames{without}, medians {medians}; sd is the spread of the draws, to which errors of the walls \
             ({tract}) add {percent:.0} %"
        )
    }
}

fn why_none(frame: &Tracked) -> &'static str {
    match frame.status {
        FrameStatus::Gap => "nothing was seen",
        FrameStatus::OutOfReach => "no shape was found",
        _ => "the tongue touches a wall",
    }
}

/// A row for each frame and formant; a frame without formants has one row with the reason.
pub fn formants_csv(results: &TrackResults) -> impl Export {
    move |out: &mut dyn Write, by: &Provenance| {
        let rows = results.frames().flat_map(|(recording, frame)| {
            let begin = [recording.seen.name.clone(), frame.time_s.to_string()];
            let formants = frame.formants.iter().enumerate().map(|(i, formant)| {
                [format!("F{}", i + 1), formant.hz.to_string(), formant.sd_hz.to_string(), String::new()]
            });
            let none = frame.formants.is_empty().then(|| ["", "", "", why_none(frame)].map(str::to_owned));
            formants.chain(none).map(move |end| begin.clone().into_iter().chain(end)).collect::<Vec<_>>()
        });
        csv::write(out, by, "recording,time_s,formant,hz,sd_hz,why_none".split(','), rows, false)
    }
}
