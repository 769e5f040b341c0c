//! `tongue-fit completions` and `tongue-fit man`: completion scripts for shells, and manual pages.
//!
//! The program makes both, because `cargo install` installs nothing but the program.

use clap::{Command, CommandFactory};
use clap_complete::Shell;
use clap_mangen::Man;
use miette::IntoDiagnostic;
use tongue_fit::report::OutputDir;

use super::{Cli, Global, Outcome, output, table};

/// Options of `tongue-fit completions`.
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

/// Options of `tongue-fit man`.
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(after_help = "Examples:\n  \
    tongue-fit man --out ~/.local/share/man/man1\n  \
    tongue-fit man | man -l -")]
pub struct ManPages {}

/// Prints a completion script.
pub fn completions(arguments: &Completions) -> miette::Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Cli::command(), "tongue-fit", &mut script);
    let script = String::from_utf8_lossy(&script);
    // For bash, clap_complete 4.6 spells a hyphen in the program's name in two ways, so that nothing is
    // completed after a subcommand (https://github.com/clap-rs/clap/issues/6421). When that is fixed, there
    // is nothing to replace.
    output::print(&script.replace("tongue__subcmd__fit", "tongue__fit"))?;
    Ok(Outcome::Good)
}

/// Writes a page for every command, or prints the first.
pub fn man(global: &Global) -> miette::Result<Outcome> {
    // Built, so that subcommands have their full names.
    let mut command = Cli::command().disable_help_subcommand(true);
    command.build();
    let Some(folder) = &global.out else {
        let (_, page) = page(&command)?;
        output::print(&page)?;
        return Ok(Outcome::Good);
    };
    let pages = everything(&command).into_iter().map(page).collect::<miette::Result<Vec<_>>>()?;
    let files: Vec<(&str, &[u8])> = pages.iter().map(|(n, p)| (n.as_str(), p.as_bytes())).collect();
    let written = OutputDir::prepare(folder).and_then(|out| out.write_all(&files)).into_diagnostic()?;
    output::summary(&table::files(&written), &written)?;
    Ok(Outcome::Good)
}

/// A command and all its subcommands.
pub fn everything(command: &Command) -> Vec<&Command> {
    let mut all = vec![command];
    all.extend(command.get_subcommands().flat_map(everything));
    all
}

/// File name and text of a command's page.
fn page(command: &Command) -> miette::Result<(String, String)> {
    let version = format!("tongue-fit {}", tongue_fit::VERSION);
    let page = Man::new(command.clone()).source(version);
    let mut text = Vec::new();
    page.render(&mut text).into_diagnostic()?;
    // The text after the help is examples, and manual pages have a section of this name.
    let text = String::from_utf8_lossy(&text).replace(".SH EXTRA", ".SH EXAMPLES");
    Ok((page.get_filename(), text))
}
