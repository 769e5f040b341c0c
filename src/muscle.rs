//! The eight muscle portions that Takano and Honda (2007) measured, in the order of their table.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::suggest;

/// Number of muscle portions.
pub const COUNT: usize = 8;

/// One value for each muscle portion, in the order of [`Muscle::ALL`].
pub type PerMuscle<T> = [T; COUNT];

/// A portion of an extrinsic tongue muscle, named as in Takano and Honda (2007), figure 2.5 of the thesis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Muscle {
    /// Genioglossus, anterior: mental spine to the front of the dorsum.
    GGa,
    /// Genioglossus, middle: mental spine to the top of the dorsum.
    GGm,
    /// Genioglossus, posterior: mental spine to the root.
    GGp,
    /// Styloglossus, posterior: styloid process to the tissue.
    SGp,
    /// Styloglossus, middle: from where it enters the tissue forwards to the middle of the tongue.
    SGm,
    /// Styloglossus, anterior: on from there to the tip.
    SGa,
    /// Hyoglossus, anterior: front of the hyoid up into the tissue.
    HGa,
    /// Hyoglossus, posterior: back of the hyoid up into the tissue.
    HGp,
}

impl Muscle {
    /// All portions, in the order of the published tables.
    pub const ALL: PerMuscle<Muscle> = [
        Muscle::GGa,
        Muscle::GGm,
        Muscle::GGp,
        Muscle::SGp,
        Muscle::SGm,
        Muscle::SGa,
        Muscle::HGa,
        Muscle::HGp,
    ];

    /// The abbreviation, as Takano writes it.
    pub const fn name(self) -> &'static str {
        match self {
            Muscle::GGa => "GGa",
            Muscle::GGm => "GGm",
            Muscle::GGp => "GGp",
            Muscle::SGp => "SGp",
            Muscle::SGm => "SGm",
            Muscle::SGa => "SGa",
            Muscle::HGa => "HGa",
            Muscle::HGp => "HGp",
        }
    }

    /// The anatomical name.
    pub const fn full_name(self) -> &'static str {
        match self {
            Muscle::GGa => "genioglossus, anterior",
            Muscle::GGm => "genioglossus, middle",
            Muscle::GGp => "genioglossus, posterior",
            Muscle::SGp => "styloglossus, posterior",
            Muscle::SGm => "styloglossus, middle",
            Muscle::SGa => "styloglossus, anterior",
            Muscle::HGa => "hyoglossus, anterior",
            Muscle::HGp => "hyoglossus, posterior",
        }
    }

    /// Position in [`Muscle::ALL`] and in every [`PerMuscle`].
    pub const fn index(self) -> usize {
        self as usize
    }
}

impl fmt::Display for Muscle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that is none of the eight.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown muscle \"{name}\"; {}", suggest::hint(name, Muscle::ALL.map(Muscle::name)))]
pub struct UnknownMuscle {
    /// What was given.
    pub name: String,
}

impl FromStr for Muscle {
    type Err = UnknownMuscle;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Muscle::ALL
            .into_iter()
            .find(|m| m.name().eq_ignore_ascii_case(name.trim()))
            .ok_or_else(|| UnknownMuscle { name: name.to_owned() })
    }
}
