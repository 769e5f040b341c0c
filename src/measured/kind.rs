//! What is compared between measurement and simulation.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;

use crate::muscle::{Muscle, PerMuscle};
use crate::suggest;

/// The quantity that measurement and simulation are compared in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TargetKind {
    /// Length over the length of GGa in the same shape, as in the thesis (4.3.1, 4.4.1): free of scale.
    #[default]
    Ratio,
    /// Length over the same muscle's length in the baseline shape: free of each muscle's rest length.
    Stretch,
}

impl TargetKind {
    /// Both kinds.
    pub const ALL: [TargetKind; 2] = [TargetKind::Ratio, TargetKind::Stretch];

    /// The name on the command line and in the outputs.
    pub const fn name(self) -> &'static str {
        match self {
            TargetKind::Ratio => "ratio",
            TargetKind::Stretch => "stretch",
        }
    }

    /// The compared quantity (dimensionless) of a shape with these `lengths`, whose baseline or rest shape has
    /// the lengths `reference`. Both in the same unit, all positive; used alike for measurement and simulation.
    pub fn values(self, lengths: &PerMuscle<f64>, reference: &PerMuscle<f64>) -> PerMuscle<f64> {
        let gga = lengths[Muscle::GGa.index()];
        Muscle::ALL.map(|m| match self {
            TargetKind::Ratio => lengths[m.index()] / gga,
            TargetKind::Stretch => lengths[m.index()] / reference[m.index()],
        })
    }

    /// Whether matching `muscle` in this quantity constrains the fit: the ratio of GGa is 1 by definition.
    pub fn constrains(self, muscle: Muscle) -> bool {
        self == TargetKind::Stretch || muscle != Muscle::GGa
    }
}

impl fmt::Display for TargetKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that is no kind of target.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown target kind \"{name}\"; {}", suggest::hint(name, TargetKind::ALL.map(TargetKind::name)))]
pub struct UnknownTargetKind {
    /// What was given.
    pub name: String,
}

impl FromStr for TargetKind {
    type Err = UnknownTargetKind;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        TargetKind::ALL
            .into_iter()
            .find(|k| k.name().eq_ignore_ascii_case(name.trim()))
            .ok_or_else(|| UnknownTargetKind { name: name.to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_and_written_alike() {
        for kind in TargetKind::ALL {
            assert_eq!(kind.name().to_uppercase().parse(), Ok(kind));
            assert_eq!(serde_json::to_value(kind).unwrap(), kind.name());
        }
        let message = "rato".parse::<TargetKind>().unwrap_err().to_string();
        assert_eq!(message, "unknown target kind \"rato\"; did you mean \"ratio\"? (known: ratio, stretch)");
    }

    #[test]
    fn ratios_ignore_scale_and_stretches_are_one_at_rest() {
        let lengths = [41.0, 62.0, 53.0, 59.0, 23.0, 44.0, 33.0, 35.0];
        // 1/1024 is a power of two, so the quotients keep every bit.
        let scaled = lengths.map(|l| l / 1024.0);
        let ratio = TargetKind::Ratio;
        assert_eq!(ratio.values(&lengths, &lengths), ratio.values(&scaled, &lengths));
        assert_eq!(TargetKind::Stretch.values(&lengths, &lengths), [1.0; 8]);
    }
}
