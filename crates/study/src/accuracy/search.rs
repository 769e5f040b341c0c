//! Axis 5: the fit.

use serde::Serialize;

use crate::Error;
use tongue_core::body::Mesh;
use tongue_core::system::Model;
use tongue_infer::inverse::{self, FitSettings, Method};
use tongue_input::measured::TargetKind;

use super::methods::DONE;
use crate::measure::{Effort, measure};
use crate::test_tensions::{largest_difference, target};

/// Tolerances of tensions in Nelder-Mead, N.
const SIMPLEX_TOLERANCES: [f64; 5] = [1.0, 1e-1, 1e-2, 1e-4, 1e-6];
/// Tolerances of tensions in Gauss-Newton, N.
const STEP_TOLERANCES: [f64; 4] = [1.0, 1e-1, 1e-2, 1e-4];
/// The default is four.
const STARTS: [usize; 3] = [1, 2, 8];

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TimedFit {
    pub target: TargetKind,
    pub method: Method,
    pub starts: usize,
    pub tolerance_n: f64,
    /// Whether candidates were solved from the nearest solved one rather than from rest.
    pub warm: bool,
    /// Largest difference of a tension from the reference, N.
    pub error_n: f64,
    /// Root mean square residual of the fitted values.
    pub misfit: f64,
    /// Median wall-clock time of the whole fit, s.
    pub seconds: f64,
    pub repeats: usize,
    pub equilibria: usize,
    pub factorisations: usize,
    pub iterations: u64,
    pub ended: String,
}

/// Fits /a/ of S2 with both kinds of target. The reference is Gauss-Newton with tighter tolerances than in any row.
pub fn work_precision(mesh: &Mesh<2>, effort: &Effort) -> Result<Vec<TimedFit>, Error> {
    let mut runs = Vec::new();
    for kind in [TargetKind::Stretch, TargetKind::Ratio] {
        let target = target("S2", "a", kind, &[])?;
        let tight = FitSettings {
            method: Method::GaussNewton,
            tension_tolerance: 1e-8,
            cost_tolerance: 1e-24,
            starts: 8,
            equilibrium: tongue_core::statics::SolveSettings { tolerance: 1e-11, ..Default::default() },
            ..FitSettings::default()
        };
        let reference = inverse::fit(mesh, &Model::default(), &target, &tight)?;
        for settings in settings_of_rows() {
            let timed = measure(effort, || inverse::fit(mesh, &Model::default(), &target, &settings));
            let fit = timed.result?;
            let inverse::Answer { status, misfit, starts, .. } = &fit.answer;
            runs.push(TimedFit {
                target: kind,
                method: settings.method,
                starts: settings.starts,
                tolerance_n: settings.tension_tolerance,
                warm: settings.warm_start,
                error_n: largest_difference(&fit.tensions(), &reference.tensions()),
                misfit: *misfit,
                seconds: timed.seconds,
                repeats: timed.repeats,
                equilibria: starts.iter().map(|s| s.counts.evaluations).sum(),
                factorisations: starts.iter().map(|s| s.counts.factorisations).sum(),
                iterations: starts.iter().map(|s| s.iterations).sum(),
                ended: match status {
                    inverse::FitStatus::Converged => DONE.to_owned(),
                    other => format!("stopped short: {other:?}"),
                },
            });
        }
    }
    Ok(runs)
}

/// Each differs from the default settings of its method in one value.
fn settings_of_rows() -> Vec<FitSettings> {
    let simplex = FitSettings::default();
    let derivative = FitSettings { method: Method::GaussNewton, ..simplex };
    let cold = |usual| FitSettings { warm_start: false, ..usual };
    let to_tolerances = |usual: FitSettings, tolerances: &[f64]| {
        Vec::from_iter(tolerances.iter().map(|&tension_tolerance| FitSettings { tension_tolerance, ..usual }))
    };
    let from_starts = |usual: FitSettings| STARTS.map(|starts| FitSettings { starts, ..usual }).to_vec();
    [
        to_tolerances(simplex, &SIMPLEX_TOLERANCES),
        to_tolerances(cold(simplex), &SIMPLEX_TOLERANCES),
        from_starts(simplex),
        to_tolerances(derivative, &STEP_TOLERANCES),
        vec![cold(derivative)],
        from_starts(derivative),
    ]
    .concat()
}
