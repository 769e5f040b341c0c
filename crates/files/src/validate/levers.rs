//! Predictions of the model under given premises, and the choice of the premises that predict others best.

use nalgebra::SVector;

use tongue_core::body::{Body, HYOID};
use tongue_core::parallel;
use tongue_core::system::Model;
use tongue_infer::inverse::{
    self, FitError, FitSettings, Forward, LooseBone, Method, Premises, Problem, Setup, Tone,
};

use super::cases::Case;

/// Candidate tones, N per metre of thickness.
pub const TONES: [f64; 9] = [0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0];
/// Candidate standard deviations of a tension, N per metre of thickness, and of the hyoid's place, m.
const TENSION_SDS: [f64; 3] = [25.0 / 3.0, 50.0 / 3.0, 100.0 / 3.0];
const BONE_SDS: [f64; 3] = [2.5e-3, 5e-3, 10e-3];

/// The body with a movable hyoid, from which the setups for all levers are made.
#[derive(Debug)]
pub struct Bench {
    /// That body.
    pub setup: Setup,
    /// Settings of the search.
    pub settings: FitSettings,
}

impl Bench {
    /// A bench for a body.
    pub fn new(body: &Body<2>, model: &Model) -> Result<Self, FitError> {
        let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
        Ok(Self { setup: Setup::new(body, model, Premises::active_baseline(2))?, settings })
    }

    /// The setup for these levers.
    pub fn setup(&self, levers: &Levers) -> Result<Setup, FitError> {
        let hyoid = LooseBone { name: HYOID.to_owned(), axes: vec![0, 1] };
        let bones = if levers.hyoid { vec![hyoid] } else { Vec::new() };
        let Levers { tone, tension_sd, bone_sd_m, .. } = *levers;
        self.setup.under(Premises { tone: Tone::Uniform(tone), bones, tension_sd, bone_sd_m })
    }

    /// Predicted stretches of a complete fit, of all muscles of the target; ones if there is no equilibrium.
    pub fn judge(&self, setup: &Setup, case: &Case) -> Vec<f64> {
        match inverse::fit_in(setup, &case.matched, &self.settings) {
            Ok(fit) if fit.status != inverse::FitStatus::NoEquilibrium => fit.simulated,
            _ => vec![1.0; case.target().muscles.len()],
        }
    }
}

/// Levers: the premises of a fit that can be tuned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Levers {
    /// Tension in the baseline, N per metre of thickness.
    pub tone: f64,
    /// Whether the hyoid may move.
    pub hyoid: bool,
    /// Standard deviation of a tension, N per metre of thickness.
    pub tension_sd: f64,
    /// Standard deviation of the hyoid's place, m.
    pub bone_sd_m: f64,
}

impl Levers {
    /// One tone for every muscle, with priors of the usual strength.
    pub fn uniform(tone: f64, hyoid: bool) -> Self {
        let Premises { tension_sd, bone_sd_m, .. } = Premises::default();
        Self { tone, hyoid, tension_sd, bone_sd_m }
    }

    /// All candidate tones with a movable hyoid, with priors of the usual strength.
    pub fn tones() -> Vec<Self> {
        TONES.into_iter().map(|tone| Self::uniform(tone, true)).collect()
    }

    /// All candidate tones and strengths of priors with a movable hyoid.
    pub fn grid() -> Vec<Self> {
        let mut all = Vec::new();
        for tone in TONES {
            for tension_sd in TENSION_SDS {
                for bone_sd_m in BONE_SDS {
                    all.push(Self { tension_sd, bone_sd_m, ..Self::uniform(tone, true) });
                }
            }
        }
        all
    }

    /// In words.
    pub fn told(&self) -> String {
        let sds = format!("{:.0} N/m and {:.1} mm", self.tension_sd, 1e3 * self.bone_sd_m);
        format!("tone {} N/m; priors {sds}", self.tone)
    }
}

/// Fits of one case, each started at the answer of the previous one.
#[derive(Debug, Clone)]
pub struct NestedChain<'a> {
    pub case: &'a Case,
    settings: FitSettings,
    x: Vec<f64>,
    positions: Vec<SVector<f64, 2>>,
}

impl<'a> NestedChain<'a> {
    /// Begins with a complete fit; if that fails, with the baseline.
    pub fn new(bench: &Bench, case: &'a Case) -> Self {
        let active = case.target().active.len();
        let (x, positions) = match inverse::fit_in(&bench.setup, &case.matched, &bench.settings) {
            Ok(fit) => (fit.unknowns, fit.positions),
            Err(_) => (vec![0.0; active], bench.setup.positions.clone()),
        };
        Self { case, settings: bench.settings, x, positions }
    }

    /// Predicted stretches of all muscles of the target; ones if no fit succeeds.
    pub fn predict(&mut self, setup: &Setup) -> Vec<f64> {
        let matched = &self.case.matched;
        let settings = setup.settings(&self.settings);
        let inverse = matched.inverse(setup, &settings);
        let mut x = self.x.clone();
        x.resize(inverse.unknowns.len(), 0.0);
        let mut forward = Forward::new(&inverse, &settings);
        forward.begin_at(&x, &self.positions);
        let measured = matched.target.muscles.len();
        let Some((found, _)) = inverse::refit(&mut forward, &settings, &x) else {
            return vec![1.0; measured];
        };
        self.x[..found.len()].copy_from_slice(&found);
        self.positions.copy_from_slice(forward.positions());
        let stretches =
            forward.lengths().iter().zip(&setup.lengths).map(|(l, from)| l / from).collect::<Vec<_>>();
        matched.numbers[..measured].iter().map(|&n| stretches[n]).collect()
    }
}

/// Mean square errors: a row for every case, a column for each of the setups. `done` is called after each
/// case.
pub fn errors(bench: &Bench, cases: &[Case], setups: &[Setup], done: impl Fn() + Sync) -> Vec<Vec<f64>> {
    parallel::map(cases, |case| {
        let mut chain = NestedChain::new(bench, case);
        let row = setups.iter().map(|setup| case.error(&chain.predict(setup))).collect();
        done();
        row
    })
}

/// Index of the column with the least mean over the rows of training cases; the first of equals.
pub fn best_column(errors: &[Vec<f64>], is_training: impl Fn(usize) -> bool) -> usize {
    let columns = errors.first().map_or(0, Vec::len);
    let sum = |column: usize| -> f64 {
        errors.iter().enumerate().filter(|(row, _)| is_training(*row)).map(|(_, e)| e[column]).sum()
    };
    (0..columns).min_by(|a, b| sum(*a).total_cmp(&sum(*b))).unwrap_or(0)
}
