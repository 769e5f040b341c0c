//! What results of tracking stand on, and how well they repeat: prior, placement, repetitions.

use serde::Serialize;

use crate::report::{ByMuscle, Table};
use tongue_infer::adapt::Placement;
use tongue_infer::track::{Repeated, Repeats, TWO_SIDED_95, TrackSettings};

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PriorRecord {
    pub scale_n: f64,
    /// Time over which tensions are remembered, s.
    pub memory_s: f64,
    /// Standard deviation of a muscle's level before the link, the same in all frames, N per metre of thickness.
    pub level_sd_n: f64,
    /// Standard deviation of its course before the link, N per metre of thickness.
    pub course_sd_n: f64,
    /// Median of a tension before anything is seen, and the ends of its 95 % interval, N per metre of thickness.
    pub median_n: f64,
    pub interval_n: [f64; 2],
    /// Standard deviation of the error of a contour that lasts from frame to frame for `memory_s`, mm.
    pub slow_error_mm: f64,
    /// Standard deviation of the error of a contour that all frames share, mm.
    pub static_error_mm: f64,
    /// Seed of the draws, and how many.
    pub seed: u64,
    pub draws: usize,
}

impl PriorRecord {
    pub fn new(settings: &TrackSettings) -> Self {
        let link = &settings.link;
        Self {
            scale_n: link.scale_n(),
            memory_s: settings.memory_s,
            level_sd_n: link.level_sd_n,
            course_sd_n: link.course_sd_n,
            median_n: link.prior_quantile(0.0),
            interval_n: [-TWO_SIDED_95, TWO_SIDED_95].map(|z| link.prior_quantile(z)),
            slow_error_mm: settings.errors.slow_mm,
            static_error_mm: settings.errors.static_mm,
            seed: settings.seed,
            draws: settings.draws,
        }
    }
}

/// Where coils placed the body; numbers with the ends of their 95 % intervals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlacementRecord {
    /// Size of the speaker's tongue over that of the body.
    pub scale: [f64; 3],
    /// Turn of the body from the axes of the recording, from back towards up, degrees.
    pub turn_deg: [f64; 3],
    /// Where the middle of the outline at rest lies in the recording, to the back, mm.
    pub back_mm: [f64; 3],
    /// The same upwards.
    pub up_mm: [f64; 3],
    /// Distance of every coil behind the tip, along the body at rest, mm.
    pub coils_mm: std::collections::BTreeMap<String, f64>,
}

impl PlacementRecord {
    pub fn new(placement: &Placement) -> Self {
        let [back, up, turn, scale] = placement.intervals();
        let mm = |interval: [f64; 3]| interval.map(|m| 1e3 * m);
        Self {
            scale,
            turn_deg: turn.map(f64::to_degrees),
            back_mm: mm(back),
            up_mm: mm(up),
            coils_mm: placement.coils.iter().map(|(name, behind)| (name.clone(), 1e3 * behind)).collect(),
        }
    }

    pub fn said(&self) -> String {
        let [scale, turn] = [self.scale, self.turn_deg];
        let coils: Vec<String> = self.coils_mm.iter().map(|(name, mm)| format!("{name} {mm:.0}")).collect();
        format!(
            "placed by coils: scale {:.2} ({:.2} to {:.2}), turned by {:.0}° ({:.0} to {:.0}), known to {:.0} mm; coils behind the tip, \
             mm: {}",
            scale[0],
            scale[1],
            scale[2],
            turn[0],
            turn[1],
            turn[2],
            (0.5 * (self.back_mm[2] - self.back_mm[1])).max(0.5 * (self.up_mm[2] - self.up_mm[1])),
            coils.join(", ")
        )
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RepeatsRecord {
    pub tier: String,
    pub labels: std::collections::BTreeMap<String, usize>,
    pub muscles: ByMuscle<Repeated>,
}

impl RepeatsRecord {
    pub fn new(repeats: Repeats, muscles: &[String]) -> Self {
        let Repeats { tier, labels, muscles: all } = repeats;
        Self { tier, labels: labels.into_iter().collect(), muscles: ByMuscle::new(muscles, all) }
    }

    /// The numbers of a table for readers, behind the muscle.
    pub const SHOWN: [&str; 5] =
        ["ICC of its course", "95 % by shifts", "by exchanges", "ICC of the label", "95 % by exchanges"];

    pub fn shown(repeated: &Repeated) -> [f64; 5] {
        let r = repeated;
        [r.icc, r.chance_95, r.exchange_95, r.of_label, r.of_label_95]
    }

    pub fn said(&self) -> String {
        let labels: Vec<String> = self.labels.iter().map(|(name, n)| format!("{name} {n} times")).collect();
        format!("repetitions of {}: {}", self.tier, labels.join(", "))
    }

    pub fn table(&self) -> Table {
        let columns = "muscle,icc,by_chance,chance_95,by_exchange,exchange_95,of_label,of_label_95,tier,labels,repetitions";
        let (labels, repetitions) = (self.labels.len(), self.labels.values().sum::<usize>());
        let row = |(muscle, r): &(String, Repeated)| {
            let chance = [r.by_chance, r.chance_95, r.by_exchange, r.exchange_95];
            let numbers = [r.icc].into_iter().chain(chance).chain([r.of_label, r.of_label_95]);
            let numbers = numbers.map(|v| v.to_string());
            let rest = [self.tier.clone(), labels.to_string(), repetitions.to_string()];
            std::iter::once(muscle.clone()).chain(numbers).chain(rest).collect()
        };
        Table {
            columns: columns.split(',').map(str::to_owned).collect(),
            rows: self.muscles.0.iter().map(row).collect(),
        }
    }
}
