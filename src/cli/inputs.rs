//! Files that commands read, with errors that name them, and options whose values are variants of an enum of the library.

use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow, bail};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde::de::DeserializeOwned;
use tongue_fit::acoustics::{Tract, VocalTract};
use tongue_fit::body::Body;
use tongue_fit::inner::choice::{named, names};
use tongue_fit::inner::files::{self, advice};
use tongue_fit::inner::measured::lengths::plausibility;
use tongue_fit::inner::report::joined;
use tongue_fit::measured::Dataset;

use super::{invocation, output};

/// The text of a file. `what` names the file in an error, such as "the map".
pub fn text(what: &str, path: &Path) -> Result<String> {
    files::read_text(path).map_err(|e| unreadable(what, path, &e))
}

pub fn bytes(what: &str, path: &Path) -> Result<Vec<u8>> {
    files::read(path).map_err(|e| unreadable(what, path, &e))
}

fn unreadable(what: &str, path: &Path, error: &std::io::Error) -> anyhow::Error {
    anyhow!("cannot read {what} \"{}\": {error}; {}", path.display(), advice(error))
}

pub fn tract(path: &Path) -> Result<Tract> {
    Ok(VocalTract::read(&text("the tract", path)?, &path.display().to_string())?)
}

/// Reads a table of lengths, by default the built-in one, and prints the doubts about it, which are returned too; `half_width_mm` replaces
/// the half widths of the table, mm.
pub fn lengths(file: Option<&PathBuf>, half_width_mm: Option<f64>) -> Result<(Dataset, Vec<String>)> {
    if file.is_some_and(|file| file.as_os_str() == "-")
        && invocation::current().is_some_and(|run| run.is_call())
    {
        bail!("a call has no standard input; give the table itself, or the name of its file");
    }
    let data = file.map_or_else(Dataset::reference, Dataset::from_path)?;
    if data.rows.iter().any(|row| row.lengths.vowel.label() == "u") {
        output::note(&format!(
            "{}: u and ɯ are two vowels, since the table has both; write ɯ for both if they are one",
            data.origin
        ));
    }
    let data = match half_width_mm {
        Some(mm) => data.with_half_width_mm(mm)?,
        None => data,
    };
    let doubts = if file.is_some() { plausibility::doubts(&data) } else { Vec::new() };
    doubts.iter().for_each(|doubt| output::note(&format!("{}: {doubt}", data.origin)));
    Ok((data, doubts))
}

/// Notes the muscles of a table that a body lacks.
pub fn tell_lacking(data: &Dataset, body: &Body<2>) {
    let own = &body.mesh.muscles;
    let lacking = data.rows.first().into_iter().flat_map(|row| row.lengths.muscles.iter());
    let lacking = joined(lacking.filter(|n| !own.iter().any(|m| m.name.eq_ignore_ascii_case(n))), ", ");
    if !lacking.is_empty() {
        let help = "add them to its anatomy or mesh, or leave their columns out of the table";
        let (table, what) = (&data.origin, &body.what);
        output::note(&format!(
            "{table}: {what} lacks the muscles {lacking}, whose lengths are left out; {help}"
        ));
    }
}

pub fn choice<T: DeserializeOwned + Clone + Send + Sync + 'static>() -> impl TypedValueParser<Value = T> {
    choice_among(names::<T>())
}

pub fn choice_among<T: DeserializeOwned + Clone + Send + Sync + 'static>(
    names: &'static [&'static str],
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(names).try_map(|name| named(&name).ok_or("not one of them"))
}
