//! `--help` shows the most used options; `--help-all` shows all of them, grouped.

use std::ffi::OsString;

use clap::{Arg, Command};

/// Options of every command that `--help` shows.
const OF_EVERY_COMMAND: [&str; 4] = ["out", "threads", "json", "help-all"];

/// For commands with many options: the command's own options that `--help` shows.
const USUAL: [(&str, &[&str]); 10] = [
    ("tongue-fit", &["vowel", "subject", "lengths", "target", "points", "posterior", "body"]),
    ("batch", &["lengths", "subjects", "vowels", "target", "draws", "posterior", "shard"]),
    ("simulate", &["tension", "activation", "trajectory", "t-end", "colour-stretch", "body", "mesh"]),
    ("adapt", &["example", "map", "map-template", "palate", "landmarks", "contour", "rest"]),
    ("track", &["example", "map", "map-template", "palate", "mesh", "as-is", "hold-out"]),
    ("sound", &["vowel", "subject", "tension", "jaw", "lip-opening", "lip-protrusion", "tract"]),
    ("muscles", &["tension", "body", "mesh", "anatomy", "h"]),
    ("page", &["lengths", "no-fits", "body", "mesh", "anatomy", "h"]),
    ("mesh", &["body", "mesh", "anatomy", "h"]),
    ("validate", &["lengths", "baseline", "posterior", "body"]),
];

/// The command with its rarely used options hidden, unless the words ask for all.
pub fn shown(command: Command, words: &[OsString]) -> Command {
    if words.iter().any(|word| word == "--help-all") { command } else { without_rare_options(command) }
}

fn without_rare_options(command: Command) -> Command {
    let Some((_, usual)) = USUAL.iter().find(|(name, _)| *name == command.get_name()) else {
        return command.mut_subcommands(without_rare_options);
    };
    let hidden = |arg: Arg| {
        let is_shown =
            arg.get_long().is_none_or(|name| usual.contains(&name) || OF_EVERY_COMMAND.contains(&name));
        arg.hide(!is_shown)
    };
    command.mut_args(hidden).mut_subcommands(without_rare_options)
}

#[cfg(test)]
mod tests {
    use super::super::Cli;
    use super::*;
    use clap::CommandFactory;

    fn help_of(mut command: Command, name: &str) -> String {
        command.build();
        match name {
            "tongue-fit" => command.render_long_help().to_string(),
            _ => command.find_subcommand_mut(name).unwrap().render_long_help().to_string(),
        }
    }

    fn options(help: &str) -> Vec<&str> {
        // Lines of descriptions are indented further, and can begin with the name of an option.
        let names = help.lines().filter_map(|line| line.strip_prefix("      --"));
        names.map(|line| line.split([' ', '=']).next().unwrap()).collect()
    }

    #[test]
    fn the_help_shows_at_most_ten_options_and_names_the_option_for_the_others() {
        for (name, _) in USUAL {
            let help = help_of(shown(Cli::command(), &[]), name);
            let shown = options(&help);
            assert!(shown.contains(&"help-all"), "{name}: {shown:?}");
            assert!(shown.iter().filter(|option| **option != "help-all").count() <= 10, "{name}: {shown:?}");
        }
    }

    #[test]
    fn every_option_in_the_lists_is_one_of_its_command_and_the_long_help_has_all() {
        for (name, usual) in USUAL {
            let help = help_of(shown(Cli::command(), &["--help-all".into()]), name);
            let all = options(&help);
            for option in usual.iter().chain(&OF_EVERY_COMMAND) {
                assert!(all.contains(option), "{name} --{option}");
            }
            assert!(all.len() > usual.len() + OF_EVERY_COMMAND.len(), "{name} needs no list");
        }
    }
}
