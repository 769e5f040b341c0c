//! The shapes to which loads lead from rest as they grow together, jumps included, for several draws at once in lanes.
//!
//! The loads grow in a few steps, each solved from the shape before; where that ends, in more. With a single step 1 of 200 draws of S1 /i/
//! ended at another equilibrium. Whether the body jumps is not determined. A test compares the shapes with those of
//! [`tongue_core::statics::leads_from_rest`], which takes longer.

use nalgebra::SVector;

use tongue_core::statics::lanes::LaneGroup;
use tongue_core::statics::{Connection, SolveSettings};

use super::density::{Density, is_found};
use super::parameters::ParameterValues;

/// Numbers of load steps, tried in this order.
const STEPS: [usize; 2] = [5, 25];
/// Residual force of the shapes before the last one, N. With 0.1 N a fifth of the factors would be saved, but of 14,000 tried draws of S1
/// /i/ and S2 /a/ 10 end elsewhere than in 25 steps (5 with this force), and one of 100 draws of a coarse body off the branch.
const ON_THE_WAY_N: f64 = 1e-4;

/// Positions of all nodes, m, to which the loads of each point lead from rest in a posture, jumps included; `None` where they lead to no
/// equilibrium. `posture` is as in [`super::PosteriorModel::load`]. Loads grow in 5 or 25 steps, without a trace;
/// [`crate::track::FrameSolver::shape_reached_from_rest`] takes three steps or a trace.
pub fn shapes_reached_from_rest(
    density: &Density<'_>,
    group: &mut LaneGroup<'_, 2>,
    points: &[&ParameterValues],
    posture: usize,
) -> Vec<Option<Vec<SVector<f64, 2>>>> {
    let mut found = vec![None; points.len()];
    for steps in STEPS {
        let left: Vec<usize> = (0..points.len()).filter(|i| found[*i].is_none()).collect();
        if left.is_empty() {
            break;
        }
        let values: Vec<&ParameterValues> = left.iter().map(|&i| points[i]).collect();
        for (i, shape) in left.into_iter().zip(follow(density, group, &values, posture, steps)) {
            found[i] = shape;
        }
    }
    found
}

/// Shapes at the end of each point's load path; `None` where the path ends earlier.
fn follow(
    density: &Density<'_>,
    group: &mut LaneGroup<'_, 2>,
    values: &[&ParameterValues],
    posture: usize,
    steps: usize,
) -> Vec<Option<Vec<SVector<f64, 2>>>> {
    let posterior_model = density.posterior_model;
    let mut shapes: Vec<Vec<SVector<f64, 2>>> = vec![posterior_model.system.rest().to_vec(); values.len()];
    let mut good = vec![true; values.len()];
    for step in 1..=steps {
        let part = step as f64 / steps as f64;
        let loads = Vec::from_iter(values.iter().zip(&shapes).map(|(m, positions)| {
            posterior_model.load(&m.scaled(part), posture, (step > 1).then_some(positions.as_slice()))
        }));
        let last = density.settings();
        let tolerance = if step < steps { ON_THE_WAY_N } else { last.tolerance };
        let answers = group.solve(&loads, &SolveSettings { tolerance, ..*last });
        for ((shape, good), answer) in shapes.iter_mut().zip(&mut good).zip(answers) {
            // In a body of springs a descent from a saddle of the energy is allowed, as a jump is; in other bodies it fails, so that the
            // loads grow again in more steps.
            let strayed = answer.solution.connection == Connection::Downhill;
            *good &= is_found(answer) && (posterior_model.is_of_springs() || !strayed);
            shape.clone_from(&answer.positions);
        }
    }
    shapes.into_iter().zip(good).map(|(shape, good)| good.then_some(shape)).collect()
}
