//! What a user should look at in a body that was read from a file.

use std::fmt;
use std::ops::RangeInclusive;

use crate::measured::muscles::Muscles;
use tongue_core::body::Mesh;
use tongue_core::geometry::simplex;

/// Plausible lengths of a tongue, from a child's to an adult's with all muscles outside it, m.
pub const TONGUE_M: RangeInclusive<f64> = 0.02..=0.3;
/// Units that a file may be in by mistake, each with its factor to metres.
const MISTAKEN_M: [(&str, f64); 3] = [("millimetres", 1e-3), ("centimetres", 1e-2), (METRES, 1e3)];
const METRES: &str = "metres taken for millimetres";
/// Limit of thin triangles, degrees: springs of thinner ones cannot resist bending.
const THIN_DEG: f64 = 10.0;
/// A part outside the tissue that is longer than the straight line by more than this part is bent.
const BENT: f64 = 1e-6;

#[derive(Debug, Clone, PartialEq)]
pub enum Concern {
    /// It does not have the size of a tongue, perhaps because of the unit.
    Size {
        extent_m: f64,
        unit: Option<&'static str>,
    },
    /// Some of the published muscles are missing.
    MissingMuscles {
        names: Vec<String>,
    },
    ThinCells {
        smallest_angle_deg: f64,
    },
    /// Sides that are curved in the file are taken as straight.
    BentSides {
        sides: usize,
        largest_m: f64,
    },
    /// A part of a muscle outside the tissue that bends in the file is taken as straight.
    BentMuscle {
        muscle: String,
        longer_m: f64,
    },
}

impl fmt::Display for Concern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size { extent_m, unit } => {
                let (least, most) = (TONGUE_M.start(), TONGUE_M.end());
                let advice = match unit {
                    Some("millimetres") => {
                        ": these look like millimetres; read them with --mesh-unit mm (in a scene: unit = \"mm\")".to_owned()
                    }
                    Some(METRES) => ": these look like metres; read them without --mesh-unit mm".to_owned(),
                    Some(unit) => format!(": these look like {unit}; scale the model to metres or millimetres"),
                    None => "; is the unit right?".to_owned(),
                };
                write!(f, "the body is {extent_m:.3} m across, and a tongue {least} to {most} m{advice}")
            }
            Self::MissingMuscles { names } => write!(
                f,
                "no muscle {}: measured lengths of it have nothing to be compared with; add Physical Curve(\"{}\") = {{...}}",
                names.join(", "),
                names.first().map_or("GGa", String::as_str)
            ),
            Self::ThinCells { smallest_angle_deg } => write!(
                f,
                "the smallest angle is {smallest_angle_deg:.1}°; below {THIN_DEG}° the mesh is too stiff: move points apart or mesh finer"
            ),
            Self::BentSides { sides, largest_m } => write!(
                f,
                "sides that are curved in the file are taken as straight ({sides} of them, by up to {:.2} mm): mesh finer where that is \
                 too much",
                1e3 * largest_m
            ),
            Self::BentMuscle { muscle, longer_m } => write!(
                f,
                "{muscle} bends outside the tissue; that part is taken as one straight line, which is {:.2} mm shorter",
                1e3 * longer_m
            ),
        }
    }
}

pub(in crate::bodies) fn review<const D: usize>(mesh: &Mesh<D>) -> Vec<Concern> {
    let mut concerns = Vec::new();
    let extent_m = mesh.extent();
    if !TONGUE_M.contains(&extent_m) {
        let unit = MISTAKEN_M.iter().find(|(_, metres)| TONGUE_M.contains(&(extent_m * metres)));
        concerns.push(Concern::Size { extent_m, unit: unit.map(|(name, _)| *name) });
    }
    let known = Muscles::built_in();
    let mut names: Vec<String> = known.all().iter().map(|m| m.name.clone()).collect();
    names.retain(|name| mesh.muscles.iter().all(|chain| chain.name != *name));
    // A body with some of the published muscles is meant for the published lengths; one with none of them has
    // its own.
    let own = !mesh.muscles.is_empty() && names.len() == known.all().len();
    if D == 2 && !names.is_empty() && !own {
        concerns.push(Concern::MissingMuscles { names });
    }
    let smallest_angle_deg = smallest_angle_deg(mesh);
    if smallest_angle_deg < THIN_DEG {
        concerns.push(Concern::ThinCells { smallest_angle_deg });
    }
    concerns.extend(bent_muscles(mesh));
    concerns
}

/// The smallest angle between two sides of any cell, degrees.
fn smallest_angle_deg<const D: usize>(mesh: &Mesh<D>) -> f64 {
    let mut smallest = f64::INFINITY;
    for cell in mesh.cells.iter() {
        // The derivative by a corner is normal to the side opposite to it.
        let normals = simplex::gradient(&simplex::corners::<D>(&mesh.nodes, cell));
        for i in 0..=D {
            for j in 0..i {
                smallest = f64::min(smallest, (-normals[i]).angle(&normals[j]).to_degrees());
            }
        }
    }
    smallest
}

/// The muscles with a part outside the tissue that bends.
fn bent_muscles<const D: usize>(mesh: &Mesh<D>) -> impl Iterator<Item = Concern> {
    let in_tissue = mesh.in_tissue();
    mesh.muscles.iter().filter_map(move |muscle| {
        let is_stop = |n: usize| in_tissue[n] || mesh.fixed.binary_search(&n).is_ok();
        let (mut longer_m, mut from, mut along) = (0.0, muscle.nodes[0], 0.0);
        for step in muscle.nodes.windows(2) {
            along += mesh.distance([step[0], step[1]]);
            if is_stop(step[1]) || Some(&step[1]) == muscle.nodes.last() {
                let straight = mesh.distance([from, step[1]]);
                longer_m += if along > (1.0 + BENT) * straight { along - straight } else { 0.0 };
                (from, along) = (step[1], 0.0);
            }
        }
        (longer_m > 0.0).then(|| Concern::BentMuscle { muscle: muscle.name.clone(), longer_m })
    })
}
