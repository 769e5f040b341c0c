//! `tongue-fit completions`: completion scripts for shells, which `cargo install` does not install.

use clap::CommandFactory;
use clap_complete::Shell;

use super::{Cli, Outcome, output};

#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(after_help = "Examples:\n  \
    tongue-fit completions bash > ~/.local/share/bash-completion/completions/tongue-fit\n  \
    tongue-fit completions zsh > ~/.zfunc/_tongue-fit\n  \
    tongue-fit completions fish > ~/.config/fish/completions/tongue-fit.fish")]
pub struct Completions {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

pub fn completions(arguments: &Completions) -> anyhow::Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Cli::command(), "tongue-fit", &mut script);
    let script = String::from_utf8_lossy(&script);
    // For bash, clap_complete 4.6 writes a hyphen in the program's name in two ways, so that nothing is completed after a subcommand
    // (https://github.com/clap-rs/clap/issues/6421). Once that is fixed, nothing is replaced here.
    output::print(&script.replace("tongue__subcmd__fit", "tongue__fit"))?;
    Ok(Outcome::Good)
}
