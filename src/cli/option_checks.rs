//! Refuses options that only bodies in the plane, or only those in space, have if the body is of the other kind.

use anyhow::bail;
use clap::parser::ValueSource;
use clap::{ArgMatches, Command};

use super::body::space_name;

const SPACE_HEADINGS: [&str; 2] = ["Body in space", "Surgery"];

/// Options that bodies in the plane and in space share, and options of space under other headings, by their names in [`clap`]; `None` for a
/// command without bodies in space.
fn options_of_bodies(command: &str) -> Option<(&'static [&'static str], &'static [&'static str])> {
    match command {
        "" => Some((&["vowel", "subject", "target", "baseline", "lengths", "error_mm"], &[])),
        "simulate" => Some((&["direct"], &[])),
        "muscles" => Some((&[], &["activation"])),
        "sound" => Some((&["tract", "lip_opening", "lip_protrusion", "pitch", "seconds"], &[])),
        "track" => {
            Some((&["files", "example", "map", "map_template", "palate", "speaker", "format", "as_is"], &[]))
        }
        _ => None,
    }
}

pub fn check(command: &Command, matches: &ArgMatches) -> anyhow::Result<()> {
    let (name, own, command) = match matches.subcommand() {
        Some((name, own)) => (name, own, command.find_subcommand(name)),
        None => ("", matches, Some(command)),
    };
    let Some(((shared, of_space), command)) = options_of_bodies(name).zip(command) else { return Ok(()) };
    let body = own.try_get_raw("body").ok().flatten().and_then(|mut words| words.next());
    let body = body.map(|word| word.to_string_lossy().into_owned());
    let body = body.filter(|word| space_name(word).is_ok());
    for option in command.get_arguments().filter(|a| !a.is_global_set()) {
        let id = option.get_id().as_str();
        if id == "body" || shared.contains(&id) || own.value_source(id) != Some(ValueSource::CommandLine) {
            continue;
        }
        let heading = option.get_help_heading();
        let in_space = of_space.contains(&id) || heading.is_some_and(|h| SPACE_HEADINGS.contains(&h));
        let option = option.get_long().map_or_else(|| id.to_owned(), |long| format!("--{long}"));
        match &body {
            Some(body) if !in_space => {
                bail!(
                    "{option} is for bodies in the plane, and --body {body} is in space: leave one of the two out (muscles in space have \
                     strengths, so give activations, like --activation GGP=0.1)"
                );
            }
            None if in_space => {
                bail!(
                    "{option} needs a body in space: --body space, --body FOLDER with the files of ArtiSynth's tongue, or --body FILE.msh"
                );
            }
            _ => {}
        }
    }
    Ok(())
}
