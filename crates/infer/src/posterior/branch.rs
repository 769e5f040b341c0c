//! The shapes to which tensions lead from rest as they grow together, in lanes. A body may snap on its way there, which only
//! [`tongue_core::statics::trace()`] would tell.
//!
//! Nearly always one step leads there. Where it does not, tensions and bones grow in more and more steps, each from the shape before.

use nalgebra::SVector;

use tongue_core::statics::Connection;
use tongue_core::statics::lanes::{Group, Load};

use super::density::{Density, Meaning, is_found};

/// Steps in which the loads grow from nothing: the first number of them that leads to an equilibrium counts.
const STEPS: [usize; 3] = [1, 5, 25];
/// Lengths that differ by less are those of one shape, m.
pub const SAME_M: f64 = 1e-7;

/// Positions of `shape` ([`Density::load`]) of every point, m, to which its loads lead from rest; `None` where they lead to no equilibrium.
pub fn from_rest(
    density: &Density<'_>,
    group: &mut Group<'_, 2>,
    meanings: &[Meaning],
    shape: usize,
) -> Vec<Option<Vec<SVector<f64, 2>>>> {
    let mut found = vec![None; meanings.len()];
    for steps in STEPS {
        let left: Vec<usize> = (0..meanings.len()).filter(|i| found[*i].is_none()).collect();
        if left.is_empty() {
            break;
        }
        let own: Vec<&Meaning> = left.iter().map(|&i| &meanings[i]).collect();
        for (&i, positions) in left.iter().zip(follow(density, group, &own, shape, steps)) {
            found[i] = positions;
        }
    }
    found
}

/// Positions of `shape` of every point at the end of the way from rest, m; `None` where the way ends before.
fn follow(
    density: &Density<'_>,
    group: &mut Group<'_, 2>,
    meanings: &[&Meaning],
    shape: usize,
    steps: usize,
) -> Vec<Option<Vec<SVector<f64, 2>>>> {
    let system = &density.ground.system;
    let mut shapes: Vec<Vec<SVector<f64, 2>>> = vec![system.rest().to_vec(); meanings.len()];
    let mut good = vec![true; meanings.len()];
    for step in 1..=steps {
        if !good.contains(&true) {
            break;
        }
        let part = step as f64 / steps as f64;
        let loads: Vec<Load<'_, 2>> = meanings
            .iter()
            .zip(&shapes)
            .map(|(m, positions)| {
                let start = (step > 1).then_some(positions.as_slice());
                Load { start, ..density.load(&m.scaled(part), shape, None) }
            })
            .collect();
        let answers = group.solve(&loads, density.settings()).to_vec();
        for ((shape, good), answer) in shapes.iter_mut().zip(&mut good).zip(answers) {
            // Lanes leave no ridge downhill; who does may be on another branch, and is followed in more steps.
            let strayed = answer.solution.connection == Connection::Downhill;
            *good &= is_found(&answer) && (density.ground.is_of_springs() || !strayed);
            *shape = answer.positions;
        }
    }
    shapes.into_iter().zip(good).map(|(shape, good)| good.then_some(shape)).collect()
}
