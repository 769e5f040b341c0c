//! The derivatives of the posterior's density are exact, and its sampler draws from the given density.

use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};
use tongue_core::body::largest_distance;
use tongue_core::random::normals;
use tongue_core::statics::SAME_SHAPE_M;
use tongue_fit::body::{Body, ContinuumSettings};
use tongue_fit::inverse::TargetOnBody;
use tongue_fit::measured::{Dataset, Target};
use tongue_fit::statics::{SolveSettings, SolveStatus, Trace, Workspace, trace};
use tongue_fit::system::Model;
use tongue_fit::{MM, parallel};
use tongue_infer::posterior::hmc::{self, SampledDensity, Whitened};
use tongue_infer::posterior::{
    Contrast, Draw, Evaluator, LinearisationPoint, MapEstimate, Measurements, Posterior, PosteriorModel,
    PosteriorProblem, Priors, Report, Sampling, ShortRun, SolvedPoint, Surrogate, SurrogateDensity, Verdict,
};

pub fn posterior_model(priors: &Priors) -> PosteriorModel {
    PosteriorModel::new(&Body::tongue(5.5 * MM).unwrap(), &Model::default(), priors).unwrap()
}

/// A model with a coarse mesh for what holds on any mesh, because its posterior takes a third of the time.
pub fn coarse_posterior_model(priors: &Priors) -> PosteriorModel {
    PosteriorModel::new(&Body::tongue(8.0 * MM).unwrap(), &Model::default(), priors).unwrap()
}

/// The stretches of a row, which do not depend on the mesh.
fn matched(subject: &str, vowel: &str) -> TargetOnBody {
    let target: Target = Dataset::reference().unwrap().stretches(subject, vowel).unwrap();
    TargetOnBody::new(&Body::tongue(5.5 * MM).unwrap().mesh, &target).unwrap()
}

pub fn measurements(subject: &str, vowel: &str) -> Measurements {
    Measurements::of_vowel(&matched(subject, vowel))
}

fn together(subject: &str, vowels: &[&str]) -> Measurements {
    let all: Vec<TargetOnBody> = vowels.iter().map(|vowel| matched(subject, vowel)).collect();
    Measurements::of_vowels(&all.iter().collect::<Vec<_>>())
}

/// Rows that several tests sample with 1000 draws.
const SAMPLED: [(&str, &str); 2] = [("S1", "i"), ("S2", "a")];

/// 1000 draws of the posterior of a subject's row, sampled once.
pub fn sampled(subject: &str) -> &'static Posterior<'static> {
    static ALL: [OnceLock<Posterior<'static>>; 2] = [const { OnceLock::new() }; 2];
    let row = SAMPLED.iter().position(|(s, _)| *s == subject).unwrap();
    ALL[row].get_or_init(|| {
        let posterior_model = Box::leak(Box::new(posterior_model(&Priors::default())));
        posterior_model
            .posterior(measurements(subject, SAMPLED[row].1), &Sampling { draws: 1000, seed: 1 })
            .unwrap()
    })
}

/// `data_beside_lengths` tests one posture, with springs and with a continuum.
#[test]
fn derivatives_of_two_postures_together_are_exact() {
    let posterior_model = posterior_model(&Priors::default());
    let mut problem = PosteriorProblem::new(&posterior_model, together("S2", &["i", "a"])).unwrap();
    let map_estimate = problem.map().unwrap();
    let mut random = fastrand::Rng::with_seed(1);
    assert_eq!(problem.parameters.len(), 29);
    for _ in 0..3 {
        let at = &map_estimate.scores + normals(29, &mut random) * 0.3;
        for (row, i, exact, difference) in derivatives(&problem, &at, &map_estimate.solved, 1e-3) {
            assert!((exact - difference).abs() < 1e-7, "{row} {i}: {exact} {difference}");
        }
    }
}

/// What is computed of the measured numbers at a point.
pub fn computed(problem: &PosteriorProblem<'_>, at: &DVector<f64>, from: &SolvedPoint) -> DVector<f64> {
    let values = problem.parameter_values(at).0;
    let point = Evaluator::new(problem).solve(&[(&values, from)]).pop().flatten().unwrap();
    -problem.residuals(&point.lengths, &point.auxiliary)
}

/// Derivatives of the measured numbers by the scores, each with its row, its column and its difference quotient of fourth order with step
/// `h`.
pub fn derivatives(
    problem: &PosteriorProblem<'_>,
    at: &DVector<f64>,
    from: &SolvedPoint,
    h: f64,
) -> Vec<(usize, usize, f64, f64)> {
    let LinearisationPoint { jacobian, solved, .. } = Evaluator::new(problem).linearise(at, from).unwrap();
    let side = |i: usize, by: f64| {
        let mut x = at.clone();
        x[i] += by;
        computed(problem, &x, &solved)
    };
    let each = (0..at.len()).flat_map(|i| {
        let near = (side(i, h) - side(i, -h)) * 8.0;
        let difference = (near - side(i, 2.0 * h) + side(i, -2.0 * h)) / (12.0 * h);
        let rows = problem.rows.iter().zip(&difference).enumerate();
        rows.map(|(row, (&number, d))| (row, i, jacobian[(number, i)], *d)).collect::<Vec<_>>()
    });
    each.collect()
}

/// The model decides how often the density accepts. The distribution of the draws does not depend on it, as the test of the sampler shows.
#[test]
fn the_quadratic_model_is_near_the_density_and_its_gradient_is_exact() {
    let posterior = sampled("S2");
    let problem = &posterior.problem;
    let whitened = posterior.map_estimate.whitened().unwrap();
    let surrogate = Surrogate::refined(problem, problem, &whitened).unwrap();
    let mut both = SurrogateDensity::new(problem, problem, &surrogate);
    let mut random = fastrand::Rng::with_seed(3);
    let (mut errors, mut logs) = (Vec::new(), Vec::new());
    for _ in 0..40 {
        let at = &whitened.centre + &whitened.spread * normals(problem.parameters.len(), &mut random);
        let (log, gradient) = both.approximate(&at);
        for i in 0..at.len() {
            let side = |by: f64| {
                let mut x = at.clone();
                x[i] += by;
                both.approximate(&x).0
            };
            let h = 1e-3;
            let difference = (8.0 * (side(h) - side(-h)) - side(2.0 * h) + side(-2.0 * h)) / (12.0 * h);
            assert!((gradient[i] - difference).abs() < 1e-6 * (1.0 + difference.abs()), "{i}");
        }
        let Some((exact, draw)) = both.evaluate(&[&at]).pop().flatten() else { continue };
        // The model's likelihood is raised to the power 0.9.
        errors.push(exact - log - 0.1 * draw.log_likelihood);
        logs.push(draw.log_likelihood);
    }
    let sd = |all: &[f64]| tongue_core::statistics::mean_and_variance(all.iter().copied()).1.sqrt();
    assert!(errors.len() >= 38 && sd(&errors) < 0.25 * sd(&logs), "{} {}", sd(&errors), sd(&logs));
}

/// The linearisation of the stretches at a mode, including geometry.
pub fn at_mode(problem: &PosteriorProblem<'_>, map_estimate: &MapEstimate) -> LinearisationPoint {
    Evaluator::new(problem).linearise(&map_estimate.scores, &map_estimate.solved).unwrap()
}

#[test]
fn chains_in_a_continuum_are_those_of_any_number_of_threads_and_go_where_tensions_lead_from_rest() {
    let continuum = Body::continuum(12.0 * MM, &ContinuumSettings::default()).unwrap();
    let posterior_model = PosteriorModel::new(&continuum, &Model::default(), &Priors::default()).unwrap();
    let mut problem = PosteriorProblem::new(&posterior_model, measurements("S2", "a")).unwrap();
    let map_estimate = problem.map().unwrap();
    let settings = hmc::Settings { warm_up: 6, draws: 4, thin: 1, seed: 3 };
    let chains = |threads| {
        let whitened = map_estimate.whitened().unwrap();
        let surrogate = Surrogate::about(&problem, &whitened).unwrap();
        let target = || SurrogateDensity::new(&problem, &problem, &surrogate);
        let sample = || hmc::sample(target, &whitened, &settings);
        parallel::with_threads(threads, sample).unwrap()
    };
    let (one, two) = (chains(1), chains(2));
    assert_eq!(one, two);
    for draw in one.iter().filter_map(|chain| chain.draws.last()) {
        let (found, away) = from_rest(&posterior_model, draw);
        assert!(found.solution.status == SolveStatus::Converged && away < SAME_SHAPE_M, "{away}");
    }
}

/// The equilibrium to which the tensions of a draw lead from rest, and the largest distance of its lengths from those of the draw, m.
fn from_rest(posterior_model: &PosteriorModel, draw: &Draw) -> (Trace, f64) {
    let mut w = Workspace::new(&posterior_model.system);
    let load = posterior_model.load(&draw.values, 0, None);
    load.bones.iter().for_each(|(nodes, shift)| w.displace_bone(&posterior_model.system, nodes, *shift));
    w.start_from_rest(&posterior_model.system);
    let found = trace(&posterior_model.system, &mut w, &load.tensions, &SolveSettings::default());
    let lengths = posterior_model.system.lengths(w.positions());
    (found, lengths.iter().zip(&draw.lengths).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max))
}

#[test]
fn vowels_together_share_the_baseline_and_tell_contrasts() {
    let posterior_model = coarse_posterior_model(&Priors::default());
    let recording = together("S2", &["i", "a"]);
    let n = recording.stretches.len();
    assert_eq!((n, recording.labels.len()), (16, 2));
    // Two stretches of a muscle share the rounding of its length in the baseline; stretches of different muscles share nothing.
    for (i, j) in (0..n).flat_map(|i| (0..i).map(move |j| (i, j))) {
        let shares = recording.stretches[i].muscle == recording.stretches[j].muscle;
        assert_eq!(recording.rounding[(i, j)] > 0.0, shares, "{i} {j}");
    }
    let posterior = posterior_model.posterior(recording, &Sampling { draws: 1000, seed: 1 }).unwrap();
    assert!(posterior.is_mixed(), "{}", posterior.diagnostics.why);
    let reports = Report::of_each(&posterior, false, 1);
    let contrasts = Contrast::all(&posterior);
    assert_eq!((reports.len(), contrasts.len()), (2, 8));
    // The hyoglossus pulls down in /a/. The room is two standard deviations of a probability from 700 effective draws.
    let more = |muscle: &str| contrasts.iter().find(|c| c.muscle == muscle).unwrap().probability_more;
    assert!(more("HGa") < 0.2 + 0.03, "{contrasts:?}");
}

#[test]
fn a_verdict_of_a_short_run_says_what_a_thousand_draws_do_and_is_that_of_its_groups_apart() {
    let (body, model) = (Body::tongue(5.5 * MM).unwrap(), Model::default());
    let (mut same, mut held) = (0, 0.0);
    for (subject, vowel) in SAMPLED {
        let target = Dataset::reference().unwrap().stretches(subject, vowel).unwrap();
        let quick = Verdict::of_target(&body, &model, &target).unwrap();
        if subject == "S2" {
            let run = ShortRun::new(&body, &model, &target).unwrap();
            let draws: Vec<Draw> =
                [0, 1].into_iter().flat_map(|group| run.draws(Some(group)).unwrap()).collect();
            assert_eq!(draws.len(), 240);
            // The page sends draws from one worker to another as JSON.
            let sent: Vec<Draw> = serde_json::from_str(&serde_json::to_string(&draws).unwrap()).unwrap();
            assert_eq!(run.verdict(&sent).unwrap(), quick);
            assert!(run.verdict(&[]).is_err());
        }
        let draws = &sampled(subject).draws;
        let mut report = Report::of_each(sampled(subject), false, 1).remove(0);
        let whole = Verdict::of(&report).unwrap();
        report.priors.hyoid.fixed_mm = Some([2.0, 0.0]);
        let hyoids = [&whole, &Verdict::of(&report).unwrap()].map(|verdict| verdict.hyoid_mm.is_some());
        assert_eq!(hyoids, [true, false]);
        for (m, (quick, whole)) in quick.muscles.iter().zip(&whole.muscles).enumerate() {
            // An interval from a hundred effective draws contains 95 ± 2.2 % of the draws of a long run; few draws reach the lower end of
            // HGa.
            let [low, high] = quick.tension_n_per_m;
            let inside = draws.iter().filter(|d| (low..=high).contains(&d.tension(0, m))).count();
            let part = inside as f64 / draws.len() as f64;
            assert!((0.85..=0.99).contains(&part), "{subject} {vowel}: {part}, {quick:?}");
            held += part / 16.0;
            // Four standard deviations of a probability from about a hundred effective draws.
            let [quickly, p] = [quick.p_rises, whole.p_rises].map(Option::unwrap);
            let clamped = p.clamp(0.02, 0.98);
            let room = 4.0 * (clamped * (1.0 - clamped) / 100.0).sqrt();
            assert!((quickly - p).abs() < room, "{subject} {vowel}: {quick:?} {whole:?}");
            same += usize::from(quick.certainty == whole.certainty);
        }
    }
    assert!(
        same >= 14 && held >= 0.93,
        "{same} of 16 words are the same, {held} of the draws are in the intervals"
    );
}

/// A density whose moments are known. Trajectories follow one with the precision `rough`.
struct Known<'a> {
    precision: &'a DMatrix<f64>,
    rough: &'a DMatrix<f64>,
    keep: fn(f64) -> f64,
}

impl SampledDensity for Known<'_> {
    type Kept = Vec<f64>;

    fn approximate(&self, at: &DVector<f64>) -> (f64, DVector<f64>) {
        let gradient = -(self.rough * at);
        (0.5 * gradient.dot(at), gradient)
    }

    fn evaluate(&mut self, points: &[&DVector<f64>]) -> Vec<Option<(f64, Vec<f64>)>> {
        let log = |x: &DVector<f64>| -0.5 * x.dot(&(self.precision * x));
        points.iter().map(|x| Some((log(x), x.iter().map(|x| (self.keep)(*x)).collect()))).collect()
    }
}

#[test]
fn the_sampler_draws_from_normal_and_half_normal_distributions() {
    let mut random = fastrand::Rng::with_seed(5);
    let n = 6;
    let root = DMatrix::from_fn(n, n, |i, j| if i == j { 1.0 + i as f64 } else { 0.4 * random.f64() });
    let precision = &root * root.transpose();
    let covariance = precision.clone().try_inverse().unwrap();
    // The whitening matrix differs from the precision, as a Gauss-Newton matrix differs from that of the posterior.
    let rough = &precision + DMatrix::identity(n, n) * 0.5;
    let whitened = Whitened::new(DVector::zeros(n), rough).unwrap();
    let settings = hmc::Settings { warm_up: 200, draws: 4000, thin: 2, seed: 2 };
    // Trajectories follow the density, and then an approximation whose precision is too small on the diagonal.
    let wrong = &precision - DMatrix::from_diagonal(&(precision.diagonal() * 0.2));
    for rough in [&precision, &wrong] {
        let chains =
            hmc::sample(|| Known { precision: &precision, rough, keep: |x| x }, &whitened, &settings);
        let draws: Vec<&Vec<f64>> = chains.iter().flat_map(|c| &c.draws).collect();
        assert_eq!(draws.len(), 32_000);
        let exact = rough == &precision;
        assert!(
            chains
                .iter()
                .all(|c| c.acceptance > 0.6 && c.divergences == 0 && (c.accepted > 1.0 - 1e-9) == exact)
        );
        for i in 0..n {
            for j in 0..=i {
                let found = draws.iter().map(|d| d[i] * d[j]).sum::<f64>() / draws.len() as f64;
                let scale = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
                assert!((found - covariance[(i, j)]).abs() < 0.03 * scale, "{exact} {i} {j}: {found}");
            }
        }
    }
    // Normal scores make half-normal tensions.
    let one = DMatrix::identity(1, 1);
    let whitened = Whitened::new(DVector::zeros(1), one.clone()).unwrap();
    let half = |x: f64| tongue_infer::posterior::parameters::tension(x).0;
    let chains = hmc::sample(|| Known { precision: &one, rough: &one, keep: half }, &whitened, &settings);
    let mut all: Vec<f64> = chains.iter().flat_map(|c| c.draws.iter().map(|d| d[0])).collect();
    all.sort_by(f64::total_cmp);
    for (p, exact) in [(0.25, 0.318_64), (0.5, 0.674_49), (0.95, 1.959_96)] {
        let found = all[(p * all.len() as f64) as usize];
        assert!((found - exact).abs() < 0.03, "{p}: {found} {exact}");
    }
}

#[test]
fn where_nothing_is_known_a_rise_is_as_probable_as_a_fall() {
    // Stretches of 1 with errors that are far larger than the effect of tensions.
    let posterior_model = coarse_posterior_model(&Priors::from_toml("discrepancy.sd = 0.5", "test").unwrap());
    let mut measurements = measurements("S2", "a");
    measurements.stretches.iter_mut().for_each(|stretch| stretch.value = 1.0);
    let posterior = posterior_model.posterior(measurements, &Sampling { draws: 1000, seed: 1 }).unwrap();
    let summary = Report::of_each(&posterior, false, 1).remove(0).summary.unwrap();
    for (muscle, change) in &summary.changes_n.0 {
        let p = change.probability_rises.unwrap();
        assert!((p - 0.5).abs() < 0.06, "{muscle}: {p}");
    }
}

#[test]
fn the_same_seed_gives_the_same_draws_on_any_number_of_threads() {
    let posterior_model = coarse_posterior_model(&Priors::default());
    let run = |threads: usize| {
        let settings = Sampling { draws: 104, seed: 3 };
        parallel::with_threads(threads, || {
            posterior_model.posterior(measurements("S1", "i"), &settings).unwrap().draws
        })
        .unwrap()
    };
    let one = run(1);
    assert!(one == run(2) && one == run(3));
    assert_eq!(one.len(), 104);
}

#[test]
fn the_command_of_the_readme_finds_three_muscles_that_pull_harder() {
    let posterior = sampled("S2");
    assert!(posterior.is_mixed() && posterior.diagnostics.r_hat < 1.01, "{}", posterior.diagnostics.why);
    let summary = Report::of_each(posterior, false, 1).remove(0).summary.unwrap();
    for (muscle, change) in &summary.changes_n.0 {
        let p = change.probability_rises.unwrap();
        assert!(p > 0.9 || !["GGa", "SGm", "HGa"].contains(&muscle.as_str()), "{muscle}: {p}");
    }
}

#[test]
fn the_most_probable_point_of_every_row_is_reached_from_rest() {
    let posterior_model = posterior_model(&Priors::default());
    for (subject, vowels) in [("S1", "ieao"), ("S2", "ieao"), ("S3", "ieao")] {
        for vowel in vowels.chars() {
            let measured = measurements(subject, &vowel.to_string());
            let mut problem = PosteriorProblem::new(&posterior_model, measured).unwrap();
            let mut map_estimate = problem.map().unwrap();
            assert!(map_estimate.is_reached_from_rest(&problem), "{subject} {vowel}");
            // Tensions that are 30 % larger lead to other shapes.
            let (values, _) = problem.parameter_values(&map_estimate.scores);
            let stronger = values.scaled(1.3);
            map_estimate.solved = Evaluator::new(&problem).solve_from_rest(&[&stronger]).remove(0).unwrap();
            assert!(!map_estimate.is_reached_from_rest(&problem));
        }
    }
}

#[test]
fn points_that_are_solved_together_have_the_shapes_that_they_have_alone() {
    let posterior_model = posterior_model(&Priors::default());
    let mut problem = PosteriorProblem::new(&posterior_model, measurements("S1", "i")).unwrap();
    let map_estimate = problem.map().unwrap();
    let (usual, _) = problem.parameter_values(&map_estimate.scores);
    // At these tensions there is no equilibrium, but in the baseline, which has other tones, there is one.
    let mut lost = usual.clone();
    lost.postures[0].tensions.iter_mut().for_each(|t| *t = 1e5);
    let weaker = usual.scaled(0.5);
    let mut evaluator = Evaluator::new(&problem);
    let together = evaluator.solve_from_rest(&[&usual, &lost, &weaker]);
    for (found, values) in together.iter().zip([&usual, &lost, &weaker]) {
        let alone = evaluator.solve_from_rest(&[values]).remove(0);
        assert_eq!(found.is_none(), std::ptr::eq(values, &lost));
        let pairs = found.iter().zip(&alone).flat_map(|(a, b)| a.shapes.iter().zip(&b.shapes));
        assert!(pairs.into_iter().all(|(a, b)| largest_distance(a, b) < SAME_SHAPE_M));
        assert_eq!(found.is_some(), alone.is_some());
    }
}

#[test]
fn every_draw_is_where_its_tensions_lead_from_rest() {
    // In /i/ of S1 another branch is near.
    let posterior = sampled("S1");
    let mut snapped = 0;
    for draw in posterior.draws.iter().step_by(10) {
        let (found, away) = from_rest(posterior.problem.posterior_model, draw);
        // Beyond a snap-through the shape depends on the steps of the load.
        snapped += usize::from(found.from_rest.critical().is_some() && away >= SAME_SHAPE_M);
        assert_eq!(found.solution.status, SolveStatus::Converged);
        assert!(away < SAME_SHAPE_M || found.from_rest.critical().is_some(), "{away}");
    }
    assert!(snapped <= 2, "{snapped} of 100");
}
