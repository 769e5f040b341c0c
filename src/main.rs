//! The `tongue-fit` command: parses the command line and dispatches.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main()
}
