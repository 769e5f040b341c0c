//! The command line; only this module prints, or chooses where files are written.

mod adapt;
mod auxiliary;
mod batch;
mod body;
mod drive;
mod fit;
mod fit_table;
mod inputs;
mod interrupt;
mod invocation;
mod lengths;
mod merge;
mod mesh;
mod muscles;
mod output;
mod page;
mod posterior;
mod recordings;
mod scene;
mod simulate;
mod sound;
mod space;
mod space_track;
mod table;
mod track;
mod track_files;
mod track_sound;
mod track_speakers;
mod track_table;
mod trajectory;
mod validate;

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::{Context, Result, ensure};
use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{ArgMatches, CommandFactory, FromArgMatches, Parser, Subcommand};

pub use invocation::Called;
use invocation::{Invocation, line_of, provenance, words_of_the_result};
use output::{Outcome, untrusted_sentence};

const FAILED: u8 = 1;

const UNTRUSTWORTHY: u8 = 3;

/// Most threads; starting more takes longer than a fit.
const MOST_THREADS: usize = 1024;

/// Size of the stack of a thread that runs a call, which is that of a process's main thread, bytes.
const STACK: usize = 8 << 20;

/// Finds the tensions of tongue muscles from their lengths.
///
/// Without a subcommand it fits one vowel: `tongue-fit --vowel a`.
#[derive(Debug, Parser)]
#[command(
    name = "tongue-fit",
    version = tongue_fit::VERSION,
    max_term_width = 100,
    after_help = "Examples:\n  \
        tongue-fit --vowel a\n  \
        tongue-fit --vowel a --subject X --lengths my.csv --target stretch --out results/mine"
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    fit: fit::Arguments,
    #[command(flatten)]
    global: Global,
}

#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Options of every command")]
struct Global {
    /// Folder for the output files [default: results, or a folder of the command's in it; simulate without --trajectory, mesh and scene
    /// write files only when it is given]
    #[arg(long, value_name = "DIR", global = true)]
    out: Option<PathBuf>,
    /// Number of threads; results do not depend on it [default: one for each core]
    #[arg(long, value_name = "N", global = true)]
    threads: Option<std::num::NonZeroUsize>,
    /// Print one JSON object on stdout, and nothing else there
    #[arg(long, global = true)]
    json: bool,
    /// Print errors only, and no table of results that are in the files written
    #[arg(short, long, global = true, conflicts_with = "verbose", hide_short_help = true)]
    quiet: bool,
    /// Report every step on stderr: version, threads, mesh, search, seeds, each after the time since the start
    #[arg(short, long, global = true, hide_short_help = true)]
    verbose: bool,
}

impl Global {
    fn volume(&self) -> invocation::Volume {
        match (self.quiet, self.verbose) {
            (true, _) => invocation::Volume::Quiet,
            (_, true) => invocation::Volume::Verbose,
            _ => invocation::Volume::Normal,
        }
    }
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Fit every subject and vowel of a table, with alarms and a page
    Batch(batch::Arguments),
    /// Merge the shards of a batch
    Merge(merge::Arguments),
    /// Solve one equilibrium at given tensions, or follow the motion there
    Simulate(simulate::Arguments),
    /// Make a speaker's body from recordings or landmarks
    Adapt(adapt::Arguments),
    /// Find tensions over time from recorded contours, sensors and bones
    Track(track::Arguments),
    /// Compute the sound of a vowel: the tract around the tongue, its formants, and a voice
    Sound(sound::Arguments),
    /// Show the effect of each muscle alone, side by side
    Muscles(muscles::Arguments),
    /// Write a page for any browser in which the tongue moves with its muscles
    Page(page::Arguments),
    /// List, explain and run scenes, which simulate only the effects that they need
    #[command(subcommand)]
    Scene(scene::SceneAction),
    /// Check how a table of measured lengths is read
    #[command(subcommand)]
    Lengths(lengths::LengthsAction),
    /// Build the mesh and report its quality
    Mesh(mesh::Arguments),
    /// Print the priors of a posterior, as TOML
    #[command(after_help = "Example:\n  tongue-fit priors > priors.toml")]
    Priors,
    /// Validate predictions of muscles that were not fitted, against other ways to predict them
    Validate(validate::Arguments),
    /// Print a script that completes tongue-fit's options in a shell
    #[command(after_help = "Examples:\n  \
        tongue-fit completions bash > ~/.local/share/bash-completion/completions/tongue-fit\n  \
        tongue-fit completions zsh > ~/.zfunc/_tongue-fit\n  \
        tongue-fit completions fish > ~/.config/fish/completions/tongue-fit.fish")]
    Completions {
        /// The shell
        #[arg(value_enum)]
        shell: clap_complete::Shell,
    },
}

/// Parses a command line (the name of the program first), runs it, and turns the result into an exit status: 0 done and converged, 1 bad
/// input or I/O, 2 wrong usage, 3 done but something did not converge or cannot be trusted. It may be called once in a process: wrong usage
/// ends the process, and signals are handled from then on.
pub fn run(words: Vec<OsString>) -> u8 {
    let (cli, matches) = parse(words.clone()).unwrap_or_else(|error| error.exit());
    Invocation::begin(words, cli.global.volume());
    #[cfg(unix)]
    interrupt::handle_signals();
    exit_status(body::check_options(&Cli::command(), &matches).and_then(|()| {
        if cli.global.threads.is_some() {
            start_threads(&cli.global, rayon::ThreadPoolBuilder::build_global)?;
        }
        cli.run()
    }))
}

/// Runs a command line within a process, on threads of its own, and returns what it prints. Calls may run side by side. After `stop`
/// becomes true, the call unwinds at its next report of progress.
pub fn call(words: Vec<OsString>, stop: &Arc<AtomicBool>) -> Called {
    let (cli, matches) = match parse(words.clone()) {
        Ok(parsed) => parsed,
        Err(error) => {
            let (text, status) =
                (error.render().to_string(), u8::try_from(error.exit_code()).unwrap_or(FAILED));
            let [stdout, stderr] =
                if error.use_stderr() { [String::new(), text] } else { [text, String::new()] };
            return Called { status, stdout, stderr };
        }
    };
    let invocation = Invocation::call(words, cli.global.volume(), Arc::clone(stop));
    invocation.enter();
    let of_threads = Arc::clone(&invocation);
    let status = exit_status(body::check_options(&Cli::command(), &matches).and_then(|()| {
        let threads = start_threads(&cli.global, |threads| {
            threads.start_handler(move |_| of_threads.enter()).stack_size(STACK).build()
        })?;
        threads.install(|| cli.run())
    }));
    let [stdout, stderr] = invocation.captured_output();
    Called { status, stdout, stderr }
}

/// The exit status of a command that has ended; an error, or why a result cannot be trusted, is printed.
fn exit_status(result: Result<Outcome>) -> u8 {
    match result {
        Ok(Outcome::Good) => 0,
        Ok(Outcome::Untrustworthy(why)) => {
            output::complain(&why);
            UNTRUSTWORTHY
        }
        Ok(Outcome::SomeRowsRefused) => FAILED,
        Err(error) => {
            output::error(&error);
            FAILED
        }
    }
}

impl Cli {
    fn run(&self) -> Result<Outcome> {
        output::step(|| {
            format!("tongue-fit {}, {} threads", tongue_fit::VERSION, rayon::current_num_threads())
        });
        let global = &self.global;
        match &self.command {
            None => fit::run(&self.fit, global),
            Some(Command::Batch(arguments)) => batch::run(arguments, global),
            Some(Command::Merge(arguments)) => merge::run(arguments, global),
            Some(Command::Simulate(arguments)) => simulate::run(arguments, global),
            Some(Command::Adapt(arguments)) => adapt::run(arguments, global),
            Some(Command::Track(arguments)) => track::run(arguments, global),
            Some(Command::Sound(arguments)) => sound::run(arguments, global),
            Some(Command::Muscles(arguments)) => muscles::run(arguments, global),
            Some(Command::Page(arguments)) => page::run(arguments, global),
            Some(Command::Scene(arguments)) => scene::run(arguments, global),
            Some(Command::Lengths(arguments)) => lengths::run(arguments, global),
            Some(Command::Mesh(arguments)) => mesh::run(arguments, global),
            Some(Command::Priors) => posterior::priors(global).map(|()| Outcome::Good),
            Some(Command::Validate(arguments)) => validate::run(arguments, global),
            Some(Command::Completions { shell }) => completions(*shell),
        }
    }
}

/// An error for wrong usage, and for a request for help or the version.
fn parse(words: Vec<OsString>) -> Result<(Cli, ArgMatches), clap::Error> {
    let matches = Cli::command().try_get_matches_from(with_points_tracked(words))?;
    let cli = Cli::from_arg_matches(&matches)?;
    let (kind, message) = if let Some(option) = misplaced_option(&matches) {
        let place = "belongs to the fit of a vowel or stands behind its subcommand, not before it";
        (ErrorKind::ArgumentConflict, format!("--{option} {place}"))
    } else if !cli.fit.auxiliary.points.is_empty() && cli.fit.posterior.posterior.is_none() {
        let message = "--points needs --posterior N (points beside the lengths), or comes before all other options (points \
                       alone), as in tongue-fit --points my.csv --as-is";
        (ErrorKind::ArgumentConflict, message.to_owned())
    } else if cli.command.is_none() && cli.fit.vowel.is_none() {
        let message = "give a vowel to fit: --vowel i, e, a, o or ɯ (or a subcommand)";
        (ErrorKind::MissingRequiredArgument, message.to_owned())
    } else {
        return Ok((cli, matches));
    };
    Err(Cli::command().error(kind, message))
}

/// Turns `--points FILE` as the first option into `track FILE`, unless a vowel is fitted.
fn with_points_tracked(mut words: Vec<OsString>) -> Vec<OsString> {
    let text = |w: &OsString| w.to_string_lossy().into_owned();
    let first = words.get(1).map(text).unwrap_or_default();
    if words.iter().any(|w| ["--vowel", "--posterior"].iter().any(|o| text(w).starts_with(o))) {
        return words;
    }
    if first == "--points" && words.len() > 2 {
        words[1] = "track".into();
    } else if let Some(file) = first.strip_prefix("--points=") {
        words.splice(1..2, ["track".into(), file.into()]);
    }
    words
}

/// An option of the fit that is given before a subcommand; options of every command may be anywhere.
fn misplaced_option(matches: &ArgMatches) -> Option<String> {
    matches.subcommand()?;
    let command = Cli::command();
    let mut own = command.get_arguments().filter(|a| !a.is_global_set());
    let given = own.find(|a| matches.value_source(a.get_id().as_str()) == Some(ValueSource::CommandLine));
    given?.get_long().map(str::to_owned)
}

fn completions(shell: clap_complete::Shell) -> Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "tongue-fit", &mut script);
    let script = String::from_utf8_lossy(&script);
    // For bash, clap_complete 4.6 writes a hyphen in the program's name in two ways, so that nothing is completed after a subcommand
    // (https://github.com/clap-rs/clap/issues/6421). Once that is fixed, nothing is replaced here.
    output::print(&script.replace("tongue__subcmd__fit", "tongue__fit"))?;
    Ok(Outcome::Good)
}

/// Starts the threads that were asked for, or one for each core.
fn start_threads<T>(
    global: &Global,
    start: impl FnOnce(rayon::ThreadPoolBuilder) -> Result<T, rayon::ThreadPoolBuildError>,
) -> Result<T> {
    let threads = global.threads.map_or(0, std::num::NonZeroUsize::get);
    ensure!(threads <= MOST_THREADS, "--threads is {threads}; give at most {MOST_THREADS}");
    start(rayon::ThreadPoolBuilder::new().num_threads(threads))
        .with_context(|| format!("cannot start {threads} threads; ask for fewer"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every command and subcommand with its name, such as `tongue-fit scene run`.
    fn commands() -> Vec<(String, clap::Command)> {
        let mut command = Cli::command().disable_help_subcommand(true);
        command.build();
        everything(&command)
    }

    fn everything(command: &clap::Command) -> Vec<(String, clap::Command)> {
        let own = (command.get_bin_name().unwrap_or(command.get_name()).to_owned(), command.clone());
        std::iter::once(own).chain(command.get_subcommands().flat_map(everything)).collect()
    }

    #[test]
    fn the_page_of_all_commands_lists_those_of_the_program() {
        let mut commands: Vec<String> = commands().into_iter().map(|(name, _)| name).collect();
        let rows = include_str!("../../docs/commands.md").lines();
        let mut listed = Vec::new();
        for (command, sentence) in rows.filter_map(|l| l.strip_prefix("| `")?.split_once("` | ")) {
            // Links may follow the sentence.
            assert!(sentence.contains('.') && sentence.ends_with(" |"), "{command}: {sentence}");
            listed.push(command.to_owned());
        }
        commands.sort();
        listed.sort();
        assert_eq!(listed, commands);
    }

    #[test]
    fn every_command_shows_examples_in_its_help_that_its_parser_takes() {
        let commands = commands();
        assert!(commands.len() >= 14, "{}", commands.len());
        for (name, command) in commands {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(help.starts_with("Example"), "{name} has no example");
            let examples: Vec<&str> = help.lines().filter_map(|l| l.strip_prefix("  ")).collect();
            assert!(!examples.is_empty(), "{name}");
            for example in examples {
                // What follows is for the shell.
                let typed: Vec<&str> = example.split(['>', '|']).next().unwrap().split_whitespace().collect();
                let matches =
                    Cli::command().try_get_matches_from(&typed).unwrap_or_else(|e| panic!("{example}: {e}"));
                let (mut at, mut called) = (&matches, "tongue-fit".to_owned());
                while let Some((word, below)) = at.subcommand() {
                    called += &format!(" {word}");
                    at = below;
                }
                assert!(called.starts_with(&name), "{example} is no example of {name}");
            }
        }
    }
}
