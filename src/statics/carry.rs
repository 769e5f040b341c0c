//! Bones that are carried away from where they are at rest: a jaw that opens, a hyoid that rises.
//!
//! Moved at once, a bone would turn over the cells beside it, and no step of Newton's method could undo that. So it is carried
//! in parts, each at most half of what the effects can be trusted for, and the body follows after each.

use nalgebra::SVector;

use crate::effect::Configuration;
use crate::system::System;

use super::{Connection, Settings, Solution, Status, Workspace, newton};

/// Residual force at which the body has followed well enough for the next part, N.
const FOLLOWED: f64 = 1e-4;
/// Most parts. The reference tongue's jaw opens by 10 degrees in 12.
const MOST_PARTS: usize = 1000;
/// A part of the way left that is not worth going.
const LEAST_PART: f64 = 1e-6;

/// Solves for the equilibrium at the given tensions (N, one for each muscle of the mesh; those of muscles that the system
/// does not let contract are without effect), starting from the positions in `workspace`, and leaves the result there.
///
/// Converged means a residual force below the tolerance, or below what rounding allows where that is more (very stiff bodies,
/// bodies far from the origin).
///
/// Never panics and never leaves a position that is not finite: what went wrong is in [`Solution::status`]. No accepted step
/// turns a cell over, because every step is cut to where all cells keep at least a tenth of their measure. Where the direct
/// way fails, the load is put on in steps, from rest; where the equilibrium found is not a stable one, the way leads on
/// downhill from it. Bones that the system carries away
/// from where they are at rest are first brought to their places, unless they are there already.
///
/// # Example
/// ```
/// use tongue_fit::statics::{self, Settings, Status, Workspace};
/// use tongue_fit::body::{self, Anatomy};
/// use tongue_fit::muscle::Muscle;
/// use tongue_fit::system::{Model, System};
///
/// let mesh = body::build(&Anatomy::reference()?, body::DEFAULT_SPACING_M)?;
/// let gga = Muscle::GGa.index();
/// let system = System::new(&mesh, &Model::default(), &[gga])?;
/// let mut workspace = Workspace::new(&system); // at rest
/// let mut tensions = [0.0; 8];
/// tensions[gga] = 12.0; // N per metre of thickness
/// let solution = statics::solve(&system, &mut workspace, &tensions, &Settings::default());
/// assert_eq!(solution.status, Status::Converged);
/// let stretch = system.length(workspace.positions(), gga) / system.length(system.rest(), gga);
/// assert!((0.85..0.95).contains(&stretch));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve<const D: usize>(
    system: &System<D>,
    workspace: &mut Workspace<D>,
    tensions: &[f64],
    settings: &Settings,
) -> Solution {
    let mut spent: Option<Solution> = None;
    for _ in 0..MOST_PARTS {
        match carry(system, workspace) {
            Carried::There => {
                let last = newton::solve(system, workspace, tensions, settings);
                return spent.map_or(last, |s| s.and(last));
            }
            Carried::Nowhere => break,
            Carried::APart => {}
        }
        let follow = Settings { tolerance: settings.tolerance.max(FOLLOWED), certify: false, ..*settings };
        let part = newton::solve(system, workspace, tensions, &follow);
        let sum = spent.map_or(part, |s| s.and(part));
        if !matches!(part.status, Status::Converged | Status::Stalled) {
            return sum;
        }
        spent = Some(sum);
    }
    let last = newton::solve(system, workspace, tensions, settings);
    Solution { status: Status::Stalled, ..spent.map_or(last, |s| s.and(last)) }
}

/// How far the bones came.
enum Carried {
    There,
    APart,
    /// Something is in the way at once: too far for the cells beside them, or a wall.
    Nowhere,
}

/// Moves the bones a part of what is left of their way.
fn carry<const D: usize>(system: &System<D>, w: &mut Workspace<D>) -> Carried {
    let there = |&(node, to): &(usize, SVector<f64, D>)| w.positions[node] == to;
    if w.carried.iter().all(there) {
        return Carried::There;
    }
    w.step.fill(SVector::zeros());
    for &(node, to) in &w.carried {
        w.step[node] = to - w.positions[node];
    }
    let at = Configuration { positions: &w.positions, tensions: &w.tensions };
    let limit = system.effects().iter().map(|e| e.step_limit(at, &w.step)).fold(1.0, f64::min);
    if limit < LEAST_PART {
        w.step.fill(SVector::zeros());
        return Carried::Nowhere;
    }
    for &(node, to) in &w.carried {
        if limit < 1.0 {
            w.positions[node] += w.step[node] * (0.5 * limit);
        } else {
            w.positions[node] = to;
        }
    }
    w.factor_ready = false;
    // The step belongs to unknowns only; Newton's method relies on zeros elsewhere.
    w.step.fill(SVector::zeros());
    Carried::APart
}

impl Solution {
    /// The end of `last` with the cost of both.
    fn and(self, last: Self) -> Self {
        Self {
            iterations: self.iterations + last.iterations,
            factorisations: self.factorisations + last.factorisations,
            energy_evaluations: self.energy_evaluations + last.energy_evaluations,
            safeguarded: self.safeguarded + last.safeguarded,
            load_steps: self.load_steps + last.load_steps,
            escapes: self.escapes + last.escapes,
            ridges: self.ridges + last.ridges,
            connection: match self.connection {
                Connection::Downhill => Connection::Downhill,
                _ => last.connection,
            },
            ..last
        }
    }
}
