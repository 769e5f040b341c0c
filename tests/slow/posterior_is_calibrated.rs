//! A posterior says how sure it is, and is as sure as it says: simulation-based calibration of the sampler
//! (Talts and others 2018), and coverage where the body that made the data is another one than the body of
//! the fit.

use tongue_core::random::{normal, normals, seed_of};
use tongue_core::statics::lanes::Lanes;
use tongue_fit::MM;
use tongue_fit::body::Body;
use tongue_fit::inverse::batch::{Known, Thoroughness, assess};
use tongue_fit::inverse::{FitSettings, Matched, Method};
use tongue_fit::material::Constants;
use tongue_fit::measured::TargetKind;
use tongue_fit::parallel;
use tongue_fit::posterior::{Density, Draw, Ground, Meaning, Priors, Seen, Settings, sample};
use tongue_fit::statics::{self, SolveStatus};
use tongue_fit::system::{Model, System};

use crate::cases;
use crate::fixtures::{target, tongue};

/// Variance of a stretch by the rounding of lengths of some 50 mm to millimetres.
const ROUNDING: f64 = 6.7e-5;

fn ground(priors: &str) -> Ground {
    let priors = Priors::from_toml(priors, "test").unwrap();
    Ground::new(&Body::tongue(5.5 * MM).unwrap(), &Model::default(), &priors).unwrap()
}

/// Stretches of a body at tensions, if it has them.
fn stretches(density: &Density<'_>, truth: &Meaning, system: &System<2>) -> Option<Vec<f64>> {
    let lanes = Lanes::new(system);
    let settings = statics::SolveSettings::default();
    let loads = [density.posture(truth, None), density.baseline(truth, None)];
    let shapes = loads.map(|load| lanes.solve(&[load], &settings).remove(0));
    if shapes.iter().any(|s| s.solution.status != SolveStatus::Converged) {
        return None;
    }
    let lengths = shapes.map(|s| system.lengths(&s.positions));
    Some(lengths[0].iter().zip(&lengths[1]).map(|(l, l0)| l / l0).collect())
}

/// What was seen of true stretches.
fn seen(ground: &Ground, stretches: &[f64], random: &mut fastrand::Rng) -> Seen {
    let sd = (ground.priors.discrepancy.sd.powi(2) + ROUNDING).sqrt();
    Seen {
        names: ground.muscles.clone(),
        muscles: (0..ground.muscles.len()).collect(),
        stretches: stretches.iter().map(|s| s + sd * normal(random)).collect(),
        rounding: vec![ROUNDING; stretches.len()],
    }
}

/// Probability that uniform numbers are as far from uniform as these, after Kolmogorov and Smirnov, with
/// Stephens's correction.
fn p_of_uniform(mut all: Vec<f64>) -> f64 {
    all.sort_by(f64::total_cmp);
    let n = all.len() as f64;
    let away = |(i, x): (usize, &f64)| (x - i as f64 / n).max((i as f64 + 1.0) / n - x);
    let largest = all.iter().enumerate().map(away).fold(0.0, f64::max);
    let t = largest * (n.sqrt() + 0.12 + 0.11 / n.sqrt());
    let term = |k: i32| 2.0 * if k % 2 == 1 { 1.0 } else { -1.0 } * (-2.0 * f64::from(k * k) * t * t).exp();
    (1..=60).map(term).sum::<f64>().clamp(0.0, 1.0)
}

#[test]
fn ranks_of_the_truth_among_draws_are_uniform() {
    // Without what is linearised at each posterior the likelihood is the very one that makes the data.
    let ground =
        ground("muscle_ends.off = true\noutline.off = true\n[compressibility]\nsd_ln_kappa = 1e-9\n");
    let numbers: Vec<usize> = (0..cases(30)).collect();
    let ranks: Vec<Vec<f64>> = parallel::map(&numbers, |&number| {
        let mut random = fastrand::Rng::with_seed(seed_of(11, number));
        let any = Seen { names: vec![], muscles: vec![], stretches: vec![], rounding: vec![] };
        let density = Density::new(&ground, any).unwrap();
        let (truth, measured) = loop {
            let (truth, _) = density.meaning(&normals(density.parameters.len(), &mut random));
            if let Some(s) = stretches(&density, &truth, &ground.system) {
                break (truth, s);
            }
        };
        let seen = seen(&ground, &measured, &mut random);
        let posterior = sample(&ground, seen, &Settings { draws: 160, seed: number as u64 }).unwrap();
        let mut rank = |value: &dyn Fn(&Meaning) -> f64| {
            let below = posterior.draws.iter().filter(|d| value(&d.meaning) < value(&truth)).count() as f64;
            (below + random.f64()) / (posterior.draws.len() as f64 + 1.0)
        };
        let each = (0..ground.muscles.len()).flat_map(|m| {
            [rank(&|d: &Meaning| d.tensions[m]), rank(&|d: &Meaning| d.tensions[m] - d.tones[m])]
        });
        each.collect()
    });
    for quantity in 0..ranks[0].len() {
        let p = p_of_uniform(ranks.iter().map(|r| r[quantity]).collect());
        let name = &ground.muscles[quantity / 2];
        eprintln!("{name} {}: p = {p:.3}", ["F", "F - F0"][quantity % 2]);
        // One of sixteen is below 0.01 by chance in one run of seven.
        let least = if numbers.len() < 100 { 0.01 / ranks[0].len() as f64 } else { 0.01 };
        assert!(p > least, "{name}, {}: {p}", ["F", "F - F0"][quantity % 2]);
    }
    assert!(p_of_uniform(ranks.iter().map(|r| r[0].powi(4)).collect()) < 0.01, "the test can fail");
}

/// Part of 95 % intervals of tensions and of changes that hold the truth, where ends, outline and kappa of
/// the body that was measured are other ones than those of the body that is fitted.
fn coverage(truth: &Ground, fitted: &Ground, count: usize) -> [f64; 2] {
    let numbers: Vec<usize> = (0..count).collect();
    let all: Vec<usize> = (0..truth.muscles.len()).collect();
    let held: Vec<Option<[usize; 2]>> = parallel::map(&numbers, |&number| {
        let mut random = fastrand::Rng::with_seed(seed_of(17, number));
        let any = Seen { names: vec![], muscles: vec![], stretches: vec![], rounding: vec![] };
        let density = Density::new(truth, any).unwrap();
        let (meaning, measured) = loop {
            let (meaning, _) = density.meaning(&normals(density.parameters.len(), &mut random));
            let ends = normals(truth.ends.len(), &mut random);
            let outline = normals(truth.outline.len(), &mut random);
            let kappa = (truth.priors.compressibility.sd_ln_kappa * normal(&mut random)).exp();
            let Some(body) = truth.displaced(ends.as_slice(), outline.as_slice()) else { continue };
            // Kappa goes with lambda minus mu; mu, and with it the springs, stays.
            let (lambda, mu) = truth.model.constants.lame();
            let lambda = mu + (lambda - mu) * kappa;
            let poisson_ratio = lambda / (2.0 * (lambda + mu));
            let constants = Constants {
                poisson_ratio,
                young_modulus: 2.0 * mu * (1.0 + poisson_ratio),
                ..truth.model.constants
            };
            let made = System::new(&body.mesh, &Model { constants, ..truth.model }, &all);
            let Ok(system) = made else { continue };
            if let Some(s) = stretches(&density, &meaning, &system) {
                break (meaning, s);
            }
        };
        let seen = seen(truth, &measured, &mut random);
        let posterior = sample(fitted, seen, &Settings { draws: 400, seed: number as u64 }).unwrap();
        if posterior.draws.is_empty() {
            // The most probable point is not where its tensions lead from rest: not mixed, and nothing is
            // told.
            return None;
        }
        let holds = |value: &dyn Fn(&Meaning) -> f64| {
            let mut values: Vec<f64> = posterior.draws.iter().map(|d: &Draw| value(&d.meaning)).collect();
            values.sort_by(f64::total_cmp);
            let at = |p: f64| values[((values.len() - 1) as f64 * p).round() as usize];
            usize::from((at(0.025)..=at(0.975)).contains(&value(&meaning)))
        };
        Some([
            all.iter().map(|&m| holds(&|d| d.tensions[m])).sum(),
            all.iter().map(|&m| holds(&|d| d.tensions[m] - d.tones[m])).sum(),
        ])
    });
    let told: Vec<[usize; 2]> = held.into_iter().flatten().collect();
    assert!(told.len() * 50 >= count * 49, "{} of {count} are told", told.len());
    [0, 1].map(|i| told.iter().map(|h| h[i]).sum::<usize>() as f64 / (told.len() * all.len()) as f64)
}

#[test]
fn intervals_cover_the_truth_of_bodies_that_are_not_the_one_fitted() {
    let usual = ground("");
    let count = cases(12);
    let found = coverage(&usual, &usual, count);
    eprintln!(
        "coverage under the stated priors, {count} cases: tensions {:.3}, changes {:.3}",
        found[0], found[1]
    );
    // Four standard errors of a binomial of independent cases about 95 %.
    let room = 4.0 * (0.95f64 * 0.05 / (8 * count) as f64).sqrt();
    assert!((found[0] - 0.95).abs() < room && (found[1] - 0.95).abs() < room, "{found:?}");
    // A wrong scale of the tensions is not seen by the intervals: that is why it is told beside them.
    if count > 100 {
        for (name, wrong) in
            [("F ~ HN30", "tension.scale_n_per_m = 30.0"), ("F ~ HN10", "tension.scale_n_per_m = 10.0")]
        {
            let found = coverage(&ground(wrong), &usual, count);
            eprintln!("coverage where {name}: tensions {:.3}, changes {:.3}", found[0], found[1]);
        }
    }
}

#[test]
fn with_everything_but_rounding_off_intervals_are_as_wide_as_those_of_the_bootstrap() {
    // Draws of both lengths within their rounding, refitted: rest for a baseline, and tensions in who
    // contracts alone.
    let mesh = tongue();
    let target = target("S2", "a", TargetKind::Stretch);
    let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
    let how = Thoroughness { settings, draws: 16_000, subset_changes: 0, ..Thoroughness::default() };
    let known = Known::reference().unwrap();
    let drawn = assess(&mesh, &Model::default(), None, &target, &known, &how).unwrap().intervals.unwrap();

    let off =
        ["baseline", "hyoid", "muscle_ends", "outline", "compressibility", "discrepancy", "young_modulus"];
    let off: String = off.iter().map(|name| format!("[{name}]\noff = true\n")).collect();
    let passive = ["GGm", "GGp", "SGp", "SGa", "HGp"].map(|name| format!("{name} = 0.0\n")).concat();
    let ground = ground(&format!("{off}[tension]\nscale_n_per_m = 1e3\n[tension.fixed_n_per_m]\n{passive}"));
    let mut seen = Seen::of(&Matched::new(&mesh, &target).unwrap());
    for position in (0..seen.names.len()).rev().filter(|m| !target.active.contains(m)) {
        seen = seen.without(position);
    }
    let posterior = sample(&ground, seen, &Settings { draws: 16_000, seed: 3 }).unwrap();
    for (&muscle, bootstrap) in target.active.iter().zip(&drawn.tensions) {
        let mut all: Vec<f64> = posterior.draws.iter().map(|d| d.meaning.tensions[muscle]).collect();
        all.sort_by(f64::total_cmp);
        let at = |p: f64| all[((all.len() - 1) as f64 * p).round() as usize];
        let ratio = (at(0.975) - at(0.025)) / (bootstrap.high - bootstrap.low);
        eprintln!(
            "{}: {:.1} to {:.1}, {ratio:.3} of {bootstrap:?}",
            target.muscles[muscle],
            at(0.025),
            at(0.975)
        );
        // Of two uniform roundings the middle 95 % are 3 % narrower than those of a normal number of the same
        // variance.
        assert!((ratio - 1.0).abs() < 0.05, "{}: {ratio}", target.muscles[muscle]);
    }
}
