//! DeepLabCut's tables (`.csv`): three header lines (`scorer`, `bodyparts`, `coords`; with several animals a fourth, `individuals`), then
//! for each frame a line with its number and x, y and likelihood of every part, in pixels, y down (Nath et al. 2019, *Nature Protocols*
//! 14). A point with a likelihood below 0.05 counts as not detected; the variance of the others is divided by their likelihood.

use std::collections::BTreeSet;

use super::{
    Budget, Format, Malformed, Recording, Sample, SourcePlace, TableLine, Times, limits, names, records,
};

const LEAST_LIKELIHOOD: f64 = 0.05;
/// A computed likelihood of 1 may be larger by rounding.
const MOST_LIKELIHOOD: f64 = 1.001;
/// Keypoints of the tongue in AAA's models, from the vallecula to the tip (Wrench and Balch-Tomes 2022).
const TONGUE: &str = "vallecula tongueroot1 tongueroot2 tonguebody1 tonguebody2 tonguedorsum1 tonguedorsum2 \
                      tongueblade1 tongueblade2 tonguetip1 tonguetip2";
const HELP: &str = "give the .csv that DeepLabCut's analyze_videos(.., save_as_csv=True) writes";

/// A body part: its name, the column of its x (y is in the next one), and the column of its likelihood.
struct BodyPart {
    name: String,
    x: usize,
    likelihood: Option<usize>,
}

pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Recording, Malformed> {
    let text = limits::text(bytes, origin)?;
    let mut titles: Vec<csv::StringRecord> = Vec::new();
    let mut parts: Vec<BodyPart> = Vec::new();
    let mut samples: Vec<Sample> = Vec::new();
    let mut budget = Budget::default();
    for row in records(&text, origin, 0, &mut csv::ReaderBuilder::new(), HELP) {
        let row = row?;
        if parts.is_empty() {
            match row.cell(0).to_ascii_lowercase().as_str() {
                "scorer" | "individuals" | "bodyparts" => titles.push(row.cells),
                "coords" => parts = parts_of(&titles, &row)?,
                _ => {
                    let what = format!("{:?} where a line of titles is due", row.cell(0));
                    return Err(row.at.error(what, HELP));
                }
            }
            continue;
        }
        budget.frame(samples.len() + 1, parts.len(), row.at)?;
        let mut sample = Sample::new(samples.len() as f64, Vec::with_capacity(parts.len()));
        for part in &parts {
            let likelihood = part.likelihood.map(|field| row.number(field, &part.name));
            let likelihood = likelihood.transpose()?.map(|l| l.unwrap_or(0.0));
            if let Some((field, l)) = part.likelihood.zip(likelihood).filter(|(_, l)| *l > MOST_LIKELIHOOD) {
                let what = format!("the likelihood of {} is {l}", part.name);
                return Err(row.place(field).error(what, "give it as a part of 1, not of 100"));
            }
            let sure = likelihood.is_none_or(|l| l >= LEAST_LIKELIHOOD);
            let place = row.point([part.x, part.x + 1], &part.name)?;
            sample.places.push(place.filter(|_| sure));
            sample.likelihood.push(likelihood.unwrap_or(1.0).clamp(LEAST_LIKELIHOOD, 1.0) as f32);
        }
        samples.push(sample);
    }
    if parts.is_empty() {
        let start = SourcePlace::start(origin);
        return Err(start.error("there is no line of titles that begins with coords", HELP));
    }
    let names = parts.into_iter().map(|p| p.name);
    let found = Recording::of_file(origin, Format::DeepLabCut, None, names, samples);
    Ok(Recording { times: Times::Frames, ..found })
}

/// The body parts, from the line of the coordinates and those above it.
fn parts_of(titles: &[csv::StringRecord], coords: &TableLine<'_>) -> Result<Vec<BodyPart>, Malformed> {
    let (at, coords) = (coords.at, &coords.cells);
    let row = |name: &str| titles.iter().find(|row| row.get(0).is_some_and(|f| f.eq_ignore_ascii_case(name)));
    let names =
        row("bodyparts").ok_or_else(|| at.error("there is no line that begins with bodyparts", HELP))?;
    let mut parts: Vec<BodyPart> = Vec::new();
    let mut known: BTreeSet<String> = BTreeSet::new();
    for x in (1..coords.len()).filter(|field| coords.get(*field) == Some("x")) {
        let at = at.at_column(x + 1);
        let title = names.get(x).unwrap_or_default();
        let is =
            |field: usize, axis: &str| coords.get(field) == Some(axis) && names.get(field) == Some(title);
        if !is(x + 1, "y") {
            return Err(at.error(format!("the x of {title:?} has no y beside it"), HELP));
        }
        let likelihood = is(x + 2, "likelihood").then_some(x + 2);
        let name = match row("individuals").and_then(|i| i.get(x)).filter(|i| !i.is_empty()) {
            Some(individual) => format!("{individual} {title}"),
            None => name_of(title),
        };
        if name.is_empty() || name.contains(char::is_control) || !known.insert(name.clone()) {
            let what = format!("the body part {name:?} is empty or given twice");
            return Err(at.error(what, "give every part one name"));
        }
        parts.push(BodyPart { name, x, likelihood });
    }
    if parts.is_empty() { Err(at.error("no body part has x and y", HELP)) } else { Ok(parts) }
}

/// Anatomical names for the keypoints of AAA's models; other parts keep their names.
fn name_of(title: &str) -> String {
    let plain = names::normalised(title);
    if let Some(n) = TONGUE.split(' ').position(|t| t == plain) {
        return format!("tongue_{n}");
    }
    names::bone(title).unwrap_or(title).to_owned()
}
