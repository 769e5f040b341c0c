//! The anatomy of a tongue, from which a mesh is made: its outline, its muscle lines, and its points on bone. It is read from TOML in
//! millimetres and held in metres.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use crate::body::BodyError;
use crate::geometry::ClosedSpline;
use crate::geometry::plane::{self, Point};
use crate::toml_text::{Exactly, line_and_column, reworded};

pub const REFERENCE: &str = include_str!("../../../../../targets/anatomy.toml");

/// Points nearer to each other than this are one point, m. Files are written to 1 µm or 10 µm.
pub(crate) const SAME_POINT_M: f64 = 5e-5;
/// Points nearer to the outline than this are on it, m. The published lengths are known to 0.1 mm at best.
pub(crate) const ON_OUTLINE_M: f64 = 5e-4;

/// An outline, muscle lines and bones that are consistent with each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Anatomy {
    outline: ClosedSpline,
    muscles: Vec<MuscleLine>,
    bones: Vec<AnatomyBone>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct MuscleLine {
    pub name: String,
    /// First and second end, m.
    pub ends: [Point; 2],
    pub outside: Option<OutsidePart>,
}

/// The part of a muscle line from an end outside the tissue to where the line enters it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutsidePart {
    /// The end outside the tissue: 0 for the first, 1 for the second.
    pub end: usize,
    /// Where the line enters the tissue, on the outline, m.
    pub entry: Point,
}

/// A bone as points, at which nodes are held.
#[derive(Debug, Clone, PartialEq)]
pub struct AnatomyBone {
    pub name: String,
    /// Ends of muscles or points of the outline, m.
    pub points: Vec<Point>,
}

/// A point `[x, y]`, mm.
type GivenPoint = Spanned<Exactly<f64, 2>>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AnatomyFile {
    outline: Spanned<Vec<GivenPoint>>,
    muscles: Spanned<BTreeMap<String, Spanned<Exactly<Exactly<f64, 2>, 2>>>>,
    bones: BTreeMap<String, Vec<GivenPoint>>,
}

/// A value, or a problem with its range of bytes in the text.
type ParsedText<T> = Result<T, (Range<usize>, String)>;

impl Anatomy {
    /// The reference anatomy (`targets/anatomy.toml`), which meets the published aggregate numbers.
    pub fn reference() -> Result<Self, BodyError> {
        Self::from_toml(REFERENCE, "targets/anatomy.toml (embedded)")
    }

    /// Reads an anatomy in the format of `targets/anatomy.toml`, in millimetres. `origin` is its name in messages, usually the path.
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, BodyError> {
        let parsed = toml::from_str::<AnatomyFile>(text).map_err(|e| {
            let hint = "an anatomy has `outline`, `[muscles]` with the two ends of a straight line each, and `[bones]`; points are [x, y]";
            (e.span().unwrap_or(0..0), format!("{} ({hint})", reworded(e.message())))
        });
        parsed.and_then(|file| Self::checked(&file)).map_err(|(span, problem)| {
            let (line, column) = line_and_column(text, span.start);
            BodyError(format!("{origin}:{line}:{column}: {problem}"))
        })
    }

    fn checked(file: &AnatomyFile) -> ParsedText<Self> {
        let outline = outline(&file.outline)?;
        let bones = file.bones.iter().map(|(name, points)| {
            let points = points.iter().map(metres).collect::<ParsedText<_>>()?;
            Ok(AnatomyBone { name: name.clone(), points })
        });
        let bones = bones.collect::<ParsedText<Vec<_>>>()?;
        // Muscles have the order of the file.
        let mut given: Vec<_> = file.muscles.get_ref().iter().collect();
        given.sort_by_key(|(_, line)| line.span().start);
        if given.is_empty() {
            let message =
                "there is no muscle; give the two ends of each as `GGa = [[x, y], [x, y]]` in millimetres";
            return Err((file.muscles.span(), message.to_owned()));
        }
        let mut muscles = Vec::with_capacity(given.len());
        for (name, line) in given {
            if let Some(other) = muscles.iter().find(|m: &&MuscleLine| m.name.eq_ignore_ascii_case(name)) {
                let message = "differ only by upper and lower case; rename or remove one";
                return Err((line.span(), format!("the muscles {} and {name} {message}", other.name)));
            }
            muscles.push(muscle_line(name, line, &outline, &bones).map_err(|p| (line.span(), p))?);
        }
        for (name, given) in &file.bones {
            for spanned in given {
                check_bone_point(name, metres(spanned)?, &outline, &muscles)
                    .map_err(|p| (spanned.span(), p))?;
            }
        }
        Ok(Self { outline, muscles, bones })
    }

    pub fn outline(&self) -> &ClosedSpline {
        &self.outline
    }

    /// The muscle lines, m, in the order of the file.
    pub fn muscles(&self) -> &[MuscleLine] {
        &self.muscles
    }

    pub fn bones(&self) -> &[AnatomyBone] {
        &self.bones
    }
}

fn metres(point: &GivenPoint) -> ParsedText<Point> {
    finite(point.get_ref().0).map_err(|p| (point.span(), p))
}

fn finite([x_mm, y_mm]: [f64; 2]) -> Result<Point, String> {
    let point = Point::new(x_mm * 1e-3, y_mm * 1e-3);
    if x_mm.is_finite() && y_mm.is_finite() {
        Ok(point)
    } else {
        Err(format!("the point [{x_mm}, {y_mm}] is not finite; give two numbers in millimetres"))
    }
}

fn outline(given: &Spanned<Vec<GivenPoint>>) -> ParsedText<ClosedSpline> {
    let count = given.get_ref().len();
    if count < 4 {
        return Err((given.span(), format!("the outline has {count} points; give at least four")));
    }
    let points = given.get_ref().iter().map(metres).collect::<ParsedText<Vec<_>>>()?;
    for ((a, b), spanned) in plane::edges(&points).zip(given.get_ref().iter().cycle().skip(1)) {
        if (b - a).norm() < SAME_POINT_M {
            let message = "this point of the outline repeats the one before it; remove one (the outline closes by itself)";
            return Err((spanned.span(), message.to_owned()));
        }
    }
    let crossed = "the outline crosses itself; list its points in order once around the tongue";
    let crossed = || (given.span(), crossed.to_owned());
    let curve = ClosedSpline::through(points).ok_or_else(crossed)?;
    // A coarser polygon is enough, since the test compares every edge with every other.
    let coarse: Vec<Point> = curve.polygon.iter().step_by(4).copied().collect();
    if plane::crosses_itself(&coarse) { Err(crossed()) } else { Ok(curve) }
}

fn muscle_line(
    name: &str,
    given: &Spanned<Exactly<Exactly<f64, 2>, 2>>,
    outline: &ClosedSpline,
    bones: &[AnatomyBone],
) -> Result<MuscleLine, String> {
    if name.trim().is_empty() || name.contains(char::is_control) {
        let message = "is empty or has characters that cannot be printed; rename it";
        return Err(format!("the muscle name {name:?} {message}"));
    }
    let [first, second] = given.get_ref().0.map(|point| point.0);
    let ends = [finite(first)?, finite(second)?];
    let length = (ends[1] - ends[0]).norm();
    if length < SAME_POINT_M {
        return Err(format!("the two ends of {name} are the same point"));
    }
    let on_outline = ends.map(|end| outline.nearest(end).1 < ON_OUTLINE_M);
    let outside = [0, 1].map(|i| !on_outline[i] && !plane::encloses(&outline.polygon, ends[i]));
    // An end on the outline may be slightly to either side of it; a crossing near it is that end.
    let margin = on_outline.map(|on| if on { 2.0 * ON_OUTLINE_M / length } else { 0.0 });
    let mut meets = outline.crossings(ends);
    meets.retain(|t| (margin[0]..=1.0 - margin[1]).contains(t));
    let at = |t: f64| ends[0] + (ends[1] - ends[0]) * t;
    let line = |outside| MuscleLine { name: name.to_owned(), ends, outside };
    let leaves =
        "leaves the tissue between its ends; a line may be outside only from one end to where it enters";
    let leaves = format!("{name} {leaves}");
    let end = match outside {
        [true, true] => {
            let message = "both of its ends are outside the outline; move one of them inside";
            return Err(format!("{name} does not reach the tissue: {message}"));
        }
        [false, false] => {
            let inside = meets.is_empty() && plane::encloses(&outline.polygon, at(0.5));
            return if inside { Ok(line(None)) } else { Err(leaves) };
        }
        [true, false] => 0,
        [false, true] => 1,
    };
    let entry = match *meets {
        [t] => at(t),
        [] => ends[1 - end],
        _ => return Err(leaves),
    };
    let held = bones.iter().flat_map(|b| &b.points).any(|p| (p - ends[end]).norm() < SAME_POINT_M);
    if !held {
        let [x, y] = if end == 0 { first } else { second };
        let message = "is outside the tissue and on no bone; add it to a bone";
        return Err(format!("the end [{x}, {y}] of {name} {message}"));
    }
    Ok(line(Some(OutsidePart { end, entry })))
}

fn check_bone_point(
    bone: &str,
    point: Point,
    outline: &ClosedSpline,
    muscles: &[MuscleLine],
) -> Result<(), String> {
    let from_end =
        muscles.iter().flat_map(|m| m.ends).map(|e| (e - point).norm()).fold(f64::INFINITY, f64::min);
    let from_outline = outline.nearest(point).1;
    if from_end < SAME_POINT_M || from_outline < ON_OUTLINE_M {
        return Ok(());
    }
    let away_mm = from_end.min(from_outline) * 1e3;
    let (x, y) = (point.x * 1e3, point.y * 1e3);
    Err(format!(
        "the point [{x}, {y}] of bone \"{bone}\" is {away_mm:.2} mm from the nearest muscle end or outline; \
         a bone holds ends of muscles or points of the outline"
    ))
}
