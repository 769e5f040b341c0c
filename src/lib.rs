//! tongue-fit: how hard does each tongue muscle pull, if it is this long?
//!
//! # The equations
//! A tongue is nodes `x_i` joined by connections, in the midsagittal plane (`D = 2`, plane strain, everything per metre of
//! thickness) or in space (`D = 3`). At equilibrium its free nodes minimise the potential energy
//!
//! ```text
//! E(x; F) =  sum over connections         1/2 k (l - l0)²            tissue (Kelvin-Voigt at rest)
//!         +  sum over muscle connections  F (l - l0)                 tension F >= 0 of the contractile element
//!         +  sum over cells               1/2 kappa ((S - S0)/S0)²   near-incompressible triangles or tetrahedra
//! ```
//!
//! and the inverse problem is to find the tensions `F` whose muscle lengths (straight distances between a muscle's ends) meet
//! measured ratios or stretches. Model and coefficients: Kato, bachelor thesis, Osaka University 2014, with its slips mended
//! (listed in docs/model.md); lengths: Takano and Honda, Speech Communication 49 (2007).
//!
//! # The flow, one way
//! ```text
//! targets/*.csv   -> measured     measured lengths: who contracts, what to hit
//! anatomy         -> body         outline and muscle lines -> nodes, connections, cells, chains, bones
//! E, nu, rho, eta -> material     coefficients by stiffness matching
//! body + material -> system       only the effects that are called for; unknowns and sparsity, made once
//! system + F      -> statics      Newton's method on a sparse block Cholesky
//! system + F(t)   -> dynamics     masses, dampers, three-element muscles over time; integrators behind one trait
//! lengths, target -> inverse      Nelder-Mead; what the data leave open
//! fit             -> report       JSON, CSV, SVG
//! scene           -> all of it    a file says what happens and what is wanted; nothing else is computed
//! ```
//!
//! # The shortest whole
//! Lengths, a mesh, one equilibrium, a fit, files: what most programs begin with. Each item has an example of its own.
//! ```
//! use tongue_fit::statics::{self, Status, Workspace};
//! use tongue_fit::inverse;
//! use tongue_fit::body::{self, Anatomy};
//! use tongue_fit::report::{FitRecord, OutputDir, Provenance};
//! use tongue_fit::system::{Model, System};
//! use tongue_fit::measured::{Dataset, Target, TargetKind, TargetOptions, Vowel};
//!
//! let data = Dataset::reference()?;
//! let target = Target::new(&data, "S2", Vowel::A, TargetKind::Stretch, &TargetOptions::default())?;
//! let mesh = body::build(&Anatomy::reference()?, body::DEFAULT_SPACING_M)?;
//!
//! let system = System::new(&mesh, &Model::default(), &[0])?; // GGa contracts; numbers as in the published tables
//! let mut workspace = Workspace::new(&system);
//! let tensions = [12.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]; // N per metre of thickness
//! let solution = statics::solve(&system, &mut workspace, &tensions, &statics::Settings::default());
//! assert_eq!(solution.status, Status::Converged);
//! assert!(system.length(workspace.positions(), 0) < system.length(system.rest(), 0));
//!
//! let fit = inverse::fit(&mesh, &Model::default(), &target, &inverse::Settings::default())?;
//! # let folder = tempfile::tempdir()?;
//! # let folder = folder.path();
//! let out = OutputDir::prepare(folder)?;
//! out.write("fit.csv", FitRecord::new(&fit, Provenance::new("my program"), 0.0).to_csv()?)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Features
//! `parallel`: starts and fits on rayon's threads, with the same bits as without. `files`: reading and writing of files; without it
//! the library takes and gives bytes and text. `cli` (the default, with both): the program `tongue-fit` itself.

// The program's modules name the library as its users do.
#[cfg(feature = "cli")]
extern crate self as tongue_fit;

pub mod body;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
pub mod dynamics;
pub mod effect;
mod files;
pub mod geometry;
pub mod input;
pub mod inverse;
pub mod material;
pub mod measured;
pub mod observe;
pub mod parallel;
pub mod report;
pub mod scene;
pub mod simulation;
pub mod sparse;
pub mod statics;
pub mod study;
pub mod suggest;
pub mod system;

/// Which tongue-fit this is: the version of the package and, where it was built in a git checkout, the commit, with
/// `-modified` behind it where its sources were not as committed: `0.1.0 (5e2005e12a)`. Every output says it.
pub const VERSION: &str = env!("TONGUE_FIT_VERSION");

/// A millimetre in metres, the unit of all lengths: `5.5 * MM`.
pub const MM: f64 = 1e-3;

/// What most programs need: `use tongue_fit::prelude::*;`.
pub mod prelude {
    pub use crate::MM;
    pub use crate::body::{Anatomy, AnyBody, Body, Unit};
    pub use crate::inverse::Method;
    pub use crate::measured::Dataset;
    pub use crate::observe::{Observable, Observation};
    pub use crate::report::{self, Json};
    pub use crate::simulation::{Assembly, Estimate, InverseProblem, Shape, Solver};
    pub use crate::system::{Model, TissueModel};
}
