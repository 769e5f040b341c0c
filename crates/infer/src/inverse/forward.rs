//! The forward model: from the unknowns to residuals, by one equilibrium for each candidate.

use nalgebra::{DMatrix, DVector, SVector};

use tongue_core::parallel;
use tongue_core::statics::{self, SolveSettings, SolveStatus, Trace, Workspace};
use tongue_core::system::{System, SystemError};

use super::FitSettings;
use super::problem::{LeastSquaresProblem, Quantity};
use super::start::{SearchCounts, WarmStarts, distance_squared, starting_point};

/// Cost of a candidate without residuals: worse than any real one, and finite, because argmin's Nelder-Mead panics on errors in its first
/// simplex and stops at NaN.
pub(super) const FAILED: f64 = 1e6;

#[derive(Debug, Clone, PartialEq)]
pub struct Linearised {
    /// One row for each observation and prior, one column for each unknown.
    pub jacobian: DMatrix<f64>,
    pub residuals: DVector<f64>,
    /// The same of the measurements that are not fitted.
    pub other_jacobian: DMatrix<f64>,
    pub other_residuals: DVector<f64>,
}

/// The shape from which a candidate is solved.
#[derive(Debug, Clone, PartialEq)]
enum CandidateStart<const D: usize> {
    /// The shape of its nearest solved neighbour; the shape at rest if there is none or it fails.
    Neighbour,
    /// The shape at rest, with all tensions at once.
    Rest,
    /// The shape at rest, with all tensions growing in proportion along the load path, jumps allowed.
    LoadPath,
    /// The shape to which the load path of a candidate led (positions of all nodes, m).
    EndOfPath(Vec<SVector<f64, D>>),
}

/// Cost of 1 N of tension if the tensions are not determined, 1/N: it changes the fitted ratios by less than 1e-3.
const EFFORT: f64 = 2e-6;

/// Solves candidates one after another, each from the nearest of the best earlier ones.
#[derive(Debug)]
pub struct Forward<'a, const D: usize> {
    pub(super) problem: &'a LeastSquaresProblem<'a, D>,
    pub(super) settings: &'a FitSettings,
    /// The system with the candidate's constants, if these are unknowns.
    candidate_system: Option<System<D>>,
    workspace: Workspace<D>,
    pub(super) effort: f64,
    pub(super) known: WarmStarts<D>,
    begin: CandidateStart<D>,
    /// The candidate whose equilibrium is in the workspace.
    last: Option<Vec<f64>>,
    pub(super) counts: SearchCounts,
    /// Derivative of all node positions by each unknown, m per unit of the unknown.
    motions: Vec<Vec<SVector<f64, D>>>,
}

impl<'a, const D: usize> Forward<'a, D> {
    pub fn new(problem: &'a LeastSquaresProblem<'a, D>, settings: &'a FitSettings) -> Self {
        Self {
            problem,
            settings,
            candidate_system: None,
            workspace: Workspace::new(problem.system),
            effort: if problem.is_undetermined() { EFFORT } else { 0.0 },
            known: WarmStarts::new(problem.unknowns.len()),
            begin: if settings.warm_start { CandidateStart::Neighbour } else { CandidateStart::Rest },
            last: None,
            counts: SearchCounts::default(),
            motions: Vec::new(),
        }
    }

    pub fn system(&self) -> &System<D> {
        self.candidate_system.as_ref().unwrap_or(self.problem.system)
    }

    pub fn positions(&self) -> &[SVector<f64, D>] {
        self.workspace.positions()
    }

    /// Makes a solved shape (positions of all nodes, m) with its unknowns the only one from which later candidates start.
    pub fn begin_at(&mut self, x: &[f64], positions: &[SVector<f64, D>]) {
        self.known = WarmStarts::new(x.len());
        self.known.remember(x, f64::INFINITY, positions);
    }

    /// Positions of all nodes, m, if `x` is the last candidate and equilibria are expensive.
    pub(super) fn kept_shape(&self, x: &[f64]) -> Option<Vec<SVector<f64, D>>> {
        (self.is_expensive() && self.last.as_deref() == Some(x)).then(|| self.positions().to_vec())
    }

    /// Whether equilibria are so expensive that later searches start from the shapes of earlier ones, which changes the last digits.
    pub(super) fn is_expensive(&self) -> bool {
        self.problem.system.tissue().is_expensive()
    }

    /// Solves every later candidate along its load path, also beyond a jump.
    pub fn on_load_path(self) -> Self {
        Self { begin: CandidateStart::LoadPath, ..self }
    }

    /// Solves a candidate from rest, both at once and along its load path, without counting it. Returns the trace, which is empty if the
    /// candidate has no system, and a `Forward` whose workspace is at the end of the load path.
    pub fn follow_load_path(&self, x: &[f64]) -> (Trace, Self) {
        let mut forward = Forward::new(self.problem, self.settings);
        let mut trace = Trace::default();
        if forward.set(x).is_ok() {
            let system = forward.candidate_system.as_ref().unwrap_or(self.problem.system);
            let settings = &SolveSettings { beyond: false, ..self.settings.equilibrium };
            forward.workspace.start_from_rest(system);
            let tensions = self.problem.tensions_of(x);
            trace = statics::solve_and_trace(system, &mut forward.workspace, &tensions, settings);
        }
        (trace, forward)
    }

    fn set(&mut self, x: &[f64]) -> Result<(), SystemError> {
        let problem = self.problem;
        self.counts.evaluations += 1;
        if let Some(tissue) = problem.tissue {
            self.candidate_system = Some(tissue.system(&problem.unknowns, x)?);
        }
        for (number, bone) in problem.bones.iter().enumerate() {
            let mut shift = SVector::<f64, D>::zeros();
            for (unknown, value) in problem.unknowns.iter().zip(x) {
                match unknown.quantity {
                    Quantity::Bone { bone, axis } if bone == number => shift[axis] = value * unknown.unit,
                    _ => {}
                }
            }
            self.workspace.displace_bone(problem.system, bone.nodes(), shift);
        }
        Ok(())
    }

    /// Weighted residuals of the observations, then of the priors, at the current shape.
    fn residuals_here(&self, x: &[f64]) -> Option<DVector<f64>> {
        let problem = self.problem;
        let observed = problem.observations.iter().map(|o| o.residual(self.positions()));
        let priors =
            problem.unknowns.iter().zip(x).filter_map(|(u, x)| u.prior.map(|p| (x - p.mean) * p.weight));
        let all: Vec<f64> = observed.chain(priors).collect();
        all.iter().all(|r| r.is_finite()).then(|| DVector::from_vec(all))
    }

    fn solve_from_nearest(&mut self, x: &[f64]) -> bool {
        let Some(nearest) = self.known.nearest(x) else { return false };
        // An expensive system continues from the last equilibrium, because its factorisation gives the linear response as the first step.
        let is_nearer = |last: &[f64]| distance_squared(last, x) <= distance_squared(&nearest.x, x);
        if !(self.is_expensive() && self.last.as_deref().is_some_and(is_nearer)) {
            self.workspace.start_from(&nearest.positions);
        }
        self.solve(x)
    }

    /// Solves from the shape at rest: directly, or along the load path where candidates follow it.
    fn solve_without_neighbours(&mut self, x: &[f64]) -> bool {
        self.workspace.start_from_rest(self.problem.system);
        if !self.is_on_load_path() {
            return self.solve(x);
        }
        let system = self.candidate_system.as_ref().unwrap_or(self.problem.system);
        let settings = &SolveSettings { beyond: false, ..self.settings.equilibrium };
        let trace = statics::trace(system, &mut self.workspace, &self.problem.tensions_of(x), settings);
        self.counts.factorisations += trace.solution.factorisations;
        trace.from_rest.leads_here()
    }

    fn solve(&mut self, x: &[f64]) -> bool {
        let system = self.candidate_system.as_ref().unwrap_or(self.problem.system);
        let settings = &self.settings.equilibrium;
        let solution = statics::solve(system, &mut self.workspace, &self.problem.tensions_of(x), settings);
        self.counts.factorisations += solution.factorisations;
        solution.status == SolveStatus::Converged
    }

    /// Records whether a candidate was solved, and returns its residuals; `None` if it was not.
    fn outcome(&mut self, x: &[f64], solved: bool) -> Option<DVector<f64>> {
        let residuals = if solved { self.residuals_here(x) } else { None };
        self.last = solved.then(|| x.to_vec());
        self.counts.failures += usize::from(!solved);
        residuals
    }

    /// Derivatives of the fitted observations and of the other measurements by all unknowns, with one factorisation.
    fn jacobians(&mut self, x: &[f64]) -> Option<[DMatrix<f64>; 2]> {
        self.counts.factorisations += 1;
        let problem = self.problem;
        let system = self.candidate_system.as_ref().unwrap_or(problem.system);
        self.motions.resize(problem.unknowns.len(), vec![SVector::zeros(); self.workspace.positions().len()]);
        let mut response = statics::Response::new(system, &mut self.workspace)?;
        for (column, unknown) in problem.unknowns.iter().enumerate() {
            match unknown.quantity {
                Quantity::Tension { muscle } => {
                    let tied =
                        problem.tied.iter().filter(|[first, _]| *first == muscle).map(|[_, other]| *other);
                    response.compute_for_tensions(std::iter::once(muscle).chain(tied));
                }
                Quantity::Bone { bone, axis } => {
                    let bone = &problem.bones[bone];
                    let model = problem.tissue.map(|t| t.model(&problem.unknowns, x));
                    response.compute_for_load(|at, load| bone.add_force(at, axis, model, load));
                    response.displace(bone.nodes(), axis);
                }
                Quantity::Constant(constant) => {
                    let derivative = problem.tissue?.derivative(&problem.unknowns, x, constant)?;
                    response.compute_for_load(|at, load| derivative.add_force(at, load));
                }
            }
            response.scale(unknown.unit);
            self.motions[column].copy_from_slice(response.motion());
        }
        Some([&problem.observations, &problem.others].map(|observations| {
            let mut jacobian = DMatrix::zeros(observations.len(), problem.unknowns.len());
            let mut rates = vec![0.0; problem.unknowns.len()];
            for (row, observation) in observations.iter().enumerate() {
                observation.rates(response.positions(), &self.motions, &mut rates);
                jacobian.row_mut(row).copy_from_slice(&rates);
            }
            jacobian
        }))
    }

    pub(super) fn start(&mut self, number: usize) -> Vec<f64> {
        match self.problem.begin {
            Some((x, positions)) if number == 0 => {
                self.begin_at(x, positions);
                x.to_vec()
            }
            _ => starting_point(number, &self.problem.unknowns),
        }
    }

    /// Residuals of the other measurements at the last candidate; empty if there are none.
    pub(super) fn other_residuals(&self) -> DVector<f64> {
        let all = self.problem.others.iter().map(|o| o.residual(self.positions()));
        DVector::from_vec(all.collect())
    }

    /// Lengths of all muscles at the last candidate, m.
    pub(super) fn lengths(&self) -> Vec<f64> {
        self.system().lengths(self.positions())
    }

    /// Residuals of a candidate, from its nearest solved neighbour where these are used; `None` if it has no equilibrium.
    pub fn residuals(&mut self, x: &[f64]) -> Option<DVector<f64>> {
        let solved = self.set(x).is_ok()
            && match &self.begin {
                CandidateStart::EndOfPath(positions) => {
                    self.workspace.start_from(positions);
                    self.solve(x)
                }
                CandidateStart::Neighbour => self.solve_from_nearest(x) || self.solve_without_neighbours(x),
                CandidateStart::Rest | CandidateStart::LoadPath => self.solve_without_neighbours(x),
            };
        let residuals = self.outcome(x, solved)?;
        let cost = self.cost(x, Some(&residuals));
        self.known.remember(x, cost, self.workspace.positions());
        Some(residuals)
    }

    /// Residuals of a candidate that is solved from rest.
    pub(super) fn residuals_without_neighbours(&mut self, x: &[f64]) -> Option<DVector<f64>> {
        let solved = self.set(x).is_ok() && self.solve_without_neighbours(x);
        self.outcome(x, solved)
    }

    /// Whether a candidate that is solved from rest has an equilibrium, and its cost there.
    pub(super) fn solved_by_newton(&mut self, x: &[f64]) -> (bool, f64) {
        let residuals = self.residuals_without_neighbours(x);
        (residuals.is_some(), self.cost(x, residuals.as_ref()))
    }

    /// Residuals and their Jacobian; `None` if there is no equilibrium or it is singular.
    pub fn linearise(&mut self, x: &[f64]) -> Option<Linearised> {
        let residuals = self.residuals(x)?;
        let problem = self.problem;
        let other_residuals = self.other_residuals();
        let [jacobian, other_jacobian] = self.jacobians(x)?;
        let mut jacobian = jacobian.resize_vertically(residuals.len(), 0.0);
        let priors = problem.unknowns.iter().enumerate().filter_map(|(i, u)| u.prior.map(|p| (i, p.weight)));
        for (row, (column, weight)) in priors.enumerate() {
            jacobian[(problem.observations.len() + row, column)] = weight;
        }
        Some(Linearised { jacobian, residuals, other_jacobian, other_residuals })
    }

    /// Residuals of several candidates, each solved from rest in a workspace of its own and kept as a start for others.
    pub(super) fn residuals_of_each(&mut self, candidates: &[Vec<f64>]) -> Vec<Option<DVector<f64>>> {
        let solved = parallel::map(candidates, |x| {
            let mut forward = Forward::new(self.problem, self.settings);
            let residuals = forward.residuals(x);
            (residuals, forward.counts, forward.known.best().cloned())
        });
        Vec::from_iter(solved.into_iter().map(|(residuals, counts, known)| {
            self.counts += counts;
            if let Some(known) = known {
                self.known.remember(&known.x, known.cost, &known.positions);
            }
            residuals
        }))
    }

    /// Whether candidates are solved along their load paths, which takes many times as long.
    pub(super) fn is_on_load_path(&self) -> bool {
        matches!(self.begin, CandidateStart::LoadPath | CandidateStart::EndOfPath(_))
    }

    /// Makes later candidates start from the shape of the last one, which is at the end of its load path.
    pub(super) fn start_from_end_of_path(&mut self) {
        self.begin = CandidateStart::EndOfPath(self.workspace.positions().to_vec());
    }

    pub(super) fn forget_neighbours(&mut self) {
        if self.begin == CandidateStart::Neighbour {
            self.begin = CandidateStart::Rest;
        }
        self.known.clear();
    }

    /// Sum of the squared residuals and the effort; always finite.
    pub(super) fn cost(&self, x: &[f64], residuals: Option<&DVector<f64>>) -> f64 {
        let Some(r) = residuals else { return FAILED };
        let tensions = self.problem.unknowns.iter().zip(x).filter(|(u, _)| u.is_tension()).map(|(_, x)| x);
        let cost = r.iter().map(|r| r.powi(2)).sum::<f64>() + self.effort * tensions.sum::<f64>();
        if cost.is_finite() { cost } else { FAILED }
    }

    /// Root mean square residual of the observations; infinite for a candidate without an equilibrium.
    pub(super) fn misfit(&self, residuals: Option<&DVector<f64>>) -> f64 {
        let n = self.problem.observations.len();
        residuals
            .map_or(f64::INFINITY, |r| (r.iter().take(n).map(|r| r.powi(2)).sum::<f64>() / n as f64).sqrt())
    }
}
