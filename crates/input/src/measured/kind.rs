//! The quantity that is compared between measurement and simulation.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::error::ReadError;
use tongue_core::{choice, suggest};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TargetKind {
    /// Length over the length of a reference muscle in the same shape (GGa in the thesis, 4.3.1 and 4.4.1):
    /// independent of scale.
    #[default]
    Ratio,
    /// Length over the same muscle's length in the baseline shape: independent of each muscle's rest length.
    Stretch,
}

impl TargetKind {
    pub const ALL: [TargetKind; 2] = [TargetKind::Ratio, TargetKind::Stretch];

    pub fn name(self) -> &'static str {
        choice::name_of(&self)
    }

    /// The compared quantity (dimensionless) of a shape with these `lengths`, whose baseline or rest shape
    /// has the lengths `at_rest`, for measurement and simulation alike. Both are positive and in the same
    /// unit and order. `reference` is the position of the reference muscle of ratios.
    pub fn values(self, lengths: &[f64], at_rest: &[f64], reference: usize) -> Vec<f64> {
        match self {
            TargetKind::Ratio => lengths.iter().map(|l| l / lengths[reference]).collect(),
            TargetKind::Stretch => lengths.iter().zip(at_rest).map(|(l, r)| l / r).collect(),
        }
    }

    /// Whether the value of a muscle constrains the fit: the ratio of the reference is 1 by definition.
    pub fn constrains(self, muscle: usize, reference: usize) -> bool {
        self == TargetKind::Stretch || muscle != reference
    }
}

/// Position of the reference muscle of ratios: GGa, as in the thesis (4.3.1), or the first muscle if there is
/// no GGa.
pub fn reference_muscle(names: &[String]) -> usize {
    super::lengths::position_of(names, "GGa").unwrap_or(0)
}

impl fmt::Display for TargetKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for TargetKind {
    type Err = ReadError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let hint = || suggest::hint(name, TargetKind::ALL.map(TargetKind::name));
        choice::named(&name.trim().to_ascii_lowercase())
            .ok_or_else(|| ReadError::Refused(format!("unknown target kind \"{name}\"; {}", hint())))
    }
}
