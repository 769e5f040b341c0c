//! EdgeTrak's contours (`.con`): numbers without a header, a row for each point of the contour and two columns (x, y) for each frame,
//! pixels, y down. The layout is that of GetContours' `ReshapeContours` (Tiede 2020), whose two header lines (`FRAME1 ..`, `X Y ..`) are
//! accepted, too, and of Faytak's `ssanova-formatter.py`.

use super::{Budget, Format, Malformed, Recording, Sample, SourcePlace, Times, limits, rows};

pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Recording, Malformed> {
    let text = limits::text(bytes, origin)?;
    let mut points: Vec<Vec<Option<f64>>> = Vec::new();
    let mut budget = Budget::default();
    for row in rows::split(&text, SourcePlace::start(origin), rows::words) {
        if points.is_empty() && row.cells.iter().all(|c| c.starts_with("FRAME") || matches!(c, "X" | "Y")) {
            continue;
        }
        let values = (0..row.cells.len()).map(|field| row.number(field, "a coordinate"));
        let values = values.collect::<Result<Vec<_>, _>>()?;
        let width = points.first().map_or(values.len(), Vec::len);
        if values.len() != width || !width.is_multiple_of(2) {
            let what = format!("the line has {} values where the first has {width}", values.len());
            let help = "give two columns (x, y) a frame in every line";
            return Err(row.at.at_column(values.len()).error(what, help));
        }
        points.push(values);
        budget.channel(width / 2, points.len(), row.at)?;
    }
    // EdgeTrak writes zeros for a frame that was not traced.
    let names = (0..points.len()).map(|n| format!("tongue_{n}"));
    let samples = Vec::from_iter((0..points.first().map_or(0, |p| p.len() / 2)).map(|frame| {
        let places = points.iter().map(|point| {
            let (x, y) = point[2 * frame].zip(point[2 * frame + 1])?;
            ((x, y) != (0.0, 0.0)).then_some([x, y, 0.0])
        });
        Sample::new(frame as f64, places.collect())
    }));
    let found = Recording::of_file(origin, Format::Edgetrak, None, names, samples);
    Ok(Recording { times: Times::Frames, ..found })
}
