//! Formants of tracked frames as records.

use std::collections::BTreeMap;
use std::io::Write;

use serde::Serialize;

use super::TrackResults;
use crate::report::{Export, Provenance, csv};
use tongue_core::statistics::upper_median;
use tongue_infer::acoustics::{Articulation, TRACT_SD, Tract};
use tongue_infer::track::{FrameStatus, Tracked};

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
        let one = |(i, [hz, sd]): (usize, &[f64; 2])| format!("F{} {hz:.0} Hz (sd {sd:.0})", i + 1);
        let all: Vec<String> = self.medians_hz.iter().enumerate().map(one).collect();
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
