//! Nelder-Mead, which uses costs only, and Gauss-Newton, which uses derivatives, find the same tensions.

use crate::fixtures::{target, tongue};
use tongue_fit::inverse::{self, Fit, FitSettings, Method};
use tongue_fit::measured::TargetKind;
use tongue_fit::system::Model;

#[test]
fn on_all_twelve_vowels_with_stretch_targets_and_with_ratios() {
    let mesh = tongue();
    for kind in TargetKind::ALL {
        for subject in ["S1", "S2", "S3"] {
            for vowel in ["i", "e", "a", "o"] {
                let target = target(subject, vowel, kind);
                let run = |method| {
                    // Nelder-Mead gets a tighter tolerance than by default, so that its own error is small.
                    let settings = FitSettings { method, tension_tolerance: 1e-6, ..FitSettings::default() };
                    inverse::fit(&mesh, &Model::default(), &target, &settings).unwrap()
                };
                let (simplex, derivatives) = (run(Method::NelderMead), run(Method::GaussNewton));
                assert_eq!(simplex.status, derivatives.status, "{subject} {vowel} {kind}");
                let equilibria: usize = derivatives.starts.iter().map(|s| s.evaluations).sum();
                assert!(equilibria < 100, "{equilibria} equilibria");
                // Results of the searches, before a fit with an undetermined target selects another one.
                let found = |fit: &Fit| -> Vec<f64> {
                    let best = fit.starts.iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
                    best.unwrap().x.clone()
                };
                let differences =
                    found(&simplex).into_iter().zip(found(&derivatives)).map(|(a, b)| (a - b).abs());
                let most = differences.fold(0.0, f64::max);
                assert!(most < 1e-3, "{subject} {vowel} {kind}: {most} N apart");
            }
        }
    }
}
