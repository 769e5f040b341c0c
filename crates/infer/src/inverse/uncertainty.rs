//! Uncertainty of an answer by the rounding of the data: every length is drawn within its rounding interval,
//! and refitted.
//!
//! A length printed as 41 mm may be anything from 40.5 to 41.5 mm with equal probability. So every measured
//! and baseline length is drawn independently from the uniform distribution on its interval, the tensions are
//! fitted to the draw starting from the answer, and the 2.5 % and 97.5 % quantiles of the results are
//! reported. The contracting muscles stay those of the answer; a muscle that is longer than its baseline in a
//! draw ends without tension. If the target does not determine the tensions, the interval is that of the
//! smallest total tension; [`super::identifiability`] gives the range of the others.

use nalgebra::SVector;
use serde::Serialize;

use tongue_input::measured::{Target, TargetKind};

use super::forward::Forward;
use super::gauss_newton::refit;
use super::matched::Matched;
use super::on_target::{nearest_to_others, onto_target};
use super::problem::Problem;
use super::{Fit, FitSettings, Setup};

/// Part of the draws inside an interval.
pub const LEVEL: f64 = 0.95;

/// The central 95 % interval of the draws.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
}

impl Interval {
    pub fn holds(&self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    /// Weibull's quantiles (position `p (n + 1)`), which do not become narrower with few draws. `None`
    /// without values.
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

#[derive(Debug, Clone, PartialEq)]
pub struct Intervals {
    /// Number of refitted draws.
    pub draws: usize,
    /// Number of draws without an equilibrium; they are in no interval.
    pub failed: usize,
    /// Number of draws that no tensions within the bounds meet.
    pub not_met: usize,
    /// Intervals of every active muscle's tension, N.
    pub tensions: Vec<Interval>,
    /// Intervals of every muscle's simulated length over that of the reference.
    pub ratios: Vec<Interval>,
    /// Intervals of every muscle's simulated length over that in the baseline.
    pub stretches: Vec<Interval>,
}

/// Draws and refits. The draws depend only on the seed. `None` if no draw could be fitted.
pub fn intervals<const D: usize>(
    setup: &Setup<D>,
    matched: &Matched,
    fit: &Fit<D>,
    settings: &FitSettings,
    draws: usize,
    seed: u64,
) -> Option<Intervals> {
    let answer = &fit.unknowns;
    let mut random = fastrand::Rng::with_seed(seed);
    let (mut failed, mut not_met) = (0, 0);
    let mut tensions = vec![Vec::with_capacity(draws); fit.target.active.len()];
    let mut ratios = vec![Vec::with_capacity(draws); fit.muscles.len()];
    let mut stretches = ratios.clone();
    for _ in 0..draws {
        let drawn = Matched { target: redraw(&fit.target, &mut random), ..matched.clone() };
        let Some((found, lengths, misfit)) = fit_draw(setup, &drawn, settings, answer, &fit.positions) else {
            failed += 1;
            continue;
        };
        not_met += usize::from(misfit > settings.misfit_tolerance);
        tensions.iter_mut().zip(found).for_each(|(all, t)| all.push(t));
        for (kind, all) in [(TargetKind::Ratio, &mut ratios), (TargetKind::Stretch, &mut stretches)] {
            let values = kind.values(&lengths, &fit.baseline_lengths, fit.target.reference);
            all.iter_mut().zip(values).for_each(|(all, value)| all.push(value));
        }
    }
    let all = |values: Vec<Vec<f64>>| values.into_iter().map(Interval::of).collect::<Option<Vec<_>>>();
    Some(Intervals {
        draws,
        failed,
        not_met,
        tensions: all(tensions)?,
        ratios: all(ratios)?,
        stretches: all(stretches)?,
    })
}

/// The unknowns (tensions of the active muscles first), lengths of all muscles and the misfit of one draw.
fn fit_draw<const D: usize>(
    setup: &Setup<D>,
    matched: &Matched,
    settings: &FitSettings,
    start: &[f64],
    positions: &[SVector<f64, D>],
) -> Option<(Vec<f64>, Vec<f64>, f64)> {
    let inverse = matched.inverse(setup, settings);
    let mut forward = Forward::new(&inverse, settings);
    forward.begin_at(start, positions);
    let (mut tensions, mut residuals) = refit(&mut forward, settings, start)?;
    if inverse.is_undetermined() {
        // The draw is moved onto the target like the answer itself.
        tensions = onto_target(&mut forward, &tensions);
        tensions = nearest_to_others(&mut forward, &tensions);
        residuals = forward.residuals(&tensions)?;
    }
    Some((tensions, matched.pick(&forward.lengths()), forward.misfit(Some(&residuals))))
}

/// The target with every length drawn from its rounding interval.
fn redraw(target: &Target, random: &mut fastrand::Rng) -> Target {
    let mut draw = |mm: &[f64], half: &[f64]| -> Vec<f64> {
        mm.iter().zip(half).map(|(l, h)| l + h * (2.0 * random.f64() - 1.0)).collect()
    };
    let measured_mm = draw(&target.measured_mm, &target.half_width_mm);
    let baseline_mm = draw(&target.baseline_mm, &target.baseline_half_width_mm);
    target.with_lengths(measured_mm, baseline_mm)
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
