//! Articulatory recordings in MATLAB files of MVIEW (Tiede 2005), among them the Haskins production rate comparison: an array of
//! structures, one for each channel, with `NAME`, `SRATE` (Hz) and `SIGNAL`, which has a row for each frame. A sensor's signal has two
//! columns (to the front, upwards) or at least three (to the front, sideways, upwards, then angles), mm; channels with one column, such as
//! the sound, are not read.

use std::collections::BTreeSet;

use super::limits::RATES_HZ;
use super::matlab::{self, MatValue};
use super::{Budget, Format, Malformed, Recording, Sample, SourcePlace, seen};

const HELP: &str = "give an array of structures with NAME, SRATE and SIGNAL, as MVIEW has them";

struct Channel<'a> {
    name: &'a str,
    rate_hz: f64,
    frames: usize,
    columns: usize,
    signal: &'a MatValue,
}

pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Vec<Recording>, Malformed> {
    let start = SourcePlace::start(origin);
    let variables = matlab::variables(bytes, origin)?;
    let mut budget = Budget::default();
    let mut found = Vec::new();
    for (name, value) in &variables {
        let MatValue::Structures(structures) = value else { continue };
        let channels: Vec<Channel<'_>> = structures.iter().filter_map(|s| channel(s)).collect();
        let Some(first) = channels.first() else { continue };
        let wrong = |what: String, help: &str| start.error(format!("in the variable {name:?} {what}"), help);
        if let Some(other) = channels.iter().find(|c| c.rate_hz != first.rate_hz || c.frames != first.frames)
        {
            let both =
                [first, other].map(|c| format!("{} has {} frames at {} Hz", c.name, c.frames, c.rate_hz));
            return Err(wrong(both.join(" and "), "resample the sensors to one rate"));
        }
        let mut names = BTreeSet::new();
        if let Some(twice) = channels.iter().find(|c| !names.insert(c.name)) {
            let what = format!("the channel {:?} is given twice", twice.name);
            return Err(wrong(what, "give every channel a name of its own"));
        }
        if !RATES_HZ.contains(&first.rate_hz) {
            return Err(wrong(format!("SRATE is {}", first.rate_hz), "it must be from 1 to 10000 Hz"));
        }
        budget.add_recording(first.frames, channels.len(), start)?;
        let samples = (0..first.frames)
            .map(|frame| {
                let places = channels.iter().map(|c| place(c, frame)).collect();
                Sample::new(frame as f64 / first.rate_hz, places)
            })
            .collect();
        let names = channels.iter().map(|c| c.name.to_owned());
        let recording = Recording::of_file(origin, Format::Mview, Some(1e-3), names, samples);
        let name = if name.is_empty() { recording.name.clone() } else { name.clone() };
        found.push(Recording { name, ..recording });
    }
    if found.is_empty() {
        let names: Vec<&str> = variables.iter().map(|(n, _)| n.as_str()).collect();
        let what = format!("no variable (of {}) is a recording", names.join(", "));
        return Err(start.error(what, HELP));
    }
    Ok(found)
}

fn place(channel: &Channel<'_>, frame: usize) -> Option<[f64; 3]> {
    let value = |column: usize| channel.signal.number(column * channel.frames + frame);
    seen(match channel.columns {
        2 => [value(0)?, 0.0, value(1)?],
        _ => [value(0)?, value(1)?, value(2)?],
    })
}

/// `None` for the sound and other signals that are not of a sensor.
fn channel(structure: &[(String, MatValue)]) -> Option<Channel<'_>> {
    let field = |name: &str| structure.iter().find(|(n, _)| n.eq_ignore_ascii_case(name)).map(|(_, v)| v);
    let Some(MatValue::Text(name)) = field("NAME") else { return None };
    let rate_hz = field("SRATE")?.number(0)?;
    let signal = field("SIGNAL")?;
    let MatValue::Numbers { size: [frames, columns], .. } = signal else { return None };
    let usable = *columns >= 2 && *frames > 0 && !name.trim().is_empty() && !name.contains(char::is_control);
    usable.then(|| Channel { name: name.trim(), rate_hz, frames: *frames, columns: *columns, signal })
}
