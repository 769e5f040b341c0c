//! Whether loads lead from rest to shapes as they grow together, jumps included, for several shapes at once in lanes.
//!
//! The loads grow in a few steps, each solved from the shape before; if these do not lead to the shape, in more. With a single step 1 of
//! 200 draws of S1 /i/ ended at another equilibrium. Whether the body jumps is not determined. A test compares the answers with those of
//! [`tongue_core::statics::leads_from_rest`], which takes longer.

use nalgebra::SVector;

use tongue_core::statics::lanes::{LaneGroup, Load};
use tongue_core::statics::{Connection, SAME_SHAPE_M, SolveSettings};

use super::density::{Density, is_found};
use super::parameters::ParameterValues;

/// Numbers of load steps; a shape is accepted if one of them leads to it.
const STEPS: [usize; 2] = [5, 25];
/// Residual force of the shapes before the last one, N.
const ON_THE_WAY_N: f64 = 1e-4;

/// Whether the loads of each point lead from rest, jumps included, to the shape of its posture, given by muscle lengths (m); `posture` is
/// as in [`super::PosteriorModel::load`]. Loads grow in 5 or 25 steps, without a trace;
/// [`crate::track::FrameSolver::shape_reached_from_rest`] compares positions after three steps or a trace.
pub fn lengths_reached_from_rest(
    density: &Density<'_>,
    group: &mut LaneGroup<'_, 2>,
    points: &[(&ParameterValues, &[f64])],
    posture: usize,
) -> Vec<bool> {
    let mut found = vec![false; points.len()];
    for steps in STEPS {
        let left: Vec<usize> = (0..points.len()).filter(|i| !found[*i]).collect();
        if left.is_empty() {
            break;
        }
        let values: Vec<&ParameterValues> = left.iter().map(|&i| points[i].0).collect();
        for (&i, lengths) in left.iter().zip(follow(density, group, &values, posture, steps)) {
            found[i] =
                lengths.is_some_and(|l| l.iter().zip(points[i].1).all(|(a, b)| (a - b).abs() < SAME_SHAPE_M));
        }
    }
    found
}

/// Muscle lengths at the end of each point's load path, m; `None` where the path ends earlier.
fn follow(
    density: &Density<'_>,
    group: &mut LaneGroup<'_, 2>,
    values: &[&ParameterValues],
    posture: usize,
    steps: usize,
) -> Vec<Option<Vec<f64>>> {
    let system = &density.posterior_model.system;
    let mut shapes: Vec<Vec<SVector<f64, 2>>> = vec![system.rest().to_vec(); values.len()];
    let mut good = vec![true; values.len()];
    for step in 1..=steps {
        let part = step as f64 / steps as f64;
        let loads: Vec<Load<'_, 2>> = values
            .iter()
            .zip(&shapes)
            .map(|(m, positions)| {
                let start = (step > 1).then_some(positions.as_slice());
                Load { start, ..density.posterior_model.load(&m.scaled(part), posture, None) }
            })
            .collect();
        let last = density.settings();
        let tolerance = if step < steps { ON_THE_WAY_N } else { last.tolerance };
        let answers = group.solve(&loads, &SolveSettings { tolerance, ..*last });
        for ((shape, good), answer) in shapes.iter_mut().zip(&mut good).zip(answers) {
            // In a body of springs a descent from a saddle of the energy is allowed, as a jump is; in other bodies it fails, so that the
            // loads grow again in more steps.
            let strayed = answer.solution.connection == Connection::Downhill;
            *good &= is_found(answer) && (density.posterior_model.is_of_springs() || !strayed);
            shape.clone_from(&answer.positions);
        }
    }
    shapes.iter().zip(good).map(|(shape, good)| good.then(|| system.lengths(shape))).collect()
}
