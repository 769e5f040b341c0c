//! Robustness: permuted names of muscles, other vowels as baseline, and muscles left out of the fit.

use tongue_core::body::Mesh;
use tongue_core::parallel;
use tongue_core::statistics::distinct;
use tongue_infer::inverse::{FitError, FitSettings, Matched, Setup};
use tongue_input::measured::{Dataset, Lengths, Target, Vowel};

use super::cases::{Case, cases, of_rows, subjects};
use super::levers::{Bench, Levers, best_column, errors};
use super::statistics::{best_shrunk, constant, gaussian, root_mean};
use crate::StudyError;

use super::{OtherBaseline, Permuted, Progress, Score, WithoutMuscle};

/// Mean square error of each case, at the tone that is best for the other subjects.
fn tuned_outside(cases: &[Case], errors: &[Vec<f64>]) -> Vec<f64> {
    let judged = |row: usize| {
        let column = best_column(errors, |other| cases[other].subject != cases[row].subject);
        errors[row][column]
    };
    (0..cases.len()).map(judged).collect()
}

/// `count` permutations of the muscles, without the identity.
pub fn orders(muscles: usize, count: u64, seed: u64) -> Vec<Vec<usize>> {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut orders = Vec::new();
    while muscles > 2 && (orders.len() as u64) < count {
        let mut order: Vec<usize> = (0..muscles).collect();
        random.shuffle(&mut order);
        if order.iter().enumerate().any(|(i, o)| i != *o) {
            orders.push(order);
        }
    }
    orders
}

/// Lengths under permuted names of muscles.
pub fn renamed(lengths: &Lengths, order: &[usize]) -> Lengths {
    Lengths {
        length_mm: order.iter().map(|&o| lengths.length_mm[o]).collect(),
        half_width_mm: order.iter().map(|&o| lengths.half_width_mm[o]).collect(),
        ..lengths.clone()
    }
}

/// Errors with permuted names of muscles; the tone is tuned for every permutation without the subject.
pub fn permuted(
    bench: &Bench,
    data: &Dataset,
    mesh: &Mesh<2>,
    baseline: &Vowel,
    [count, seed]: [u64; 2],
    progress: &Progress<'_>,
) -> Result<Permuted, StudyError> {
    let setups: Vec<Setup> =
        Levers::tones(true).iter().map(|l| bench.setup(l)).collect::<Result<_, FitError>>()?;
    let rms = |cases: &[Case]| root_mean(&tuned_outside(cases, &errors(bench, cases, &setups, || {})));
    let orders = orders(data.muscles().len(), count, seed);
    let truth = rms(&cases(data, mesh, baseline));
    let all = parallel::map(&orders, |order| {
        let cases = of_rows(data, mesh, baseline, |lengths| renamed(lengths, order));
        let found = if cases.is_empty() { f64::NAN } else { rms(&cases) };
        progress.add(1, "permuted names");
        found
    });
    let all: Vec<f64> = all.into_iter().filter(|r| r.is_finite()).collect();
    Ok(Permuted {
        lowest: all.iter().copied().fold(f64::INFINITY, f64::min),
        mean: all.iter().sum::<f64>() / all.len() as f64,
        permuted_rms: all,
        true_rms: truth,
    })
}

/// The default model without and with a hyoid, and the model of the thesis, without tuning.
fn untuned(bench: &Bench) -> Result<Vec<(&'static str, Setup)>, FitError> {
    let levers = [
        ("thesis", Levers::uniform(0.0, false)),
        ("tone", Levers::uniform(tongue_infer::inverse::TONE, false)),
        ("tone_hyoid", Levers::uniform(tongue_infer::inverse::TONE, true)),
    ];
    levers.into_iter().map(|(name, l)| Ok((name, bench.setup(&l)?))).collect()
}

/// Errors with every vowel of the table as baseline, for all subjects that have it, without tuning.
pub fn other_baselines(
    bench: &Bench,
    data: &Dataset,
    mesh: &Mesh<2>,
    progress: &Progress<'_>,
) -> Result<Vec<OtherBaseline>, StudyError> {
    let vowels: Vec<Vowel> = distinct(data.rows().iter().map(|row| row.lengths.vowel.clone()));
    let setups = untuned(bench)?;
    let mut out = Vec::new();
    for baseline in vowels {
        let all = cases(data, mesh, &baseline);
        if all.is_empty() {
            continue;
        }
        let model: Vec<Vec<f64>> = parallel::map(&all, |case| {
            let row = setups.iter().map(|(_, setup)| case.error(&bench.judge(setup, case))).collect();
            progress.add(1, "other baselines");
            row
        });
        let of_others = |case: &Case| constant(all.iter().filter(|c| c.subject != case.subject));
        let flat = |case: &Case| case.error(&vec![of_others(case); case.target().muscles.len()]);
        let whole = [
            ("no_change", all.iter().map(Case::no_change).collect::<Vec<_>>()),
            ("constant", all.iter().map(flat).collect()),
        ];
        let of_model =
            setups.iter().enumerate().map(|(i, (name, _))| (*name, model.iter().map(|r| r[i]).collect()));
        for subjects in std::iter::once(subjects(&all)).chain(subjects(&all).into_iter().map(|s| vec![s])) {
            let within = |errors: &Vec<f64>| -> Vec<f64> {
                let kept = all.iter().zip(errors).filter(|(c, _)| subjects.contains(&c.subject.as_str()));
                kept.map(|(_, e)| *e).collect()
            };
            let scores: Vec<Score> = whole
                .iter()
                .map(|(name, errors)| (*name, errors.clone()))
                .chain(of_model.clone())
                .map(|(name, errors)| Score { name: name.to_owned(), rms: root_mean(&within(&errors)) })
                .collect();
            out.push(OtherBaseline {
                baseline: baseline.clone(),
                subjects: subjects.iter().map(|s| (*s).to_owned()).collect(),
                fits: within(&vec![0.0; all.len()]).len(),
                scores,
            });
        }
    }
    Ok(out)
}

/// Predicts each muscle of each case without its measurement, not even whether it became shorter. All other
/// muscles are fitted, also the longer ones.
pub fn left_out(
    bench: &Bench,
    cases: &[Case],
    progress: &Progress<'_>,
) -> Result<Vec<WithoutMuscle>, StudyError> {
    let setups = untuned(bench)?;
    let held: Vec<Setup> = DISCREPANCIES
        .into_iter()
        .map(|sd| {
            let usual = Levers::uniform(tongue_infer::inverse::TONE, true);
            let weaker = tongue_infer::inverse::STRETCH_SD / sd;
            let (tension_sd, bone_sd_m) = (usual.tension_sd * weaker, usual.bone_sd_m * weaker);
            bench.setup(&Levers { tension_sd, bone_sd_m, ..usual })
        })
        .collect::<Result<_, FitError>>()?;
    let settings = FitSettings { starts: 2, ..bench.settings };
    let rows: Vec<Vec<Option<Left>>> = parallel::map(cases, |case| {
        let target = case.target();
        let others: Vec<&Case> = cases.iter().filter(|c| c.subject != case.subject).collect();
        let each =
            |c: &Case| (0..c.target().muscles.len()).map(|m| Case { unseen: vec![m], ..c.clone() }).collect();
        let how = best_shrunk(&others, each, |p| p);
        let one = |left: usize| -> Option<Left> {
            let square = |p: f64| (p - target.values[left]).powi(2);
            let predict = |setup: &Setup, matched: &Matched| {
                let fit = tongue_infer::inverse::fit_in(setup, matched, &settings).ok()?;
                let number = fit.muscles.iter().position(|n| *n == target.muscles[left])?;
                Some(square(fit.lengths[number] / fit.baseline_lengths[number]))
            };
            let seen = without(case, left)?;
            let unknown = Case { unseen: vec![left], ..case.clone() };
            let expected = gaussian(&others, &unknown, how)?[left];
            let mut squares = vec![square(1.0), square(expected)];
            for (_, setup) in &setups[..2] {
                squares.push(predict(setup, &seen)?);
            }
            let pulling = all_pull(case, left);
            let of_held =
                |matched: &Matched| held.iter().map(|s| predict(s, matched)).collect::<Option<Vec<f64>>>();
            Some(Left { squares, chosen: [of_held(&seen)?, of_held(&pulling)?] })
        };
        let row = (0..target.muscles.len()).map(one).collect();
        progress.add(1, "muscles left out");
        row
    });
    // The discrepancy is chosen without the subject.
    let sums = |rule: usize| -> Vec<Vec<f64>> {
        let sum = |row: &Vec<Option<Left>>, k: usize| row.iter().flatten().map(|l| l.chosen[rule][k]).sum();
        rows.iter().map(|row| (0..held.len()).map(|k| sum(row, k)).collect()).collect()
    };
    let sums = [sums(0), sums(1)];
    let squares = rows.iter().enumerate().flat_map(|(number, row)| {
        let outside = |other: usize| cases[other].subject != cases[number].subject;
        let best = [0, 1].map(|rule| best_column(&sums[rule], outside));
        row.iter().flatten().map(move |l| {
            l.squares
                .iter()
                .copied()
                .chain([0, 1].map(|rule| l.chosen[rule][best[rule]]))
                .collect::<Vec<f64>>()
        })
    });
    let squares: Vec<Vec<f64>> = squares.collect();
    let names = ["no_change", "gaussian", "thesis", "tone", "tone_hyoid", "all_may_pull"];
    let score = |(i, name): (usize, &&str)| WithoutMuscle {
        name: (*name).to_owned(),
        rms: root_mean(&squares.iter().map(|s| s[i]).collect::<Vec<_>>()),
        predictions: squares.len(),
    };
    Ok(names.iter().enumerate().map(score).collect())
}

/// Candidate standard deviations of the model's discrepancy of a stretch: the larger, the more the priors
/// count.
const DISCREPANCIES: [f64; 4] = [0.01, 0.02, 0.04, 0.08];

/// Squared errors of one muscle left out: of each opponent, and for each of [`DISCREPANCIES`] with and
/// without the rule that only shorter muscles contract.
struct Left {
    squares: Vec<f64>,
    chosen: [Vec<f64>; 2],
}

/// The target without a muscle, with all others fitted; `None` if no other contracts.
fn without(case: &Case, left: usize) -> Option<Matched> {
    let matched = &case.matched;
    let target = &matched.target;
    let name = &target.muscles[left];
    let kept = Target {
        active: target.active.iter().copied().filter(|m| *m != left).collect(),
        fitted: (0..target.muscles.len()).filter(|m| *m != left).collect(),
        reference: if target.reference == left { usize::from(left == 0) } else { target.reference },
        ..target.clone()
    };
    if kept.active.is_empty() {
        return None;
    }
    let kept = kept.of_body(|muscle| muscle != name).ok()?;
    let mut muscles = matched.muscles.clone();
    let moved = muscles.remove(left);
    muscles.push(moved);
    let mut numbers = matched.numbers.clone();
    let moved = numbers.remove(left);
    numbers.push(moved);
    Some(Matched { target: kept, muscles, numbers })
}

/// The target without a muscle and without the rule that only shorter muscles contract: every muscle may
/// pull, and every stretch but one is fitted.
fn all_pull(case: &Case, left: usize) -> Matched {
    let target = case.target();
    let all = 0..target.muscles.len();
    let target = Target {
        active: all.clone().collect(),
        fitted: all.filter(|m| *m != left).collect(),
        ..target.clone()
    };
    Matched { target, ..case.matched.clone() }
}

/// Predicted stretches of all cases by complete fits.
pub fn judged(bench: &Bench, setup: &Setup, cases: &[&Case]) -> Vec<Vec<f64>> {
    parallel::map(cases, |case| bench.judge(setup, case))
}
