//! Outputs and runs of tongue-fit: records, tables, pictures and pages ([`report`]), runs as plain structs
//! ([`run`]), the library by names of muscles and bones ([`simulation`]), surgery in words ([`surgery`]), and
//! scenes from files ([`scene`]).

pub mod report;
pub mod run;
pub mod scene;
pub mod simulation;
pub mod surgery;
pub mod validate;

/// The version of the package and, if it was built in a git checkout, the commit, with `-modified` if its
/// sources differed from the commit: `0.1.0 (5e2005e12a)`. Every output contains it.
pub const VERSION: &str = env!("TONGUE_FIT_VERSION");
