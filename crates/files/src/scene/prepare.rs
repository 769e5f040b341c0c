//! Makes the system of a scene, with only what the scene needs.

use std::any::Any;
use std::sync::Arc;

use super::body::operation;
use super::file::{FitTarget, Scene, Want};
use super::loads::{contact, displace_bones, gravity};
use super::plan::{self, MuscleRole, Planned, ScenePlan, force_unit};
use super::{loads, vocal_tract};
use crate::simulation::SimulationError;
use crate::surgery::Operation;
use tongue_core::body::Body;
use tongue_core::effect::Contact;
use tongue_core::system::model::bending_kept;
use tongue_core::system::{self, Additions, Model, SpaceModel, System};
use tongue_infer::acoustics::VocalTract;
use tongue_infer::inverse::{self, TargetOnBody};
use tongue_infer::track::Frame;
use tongue_input::measured::{Dataset, Target, TargetKind, TargetOptions, Vowel};

#[derive(Debug)]
pub struct Prepared<const D: usize> {
    pub plan: ScenePlan,
    pub body: Body<D>,
    pub(super) operation: Option<Operation>,
    pub system: Arc<System<D>>,
    /// For a trajectory with displaced bones: the system without weight and contraction, at whose equilibrium the motion starts.
    pub start: Option<System<D>>,
    pub tensions: Vec<f64>,
    pub wall: Option<Contact>,
    pub target: Option<TargetOnBody>,
    pub seen: Option<Frame>,
    pub airway: Option<VocalTract>,
}

pub fn prepare<const D: usize>(scene: &Scene, body: Body<D>) -> Result<Prepared<D>, SimulationError> {
    scene.check()?;
    let model = scene.model();
    let target = scene.fit.as_ref().map(|wanted| target(wanted, scene, &body)).transpose()?;
    let operation = operation(scene)?;
    let given = given(scene, operation.as_ref(), &body)?;
    let tensions: Vec<f64> = given.iter().map(|tension| tension.unwrap_or(0.0)).collect();
    let seen = loads::frame(scene, &body)?;
    let airway = vocal_tract::vocal_tract(scene, &body)?;
    let all = 0..body.mesh.muscles.len();
    let contracting: Vec<usize> = match &target {
        _ if seen.is_some() => all.collect(),
        None if body.is_activated() => all.filter(|&m| tensions[m] > 0.0).collect(),
        None => all.filter(|&m| given[m].is_some()).collect(),
        Some(target) => target.contracting(),
    };

    let mut decisions = tissue_decisions(scene, &body, &contracting);
    if let Some(why) = locks(&body, &model)? {
        decisions.iter_mut().filter(|d| d.simulated && d.effect == "springs").for_each(|d| d.why += &why);
    }
    let mut additions =
        Additions { incompressible: scene.effects.incompressibility == Some(true), ..Additions::default() };
    let coefficients = system::coefficients(&body.mesh, &model)?;
    decisions.push(Planned::by_request("gravity", scene.effects.gravity.is_some()));
    if let Some(gravity) = gravity(scene, &body, &model)? {
        additions.add_gravity(gravity);
    }
    decisions.push(Planned::by_request("contact", scene.effects.contact.is_some()));
    let wall = contact(scene, &body, coefficients.tissue_stiffness)?;
    if let Some(wall) = &wall {
        additions.add_contact(wall.clone());
    }
    decisions.extend(displace_bones(scene, &body, &mut additions)?);
    decisions.push(match body.mesh.fixed.len() {
        0 => Planned::leave_out("bone", "no node is fixed"),
        n => Planned::simulate("bone", format!("{n} nodes are fixed")).counting(n),
    });
    decisions.extend(plan::motion(scene, !contracting.is_empty()));

    let start = if scene.want == Want::Trajectory && !additions.displaced.is_empty() {
        let (incompressible, displaced) = (additions.incompressible, additions.displaced.clone());
        let mut unloaded = Additions { incompressible, displaced, ..Additions::default() };
        wall.iter().for_each(|wall| unloaded.add_contact(wall.clone()));
        Some(System::with_additions(&body.mesh, &model, &[], unloaded)?)
    } else {
        None
    };
    let system = if body.is_activated() {
        of_hexahedra(&body, additions)?
    } else {
        System::with_additions(&body.mesh, &model, &contracting, additions)?
    };
    let system = Arc::new(system);
    let roles = roles(&body, &contracting, &given, target.as_ref());
    let plan = plan::count(scene, &body.what, method(scene, airway.as_ref()), decisions, roles, &system);
    Ok(Prepared { plan, body, operation, system, start, tensions, wall, target, seen, airway })
}

/// The system of a tongue in space; a body for which `D` is not 3 is refused.
fn of_hexahedra<const D: usize>(
    body: &Body<D>,
    additions: Additions<D>,
) -> Result<System<D>, SimulationError> {
    let wrong = || {
        SimulationError::contradiction("a tongue in space", "a body in the plane", "it has three dimensions")
    };
    let additions: Box<dyn Any> = Box::new(additions);
    let additions = additions.downcast::<Additions<3>>().map_err(|_| wrong())?;
    let body = (body as &dyn Any).downcast_ref().ok_or_else(wrong)?;
    let system: Box<dyn Any> = Box::new(System::in_space_with(body, &SpaceModel::default(), *additions)?);
    Ok(*system.downcast::<System<D>>().map_err(|_| wrong())?)
}

impl Scene {
    pub fn model(&self) -> Model {
        let (m, table) = (&self.material, Model::default());
        Model {
            density: m.density_kg_per_m3.unwrap_or(table.density),
            young_modulus: m.young_modulus_pa.unwrap_or(table.young_modulus),
            poisson_ratio: m.poisson_ratio.unwrap_or(table.poisson_ratio),
            viscosity: m.viscosity_pa_s.unwrap_or(table.viscosity),
        }
    }
}

fn target<const D: usize>(
    wanted: &FitTarget,
    scene: &Scene,
    body: &Body<D>,
) -> Result<TargetOnBody, SimulationError> {
    let vowel: Vowel = wanted.vowel.parse()?;
    let kind: TargetKind = wanted.target.parse()?;
    let data = Dataset::reference()?;
    data.row(&wanted.subject, &vowel)?;
    if data.baseline(&wanted.subject).is_err() {
        return Err(SimulationError::Refused(format!(
            "a fit in a scene or of a sound compares with /ɯ/, which was not measured of {0}; take another subject, or the tensions that \
             `tongue-fit --vowel {vowel} --subject {0} --baseline e` finds",
            wanted.subject
        )));
    }
    let target = Target::new(&data, &wanted.subject, &vowel, kind, &TargetOptions::default())?;
    TargetOnBody::new(&body.mesh, &target).map_err(|missing| {
        let why = format!("{missing}; fit a body that has it, or give tensions");
        SimulationError::contradiction("[fit]", scene.body_key(), why)
    })
}

/// The tension or activation of every muscle of `body`, after surgery if there was any; `None` where the scene gives none. Muscles of one
/// name have the same.
fn given<const D: usize>(
    scene: &Scene,
    operation: Option<&Operation>,
    body: &Body<D>,
) -> Result<Vec<Option<f64>>, SimulationError> {
    if body.is_activated() {
        let given: Vec<_> = scene.activations.iter().map(|(name, a)| (name, *a)).collect();
        let all = match operation {
            None => body.activations(&given),
            Some(operation) => operation.whole.activations(&given).map(|all| operation.of_remaining(&all)),
        };
        let all = all.map_err(|wrong| SimulationError::Refused(format!("activations: {wrong}")))?;
        return Ok(all.into_iter().map(Some).collect());
    }
    let mut given = vec![None; body.mesh.muscles.len()];
    for (name, &tension) in &scene.tensions_n {
        let muscle = body.muscle(name).map_err(|missing| {
            SimulationError::contradiction(format!("tensions_n.{name}"), scene.body_key(), missing)
        })?;
        let own = &body.mesh.muscles[muscle].name;
        for number in body.muscles_called(own) {
            if given[number].replace(tension).is_some() {
                let why = format!("tensions_n.{name}: the tension of {own} is given twice; keep one of them");
                return Err(SimulationError::Refused(why));
            }
        }
    }
    Ok(given)
}

fn tissue_decisions<const D: usize>(scene: &Scene, body: &Body<D>, contracting: &[usize]) -> Vec<Planned> {
    // A decision about what pulls, with its verb in singular and plural.
    let pulling = |effect, what: &str, [one, several]: [&str; 2], how: &str| match contracting.len() {
        0 => Planned::leave_out(effect, format!("no muscle {one}")),
        1 => Planned::simulate(effect, format!("1 {what} {one}{how}")),
        n => Planned::simulate(effect, format!("{n} {what}s {several}{how}")),
    };
    if body.is_activated() {
        let why = "the body is made of hexahedra";
        return vec![
            Planned::leave_out("springs", why),
            Planned::simulate("hexahedra", format!("needed: {why}")),
            pulling("fibres", "muscle", ["is active", "are active"], ""),
            Planned::leave_out("incompressibility", why),
            Planned::leave_out("straight paths", why),
        ];
    }
    if let Some(continuum) = &body.mesh.continuum {
        let why = "the body is a continuum";
        return vec![
            Planned::leave_out("springs", why),
            Planned::simulate("quadratic elements", format!("needed: {why}")),
            Planned::simulate("barrier", "acts only where an element is pressed to a tenth"),
            if continuum.ties.is_empty() {
                Planned::leave_out("attachment", "bones hold nodes")
            } else {
                Planned::simulate("attachment", "bones hold patches of the surface")
            },
            pulling("fibres", "muscle", ["contracts", "contract"], ""),
            Planned::leave_out("incompressibility", why),
            Planned::leave_out("straight paths", why),
        ];
    }
    let how = "; only its connections get the three-element model";
    let how = if contracting.len() > 1 { how.replace("its", "their") } else { how.to_owned() };
    vec![
        Planned::simulate("springs", "needed: the tissue is made of them"),
        pulling("muscle", "chain", ["contracts", "contract"], &how),
        Planned::by_request("incompressibility", scene.effects.incompressibility == Some(true)),
        if body.mesh.in_tissue().iter().all(|inside| *inside) {
            Planned::leave_out("straight paths", "no muscle runs outside the tissue")
        } else {
            Planned::simulate(
                "straight paths",
                "needed: a chain outside the tissue would have no lateral stiffness",
            )
        },
    ]
}

/// A text that says how much the springs of a solid lock; `None` where they do not.
fn locks<const D: usize>(body: &Body<D>, model: &Model) -> Result<Option<String>, SimulationError> {
    let mesh = &body.mesh;
    if D != 3 || mesh.cells.is_empty() || mesh.continuum.is_some() {
        return Ok(None);
    }
    let total: f64 = mesh.connections.iter().map(|&c| mesh.distance(c)).sum();
    let side = total / mesh.connections.len().max(1) as f64;
    let kept = bending_kept(model, side)?;
    Ok(kept.map(|kept| {
        format!(
            "; they lock at a Poisson's ratio of {}: one cube of them keeps {:.0} % of its bending, so do not take the answer for soft tissue \
             (a continuum or hexahedra do not lock)",
            model.poisson_ratio,
            100.0 * kept
        )
    }))
}

/// What each muscle does, and why. What is `given` are activations in a body of hexahedra, otherwise tensions.
fn roles<const D: usize>(
    body: &Body<D>,
    contracting: &[usize],
    given: &[Option<f64>],
    target: Option<&TargetOnBody>,
) -> Vec<MuscleRole> {
    let mut roles: Vec<MuscleRole> = Vec::new();
    for (number, muscle) in body.mesh.muscles.iter().enumerate() {
        if roles.iter().any(|r| r.muscle == muscle.name) {
            continue;
        }
        let contracts = contracting.contains(&number);
        let why = match given[number] {
            Some(activation) if contracts && body.is_activated() => format!("activated to {activation}"),
            _ if body.is_activated() => "passive: its region is tissue".to_owned(),
            _ if !contracts => "passive: its connections are tissue".to_owned(),
            Some(tension) => format!("contracts with {tension} {}", force_unit(D)),
            None => match target {
                Some(target) if target.target.active_names().contains(&muscle.name.as_str()) => {
                    "shorter in this vowel than at rest: contracts, with a tension to be found".to_owned()
                }
                Some(_) => "not shorter in this vowel: without tension".to_owned(),
                None => "contracts, with a tension to be found".to_owned(),
            },
        };
        roles.push(MuscleRole { muscle: muscle.name.clone(), contracting: contracts, why });
    }
    roles
}

fn method(scene: &Scene, airway: Option<&VocalTract>) -> &'static str {
    match scene.want {
        Want::Trajectory => "TR-BDF2 with adaptive steps",
        _ if scene.points.is_some() => {
            "Gauss-Newton over some ten equilibria by Newton's method on the energy"
        }
        _ if scene.fit.is_some() && search_method(airway) == inverse::Method::GaussNewton => {
            "Gauss-Newton over some hundred equilibria by Newton's method on the energy"
        }
        _ if scene.fit.is_some() => {
            "Nelder-Mead over some thousand equilibria by Newton's method on the energy"
        }
        _ => "one equilibrium by Newton's method on the energy",
    }
}

/// The method of a fit in a scene. The end point of Nelder-Mead depends on the last bits of a machine, which moves a formant by 2 Hz.
pub(super) fn search_method(airway: Option<&VocalTract>) -> inverse::Method {
    airway.map_or_else(inverse::Method::default, |_| inverse::Method::GaussNewton)
}
