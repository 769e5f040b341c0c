//! Entry points of the physics that are compiled in this crate, for two and for three dimensions.
//!
//! A generic function is compiled in the crate that first calls it, with the optimisation of that crate. The
//! crates that read, write and print are not optimised, so computations are called through `Entries`:
//! pointers to functions that were compiled here. A [`System`] contains them, because it can only be made
//! here (`system_in_plane`, `system_in_space`).

use std::any::Any;

use nalgebra::{DMatrix, SVector};

use crate::body::Mesh;
use crate::dynamics::{
    self, Control, IntegrationMethod, Integrator, Motion, MotionError, MotionOutcome, Observer, State,
};
use crate::effect::Effect;
use crate::material::Coefficients;
use crate::sparse::cholesky::NotPositiveDefinite;
use crate::statics::{self, Settings, Solution, Trace, Workspace};
use crate::system::{Additions, Model, System, SystemError};

type Follow<const D: usize> = fn(&System<D>, &mut Workspace<D>, &[f64], &Settings, usize) -> Trace;
type Sensitivities<const D: usize> =
    fn(&System<D>, &mut Workspace<D>) -> Result<DMatrix<f64>, NotPositiveDefinite>;
type Rates<const D: usize> = fn(
    &System<D>,
    &mut Workspace<D>,
    (&[SVector<f64, D>], &[f64]),
    &[Vec<usize>],
) -> Option<Vec<Vec<SVector<f64, D>>>>;
type Run<const D: usize> = fn(
    &Motion<'_, D>,
    &mut dyn Integrator<D>,
    &mut State<D>,
    f64,
    &[f64],
    &mut dyn Observer<D>,
) -> MotionOutcome;
type MakeIntegrator<const D: usize> =
    fn(IntegrationMethod, &Motion<'_, D>, Control) -> Result<Box<dyn Integrator<D>>, MotionError>;

/// Pointers to the functions of one dimension, compiled in this crate.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entries<const D: usize> {
    pub solve: fn(&System<D>, &mut Workspace<D>, &[f64], &Settings) -> Solution,
    pub trace: Follow<D>,
    pub solve_and_trace: Follow<D>,
    pub length_sensitivities: Sensitivities<D>,
    pub position_rates: Rates<D>,
    pub smallest_eigenvalue: fn(&System<D>, &mut Workspace<D>) -> Option<f64>,
    pub run: Run<D>,
    pub integrator: MakeIntegrator<D>,
    pub checked_integrator: MakeIntegrator<D>,
}

impl<const D: usize> Entries<D> {
    /// The functions compiled at the place of the call: in this crate, by [`System::build`].
    pub fn here() -> Self {
        Self {
            solve: statics::solve_here,
            trace: statics::trace_here,
            solve_and_trace: statics::solve_and_trace_here,
            length_sensitivities: statics::length_sensitivities_here,
            position_rates: statics::position_rates_here,
            smallest_eigenvalue: statics::smallest_eigenvalue_here,
            run: dynamics::run_here,
            integrator: IntegrationMethod::integrator_here,
            checked_integrator: IntegrationMethod::checked_here,
        }
    }
}

/// [`System::build`] in the plane.
pub(crate) fn system_in_plane(
    mesh: &Mesh<2>,
    model: &Model,
    contracting: &[usize],
    additions: Additions<2>,
) -> Result<System<2>, SystemError> {
    System::build(mesh, model, contracting, additions)
}

/// [`System::build`] in space.
pub(crate) fn system_in_space(
    mesh: &Mesh<3>,
    model: &Model,
    contracting: &[usize],
    additions: Additions<3>,
) -> Result<System<3>, SystemError> {
    System::build(mesh, model, contracting, additions)
}

/// [`System::build_from_effects`] in the plane.
pub(crate) fn effects_in_plane(
    mesh: &Mesh<2>,
    coefficients: Coefficients,
    effects: Vec<Box<dyn Effect<2>>>,
    contracting: &[usize],
) -> Result<System<2>, SystemError> {
    System::build_from_effects(mesh, coefficients, effects, contracting)
}

/// [`System::build_from_effects`] in space.
pub(crate) fn effects_in_space(
    mesh: &Mesh<3>,
    coefficients: Coefficients,
    effects: Vec<Box<dyn Effect<3>>>,
    contracting: &[usize],
) -> Result<System<3>, SystemError> {
    System::build_from_effects(mesh, coefficients, effects, contracting)
}

/// The reference as one to a `B`, if that is what it refers to.
pub(crate) fn seen_as<A: Any, B: Any>(value: &A) -> Option<&B> {
    (value as &dyn Any).downcast_ref()
}

/// The value as a `B`, if it is one; it stays where it is otherwise.
pub fn taken_as<A: Any, B: Any>(value: &mut Option<A>) -> Option<B> {
    (value as &mut dyn Any).downcast_mut::<Option<B>>().and_then(Option::take)
}

/// The reference as a mutable one to a `B`, if that is what it refers to.
pub(crate) fn as_mut<A: Any, B: Any>(value: &mut A) -> Option<&mut B> {
    (value as &mut dyn Any).downcast_mut()
}
