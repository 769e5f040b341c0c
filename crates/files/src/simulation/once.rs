//! Non-generic entry points, compiled in this crate for the plane and for space, so that a program that uses
//! them does not compile solvers and searches again.

use nalgebra::SVector;

use tongue_core::body::Mesh;
use tongue_core::dynamics::{MotionOutcome, Tensions};
use tongue_core::statics::{self, Settings, Solution, Trace, Workspace};
use tongue_core::system::{Model, System, SystemError};
use tongue_infer::inverse::{self, Answer, FitError, FreedBone, Inverse};

use super::SimulationError;
use super::samples::{Samples, follow};

/// Marker of the dimensions in which bodies can be solved by name: those for which it is [`Dimension`].
#[derive(Debug)]
pub struct Space;

/// Marker that bodies of `D` dimensions can be solved by name: 2 and 3.
pub trait Dimension<const D: usize>: Once<D> {}

/// Entry points that are compiled once. They cannot be called or implemented outside this crate.
#[allow(missing_docs, reason = "each is the function that it calls")]
pub trait Once<const D: usize> {
    fn system(mesh: &Mesh<D>, model: &Model, contracting: &[usize]) -> Result<System<D>, SystemError>;
    fn workspace(system: &System<D>) -> Workspace<D>;
    fn solve(system: &System<D>, w: &mut Workspace<D>, tensions: &[f64], settings: &Settings) -> Solution;
    fn trace(system: &System<D>, w: &mut Workspace<D>, tensions: &[f64], settings: &Settings) -> Trace;
    fn rates(
        system: &System<D>,
        w: &mut Workspace<D>,
        at: (&[SVector<f64, D>], &[f64]),
        muscles: &[Vec<usize>],
    ) -> Option<Vec<Vec<SVector<f64, D>>>>;
    fn free(
        mesh: &Mesh<D>,
        model: &Model,
        contracting: &[usize],
        nodes: &[usize],
    ) -> Result<FreedBone<D>, SystemError>;
    fn fit(inverse: &Inverse<'_, D>, settings: &inverse::Settings) -> Result<Answer<D>, FitError>;
    fn follow(
        system: &System<D>,
        tensions: Tensions,
        t_end_s: f64,
        samples: usize,
    ) -> Result<(MotionOutcome, Option<f64>, Samples<D>), SimulationError>;
}

macro_rules! once {
    ($d:literal) => {
        impl Dimension<$d> for Space {}

        impl Once<$d> for Space {
            fn system(
                mesh: &Mesh<$d>,
                model: &Model,
                contracting: &[usize],
            ) -> Result<System<$d>, SystemError> {
                System::new(mesh, model, contracting)
            }

            fn workspace(system: &System<$d>) -> Workspace<$d> {
                Workspace::new(system)
            }

            fn solve(
                system: &System<$d>,
                w: &mut Workspace<$d>,
                tensions: &[f64],
                settings: &Settings,
            ) -> Solution {
                statics::solve(system, w, tensions, settings)
            }

            fn trace(
                system: &System<$d>,
                w: &mut Workspace<$d>,
                tensions: &[f64],
                settings: &Settings,
            ) -> Trace {
                statics::solve_and_trace(system, w, tensions, settings, statics::TRACE_STEPS)
            }

            fn rates(
                system: &System<$d>,
                w: &mut Workspace<$d>,
                at: (&[SVector<f64, $d>], &[f64]),
                muscles: &[Vec<usize>],
            ) -> Option<Vec<Vec<SVector<f64, $d>>>> {
                statics::position_rates(system, w, at, muscles)
            }

            fn free(
                mesh: &Mesh<$d>,
                model: &Model,
                contracting: &[usize],
                nodes: &[usize],
            ) -> Result<FreedBone<$d>, SystemError> {
                FreedBone::new(mesh, model, contracting, nodes)
            }

            fn fit(inverse: &Inverse<'_, $d>, settings: &inverse::Settings) -> Result<Answer<$d>, FitError> {
                inverse::solve(inverse, settings)
            }

            fn follow(
                system: &System<$d>,
                tensions: Tensions,
                t_end_s: f64,
                samples: usize,
            ) -> Result<(MotionOutcome, Option<f64>, Samples<$d>), SimulationError> {
                follow(system, tensions, t_end_s, samples)
            }
        }
    };
}

once!(2);
once!(3);
