//! Places of nodes of a body in space, over time where there are several frames: a CSV table.

use std::collections::BTreeSet;
use std::path::Path;

use nalgebra::Vector3;

use super::TableError;
use crate::files;

/// The columns that a table must have.
const COLUMNS: [&str; 4] = ["node", "x_mm", "y_mm", "z_mm"];

/// Where a node was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenNode {
    /// Its number in the body.
    pub node: usize,
    /// Its place, m.
    pub place: Vector3<f64>,
    /// Standard deviation of each coordinate, m.
    pub sd_m: f64,
}

/// Places of nodes at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeFrame {
    /// The time, s, where the table has times.
    pub time_s: Option<f64>,
    /// Where its nodes were seen.
    pub seen: Vec<SeenNode>,
}

/// Reads a comma-separated table with the columns `node` (from 1, in the order of the body's nodes),
/// `x_mm`, `y_mm`, `z_mm` in the frame of the body, and if wanted `sd_mm` (`usual_sd_m` where it is
/// missing) and `time_s`, by which rows form frames.
///
/// # Errors
/// [`TableError`], with the line.
pub fn read_nodes(path: &Path, usual_sd_m: f64) -> Result<Vec<NodeFrame>, TableError> {
    let origin = path.display().to_string();
    let bytes = files::read(path).map_err(|e| {
        let columns = COLUMNS.join(",");
        let problem = format!("cannot be read: {e}; name a CSV table with the columns {columns}");
        TableError::malformed(&origin, None, problem)
    })?;
    nodes_from(&bytes, &origin, usual_sd_m)
}

/// As [`read_nodes`], from the bytes of a file; `origin` is its name in messages.
pub fn nodes_from(bytes: &[u8], origin: &str, usual_sd_m: f64) -> Result<Vec<NodeFrame>, TableError> {
    let whole = |problem: String| TableError::malformed(origin, None, problem);
    let text = String::from_utf8_lossy(bytes);
    let wrong = |line: u64, problem: String| TableError::malformed(origin, Some(line), problem);
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
    let broken =
        |e: csv::Error| wrong(e.position().map_or(1, csv::Position::line), format!("is no table: {e}"));
    let header = reader.headers().map_err(broken)?.clone();
    let column = |name: &str| header.iter().position(|h| h == name);
    if let Some(missing) = COLUMNS.iter().find(|c| column(c).is_none()) {
        return Err(wrong(
            1,
            format!("has no column {missing}; a body in space is met at nodes: {}", COLUMNS.join(",")),
        ));
    }
    let mut frames: Vec<NodeFrame> = Vec::new();
    let mut of_frame: BTreeSet<usize> = BTreeSet::new();
    for record in reader.records() {
        let record = record.map_err(broken)?;
        let line = record.position().map_or(1, csv::Position::line);
        let number = |name: &str| -> Result<Option<f64>, TableError> {
            let Some(text) = column(name).and_then(|c| record.get(c)) else { return Ok(None) };
            let value = text.parse::<f64>().ok().filter(|v| v.is_finite());
            value.map(Some).ok_or_else(|| wrong(line, format!("{name} is \"{text}\"; give a finite number")))
        };
        let needed = |name: &str| number(name).map(Option::unwrap_or_default);
        let node = needed("node")?;
        if node < 1.0 || node.fract() != 0.0 {
            return Err(wrong(line, format!("node is {node}; nodes are numbered from 1")));
        }
        let sd_m = number("sd_mm")?.map_or(usual_sd_m, |sd| 1e-3 * sd);
        if sd_m <= 0.0 {
            return Err(wrong(line, "sd_mm must be positive".to_owned()));
        }
        let time_s = number("time_s")?;
        let place = Vector3::new(needed("x_mm")?, needed("y_mm")?, needed("z_mm")?) * 1e-3;
        let one = SeenNode { node: node as usize - 1, place, sd_m };
        let is_earlier = frames.last().is_some_and(|f| f.time_s > time_s);
        match frames.last_mut().filter(|f| f.time_s == time_s) {
            Some(_) if !of_frame.insert(one.node) => {
                return Err(wrong(line, format!("node {node} comes twice in a frame; give it once")));
            }
            Some(frame) => frame.seen.push(one),
            None if is_earlier => {
                let problem = "its time comes before that of the rows above; sort them by time_s";
                return Err(wrong(line, problem.to_owned()));
            }
            None => {
                of_frame = BTreeSet::from([one.node]);
                frames.push(NodeFrame { time_s, seen: vec![one] });
            }
        }
    }
    match frames.is_empty() {
        true => Err(whole("has no row below its header; give at least one node".to_owned())),
        false => Ok(frames),
    }
}
