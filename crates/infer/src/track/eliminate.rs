//! Elimination of a recording's states from the normal equations, which leaves those of the shared unknowns.
//!
//! The responses of the states to the shared unknowns need 10 kB for each frame. They are kept for a recording of one window; for a longer
//! one the blocks at the ends of windows are kept, and a window is computed again where it is needed.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, stack};

use super::ornstein_uhlenbeck::Factors;
use super::smoother::{CHUNK, SmoothedRecording, Smoother, WhitenedRows, in_chunks};

pub(super) const WINDOW: usize = 4 * CHUNK;

pub(super) fn windows(frames: usize) -> Vec<Range<usize>> {
    (0..frames).step_by(WINDOW).map(|from| from..(from + WINDOW).min(frames)).collect()
}

/// The observations of a frame, and their contribution to Hessian and gradient.
struct Contribution {
    /// No rows for a frame without data or equilibrium.
    rows: WhitenedRows,
    damping: f64,
    own: DMatrix<f64>,
    gradient: DVector<f64>,
    with_shape: DMatrix<f64>,
    shape: DMatrix<f64>,
    shape_gradient: DVector<f64>,
}

impl Contribution {
    /// Coupling of the state with the shared unknowns, followed by those of the shape.
    fn coupling(&self, smoother: &Smoother<'_>) -> DMatrix<f64> {
        stack![self.own.select_columns(&smoother.states_of_shared()), self.with_shape]
    }
}

/// A recording linearised at its present state.
#[derive(Clone, Copy)]
pub(super) struct LinearProblem<'a> {
    pub smoother: &'a Smoother<'a>,
    pub recording: &'a SmoothedRecording,
    /// Damping of the tensions and displacements of each frame, in units of their prior precision; empty without damping.
    pub damping: &'a [f64],
    /// Derivatives of the frames by `columns` directions of the shape, mm, empty without a shape.
    pub by_shape: &'a [Option<DMatrix<f64>>],
    pub columns: usize,
}

impl LinearProblem<'_> {
    /// `None` where a frame has no observations or no equilibrium.
    fn rows(&self, t: usize) -> Option<WhitenedRows> {
        let Self { smoother, recording, .. } = self;
        let here = &recording.here[t];
        let residuals = smoother.residuals_mm(recording, t, here, &smoother.shared)?;
        let (linear, errors) = (here.linear.as_ref()?, recording.errors[t].as_ref()?);
        let mut jacobian = linear.jacobian.clone();
        for (mut row, o) in jacobian.row_iter_mut().zip(&recording.frames[t].observations) {
            row *= 1e3 / o.observation.weight;
        }
        let all = errors.whitened(stack![residuals, jacobian, -&errors.basis]);
        let by_state = all.columns(1, smoother.sizes.state()).into_owned();
        let by_shape = self.by_shape.get(t).cloned().flatten();
        let by_shape = by_shape.unwrap_or_else(|| DMatrix::zeros(residuals.len(), self.columns));
        let by_shape = errors.whitened(by_shape);
        Some(WhitenedRows { residuals: all.column(0).into_owned(), by_state, by_shape })
    }

    fn contributions(&self, window: &Range<usize>) -> Vec<Contribution> {
        let (n, columns) = (self.smoother.sizes.state(), self.columns);
        in_chunks(window.clone(), |chunk| {
            Vec::from_iter(chunk.iter().map(|&t| {
                let found = self.rows(t);
                let damping = self.damping.get(t).filter(|_| found.is_some()).copied().unwrap_or(0.0);
                let rows = found.unwrap_or_else(|| WhitenedRows {
                    residuals: DVector::zeros(0),
                    by_state: DMatrix::zeros(0, n),
                    by_shape: DMatrix::zeros(0, columns),
                });
                Contribution {
                    damping,
                    own: rows.by_state.tr_mul(&rows.by_state),
                    gradient: rows.by_state.tr_mul(&rows.residuals),
                    with_shape: rows.by_state.tr_mul(&rows.by_shape),
                    shape: rows.by_shape.tr_mul(&rows.by_shape),
                    shape_gradient: rows.by_shape.tr_mul(&rows.residuals),
                    rows,
                }
            }))
        })
    }
}

/// Rows of a window of frames, and the responses of their states to the shared unknowns.
pub(super) struct Window {
    pub rows: Vec<WhitenedRows>,
    pub responses: Vec<DMatrix<f64>>,
}

/// A recording whose states are eliminated.
pub(super) struct Eliminated<'a> {
    pub problem: LinearProblem<'a>,
    pub factors: Factors,
    /// The steps of the states at fixed shared unknowns, in columns.
    pub steps: Vec<DMatrix<f64>>,
    /// Of the shared unknowns, after the elimination.
    pub curvature: DMatrix<f64>,
    pub gradient: DVector<f64>,
    /// For every window but the first, the last block before it after the forward elimination; for every window but the last, the responses
    /// of the first frame after it.
    before: Vec<DMatrix<f64>>,
    after: Vec<DMatrix<f64>>,
    /// The window of a recording that has only one.
    kept: Option<Arc<Window>>,
}

impl<'a> Eliminated<'a> {
    pub fn new(problem: LinearProblem<'a>) -> Option<Self> {
        let LinearProblem { smoother, recording, columns, .. } = problem;
        let (m, bones, shared) = (smoother.sizes.muscles, smoother.sizes.bones, smoother.states_of_shared());
        let z: Vec<DVector<f64>> = recording.here.iter().map(|h| h.z.clone()).collect();
        let held = recording.chain.image(&z);
        let size = shared.len() + columns;
        let (mut curvature, mut gradient) = (DMatrix::zeros(size, size), DVector::zeros(size));
        let (mut own, mut steps) = (Vec::with_capacity(z.len()), Vec::with_capacity(z.len()));
        let held_by = smoother.settings.link.deviation_sd_n.powi(-2);
        let windows = windows(z.len());
        let mut kept = None;
        for window in &windows {
            let all = problem.contributions(window);
            for (t, found) in window.clone().zip(&all) {
                let of_shared = found.own.select_rows(&shared).select_columns(&shared);
                let with_shape = found.with_shape.select_rows(&shared);
                curvature += stack![of_shared, with_shape; with_shape.transpose(), found.shape];
                gradient += stack![found.gradient.select_rows(&shared); found.shape_gradient];
                let mut by_state = found.own.clone();
                for i in 0..m {
                    by_state[(i, i)] += found.damping * held_by;
                    curvature[(i, i)] += found.damping * held_by;
                }
                (m..m + bones).for_each(|i| by_state[(i, i)] += found.damping);
                own.push(by_state);
                steps.push(DMatrix::from_columns(&[&found.gradient + &held[t]]));
            }
            kept = Some(all).filter(|_| windows.len() == 1);
        }
        let factors = recording.chain.factorise(own)?;
        factors.solve(&mut steps);
        let (before, after) = (Vec::new(), Vec::new());
        let mut out = Self { problem, factors, steps, curvature, gradient, before, after, kept: None };
        out.set_window_ends(&windows);
        for window in windows {
            let (rows, across) = out.rows_and_coupling(&window, kept.take());
            let responses = out.responses(&window, across.clone());
            for ((across, answer), t) in across.iter().zip(&responses).zip(window.clone()) {
                out.curvature -= across.tr_mul(answer);
                out.gradient -= across.tr_mul(&out.steps[t].column(0));
            }
            out.kept = Some(Arc::new(Window { rows, responses })).filter(|_| window.len() == z.len());
        }
        Some(out)
    }

    pub fn window(&self, window: &Range<usize>) -> Arc<Window> {
        if let Some(kept) = &self.kept {
            return Arc::clone(kept);
        }
        let (rows, across) = self.rows_and_coupling(window, None);
        Arc::new(Window { rows, responses: self.responses(window, across) })
    }

    /// Computes the blocks at the ends of the windows of a long recording.
    fn set_window_ends(&mut self, windows: &[Range<usize>]) {
        for window in windows.iter().take(windows.len().saturating_sub(1)) {
            let (_, mut blocks) = self.rows_and_coupling(window, None);
            self.factors.forward(&mut blocks, window.start, self.before.last());
            self.before.extend(blocks.pop());
        }
        for window in windows.iter().skip(1).rev() {
            let (_, mut blocks) = self.rows_and_coupling(window, None);
            self.factors.forward(&mut blocks, window.start, self.before.get(window.start / WINDOW - 1));
            self.factors.backward(&mut blocks, window.start, self.after.last());
            self.after.extend(blocks.into_iter().next());
        }
        self.after.reverse();
    }

    /// The rows of a window, and the coupling of each of its states with the shared unknowns.
    fn rows_and_coupling(
        &self,
        window: &Range<usize>,
        known: Option<Vec<Contribution>>,
    ) -> (Vec<WhitenedRows>, Vec<DMatrix<f64>>) {
        let smoother = self.problem.smoother;
        let held_by = smoother.settings.link.deviation_sd_n.powi(-2);
        let found = known.unwrap_or_else(|| self.problem.contributions(window));
        let states = found.into_iter().map(|found| {
            let mut across = found.coupling(smoother);
            (0..smoother.sizes.muscles).for_each(|i| across[(i, i)] += found.damping * held_by);
            (found.rows, across)
        });
        states.unzip()
    }

    /// Responses of the states of a window to the shared unknowns, with which they are coupled by `across`.
    fn responses(&self, window: &Range<usize>, mut across: Vec<DMatrix<f64>>) -> Vec<DMatrix<f64>> {
        let number = window.start / WINDOW;
        let before = number.checked_sub(1).and_then(|n| self.before.get(n));
        self.factors.forward(&mut across, window.start, before);
        self.factors.backward(&mut across, window.start, self.after.get(number));
        across
    }
}
