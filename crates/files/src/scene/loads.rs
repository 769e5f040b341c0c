//! Loads of a scene: weight, walls, the bones that jaw and hyoid move; and the tensions that points measured on the tongue imply.

use std::any::Any;

use nalgebra::{SVector, Vector2};
use serde::Serialize;

use super::effects::{HeadPosture, SceneGravity};
use super::file::{Points, Scene};
use super::plan::{self, Planned};
use crate::report::names_or_none;
use crate::simulation::SimulationError;
use tongue_core::body::{Body, HYOID, MANDIBLE, Mesh};
use tongue_core::effect::{Contact, Gravity, lumped_masses};
use tongue_core::observe::TongueSurface;
use tongue_core::system::{Additions, Model, PrescribedDisplacement, System};
use tongue_infer::track::{self, ErrorModel, Frame, FrameStatus, TrackSettings, TrackingContext, Watch};
use tongue_input::measured::recording::{AlignedFrame, AlignedRecording, Mark};

pub(super) fn gravity<const D: usize>(
    scene: &Scene,
    body: &Body<D>,
    model: &Model,
) -> Result<Option<Gravity<D>>, SimulationError> {
    let Some(keys) = &scene.effects.gravity else { return Ok(None) };
    let acceleration = direction::<D>(keys)? * keys.acceleration_m_per_s2;
    let masses = lumped_masses(&body.mesh, model.density);
    Ok(Some(Gravity::new(&masses, acceleration, &body.mesh.nodes)))
}

fn direction<const D: usize>(keys: &SceneGravity) -> Result<SVector<f64, D>, SimulationError> {
    match (keys.posture, &keys.direction) {
        (Some(HeadPosture::Upright), _) => Ok(flat([0.0, -1.0])),
        (Some(HeadPosture::Supine), _) => Ok(flat([1.0, 0.0])),
        (Some(HeadPosture::Prone), _) => Ok(flat([-1.0, 0.0])),
        (None, given) => plan::unit(given.as_deref().unwrap_or_default()),
    }
}

fn flat<const D: usize>([x, y]: [f64; 2]) -> SVector<f64, D> {
    let mut v = SVector::zeros();
    (v[0], v[1]) = (x, y);
    v
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
    if let Some([first, last]) = wall.folded() {
        let why = format!(
            "from its row {first} to its row {last} the wall crosses itself or turns back along itself; exchange the rows that are out of order"
        );
        return Err(SimulationError::contradiction("effects.contact.outline_mm", "a wall", why));
    }
    let through = wall.first_penetration(&body.mesh.nodes, &body.mesh.connections);
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

/// A corner of the wall inside a triangle, m. In space the wall is unbounded, so that it crosses an edge of every cell that it passes.
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
    wall.outline.iter().find(inside).map(|p| [p.x, p.y])
}

/// Adds the positions to which jaw and hyoid move the nodes on them, and plans both.
pub(super) fn displace_bones<const D: usize>(
    scene: &Scene,
    body: &Body<D>,
    additions: &mut Additions<D>,
) -> Result<[Planned; 2], SimulationError> {
    let turned = scene.effects.jaw.as_ref().map(|j| PrescribedDisplacement::Turned {
        joint: flat(j.joint_mm.map(|x| x * 1e-3)),
        angle: j.opening_deg.to_radians(),
    });
    let shifted = scene.effects.hyoid.as_ref();
    let shifted = shifted.map(|h| PrescribedDisplacement::Shifted(flat(h.shift_mm.map(|x| x * 1e-3))));
    let mut displace = |effect, bone, displacement: Option<PrescribedDisplacement<D>>| {
        let Some(displacement) = displacement else { return Ok(Planned::leave_out(effect, "not asked for")) };
        let nodes = body.bone(bone);
        if nodes.is_empty() {
            let known = names_or_none(body.bones.iter().map(|b| format!("{:?}", b.name)));
            let why = format!(
                "this body has no bone {bone:?} (its bones: {known}); give its nodes that name in the mesh, or take the reference tongue"
            );
            return Err(SimulationError::contradiction(format!("effects.{effect}"), scene.body_key(), why));
        }
        additions.displaced.extend(nodes.iter().map(|&n| (n, displacement.place(body.mesh.nodes[n]))));
        let why = "asked for; brought there in parts, each an equilibrium";
        Ok(Planned::simulate(effect, why).counting(nodes.len()))
    };
    Ok([displace("jaw", MANDIBLE, turned)?, displace("hyoid", HYOID, shifted)?])
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointsFit {
    pub status: FrameStatus,
    pub rms_mm: Option<f64>,
    /// Number of directions of the tensions whose standard deviation is below half of the prior's; the others come from the prior.
    pub resolved: usize,
    /// Lower ends of the 95 % intervals of all chains, N per metre of thickness, for a speaker whose tongue has the shape of this body.
    pub low_n: Vec<f64>,
    pub high_n: Vec<f64>,
}

/// The points of a scene as observations of its body; `None` if the scene has none.
pub(super) fn frame<const D: usize>(scene: &Scene, body: &Body<D>) -> Result<Option<Frame>, SimulationError> {
    let Some(points) = &scene.points else { return Ok(None) };
    let flat = (body as &dyn Any).downcast_ref::<Body<2>>();
    let surface = flat.and_then(TongueSurface::of).ok_or_else(|| {
        let why = "points are seen in the midsagittal plane, on the outline of a body; take the reference tongue or a mesh in the plane";
        SimulationError::contradiction("[points]", scene.body_key(), why)
    })?;
    Ok(track::frames(&as_recording(points), &surface, &[], &[]).pop())
}

fn as_recording(points: &Points) -> AlignedRecording {
    let mark = |at: &[f64; 2]| Some(Mark { at: Vector2::from(*at) * 1e-3, sd: points.noise_mm * 1e-3 });
    let behind = points.sensors.iter().map(|s| s.surface_mm * 1e-3);
    AlignedRecording {
        name: "points".to_owned(),
        contour: numbered("contour", points.contour_mm.len()),
        sensors: numbered("sensor", points.sensors.len()).into_iter().zip(behind).collect(),
        measured: vec![true; points.sensors.len()],
        frames: vec![AlignedFrame {
            time_s: 0.0,
            contour: points.contour_mm.iter().map(mark).collect(),
            sensors: points.sensors.iter().map(|s| mark(&s.at_mm)).collect(),
            bones: Vec::new(),
        }],
        ..AlignedRecording::default()
    }
}

fn numbered(stem: &str, count: usize) -> Vec<String> {
    (1..=count).map(|i| format!("{stem}_{i}")).collect()
}

/// The tensions of all chains of the mesh, N, and their intervals; `None` in space, for which [`frame`] makes no observations.
pub(super) fn fit<const D: usize>(
    points: &Points,
    frame: &Frame,
    system: &System<D>,
) -> Option<(Vec<f64>, PointsFit)> {
    let system = (system as &dyn Any).downcast_ref::<System<2>>()?;
    let settings =
        TrackSettings { errors: ErrorModel::INDEPENDENT, ..TrackSettings::new(points.prior_n_per_m, 0.0) };
    // The body of a scene is given, so its shape is taken as known.
    let context = TrackingContext::fixed(system);
    let tracked = Watch::collect(|watch| context.smooth(vec![vec![frame.clone()]], &settings, watch));
    let tracked = tracked.ok()?.pop()?.frames.pop()?;
    let of_body = |values: &[f64]| {
        let mut all = vec![0.0; system.muscle_count()];
        system.contracting().iter().zip(values).for_each(|(&muscle, value)| all[muscle] = *value);
        all
    };
    let fit = PointsFit {
        status: tracked.status,
        rms_mm: tracked.rms_m.map(|r| r * 1e3),
        resolved: tracked.resolved,
        low_n: of_body(&Vec::from_iter(tracked.tensions.iter().map(|l| l.low))),
        high_n: of_body(&Vec::from_iter(tracked.tensions.iter().map(|l| l.high))),
    };
    Some((of_body(&tracked.tensions_n()), fit))
}
