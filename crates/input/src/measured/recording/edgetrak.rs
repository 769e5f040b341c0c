//! EdgeTrak's contours (`.con`): numbers without a header, a row for each point of the contour and two columns (x, y) for each frame,
//! pixels, y down. The layout is that of GetContours' `ReshapeContours` (Tiede 2020), whose two header lines (`FRAME1 ..`, `X Y ..`) are
//! accepted, too, and of Faytak's `ssanova-formatter.py`.

use super::super::error::{Malformed, SourcePlace};
use super::{Budget, Format, Recording, Sample, Times, limits, numbers};

pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Recording, Malformed> {
    let text = limits::text(bytes, origin)?;
    let mut rows: Vec<Vec<Option<f64>>> = Vec::new();
    let mut budget = Budget::default();
    for (at, line) in limits::lines(&text, SourcePlace::start(origin)) {
        let cells = line.split([' ', '\t', ',']).filter(|c| !c.is_empty());
        if rows.is_empty() && cells.clone().all(|c| c.starts_with("FRAME") || matches!(c, "X" | "Y")) {
            continue;
        }
        let row =
            (1..).zip(cells).map(|(column, cell)| numbers::value(cell, "a coordinate", at.at_column(column)));
        let row = row.collect::<Result<Vec<_>, _>>()?;
        let width = rows.first().map_or(row.len(), Vec::len);
        if row.len() != width || !width.is_multiple_of(2) {
            let what = format!("the line has {} values where the first has {width}", row.len());
            return Err(at.at_column(row.len()).error(what, "give two columns (x, y) a frame in every line"));
        }
        rows.push(row);
        budget.channel(width / 2, rows.len(), at)?;
    }
    // EdgeTrak writes zeros for a frame that was not traced.
    let names = (0..rows.len()).map(|n| format!("tongue_{n}"));
    let samples = Vec::from_iter((0..rows.first().map_or(0, |r| r.len() / 2)).map(|frame| {
        let places = rows.iter().map(|row| {
            let (x, y) = row[2 * frame].zip(row[2 * frame + 1])?;
            ((x, y) != (0.0, 0.0)).then_some([x, y, 0.0])
        });
        Sample::new(frame as f64, places.collect())
    }));
    let found = Recording::of_file(origin, Format::Edgetrak, None, names, samples);
    Ok(Recording { times: Times::Frames, ..found })
}
