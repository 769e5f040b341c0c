//! Lengths simulated at chosen tensions are rounded to 1 mm like the published ones and fitted again: the 95
//! % intervals must contain the truth in 95 % of the cases.

use crate::fixtures::{target_of, tongue};
use rayon::prelude::*;
use tongue_fit::body::Mesh;
use tongue_fit::inverse::batch::Thoroughness;
use tongue_fit::inverse::{FitSettings, Method};
use tongue_fit::measured::{Target, TargetKind};
use tongue_fit::statics::{self, SolveStatus, Workspace};
use tongue_fit::system::{Model, System};
use tongue_infer::inverse::batch::{Known, assess};

const CASES: u64 = 240;
const DRAWS: usize = 200;

/// Number of intervals, and of those that contain the truth.
#[derive(Debug, Clone, Copy, Default)]
struct Count {
    intervals: usize,
    held: usize,
}

impl Count {
    fn add(&mut self, held: bool) {
        self.intervals += 1;
        self.held += usize::from(held);
    }

    fn rate(self) -> f64 {
        self.held as f64 / self.intervals as f64
    }
}

/// A true answer and its rounded measurement.
struct Case {
    target: Target,
    tensions: Vec<f64>,
    /// Ratios or stretches of the truth.
    values: Vec<f64>,
}

/// Two to four muscles pull with 3 to 25 N in a subject who is smaller or larger than the model. For ratios
/// to GGa, GGa stays passive: there are then as many equations as tensions, and the truth is the only answer.
fn case(mesh: &Mesh<2>, seed: u64, kind: TargetKind) -> Option<Case> {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut muscles: Vec<usize> = (0..mesh.muscles.len()).filter(|m| kind.constrains(*m, 0)).collect();
    random.shuffle(&mut muscles);
    muscles.truncate(random.usize(2..=4));
    muscles.sort_unstable();
    let system = System::new(mesh, &Model::default(), &muscles).unwrap();
    let mut tensions = vec![0.0; system.muscle_count()];
    for &m in &muscles {
        tensions[m] = 3.0 + 22.0 * random.f64();
    }
    let mut workspace = Workspace::new(&system);
    let solution = statics::solve(&system, &mut workspace, &tensions, &statics::SolveSettings::default());
    if solution.status != SolveStatus::Converged {
        return None;
    }
    let scale_mm = 1e3 * (0.85 + 0.35 * random.f64());
    let scaled = |shape: &[_]| -> Vec<f64> { system.lengths(shape).iter().map(|l| scale_mm * l).collect() };
    let (lengths, rest) = (scaled(workspace.positions()), scaled(system.rest()));
    let rounded = |mm: &[f64]| -> Vec<f64> { mm.iter().map(|l| 1e-3 * l.round()).collect() };
    let names: Vec<&str> = muscles.iter().map(|&m| mesh.muscles[m].name.as_str()).collect();
    let target = target_of(mesh, &rounded(&lengths), &rounded(&rest), kind, &names);
    Some(Case { target, tensions, values: kind.values(&lengths, &rest, 0) })
}

#[test]
fn intervals_hold_the_truth_in_95_percent_of_synthetic_cases() {
    let mesh = tongue();
    let known = Known::built_in();
    let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
    let how = Thoroughness { settings, draws: DRAWS, subset_changes: 0, ..Thoroughness::default() };
    for kind in TargetKind::ALL {
        let counted: Vec<(Count, Count)> = (0..CASES / 2)
            .into_par_iter()
            .filter_map(|seed| case(&mesh, seed, kind))
            .map(|case| {
                let found = assess(&mesh, &Model::default(), None, &case.target, &known, &how).unwrap();
                let intervals = found.intervals.unwrap();
                assert_eq!(intervals.failed, 0);
                let (mut tensions, mut passive) = (Count::default(), Count::default());
                for (&m, interval) in case.target.active.iter().zip(&intervals.tensions) {
                    tensions.add(interval.holds(case.tensions[m]));
                }
                let predicted = match kind {
                    TargetKind::Ratio => intervals.ratios,
                    TargetKind::Stretch => intervals.stretches,
                };
                for m in case.target.compared() {
                    if !case.target.active.contains(&m) {
                        passive.add(predicted[m].holds(case.values[m]));
                    }
                }
                (tensions, passive)
            })
            .collect();
        let sum = |of: fn(&(Count, Count)) -> Count| {
            counted.iter().map(of).fold(Count::default(), |a, b| Count {
                intervals: a.intervals + b.intervals,
                held: a.held + b.held,
            })
        };
        assert!(counted.len() >= 100, "{kind}: only {} cases have an equilibrium", counted.len());
        for (what, count) in [("tensions", sum(|c| c.0)), ("passive predictions", sum(|c| c.1))] {
            println!("{kind}, {what}: {} of {} intervals, {:.3}", count.held, count.intervals, count.rate());
            assert!((0.92..=0.98).contains(&count.rate()), "{kind}, {what}: {:.3}", count.rate());
        }
    }
}
