//! What a user should look at in a body that was read from a file.

use std::ops::RangeInclusive;

use crate::measured::lengths::plausibility::doubt_of_lengths;
use crate::measured::muscles::Muscles;
use crate::measured::recording::{STEEPEST_BONES_DEG, steep_deg};
use tongue_core::body::{Body, HYOID, MANDIBLE, Mesh};
use tongue_core::geometry::{Point, simplex};
use tongue_core::statistics::upper_median;

/// Plausible lengths of a tongue, from a child's to an adult's with all muscles outside it, m.
const TONGUE_M: RangeInclusive<f64> = 0.02..=0.3;
/// Units that a file may be in by mistake, each with its factor to metres and what to do.
const MISTAKEN_M: [(&str, f64, &str); 3] = [
    ("millimetres", 1e-3, "read them with --mesh-unit mm (in a scene: unit = \"mm\")"),
    ("centimetres", 1e-2, "scale the model to metres or millimetres"),
    ("metres", 1e3, "read them without --mesh-unit mm"),
];
/// Limit of thin triangles, degrees: springs of thinner ones cannot resist bending.
const THIN_DEG: f64 = 10.0;
/// A part outside the tissue that is longer than the straight line by more than this part is bent.
const BENT: f64 = 1e-6;

pub(in crate::bodies) fn review<const D: usize>(mesh: &Mesh<D>) -> Vec<String> {
    let mut concerns = Vec::new();
    let extent_m = mesh.extent();
    if !TONGUE_M.contains(&extent_m) {
        let (least, most) = (TONGUE_M.start(), TONGUE_M.end());
        let told = format!("the body is {extent_m:.3} m across, and a tongue {least} to {most} m");
        let unit = MISTAKEN_M.iter().find(|(_, metres, _)| TONGUE_M.contains(&(extent_m * metres)));
        concerns.push(match unit {
            Some((unit, _, help)) => format!("{told}: these look like {unit}; {help}"),
            None => format!("{told}; is the unit right?"),
        });
    }
    let known = Muscles::built_in();
    let mut names: Vec<&str> = known.all().iter().map(|m| m.name.as_str()).collect();
    names.retain(|name| mesh.muscles.iter().all(|chain| chain.name != *name));
    // A body with some of the published muscles is meant for the published lengths; one with none of them has
    // its own.
    let own = !mesh.muscles.is_empty() && names.len() == known.all().len();
    if let (2, false, Some(first)) = (D, own, names.first()) {
        concerns.push(format!(
            "no muscle {}: measured lengths of it have nothing to be compared with; add Physical Curve(\"{first}\") = {{...}}",
            names.join(", ")
        ));
    }
    let angle_deg = smallest_angle_deg(mesh);
    if angle_deg < THIN_DEG {
        concerns.push(format!(
            "the smallest angle is {angle_deg:.1}°; below {THIN_DEG}° the mesh is too stiff: move points apart or mesh finer"
        ));
    }
    concerns.extend(bent_muscles(mesh));
    concerns
}

/// What a user should look at in how a body in the plane lies in the head, and in the lengths of its muscles.
pub(in crate::bodies) fn review_of_head(body: &Body<2>) -> Vec<String> {
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
        let is_below = upper_median(heights).is_some_and(|height| height < spine.y.min(hyoid.y));
        let turned = match () {
            () if steep_deg(to_hyoid) > STEEPEST_BONES_DEG => {
                Some("the mental spine and the hyoid lie one above the other")
            }
            () if to_hyoid.x < 0.0 => Some("the mental spine lies behind the hyoid"),
            () if is_below => Some("the tissue lies below the mental spine and the hyoid"),
            () => None,
        };
        concerns.extend(turned.map(|told| {
            format!("{told}: x grows to the back of the head and y upwards, and weight, walls and recordings are in these axes")
        }));
    }
    // In another unit all muscles are too long, which is told of the body.
    if TONGUE_M.contains(&mesh.extent()) {
        let lengths = mesh.muscles.iter().map(|m| (m.name.as_str(), 1e3 * mesh.distance(m.ends())));
        concerns.extend(doubt_of_lengths(lengths));
    }
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
fn bent_muscles<const D: usize>(mesh: &Mesh<D>) -> impl Iterator<Item = String> {
    let in_tissue = mesh.in_tissue();
    mesh.muscles.iter().filter_map(move |muscle| {
        let (mut longer_m, mut from, mut along) = (0.0, muscle.nodes[0], 0.0);
        for step in muscle.nodes.windows(2) {
            along += mesh.distance([step[0], step[1]]);
            let is_stop = in_tissue[step[1]] || mesh.fixed.binary_search(&step[1]).is_ok();
            if is_stop || Some(&step[1]) == muscle.nodes.last() {
                let straight = mesh.distance([from, step[1]]);
                longer_m += if along > (1.0 + BENT) * straight { along - straight } else { 0.0 };
                (from, along) = (step[1], 0.0);
            }
        }
        (longer_m > 0.0).then(|| {
            let (name, mm) = (&muscle.name, 1e3 * longer_m);
            format!("{name} bends outside the tissue; that part is taken as one straight line, which is {mm:.2} mm shorter")
        })
    })
}
