//! What acts on the body of a scene beside its muscles: weight, walls, and the bones that jaw and hyoid move.

use nalgebra::{SVector, Vector2};

use super::effects::{Posture, SceneGravity};
use super::file::Scene;
use super::plan::{self, Planned};
use crate::simulation::SimulationError;
use tongue_core::body::{Body, HYOID, MANDIBLE, Mesh};
use tongue_core::effect::{Contact, Gravity, lumped_masses};
use tongue_core::system::{Additions, Model, PrescribedDisplacement};

pub(super) fn gravity<const D: usize>(
    scene: &Scene,
    body: &Body<D>,
    model: &Model,
) -> Result<Option<Gravity<D>>, SimulationError> {
    let Some(keys) = &scene.effects.gravity else { return Ok(None) };
    let acceleration = direction::<D>(keys)? * keys.acceleration_m_per_s2;
    let masses = lumped_masses(&body.mesh, model.constants.density);
    Ok(Some(Gravity::new(&masses, acceleration, &body.mesh.nodes)))
}

fn direction<const D: usize>(keys: &SceneGravity) -> Result<SVector<f64, D>, SimulationError> {
    let flat = |x: f64, y: f64| {
        let mut v = SVector::zeros();
        (v[0], v[1]) = (x, y);
        v
    };
    match (keys.posture, &keys.direction) {
        (Some(Posture::Upright), _) => Ok(flat(0.0, -1.0)),
        (Some(Posture::Supine), _) => Ok(flat(1.0, 0.0)),
        (Some(Posture::Prone), _) => Ok(flat(-1.0, 0.0)),
        (None, given) => plan::unit(given.as_deref().unwrap_or_default()),
    }
}

pub(super) fn contact<const D: usize>(
    scene: &Scene,
    body: &Body<D>,
    tissue_stiffness: f64,
) -> Result<Option<Contact>, SimulationError> {
    let Some(keys) = &scene.effects.contact else { return Ok(None) };
    let outline: Vec<Vector2<f64>> = match (&keys.outline_mm, &body.palate) {
        (Some(points), _) => points.iter().map(|&[x, y]| Vector2::new(x, y) * 1e-3).collect(),
        (None, Some(palate)) => palate.clone(),
        (None, None) => {
            let why = "no palate goes with this body; give effects.contact.outline_mm";
            return Err(SimulationError::contradiction("effects.contact", scene.body_key(), why));
        }
    };
    let stiffness = keys.stiffness_n_per_m.unwrap_or(tissue_stiffness);
    let wall = Contact::new(outline, &body.mesh.surface_nodes(), stiffness, keys.reach_mm * 1e-3);
    let through = wall.penetrated(&body.mesh.nodes, &body.mesh.connections);
    let middle = through.map(|[a, b]| [0, 1].map(|d| (body.mesh.nodes[a][d] + body.mesh.nodes[b][d]) / 2.0));
    if let Some([x, y]) = middle.or_else(|| corner_inside(&wall, &body.mesh)) {
        let why = format!(
            "the body passes through the wall at rest, near [{:.1}, {:.1}] mm; move the wall out of the body",
            1e3 * x,
            1e3 * y
        );
        return Err(SimulationError::contradiction("effects.contact", scene.body_key(), why));
    }
    Ok(Some(wall))
}

/// A corner of the wall inside a triangle, m. (In space the wall is unbounded, so it meets an edge of every
/// cell that it passes.)
fn corner_inside<const D: usize>(wall: &Contact, mesh: &Mesh<D>) -> Option<[f64; 2]> {
    let inside = |p: &&Vector2<f64>| {
        D == 2
            && mesh.cells.iter().any(|cell| {
                let turns = (0..3).map(|i| {
                    let [a, b] =
                        [cell[i], cell[(i + 1) % 3]].map(|n| mesh.nodes[n].fixed_rows::<2>(0).into_owned());
                    (b - a).perp(&(**p - a))
                });
                turns.fold(f64::INFINITY, f64::min) > 0.0
            })
    };
    wall.outline().iter().find(inside).map(|p| [p.x, p.y])
}

/// Positions to which jaw and hyoid move the nodes that they hold.
pub(super) fn carry_bones<const D: usize>(
    scene: &Scene,
    body: &Body<D>,
    additions: &mut Additions<D>,
) -> Result<[Planned; 2], SimulationError> {
    let millimetres = |[x, y]: [f64; 2]| {
        let mut v = SVector::<f64, D>::zeros();
        (v[0], v[1]) = (x * 1e-3, y * 1e-3);
        v
    };
    let jaw = scene.effects.jaw.as_ref();
    let hyoid = scene.effects.hyoid.as_ref();
    let turned = jaw.map(|j| PrescribedDisplacement::Turned {
        joint: millimetres(j.joint_mm),
        angle: j.opening_deg.to_radians(),
    });
    let shifted = hyoid.map(|h| PrescribedDisplacement::Shifted(millimetres(h.shift_mm)));
    let [mandible, hyoid_bone] = [MANDIBLE, HYOID].map(|name| body.bone(name));
    let wanted = [("effects.jaw", turned, mandible), ("effects.hyoid", shifted, hyoid_bone)];
    for (key, carried, nodes) in wanted {
        let Some(carried) = carried else { continue };
        if nodes.is_empty() {
            let why = "this body does not say which of its nodes are on that bone; take the reference tongue";
            return Err(SimulationError::contradiction(key, scene.body_key(), why));
        }
        additions.carried.extend(nodes.iter().map(|&n| (n, carried.place(body.mesh.nodes[n]))));
    }
    let decide = |name: &'static str, asked: bool, nodes: &[usize]| match asked {
        true => Planned::yes(name, "asked for; brought there in parts, each an equilibrium").of(nodes.len()),
        false => Planned::no(name, "not asked for"),
    };
    Ok([decide("jaw", jaw.is_some(), mandible), decide("hyoid", hyoid.is_some(), hyoid_bone)])
}
