//! An approximation of the lengths of muscles whose values and derivatives cost next to nothing. The sampler steers its trajectories by it;
//! whether the end of a trajectory is taken is decided by solved shapes, so errors of the approximation cost draws and bias none.
//!
//! Every length is a polynomial of third degree in the load of a shape, which are the tensions, the hyoid's displacement and angle, and kappa. It is
//! fitted by least squares to the lengths and their exact derivatives in the solved shapes over which the covariance of geometry is
//! averaged, and then also to the lengths in those of the warm-up. Postures and the baseline are shapes of the same body, so all share it.

use nalgebra::{DMatrix, DVector, SVector};

use tongue_core::statics::lanes::Adjoint;

use super::density::Meaning;
use super::ground::Ground;

/// Weight of a derivative beside that of a length.
const OF_SLOPES: f64 = 0.3;
/// Weights in the least squares that keep coefficients small, by the degree of their term: about the square of what remains to be explained
/// (0.001) over that of a usual coefficient.
const RIDGE: [f64; 4] = [1e-9, 1e-4, 1e-3, 1e-2];
/// Numbers of a load besides the tensions: the hyoid's displacement back and up, its angle, kappa.
const OTHERS: usize = 4;

/// A solved shape: its load, the lengths of all muscles as parts of those at rest, and the derivatives of these by the load where they are known.
#[derive(Debug, Clone)]
pub struct Shape {
    load: DVector<f64>,
    lengths: DVector<f64>,
    slopes: Option<DMatrix<f64>>,
}

/// What stands for kappa in a load: it goes from 4 to 0, and lengths are nearly straight in it. Its derivative by ln kappa comes second.
fn of_kappa(kappa: f64) -> (f64, f64) {
    let root = 10.0 * kappa.sqrt();
    (4.0 / (1.0 + root), -2.0 * root / (1.0 + root).powi(2))
}

/// Units of the numbers of a load: tensions, displacements (m) and angle.
fn units(ground: &Ground) -> [f64; 3] {
    let priors = &ground.priors;
    let displacement = 1e-3 * priors.hyoid.sd_mm;
    [priors.tension.scale_n_per_m, displacement, priors.hyoid_tilt.sd_rad_per_m * displacement]
}

/// The load of posture `shape`, or of the baseline where there are only so many postures.
fn load(ground: &Ground, meaning: &Meaning, shape: usize) -> DVector<f64> {
    let [tension, displacement, angle] = units(ground);
    let own = meaning.postures.get(shape);
    let tensions = own.map_or(&meaning.tones, |p| &p.tensions);
    let hyoid = own.map_or(SVector::zeros(), |p| p.hyoid);
    let others = [
        hyoid.x / displacement,
        hyoid.y / displacement,
        meaning.tilt * hyoid.x / angle,
        of_kappa(meaning.kappa).0,
    ];
    DVector::from_iterator(
        tensions.len() + OTHERS,
        tensions.iter().map(|t| of_tension(t / tension).0).chain(others),
    )
}

/// What stands for a tension in a load, where lengths are straighter than in the tension itself, and its derivative.
fn of_tension(t: f64) -> (f64, f64) {
    (t.ln_1p(), 1.0 / (1.0 + t))
}

impl Shape {
    /// Of lengths (m) with their adjoints and their derivatives by ln kappa, if that is sampled.
    pub fn new(
        ground: &Ground,
        (meaning, shape): (&Meaning, usize),
        lengths: &[f64],
        rates: &[Adjoint<2>],
        by_ln_kappa: Option<&Vec<f64>>,
    ) -> Self {
        let [tension, displacement, angle] = units(ground);
        let (rest, muscles) = (ground.rest_lengths(), lengths.len());
        let by_kappa = of_kappa(meaning.kappa).1;
        let slopes = DMatrix::from_fn(muscles, muscles + OTHERS, |m, of| {
            let rate = &rates[m];
            let shift = || rate.by_bone(&ground.hyoid) * displacement;
            let slope = match of.checked_sub(muscles) {
                None => {
                    rate.by_tension[of] * tension
                        / of_tension(
                            if shape < meaning.postures.len() {
                                meaning.postures[shape].tensions[of]
                            } else {
                                meaning.tones[of]
                            } / tension,
                        )
                        .1
                }
                Some(0) => shift().x,
                Some(1) => shift().y,
                Some(2) => ground.hyoid_by_angle(rate) * angle,
                Some(_) => by_ln_kappa.map_or(0.0, |by| by[m] / by_kappa),
            };
            slope / rest[m]
        });
        let lengths = DVector::from_fn(muscles, |m, _| lengths[m] / rest[m]);
        Self { load: load(ground, meaning, shape), lengths, slopes: Some(slopes) }
    }

    /// Of lengths (m) alone.
    pub fn without_slopes(ground: &Ground, (meaning, shape): (&Meaning, usize), lengths: &[f64]) -> Self {
        let rest = ground.rest_lengths();
        let lengths = DVector::from_fn(lengths.len(), |m, _| lengths[m] / rest[m]);
        Self { load: load(ground, meaning, shape), lengths, slopes: None }
    }
}

/// Polynomials of the lengths of all muscles.
#[derive(Debug, Clone)]
pub struct Emulator {
    /// Factors of every term: three numbers of a load, before which stands a one.
    terms: Vec<[usize; 3]>,
    /// A row a term, a column a muscle.
    coefficients: DMatrix<f64>,
}

/// All products of three of so many numbers, the first of which is one.
fn terms(numbers: usize) -> Vec<[usize; 3]> {
    (0..numbers).flat_map(|a| (a..numbers).flat_map(move |b| (b..numbers).map(move |c| [a, b, c]))).collect()
}

/// A one, then the numbers of a load.
fn with_one(load: &DVector<f64>) -> DVector<f64> {
    load.clone().insert_row(0, 1.0)
}

/// The derivative of a term by number `by`.
fn slope_of([a, b, c]: [usize; 3], u: &DVector<f64>, by: usize) -> f64 {
    let is = |i: usize| if i == by { 1.0 } else { 0.0 };
    is(a) * u[b] * u[c] + u[a] * (is(b) * u[c] + u[b] * is(c))
}

impl Emulator {
    /// Fitted to shapes; `None` of none.
    pub fn fit<'s>(shapes: impl Iterator<Item = &'s Shape> + Clone) -> Option<Self> {
        let first = shapes.clone().next()?;
        let (n, muscles) = (first.load.len(), first.lengths.len());
        let terms = terms(n + 1);
        let rows: usize = shapes.clone().map(|s| 1 + if s.slopes.is_some() { n } else { 0 }).sum();
        // A column of the first an equation, of the second a muscle.
        let mut left = DMatrix::zeros(terms.len(), rows);
        let mut right = DMatrix::zeros(rows, muscles);
        let mut row = 0;
        for shape in shapes {
            let u = with_one(&shape.load);
            terms.iter().enumerate().for_each(|(t, &[a, b, c])| left[(t, row)] = u[a] * u[b] * u[c]);
            right.row_mut(row).tr_copy_from(&shape.lengths);
            row += 1;
            for (by, slopes) in shape.slopes.iter().flat_map(|s| s.column_iter()).enumerate() {
                let slope = |term: [usize; 3]| OF_SLOPES * slope_of(term, &u, by + 1);
                terms.iter().enumerate().for_each(|(t, term)| left[(t, row)] = slope(*term));
                right.row_mut(row).tr_copy_from(&(slopes * OF_SLOPES));
                row += 1;
            }
        }
        let mut normal = &left * left.transpose();
        for (t, term) in terms.iter().enumerate() {
            normal[(t, t)] += RIDGE[term.iter().filter(|i| **i > 0).count()];
        }
        let coefficients = normal.cholesky()?.solve(&(&left * &right));
        Some(Self { terms, coefficients })
    }

    /// A shape of which nothing but the load is known.
    pub fn at(&self, ground: &Ground, meaning: &Meaning, shape: usize) -> Emulated<'_> {
        let load = with_one(&load(ground, meaning, shape));
        let each = self.terms.iter().map(|&[a, b, c]| load[a] * load[b] * load[c]);
        let values = DVector::from_iterator(self.terms.len(), each);
        Emulated { emulator: self, lengths: self.coefficients.tr_mul(&values), load }
    }
}

/// An emulated shape.
#[derive(Debug)]
pub struct Emulated<'a> {
    emulator: &'a Emulator,
    load: DVector<f64>,
    /// Lengths of all muscles as parts of those at rest.
    pub lengths: DVector<f64>,
}

impl Emulated<'_> {
    /// Derivatives by the numbers of the load of a function whose derivatives by the lengths are given.
    pub fn by_load(&self, by_lengths: &DVector<f64>) -> DVector<f64> {
        let (u, weights) = (&self.load, &self.emulator.coefficients * by_lengths);
        let mut by = DVector::zeros(u.len());
        for (&[a, b, c], weight) in self.emulator.terms.iter().zip(weights.iter()) {
            by[a] += weight * u[b] * u[c];
            by[b] += weight * u[a] * u[c];
            by[c] += weight * u[a] * u[b];
        }
        by.remove_row(0)
    }
}

/// Derivatives by what is sampled, of a function whose derivatives by the numbers of a load are given: by tensions (N/m), by the hyoid's displacement
/// (m), by its tilt (rad/m) and by ln kappa.
#[derive(Debug)]
pub struct ByLoad {
    pub tensions: Vec<f64>,
    pub hyoid: [f64; 2],
    pub tilt: f64,
    pub ln_kappa: f64,
}

impl ByLoad {
    pub fn new(ground: &Ground, meaning: &Meaning, shape: usize, by: &DVector<f64>) -> Self {
        let [tension, displacement, angle] = units(ground);
        let muscles = by.len() - OTHERS;
        let hyoid = meaning.postures.get(shape).map_or(SVector::zeros(), |p| p.hyoid);
        let by_angle = by[muscles + 2] / angle;
        Self {
            tensions: by
                .iter()
                .take(muscles)
                .enumerate()
                .map(|(m, b)| {
                    b / tension
                        * of_tension(
                            meaning.postures.get(shape).map_or(&meaning.tones, |p| &p.tensions)[m] / tension,
                        )
                        .1
                })
                .collect(),
            hyoid: [by[muscles] / displacement + meaning.tilt * by_angle, by[muscles + 1] / displacement],
            tilt: hyoid.x * by_angle,
            ln_kappa: by[muscles + 3] * of_kappa(meaning.kappa).1,
        }
    }
}
