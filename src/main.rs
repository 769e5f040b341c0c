//! The `tongue-fit` command. All of it is in the library's [`tongue_fit::cli`], so that nothing of the library is compiled twice.

use std::process::ExitCode;

fn main() -> ExitCode {
    tongue_fit::cli::main()
}
