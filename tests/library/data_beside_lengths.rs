//! Muscle activity, contours and coils together with stretches in one posterior: derivatives, the effect of geometry, and the information
//! that they add.

use std::sync::LazyLock;

use nalgebra::{DMatrix, DVector, DVectorView};
use tongue_core::random::{normal, normals};
use tongue_core::statics::lanes::{Lanes, Load};
use tongue_core::statistics::mean_and_variance;
use tongue_fit::body::{Body, ContinuumSettings, Mesh};
use tongue_fit::geometry::Point;
use tongue_fit::measured::recording::{self, Format, Map, Recording};
use tongue_fit::parallel;
use tongue_fit::statics::SolveStatus;
use tongue_fit::system::{Model, System};
use tongue_fit::track::TongueSurface;
use tongue_infer::posterior::{
    AuxiliaryData, Draw, MapEstimate, Measurements, ParameterValues, Posterior, PosteriorModel,
    PosteriorProblem, Priors, Sampling,
};

use crate::fixtures::less_compressible;
use crate::posterior::{at_mode, coarse_posterior_model, derivatives, measurements, posterior_model};

fn posterior_models() -> Vec<PosteriorModel> {
    let bodies = [Body::tongue(5.5e-3), Body::continuum(8e-3, &ContinuumSettings::default())];
    bodies
        .map(|body| PosteriorModel::new(&body.unwrap(), &Model::default(), &Priors::default()).unwrap())
        .into()
}

fn stretches() -> Measurements {
    measurements("S2", "a")
}

/// Activity of GGa, and of the hyoglossus (HGa and HGp together), in the posture and in the baseline.
fn emg(active: [f64; 2]) -> AuxiliaryData {
    let electrodes = [
        (vec![0], vec![(Some(0), 0.9), (None, 0.3)]),
        (vec![6, 7], vec![(Some(0), active[0]), (None, active[1])]),
        (vec![4], vec![(Some(0), 1.0)]),
    ];
    AuxiliaryData::emg(&electrodes)
}

/// Points of the surface for these positions of the nodes, m.
fn points_of(posterior_model: &PosteriorModel, positions: &[Point]) -> Vec<Point> {
    let curve = TongueSurface::of(&posterior_model.body).unwrap().curve;
    let place = |i: usize| curve.weights(curve.length() * (0.2 + 0.06 * f64::from(i as u32)));
    (0..11).map(|i| place(i).iter().map(|(node, w)| positions[*node] * *w).sum()).collect()
}

/// Contours of the posture and, if it is given, of the baseline.
fn contours(of: &PosteriorModel, posture: &[Point], baseline: Option<&[Point]>) -> AuxiliaryData {
    let all: Vec<&[Point]> = [posture].into_iter().chain(baseline).collect();
    AuxiliaryData::points(&of.body, &recording::AlignedRecording::of_contours(&all), &[Some(0), None])
        .unwrap()
}

/// Coils at three points of the tongue in the posture and in the baseline, for these positions of the nodes, m.
fn coils(posterior_model: &PosteriorModel, positions: [&[Point]; 2]) -> AuxiliaryData {
    let surface = TongueSurface::of(&posterior_model.body).unwrap();
    let file = |positions: &[Point]| {
        let place = |behind: f64| -> Point {
            let weights = surface.curve.weights(surface.tip - behind);
            weights.iter().map(|(node, w)| positions[*node] * *w).sum()
        };
        let row =
            |(n, behind): (usize, f64)| format!("T{n},{},{}\n", 1e3 * place(behind).x, 1e3 * place(behind).y);
        let rows: String = (1..).zip([10e-3, 25e-3, 40e-3]).map(row).collect();
        let table = format!("point,x_mm,y_mm\n{rows}");
        Recording::from_bytes(table.as_bytes(), "coils.csv", Some(Format::Tidy)).unwrap().remove(0)
    };
    let both = Recording::of_coils(&positions.map(file)).unwrap();
    let aligned_recording = recording::AlignedRecording::new(&both, &Map::default()).unwrap();
    AuxiliaryData::points(&posterior_model.body, &aligned_recording, &[Some(0), None]).unwrap()
}

fn with_all(posterior_model: &PosteriorModel) -> Measurements {
    let rest = posterior_model.system.rest();
    let points: Vec<Point> =
        points_of(posterior_model, rest).iter().map(|p| p + Point::new(1e-3, 2e-3)).collect();
    let baseline = points_of(posterior_model, rest);
    let auxiliary = emg([0.8, 0.1])
        .and(contours(posterior_model, &points, Some(&baseline)))
        .and(coils(posterior_model, [rest, rest]));
    Measurements { auxiliary, ..stretches() }
}

#[test]
fn derivatives_of_stretches_and_other_data_are_exact() {
    for posterior_model in &posterior_models() {
        let mut problem = PosteriorProblem::new(posterior_model, with_all(posterior_model)).unwrap();
        let map_estimate = problem.map().unwrap();
        let n = problem.parameters.len();
        let stretches = problem.measurements.stretches.len();
        let rows = problem.rows.len() - stretches;
        assert_eq!(rows, 4 + 22 + 12, "activity in one posture says nothing");
        let at = &map_estimate.scores + normals(n, &mut fastrand::Rng::with_seed(1)) * 0.2;
        for (row, i, exact, difference) in derivatives(&problem, &at, &map_estimate.solved, 1e-3) {
            // The scale is 1 for stretches and for logarithms of activity, and a millimetre for points.
            let scale = if row < stretches + 4 { 1.0 } else { 1e-3 };
            assert!((exact - difference).abs() < 1e-5 * scale, "{row} {i}: {exact} {difference}");
        }
    }
}

#[test]
fn what_geometry_does_to_stretches_and_other_data_is_what_bodies_that_are_moved_show() {
    for posterior_model in &posterior_models() {
        let mut problem = PosteriorProblem::new(posterior_model, with_all(posterior_model)).unwrap();
        let map_estimate = problem.map().unwrap();
        let (values, _) = problem.parameter_values(&map_estimate.scores);
        let answers = at_mode(&problem, &map_estimate).geometry;
        let all: Vec<usize> = (0..posterior_model.muscles.len()).collect();
        // The values are stretches, then the other data of the posture and of the baseline.
        let values = |mesh: &Mesh<2>, model: &Model| -> DVector<f64> {
            let system = System::new(mesh, model, &all).unwrap();
            let load = |s| Load {
                system: Some(&system),
                ..posterior_model.load(&values, s, Some(map_estimate.solved.shape(s).0))
            };
            let shapes = problem.lanes().solve(&[load(0), load(1)], problem.settings());
            let [vowel, base] = [0, 1].map(|s| system.lengths(&shapes[s].positions));
            let shape = |posture: Option<usize>| shapes[posture.unwrap_or(1)].positions.as_slice();
            let auxiliary = problem.measurements.auxiliary.values(&values, shape);
            DVector::from_vec(vowel.iter().zip(&base).map(|(v, b)| v / b).chain(auxiliary).collect())
        };
        let agree = |derivative: DVectorView<'_, f64>, difference: &DVector<f64>, what: &str| {
            assert!((derivative - difference).amax() < 1e-6, "{what}: {derivative} {difference}");
        };
        let h = 1e-3;
        let [mut of_stretches, mut of_others]: [f64; 2] = [0.0; 2];
        let of_fields =
            [(&answers.ends, &posterior_model.ends), (&answers.outline, &posterior_model.outline)];
        for (derivative, fields) in of_fields {
            for (f, field) in fields.iter().enumerate().step_by(3) {
                let side = |by: f64| {
                    let body = posterior_model.displaced([(field, by)]).unwrap();
                    values(&body.mesh, &posterior_model.model)
                };
                let difference = (side(h) - side(-h)) / (2.0 * h);
                agree(derivative.column(f), &difference, &format!("{f} of {}", fields.len()));
                of_stretches = of_stretches.max(difference.rows(0, all.len()).amax());
                of_others = of_others.max(difference.rows_range(all.len()..).amax());
            }
        }
        assert!(of_stretches > 5e-3 && of_others > 0.3e-3, "they do matter: {of_stretches} {of_others}");
        let with = |ln_kappa: f64| {
            values(&posterior_model.body.mesh, &less_compressible(posterior_model, ln_kappa.exp()))
        };
        let sd = posterior_model.priors.compressibility.sd_ln_kappa;
        let difference = (with(sd) - with(-sd)) * 0.5;
        agree(answers.kappa.column(0), &difference, "kappa");
        assert!(difference.rows(0, all.len()).amax() > 1e-3, "{difference}");
    }
}

/// Squared norm, in standard deviations, of the residuals of a contour and of coils at rest, if the data of posture and baseline are
/// shifted by `moved`.
fn costs(posterior_model: &PosteriorModel, moved: [Point; 2]) -> [f64; 2] {
    let rest = posterior_model.system.rest();
    let [a, b] = moved.map(|by| rest.iter().map(|p| p + by).collect::<Vec<_>>());
    let contour = |positions: &[Point]| points_of(posterior_model, positions);
    let both =
        [contours(posterior_model, &contour(&a), Some(&contour(&b))), coils(posterior_model, [&a, &b])];
    both.map(|auxiliary| {
        let nothing = ParameterValues { postures: Vec::new(), tilt: 0.0 };
        let computed = DVector::from_vec(auxiliary.values(&nothing, |_| rest));
        let residuals = DVector::from_vec(auxiliary.measured) - computed;
        residuals.dot(&auxiliary.errors.cholesky().unwrap().solve(&residuals))
    })
}

#[test]
fn a_common_shift_is_one_standard_deviation_and_a_shift_of_one_posture_is_many() {
    let posterior_model = &posterior_models()[0];
    // The shift is one standard deviation of the placement.
    let back = Point::new(5e-3, 0.0);
    let of_both = costs(posterior_model, [back; 2]);
    for (common, apart) in of_both.into_iter().zip(costs(posterior_model, [back, Point::zeros()])) {
        assert!(common < 2.0, "{common}");
        assert!(apart > 8.0 * common.max(1.0), "{apart} {common}");
    }
}

#[test]
fn a_contour_that_was_drawn_the_other_way_has_the_same_errors() {
    let posterior_model = &posterior_models()[0];
    let mut points = points_of(posterior_model, posterior_model.system.rest());
    let forth = contours(posterior_model, &points, Some(&points)).errors;
    points.reverse();
    let back = contours(posterior_model, &points, Some(&points)).errors;
    let other = |i: usize| 11 * (i / 11) + 10 - i % 11;
    let expected = DMatrix::from_fn(22, 22, |i, j| back[(other(i), other(j))]);
    assert!((&forth - expected).amax() < 1e-9 * forth.amax());
}

const SETTINGS: Sampling = Sampling { draws: 1000, seed: 1 };

/// The posterior of stretches alone, sampled once.
fn alone() -> &'static Posterior<'static> {
    static ALONE: LazyLock<Posterior<'static>> = LazyLock::new(|| {
        let posterior_model = Box::leak(Box::new(coarse_posterior_model(&Priors::default())));
        posterior_model.posterior(stretches(), &SETTINGS).unwrap()
    });
    &ALONE
}

#[test]
fn each_kind_adds_to_what_is_known() {
    let alone = alone();
    let posterior_model = alone.problem.posterior_model;
    assert!(alone.is_mixed(), "{}", alone.diagnostics.why);
    // A contour of the baseline adds information, because the errors of placement and body are common to both.
    let mean_sd = |draws: &[Draw]| {
        let sd = |m: usize| mean_and_variance(draws.iter().map(|d| d.change(0, m))).1.sqrt();
        (0..8).map(sd).sum::<f64>() / 8.0
    };
    let part = |auxiliary: AuxiliaryData| {
        let with = posterior_model.posterior(Measurements { auxiliary, ..stretches() }, &SETTINGS).unwrap();
        assert!(with.is_mixed(), "{}", with.diagnostics.why);
        mean_sd(&with.draws) / mean_sd(&alone.draws)
    };
    let shape = &alone.map_estimate.solved.shapes[0];
    let baseline = points_of(posterior_model, &alone.map_estimate.solved.shapes[1]);
    let posture = points_of(posterior_model, shape);
    let one = part(contours(posterior_model, &posture, None));
    let both = part(contours(posterior_model, &posture, Some(&baseline)));
    let glued = part(coils(posterior_model, [shape, &alone.map_estimate.solved.shapes[1]]));
    assert!((0.93..1.0).contains(&one) && (0.85..0.95).contains(&both), "{one} {both}");
    assert!((0.85..0.98).contains(&glued), "{glued}");
}

#[test]
fn activity_narrows_its_muscles_and_its_unit_does_not_matter() {
    let posterior_model = alone().problem.posterior_model;
    let sds = |found: &Posterior<'_>| -> Vec<f64> {
        assert!(found.is_mixed(), "{}", found.diagnostics.why);
        (0..8).map(|m| mean_and_variance(found.draws.iter().map(|d| d.change(0, m))).1.sqrt()).collect()
    };
    let measured = Measurements { auxiliary: emg([0.9, 0.3]), ..stretches() };
    let (without, with) = (sds(alone()), sds(&posterior_model.posterior(measured, &SETTINGS).unwrap()));
    let parts: Vec<f64> = with.iter().zip(&without).map(|(with, without)| with / without).collect();
    assert!(parts.iter().sum::<f64>() / 8.0 < 1.03, "{parts:?}");
    assert!(parts[0] < 0.9 && 0.5 * (parts[6] + parts[7]) < 1.0, "{parts:?}");
    // The gain of an electrode is free, so other units of activity change nothing.
    let mode_with = |times: f64| {
        let mut auxiliary = emg([0.8, 0.1]);
        auxiliary.measured.iter_mut().take(2).for_each(|ln| *ln += times.ln());
        let mut problem =
            PosteriorProblem::new(posterior_model, Measurements { auxiliary, ..stretches() }).unwrap();
        problem.map().unwrap().scores
    };
    assert!((mode_with(1.0) - mode_with(5.0)).amax() < 0.01);
}

#[test]
fn stretches_of_a_continuum_answer_to_its_widths_as_bodies_laid_anew_do() {
    let continuum = Body::continuum(8e-3, &ContinuumSettings::default()).unwrap();
    // The nodes of the hyoid depend on the patches of the body, so the hyoid moves without tilting here.
    let priors = Priors::from_toml("hyoid_tilt.off = true", "test").unwrap();
    let posterior_model = PosteriorModel::new(&continuum, &Model::default(), &priors).unwrap();
    let mut problem = PosteriorProblem::new(&posterior_model, measurements("S2", "a")).unwrap();
    let map_estimate = problem.map().unwrap();
    let (values, _) = problem.parameter_values(&map_estimate.scores);
    let all: Vec<usize> = (0..posterior_model.muscles.len()).collect();
    let stretches = |settings: &ContinuumSettings| -> DVector<f64> {
        let body = posterior_model.body.with_continuum(settings).unwrap().unwrap();
        let system = System::new(&body.mesh, &posterior_model.model, &all).unwrap();
        let solved = |load: Load<'_, 2>| {
            let found = Lanes::new(&system).solve(&[load], problem.settings()).remove(0);
            assert_eq!(found.solution.status, SolveStatus::Converged);
            system.lengths(&found.positions)
        };
        let own = &values.postures[0];
        let vowel = Load::new(own.tensions.clone()).with_bone(body.bone("hyoid"), own.hyoid);
        let (vowel, base) = (solved(vowel), solved(Load::new(values.tones().to_vec())));
        DVector::from_fn(all.len(), |m, _| vowel[m] / base[m])
    };
    let own = posterior_model.body.mesh.continuum.as_ref().unwrap().settings;
    let (width, patch) = (posterior_model.priors.bundle_width.sd_ln, posterior_model.priors.bone_patch.sd_ln);
    let answers = at_mode(&problem, &map_estimate).geometry;
    for (derivative, [width, patch]) in [(&answers.width, [width, 0.0]), (&answers.patch, [0.0, patch])] {
        let by = |part: f64| ContinuumSettings {
            bundle_width_m: own.bundle_width_m * (part * width).exp(),
            patch_radius_m: own.patch_radius_m * (part * patch).exp(),
            ..own
        };
        // The difference has a step as long as that of the derivative, which is itself a secant.
        let difference = stretches(&by(0.5)) - stretches(&by(-0.5));
        let error = (derivative.column(0) - &difference).amax();
        assert!(error < 0.03 * difference.amax() && difference.amax() > 1e-3, "{error}: {difference}");
    }
}

/// Draws from the Laplace approximation at the mode, without those that have no equilibrium.
fn laplace_draws(map_estimate: &MapEstimate, count: usize, seed: u64) -> Vec<DVector<f64>> {
    let mut random = fastrand::Rng::with_seed(seed);
    let root = map_estimate.precision.clone().cholesky().unwrap().inverse().cholesky().unwrap().unpack();
    (0..count).map(|_| &map_estimate.scores + &root * normals(root.nrows(), &mut random)).collect()
}

#[test]
fn the_covariance_of_geometry_is_that_of_bodies_that_are_moved_over_the_posterior() {
    // If kappa is known, the covariance is that of muscle ends and outline.
    let posterior_model =
        posterior_model(&Priors::from_toml("compressibility.sd_ln_kappa = 1e-4", "test").unwrap());
    let mut problem = PosteriorProblem::new(&posterior_model, measurements("S2", "a")).unwrap();
    let map_estimate = problem.map().unwrap();
    let all: Vec<usize> = (0..posterior_model.muscles.len()).collect();
    let draws: Vec<(u64, DVector<f64>)> = (0..).zip(laplace_draws(&map_estimate, 200, 2)).collect();
    let moved: Vec<Option<DVector<f64>>> = parallel::map(&draws, |(number, scores)| {
        let mut random = fastrand::Rng::with_seed(1000 + number);
        let (values, _) = problem.parameter_values(scores);
        let fields = posterior_model.ends.iter().chain(&posterior_model.outline);
        let body = posterior_model.displaced(fields.map(|field| (field, normal(&mut random))))?;
        let system = System::new(&body.mesh, &posterior_model.model, &all).ok()?;
        let lengths = |load: Load<'_, 2>, system: &System<2>| {
            let shape = problem.lanes().solve(&[load], problem.settings()).remove(0);
            (shape.solution.status == SolveStatus::Converged).then(|| system.lengths(&shape.positions))
        };
        let stretches = |system: &System<2>| {
            let load = |s| Load { system: Some(system), ..problem.posterior_model.load(&values, s, None) };
            let (posture, base) = (lengths(load(0), system)?, lengths(load(problem.postures()), system)?);
            Some(DVector::from_fn(all.len(), |m, _| posture[m] / base[m]))
        };
        Some(stretches(&system)? - stretches(&posterior_model.system)?)
    });
    let moved: Vec<_> = moved.into_iter().flatten().collect();
    assert!(moved.len() > 120, "{}", moved.len());
    let found = moved.iter().map(|d| d.norm_squared()).sum::<f64>() / moved.len() as f64;
    let linear = problem.geometry.trace();
    assert!((linear / found - 1.0).abs() < 0.25, "{linear} {found}");
}
