//! What the errors of a body's geometry do to the stretches is what bodies that are moved show.

use nalgebra::DVector;
use tongue_core::statics::lanes::{Lanes, Load};
use tongue_core::statistics::normals;
use tongue_fit::body::{Body, ContinuumSettings};
use tongue_fit::statics::SolveStatus;
use tongue_fit::system::{Model, System};
use tongue_fit::{MM, parallel};
use tongue_infer::posterior::{Density, MapEstimate, PosteriorModel, Priors};

use crate::posterior::{at_mode, posterior_model, seen};

#[test]
fn stretches_of_a_continuum_answer_to_its_widths_as_bodies_laid_anew_do() {
    let continuum = Body::continuum(8.0 * MM, &ContinuumSettings::default()).unwrap();
    // The hyoid's nodes are others in a body of other patches: it moves without tilting here.
    let priors = Priors::from_toml("hyoid_tilt.off = true", "test").unwrap();
    let posterior_model = PosteriorModel::new(&continuum, &Model::default(), &priors).unwrap();
    let mut density = Density::new(&posterior_model, seen("S2", "a")).unwrap();
    let mode = MapEstimate::find(&mut density).unwrap();
    let (meaning, _) = density.meaning(&mode.scores);
    let all: Vec<usize> = (0..posterior_model.muscles.len()).collect();
    let stretches = |settings: &ContinuumSettings| -> DVector<f64> {
        let body = posterior_model.body.with_continuum(settings).unwrap().unwrap();
        let system = System::new(&body.mesh, &posterior_model.model, &all).unwrap();
        let solved = |load: Load<'_, 2>| {
            let found = Lanes::new(&system).solve(&[load], density.settings()).remove(0);
            assert_eq!(found.solution.status, SolveStatus::Converged);
            system.lengths(&found.positions)
        };
        let own = &meaning.postures[0];
        let vowel = Load::new(own.tensions.clone()).with_bone(body.bone("hyoid"), own.hyoid);
        let (vowel, base) = (solved(vowel), solved(Load::new(meaning.tones.clone())));
        DVector::from_fn(all.len(), |m, _| vowel[m] / base[m])
    };
    let own = posterior_model.body.mesh.continuum.as_ref().unwrap().settings;
    let (width, patch) = (posterior_model.priors.bundle_width.sd_ln, posterior_model.priors.bone_patch.sd_ln);
    let answers = at_mode(&density, &mode).geometry;
    for (derivative, [width, patch]) in [(&answers.width, [width, 0.0]), (&answers.patch, [0.0, patch])] {
        let by = |part: f64| ContinuumSettings {
            bundle_width_m: own.bundle_width_m * (part * width).exp(),
            patch_radius_m: own.patch_radius_m * (part * patch).exp(),
            ..own
        };
        // Of a step as long as that of the derivative: a secant of what has no derivatives of higher order.
        let difference = stretches(&by(0.5)) - stretches(&by(-0.5));
        let error = (derivative.column(0) - &difference).amax();
        assert!(error < 0.03 * difference.amax() && difference.amax() > 1e-3, "{error}: {difference}");
    }
}

/// Scores of draws of the posterior's normal approximation at a mode, without those of which there is no
/// equilibrium.
fn laplace_draws(mode: &MapEstimate, count: usize, seed: u64) -> Vec<DVector<f64>> {
    let mut random = fastrand::Rng::with_seed(seed);
    let root = mode.precision.clone().cholesky().unwrap().inverse().cholesky().unwrap().unpack();
    (0..count).map(|_| &mode.scores + &root * normals(root.nrows(), &mut random)).collect()
}

#[test]
fn the_covariance_of_geometry_is_that_of_bodies_that_are_moved_over_the_posterior() {
    // With kappa known, the covariance is that of ends and outline.
    let posterior_model =
        posterior_model(&Priors::from_toml("compressibility.sd_ln_kappa = 1e-4", "test").unwrap());
    let mut density = Density::new(&posterior_model, seen("S2", "a")).unwrap();
    let mode = MapEstimate::find(&mut density).unwrap();
    let all: Vec<usize> = (0..posterior_model.muscles.len()).collect();
    let draws: Vec<(u64, DVector<f64>)> = (0..).zip(laplace_draws(&mode, 200, 2)).collect();
    let moved: Vec<Option<DVector<f64>>> = parallel::map(&draws, |(number, scores)| {
        let mut random = fastrand::Rng::with_seed(1000 + number);
        let (meaning, _) = density.meaning(scores);
        let ends = normals(posterior_model.ends.len(), &mut random);
        let outline = normals(posterior_model.outline.len(), &mut random);
        let body = posterior_model.displaced(ends.as_slice(), outline.as_slice())?;
        let system = System::new(&body.mesh, &posterior_model.model, &all).ok()?;
        let lengths = |load: Load<'_, 2>, system: &System<2>| {
            let shape = density.lanes().solve(&[load], density.settings()).remove(0);
            (shape.solution.status == SolveStatus::Converged).then(|| system.lengths(&shape.positions))
        };
        let stretches = |system: &System<2>| {
            let load = |s| Load { system: Some(system), ..density.posterior_model.load(&meaning, s, None) };
            let (posture, base) = (lengths(load(0), system)?, lengths(load(density.postures()), system)?);
            Some(DVector::from_fn(all.len(), |m, _| posture[m] / base[m]))
        };
        Some(stretches(&system)? - stretches(&posterior_model.system)?)
    });
    let moved: Vec<_> = moved.into_iter().flatten().collect();
    assert!(moved.len() > 120, "{}", moved.len());
    let found = moved.iter().map(|d| d.norm_squared()).sum::<f64>() / moved.len() as f64;
    let linear = mode.geometry.trace();
    assert!((linear / found - 1.0).abs() < 0.25, "{linear} {found}");
}
