//! Errors of reading files of ArtiSynth: what is wrong, where, and what to do.

use super::Text;
use crate::bodies::{BodyFileError, FilePlace};
use tongue_core::body::SpaceFault;

/// What is wrong with a file of ArtiSynth.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ArtiSynthProblem {
    #[error(
        "cannot be read: {why}; name a folder with ArtiSynth's tongue (.node, .elem, CreateMuscles.mac, Fibers.mac, MuscleMaxForce.txt, jawAttachments.txt, hyoidAttachments.txt)"
    )]
    Unreadable { why: String },
    #[error("contains no file that ends in .{ending}; a body of ArtiSynth has one")]
    NoFile { ending: String },
    #[error("contains several files that end in .{ending}; keep one")]
    Several { ending: String },
    #[error("\"{found}\" stands where {what} was expected")]
    Expected { what: &'static str, found: String },
    #[error("node {id} does not exist")]
    NoSuchNode { id: u64 },
    #[error("element {id} does not exist")]
    NoSuchElement { id: u64 },
    #[error("{what} {id} comes twice")]
    Twice { what: &'static str, id: u64 },
    #[error("it contains nothing that could be read as {what}")]
    Nothing { what: &'static str },
    #[error("muscle {muscle} has no elements: no CM,{muscle},ELEM follows")]
    NoRegion { muscle: String },
    #[error("muscle {muscle} has no fibres in Fibers.mac")]
    NoFibres { muscle: String },
    #[error("muscle {muscle} has no strength in MuscleMaxForce.txt")]
    NoStrength { muscle: String },
    #[error("fibre {fibre} of muscle number {muscle} has no node number {missing}")]
    Gap { muscle: usize, fibre: usize, missing: usize },
    #[error("is not a valid body: {fault}")]
    Faulty { fault: SpaceFault },
}

/// The error for a line of a file.
pub(super) fn fail(text: &Text, line: Option<usize>, problem: ArtiSynthProblem) -> BodyFileError {
    let place = line.map_or(FilePlace::Whole, FilePlace::Line);
    BodyFileError::ArtiSynth { origin: text.file.clone(), place, problem }
}
