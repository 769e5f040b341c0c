//! tongue-fit: the tensions of tongue muscles from their lengths.
//!
//! # The equations
//! A tongue is nodes `x_i` joined by connections, in the midsagittal plane (`D = 2`, plane strain, everything
//! per metre of thickness) or in space (`D = 3`). At equilibrium its free nodes minimise the potential energy
//! ```text
//! E(x; F) =  sum over connections         1/2 k (l - l0)²            tissue (Kelvin-Voigt at rest)
//! +  sum over muscle connections  F (l - l0)                 tension F >= 0 of the contractile element
//! +  sum over cells               1/2 kappa ((S - S0)/S0)²   near-incompressible triangles or tetrahedra
//! ```
//!
//! and the inverse problem is to find the tensions `F` whose muscle lengths (straight distances between a
//! muscle's ends) meet measured ratios or stretches. Model and coefficients: Kato, bachelor thesis, Osaka
//! University 2014, with its misprints corrected (listed in docs/model.md); lengths: Takano and Honda, Speech
//! Communication 49 (2007).
//!
//! # The flow, one way
//! ```text
//! targets/*.csv            -> measured     tables of lengths: which muscles contract, what to fit
//! anatomy or Gmsh file     -> body         nodes, cells, named muscles, named bones
//! E, nu, rho, eta          -> material     coefficients by stiffness matching, laws
//! body + material          -> system       only the effects that are needed; unknowns and sparsity, made
//! once system + tensions        -> statics      Newton's method on a sparse block Cholesky; the branch of
//! equilibria from rest system + tensions(t)     -> dynamics     masses, dampers, three-element muscles over
//! time; integrators behind one trait measurements             -> observe      lengths, ratios, stretches,
//! points, contours: value, gradient, standard deviation system + observations    -> inverse      tensions,
//! displaced bones, constants: Nelder-Mead, Gauss-Newton, what the data leave undetermined body + recording
//! -> adapt        a speaker's body; track: tensions over time from contours, sensors and bones body + tract
//! -> heard        areas, formants and their derivatives by the nodes, a voice any result               ->
//! report       JSON, CSV, SVG, VTU, MSH, .sto a file                   -> scene        loads and wanted
//! results; nothing else is computed
//! ```
//! [`simulation`] is the interface to all of it by the names of muscles and bones.
//!
//! # A complete example
//! ```
//! use tongue_fit::prelude::*;
//!
//! let target = Dataset::reference()?.stretches("S2", "a")?; // which muscles shortened in /a/, and by how
//! much let body = Body::tongue(5.5 * MM)?; // or AnyBody::read("my.msh".as_ref(), Unit::Mm)?.flat()? let
//! model = Model::default().assemble(&body, target.active_names())?; // these muscles can contract
//!
//! let shape = model.solver().follow_from_rest(&[("GGa", 12.0), ("HGa", 4.5)])?; // N per metre of thickness
//! println!("GGa: {:.3} of its length at rest, {:?}", shape.stretch("GGa")?, shape.solution.status);
//!
//! let fit = InverseProblem::new(&model, model.observations(&target)?).fit()?;
//! for (muscle, tension) in fit.tensions() {
//!     println!("{muscle} {tension:.1} N per metre: {:.3} of its length", fit.shape.stretch(muscle)?);
//! }
//! let (folder, picture) = (std::env::temp_dir().join("tongue-fit"), fit.shape.picture("S2 /a/")?);
//! report::write(folder, "my program", &[("fit.json", &Json(&fit.record())), ("tongue.svg", &picture)])?;
//! # assert!(shape.is_converged() && shape.is_traced() && fit.is_trustworthy());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//! Further programs are in `examples/`: data of your own, a body of your own, a scene, tensions that ratios
//! leave undetermined, three dimensions (`cargo run --example own_data`).
//!
//! # Features
//! `parallel`: starts and fits on rayon's threads, with the same bits as without. `files`: reading and
//! writing of files; without it the library takes and gives bytes and text. `cli` (the default, with both):
//! the program `tongue-fit` itself.

// The program's modules use the library as its users do.
#[cfg(feature = "cli")]
extern crate self as tongue_fit;

#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;

pub use tongue_core::{
    effect, geometry, material, observe, parallel, random, sparse, statics, statistics, suggest, system,
};
pub use tongue_files::{VERSION, report, scene, simulation};
pub use tongue_infer::{adapt, heard, inverse, posterior, track};
#[doc(hidden)]
pub use tongue_input::files;
pub use tongue_input::measured;
pub use tongue_study as study;

pub mod body {
    //! Bodies: meshes with named muscles and bones, from an anatomy, from a file, or of your own.
    pub use tongue_core::body::*;
    pub use tongue_input::bodies::{AnyBody, BodyFileError, Unit, artisynth, gmsh, json};
}

pub mod dynamics {
    //! Motion: masses, dampers and three-element muscles over time.
    pub use tongue_core::dynamics::*;
    pub use tongue_input::curves::{Curves, CurvesError};
}

/// A millimetre in metres: `5.5 * MM`.
pub const MM: f64 = 1e-3;

/// What most programs need: `use tongue_fit::prelude::*;`.
pub mod prelude {
    pub use crate::MM;
    pub use crate::body::{Anatomy, AnyBody, Body, Unit};
    pub use crate::inverse::Method;
    pub use crate::measured::Dataset;
    pub use crate::observe::{Observable, Observation};
    pub use crate::report::{self, Json};
    pub use crate::simulation::{Assemble, Assembly, Estimate, InverseProblem, Shape, Solver};
    pub use crate::system::{Model, TissueModel};
}
