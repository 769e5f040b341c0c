//! Cases of a validation: passive muscles predicted by the thesis's fit, and by the most probable point given the contracting muscles.

use tongue_core::body::{Body, HYOID, Mesh};
use tongue_core::statistics::distinct;
use tongue_core::system::Model;
use tongue_infer::inverse::{self, FitSettings, FitStatus, Method, TargetOnBody};
use tongue_infer::posterior::{
    MapEstimate, Measurements, PosteriorError, PosteriorModel, PosteriorProblem, Priors,
};
use tongue_input::measured::{Dataset, Lengths, Target, TargetKind, Vowel};

#[derive(Debug, Clone)]
pub struct Case {
    pub matched: TargetOnBody,
    /// Indices of the muscles that are predicted.
    pub unseen: Vec<usize>,
}

impl Case {
    /// The case in which the passive muscles of a target are predicted; `None` if the body lacks a muscle that the target needs.
    pub fn new(mesh: &Mesh<2>, target: &Target) -> Option<Self> {
        let matched = TargetOnBody::new(mesh, target).ok()?;
        let target = &matched.target;
        let unseen = (0..target.muscles.len()).filter(|m| !target.active.contains(m)).collect();
        Some(Self { unseen, matched })
    }

    pub fn target(&self) -> &Target {
        &self.matched.target
    }

    pub fn stretch_of(&self, muscle: &str) -> Option<f64> {
        let at = self.target().muscles.iter().position(|m| m == muscle)?;
        Some(self.target().values[at])
    }

    pub fn passive(&self) -> impl Iterator<Item = String> {
        self.unseen.iter().map(|&m| self.target().muscles[m].clone())
    }

    /// Mean square error over the muscles that are predicted; `predicted` has the stretches of all muscles of the target.
    pub fn error(&self, predicted: &[f64]) -> f64 {
        let squares = self.unseen.iter().map(|&m| (predicted[m] - self.target().values[m]).powi(2));
        squares.sum::<f64>() / self.unseen.len() as f64
    }

    /// A case for each muscle, in which it alone is predicted.
    pub fn each_left_out(&self) -> impl Iterator<Item = Self> {
        (0..self.target().muscles.len()).map(|m| Self { unseen: vec![m], ..self.clone() })
    }
}

/// Every vowel that has passive muscles, of every subject that has the baseline, in the order of the table, with lengths as `make` makes
/// them of the measured ones.
pub fn cases(
    data: &Dataset,
    mesh: &Mesh<2>,
    baseline: &Vowel,
    make: impl Fn(&Lengths) -> Lengths,
) -> Vec<Case> {
    let rows = data.rows.iter().map(|row| &row.lengths);
    Vec::from_iter(rows.filter_map(|lengths| {
        let own = data.baseline_vowel(&lengths.subject, baseline).ok()?;
        let target = Target::from_lengths(&make(lengths), &make(own), TargetKind::Stretch, None).ok()?;
        Case::new(mesh, &target).filter(|case| !case.unseen.is_empty())
    }))
}

pub fn subjects(cases: &[Case]) -> Vec<&str> {
    distinct(cases.iter().map(|case| case.target().subject.as_str()))
}

/// At most `count` random permutations of the muscles, other than the identity; none for fewer than three muscles.
pub fn permutations(muscles: usize, count: u64, seed: u64) -> Vec<Vec<usize>> {
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

pub fn with_muscle_order(lengths: &Lengths, order: &[usize]) -> Lengths {
    Lengths {
        length_mm: order.iter().map(|&o| lengths.length_mm[o]).collect(),
        half_width_mm: order.iter().map(|&o| lengths.half_width_mm[o]).collect(),
        ..lengths.clone()
    }
}

/// Stretches of all muscles of the target, predicted by the thesis's fit; ones if there is no equilibrium.
pub fn of_thesis(mesh: &Mesh<2>, model: &Model, case: &Case) -> Vec<f64> {
    let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
    match inverse::fit(mesh, model, case.target(), &settings) {
        Ok(fit) if fit.answer.status != FitStatus::NoEquilibrium => fit.simulated(case.target().kind),
        _ => vec![1.0; case.target().muscles.len()],
    }
}

/// The posterior's model with its default priors, in which the muscles `passive` have no tension in the vowel.
pub fn posterior_model(
    body: &Body<2>,
    model: &Model,
    passive: impl Iterator<Item = String>,
) -> Result<PosteriorModel, PosteriorError> {
    let mut priors = Priors::default();
    priors.hyoid.off = body.bone(HYOID).is_empty();
    priors.tension.fixed_n_per_m = passive.map(|muscle| (muscle, 0.0)).collect();
    PosteriorModel::new(body, model, &priors)
}

/// Stretches of all muscles of the target at the most probable point given the contracting muscles; ones if there is no equilibrium.
pub fn most_probable(posterior_model: &PosteriorModel, case: &Case) -> Vec<f64> {
    let mut measurements = Measurements::of_vowel(&case.matched);
    for position in (0..measurements.stretches.len()).rev().filter(|m| !case.target().active.contains(m)) {
        measurements = measurements.without(position);
    }
    let estimate = PosteriorProblem::new(posterior_model, measurements).and_then(|mut problem| problem.map());
    let Ok(MapEstimate { solved, .. }) = estimate else { return vec![1.0; case.target().muscles.len()] };
    let numbers = case.matched.numbers[..case.target().muscles.len()].iter();
    let [vowel, baseline] = [0, 1].map(|shape| solved.shape(shape).1);
    numbers.map(|&n| vowel[n] / baseline[n]).collect()
}
