//! What results of tracking stand on (prior, placement), how well they repeat, and the formants of tracked frames as records.

use std::collections::BTreeMap;
use std::io::Write;

use serde::{Serialize, Serializer};
use serde_json::json;

use super::TrackResults;
use crate::report::{Export, Provenance, Table, csv};
use tongue_core::statistics::{TWO_SIDED_95, upper_median};
use tongue_infer::acoustics::{Articulation, TRACT_SD, Tract};
use tongue_infer::adapt::Placement;
use tongue_infer::track::{FrameStatus, Repeatability, Repeated, TrackSettings, Tracked};

/// Ends of the 95 % interval of a tension before anything is seen, N per metre of thickness.
pub fn prior_interval_n(settings: &TrackSettings) -> [f64; 2] {
    [-TWO_SIDED_95, TWO_SIDED_95].map(|z| settings.link.prior_quantile(z))
}

/// The prior: standard deviations of a muscle's level, the same in all frames, and of its course, both before the link; median and 95 %
/// interval of a tension before anything is seen, all N per metre of thickness; standard deviations of the errors of a contour, mm, that
/// last for `memory_s` and that all frames share; seed and number of the draws.
pub(super) fn prior<S: Serializer>(settings: &TrackSettings, serializer: S) -> Result<S::Ok, S::Error> {
    let TrackSettings { link, memory_s, errors, seed, draws, .. } = settings;
    let record = json!({
        "scale_n": link.scale_n(),
        "memory_s": memory_s,
        "level_sd_n": link.level_sd_n,
        "course_sd_n": link.course_sd_n,
        "median_n": link.prior_quantile(0.0),
        "interval_n": prior_interval_n(settings),
        "slow_error_mm": errors.slow_mm,
        "static_error_mm": errors.static_mm,
        "seed": seed,
        "draws": draws,
    });
    record.serialize(serializer)
}

/// Where coils placed the body, numbers with the ends of their 95 % intervals: its size over that before, its turn from the axes of the
/// recording from back towards up, and the place of the middle of its outline; and every coil's distance behind the tip, along the body at
/// rest.
pub(super) fn placement<S: Serializer>(found: &Option<Placement>, serializer: S) -> Result<S::Ok, S::Error> {
    let Some(found) = found else { return serializer.serialize_none() };
    let [back, up, turn, scale] = found.intervals();
    let coils_mm: BTreeMap<_, _> = found.coils.iter().map(|(name, behind)| (name, 1e3 * behind)).collect();
    let record = json!({
        "scale": scale,
        "turn_deg": turn.map(f64::to_degrees),
        "back_mm": back.map(|m| 1e3 * m),
        "up_mm": up.map(|m| 1e3 * m),
        "coils_mm": coils_mm,
    });
    record.serialize(serializer)
}

pub fn placed(placement: &Placement) -> String {
    let [back, up, turn, scale] = placement.intervals();
    let [back, up] = [back, up].map(|[_, low, high]| 0.5 * (1e3 * high - 1e3 * low));
    let [turn, low, high] = turn.map(f64::to_degrees);
    let mut coils: Vec<_> =
        placement.coils.iter().map(|(name, m)| format!("{name} {:.0}", 1e3 * m)).collect();
    coils.sort();
    format!(
        "placed by coils: scale {:.2} ({:.2} to {:.2}), turned by {turn:.0}° ({low:.0} to {high:.0}), known to {:.0} mm; coils behind the \
         tip, mm: {}",
        scale[0],
        scale[1],
        scale[2],
        back.max(up),
        coils.join(", ")
    )
}

pub fn repeated(repeats: &Repeatability) -> String {
    let labels: Vec<String> = repeats.labels.iter().map(|(name, n)| format!("{name} {n} times")).collect();
    format!("repetitions of {}: {}", repeats.tier, labels.join(", "))
}

/// A number of a muscle in a table for readers: its name, and its value.
type ShownNumber = (&'static str, fn(&Repeated) -> f64);

pub const REPEATED: [ShownNumber; 5] = [
    ("ICC of its course", |r| r.icc),
    ("95 % by shifts", |r| r.chance_95),
    ("by exchanges", |r| r.exchange_95),
    ("ICC of the label", |r| r.of_label),
    ("95 % by exchanges", |r| r.of_label_95),
];

pub fn repeats_table(Repeatability { tier, labels, muscles }: &Repeatability) -> Table {
    let columns =
        "muscle,icc,by_chance,chance_95,by_exchange,exchange_95,of_label,of_label_95,tier,labels,repetitions";
    let (count, repetitions) = (labels.len(), labels.values().sum::<usize>());
    let rows = muscles.0.iter().map(|(muscle, r)| {
        let numbers =
            [r.icc, r.by_chance, r.chance_95, r.by_exchange, r.exchange_95, r.of_label, r.of_label_95];
        let rest = [tier.clone(), count.to_string(), repetitions.to_string()];
        std::iter::once(muscle.clone()).chain(numbers.map(|v| v.to_string())).chain(rest).collect()
    });
    Table { columns: columns.split(',').map(str::to_owned).collect(), rows: rows.collect() }
}

/// What the formants of a run are those of, and how far they are known.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FormantsRecord {
    pub tract: String,
    pub lip_opening_mm: f64,
    pub lip_protrusion_mm: f64,
    /// Number of frames that have formants.
    pub frames: usize,
    /// Number of the other frames by the reason why they have none.
    pub without: BTreeMap<&'static str, usize>,
    pub sd_hz_is: &'static str,
    /// Standard deviation by the errors of estimated walls, as a part of the frequency; it is not in `sd_hz`.
    pub tract_sd_part: f64,
    /// Medians over the frames: frequency and `sd_hz` of each formant, Hz.
    pub medians_hz: Vec<[f64; 2]>,
}

impl FormantsRecord {
    pub fn new(tract: &Tract, lips: &Articulation, results: &TrackResults) -> Self {
        let told: Vec<&Tracked> =
            results.frames().map(|(_, f)| f).filter(|f| !f.formants.is_empty()).collect();
        let mut without = BTreeMap::new();
        for (_, frame) in results.frames().filter(|(_, f)| f.formants.is_empty()) {
            *without.entry(why_none(frame)).or_default() += 1;
        }
        let count = told.first().map_or(0, |f| f.formants.len());
        let median =
            |of: &dyn Fn(&Tracked) -> f64| upper_median(told.iter().map(|f| of(f))).unwrap_or(f64::NAN);
        Self {
            tract: tract.name.clone(),
            lip_opening_mm: lips.lip_opening_mm,
            lip_protrusion_mm: lips.lip_protrusion_mm,
            frames: told.len(),
            without,
            sd_hz_is: "spread of the draws between walls that count as known",
            tract_sd_part: TRACT_SD,
            medians_hz: (0..count)
                .map(|i| [median(&|f| f.formants[i].hz), median(&|f| f.formants[i].sd_hz)])
                .collect(),
        }
    }

    pub fn said(&self, of: usize) -> String {
        let all = self.medians_hz.iter().enumerate();
        let all: Vec<String> =
            all.map(|(i, [hz, sd])| format!("F{} {hz:.0} Hz (sd {sd:.0})", i + 1)).collect();
        let without: String = self.without.iter().map(|(why, count)| format!(" ({count}: {why})")).collect();
        format!(
            "formants of {} of {of} frames{without}, medians {}; sd is the spread of the draws, to which errors of the walls ({}) add {:.0} %",
            self.frames,
            if all.is_empty() { "none".to_owned() } else { all.join(", ") },
            self.tract,
            100.0 * self.tract_sd_part
        )
    }
}

/// Why a frame has no formants.
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
            let begin = [recording.name.clone(), frame.time_s.to_string()];
            let told = frame.formants.iter().enumerate().map(|(i, formant)| {
                [format!("F{}", i + 1), formant.hz.to_string(), formant.sd_hz.to_string(), String::new()]
            });
            let none = frame.formants.is_empty().then(|| ["", "", "", why_none(frame)].map(str::to_owned));
            told.chain(none).map(move |end| begin.clone().into_iter().chain(end)).collect::<Vec<_>>()
        });
        csv::write(out, by, "recording,time_s,formant,hz,sd_hz,why_none".split(','), rows)
    }
}
