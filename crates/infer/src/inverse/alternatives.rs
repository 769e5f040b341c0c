//! Other answers: local optima from other starts, and other choices of contracting muscles that meet the same target.

use tongue_core::body::Mesh;
use tongue_core::system::{Model, System};
use tongue_input::measured::Target;

use super::forward::Forward;
use super::gauss_newton::refit;
use super::matched::Matched;
use super::problem::Problem;
use super::{Fit, FitError, FitSettings, Setup};

/// Answers whose tensions all differ by less than this are the same, N.
const SAME_ANSWER: f64 = 0.5;
/// Initial tension of a muscle that is added to a subset, N.
const FROM: f64 = 5.0;

/// A local optimum other than the answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Optimum {
    /// Tensions of the active muscles, N.
    pub tensions: Vec<f64>,
    /// Objective; the answer's is smaller.
    pub cost: f64,
    /// Number of starts that ended there.
    pub starts: usize,
}

/// Ends of converged starts other than the answer, best first.
pub fn optima<const D: usize>(fit: &Fit<D>) -> Vec<Optimum> {
    let answer = fit.active_tensions();
    let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME_ANSWER);
    let mut found: Vec<Optimum> = Vec::new();
    for start in fit.starts.iter().filter(|s| s.converged && !same(&s.x, &answer)) {
        match found.iter_mut().find(|o| same(&o.tensions, &start.x)) {
            Some(o) => o.starts += 1,
            None => {
                let tensions = start.x[..answer.len()].to_vec();
                found.push(Optimum { tensions, cost: start.cost, starts: 1 });
            }
        }
    }
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    found
}

/// Another choice of contracting muscles, fitted to the same equations.
#[derive(Debug, Clone, PartialEq)]
pub struct Subset {
    /// The contracting muscles: positions in the target.
    pub muscles: Vec<usize>,
    pub tensions: Vec<f64>,
    pub misfit: f64,
    /// Root mean square residual of all muscles of the row.
    pub row_rms: f64,
    pub within_rounding: bool,
}

/// Fits every choice of contracting muscles that differs from the answer's in at most `changes` muscles to
/// the same values. Order: those within rounding first, by the number of muscles and then by the residual of
/// the whole row; then the others by misfit. A subset in which a muscle ends without tension is left out,
/// because a smaller one gives the same answer.
pub fn subsets<const D: usize>(
    mesh: &Mesh<D>,
    model: &Model,
    setup: &Setup<D>,
    matched: &Matched,
    fit: &Fit<D>,
    settings: &FitSettings,
    changes: u32,
) -> Result<Vec<Subset>, FitError> {
    let mut found = Vec::new();
    for active in choices(&fit.target, changes) {
        let other = Matched { target: Target { active, ..fit.target.clone() }, ..matched.clone() };
        if let Some(subset) = one(mesh, model, setup, &other, fit, settings)?
            && subset.tensions.iter().all(|t| *t > super::AT_BOUND)
        {
            found.push(subset);
        }
    }
    found.sort_by(|a, b| {
        let group = b.within_rounding.cmp(&a.within_rounding);
        let inside = || a.muscles.len().cmp(&b.muscles.len()).then(a.row_rms.total_cmp(&b.row_rms));
        group.then_with(|| if a.within_rounding { inside() } else { a.misfit.total_cmp(&b.misfit) })
    });
    Ok(found)
}

/// Choices of active muscles (positions, ascending) that differ from the target's in 1 to `changes` muscles,
/// without the empty choice, in the order of binary numbers whose digits are the muscles.
fn choices(target: &Target, changes: u32) -> Vec<Vec<usize>> {
    let mut all: Vec<Vec<usize>> = vec![Vec::new()];
    for muscle in (0..target.muscles.len()).rev() {
        let differences = |choice: &[usize]| {
            (muscle..target.muscles.len()).filter(|m| choice.contains(m) != target.active.contains(m)).count()
        };
        let with = all.iter().map(|choice| [&[muscle][..], choice].concat());
        let next = all.iter().cloned().chain(with);
        all = next.filter(|choice| differences(choice) <= changes as usize).collect();
    }
    all.retain(|choice| !choice.is_empty() && *choice != target.active);
    all.sort_by(|a, b| a.iter().rev().cmp(b.iter().rev()));
    all
}

fn one<const D: usize>(
    mesh: &Mesh<D>,
    model: &Model,
    setup: &Setup<D>,
    matched: &Matched,
    fit: &Fit<D>,
    settings: &FitSettings,
) -> Result<Option<Subset>, FitError> {
    let target = &matched.target;
    let own;
    let setup = if setup.premises.is_thesis() {
        own = Setup::at_rest(System::new(mesh, model, &matched.contracting())?);
        &own
    } else {
        setup
    };
    let inverse = matched.inverse(setup, settings);
    let mut forward = Forward::new(&inverse, settings);
    let near: Vec<f64> = target.active.iter().map(|&m| fit.tensions[m]).collect();
    let mut best: Option<(f64, Subset)> = None;
    let moved = &fit.unknowns[fit.target.active.len()..];
    for mut start in [near, vec![FROM; target.active.len()]] {
        start.extend(moved);
        let Some((mut tensions, residuals)) = refit(&mut forward, settings, &start) else { continue };
        let cost = forward.cost(&tensions, Some(&residuals));
        if best.as_ref().is_some_and(|(least, _)| *least <= cost) {
            continue;
        }
        let lengths = matched.pick(&forward.lengths());
        let measured = target.muscles.len();
        let simulated = target.simulated(&lengths[..measured], &fit.baseline_lengths[..measured]);
        let within = |m: &usize| {
            let (low, high) = target.rounding_range(*m);
            (low..=high).contains(&simulated[*m])
        };
        let squares: f64 = target.compared().map(|m| (simulated[m] - target.values[m]).powi(2)).sum();
        tensions.truncate(target.active.len());
        let subset = Subset {
            muscles: target.active.clone(),
            tensions,
            misfit: forward.misfit(Some(&residuals)),
            row_rms: (squares / target.compared().count() as f64).sqrt(),
            within_rounding: target.fitted.iter().all(within),
        };
        best = Some((cost, subset));
    }
    Ok(best.map(|(_, subset)| subset))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tongue_input::measured::{Dataset, TargetKind, TargetOptions, Vowel};

    #[test]
    fn choices_are_those_of_binary_numbers_and_as_few_as_the_changes_allow() {
        let data = Dataset::reference().unwrap();
        let vowel = Vowel::new("a").unwrap();
        let target = Target::new(&data, "S2", &vowel, TargetKind::Ratio, &TargetOptions::default()).unwrap();
        let own: u32 = target.active.iter().map(|m| 1 << m).sum();
        for changes in [1, 2, 8] {
            let expected: Vec<Vec<usize>> = (1u32..256)
                .filter(|c| (1..=changes).contains(&(c ^ own).count_ones()))
                .map(|c| (0..8).filter(|m| c & 1 << m != 0).collect())
                .collect();
            assert_eq!(choices(&target, changes), expected, "{changes}");
        }
        assert!(choices(&target, 0).is_empty());
    }
}
