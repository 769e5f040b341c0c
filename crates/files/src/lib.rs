//! What tongue-fit writes and runs: records, tables, pictures and pages ([`report`]), the library by names of muscles and bones
//! ([`simulation`]), and scenes from files ([`scene`]).

pub mod report;
pub mod scene;
pub mod simulation;

/// Which tongue-fit this is: the version of the package and, where it was built in a git checkout, the commit, with
/// `-modified` behind it where its sources were not as committed: `0.1.0 (5e2005e12a)`. Every output says it.
pub const VERSION: &str = env!("TONGUE_FIT_VERSION");
