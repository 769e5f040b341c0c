//! Articulate Assistant Advanced's export of splines: a tab-separated table with a header, a row a frame, columns `X0 SPLINE`,
//! `Y0 SPLINE` and so on, millimetres, y up. What is missing is empty or `*`. Columns as the R package rticulate (Coretta 2021,
//! `read_aaa`) and AAA's own list of DeepLabCut splines name them.

use std::collections::BTreeMap;

use super::super::lengths::Malformed;
use super::super::lengths::error::Place;
use super::super::lengths::text::decode;
use super::{Format, Recording, Sample, check_size, coordinate};

const TIMES: [&str; 4] =
    ["Time of sample in recording", "Time of sample in annot", "Time of sample in sweep", "time_s"];

/// Columns of one point.
struct Columns {
    name: String,
    x: usize,
    y: usize,
}

pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Vec<Recording>, Malformed> {
    let text = decode(bytes, origin)?.text;
    let start = Place { origin, line: 1, column: 1 };
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(b'\t')
        .has_headers(true)
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let broken = |e: csv::Error| {
        let line = e.position().map_or(1, csv::Position::line);
        Place { line, ..start }.error(e.to_string(), "export the table from AAA anew, separated by tabs")
    };
    let header = reader.headers().map_err(broken)?.clone();
    let time = TIMES.iter().find_map(|t| header.iter().position(|h| h.eq_ignore_ascii_case(t)));
    let time = time.ok_or_else(|| {
        start.error(
            format!("no column \"{}\"", TIMES[0]),
            "export the time of the sample in the recording, as a table separated by tabs with a header",
        )
    })?;
    let points = points(&header, start)?;
    let of_recording: Vec<usize> = ["Client", "Date", "Prompt"]
        .iter()
        .filter_map(|word| header.iter().position(|h| h.starts_with(word)))
        .collect();

    let mut found: Vec<Recording> = Vec::new();
    let mut numbers: BTreeMap<Vec<String>, usize> = BTreeMap::new();
    let mut rows = 0;
    for record in reader.records() {
        let record = record.map_err(broken)?;
        if record.iter().all(str::is_empty) {
            continue;
        }
        let at = Place { line: record.position().map_or(1, csv::Position::line), ..start };
        rows += 1;
        check_size(rows, points.len(), at)?;
        let text = record.get(time).unwrap_or_default();
        let time_s = coordinate(text).ok_or_else(|| {
            at.at_column(time + 1).error(format!("the time is {text:?}"), "give a finite number of seconds")
        })?;
        let places = points.iter().map(|p| {
            let value = |field: usize| match record.get(field).unwrap_or_default() {
                "" | "*" | "NA" => Ok(None),
                text => coordinate(text).map(Some).ok_or_else(|| {
                    let help = "give millimetres, or leave it empty where the point was not seen";
                    at.at_column(field + 1).error(format!("a coordinate of {} is {text:?}", p.name), help)
                }),
            };
            Ok(value(p.x)?.zip(value(p.y)?).map(|(x, y)| [x, y, 0.0]))
        });
        let places = places.collect::<Result<Vec<_>, Malformed>>()?;
        let key: Vec<String> =
            of_recording.iter().map(|f| record.get(*f).unwrap_or_default().to_owned()).collect();
        let number = *numbers.entry(key).or_insert_with_key(|key| {
            let words: Vec<&str> = key.iter().map(String::as_str).filter(|w| !w.is_empty()).collect();
            found.push(Recording {
                name: if words.is_empty() { Recording::stem(origin) } else { words.join(", ") },
                channels: points.iter().map(|p| p.name.clone()).collect(),
                sigma: vec![None; points.len()],
                samples: Vec::new(),
                metres: Some(1e-3),
                format: Format::Aaa,
            });
            found.len() - 1
        });
        let samples = &mut found[number].samples;
        if samples.last().is_some_and(|last: &Sample| last.time_s >= time_s) {
            let what = format!("the time {time_s} s does not come after that of the row before");
            return Err(at.at_column(time + 1).error(what, "sort the rows of each recording by time"));
        }
        samples.push(Sample { time_s, places });
    }
    Ok(found)
}

/// The pairs `X3 SPLINE`, `Y3 SPLINE` of the header. A point that two splines share is taken once.
fn points(header: &csv::StringRecord, start: Place<'_>) -> Result<Vec<Columns>, Malformed> {
    let mut points: Vec<Columns> = Vec::new();
    for (x, title) in header.iter().enumerate() {
        let Some((number, spline)) = title.strip_prefix('X').and_then(|rest| rest.split_once(' ')) else {
            continue;
        };
        if number.is_empty() || !number.bytes().all(|b| b.is_ascii_digit()) {
            continue;
        }
        let other = format!("Y{number} {spline}");
        let y = header.iter().position(|h| h == other).ok_or_else(|| {
            start.at_column(x + 1).error(format!("{title:?} has no {other:?} beside it"), "export both")
        })?;
        let name = name_of(spline.trim(), number);
        if !points.iter().any(|p| p.name == name) {
            points.push(Columns { name, x, y });
        }
    }
    match points.is_empty() {
        false => Ok(points),
        true => Err(start.error(
            "no columns of a spline (\"X0 DLC_Tongue\", \"Y0 DLC_Tongue\", ..)",
            "export the splines with \"X,Y values\" in a column each",
        )),
    }
}

/// The keypoints of AAA's DeepLabCut models by what they are; any other spline by its own name.
fn name_of(spline: &str, number: &str) -> String {
    match (spline, number) {
        ("DLC_Tongue", n) => format!("tongue_{n}"),
        ("DLC_HyoidMandible", "0") => "hyoid".to_owned(),
        ("DLC_ShorttendonMandible", "0") => "mental_spine".to_owned(),
        ("DLC_HyoidMandible" | "DLC_ShorttendonMandible", "1") => "mandible".to_owned(),
        (spline, n) => format!("{spline}_{n}"),
    }
}
