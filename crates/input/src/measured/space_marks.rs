//! Tables (CSV) of places and lengths that were measured of a body in space, in one frame or several over time.
//!
//! The columns say what the rows are (a table in `docs/space.md`). Any table may have a column `sd_mm`, and a column `time_s`: rows of one
//! time form a frame.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use csv::StringRecord;
use nalgebra::{Vector2, Vector3};

use super::error::{Malformed, ReadError};
use super::lengths::number::with_point;
use super::table::{TableLine, TableLines};
use tongue_core::body::space::Side;
use tongue_core::limits::COORDINATE_MM;

use crate::bodies::group_and_side;
use crate::files;

/// A measurement in the frame of the body: x to the back, y to the right, z upwards.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceMark {
    pub what: Marked,
    /// Standard deviation of each coordinate, of the distance or of the length, also where its stretch or ratio is given, m.
    pub sd_m: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Marked {
    /// Position of a node, m.
    Node { node: usize, place: Vector3<f64> },
    /// Position of a point somewhere on the surface, m.
    Surface(Vector3<f64>),
    /// Position of a point somewhere on the midsagittal contour: x and z, m.
    Contour(Vector2<f64>),
    /// Position of a point that is fixed to the midsagittal surface, at a distance behind the tip along it at rest: x and z, m.
    Coil { behind_tip_m: f64, place: Vector2<f64> },
    /// The length of a muscle; of both sides if the name has none.
    Muscle { muscle: String, measure: LengthMeasure },
}

#[derive(Debug, Clone, PartialEq)]
pub enum LengthMeasure {
    Length(f64),
    Stretch(f64),
    /// The length over that of the named muscle in the same shape, or else over that of the anterior genioglossus.
    Ratio(f64, Option<String>),
}

impl SpaceMark {
    pub fn node(node: usize, place: Vector3<f64>, sd_m: f64) -> Self {
        Self { what: Marked::Node { node, place }, sd_m }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct SpaceFrame {
    pub time_s: Option<f64>,
    pub marks: Vec<SpaceMark>,
}

/// Adds the name of a mark to those of its frame. A node, a muscle, a coil or a place of a point may have one mark in a frame, and both
/// sides of a muscle have none beside one side.
fn add_name(names: &mut BTreeSet<(usize, String)>, frame: usize, mark: &SpaceMark) -> Result<(), String> {
    // In millimetres without the error of the conversion to metres; adding 0 turns -0 into 0.
    let mm = |m: &f64| (1e9 * m).round() / 1e6 + 0.0;
    let at = |place: &[f64]| format!("{:?} mm", Vec::from_iter(place.iter().map(mm)));
    let name = match &mark.what {
        Marked::Node { node, .. } => format!("node {}", node + 1),
        Marked::Muscle { muscle, .. } => format!("muscle {muscle}"),
        Marked::Coil { behind_tip_m, .. } => format!("the coil with surface_mm {}", mm(behind_tip_m)),
        Marked::Contour(place) => format!("the point of the contour at {}", at(place.as_slice())),
        Marked::Surface(place) => format!("the point of the surface at {}", at(place.as_slice())),
    };
    let overlapping = match &mark.what {
        Marked::Muscle { muscle, .. } => match group_and_side(muscle) {
            (name, Side::Middle) => ["L", "R"].map(|side| format!("muscle {name}_{side}")).to_vec(),
            (group, _) => vec![format!("muscle {group}")],
        },
        _ => Vec::new(),
    };
    if let Some(other) = overlapping.into_iter().find(|other| names.contains(&(frame, other.clone()))) {
        return Err(format!(
            "{other} and {name} are in one frame, so one length counts twice; give one of them"
        ));
    }
    let twice = format!("{name} comes twice in a frame; give it once");
    if names.insert((frame, name)) { Ok(()) } else { Err(twice) }
}

/// Reads tables as one recording, in which frames of the same time are joined. `usual_sd_m` is the standard deviation where a table gives
/// none.
pub fn read_space_marks(paths: &[impl AsRef<Path>], usual_sd_m: f64) -> Result<Vec<SpaceFrame>, ReadError> {
    let (mut all, mut names) = (Vec::<SpaceFrame>::new(), BTreeSet::new());
    let mut by_time: BTreeMap<Option<u64>, usize> = BTreeMap::new();
    for path in paths {
        let origin = path.as_ref().display().to_string();
        let wrong = |problem: String| ReadError::Refused(format!("{origin}: {problem}"));
        let bytes = files::read(path.as_ref()).map_err(|e| {
            let columns = NODE.join(",");
            wrong(format!("cannot be read: {e}; name a CSV table, such as one with the columns {columns}"))
        })?;
        let frames = space_marks_from(&bytes, &origin, usual_sd_m)?;
        if all.iter().chain(&frames).map(|f| f.time_s.is_some()).collect::<BTreeSet<_>>().len() > 1 {
            let problem = "give time_s in all tables of a recording or in none of them";
            return Err(wrong(problem.to_owned()));
        }
        for SpaceFrame { time_s, marks } in frames {
            // Adding 0 turns -0 into 0.
            let same = *by_time.entry(time_s.map(|time_s| (time_s + 0.0).to_bits())).or_insert(all.len());
            if same == all.len() {
                all.push(SpaceFrame { time_s, marks: Vec::new() });
            }
            marks.iter().try_for_each(|mark| add_name(&mut names, same, mark)).map_err(wrong)?;
            all[same].marks.extend(marks);
        }
    }
    all.sort_by(|a, b| a.time_s.partial_cmp(&b.time_s).unwrap_or(std::cmp::Ordering::Equal));
    Ok(all)
}

/// Whether a file is such a table and not a recording in the plane, by its columns.
pub fn is_space_table(path: &Path) -> std::io::Result<bool> {
    // Recordings with the columns x_mm and y_mm have a column point.
    Ok(lines(&files::read(path)?, "").is_ok_and(|table| {
        let h = &table.header.cells;
        let is_recording = h.iter().any(|name| name.eq_ignore_ascii_case("point"));
        let any = ["node", "muscle", "x_mm", "z_mm"].into_iter().any(|name| has(h, name));
        any && !is_recording
    }))
}

fn has(header: &StringRecord, name: &str) -> bool {
    header.iter().any(|h| h == name)
}

fn lines<'a>(bytes: &[u8], origin: &'a str) -> Result<TableLines<'a>, Malformed> {
    let known = [NODE, COIL, &["time_s", "sd_mm", "over", "point"]].into_iter().chain(MUSCLE);
    let mut table =
        TableLines::read(bytes, origin, &NODE.join(","), |name| known.clone().any(|k| k.contains(&name)))?;
    table.find_decimal_mark(0..table.header.cells.len());
    Ok(table)
}

/// Columns that a table must have.
type MarkColumns = [&'static str];
const NODE: &MarkColumns = &["node", "x_mm", "y_mm", "z_mm"];
const SURFACE: &MarkColumns = &["x_mm", "y_mm", "z_mm"];
const CONTOUR: &MarkColumns = &["x_mm", "z_mm"];
const COIL: &MarkColumns = &["surface_mm", "x_mm", "z_mm"];
const MUSCLE: [&MarkColumns; 3] = [&["muscle", "length_mm"], &["muscle", "stretch"], &["muscle", "ratio"]];

fn kind(header: &StringRecord) -> Result<&'static MarkColumns, String> {
    let has = |name: &str| has(header, name);
    let measured: Vec<_> = MUSCLE.into_iter().filter(|columns| has(columns[1])).collect();
    let kind = match &measured[..] {
        [_, _, ..] => {
            let names: Vec<&str> = measured.iter().map(|columns| columns[1]).collect();
            return Err(format!("has the columns {}; give one of them in a table", names.join(" and ")));
        }
        _ if has("node") => NODE,
        [measured] => *measured,
        [] if has("muscle") => MUSCLE[0],
        [] if has("surface_mm") => COIL,
        [] if has("x_mm") && has("z_mm") && !has("y_mm") => CONTOUR,
        [] if has("x_mm") || has("y_mm") || has("z_mm") => SURFACE,
        [] => NODE,
    };
    kind.iter().find(|c| !has(c)).map_or(Ok(kind), |missing| {
        Err(format!(
            "has no column {missing}; a table of a body in space has one of these headers: {}",
            [NODE, SURFACE, CONTOUR, COIL, MUSCLE[0]].map(|kind| kind.join(",")).join("; ")
        ))
    })
}

struct MarkRow<'a> {
    table: &'a TableLines<'a>,
    line: &'a TableLine<'a>,
}

impl MarkRow<'_> {
    fn text(&self, name: &str) -> Option<&str> {
        Some(self.line.cell(self.table.header.cells.iter().position(|h| h == name)?))
    }

    fn number(&self, name: &str) -> Result<Option<f64>, String> {
        let Some(text) = self.text(name) else { return Ok(None) };
        let value = with_point(text, self.table.mark).and_then(|text| text.parse().ok());
        let value = value.filter(|v: &f64| v.is_finite());
        value.map(Some).ok_or_else(|| format!("{name} is \"{text}\"; give a finite number, such as 1.5"))
    }

    /// The number in a column that the table is known to have.
    fn needed(&self, name: &str) -> Result<f64, String> {
        Ok(self.number(name)?.unwrap_or_default())
    }

    fn mark(&self, kind: &MarkColumns, usual_sd_m: f64) -> Result<SpaceMark, String> {
        let mm = |name: &str| {
            let value = 1e-3 * self.needed(name)?;
            COORDINATE_MM.check(1e3 * value).map_err(|beyond| format!("{name}: {beyond}"))?;
            Ok::<f64, String>(value)
        };
        let in_plane = || Ok::<_, String>(Vector2::new(mm("x_mm")?, mm("z_mm")?));
        let in_space = || Ok::<_, String>(Vector3::new(mm("x_mm")?, mm("y_mm")?, mm("z_mm")?));
        let what = match kind {
            ["node", ..] => match self.needed("node")? {
                node if node < 1.0 || node.fract() != 0.0 => {
                    return Err(format!("node is {node}; nodes are numbered from 1"));
                }
                node => Marked::Node { node: node as usize - 1, place: in_space()? },
            },
            ["surface_mm", ..] => match mm("surface_mm")? {
                behind if behind < 0.0 => {
                    return Err("surface_mm is negative; it is the distance behind the tip".to_owned());
                }
                behind_tip_m => Marked::Coil { behind_tip_m, place: in_plane()? },
            },
            ["muscle", measure] => {
                let value = self.needed(measure)?;
                if value <= 0.0 {
                    return Err(format!("{measure} must be positive"));
                }
                let over = self.text("over").filter(|o| !o.is_empty()).map(str::to_owned);
                let measure = match *measure {
                    "stretch" => LengthMeasure::Stretch(value),
                    "ratio" => LengthMeasure::Ratio(value, over),
                    _ => LengthMeasure::Length(1e-3 * value),
                };
                Marked::Muscle { muscle: self.text("muscle").unwrap_or_default().to_owned(), measure }
            }
            ["x_mm", "z_mm"] => Marked::Contour(in_plane()?),
            _ => Marked::Surface(in_space()?),
        };
        match self.number("sd_mm")?.map_or(usual_sd_m, |sd| 1e-3 * sd) {
            sd_m if sd_m <= 0.0 => Err("sd_mm must be positive".to_owned()),
            sd_m => Ok(SpaceMark { what, sd_m }),
        }
    }
}

/// Reads one table; `origin` is its name in messages.
pub fn space_marks_from(bytes: &[u8], origin: &str, usual_sd_m: f64) -> Result<Vec<SpaceFrame>, ReadError> {
    let wrong = |line: u64, problem: String| ReadError::Refused(format!("{origin}, line {line}: {problem}"));
    let table = lines(bytes, origin)?;
    let kind = kind(&table.header.cells).map_err(|problem| wrong(table.header.at.line, problem))?;
    let (mut frames, mut names) = (Vec::<SpaceFrame>::new(), BTreeSet::new());
    for line in &table.rows {
        table.check_shape(line)?;
        let wrong = |problem: String| wrong(line.at.line, problem);
        let row = MarkRow { table: &table, line };
        let mark = row.mark(kind, usual_sd_m).map_err(wrong)?;
        let time_s = row.number("time_s").map_err(wrong)?;
        if frames.last().is_some_and(|last| last.time_s > time_s) {
            let problem = "its time comes before that of the rows above; sort them by time_s";
            return Err(wrong(problem.to_owned()));
        }
        if frames.last().is_none_or(|last| last.time_s != time_s) {
            frames.push(SpaceFrame { time_s, marks: Vec::new() });
        }
        add_name(&mut names, frames.len(), &mark).map_err(wrong)?;
        if let Some(last) = frames.last_mut() {
            last.marks.push(mark);
        }
    }
    if frames.is_empty() {
        let problem = format!("{origin}: has no row below its header; give at least one");
        return Err(ReadError::Refused(problem));
    }
    Ok(frames)
}
