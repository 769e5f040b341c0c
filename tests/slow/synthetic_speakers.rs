//! Speakers with tensions drawn from the priors of a posterior, and their measurements.

use nalgebra::DMatrix;
use tongue_core::geometry::NaturalSpline;
use tongue_core::random::{normal, normals};
use tongue_core::statics::lanes::Lanes;
use tongue_fit::MM;
use tongue_fit::body::Body;
use tongue_fit::geometry::{Point, Similarity};
use tongue_fit::measured::recording::{AlignedRecording, Format, Map, Recording};
use tongue_fit::statics::{self, SolveStatus};
use tongue_fit::system::{Model, System};
use tongue_fit::track::TongueSurface;
use tongue_infer::posterior::{
    AuxiliaryData, MeasuredStretch, Measurements, ParameterValues, PosteriorModel, PosteriorProblem, Priors,
};
use tongue_infer::standard_deviations::{
    COIL_M, EMG, FIRST_COIL_MM, LEFT_SCALE, LEFT_SHIFT_MM, LEFT_TURN_DEG,
};

/// Variance of a stretch by rounding of lengths of some 50 mm to millimetres.
const ROUNDING: f64 = 6.7e-5;

/// The tongue of springs under priors (TOML).
pub fn posterior_model(priors: &str) -> PosteriorModel {
    posterior_model_at(5.5 * MM, priors)
}

/// The tongue with a coarse mesh, with which a posterior takes a quarter of the time.
pub fn coarse_posterior_model(priors: &str) -> PosteriorModel {
    posterior_model_at(10.0 * MM, priors)
}

/// The tongue with this mesh spacing, m.
pub fn posterior_model_at(spacing_m: f64, priors: &str) -> PosteriorModel {
    let priors = Priors::from_toml(priors, "test").unwrap();
    PosteriorModel::new(&Body::tongue(spacing_m).unwrap(), &Model::default(), &priors).unwrap()
}

/// Shapes of a body in the postures of a speaker and, last, in the baseline; `None` if one has no equilibrium.
pub fn shapes(
    problem: &PosteriorProblem<'_>,
    truth: &ParameterValues,
    system: &System<2>,
) -> Option<Vec<Vec<Point>>> {
    let lanes = Lanes::new(system);
    let settings = statics::SolveSettings::default();
    let shape = |posture| {
        let load = problem.posterior_model.load(truth, posture, None);
        let shape = lanes.solve(&[load], &settings).remove(0);
        (shape.solution.status == SolveStatus::Converged).then_some(shape.positions)
    };
    (0..=problem.postures()).map(shape).collect()
}

/// Stretches of shapes against the last one.
pub fn stretches_of(system: &System<2>, shapes: &[Vec<Point>]) -> Vec<f64> {
    let lengths: Vec<Vec<f64>> = shapes.iter().map(|shape| system.lengths(shape)).collect();
    let (over, postures) = lengths.split_last().unwrap();
    postures.iter().flat_map(|own| own.iter().zip(over).map(|(l, l0)| l / l0)).collect()
}

/// Stretches of a body in the postures of a speaker; `None` if one has no equilibrium.
pub fn stretches(
    problem: &PosteriorProblem<'_>,
    truth: &ParameterValues,
    system: &System<2>,
) -> Option<Vec<f64>> {
    Some(stretches_of(system, &shapes(problem, truth, system)?))
}

/// Measurements of this many postures without errors.
fn exact(posterior_model: &PosteriorModel, postures: usize, stretches: &[f64]) -> Measurements {
    let count = posterior_model.muscles.len();
    let n = stretches.len();
    let rounding = DMatrix::from_fn(n, n, |i, j| {
        // Half of the variance is that of the baseline, which the postures share.
        let of_baseline = if i % count == j % count { 0.5 * ROUNDING } else { 0.0 };
        of_baseline + if i == j { 0.5 * ROUNDING } else { 0.0 }
    });
    let all = stretches.iter().enumerate().map(|(i, &value)| {
        let name = posterior_model.muscles[i % count].clone();
        MeasuredStretch { name, muscle: i % count, posture: i / count, value }
    });
    Measurements {
        stretches: all.collect(),
        rounding,
        labels: (0..postures).map(|p| format!("v{p}")).collect(),
        neutral: Some(postures),
        ..Measurements::default()
    }
}

/// Measurements of true stretches with errors.
pub fn measurements(
    posterior_model: &PosteriorModel,
    postures: usize,
    stretches: &[f64],
    random: &mut fastrand::Rng,
) -> Measurements {
    let mut measurements = exact(posterior_model, postures, stretches);
    let n = stretches.len();
    let errors =
        &measurements.rounding + DMatrix::identity(n, n) * posterior_model.priors.discrepancy.sd.powi(2);
    let errors = errors.cholesky().unwrap().l() * normals(n, random);
    measurements.stretches.iter_mut().zip(errors.iter()).for_each(|(s, e)| s.value += e);
    measurements
}

/// Points of shapes in the frame of the fitted body, shifted, turned and scaled as a posterior assumes, with noise along each axis.
fn placed(shapes: &[Vec<Point>], noise_m: f64, random: &mut fastrand::Rng) -> Vec<Vec<Point>> {
    let [scale, turn] = [LEFT_SCALE, LEFT_TURN_DEG.to_radians()].map(|sd| sd * normal(random));
    let shift = Point::new(normal(random), normal(random)) * (LEFT_SHIFT_MM * MM);
    let similarity = Similarity::new(scale.exp(), turn, shift);
    let centre = shapes.iter().flatten().sum::<Point>() / shapes.iter().flatten().count() as f64;
    let mut place = |at: &Point| {
        let noise = Point::new(normal(random), normal(random)) * noise_m;
        centre + similarity.place(at - centre) + noise
    };
    shapes.iter().map(|points| points.iter().map(&mut place).collect()).collect()
}

/// Points of shapes at these distances along the surface, m.
fn on_surface(surface: &TongueSurface, shapes: &[Vec<Point>], places: &[f64]) -> Vec<Vec<Point>> {
    let place = |shape: &[Point], at: f64| -> Point {
        surface.curve.weights(at).iter().map(|(n, w)| shape[*n] * *w).sum()
    };
    shapes.iter().map(|shape| places.iter().map(|&at| place(shape, at)).collect()).collect()
}

/// Numbers of the postures of `shapes`, of which the last one is the baseline.
fn postures(shapes: &[Vec<Point>]) -> Vec<Option<usize>> {
    (0..shapes.len() - 1).map(Some).chain([None]).collect()
}

/// Contours of shapes: 11 points with the usual noise, or a spline through them with `between` points in each gap.
pub fn contours(
    body: &Body<2>,
    shapes: &[Vec<Point>],
    between: usize,
    random: &mut fastrand::Rng,
) -> AuxiliaryData {
    let surface = TongueSurface::of(body).unwrap();
    let places = Vec::from_iter((0..11).map(|i| 10.0 * MM + (surface.tip - 13.0 * MM) * f64::from(i) / 10.0));
    let keypoints = placed(&on_surface(&surface, shapes, &places), 0.8 * MM, random);
    let drawn = Vec::from_iter(keypoints.iter().map(|points| {
        let curve = NaturalSpline::through(points).unwrap();
        curve.polygon.iter().step_by(16 / (between + 1)).copied().collect::<Vec<_>>()
    }));
    let recording = AlignedRecording::of_contours(&drawn.iter().map(Vec::as_slice).collect::<Vec<_>>());
    AuxiliaryData::points(body, &recording, &postures(shapes)).unwrap()
}

/// Three coils on shapes, at places that are not measured.
pub fn coils(body: &Body<2>, shapes: &[Vec<Point>], random: &mut fastrand::Rng) -> AuxiliaryData {
    let surface = TongueSurface::of(body).unwrap();
    let first = surface.tip - (8.0 + FIRST_COIL_MM * normal(random)).clamp(1.0, 20.0) * MM;
    let [second, third] = [0; 2].map(|_| (13.0 + 6.0 * random.f64()) * MM);
    let places = [first, first - second, first - second - third];
    let files = placed(&on_surface(&surface, shapes, &places), COIL_M, random);
    let files = Vec::from_iter(files.iter().map(|coils| {
        let rows = coils.iter().zip(1..).map(|(at, n)| format!("T{n},{},{}\n", at.x / MM, at.y / MM));
        let table = format!("point,x_mm,y_mm\n{}", rows.collect::<String>());
        Recording::from_bytes(table.as_bytes(), "coils.csv", Some(Format::Tidy)).unwrap().remove(0)
    }));
    let map = Map::from_toml("back = \"x\"\nup = \"y\"\n", "test").unwrap();
    let recording = AlignedRecording::new(&Recording::of_coils(&files).unwrap(), &map).unwrap();
    AuxiliaryData::points(body, &recording, &postures(shapes)).unwrap()
}

/// Activity of GGa, and of HGa and HGp together, in a posture and in the baseline; each electrode has its own gain.
pub fn activity(values: &ParameterValues, random: &mut fastrand::Rng) -> AuxiliaryData {
    let electrodes = [vec![0], vec![6, 7]].map(|muscles| {
        let ln_gain = normal(random);
        let mut active = |tensions: &[f64]| {
            let mean = muscles.iter().map(|&m| tensions[m]).sum::<f64>() / muscles.len() as f64;
            0.025 * (mean.ln_1p() + ln_gain + EMG * normal(random)).exp_m1()
        };
        let both = [(Some(0), active(&values.postures[0].tensions)), (None, active(values.tones()))];
        (muscles, both.to_vec())
    });
    AuxiliaryData::emg(&electrodes)
}

/// A density without measurements.
pub fn unseen(posterior_model: &PosteriorModel, postures: usize) -> PosteriorProblem<'_> {
    let count = postures * posterior_model.muscles.len();
    PosteriorProblem::new(posterior_model, exact(posterior_model, postures, &vec![1.0; count])).unwrap()
}

/// A number that is sampled or reported.
pub struct Number {
    /// F0, F, F - F0, contrast, hyoid or tilt.
    pub kind: &'static str,
    pub name: String,
    pub value: Box<dyn Fn(&ParameterValues) -> f64 + Sync>,
}

/// All numbers that are sampled or reported.
pub fn unknowns(posterior_model: &PosteriorModel, postures: usize) -> Vec<Number> {
    let mut all: Vec<Number> = Vec::new();
    let mut add = |kind: &'static str, of: String, value: Box<dyn Fn(&ParameterValues) -> f64 + Sync>| {
        all.push(Number { kind, name: format!("{kind} {of}"), value });
    };
    for (m, name) in posterior_model.muscles.iter().enumerate() {
        add("F0", name.clone(), Box::new(move |d| d.tones()[m]));
        for p in 0..postures {
            add("F", format!("{name} {p}"), Box::new(move |d| d.postures[p].tensions[m]));
            let change = move |d: &ParameterValues| d.postures[p].tensions[m] - d.tones()[m];
            add("F - F0", format!("{name} {p}"), Box::new(change));
        }
        if postures > 1 {
            let contrast = move |d: &ParameterValues| d.postures[0].tensions[m] - d.postures[1].tensions[m];
            add("contrast", name.clone(), Box::new(contrast));
        }
    }
    for p in 0..postures {
        for axis in 0..2 {
            add("hyoid", format!("{axis} {p}"), Box::new(move |d| d.postures[p].hyoid[axis]));
        }
    }
    add("tilt", String::new(), Box::new(|d| d.tilt));
    all
}

/// Probability that uniform numbers are as far from uniform as these (Kolmogorov and Smirnov, with Stephens's correction).
pub fn p_of_uniform(mut all: Vec<f64>) -> f64 {
    all.sort_by(f64::total_cmp);
    let n = all.len() as f64;
    let away = |(i, x): (usize, &f64)| (x - i as f64 / n).max((i as f64 + 1.0) / n - x);
    let largest = all.iter().enumerate().map(away).fold(0.0, f64::max);
    let t = largest * (n.sqrt() + 0.12 + 0.11 / n.sqrt());
    let term = |k: i32| 2.0 * if k % 2 == 1 { 1.0 } else { -1.0 } * (-2.0 * f64::from(k * k) * t * t).exp();
    (1..=60).map(term).sum::<f64>().clamp(0.0, 1.0)
}
