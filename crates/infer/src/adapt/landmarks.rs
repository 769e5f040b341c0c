//! Landmarks and a resting contour: CSV or 3D Slicer's markups (`.mrk.json`).

use std::collections::BTreeMap;

use serde::Deserialize;

use tongue_core::body::{Body, HYOID, MANDIBLE};
use tongue_core::geometry::Point;
use tongue_input::measured::ReadError;
use tongue_input::measured::recording::{
    AlignedRecording, Format, Map, Recording, STEEPEST_BONES_DEG, bone, disorder_of_contour, steep_deg,
};

/// Points of one posture, in the frame of a body: m, x to the back of the head, y up.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Landmarks {
    /// Named points: bones and others.
    pub named: BTreeMap<String, Point>,
    /// Points along the surface, if there are any.
    pub contour: Vec<Point>,
    /// Whether x was reversed, because the face looks to the right in the file.
    pub mirrored: bool,
}

#[derive(Deserialize)]
struct Markups {
    markups: Vec<Markup>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Markup {
    #[serde(rename = "type")]
    kind: String,
    #[serde(default)]
    coordinate_system: String,
    coordinate_units: Option<serde_json::Value>,
    control_points: Vec<ControlPoint>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct ControlPoint {
    #[serde(default)]
    label: String,
    position: Option<[f64; 3]>,
    position_status: Option<String>,
}

/// Possible diagonals of the box around a contour, mm. In recordings half of a contour has half of these limits.
const POSSIBLE_MM: std::ops::RangeInclusive<f64> = 20.0..=400.0;
/// Farthest that a contour ends below both bones, m.
const MOST_BELOW_M: f64 = 5e-3;
/// Coordinates of a head are smaller, m.
const FARTHEST_M: f64 = 10.0;

impl Landmarks {
    /// Reads a file: JSON as Slicer's markups, everything else as a [`Recording`], of which the first frame is used.
    ///
    /// Labels of markups are names of points; open and closed curves are contours. Coordinates are LPS (y to the back, z up), or RAS (y to
    /// the front) if the file says so.
    pub fn from_bytes(bytes: &[u8], origin: &str, map: &Map) -> Result<Self, ReadError> {
        let first = bytes.iter().find(|b| !b.is_ascii_whitespace());
        if first == Some(&b'{') {
            return Self::from_markups(bytes, origin);
        }
        let recordings = Recording::from_bytes(bytes, origin, Some(Format::of(bytes, origin)))?;
        let Some(recording) = recordings.first() else { return Ok(Self::default()) };
        let mut out = Self::default();
        match AlignedRecording::new(recording, map) {
            Ok(seen) => {
                out.mirrored = seen.mirrored;
                let frame = seen.frames.into_iter().next().unwrap_or_default();
                out.contour = frame.contour.iter().flatten().map(|m| m.at).collect();
                let bones = seen.bones.into_iter().zip(frame.bones);
                out.named.extend(bones.filter_map(|(name, at)| Some((name, at?))));
            }
            // Landmarks without a contour are no recording, but are used if their unit is known.
            Err(error) if recording.metres.is_none() => return Err(error),
            Err(_) => {}
        }
        let places = recording.samples.first().map(|s| s.places.as_slice()).unwrap_or_default();
        for (name, place) in recording.channels.iter().zip(places) {
            // Names are kept only where a known unit gives the points places in metres.
            if let (Some([x, y, _]), Some(metres)) = (place, recording.metres) {
                let x = if out.mirrored { -x } else { *x };
                out.named.entry(known_name(name)).or_insert(Point::new(x * metres, y * metres));
            }
        }
        // The face looks to the left if the mental spine lies before the hyoid.
        let bones = out.named.get(MANDIBLE).zip(out.named.get(HYOID));
        if bones.is_some_and(|(spine, hyoid)| spine.x > hyoid.x) {
            out.turn_round();
        }
        Ok(out)
    }

    fn turn_round(&mut self) {
        self.mirrored = !self.mirrored;
        self.named.values_mut().chain(&mut self.contour).for_each(|p| p.x = -p.x);
    }

    /// Adds the contour of the same posture from another file: its curve, or else all of its points, mirrored if it faces the other way.
    pub fn with_contour(mut self, mut drawn: Self) -> Self {
        if drawn.mirrored != self.mirrored {
            drawn.turn_round();
        }
        self.contour = if drawn.contour.is_empty() {
            let mut points: Vec<(String, Point)> = drawn.named.into_iter().collect();
            points.sort_by_key(|(name, _)| number(name));
            points.into_iter().map(|(_, at)| at).collect()
        } else {
            drawn.contour
        };
        self
    }

    /// A sentence about an impossible position of the landmarks and its remedy.
    pub fn doubt(&self) -> Option<String> {
        let bones = self.named.get(MANDIBLE).zip(self.named.get(HYOID));
        self.impossible_size()
            .or_else(|| bones.and_then(|(spine, hyoid)| self.doubt_of_bones(spine, hyoid)))
            .or_else(|| disorder_of_contour(&self.contour).map(str::to_owned))
    }

    fn impossible_size(&self) -> Option<String> {
        let corners =
            [Point::inf, Point::sup].map(|end| self.contour.iter().copied().reduce(|a, b| end(&a, &b)));
        let [Some(low), Some(high)] = corners else { return None };
        let extent_mm = 1e3 * (high - low).norm();
        (self.contour.len() >= 3 && !POSSIBLE_MM.contains(&extent_mm)).then(|| {
            let [least, most] = [POSSIBLE_MM.start(), POSSIBLE_MM.end()];
            format!("the contour spans {extent_mm:.2} mm, where {least} to {most} are possible; give it in millimetres")
        })
    }

    fn doubt_of_bones(&self, spine: &Point, hyoid: &Point) -> Option<String> {
        let count = self.contour.len() as f64;
        let height = self.contour.iter().map(|p| p.y).sum::<f64>() / count;
        if count > 0.0 && height < spine.y.min(hyoid.y) {
            return Some(
                "the contour lies below the hyoid and the mental spine, where no tongue is; give y upwards, and both in one frame"
                    .to_owned(),
            );
        }
        if self.root_is_at(spine, hyoid) {
            return Some(
                "the lower end of the contour, which is the root, lies by the mental spine, and the other one behind the hyoid: the names of \
                 these two are exchanged, or contour and bones are not in one frame"
                    .to_owned(),
            );
        }
        let ends = self.contour.first().zip(self.contour.last());
        // The root lies behind the hyoid and not below it, even if only the rear part of the contour, which is as steep, was drawn.
        let lowest = spine.y.min(hyoid.y) - MOST_BELOW_M;
        let is_exchanged = |(a, b): (&Point, &Point)| {
            let (low, high) = if a.y < b.y { (a, b) } else { (b, a) };
            steep_deg(high - low) > STEEPEST_BONES_DEG && high.x < low.x && low.x < hyoid.x && low.y < lowest
        };
        ends.is_some_and(is_exchanged).then(|| {
            "the lower end of the contour lies before the hyoid and below it, and the other one above: x and y of the contour seem to be \
             exchanged; give x to the back and y upwards"
                .to_owned()
        })
    }

    /// Whether the lower end of the contour is much nearer to `bone` than the bones are to each other, and the higher end lies behind the
    /// bone at the root. The lower end of a contour without a root, as in ultrasound, may be the tip, which is far from both.
    fn root_is_at(&self, bone: &Point, at_root: &Point) -> bool {
        let (Some(first), Some(last)) = (self.contour.first(), self.contour.last()) else { return false };
        let (lower, higher) = if first.y < last.y { (first, last) } else { (last, first) };
        2.0 * (lower - bone).norm() < (bone - at_root).norm() && higher.x > at_root.x
    }

    /// Names of landmarks that are neither bones of the body nor points of the contour.
    pub fn unused(&self, body: &Body<2>) -> Vec<&str> {
        let is_contour = |n: &str| n.strip_prefix("tongue_").is_some_and(|n| n.parse::<u32>().is_ok());
        let names = self.named.keys().map(String::as_str);
        names
            .filter(|n| !is_contour(n) && ![MANDIBLE, HYOID].contains(n) && body.bone(n).is_empty())
            .collect()
    }

    fn from_markups(bytes: &[u8], origin: &str) -> Result<Self, ReadError> {
        let wrong = |problem: String| ReadError::Refused(format!("{origin}: {problem}"));
        let file: Markups = serde_json::from_slice(bytes).map_err(|e| {
            let e = tongue_core::toml_text::reworded(&e.to_string());
            wrong(format!("not as 3D Slicer writes markups: {e}; save the node as .mrk.json"))
        })?;
        let mut out = Self::default();
        for markup in file.markups {
            let front = match markup.coordinate_system.as_str() {
                "LPS" | "" | "0" => 1.0,
                "RAS" | "1" => -1.0,
                other => {
                    return Err(wrong(format!("the coordinate system is {other:?}; save it in LPS or RAS")));
                }
            };
            let unit = match markup.coordinate_units.as_ref().and_then(|u| u.as_str()) {
                None | Some("mm") => 1e-3,
                Some(other) => return Err(wrong(format!("the unit is {other:?}; save it in mm"))),
            };
            for (n, point) in markup.control_points.iter().enumerate() {
                if point.position_status.as_deref().is_some_and(|s| s != "defined") {
                    continue;
                }
                let Some([_, back, up]) = point.position else { continue };
                let at = Point::new(front * back, up) * unit;
                if !at.iter().all(|v| v.is_finite() && v.abs() <= FARTHEST_M) {
                    return Err(wrong(format!(
                        "control point {} lies {at:?} m away; give millimetres",
                        n + 1
                    )));
                }
                match markup.kind.as_str() {
                    "Curve" | "ClosedCurve" | "Line" => out.contour.push(at),
                    _ => drop(out.named.insert(known_name(&point.label), at)),
                }
            }
        }
        Ok(out)
    }
}

/// The name that a bone has in bodies, or else the name as it is.
fn known_name(name: &str) -> String {
    bone(name).unwrap_or(name).to_owned()
}

/// The number at the end of a name, so that p10 follows p9.
fn number(name: &str) -> u64 {
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    name.get(stem..).and_then(|digits| digits.parse().ok()).unwrap_or(0)
}
