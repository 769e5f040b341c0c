//! Accuracy and its cost in time, for every method of solution.
//!
//! | axis | file | error against |
//! |---|---|---|
//! | 1 to equilibrium | [`equilibrium`] | Newton's method stopped by rounding alone |
//! | 2 along the trajectory to 3 s | [`trajectory`] | TR-BDF2 at a tolerance a thousand times tighter |
//! | 3 stopping early | [`early_stopping`] | the equilibrium |
//! | 4 the mesh | [`mesh`] | the next coarser mesh: there is no limit to compare with |
//! | 5 the fit | [`search`] | Gauss-Newton at the tightest tolerances |
//!
//! Times are medians and hold for one machine; steps, evaluations of the force and factorisations hold for all. Failed and refused runs are
//! rows, too.

mod axes;
mod early_stopping;
mod equilibrium;
mod files;
mod mesh;
mod runs;
mod search;
mod time_stepping;
mod trajectory;

use crate::measure::Effort;
use crate::{Error, PUBLISHED_A, TestTensions, tell};
use tongue_core::body::{Body, DEFAULT_SPACING_M};
use tongue_core::system::Model;

pub use files::files;
#[cfg(test)]
mod tests;

#[derive(Debug, Clone)]
pub(crate) struct AccuracyStudy {
    pub equilibrium: Vec<runs::Run>,
    /// Residual force at the reference of axis 1, N.
    pub reference_residual_n: f64,
    pub trajectory: Vec<runs::Run>,
    /// Largest distance, mm, between the reference of axis 2 and a run with ten times its tolerance.
    pub reference_doubt_mm: f64,
    pub early: Vec<early_stopping::Stopped>,
    pub meshes: Vec<mesh::MeshRun>,
    pub fits: Vec<search::TimedFit>,
}

/// A run that fails is a row and no error.
pub fn run(effort: &Effort) -> Result<AccuracyStudy, Error> {
    let spacing = if effort.repeats > 1 { DEFAULT_SPACING_M } else { effort.spacings[0] };
    let body = Body::tongue(spacing)?.mesh;
    let scene = TestTensions::new(&body, &Model::default(), &PUBLISHED_A)?;
    tell("axis 5, the fit");
    let fits = search::work_precision(&body, effort)?;
    tell("axis 3, stopping early");
    let early = early_stopping::work_precision(&scene, effort)?;
    tell("axis 4, meshes");
    let meshes = mesh::work_precision(effort)?;
    tell("axis 2, along the trajectory");
    let (trajectory, reference_doubt_mm) = trajectory::work_precision(&scene, effort)?;
    tell("axis 1, to equilibrium");
    let (equilibrium, reference_residual_n) = equilibrium::work_precision(&scene, effort)?;
    Ok(AccuracyStudy {
        equilibrium,
        reference_residual_n,
        trajectory,
        reference_doubt_mm,
        early,
        meshes,
        fits,
    })
}
