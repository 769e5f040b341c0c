//! What the rounding of the data does to an answer: every length is drawn anew within its rounding interval, and refitted.
//!
//! A length printed as 41 mm may be anything from 40.5 to 41.5 mm, each as likely. So every measured and baseline length is
//! drawn uniformly from its interval, independently, the tensions are fitted to the draw from the answer at hand, and the
//! 2.5 % and 97.5 % quantiles of what comes out are reported. The contracting muscles stay those of the answer; a muscle that
//! a draw makes longer than its baseline ends with no tension. Where the target does not determine the tensions, the interval
//! is that of the smallest total tension: how far others reach is said by [`super::identifiability`].

use nalgebra::SVector;
use serde::Serialize;

use crate::measured::{ROUNDING_MM, Target, TargetKind};
use crate::muscle::{COUNT, Muscle, PerMuscle};
use crate::system::System;

use super::fit::inverse;
use super::forward::Forward;
use super::gauss_newton::refit;
use super::identifiability::onto_target;
use super::problem::Problem;
use super::{Fit, Settings};

/// Part of the draws that an interval holds.
pub const LEVEL: f64 = 0.95;

/// The middle 95 % of what came out of the draws.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Interval {
    /// 2.5 % quantile.
    pub low: f64,
    /// 97.5 % quantile.
    pub high: f64,
}

impl Interval {
    /// Whether the value lies within.
    pub fn holds(&self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    /// Quantiles of Weibull's kind (position `p (n + 1)`), which do not narrow with few draws. `None` without values.
    fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        let quantile = |p: f64| {
            let position = (p * (values.len() + 1) as f64 - 1.0).clamp(0.0, last as f64);
            let below = position.floor() as usize;
            let above = (below + 1).min(last);
            values[below] + (position - below as f64) * (values[above] - values[below])
        };
        let tail = 0.5 * (1.0 - LEVEL);
        Some(Self { low: quantile(tail), high: quantile(1.0 - tail) })
    }
}

/// The 95 % intervals of one fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Intervals {
    /// Draws that were refitted.
    pub draws: usize,
    /// Draws for which no equilibrium was found; they are in no interval.
    pub failed: usize,
    /// Draws that no tensions within the bounds meet.
    pub not_met: usize,
    /// Of every active muscle's tension, N.
    pub tensions: Vec<Interval>,
    /// Of every muscle's simulated length over that of GGa.
    pub ratios: PerMuscle<Interval>,
    /// Of every muscle's simulated length over that at rest.
    pub stretches: PerMuscle<Interval>,
}

/// Draws and refits. The same seed gives the same draws, whatever else runs. `None` where no draw could be fitted.
pub fn intervals<const D: usize>(
    system: &System<D>,
    numbers: PerMuscle<usize>,
    fit: &Fit<D>,
    settings: &Settings,
    draws: usize,
    seed: u64,
) -> Option<Intervals> {
    let answer: Vec<f64> = fit.target.active.iter().map(|m| fit.tensions[m.index()]).collect();
    let mut random = fastrand::Rng::with_seed(seed);
    let (mut failed, mut not_met) = (0, 0);
    let mut tensions = vec![Vec::with_capacity(draws); answer.len()];
    let mut ratios: PerMuscle<Vec<f64>> = Default::default();
    let mut stretches: PerMuscle<Vec<f64>> = Default::default();
    for _ in 0..draws {
        let target = redraw(&fit.target, &mut random);
        let Some((found, lengths, misfit)) =
            fit_draw(system, numbers, &target, settings, &answer, &fit.positions)
        else {
            failed += 1;
            continue;
        };
        not_met += usize::from(misfit > settings.misfit_tolerance);
        tensions.iter_mut().zip(found).for_each(|(all, t)| all.push(t));
        let (r, s) = (
            TargetKind::Ratio.values(&lengths, &fit.rest_lengths),
            TargetKind::Stretch.values(&lengths, &fit.rest_lengths),
        );
        for i in 0..COUNT {
            ratios[i].push(r[i]);
            stretches[i].push(s[i]);
        }
    }
    let all = |values: PerMuscle<Vec<f64>>| -> Option<PerMuscle<Interval>> {
        let found: Vec<Interval> = values.into_iter().map(Interval::of).collect::<Option<_>>()?;
        found.try_into().ok()
    };
    Some(Intervals {
        draws,
        failed,
        not_met,
        tensions: tensions.into_iter().map(Interval::of).collect::<Option<_>>()?,
        ratios: all(ratios)?,
        stretches: all(stretches)?,
    })
}

fn fit_draw<const D: usize>(
    system: &System<D>,
    numbers: PerMuscle<usize>,
    target: &Target,
    settings: &Settings,
    start: &[f64],
    positions: &[SVector<f64, D>],
) -> Option<(Vec<f64>, PerMuscle<f64>, f64)> {
    let inverse = inverse(system, numbers, target, settings);
    let mut forward = Forward::new(&inverse, settings);
    forward.begin_at(start, positions);
    let (mut tensions, mut residuals) = refit(&mut forward, settings, start)?;
    if inverse.is_undetermined() {
        // As the answer itself is.
        tensions = onto_target(&mut forward, &tensions);
        residuals = forward.residuals(&tensions)?;
    }
    let lengths = forward.lengths();
    Some((tensions, numbers.map(|n| lengths[n]), forward.misfit(Some(&residuals))))
}

/// The same target with every length drawn from its rounding interval.
fn redraw(target: &Target, random: &mut fastrand::Rng) -> Target {
    let mut draw = |mm: &PerMuscle<f64>| mm.map(|l| l + ROUNDING_MM * (2.0 * random.f64() - 1.0));
    let (measured_mm, baseline_mm) = (draw(&target.measured_mm), draw(&target.baseline_mm));
    let values = target.kind.values(&measured_mm, &baseline_mm);
    Target { measured_mm, baseline_mm, values, ..target.clone() }
}

/// Lowest and highest value of the compared quantity that the rounding of the lengths allows for `muscle`.
pub fn rounding_range(target: &Target, muscle: Muscle) -> (f64, f64) {
    let over = match target.kind {
        TargetKind::Ratio => target.measured_mm[Muscle::GGa.index()],
        TargetKind::Stretch => target.baseline_mm[muscle.index()],
    };
    let length = target.measured_mm[muscle.index()];
    ((length - ROUNDING_MM) / (over + ROUNDING_MM), (length + ROUNDING_MM) / (over - ROUNDING_MM))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_hold_the_middle_of_the_draws() {
        let i = Interval::of((1..=199).rev().map(f64::from).collect()).unwrap();
        assert!((i.low - 5.0).abs() < 1e-12 && (i.high - 195.0).abs() < 1e-12, "{i:?}");
        assert!(i.holds(5.5) && !i.holds(4.5));
        assert_eq!(Interval::of(vec![3.0]), Some(Interval { low: 3.0, high: 3.0 }));
        assert_eq!(Interval::of(Vec::new()), None);
    }
}
