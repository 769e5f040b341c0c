//! Sensitivities of muscle lengths to the shape of any body at rest and to its constants, by adjoints and differences of forces.
//!
//! A body perturbed by `p` (displaced at rest, or with other constants) with the same displacements `u` of the nodes has forces `f(p, u)`
//! and lengths `L(p, u)`. At equilibrium `f(p, u(p)) = 0`, so `dL/dp = ∂L/∂p + a·∂f/∂p` with the adjoint `a` of the length, its response to
//! a force on every node. The partial derivatives are central differences without a new equilibrium. Only for kappa, which may be ten times
//! larger or smaller, equilibria are solved again. Bodies of springs have exact formulas (`rest_shape`) with the same result.

use nalgebra::{DMatrix, DVector, SVector};

use super::auxiliary::AuxiliaryData;
use super::model::{PerturbedBody, PerturbedPair, PosteriorModel};
use super::parameters::{ParameterValues, SolvedPoint};
use tongue_core::effect::Configuration;
use tongue_core::statics::lanes::{Adjoint, Lanes};
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
pub(crate) fn by_kappa(
    posterior_model: &PosteriorModel,
    point: &GeometrySensitivity<'_>,
) -> Option<DMatrix<f64>> {
    let &GeometrySensitivity { solved, values, auxiliary, .. } = point;
    let (count, base) = (posterior_model.muscles.len(), solved.shapes.len() - 1);
    let of_muscles = base * count;
    let rows = of_muscles + solved.auxiliary.len();
    let Some(sides) = &posterior_model.kappa else { return Some(DMatrix::zeros(rows, 0)) };
    let with = |system: &System<2>| -> Option<DVector<f64>> {
        let loads: Vec<_> = (0..=base)
            .map(|index| posterior_model.load(values, index, Some(solved.shape(index).0)))
            .collect();
        let found = Lanes::new(system).solve(&loads, &SolveSettings::default());
        let converged = found.iter().all(|shape| shape.solution.status == SolveStatus::Converged);
        let lengths: Vec<Vec<f64>> = found.iter().map(|shape| system.lengths(&shape.positions)).collect();
        let stretches =
            (0..of_muscles).map(|row| lengths[row / count][row % count] / lengths[base][row % count]);
        // Activity follows from tensions, which kappa does not change.
        let of_shape = |posture: Option<usize>| found[posture.unwrap_or(base)].positions.as_slice();
        let others = auxiliary.iter().flat_map(|b| b.of_shapes(of_shape));
        let all = DVector::from_iterator(rows, stretches.chain(others));
        (converged && all.iter().all(|v| v.is_finite())).then_some(all)
    };
    let half = (with(&sides[1])? - with(&sides[0])?) / 2.0;
    Some(DMatrix::from_column_slice(rows, 1, half.as_slice()))
}

/// Changes of all computed numbers for one standard deviation of each source of error; one row for each number.
#[derive(Debug, Clone)]
pub struct FiniteDifferences {
    pub ends: DMatrix<f64>,
    pub outline: DMatrix<f64>,
    pub kappa: DMatrix<f64>,
    pub width: DMatrix<f64>,
    pub patch: DMatrix<f64>,
}

impl FiniteDifferences {
    pub fn none(numbers: usize) -> Self {
        let none = || DMatrix::zeros(numbers, 0);
        Self { ends: none(), outline: none(), kappa: none(), width: none(), patch: none() }
    }
}

pub struct Adjoints {
    /// Adjoints of all lengths, shape by shape.
    pub lengths: Vec<Vec<Adjoint<2>>>,
    /// For every auxiliary number that follows from a shape, the number of the shape and its adjoint; `None` for the others.
    pub data: Vec<Option<(usize, Adjoint<2>)>>,
}

pub struct GeometrySensitivity<'a> {
    pub solved: &'a SolvedPoint,
    pub values: &'a ParameterValues,
    pub rates: &'a Adjoints,
    pub auxiliary: &'a [AuxiliaryData],
}

/// The sensitivities at a solved point; `None` where the bodies do not match or another kappa leads to no equilibrium.
pub fn answers(
    posterior_model: &PosteriorModel,
    point: &GeometrySensitivity<'_>,
) -> Option<FiniteDifferences> {
    let &GeometrySensitivity { solved, rates, .. } = point;
    let sides = posterior_model.sides.as_ref()?;
    let (count, base) = (posterior_model.muscles.len(), solved.shapes.len() - 1);
    let of_muscles = base * count;
    let rows = of_muscles + solved.auxiliary.len();
    let of_pair = |([low, high], step): &PerturbedPair| -> Option<DVector<f64>> {
        let slopes = (0..=base)
            .map(|index| Some(slopes_of(posterior_model, [low, high], point, index)? / (2.0 * step)));
        let slopes: Vec<DVector<f64>> = slopes.collect::<Option<_>>()?;
        let stretches = (0..of_muscles).map(|row| solved.stretch_rate(row, 1.0, |index, m| slopes[index][m]));
        // The auxiliary numbers of a shape follow its lengths in `slopes`.
        let mut next = vec![count; base + 1];
        let others = rates.data.iter().map(|own| {
            own.as_ref().map_or(0.0, |&(index, _)| {
                next[index] += 1;
                slopes[index][next[index] - 1]
            })
        });
        Some(DVector::from_iterator(rows, stretches.chain(others)))
    };
    let matrix = |pairs: &[PerturbedPair]| -> Option<DMatrix<f64>> {
        let columns: Vec<DVector<f64>> = pairs.iter().map(of_pair).collect::<Option<_>>()?;
        Some(DMatrix::from_fn(rows, columns.len(), |row, c| columns[c][row]))
    };
    Some(FiniteDifferences {
        ends: matrix(&sides.ends)?,
        outline: matrix(&sides.outline)?,
        kappa: by_kappa(posterior_model, point)?,
        width: matrix(sides.width.as_slice())?,
        patch: matrix(sides.patch.as_slice())?,
    })
}

/// First-order differences of every length of a shape, m, and every auxiliary number of it, between the second body and the first.
fn slopes_of(
    posterior_model: &PosteriorModel,
    [low, high]: [&PerturbedBody; 2],
    &GeometrySensitivity { solved, values, rates, auxiliary }: &GeometrySensitivity<'_>,
    index: usize,
) -> Option<DVector<f64>> {
    let unknowns = posterior_model.system.pattern().nodes();
    let same = [low, high].iter().all(|side| {
        let pattern = side.system.pattern();
        pattern.unknowns() == unknowns.len() && unknowns.iter().all(|&n| pattern.unknown(n).is_some())
    });
    if !same {
        return None;
    }
    let own = values.postures.get(index);
    let tensions = own.map_or(&values.tones, |p| &p.tensions);
    let hyoid = own.map_or((SVector::zeros(), 0.0), |p| (p.hyoid, values.tilt * p.hyoid.x));
    let [[force_low, x_low], [force_high, x_high]] = [low, high]
        .map(|side| side.forces_and_positions(posterior_model, solved.shape(index).0, tensions, hyoid));
    let [of_low, of_high] = [(low, &x_low), (high, &x_high)].map(|(side, x)| -> Vec<f64> {
        let numbers = auxiliary.iter().flat_map(|data| data.of_shape(own.map(|_| index), x));
        side.system.lengths(x).into_iter().chain(numbers).collect()
    });
    let data = rates.data.iter().flatten().filter(|(of, _)| *of == index).map(|(_, adjoint)| adjoint);
    let adjoints = rates.lengths[index].iter().chain(data);
    let slopes: Vec<f64> = Vec::from_iter(adjoints.enumerate().map(|(i, adjoint)| {
        let by_force: f64 =
            unknowns.iter().map(|&n| adjoint.by_node[n].dot(&(force_high[n] - force_low[n]))).sum();
        of_high[i] - of_low[i] + by_force
    }));
    slopes.iter().all(|s| s.is_finite()).then(|| DVector::from_vec(slopes))
}
