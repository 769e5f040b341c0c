//! Concerns about a body that was read from a file, for the user to check.

use std::ops::RangeInclusive;

use crate::measured::lengths::plausibility::doubt_of_lengths;
use crate::measured::muscles::Muscles;
use crate::measured::recording::{STEEPEST_BONES_DEG, steep_deg};
use tongue_core::body::{Body, HYOID, MANDIBLE, Mesh};
use tongue_core::geometry::{Point, simplex};
use tongue_core::statistics::median;

/// Plausible extents of a body, m: from a child's tongue to an adult's with all muscles outside it.
const TONGUE_M: RangeInclusive<f64> = 0.02..=0.3;
/// Units of files that are read in the wrong one: name, factor to metres, advice.
const MISTAKEN_M: [(&str, f64, &str); 3] = [
    ("millimetres", 1e-3, "read them with --mesh-unit mm (in a scene: unit = \"mm\")"),
    ("centimetres", 1e-2, "scale the model to metres or millimetres"),
    ("metres", 1e3, "read them without --mesh-unit mm"),
];
/// Triangles with smaller angles are too stiff, because their springs do not allow bending; degrees.
const THINNEST_DEG: f64 = 10.0;
/// How much longer than the straight line a part of a muscle outside the tissue may be, as a part of that line.
const MOST_BENT: f64 = 1e-6;

pub(in crate::bodies) fn review<const D: usize>(mesh: &Mesh<D>) -> Vec<String> {
    let mut concerns = Vec::new();
    let extent_m = mesh.extent();
    if !TONGUE_M.contains(&extent_m) {
        let (least, most) = (TONGUE_M.start(), TONGUE_M.end());
        let size = format!("the body is {extent_m:.3} m across, but a tongue is {least} to {most} m");
        let unit = MISTAKEN_M.iter().find(|(_, metres, _)| TONGUE_M.contains(&(extent_m * metres)));
        concerns.push(match unit {
            Some((unit, _, help)) => format!("{size}: the coordinates look like {unit}; {help}"),
            None => format!("{size}; is the unit right?"),
        });
    }
    let known = Muscles::built_in();
    let mut names: Vec<&str> = known.all().iter().map(|m| m.name.as_str()).collect();
    names.retain(|name| mesh.muscles.iter().all(|chain| !chain.name.eq_ignore_ascii_case(name)));
    // A body with some of the published muscles is meant for the published lengths; one with none of them has muscles of its own.
    let own = !mesh.muscles.is_empty() && names.len() == known.all().len();
    if let (2, false, Some(first)) = (D, own, names.first()) {
        concerns.push(format!(
            "no muscle {}: measured lengths of it have nothing to be compared with; add Physical Curve(\"{first}\") = {{...}}",
            names.join(", ")
        ));
    }
    let angle_deg = smallest_angle_deg(mesh);
    if angle_deg < THINNEST_DEG {
        concerns.push(format!(
            "the smallest angle is {angle_deg:.1}°; below {THINNEST_DEG}° the mesh is too stiff: move points apart or mesh finer"
        ));
    }
    concerns.extend(bent_muscles(mesh));
    concerns
}

/// Concerns about the position of a body in the head, and about the lengths of its muscles.
pub fn review_of_head(body: &Body<2>) -> Vec<String> {
    let (mesh, mut concerns) = (&body.mesh, Vec::new());
    if mesh.fixed.len() == 1 {
        concerns
            .push("only one node is held, so that the body can turn about it; hold another one".to_owned());
    }
    let places = [MANDIBLE, HYOID].map(|bone| {
        let nodes = body.bone(bone);
        (!nodes.is_empty()).then(|| nodes.iter().map(|n| mesh.nodes[*n]).sum::<Point>() / nodes.len() as f64)
    });
    if let [Some(spine), Some(hyoid)] = places {
        let to_hyoid = hyoid - spine;
        let in_tissue = mesh.in_tissue();
        let heights =
            mesh.nodes.iter().zip(in_tissue).filter(|(_, is_tissue)| *is_tissue).map(|(at, _)| at.y);
        let is_below = median(heights).is_some_and(|height| height < spine.y.min(hyoid.y));
        let turned = match () {
            () if steep_deg(to_hyoid) > STEEPEST_BONES_DEG => {
                Some("the mental spine and the hyoid lie one above the other")
            }
            () if to_hyoid.x < 0.0 => Some("the mental spine lies behind the hyoid"),
            () if is_below => Some("the tissue lies below the mental spine and the hyoid"),
            () => None,
        };
        concerns.extend(turned.map(|fault| {
            format!("{fault}: x grows to the back of the head and y upwards, and weight, walls and recordings are in these axes")
        }));
    }
    // If the unit is wrong all muscles have wrong lengths, and `review` has a concern about the extent.
    if TONGUE_M.contains(&mesh.extent()) {
        let lengths = mesh.muscles.iter().map(|m| (m.name.as_str(), 1e3 * mesh.distance(m.ends())));
        concerns.extend(doubt_of_lengths(lengths));
    }
    concerns
}

fn smallest_angle_deg<const D: usize>(mesh: &Mesh<D>) -> f64 {
    let mut smallest = f64::INFINITY;
    for cell in mesh.cells.iter() {
        // The gradient of a cell's measure by the position of a corner is normal to the opposite side.
        let normals = simplex::gradient(&simplex::corners::<D>(&mesh.nodes, cell));
        for i in 0..=D {
            for j in 0..i {
                smallest = f64::min(smallest, (-normals[i]).angle(&normals[j]).to_degrees());
            }
        }
    }
    smallest
}

fn bent_muscles<const D: usize>(mesh: &Mesh<D>) -> impl Iterator<Item = String> {
    let in_tissue = mesh.in_tissue();
    mesh.muscles.iter().filter_map(move |muscle| {
        let (mut longer_m, mut from, mut along) = (0.0, muscle.nodes[0], 0.0);
        for step in muscle.nodes.windows(2) {
            along += mesh.distance([step[0], step[1]]);
            let is_stop = in_tissue[step[1]] || mesh.fixed.binary_search(&step[1]).is_ok();
            if is_stop || Some(&step[1]) == muscle.nodes.last() {
                let straight = mesh.distance([from, step[1]]);
                longer_m += if along > (1.0 + MOST_BENT) * straight { along - straight } else { 0.0 };
                (from, along) = (step[1], 0.0);
            }
        }
        (longer_m > 0.0).then(|| {
            let (name, mm) = (&muscle.name, 1e3 * longer_m);
            format!("{name} bends outside the tissue; that part is taken as one straight line, which is {mm:.2} mm shorter")
        })
    })
}
