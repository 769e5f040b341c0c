//! Landmarks and a resting contour: CSV or 3D Slicer's markups (`.mrk.json`).

use std::collections::BTreeMap;

use serde::Deserialize;

use tongue_core::geometry::Point;
use tongue_input::measured::lengths::Malformed;
use tongue_input::measured::recording::{Format, Map, MapError, Recording, Seen};

/// Points of one posture, in the frame of a body: m, x to the back of the head, y up.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Landmarks {
    /// Named points: bones, and whatever else.
    pub named: BTreeMap<String, Point>,
    /// Points along the surface, where there are any.
    pub contour: Vec<Point>,
}

/// Why landmarks cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LandmarkError {
    /// A table that is none.
    #[error(transparent)]
    Malformed(#[from] Malformed),
    /// What the table holds is not understood.
    #[error(transparent)]
    Map(#[from] MapError),
    /// Slicer's file is no markups.
    #[error("{origin}: {problem}")]
    Markups {
        /// The file.
        origin: String,
        /// What is wrong and what to do.
        problem: String,
    },
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
    #[serde(default)]
    coordinate_units: Option<serde_json::Value>,
    control_points: Vec<ControlPoint>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct ControlPoint {
    #[serde(default)]
    label: String,
    #[serde(default)]
    position: Option<[f64; 3]>,
    #[serde(default)]
    position_status: Option<String>,
}

/// Larger coordinates are none of a head, m.
const FARTHEST_M: f64 = 10.0;

impl Landmarks {
    /// Reads what a file holds: JSON is Slicer's, everything else a table as [`Recording`] reads it, of which the first frame counts.
    ///
    /// In Slicer's markups points are named by their labels; open and closed curves are contours. LPS: y leads to the back and z up.
    /// RAS, where a file says so: y leads to the front.
    ///
    /// # Errors
    /// [`LandmarkError`] with the place.
    pub fn from_bytes(bytes: &[u8], origin: &str, map: &Map) -> Result<Self, LandmarkError> {
        let first = bytes.iter().find(|b| !b.is_ascii_whitespace());
        if first == Some(&b'{') {
            return Self::from_markups(bytes, origin);
        }
        let recordings = Recording::from_bytes(bytes, origin, Some(Format::of(bytes, origin)))?;
        let Some(recording) = recordings.first() else { return Ok(Self::default()) };
        let mut out = Self::default();
        let seen = Seen::new(recording, map);
        // Landmarks alone are no recording, but they are landmarks.
        let (contour, mirrored) = match &seen {
            Ok(seen) => (seen.frames.first().map(|f| f.contour.clone()).unwrap_or_default(), seen.mirrored),
            Err(_) => (Vec::new(), false),
        };
        let metres = recording.metres.unwrap_or(1e-3);
        for (name, place) in recording.channels.iter().zip(recording.samples.iter().flat_map(|s| &s.places)) {
            if let Some([x, y, _]) = place {
                let x = if mirrored { -x } else { *x };
                out.named.insert(name.clone(), Point::new(x * metres, y * metres));
            }
        }
        out.contour = contour.into_iter().flatten().map(|m| m.at).collect();
        Ok(out)
    }

    fn from_markups(bytes: &[u8], origin: &str) -> Result<Self, LandmarkError> {
        let wrong = |problem: String| LandmarkError::Markups { origin: origin.to_owned(), problem };
        let file: Markups = serde_json::from_slice(bytes).map_err(|e| {
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
                    _ => drop(out.named.insert(point.label.clone(), at)),
                }
            }
        }
        Ok(out)
    }
}
