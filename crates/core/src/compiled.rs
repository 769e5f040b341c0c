//! Entry points of the physics that are compiled in this crate, for two and for three dimensions.
//!
//! A generic function is compiled in the crate that first calls it, with the optimisation of that crate. The
//! crates that read, write and print are not optimised, so computations are called through `Entries`:
//! pointers to functions that were compiled here. A [`System`] contains them.

use std::any::Any;

use nalgebra::{DMatrix, SVector};

use crate::body::Mesh;
use crate::dynamics::{
    self, Control, IntegrationMethod, Integrator, Motion, MotionError, MotionOutcome, Observer, State,
};
use crate::effect::{Contact, Effect, Gravity};
use crate::material::Coefficients;
use crate::sparse::cholesky::NotPositiveDefinite;
use crate::statics::{self, Solution, SolveSettings, Trace, Workspace};
use crate::system::{Additions, Model, System, SystemError};

type Follow<const D: usize> = fn(&System<D>, &mut Workspace<D>, &[f64], &SolveSettings, usize) -> Trace;
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

type Build<const D: usize> = fn(&Mesh<D>, &Model, &[usize], Additions<D>) -> Result<System<D>, SystemError>;
type BuildFromEffects<const D: usize> =
    fn(&Mesh<D>, Coefficients, Vec<Box<dyn Effect<D>>>, &[usize]) -> Result<System<D>, SystemError>;

/// Pointers to the functions of one dimension, compiled in this crate.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entries<const D: usize> {
    pub build: Build<D>,
    pub build_from_effects: BuildFromEffects<D>,
    pub add_contact: fn(&mut Additions<D>, Contact),
    pub add_gravity: fn(&mut Additions<D>, Gravity<D>),
    pub solve: fn(&System<D>, &mut Workspace<D>, &[f64], &SolveSettings) -> Solution,
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
    /// The functions of this dimension; `None` if it is neither two nor three.
    pub fn of_dimension() -> Option<Self> {
        taken_as(&mut Some(in_plane())).or_else(|| taken_as(&mut Some(in_space())))
    }

    /// The functions as they are compiled where this is called, which must be in this crate.
    pub fn here() -> Self {
        Self {
            build: System::build,
            build_from_effects: System::build_from_effects,
            add_contact: Additions::add_contact_here,
            add_gravity: Additions::add_gravity_here,
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

// Not inlined, because a crate into which these are inlined compiles all that they point to once more.

#[inline(never)]
fn in_plane() -> Entries<2> {
    Entries::here()
}

#[inline(never)]
fn in_space() -> Entries<3> {
    Entries::here()
}

/// The value as a `B`, if it is one; it stays where it is otherwise.
pub fn taken_as<A: Any, B: Any>(value: &mut Option<A>) -> Option<B> {
    (value as &mut dyn Any).downcast_mut::<Option<B>>().and_then(Option::take)
}
