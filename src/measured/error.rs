//! Everything that can be wrong with a data file or with what is asked of it.

use std::io;

use super::Vowel;
use crate::muscle::Muscle;

/// Why data could not be read, or why a target could not be made from them.
///
/// Each message is complete: what is wrong, where, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file could not be opened or read.
    #[error("cannot read {origin}: {source}; check that the path is right and that the file may be read")]
    Unreadable {
        /// File name or other description of where the data came from.
        origin: String,
        /// What the operating system said.
        source: io::Error,
    },
    /// The file was read, but is not a table of this format.
    #[error("{origin}:{line}:{column}: {what}; {help}")]
    Malformed {
        /// File name or other description of where the data came from.
        origin: String,
        /// Line in the file, from 1.
        line: u64,
        /// Column of the table (field of the line, not character), from 1; for something missing, where it
        /// should have been.
        column: usize,
        /// What is wrong.
        what: String,
        /// What to do about it.
        help: String,
    },
    /// No row has this subject.
    #[error("unknown subject \"{name}\" in {origin}; {hint}")]
    UnknownSubject {
        /// Where the data came from.
        origin: String,
        /// What was asked for.
        name: String,
        /// The nearest subject, or those that exist.
        hint: String,
    },
    /// The subject has rows, but not for this vowel.
    #[error("{subject} has no row for /{vowel}/ in {origin}; it has {}", Vowel::list(has))]
    MissingRow {
        /// Where the data came from.
        origin: String,
        /// The subject.
        subject: String,
        /// The vowel asked for.
        vowel: Vowel,
        /// The vowels that this subject has.
        has: Vec<Vowel>,
    },
    /// The subject has no row for the vowel that is to be the baseline.
    #[error(
        "{subject} has no row for the baseline vowel /{vowel}/ in {origin}; it has {}: choose one of these as \
         the baseline instead",
        Vowel::list(has)
    )]
    MissingBaseline {
        /// Where the data came from.
        origin: String,
        /// The subject.
        subject: String,
        /// The baseline vowel asked for.
        vowel: Vowel,
        /// The vowels that this subject has.
        has: Vec<Vowel>,
    },
    /// The row is its own baseline: every change is zero.
    #[error(
        "/{vowel}/ of {subject} is the baseline itself, so there is nothing to fit; choose another vowel or \
         another baseline"
    )]
    IsBaseline {
        /// The subject.
        subject: String,
        /// The vowel, which is also the baseline.
        vowel: Vowel,
    },
    /// No muscle is shorter than in the baseline.
    #[error(
        "no muscle of {subject} is shorter in /{vowel}/ than in /{baseline}/, so none contracts; name the \
         contracting muscles yourself"
    )]
    NoContraction {
        /// The subject.
        subject: String,
        /// The vowel to fit.
        vowel: Vowel,
        /// The vowel it is compared with.
        baseline: Vowel,
    },
    /// An empty choice of contracting muscles.
    #[error("the list of contracting muscles is empty; name at least one of {}", list(&Muscle::ALL))]
    NoMuscles,
    /// A muscle was chosen twice.
    #[error("muscle {muscle} is listed twice; name each contracting muscle once")]
    RepeatedMuscle {
        /// The muscle.
        muscle: Muscle,
    },
    /// Only GGa contracts, and its ratio to itself is 1 whatever it does.
    #[error(
        "only GGa contracts in /{vowel}/ of {subject}, and its ratio to itself is always 1, so a ratio target \
         says nothing about it; use the stretch target or name more muscles"
    )]
    NoEquation {
        /// The subject.
        subject: String,
        /// The vowel to fit.
        vowel: Vowel,
    },
}

/// Muscle names for a message.
fn list(muscles: &[Muscle]) -> String {
    if muscles.is_empty() {
        return "none".to_owned();
    }
    muscles.iter().map(|m| m.name()).collect::<Vec<_>>().join(", ")
}
