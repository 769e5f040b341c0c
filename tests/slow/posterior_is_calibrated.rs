//! A posterior says how sure it is, and is as sure as it says: simulation-based calibration of the sampler
//! (Talts and others 2018), and coverage where the body that made the data is another one than the body of
//! the fit.

use nalgebra::DMatrix;
use tongue_core::random::{normal, normals, seed_of};
use tongue_core::statics::lanes::{Lanes, Load};
use tongue_fit::MM;
use tongue_fit::body::Body;
use tongue_fit::inverse::batch::{Known, Thoroughness, assess};
use tongue_fit::inverse::{FitSettings, Matched, Method};
use tongue_fit::material::Constants;
use tongue_fit::measured::{Dataset, TargetKind};
use tongue_fit::parallel;
use tongue_fit::statics::{self, SolveStatus};
use tongue_fit::system::{Model, System};
use tongue_infer::posterior::{
    Density, Draw, Ground, Meaning, Measurements, Priors, Report, Sampling, sample,
};

use crate::cases;
use crate::fixtures::{target, tongue};

/// Variance of a stretch by the rounding of lengths of some 50 mm to millimetres.
const ROUNDING: f64 = 6.7e-5;

fn ground(priors: &str) -> Ground {
    let priors = Priors::from_toml(priors, "test").unwrap();
    Ground::new(&Body::tongue(5.5 * MM).unwrap(), &Model::default(), &priors).unwrap()
}

/// Stretches of a body in the postures of a speaker, one after the other, if it has them.
fn stretches(density: &Density<'_>, truth: &Meaning, system: &System<2>) -> Option<Vec<f64>> {
    let lanes = Lanes::new(system);
    let settings = statics::SolveSettings::default();
    let lengths = |load: Load<'_, 2>| {
        let shape = lanes.solve(&[load], &settings).remove(0);
        (shape.solution.status == SolveStatus::Converged).then(|| system.lengths(&shape.positions))
    };
    let over = lengths(density.ground.load(truth, density.postures(), None))?;
    let mut all = Vec::new();
    for posture in 0..density.postures() {
        all.extend(
            lengths(density.ground.load(truth, posture, None))?.iter().zip(&over).map(|(l, l0)| l / l0),
        );
    }
    Some(all)
}

/// Of so many postures, with errors that are zero.
fn exact(ground: &Ground, postures: usize, stretches: &[f64]) -> Measurements {
    let count = ground.muscles.len();
    let n = stretches.len();
    let rounding = DMatrix::from_fn(n, n, |i, j| {
        // Half of it comes from the baseline, which the postures share.
        let of_baseline = if i % count == j % count { 0.5 * ROUNDING } else { 0.0 };
        of_baseline + if i == j { 0.5 * ROUNDING } else { 0.0 }
    });
    Measurements {
        names: (0..n).map(|i| ground.muscles[i % count].clone()).collect(),
        muscles: (0..n).map(|i| i % count).collect(),
        postures: (0..n).map(|i| i / count).collect(),
        stretches: stretches.to_vec(),
        rounding,
        labels: (0..postures).map(|p| format!("v{p}")).collect(),
        ..Measurements::nothing()
    }
}

/// What was seen of true stretches.
fn seen(ground: &Ground, postures: usize, stretches: &[f64], random: &mut fastrand::Rng) -> Measurements {
    let mut seen = exact(ground, postures, stretches);
    let n = stretches.len();
    let errors = &seen.rounding + DMatrix::identity(n, n) * ground.priors.discrepancy.sd.powi(2);
    let errors = errors.cholesky().unwrap().l() * normals(n, random);
    seen.stretches.iter_mut().zip(errors.iter()).for_each(|(s, e)| *s += e);
    seen
}

/// A density of which nothing was seen yet.
fn unseen(ground: &Ground, postures: usize) -> Density<'_> {
    let count = postures * ground.muscles.len();
    Density::new(ground, exact(ground, postures, &vec![1.0; count])).unwrap()
}

/// A number of a meaning, and its name.
type Number<'a> = (String, Box<dyn Fn(&Meaning) -> f64 + Sync + 'a>);

/// All that is sampled, and what is told of it.
fn unknowns(ground: &Ground, postures: usize) -> Vec<Number<'_>> {
    let mut all: Vec<Number<'_>> = Vec::new();
    for (m, name) in ground.muscles.iter().enumerate() {
        all.push((format!("F0 {name}"), Box::new(move |d| d.tones[m])));
        for p in 0..postures {
            all.push((format!("F {name} {p}"), Box::new(move |d| d.postures[p].tensions[m])));
            all.push((
                format!("F - F0 {name} {p}"),
                Box::new(move |d| d.postures[p].tensions[m] - d.tones[m]),
            ));
        }
        if postures > 1 {
            let contrast = move |d: &Meaning| d.postures[0].tensions[m] - d.postures[1].tensions[m];
            all.push((format!("contrast {name}"), Box::new(contrast)));
        }
    }
    for p in 0..postures {
        for axis in 0..2 {
            all.push((format!("hyoid {axis} {p}"), Box::new(move |d| d.postures[p].hyoid[axis])));
        }
    }
    all.push(("tilt".to_owned(), Box::new(|d| d.tilt)));
    all
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
    let ground = ground("muscle_ends.off = true\noutline.off = true\ncompressibility.off = true\n");
    for (postures, count) in [(1, cases(30)), (3, cases(8))] {
        let unknowns = unknowns(&ground, postures);
        let numbers: Vec<usize> = (0..count).collect();
        let ranks: Vec<Option<Vec<f64>>> = parallel::map(&numbers, |&number| {
            let mut random = fastrand::Rng::with_seed(seed_of(11, number));
            let density = unseen(&ground, postures);
            let (truth, measured) = loop {
                let (truth, _) = density.meaning(&normals(density.parameters.len(), &mut random));
                if let Some(s) = stretches(&density, &truth, &ground.system) {
                    break (truth, s);
                }
            };
            let seen = seen(&ground, postures, &measured, &mut random);
            let posterior = sample(&ground, seen, &Sampling { draws: 160, seed: number as u64 }).unwrap();
            if posterior.draws.is_empty() {
                return None;
            }
            let rank = |value: &dyn Fn(&Meaning) -> f64| {
                let own = value(&truth);
                let below = posterior.draws.iter().filter(|d| value(&d.meaning) < own).count() as f64;
                below / (posterior.draws.len() as f64 + 1.0)
            };
            let width = 1.0 / (posterior.draws.len() as f64 + 1.0);
            Some(unknowns.iter().map(|(_, value)| rank(value.as_ref()) + width * random.f64()).collect())
        });
        let ranks: Vec<Vec<f64>> = ranks.into_iter().flatten().collect();
        assert!(ranks.len() * 20 >= count * 19, "{} of {count} were sampled", ranks.len());
        let mut low = Vec::new();
        for (quantity, (name, _)) in unknowns.iter().enumerate() {
            let p = p_of_uniform(ranks.iter().map(|r| r[quantity]).collect());
            low.push((p, name));
        }
        low.sort_by(|a, b| a.0.total_cmp(&b.0));
        eprintln!("{postures} postures, {} speakers, lowest: {:?}", ranks.len(), &low[..4]);
        // The lowest of so many by chance, once in a hundred runs.
        assert!(low[0].0 > 0.01 / unknowns.len() as f64, "{postures}: {low:?}");
        let first = ranks.iter().map(|r| r[1].powi(4)).collect();
        assert!(count < 20 || p_of_uniform(first) < 0.01, "the test can fail");
    }
}

/// Parts of 95 % intervals that hold the truth, in tensions, changes and contrasts, where ends, outline and kappa of the body that was measured are
/// other ones than those of the body that is fitted.
fn coverage(truth: &Ground, fitted: &Ground, postures: usize, count: usize) -> [f64; 3] {
    let numbers: Vec<usize> = (0..count).collect();
    let muscles = truth.muscles.len();
    let all: Vec<usize> = (0..muscles).collect();
    let unknowns = unknowns(truth, postures);
    let kinds = ["F ", "F - F0 ", "contrast "];
    let held: Vec<Option<[usize; 3]>> = parallel::map(&numbers, |&number| {
        let mut random = fastrand::Rng::with_seed(seed_of(17, number));
        let density = unseen(truth, postures);
        let (meaning, measured) = loop {
            let (meaning, _) = density.meaning(&normals(density.parameters.len(), &mut random));
            let ends = normals(truth.ends.len(), &mut random);
            let outline = normals(truth.outline.len(), &mut random);
            let Some(body) = truth.displaced(ends.as_slice(), outline.as_slice()) else { continue };
            // Kappa goes with lambda minus mu; mu, and with it the springs, stays.
            let kappa = (truth.priors.compressibility.sd_ln_kappa * normal(&mut random)).exp();
            let (lambda, mu) = truth.model.constants.lame();
            let lambda = mu + (lambda - mu) * kappa;
            let poisson_ratio = lambda / (2.0 * (lambda + mu));
            let young_modulus = 2.0 * mu * (1.0 + poisson_ratio);
            let constants = Constants { poisson_ratio, young_modulus, ..truth.model.constants };
            let model = Model { constants, ..truth.model };
            let Ok(system) = System::new(&body.mesh, &model, &all) else { continue };
            if let Some(s) = stretches(&density, &meaning, &system) {
                break (meaning, s);
            }
        };
        let seen = seen(truth, postures, &measured, &mut random);
        let posterior = sample(fitted, seen, &Sampling { draws: 400, seed: number as u64 }).unwrap();
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
        let of_kind = |kind: &str| {
            let own = unknowns.iter().filter(|(name, _)| match kind {
                "F " => name.starts_with("F ") && !name.starts_with("F - "),
                _ => name.starts_with(kind),
            });
            own.map(|(_, value)| holds(value.as_ref())).sum()
        };
        Some(kinds.map(of_kind))
    });
    let told: Vec<[usize; 3]> = held.into_iter().flatten().collect();
    assert!(told.len() * 50 >= count * 49, "{} of {count} are told", told.len());
    let of = |kind: usize, each: usize| {
        told.iter().map(|h| h[kind]).sum::<usize>() as f64 / (told.len() * each).max(1) as f64
    };
    [of(0, muscles * postures), of(1, muscles * postures), of(2, muscles)]
}

#[test]
fn intervals_cover_the_truth_of_bodies_that_are_not_the_one_fitted() {
    let usual = ground("");
    let count = cases(12);
    let found = coverage(&usual, &usual, 1, count);
    eprintln!("coverage under the stated priors, {count} cases: {found:.3?}");
    // Four standard errors of a binomial of independent cases about 95 %.
    let room = 4.0 * (0.95f64 * 0.05 / (8 * count) as f64).sqrt();
    assert!((found[0] - 0.95).abs() < room && (found[1] - 0.95).abs() < room, "{found:?}");
    // A wrong scale of the tensions is not seen by the intervals: that is why it is told beside them.
    if count > 100 {
        for (name, wrong) in
            [("F ~ HN30", "tension.scale_n_per_m = 30.0"), ("F ~ HN10", "tension.scale_n_per_m = 10.0")]
        {
            let found = coverage(&ground(wrong), &usual, 1, count);
            eprintln!("coverage where {name}: tensions {:.3}, changes {:.3}", found[0], found[1]);
        }
    }
}

#[test]
fn intervals_of_speakers_of_three_vowels_cover_the_truth_and_so_do_contrasts() {
    let usual = ground("");
    let count = cases(6);
    let found = coverage(&usual, &usual, 3, count);
    eprintln!("coverage of {count} speakers of three vowels: {found:.3?}");
    // Four standard errors of a binomial of independent contrasts about 95 %; at the published number of speakers 93 to 97 %.
    let room = (4.0 * (0.95f64 * 0.05 / (8 * count) as f64).sqrt()).max(0.02);
    assert!(found.iter().all(|part| (part - 0.95).abs() < room), "{found:?}");
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

    let off = [
        "baseline",
        "hyoid",
        "hyoid_tilt",
        "muscle_ends",
        "outline",
        "compressibility",
        "discrepancy",
        "young_modulus",
    ];
    let off: String = off.iter().map(|name| format!("[{name}]\noff = true\n")).collect();
    let passive = ["GGm", "GGp", "SGp", "SGa", "HGp"].map(|name| format!("{name} = 0.0\n")).concat();
    let ground = ground(&format!("{off}[tension]\nscale_n_per_m = 1e3\n[tension.fixed_n_per_m]\n{passive}"));
    let mut seen = Measurements::of(&Matched::new(&mesh, &target).unwrap());
    for position in (0..seen.names.len()).rev().filter(|m| !target.active.contains(m)) {
        seen = seen.without(position);
    }
    let posterior = sample(&ground, seen, &Sampling { draws: 16_000, seed: 3 }).unwrap();
    for (&muscle, bootstrap) in target.active.iter().zip(&drawn.tensions) {
        let mut all: Vec<f64> = posterior.draws.iter().map(|d| d.tension(0, muscle)).collect();
        all.sort_by(f64::total_cmp);
        let at = |p: f64| all[((all.len() - 1) as f64 * p).round() as usize];
        let ratio = (at(0.975) - at(0.025)) / (bootstrap.high - bootstrap.low);
        eprintln!(
            "{}: {:.1} to {:.1}, {ratio:.3} of {bootstrap:?}",
            target.muscles[muscle],
            at(0.025),
            at(0.975)
        );
        // The middle 95 % of two uniform roundings are 3 % narrower than those of a normal number of the same
        // variance.
        assert!((ratio - 1.03).abs() < 0.04, "{}: {ratio}", target.muscles[muscle]);
    }
}

/// A sign that is told with a probability of .9 keeps .85 where the scale of the tensions' prior is half or twice as large, or is marked.
#[test]
fn a_sign_that_is_sure_and_not_marked_is_sure_under_half_and_twice_the_prior() {
    let scaled = |factor: f64| {
        let scale = 20.0 * factor;
        ground(&format!("[tension]\nscale_n_per_m = {scale}\n[baseline]\nscale_n_per_m = {scale}"))
    };
    let grounds = [1.0, 0.5, 2.0].map(scaled);
    let mut compared = 0;
    for (subject, vowel) in [("S2", "e"), ("S3", "o")] {
        let target = Dataset::reference().unwrap().stretches(subject, vowel).unwrap();
        let matched = Matched::new(&tongue(), &target).unwrap();
        let summaries = grounds.each_ref().map(|ground| {
            let seen = Measurements::of(&matched);
            let posterior = sample(ground, seen, &Sampling { draws: 1000, seed: 1 }).unwrap();
            Report::of_each(&posterior, false, 1).unwrap().remove(0).summary
        });
        let [usual, others @ ..] = summaries;
        for (muscle, change) in &usual.unwrap().changes_n.0 {
            let rises = change.probability_rises > 0.5;
            let sure = |p: f64| if rises { p } else { 1.0 - p };
            if sure(change.probability_rises) < 0.9 || change.sign_depends_on_prior {
                continue;
            }
            for other in others.iter().flatten() {
                let p = other.changes_n.0.iter().find(|(m, _)| m == muscle).unwrap().1.probability_rises;
                assert!(sure(p) >= 0.85, "{subject} {vowel} {muscle}: {p}");
                compared += 1;
            }
        }
    }
    assert!(compared >= 3, "{compared}");
}
