//! The information that each kind of data adds about the muscles, and measurements that contradict the others.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::half_normal;
use tongue_core::statistics::mean_and_variance;
use tongue_input::measured::ByMuscle;

use super::density::Density;
use super::map::Mode;
use super::run::{Posterior, Sampling, Status, sample};

/// Standard deviations of the changes of tensions in a posture without one kind of data and with it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gain {
    pub kind: String,
    /// Without it, N per metre of thickness; null where the chains without it have not mixed or could not begin.
    pub sd_without_n: Option<ByMuscle<f64>>,
    pub sd_with_n: ByMuscle<f64>,
}

/// Of every kind of data beside the stretches what it adds in a posture: the posterior is sampled once more without it. None where the chains
/// of the whole posterior have not mixed.
pub fn gains(posterior: &Posterior<'_>, posture: usize, settings: &Sampling) -> Vec<Gain> {
    let density = &posterior.density;
    if posterior.status != Status::Mixed {
        return Vec::new();
    }
    let of_kind = |kind: &String| {
        let without = sample(density.ground, density.seen.without_kind(kind), settings).ok();
        let told = without.filter(|without| without.status == Status::Mixed);
        Gain {
            kind: kind.clone(),
            sd_without_n: told.map(|without| sd_of_changes(&without, posture)),
            sd_with_n: sd_of_changes(posterior, posture),
        }
    };
    density.seen.beside.iter().map(|b| of_kind(&b.kind)).collect()
}

fn sd_of_changes(posterior: &Posterior<'_>, posture: usize) -> ByMuscle<f64> {
    let muscles = &posterior.density.ground.muscles;
    let sd = |m: usize| mean_and_variance(posterior.draws.iter().map(|d| d.change(posture, m))).1.sqrt();
    ByMuscle::new(muscles, (0..muscles.len()).map(sd))
}

/// A probability below this, shared among all tests of a posterior, contradicts what the other data lead to expect.
const CONTRADICTS: f64 = 1e-3;

/// A measured number, or a whole kind of data, that is further from what all other data lead to expect than the errors allow.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contradiction {
    pub name: String,
    /// Number of its posture; null for the baseline and where it is of several.
    pub posture: Option<usize>,
    pub p: f64,
}

/// The contradictions of a posterior, each number and each kind of data predicted from all others in the linear problem at the mode. With
/// `K = J J' + C` and `r` what was measured less what the linear model gives where all scores are zero, the numbers `B` are away by
/// `v' (K⁻¹_BB)⁻¹ v` with `v = (K⁻¹ r)_B`, which is chi-squared with as many degrees of freedom as there are numbers.
pub fn contradictions(density: &Density<'_>, mode: &Mode) -> Vec<Contradiction> {
    let jacobian = mode.linear.jacobian.select_rows(density.rows());
    let covariance: DMatrix<f64> = &jacobian * jacobian.transpose() + density.covariance();
    let Some(inverse) = covariance.cholesky().map(|factor| factor.inverse()) else { return Vec::new() };
    let place = &mode.place;
    let residuals: DVector<f64> =
        density.residuals(&place.lengths, &place.baseline_lengths, &place.beside) + &jacobian * &mode.scores;
    let pulls = &inverse * residuals;
    let seen = &density.seen;
    let p = |from: usize, count: usize| {
        let v = pulls.rows(from, count).into_owned();
        let block = inverse.view((from, from), (count, count)).into_owned();
        block.cholesky().map_or(1.0, |factor| beyond(v.dot(&factor.solve(&v)), count))
    };
    let numbers = seen.measured_names().into_iter().enumerate();
    let mut tests: Vec<Contradiction> =
        numbers.map(|(i, (name, posture))| Contradiction { name, posture, p: p(i, 1) }).collect();
    let mut from = seen.len();
    for beside in seen.beside.iter() {
        if beside.len() > 1 {
            let posture = beside.only_posture();
            tests.push(Contradiction {
                name: format!("{} as a whole", beside.kind),
                posture,
                p: p(from, beside.len()),
            });
        }
        from += beside.len();
    }
    let least = CONTRADICTS / tests.len().max(1) as f64;
    tests.into_iter().filter(|test| test.p < least).collect()
}

/// Probability that a chi-squared number of so many degrees of freedom is larger: exact for one and two, and from there by the recurrence
/// `Q(x; k + 2) = Q(x; k) + (x/2)^(k/2) exp(-x/2) / Gamma(k/2 + 1)` (Abramowitz and Stegun 1964, 26.4.8).
fn beyond(value: f64, freedom: usize) -> f64 {
    let half = 0.5 * value.max(0.0);
    let (mut tail, mut term) = if freedom % 2 == 1 {
        (
            2.0 * half_normal::upper_tail((2.0 * half).sqrt()),
            2.0 * (half / std::f64::consts::PI).sqrt() * (-half).exp(),
        )
    } else {
        ((-half).exp(), half * (-half).exp())
    };
    for k in (2 - freedom % 2..freedom).step_by(2) {
        tail += term;
        term *= half / (0.5 * k as f64 + 1.0);
    }
    tail
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_of_chi_squared_numbers_are_those_of_the_tables() {
        let of_tables = [
            (10.828, 1, 1e-3),
            (13.816, 2, 1e-3),
            (7.815, 3, 0.05),
            (20.515, 5, 1e-3),
            (29.588, 10, 1e-3),
            (18.307, 10, 0.05),
            (43.773, 30, 0.05),
        ];
        for (value, freedom, p) in of_tables {
            let found = beyond(value, freedom);
            assert!((found / p - 1.0).abs() < 1e-3, "{value} {freedom}: {found}");
        }
    }
}
