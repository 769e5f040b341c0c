//! The `tongue-fit` command. Its code is in [`tongue_fit::cli`], so that nothing is compiled twice.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(tongue_fit::cli::run(std::env::args_os().collect()))
}
