//! Errors of small tables, and of making a target from measured lengths.

use super::lengths::{self, Vowel};
use tongue_core::suggest;

/// A table of nodes, tones or activity that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{origin}{}: {problem}", line.map_or_else(String::new, |l| format!(", line {l}")))]
pub struct BadTable {
    /// Its file or source.
    pub origin: String,
    /// The line, from 1, where one is to blame.
    pub line: Option<u64>,
    /// What is wrong, and what to do.
    pub problem: String,
}

/// Why a target could not be made. Each message says what is wrong, where, and what to do.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "fields without a unit are in the messages")]
pub enum TargetError {
    /// The data cannot be read, or have no such row.
    #[error(transparent)]
    Data(#[from] lengths::LengthsError),
    /// The name is not a vowel.
    #[error(transparent)]
    Vowel(#[from] lengths::BadLabel),
    /// The row is its own baseline, so every change is zero.
    #[error(
        "/{vowel}/ of {subject} is the baseline itself, so there is nothing to fit; choose another vowel or \
         another baseline"
    )]
    IsBaseline { subject: String, vowel: Vowel },
    /// The two lengths of a muscle are incompatible.
    #[error(
        "{muscle} of {subject} is {mm} mm in /{vowel}/ and {baseline_mm} mm in /{baseline}/, but no muscle of a tongue changes its length \
         to less than 0.5 or more than 1.7 times; correct the length that is wrong, or leave it empty"
    )]
    Impossible {
        muscle: String,
        subject: String,
        vowel: Vowel,
        /// Its length there, mm.
        mm: f64,
        baseline: Vowel,
        /// Its length there, mm.
        baseline_mm: f64,
    },
    /// No muscle is shorter than in the baseline.
    #[error(
        "no muscle of {subject} is shorter in /{vowel}/ than in /{baseline}/, so none contracts; name the \
         contracting muscles yourself"
    )]
    NoContraction { subject: String, vowel: Vowel, baseline: Vowel },
    /// The list of contracting muscles is empty.
    #[error("the list of contracting muscles is empty; name at least one of {}", known.join(", "))]
    NoMuscles { known: Vec<String> },
    /// A chosen muscle is not in the table.
    #[error("unknown muscle \"{name}\"; {}", suggest::hint(name, known.iter().map(String::as_str)))]
    UnknownMuscle { name: String, known: Vec<String> },
    /// A chosen muscle has no length in one of the two rows.
    #[error(
        "{muscle} of {subject} was not measured in both /{vowel}/ and /{baseline}/; choose other muscles"
    )]
    NotMeasured { muscle: String, subject: String, vowel: Vowel, baseline: Vowel },
    /// A muscle was chosen twice.
    #[error("muscle {muscle} is listed twice; name each contracting muscle once")]
    RepeatedMuscle { muscle: String },
    /// The reference muscle of ratios has no length.
    #[error(
        "{reference} of {subject} was not measured in /{vowel}/, but ratios are relative to it; use the stretch target, or add its length"
    )]
    NoReference { reference: String, subject: String, vowel: Vowel },
    /// Only the reference muscle of ratios contracts, and its ratio to itself is always 1.
    #[error(
        "only {reference} contracts in /{vowel}/ of {subject}, and its ratio to itself is always 1, so a ratio target \
         says nothing about it; use the stretch target or name more muscles"
    )]
    NoEquation { reference: String, subject: String, vowel: Vowel },
}
