//! Landmarks of active shape models (`.pts`, Cootes's tools and menpo): `version: 1`, `n_points: N`, then N lines of x and y between
//! braces, in pixels, y down. The points have no names: they are a contour from the root to the tip, in the order of the file, unless
//! a map says what each is.

use super::super::lengths::Malformed;
use super::super::lengths::error::Place;
use super::{Budget, Format, Recording, Sample, Times, budget, coordinate};

const HELP: &str = "write `version: 1`, `n_points: N`, then `{`, N lines of x and y, and `}`";

/// Whether a first line begins such a file.
pub(super) fn is_head(line: &[u8]) -> bool {
    let line = String::from_utf8_lossy(line).trim().to_ascii_lowercase();
    ["version:", "n_points:", "version :", "n_points :"].iter().any(|head| line.starts_with(head))
}

pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Recording, Malformed> {
    let text = budget::text(bytes, origin)?;
    let start = Place { origin, line: 1, column: 1 };
    let mut count: Option<usize> = None;
    let (mut inside, mut closed) = (false, false);
    let mut places = Vec::new();
    let mut budget = Budget::default();
    let mut at = start;
    for (n, line) in text.lines().enumerate() {
        at = Place { line: n as u64 + 1, ..start };
        let line = line.split("//").next().unwrap_or_default().trim();
        match line {
            "" => {}
            "{" if !inside && !closed => inside = true,
            "}" if inside => (inside, closed) = (false, true),
            _ if inside => {
                let cells: Vec<&str> = line.split([' ', '\t', ',']).filter(|c| !c.is_empty()).collect();
                let [x, y] = cells[..] else {
                    let what = format!("the line has {} values where 2 are needed", cells.len());
                    return Err(at.at_column(cells.len().max(1)).error(what, HELP));
                };
                let number = |column: usize, cell: &str| {
                    let what = || format!("{cell:?} is no coordinate");
                    coordinate(cell).ok_or_else(|| at.at_column(column).error(what(), "write pixels"))
                };
                places.push(Some([number(1, x)?, number(2, y)?, 0.0]));
                budget.channel(1, places.len(), at)?;
            }
            _ => {
                let (key, value) = line.split_once(':').unwrap_or((line, ""));
                match (key.trim().to_ascii_lowercase().as_str(), value.trim()) {
                    ("version", _) if !closed => {}
                    ("n_points", value) if !closed => {
                        let wrong =
                            || at.error(format!("n_points is {value:?}"), "write the number of points");
                        count = Some(value.parse().map_err(|_| wrong())?);
                    }
                    _ => return Err(at.error("the line is none of such a file", HELP)),
                }
            }
        }
    }
    let count = count.ok_or_else(|| start.error("n_points is missing", HELP))?;
    if !closed || count != places.len() {
        let what = match closed {
            true => format!("the file has {} points where n_points says {count}", places.len()),
            false => "the file is cut off: its points are not closed by `}`".to_owned(),
        };
        return Err(at.error(what, "export it anew"));
    }
    Ok(Recording {
        labels: Vec::new(),
        notes: Vec::new(),
        name: Recording::stem(origin),
        speaker: None,
        channels: (0..places.len()).map(|n| format!("tongue_{n}")).collect(),
        sigma: vec![None; places.len()],
        samples: vec![Sample::new(0.0, places)],
        metres: None,
        times: Times::Frames,
        format: Format::Pts,
    })
}
