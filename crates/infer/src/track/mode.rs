//! The most probable tensions of all frames on one body, by the Gauss-Newton method.
//!
//! The unknowns of a frame (its state) are the course of each muscle, displacements of bones that were not observed, and the slow error
//! at a few knots of the contour. Shared by all frames are the level of each muscle and the static error. The shape at rest is fixed.

use nalgebra::{DMatrix, DVector};

use tongue_core::geometry::Point;

use super::chain::{Chain, Factors};
use super::errors::{FrameErrors, Knots};
use super::frame::{Frame, Linear, Solver};
use super::settings::TrackSettings;

/// Number of frames in a chunk: each is solved from the one before, and the first from rest. Chunks do not depend on threads, so the
/// results do not either.
pub(super) const CHUNK: usize = 32;
/// A frame with fewer observations than this counts as one without observations.
pub const FEWEST: usize = 3;

/// Numbers of the unknowns, in their order.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sizes {
    /// Contracting muscles.
    pub muscles: usize,
    /// Displacements of freed bones.
    pub bones: usize,
    /// Knots of the errors.
    pub knots: usize,
}

impl Sizes {
    /// Unknowns of a frame: courses, displacements, slow error.
    pub fn state(&self) -> usize {
        self.muscles + self.bones + self.knots
    }

    /// Number of unknowns that all frames share on a fixed body: levels, static error.
    pub fn shared(&self) -> usize {
        self.muscles + self.knots
    }
}

/// State and linearisation of a frame.
#[derive(Debug, Clone)]
pub(super) struct Here {
    /// Its state.
    pub z: DVector<f64>,
    /// `None` where there is no equilibrium, or no data.
    pub linear: Option<Linear>,
    pub positions: Option<Vec<Point>>,
}

/// A recording during the search.
pub(super) struct Course {
    pub frames: Vec<Frame>,
    pub chain: Chain,
    /// The errors of every frame; `None` where there are too few observations.
    pub errors: Vec<Option<FrameErrors>>,
    pub here: Vec<Here>,
}

impl Course {
    /// Number of frames with data.
    pub fn count(&self) -> usize {
        self.errors.iter().flatten().count()
    }
}

/// The whitened residuals of a frame and their derivatives.
pub(super) struct Rows {
    pub residuals: DVector<f64>,
    pub by_state: DMatrix<f64>,
    /// Derivatives by levels, static error and, where they are asked for, the directions of the shape.
    pub by_shared: DMatrix<f64>,
}

/// A recording whose states are eliminated.
pub(super) struct Eliminated {
    pub factors: Factors,
    /// Responses of the states to the shared unknowns, and their own step, in columns.
    pub answers: Vec<DMatrix<f64>>,
    pub steps: Vec<DMatrix<f64>>,
    /// The rows of every frame.
    pub rows: Vec<Option<Rows>>,
    /// Curvature and gradient of the shared unknowns after the elimination.
    pub curvature: DMatrix<f64>,
    pub gradient: DVector<f64>,
}

/// All recordings of a speaker, with their shared unknowns.
#[derive(Clone)]
pub(super) struct Mode<'a, 's> {
    pub sizes: Sizes,
    pub settings: &'a TrackSettings,
    pub knots: &'a Knots,
    pub solver: &'a (dyn Fn() -> Solver<'s> + Sync),
    /// Levels (N/m) and static error (mm).
    pub shared: DVector<f64>,
    /// Precision of the shared unknowns in the prior.
    pub shared_precision: DMatrix<f64>,
}

impl<'a, 's> Mode<'a, 's> {
    pub fn new(
        sizes: Sizes,
        settings: &'a TrackSettings,
        knots: &'a Knots,
        solver: &'a (dyn Fn() -> Solver<'s> + Sync),
    ) -> Self {
        let n = sizes.shared();
        let mut precision = DMatrix::identity(n, n) / settings.link.level_sd_n.powi(2);
        let (m, k) = (sizes.muscles, sizes.knots);
        precision.view_mut((m, m), (k, k)).copy_from(&knots.precision(settings.errors.static_mm));
        Self { sizes, settings, knots, solver, shared: DVector::zeros(n), shared_precision: precision }
    }

    /// A recording at the start of the search.
    pub fn course(&self, frames: Vec<Frame>) -> Course {
        let Sizes { muscles, bones, knots } = self.sizes;
        let n = self.sizes.state();
        let mut precision = DMatrix::identity(n, n);
        (0..muscles).for_each(|i| precision[(i, i)] = self.settings.link.course_sd_n.powi(-2));
        let slow = self.knots.precision(self.settings.errors.slow_mm);
        precision.view_mut((muscles + bones, muscles + bones), (knots, knots)).copy_from(&slow);
        let times: Vec<f64> = frames.iter().map(|f| f.time_s).collect();
        let chain = Chain::new(precision, self.settings.memory_s, &times);
        let here = vec![Here { z: DVector::zeros(n), linear: None, positions: None }; frames.len()];
        let mut course = Course { frames, chain, errors: Vec::new(), here };
        self.take_errors(&mut course);
        course
    }

    /// Every n-th frame with data of recordings, at their present states; the frames of all recordings are counted together.
    pub fn thinned(&self, courses: &[Course], every: usize) -> Vec<Course> {
        let mut before = 0;
        let one = |course: &Course| {
            let seen = (0..course.frames.len()).filter(|&t| course.errors[t].is_some());
            let taken: Vec<usize> =
                seen.enumerate().filter(|(n, _)| (before + n) % every == every / 2).map(|(_, t)| t).collect();
            before += course.count();
            let mut out = self.course(taken.iter().map(|&t| course.frames[t].clone()).collect());
            out.here = taken.iter().map(|&t| course.here[t].clone()).collect();
            out
        };
        courses.iter().map(one).collect()
    }

    /// Sets the errors for the observations that the frames of a recording have now.
    pub fn take_errors(&self, course: &mut Course) {
        let of = |f: &Frame| (f.observations.len() >= FEWEST).then(|| self.knots.frame(&f.along)).flatten();
        course.errors = course.frames.iter().map(of).collect();
    }

    /// Unknowns of a frame's equilibrium: tensions before the link, and displacements.
    pub fn unknowns(&self, z: &DVector<f64>, shared: &DVector<f64>) -> DVector<f64> {
        let Sizes { muscles, bones, .. } = self.sizes;
        let middle = self.settings.link.middle_n;
        DVector::from_fn(muscles + bones, |i, _| if i < muscles { middle + shared[i] + z[i] } else { z[i] })
    }

    /// Residuals of a frame, mm, less the error given by the values at the knots.
    pub fn residuals_mm(
        &self,
        course: &Course,
        t: usize,
        here: &Here,
        shared: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let errors = course.errors[t].as_ref()?;
        let linear = here.linear.as_ref()?;
        let Sizes { muscles, bones, knots } = self.sizes;
        let known = here.z.rows(muscles + bones, knots) + shared.rows(muscles, knots);
        let mut residuals = linear.residuals.clone();
        residuals.iter_mut().zip(&course.frames[t].observations).for_each(|(r, o)| *r *= 1e3 / o.weight);
        Some(residuals - &errors.basis * known)
    }

    /// The rows of a frame; `None` where it has no observations or no equilibrium.
    pub fn rows(&self, course: &Course, t: usize) -> Option<Rows> {
        let residuals = self.residuals_mm(course, t, &course.here[t], &self.shared)?;
        let (linear, errors) = (course.here[t].linear.as_ref()?, course.errors[t].as_ref()?);
        let Sizes { muscles, bones, knots } = self.sizes;
        let count = residuals.len();
        let mut jacobian = linear.jacobian.clone();
        for (mut row, o) in jacobian.row_iter_mut().zip(&course.frames[t].observations) {
            row *= 1e3 / o.weight;
        }
        let mut all = DMatrix::zeros(count, 1 + self.sizes.state());
        all.column_mut(0).copy_from(&residuals);
        all.columns_mut(1, muscles + bones).copy_from(&jacobian);
        all.columns_mut(1 + muscles + bones, knots).copy_from(&-&errors.basis);
        let all = errors.whitened(all);
        let by_state = all.columns(1, self.sizes.state()).into_owned();
        let mut by_shared = DMatrix::zeros(count, self.sizes.shared());
        by_shared.columns_mut(0, muscles).copy_from(&by_state.columns(0, muscles));
        by_shared.columns_mut(muscles, knots).copy_from(&by_state.columns(muscles + bones, knots));
        Some(Rows { residuals: all.column(0).into_owned(), by_state, by_shared })
    }

    /// Eliminates the states of a recording; `more` gives further columns of shared unknowns. `damping` holds the tensions and
    /// displacements of each frame, in units of their precision in the prior.
    pub fn eliminate(
        &self,
        course: &Course,
        damping: &[f64],
        more: &dyn Fn(usize) -> Option<DMatrix<f64>>,
        columns: usize,
    ) -> Option<Eliminated> {
        let (n, p) = (self.sizes.state(), self.sizes.shared() + columns);
        let z: Vec<DVector<f64>> = course.here.iter().map(|h| h.z.clone()).collect();
        let held = course.chain.image(&z);
        let mut curvature = DMatrix::zeros(p, p);
        let mut gradient = DVector::zeros(p);
        let (mut own, mut across, mut steps) = (Vec::new(), Vec::new(), Vec::new());
        let (m, held_by) = (self.sizes.muscles, self.settings.link.course_sd_n.powi(-2));
        let mut all: Vec<Option<Rows>> = (0..course.frames.len()).map(|t| self.rows(course, t)).collect();
        for (t, held) in held.iter().enumerate() {
            let Some((rows, errors)) = all[t].as_mut().zip(course.errors[t].as_ref()) else {
                own.push(DMatrix::zeros(n, n));
                across.push(DMatrix::zeros(n, p));
                steps.push(DMatrix::from_column_slice(n, 1, held.as_slice()));
                continue;
            };
            if columns > 0 {
                rows.by_shared.resize_horizontally_mut(p, 0.0);
            }
            if let Some(more) = more(t) {
                rows.by_shared.columns_mut(p - columns, columns).copy_from(&errors.whitened(more));
            }
            let shared = &rows.by_shared;
            let mut by_state = rows.by_state.tr_mul(&rows.by_state);
            let mut by_both = rows.by_state.tr_mul(shared);
            let damping = damping.get(t).copied().unwrap_or(0.0);
            for i in 0..m {
                by_state[(i, i)] += damping * held_by;
                by_both[(i, i)] += damping * held_by;
                curvature[(i, i)] += damping * held_by;
            }
            (m..m + self.sizes.bones).for_each(|i| by_state[(i, i)] += damping);
            own.push(by_state);
            across.push(by_both);
            steps.push(DMatrix::from_columns(&[rows.by_state.tr_mul(&rows.residuals) + held]));
            curvature += shared.tr_mul(shared);
            gradient += shared.tr_mul(&rows.residuals);
        }
        let factors = course.chain.factorise(&own)?;
        let mut answers = across.clone();
        factors.solve(&mut answers);
        factors.solve(&mut steps);
        for ((across, answer), step) in across.iter().zip(&answers).zip(&steps) {
            curvature -= across.tr_mul(answer);
            gradient -= across.tr_mul(&step.column(0));
        }
        Some(Eliminated { factors, answers, steps, rows: all, curvature, gradient })
    }
}
