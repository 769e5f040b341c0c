//! Sensitivities of muscle lengths to the shape of any body at rest and to its constants, by adjoints and differences of forces.
//!
//! A body perturbed by `p` (displaced at rest, or with other constants) with the same displacements `u` of the nodes has forces `f(p, u)`
//! and lengths `L(p, u)`. At equilibrium `f(p, u(p)) = 0`, so `dL/dp = ∂L/∂p + a·∂f/∂p` with the adjoint `a` of the length, its response to
//! a force on every node. The partial derivatives are central differences without a new equilibrium. Only for kappa, which may be ten times
//! larger or smaller, equilibria are solved again. Bodies of springs have exact formulas (`rest_shape`) with the same result.

use nalgebra::{DMatrix, DVector, SVector};

use super::linearisation::{DifferentiatedPoint, GeometrySensitivities};
use super::model::{PerturbedBody, PerturbedPair, PosteriorModel};
use super::parameters::Posture;
use tongue_core::effect::Configuration;
use tongue_core::statics::lanes::Lanes;
use tongue_core::statics::{SolveSettings, SolveStatus};
use tongue_core::system::System;

impl PerturbedBody {
    /// Forces on all nodes, N, and positions of all nodes, m, with the tissue displaced from rest as in the body of `posterior_model` at
    /// `positions`, and the hyoid by this displacement, m, and angle, radians.
    fn forces_and_positions(
        &self,
        posterior_model: &PosteriorModel,
        positions: &[SVector<f64, 2>],
        tensions: &[f64],
        (hyoid, angle): (SVector<f64, 2>, f64),
    ) -> [Vec<SVector<f64, 2>>; 2] {
        let (own, system) = (&posterior_model.system, &self.system);
        let mut x = system.rest().to_vec();
        // Nodes of the tissue have the same numbers in both bodies; nodes of bones may have others.
        own.pattern().nodes().iter().for_each(|&n| x[n] += positions[n] - own.rest()[n]);
        self.hyoid.iter().zip(&self.turn).for_each(|(&n, turn)| x[n] += hyoid + turn * angle);
        system.place_path_nodes(&mut x);
        let mut force = vec![SVector::zeros(); x.len()];
        system.force(Configuration { positions: &x, tensions }, &mut force);
        [force, x]
    }
}

/// Change of all computed numbers for one standard deviation of the logarithm of kappa: half the difference between the equilibria to
/// either side, because the change is far from linear. One column, or none if kappa is known; `None` where there is no equilibrium.
pub(super) fn by_kappa(point: &DifferentiatedPoint<'_>) -> Option<DMatrix<f64>> {
    let DifferentiatedPoint { problem, solved, values, .. } = point;
    let (posterior_model, base) = (problem.posterior_model, problem.postures());
    let Some(sides) = &posterior_model.kappa else { return Some(point.matrix(&[])) };
    let with = |system: &System<2>| -> Option<DVector<f64>> {
        let loads: Vec<_> = (0..=base)
            .map(|index| posterior_model.load(values, index, Some(solved.shape(index).0)))
            .collect();
        let found = Lanes::new(system).solve(&loads, &SolveSettings::default());
        let converged = found.iter().all(|shape| shape.solution.status == SolveStatus::Converged);
        let lengths: Vec<Vec<f64>> = found.iter().map(|shape| system.lengths(&shape.positions)).collect();
        let (baseline, postures) = lengths.split_last()?;
        let stretches =
            postures.iter().flat_map(|own| own.iter().zip(baseline).map(|(length, over)| length / over));
        let of_shape = |posture: Option<usize>| found[posture.unwrap_or(base)].positions.as_slice();
        let others = problem.measurements.auxiliary.values(values, of_shape);
        let all = DVector::from_vec(stretches.chain(others).collect());
        (converged && all.iter().all(|v| v.is_finite())).then_some(all)
    };
    Some(point.matrix(&[(with(&sides[1])? - with(&sides[0])?) / 2.0]))
}

/// The sensitivities at a solved point; `None` where the bodies do not match or another kappa leads to no equilibrium.
pub(super) fn of_perturbed_bodies(point: &DifferentiatedPoint<'_>) -> Option<GeometrySensitivities> {
    let sides = point.problem.posterior_model.sides.as_ref()?;
    let of_pair = |(bodies, step): &PerturbedPair| -> Option<DVector<f64>> {
        let slopes = (0..point.adjoints.len()).map(|index| slopes_of(point, bodies, *step, index));
        Some(point.changes(1.0, &slopes.collect::<Option<Vec<_>>>()?, |_| 0.0))
    };
    let matrix = |pairs: &[PerturbedPair]| -> Option<DMatrix<f64>> {
        Some(point.matrix(&pairs.iter().map(of_pair).collect::<Option<Vec<_>>>()?))
    };
    Some(GeometrySensitivities {
        ends: matrix(&sides.ends)?,
        outline: matrix(&sides.outline)?,
        kappa: by_kappa(point)?,
        width: matrix(sides.width.as_slice())?,
        patch: matrix(sides.patch.as_slice())?,
    })
}

/// Differences of the numbers of a shape between two perturbed bodies, divided by twice their step; in the order of its adjoints.
fn slopes_of(
    point: &DifferentiatedPoint<'_>,
    [low, high]: &[PerturbedBody; 2],
    step: f64,
    index: usize,
) -> Option<Vec<f64>> {
    let DifferentiatedPoint { problem, solved, values, .. } = point;
    let posterior_model = problem.posterior_model;
    let unknowns = posterior_model.system.pattern().nodes();
    let same = [low, high].iter().all(|side| {
        let pattern = side.system.pattern();
        pattern.unknowns() == unknowns.len() && unknowns.iter().all(|&n| pattern.unknown(n).is_some())
    });
    if !same {
        return None;
    }
    let Posture { tensions, hyoid } = &values.postures[index];
    let hyoid = (*hyoid, values.tilt * hyoid.x);
    let posture = (index < problem.postures()).then_some(index);
    let [[force_low, x_low], [force_high, x_high]] = [low, high]
        .map(|side| side.forces_and_positions(posterior_model, solved.shape(index).0, tensions, hyoid));
    let [of_low, of_high] = [(low, &x_low), (high, &x_high)].map(|(side, x)| -> Vec<f64> {
        let numbers = problem.measurements.auxiliary.of_shape(posture, x);
        side.system.lengths(x).into_iter().chain(numbers).collect()
    });
    let slopes: Vec<f64> = Vec::from_iter(point.adjoints[index].iter().enumerate().map(|(i, adjoint)| {
        let by_force: f64 =
            unknowns.iter().map(|&n| adjoint.by_node[n].dot(&(force_high[n] - force_low[n]))).sum();
        (of_high[i] - of_low[i] + by_force) / (2.0 * step)
    }));
    slopes.iter().all(|s| s.is_finite()).then_some(slopes)
}
