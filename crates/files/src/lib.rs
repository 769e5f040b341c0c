//! Outputs ([`report`]), runs as plain structs ([`run`]), the library by names of muscles and bones ([`simulation`]), surgery of a tongue
//! in space ([`surgery`]), scenes from files ([`scene`]), and validation ([`validate`]).

pub mod report;
pub mod run;
pub mod scene;
pub mod simulation;
pub mod surgery;
pub mod validate;

/// The version of the package, with the commit if it was built in a git checkout, and `-modified` if its sources differed from that commit:
/// `0.1.0 (5e2005e12a)`. Every output contains it.
pub const VERSION: &str = env!("TONGUE_FIT_VERSION");
