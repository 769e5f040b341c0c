//! Surgery of a tongue in space: regions and their filling as text, and what the surgery changed.

use std::collections::BTreeSet;

use nalgebra::{SVector, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::report::status_in_words;
use crate::run::Solved;
use crate::simulation::SimulationError;
use tongue_core::body::Body;
use tongue_core::body::space::{Filling, Operated, Region, Side};
use tongue_core::geometry::hexahedron;
use tongue_core::system::{SpaceModel, System};
use tongue_infer::inverse::alarms::Alarm;
use tongue_infer::inverse::in_space::SpaceSearch;
use tongue_infer::inverse::{FitSettings, FitStatus};
use tongue_input::measured::{ByMuscle, SpaceMark};

/// Nodes nearer to the foremost one than this belong to the tip, m.
const TIP_M: f64 = 8e-3;
/// The equilibrium with a scar of half of the mobile tongue takes 27 iterations if it is 100 times as stiff, 50 if 1000 times.
const STIFFEST_SCAR: f64 = 1000.0;
/// Standard deviation of the positions to which the tip's nodes are fitted when activations are searched for, m.
const SD_M: f64 = 5e-4;

/// Surgery of a tongue in space.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Surgery {
    /// Regions: elements whose middle lies in a box, `box:X0,X1,Y0,Y1,Z0,Z1`, or in a ball, `ball:X,Y,Z,R` (mm; x to the back, y to the
    /// right, z upwards), or through which a muscle runs, `GGP_L`; with `left:` or `right:` in front on one side only.
    pub operate: Vec<String>,
    /// What is left there. It decides to which side the tongue deviates.
    pub filling: FillingKind,
    /// How many times as stiff as tongue a scar is.
    #[serde(default = "ten")]
    pub scar: f64,
    /// Whether activations are searched for, with the sides apart, that bring the tip back to where it was before.
    #[serde(default)]
    pub make_up: bool,
}

/// What surgery leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FillingKind {
    /// Nothing: what remains moves freely.
    Removed,
    /// A scar: stiff, without muscle.
    Scar,
    /// A flap: as stiff as tongue, without muscle.
    Flap,
    /// Tissue whose nerve is cut: its muscles are silent, which mechanically is a flap.
    Silent,
}

fn ten() -> f64 {
    10.0
}

impl Surgery {
    pub fn operate(&self, body: &Body<3>) -> Result<Operated, SimulationError> {
        let filling = match self.filling {
            FillingKind::Scar if !(self.scar > 0.0 && self.scar <= STIFFEST_SCAR) => {
                let must =
                    "above 0 and at most 1000: it is how many times as stiff as the tongue the scar is";
                return Err(SimulationError::value("scar", self.scar, must));
            }
            FillingKind::Scar => Filling::Scar(self.scar),
            FillingKind::Flap => Filling::Flap,
            FillingKind::Silent => Filling::Silent,
            FillingKind::Removed => Filling::Removed,
        };
        let mut elements = BTreeSet::new();
        for word in &self.operate {
            let wrong = |problem: String| SimulationError::Refused(format!("{word}: {problem}"));
            let (region, side) = region(word).map_err(wrong)?;
            elements.extend(body.elements_in(&region, side).map_err(|fault| wrong(fault.to_string()))?);
        }
        if elements.is_empty() {
            let message = "no region is given; name at least one, such as left:box:-20,20,-40,40,15,60";
            return Err(SimulationError::Refused(message.to_owned()));
        }
        Ok(body.operated(&elements, filling)?)
    }
}

fn region(word: &str) -> Result<(Region, Option<Side>), String> {
    let (side, word) = match (word.strip_prefix("left:"), word.strip_prefix("right:")) {
        (Some(rest), _) => (Some(Side::Left), rest),
        (_, Some(rest)) => (Some(Side::Right), rest),
        _ => (None, word),
    };
    let region = if let Some(text) = word.strip_prefix("box:") {
        match metres(text)?[..] {
            [x0, x1, y0, y1, z0, z1] => Region::Box([Vector3::new(x0, y0, z0), Vector3::new(x1, y1, z1)]),
            _ => return Err("a box has six numbers: box:X0,X1,Y0,Y1,Z0,Z1 in mm".to_owned()),
        }
    } else if let Some(text) = word.strip_prefix("ball:") {
        match metres(text)?[..] {
            [x, y, z, r] => Region::Ball(Vector3::new(x, y, z), r),
            _ => return Err("a ball has four numbers: ball:X,Y,Z,R in mm".to_owned()),
        }
    } else {
        Region::Muscle(word.to_owned())
    };
    Ok((region, side))
}

fn metres(text: &str) -> Result<Vec<f64>, String> {
    let number = |t: &str| t.trim().parse::<f64>().map_err(|_| format!("\"{t}\" is not a number"));
    text.split(',').map(|t| Ok(1e-3 * number(t)?)).collect()
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OperationRecord {
    pub regions: Vec<String>,
    pub filling: FillingKind,
    pub elements: usize,
    /// Volume of the operated elements at rest.
    pub volume_cm3: f64,
    /// Displacement of the tip from rest before surgery: back, right, up.
    pub tip_before_mm: [f64; 3],
    /// This and the next two are `None` if the tip is removed.
    pub tip_after_mm: Option<[f64; 3]>,
    /// How much less far to the front the tip reaches than before.
    pub reach_lost_mm: Option<f64>,
    /// How far the tip deviates to the right; negative to the left.
    pub deviation_mm: Option<f64>,
    /// Activations that bring the tip back to where it was before; `None` if they were not searched for.
    pub made_up_by: Option<ByMuscle<f64>>,
    /// The range of each activation in 95 % of the draws that bring the tip there; a tip alone determines few activations.
    pub made_up_interval_95: Option<ByMuscle<[f64; 2]>>,
    /// RMS distance of the tip's nodes from where they were before.
    pub made_up_to_mm: Option<f64>,
    /// How the search for these activations ended, and doubts about the shape that they give.
    pub made_up_status: Option<FitStatus>,
    pub made_up_alarms: Vec<Alarm>,
    /// Number of starts of the search that ended at these activations, and of all starts.
    pub made_up_starts: Option<[usize; 2]>,
    #[serde(skip)]
    pub before: BeforeSurgery,
}

impl OperationRecord {
    /// Reasons not to trust the activations that bring the tip back.
    pub fn doubts(&self) -> impl Iterator<Item = String> {
        use FitStatus::{IterationLimit, NoEquilibrium, ReplayDiffers};
        let status = self.made_up_status;
        let failed = status.filter(|s| matches!(s, IterationLimit | NoEquilibrium | ReplayDiffers));
        let failed = failed.map(|status| status_in_words(&status));
        let all = failed.into_iter().chain(self.made_up_alarms.iter().map(Alarm::to_string));
        all.map(|why| format!("the activations that bring the tip back are not to be trusted: {why}"))
    }
}

/// What a picture after surgery shows of the body before it. Positions are those of all nodes in the axes of the body, m.
#[derive(Debug, Clone, PartialEq)]
pub struct BeforeSurgery {
    pub body: Body<3>,
    pub positions: Vec<Vector3<f64>>,
    pub elements: BTreeSet<usize>,
    /// Positions after surgery where the tip was brought back; empty where that was not asked for.
    pub made_up: Vec<Vector3<f64>>,
}

/// A tongue before and after its surgery, in its own axes.
#[derive(Debug)]
pub struct Operation {
    surgery: Surgery,
    pub whole: Body<3>,
    operated: Operated,
}

impl Operation {
    pub fn new(surgery: &Surgery, whole: Body<3>) -> Result<Self, SimulationError> {
        Ok(Self { operated: surgery.operate(&whole)?, surgery: surgery.clone(), whole })
    }

    pub fn body(&self) -> &Body<3> {
        &self.operated.body
    }

    /// The activations of the muscles that remain after surgery, from those of all muscles.
    pub fn of_remaining(&self, all: &[f64]) -> Vec<f64> {
        self.operated.muscles.iter().map(|&m| all[m]).collect()
    }

    /// The equilibrium after surgery at the activations of the equilibrium `before` it, and what has changed. `direct` and `tell` are those
    /// of [`Solved::in_space`].
    pub fn solve_after(
        &self,
        before: &Solved<3>,
        model: &SpaceModel,
        direct: bool,
        tell: &dyn Fn(&str),
    ) -> Result<(Solved<3>, OperationRecord), SimulationError> {
        let after = Solved::in_space(self.body(), model, &self.of_remaining(&before.pulls), direct, tell)?;
        let mut record = self.record([&before.positions, &after.positions]);
        if self.surgery.make_up {
            // Left and right are searched apart, even if half of the body was enough for the equilibrium.
            let system = System::in_space(self.body(), model)?;
            self.make_up(&mut record, (self.body(), &system), &before.positions)?;
        }
        Ok((after, record))
    }

    /// What changed between the positions of all nodes before surgery and those after it, m.
    pub fn record(&self, [before, after]: [&[Vector3<f64>]; 2]) -> OperationRecord {
        let Self { surgery, whole, operated } = self;
        let tip_before_mm = foremost_moved_mm(whole, before).unwrap_or_default();
        let tip_after_mm = foremost_moved_mm(&operated.body, after);
        OperationRecord {
            regions: surgery.operate.clone(),
            filling: surgery.filling,
            elements: operated.elements.len(),
            volume_cm3: 1e6 * operated.volume_m3,
            tip_before_mm,
            tip_after_mm,
            reach_lost_mm: tip_after_mm.map(|after| after[0] - tip_before_mm[0]),
            deviation_mm: tip_after_mm.map(|after| after[1]),
            made_up_by: None,
            made_up_interval_95: None,
            made_up_to_mm: None,
            made_up_status: None,
            made_up_alarms: Vec::new(),
            made_up_starts: None,
            before: BeforeSurgery {
                body: whole.clone(),
                positions: before.to_vec(),
                elements: operated.elements.clone(),
                made_up: Vec::new(),
            },
        }
    }

    /// Adds the activations that bring the tip back to where it was before surgery, if these are asked for. The operated body, its system
    /// and the positions before surgery, m, are given in one frame, which may be any.
    pub fn make_up(
        &self,
        record: &mut OperationRecord,
        (operated, system): (&Body<3>, &System<3>),
        before: &[Vector3<f64>],
    ) -> Result<(), SimulationError> {
        let Some(tip) = self.whole.tip().filter(|_| self.surgery.make_up) else { return Ok(()) };
        if is_removed(operated, tip) {
            return Ok(());
        }
        let rest = &operated.mesh.nodes;
        let near = (0..rest.len())
            .filter(|n| operated.mesh.fixed.binary_search(n).is_err())
            .filter(|&n| (rest[n] - rest[tip]).norm() < TIP_M);
        let targets: Vec<SpaceMark> = near.map(|node| SpaceMark::node(node, before[node], SD_M)).collect();
        // Nothing is left of the tip.
        if targets.is_empty() {
            return Ok(());
        }
        let usual = SpaceSearch::default();
        // Of a large scar the starts may end at different answers, as `made_up_starts` tells.
        let settings = FitSettings { starts: 2, ..usual.settings };
        let search = SpaceSearch { sides_apart: true, settings, ..usual };
        let fit = search.fit(operated, system, &targets, None)?;
        record.made_up_status = Some(fit.answer.status);
        record.made_up_starts = Some([fit.ended_here(), fit.starts.len()]);
        record.made_up_alarms = fit.alarms;
        record.made_up_by = Some(fit.activations);
        record.made_up_interval_95 = Some(fit.interval_95);
        record.made_up_to_mm = Some(1e3 * fit.rms_m);
        record.before.made_up = fit.answer.positions;
        Ok(())
    }
}

fn is_removed<const D: usize>(body: &Body<D>, node: usize) -> bool {
    !body.mesh.hexahedra.iter().any(|corners| corners.contains(&node))
}

/// Displacement of the tip; `None` if it is removed.
pub(crate) fn foremost_moved_mm<const D: usize>(
    body: &Body<D>,
    positions: &[SVector<f64, D>],
) -> Option<[f64; 3]> {
    let Some(tip) = body.tip() else { return Some([0.0; 3]) };
    let moved_mm = (positions[tip] - body.mesh.nodes[tip]) * 1e3;
    (!is_removed(body, tip)).then(|| hexahedron::in_space(&moved_mm).into())
}
