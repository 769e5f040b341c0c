//! The density of a posterior is differentiated exactly, and its sampler draws from what it is given.

use nalgebra::{DMatrix, DVector, SVector};
use tongue_core::random::normals;
use tongue_core::statics::lanes::{Lanes, Load};
use tongue_fit::MM;
use tongue_fit::body::{Body, ContinuumSettings};
use tongue_fit::inverse::Matched;
use tongue_fit::measured::{Dataset, Target};
use tongue_fit::parallel;
use tongue_fit::posterior::hmc::{self, Point, Target as Sampled, Whitened};
use tongue_fit::posterior::{
    Density, Evaluator, Ground, How, Mode, Pairs, Place, Priors, Report, Seen, Settings, sample, unseen,
};
use tongue_fit::statics::{self, SolveStatus, Workspace};
use tongue_fit::system::{Model, System, TissueModel};

fn ground(priors: &Priors) -> Ground {
    Ground::new(&Body::tongue(5.5 * MM).unwrap(), &Model::default(), priors).unwrap()
}

/// Quadratic elements, and linear ones.
fn grounds_without_lanes() -> [Ground; 2] {
    let continuum = Body::continuum(8.0 * MM, &ContinuumSettings::default()).unwrap();
    let elements = Model { tissue: TissueModel::FiniteElement, ..Model::default() };
    let priors = Priors::default();
    [
        Ground::new(&continuum, &Model::default(), &priors).unwrap(),
        Ground::new(&Body::tongue(8.0 * MM).unwrap(), &elements, &priors).unwrap(),
    ]
}

fn seen(subject: &str, vowel: &str) -> Seen {
    let target: Target = Dataset::reference().unwrap().stretches(subject, vowel).unwrap();
    Seen::of(&Matched::new(&Body::tongue(5.5 * MM).unwrap().mesh, &target).unwrap())
}

#[test]
fn the_gradient_is_the_derivative_of_the_density() {
    the_gradient_is_right(&ground(&Priors::default()), 1e-3);
    // Solved one by one, they end nearer to the tolerance.
    grounds_without_lanes().iter().for_each(|ground| the_gradient_is_right(ground, 1e-2));
}

fn the_gradient_is_right(ground: &Ground, h: f64) {
    let mut density = Density::new(ground, seen("S2", "a")).unwrap();
    let mode = Mode::find(&mut density).unwrap();
    let mut random = fastrand::Rng::with_seed(1);
    let n = density.parameters.len();
    assert_eq!(n, 18);
    let mut evaluator = Evaluator::new(&density);
    for _ in 0..3 {
        let at = &mode.scores + normals(n, &mut random) * 0.3;
        let one = |e: &mut Evaluator<'_>, x: &DVector<f64>, p: &Place| {
            e.evaluate(&[(x, p)]).pop().flatten().unwrap()
        };
        let here = one(&mut evaluator, &at, &mode.place);
        for i in 0..n {
            let mut side = |by: f64| {
                let mut x = at.clone();
                x[i] += by;
                one(&mut evaluator, &x, &here.place).log
            };
            let difference = (8.0 * (side(h) - side(-h)) - side(2.0 * h) + side(-2.0 * h)) / (12.0 * h);
            assert!((here.gradient[i] - difference).abs() < 1e-6, "{i}: {} {difference}", here.gradient[i]);
        }
    }
}

#[test]
fn stretches_answer_to_the_shape_at_rest_as_bodies_that_are_moved_do() {
    answers_to_the_shape_are_right(&ground(&Priors::default()));
    grounds_without_lanes().iter().for_each(answers_to_the_shape_are_right);
}

fn answers_to_the_shape_are_right(ground: &Ground) {
    let mut density = Density::new(ground, seen("S2", "a")).unwrap();
    let mode = Mode::find(&mut density).unwrap();
    let (meaning, _) = density.meaning(&mode.scores);
    let all: Vec<usize> = (0..ground.muscles.len()).collect();
    let stretches = |system: &System<2>| -> DVector<f64> {
        let lanes = density.lanes();
        let loads = [
            density.posture(&meaning, Some(&mode.place.posture)).in_body(system),
            density.baseline(&meaning, Some(&mode.place.baseline)).in_body(system),
        ];
        let [vowel, base] =
            [0, 1].map(|i| lanes.solve(&loads[i..=i], density.settings()).remove(0).positions);
        DVector::from_fn(all.len(), |m, _| system.length(&vowel, m) / system.length(&base, m))
    };
    let zeros = |fields: &[tongue_fit::posterior::Field]| vec![0.0; fields.len()];
    let h = 1e-3;
    let mut largest = 0.0_f64;
    for (which, derivative) in [(0, &mode.linear.geometry.ends), (1, &mode.linear.geometry.outline)] {
        for f in (0..derivative.ncols()).step_by(3) {
            let side = |by: f64| {
                let (mut ends, mut outline) = (zeros(&ground.ends), zeros(&ground.outline));
                [&mut ends, &mut outline][which][f] = by;
                let body = ground.displaced(&ends, &outline).unwrap();
                stretches(&System::new(&body.mesh, &ground.model, &all).unwrap())
            };
            let difference = (side(h) - side(-h)) / (2.0 * h);
            let error = (derivative.column(f) - &difference).amax();
            largest = largest.max(difference.amax());
            assert!(error < 1e-6, "{which} {f}: {error} of {}", difference.amax());
        }
    }
    assert!(largest > 5e-3, "they do matter: {largest}");
    // Kappa by Poisson's ratio, with a modulus that leaves the springs as they are.
    let with = |nu: f64| {
        let own = ground.model.constants;
        let young_modulus = own.young_modulus * (1.0 + nu) / (1.0 + own.poisson_ratio);
        let constants = tongue_fit::material::Constants { poisson_ratio: nu, young_modulus, ..own };
        let system = System::new(&ground.body.mesh, &Model { constants, ..ground.model }, &all).unwrap();
        (stretches(&system), system.coefficients().kappa.ln(), system.coefficients().tissue_stiffness)
    };
    let (high, low) = (with(0.49905), with(0.49895));
    let difference = (high.0 - low.0) / (high.1 - low.1) * ground.priors.compressibility.sd_ln_kappa;
    assert!((high.2 / low.2 - 1.0).abs() < 1e-12);
    let error = (mode.linear.geometry.kappa.column(0) - &difference).amax();
    assert!(error < 1e-2 * difference.amax() && difference.amax() > 1e-3, "{error}: {difference}");
}

#[test]
fn stretches_of_a_continuum_answer_to_its_widths_as_bodies_laid_anew_do() {
    let [ground, _] = grounds_without_lanes();
    let mut density = Density::new(&ground, seen("S2", "a")).unwrap();
    let mode = Mode::find(&mut density).unwrap();
    let (meaning, _) = density.meaning(&mode.scores);
    let all: Vec<usize> = (0..ground.muscles.len()).collect();
    let stretches = |settings: &ContinuumSettings| -> DVector<f64> {
        let body = ground.body.with_continuum(settings).unwrap().unwrap();
        let system = System::new(&body.mesh, &ground.model, &all).unwrap();
        let solved = |load: Load<'_, 2>| {
            let found = Lanes::new(&system).solve(&[load], density.settings()).remove(0);
            assert_eq!(found.solution.status, SolveStatus::Converged);
            system.lengths(&found.positions)
        };
        let vowel = Load::new(meaning.tensions.clone()).with_bone(body.bone("hyoid"), meaning.hyoid);
        let (vowel, base) = (solved(vowel), solved(Load::new(meaning.tones.clone())));
        DVector::from_fn(all.len(), |m, _| vowel[m] / base[m])
    };
    let own = ground.body.mesh.continuum.as_ref().unwrap().settings;
    let (width, patch) = (ground.priors.bundle_width.sd_ln, ground.priors.bone_patch.sd_ln);
    let wider =
        |by: f64| ContinuumSettings { bundle_width_m: own.bundle_width_m * (by * width).exp(), ..own };
    let farther =
        |by: f64| ContinuumSettings { patch_radius_m: own.patch_radius_m * (by * patch).exp(), ..own };
    type Side<'a> = (&'a DMatrix<f64>, &'a dyn Fn(f64) -> ContinuumSettings);
    let sides: [Side<'_>; 2] =
        [(&mode.linear.geometry.width, &wider), (&mode.linear.geometry.patch, &farther)];
    for (derivative, settings) in sides {
        // Of a step as long as that of the derivative: a secant of what has no derivatives of higher order.
        let difference = stretches(&settings(0.5)) - stretches(&settings(-0.5));
        let error = (derivative.column(0) - &difference).amax();
        assert!(error < 0.03 * difference.amax() && difference.amax() > 1e-3, "{error}: {difference}");
    }
}

#[test]
fn chains_in_a_continuum_are_those_of_any_number_of_threads_and_go_where_tensions_lead_from_rest() {
    let continuum = Body::continuum(12.0 * MM, &ContinuumSettings::default()).unwrap();
    let ground = Ground::new(&continuum, &Model::default(), &Priors::default()).unwrap();
    let mut density = Density::new(&ground, seen("S2", "a")).unwrap();
    let mode = Mode::find(&mut density).unwrap();
    let settings = hmc::Settings { chains: 8, warm_up: 6, draws: 4, thin: 1, seed: 3 };
    let chains = |threads| {
        let whitened = mode.whitened().unwrap();
        let sample = || hmc::sample(|| Evaluator::new(&density), &whitened, &mode.place, &settings);
        parallel::with_threads(threads, sample).unwrap()
    };
    let (one, two) = (chains(1), chains(2));
    assert_eq!(one, two);
    let n = ground.muscles.len();
    let mut w = Workspace::new(&ground.system);
    for row in one.iter().filter_map(|chain| chain.draws.last()) {
        w.carry_bone(&ground.system, &ground.hyoid, SVector::from([row[2 * n], row[2 * n + 1]]));
        w.start_from_rest(&ground.system);
        let solution = statics::solve(&ground.system, &mut w, &row[..n], &statics::SolveSettings::default());
        assert_eq!(solution.status, SolveStatus::Converged);
        let lengths = ground.system.lengths(w.positions());
        assert!(lengths.iter().zip(&row[2 * n + 2..]).all(|(a, b)| (a - b).abs() < 1e-7));
    }
}

/// Scores of draws of the posterior's normal approximation at a mode, without those of which there is no
/// equilibrium.
fn about(mode: &Mode, count: usize, seed: u64) -> Vec<DVector<f64>> {
    let mut random = fastrand::Rng::with_seed(seed);
    let root = mode.precision.clone().cholesky().unwrap().inverse().cholesky().unwrap().unpack();
    (0..count).map(|_| &mode.scores + &root * normals(root.nrows(), &mut random)).collect()
}

#[test]
fn the_covariance_of_geometry_is_that_of_bodies_that_are_moved_over_the_posterior() {
    let ground = ground(&Priors::default());
    let mut density = Density::new(&ground, seen("S2", "a")).unwrap();
    let mode = Mode::find(&mut density).unwrap();
    let all: Vec<usize> = (0..ground.muscles.len()).collect();
    let draws: Vec<(u64, DVector<f64>)> = (0..).zip(about(&mode, 200, 2)).collect();
    let moved: Vec<Option<DVector<f64>>> = parallel::map(&draws, |(number, scores)| {
        let mut random = fastrand::Rng::with_seed(1000 + number);
        let (meaning, _) = density.meaning(scores);
        let by = |fields: &[tongue_fit::posterior::Field], random: &mut fastrand::Rng| {
            normals(fields.len(), random)
        };
        let (ends, outline) = (by(&ground.ends, &mut random), by(&ground.outline, &mut random));
        let body = ground.displaced(ends.as_slice(), outline.as_slice())?;
        let system = System::new(&body.mesh, &ground.model, &all).ok()?;
        let lengths = |load: Load<'_, 2>, system: &System<2>| {
            let shape = density.lanes().solve(&[load], density.settings()).remove(0);
            (shape.solution.status == SolveStatus::Converged).then(|| system.lengths(&shape.positions))
        };
        let stretches = |system: &System<2>| {
            let posture = lengths(density.posture(&meaning, None).in_body(system), system)?;
            let base = lengths(density.baseline(&meaning, None).in_body(system), system)?;
            Some(DVector::from_fn(all.len(), |m, _| posture[m] / base[m]))
        };
        Some(stretches(&system)? - stretches(&ground.system)?)
    });
    let moved: Vec<_> = moved.into_iter().flatten().collect();
    assert!(moved.len() > 120, "{}", moved.len());
    let found = moved.iter().map(|d| d.norm_squared()).sum::<f64>() / moved.len() as f64;
    let linear = mode.geometry.ends.trace() + mode.geometry.outline.trace();
    let at_mode = mode.linear.geometry.ends.norm_squared() + mode.linear.geometry.outline.norm_squared();
    assert!((linear / found - 1.0).abs() < 0.25, "{linear} {found}");
    eprintln!("of {}: moved {found:.5}, linear {linear:.5}, linear at the mode {at_mode:.5}", moved.len());
}

#[test]
fn pairs_weigh_as_draws_of_the_prior_do_and_predict_as_draws_of_the_posterior() {
    // Wide errors: a few thousand draws of the prior tell the marginal density.
    let ground = ground(&Priors::from_toml("discrepancy.sd = 0.15", "test").unwrap());
    let mut density = Density::new(&ground, seen("S3", "e")).unwrap();
    let mode = Mode::find(&mut density).unwrap();
    let (evidence, effective) =
        Pairs::about(&density, std::slice::from_ref(&mode), 1).unwrap().evidence(&density);
    let numbers: Vec<u64> = (0..50).collect();
    let sums: Vec<f64> = parallel::map(&numbers, |&number| {
        let mut random = fastrand::Rng::with_seed(number);
        let (mut evaluator, rest) = (Evaluator::new(&density), density.rest());
        let one = |_| {
            let x = normals(density.parameters.len(), &mut random);
            let found = evaluator.evaluate(&[(&x, &rest)]).pop().flatten();
            found.map_or(0.0, |point| (point.log + 0.5 * x.norm_squared()).exp())
        };
        (0..40).map(one).sum()
    });
    let constant = -density.factor().l().diagonal().map(f64::ln).sum() - 4.0 * std::f64::consts::TAU.ln();
    let direct = (sums.iter().sum::<f64>() / 2000.0).ln() + constant;
    assert!((evidence - direct).abs() < 0.1, "{evidence} {direct}");
    assert!(effective > 100.0, "{effective}");

    let position = 4;
    let found = unseen(&density, &mode, &[position], 1).unwrap().remove(0);
    assert_eq!(found.how, How::Pairs);
    let mut other = density.of(density.seen.without(position)).unwrap();
    Mode::find_near(&mut other, &mode).unwrap();
    let draws = sample(&ground, other.seen.clone(), &Settings { draws: 800, seed: 1 }).unwrap();
    let direct = draws.draws.iter().map(|d| d.stretch(density.seen.muscles[position])).sum::<f64>()
        / draws.draws.len() as f64;
    // The conditional mean moves with the residuals by what geometry has in common, which is little beside
    // such errors.
    let wide = 0.25 * (found.spread.interval_95[1] - found.spread.interval_95[0]);
    assert!((found.spread.mean - direct).abs() < 0.15 * wide, "{} {direct} {wide}", found.spread.mean);
}

/// A target whose answer is known.
struct Known<'a>(&'a DMatrix<f64>, &'a (dyn Fn(f64) -> f64 + Sync));

impl Sampled for Known<'_> {
    type Place = ();

    fn evaluate(&mut self, points: &[(&DVector<f64>, &())]) -> Vec<Option<Point<()>>> {
        let one = |x: &DVector<f64>| {
            let gradient = -(self.0 * x);
            Some(Point { log: 0.5 * gradient.dot(x), gradient, place: () })
        };
        points.iter().map(|(x, ())| one(x)).collect()
    }

    fn keep(&self, at: &DVector<f64>, _: &Point<()>) -> Vec<f64> {
        at.iter().map(|x| self.1(*x)).collect()
    }
}

#[test]
fn the_sampler_draws_from_normal_and_half_normal_distributions() {
    let mut random = fastrand::Rng::with_seed(5);
    let n = 6;
    let root = DMatrix::from_fn(n, n, |i, j| if i == j { 1.0 + i as f64 } else { 0.4 * random.f64() });
    let precision = &root * root.transpose();
    let covariance = precision.clone().try_inverse().unwrap();
    // Whitened by something else, as a Gauss-Newton matrix is not quite the posterior's.
    let rough = &precision + DMatrix::identity(n, n) * 0.5;
    let whitened = Whitened::new(DVector::zeros(n), rough).unwrap();
    let settings = hmc::Settings { chains: 8, warm_up: 200, draws: 4000, thin: 1, seed: 2 };
    let chains = hmc::sample(|| Known(&precision, &|x| x), &whitened, &(), &settings);
    let draws: Vec<&Vec<f64>> = chains.iter().flat_map(|c| &c.draws).collect();
    assert_eq!(draws.len(), 32_000);
    assert!(chains.iter().all(|c| c.acceptance > 0.6 && c.divergences == 0));
    for i in 0..n {
        for j in 0..=i {
            let found = draws.iter().map(|d| d[i] * d[j]).sum::<f64>() / draws.len() as f64;
            let scale = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
            assert!(
                (found - covariance[(i, j)]).abs() < 0.03 * scale,
                "{i} {j}: {found} {}",
                covariance[(i, j)]
            );
        }
    }
    // Scores that are normal make tensions that are half-normal.
    let one = DMatrix::identity(1, 1);
    let whitened = Whitened::new(DVector::zeros(1), one.clone()).unwrap();
    let half = |x: f64| tongue_fit::track::scores::tension(x).0;
    let chains = hmc::sample(|| Known(&one, &half), &whitened, &(), &settings);
    let mut all: Vec<f64> = chains.iter().flat_map(|c| c.draws.iter().map(|d| d[0])).collect();
    all.sort_by(f64::total_cmp);
    for (p, exact) in [(0.25, 0.318_64), (0.5, 0.674_49), (0.95, 1.959_96)] {
        let found = all[(p * all.len() as f64) as usize];
        assert!((found - exact).abs() < 0.03, "{p}: {found} {exact}");
    }
}

#[test]
fn the_same_seed_gives_the_same_draws_on_any_number_of_threads() {
    let ground = ground(&Priors::default());
    let run = |threads: usize| {
        let settings = Settings { draws: 104, seed: 3 };
        parallel::with_threads(threads, || sample(&ground, seen("S1", "i"), &settings).unwrap().draws)
            .unwrap()
    };
    let one = run(1);
    assert!(one == run(2) && one == run(3));
    assert_eq!(one.len(), 104);
}

#[test]
fn every_draw_is_where_its_tensions_lead_from_rest() {
    // In /i/ of S1 there is another branch not far away.
    let ground = ground(&Priors::default());
    let posterior = sample(&ground, seen("S1", "i"), &Settings { draws: 400, seed: 1 }).unwrap();
    let settings = statics::SolveSettings::default();
    for draw in posterior.draws.iter().step_by(16) {
        let mut w = Workspace::new(&ground.system);
        w.carry_bone(&ground.system, &ground.hyoid, draw.meaning.hyoid);
        w.start_from_rest(&ground.system);
        let found = statics::trace(&ground.system, &mut w, &draw.meaning.tensions, &settings, 20);
        let lengths = ground.system.lengths(w.positions());
        let away = lengths.iter().zip(&draw.lengths).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(
            found.solution.status == SolveStatus::Converged && away < 1e-7,
            "{away}: {:?}",
            found.critical
        );
    }
}

#[test]
fn shares_of_variance_are_those_of_the_linear_problem_and_draws_agree_with_it() {
    // Small errors: the posterior is nearly linear.
    let priors = "tension.scale_n_per_m = 2.0\nbaseline.scale_n_per_m = 2.0\nhyoid.sd_mm = 0.3\nmuscle_ends.sd_mm = 0.5\noutline.sd_mm = 0.3\n";
    let ground = ground(&Priors::from_toml(priors, "test").unwrap());
    let posterior = sample(&ground, seen("S1", "e"), &Settings { draws: 1000, seed: 1 }).unwrap();
    let report = Report::new(&posterior, false, 1).unwrap();
    let shares = report.variance_share.unwrap();
    for s in shares.tensions.0.iter().map(|(_, s)| s).chain([&shares.change, &shares.left_out_stretch]) {
        assert!((s.each().iter().map(|(_, v)| v).sum::<f64>() - 1.0).abs() < 1e-12);
    }
    // The same written out, for the first tension.
    let linear = &posterior.mode.linear;
    let before = &linear.jacobian * linear.jacobian.transpose() + posterior.density.covariance();
    let inverse = before.try_inverse().unwrap();
    let column = linear.jacobian.column(0).into_owned();
    let gain = &inverse * &column;
    let variance = 1.0 - column.dot(&gain);
    let missed = -linear.jacobian.tr_mul(&gain);
    let unresolved: f64 = (0..8).map(|i| (missed[i] + if i == 0 { 1.0 } else { 0.0 }).powi(2)).sum();
    assert!((shares.tensions.0[0].1.unresolved - unresolved / variance).abs() < 1e-9);
}
