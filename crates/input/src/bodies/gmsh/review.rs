//! Review of a body from a file: what the user should check before trusting it.

use std::fmt;

use super::{Bent, Content};
use crate::measured::muscles::Muscles;
use tongue_core::body::Mesh;
use tongue_core::suggest;

/// Plausible lengths of a tongue, from a child's to an adult's with all muscles outside it, m.
pub const TONGUE_M: std::ops::RangeInclusive<f64> = 0.02..=0.3;
/// Units that a file may be in by mistake, each with its factor to metres.
const MISTAKEN_M: [(&str, f64); 3] = [("millimetres", 1e-3), ("centimetres", 1e-2), (METRES, 1e3)];
const METRES: &str = "metres taken for millimetres";
/// Limit of thin triangles, degrees: springs of thinner ones cannot resist bending.
const THIN_DEG: f64 = 10.0;

/// A concern about a body.
#[derive(Debug, Clone, PartialEq)]
pub enum Concern {
    Size { extent_m: f64, unit: Option<&'static str> },
    NoBone,
    MissingMuscles { names: Vec<String> },
    Empty { dimension: usize, name: String },
    Unused { dimension: usize, name: String, meant: Option<String> },
    ThinCells { smallest_angle_deg: f64 },
    Bent(Bent),
}

impl fmt::Display for Concern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size { extent_m, unit } => {
                write!(
                    f,
                    "the body is {extent_m:.3} m across, and a tongue {} to {} m",
                    TONGUE_M.start(),
                    TONGUE_M.end()
                )?;
                match unit {
                    Some("millimetres") => write!(
                        f,
                        ": these look like millimetres; read them with --mesh-unit mm (in a scene: unit = \"mm\")"
                    ),
                    Some(METRES) => write!(f, ": these look like metres; read them without --mesh-unit mm"),
                    Some(unit) => {
                        write!(f, ": these look like {unit}; scale the model to metres or millimetres")
                    }
                    None => write!(f, "; is the unit right?"),
                }
            }
            Self::NoBone => write!(
                f,
                "no bone holds the body; add Physical Point(\"bone\") = {{...}} or Physical Curve(\"bone\") = {{...}}"
            ),
            Self::MissingMuscles { names } => write!(
                f,
                "no muscle {}: measured lengths of it have nothing to be compared with; add Physical Curve(\"{}\") = {{...}}",
                names.join(", "),
                names.first().map_or("GGa", String::as_str)
            ),
            Self::Empty { dimension, name } => write!(
                f,
                "the physical group \"{name}\" of {} has no elements; is it of a part that was not meshed?",
                entities(*dimension)
            ),
            Self::Unused { dimension, name, meant } => {
                let on = entities(*dimension);
                write!(f, "the physical group \"{name}\" of {on} is left out")?;
                match meant {
                    Some(meant) => write!(f, "; did you mean \"{meant}\"?"),
                    None if *dimension == 1 => write!(f, "; a muscle is called GGa, ... or muscle:NAME"),
                    None => Ok(()),
                }
            }
            Self::ThinCells { smallest_angle_deg } => write!(
                f,
                "the smallest angle is {smallest_angle_deg:.1}°; below {THIN_DEG}° the mesh is too stiff: \
                 move points apart or mesh finer"
            ),
            Self::Bent(Bent { sides, largest_m }) => write!(
                f,
                "sides that are curved in the file are taken as straight ({sides} of them, by up to {:.2} mm): mesh finer where that is \
                 too much",
                1e3 * largest_m
            ),
        }
    }
}

/// The geometric entity of this dimension.
fn entities(dimension: usize) -> &'static str {
    ["points", "curves", "surfaces", "volumes"].get(dimension).copied().unwrap_or("entities")
}

impl Concern {
    /// Whether nothing can be computed with the body.
    pub fn is_fatal(&self) -> bool {
        matches!(self, Self::NoBone)
    }

    /// Whether it is only a remark.
    pub fn is_remark(&self) -> bool {
        matches!(self, Self::Unused { meant: None, .. })
    }
}

/// The concern that a body does not have the size of a tongue.
pub fn unit_suspicion<const D: usize>(mesh: &Mesh<D>) -> Option<Concern> {
    let extent_m = mesh.extent();
    if TONGUE_M.contains(&extent_m) {
        return None;
    }
    let unit = MISTAKEN_M.iter().find(|(_, metres)| TONGUE_M.contains(&(extent_m * metres)));
    Some(Concern::Size { extent_m, unit: unit.map(|(name, _)| *name) })
}

/// All concerns. `smallest_angle_deg` is that of the cells, degrees (0 if there are none).
pub fn review<const D: usize>(content: &Content<D>, smallest_angle_deg: f64) -> Vec<Concern> {
    let bent = content.bent.map(Concern::Bent);
    let mut concerns: Vec<Concern> = unit_suspicion(&content.body.mesh).into_iter().chain(bent).collect();
    if content.body.mesh.fixed.is_empty() {
        concerns.push(Concern::NoBone);
    }
    let known = Muscles::built_in();
    let present = &content.body.mesh.muscles;
    let missing = |name: &&str| !present.iter().any(|chain| chain.name == **name);
    let all = known.all();
    let names: Vec<&str> = all.iter().map(|m| m.name.as_str()).filter(missing).collect();
    // A body with some of the published muscles is meant for the published lengths; one with none of them has
    // its own.
    let own = !present.is_empty() && names.len() == all.len();
    if D == 2 && !names.is_empty() && !own {
        concerns.push(Concern::MissingMuscles { names: names.iter().map(|n| (*n).to_owned()).collect() });
    }
    if smallest_angle_deg < THIN_DEG {
        concerns.push(Concern::ThinCells { smallest_angle_deg });
    }
    concerns.extend(content.unused.iter().map(|group| {
        if group.elements == 0 {
            return Concern::Empty { dimension: group.dimension, name: group.name.clone() };
        }
        let known: Vec<&str> = match group.dimension {
            0 => vec!["bone"],
            1 => names.iter().copied().chain(["bone"]).collect(),
            _ => vec!["tissue"],
        };
        let name = group.name.clone();
        let meant = suggest::nearest(&name, known).map(str::to_owned);
        Concern::Unused { dimension: group.dimension, name, meant }
    }));
    concerns
}
