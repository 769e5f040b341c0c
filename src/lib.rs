//! tongue-fit: the tensions of tongue muscles from their lengths.
//!
//! # The equations
//! A tongue is nodes `x_i` joined by connections, in the midsagittal plane (`D = 2`, plane strain, everything per metre of thickness) or in
//! space (`D = 3`). At equilibrium its free nodes minimise the potential energy
//! ```text
//! E(x; F) =  sum over connections         1/2 k (l - l0)²            tissue (Kelvin-Voigt at rest)
//!         +  sum over muscle connections  F (l - l0)                 tension F >= 0 of the contractile element
//!         +  sum over cells               1/2 kappa ((S - S0)/S0)²   near-incompressible triangles or tetrahedra
//! ```
//!
//! and the inverse problem is to find the tensions `F` whose muscle lengths (straight distances between a muscle's ends) meet measured
//! ratios or stretches. Model and coefficients: Kato, bachelor thesis, Osaka University 2014, with its misprints corrected (listed in
//! docs/model.md); lengths: Takano and Honda, Speech Communication 49 (2007).
//!
//! # The flow, one way
//! ```text
//! targets/*.csv            -> measured     tables of lengths: which muscles contract, what to fit
//! anatomy or Gmsh file     -> body         nodes, cells, named muscles, named bones
//! E, nu, rho, eta          -> material     coefficients by stiffness matching, laws
//! body + material          -> system       only the needed effects; unknowns and sparsity, made once
//! system + tensions        -> statics      Newton's method on a sparse block Cholesky; the branch from rest
//! system + tensions(t)     -> dynamics     masses, dampers, three-element muscles over time; integrators
//! measurements             -> observe      lengths, ratios, stretches, points, contours and their gradients
//! system + observations    -> inverse      tensions, displaced bones, constants; what is undetermined
//! body + recording         -> adapt        a speaker's body; track: tensions over time from recordings
//! body + tract             -> acoustics    areas, formants and their derivatives by the nodes
//! any result               -> report       JSON, CSV, SVG, VTU, MSH, .sto
//! a file                   -> scene        loads and wanted results; nothing else is computed
//! ```
//! [`simulation`] is the interface to all of it by the names of muscles and bones; [`run`] has what the program does as structs of options.
//!
//! # A complete example
//! ```
//! use tongue_fit::prelude::*;
//!
//! let target = Dataset::reference()?.stretches("S2", "a")?; // which muscles shortened in /a/, and by how much
//! let body = Body::tongue(5.5 * MM)?; // or AnyBody::read("my.msh".as_ref(), Unit::Mm)?.flat()?
//! let model = Assembly::new(&Model::default(), &body, target.active_names())?; // these muscles can contract
//!
//! let shape = model.solver().follow_from_rest(&[("GGa", 12.0), ("HGa", 4.5)])?; // N per metre of thickness
//! println!("GGa: {:.3} of its length at rest, {:?}", shape.stretch("GGa")?, shape.solved.equilibrium.solution.status);
//!
//! let fit = InverseProblem::new(&model, model.observations(&target)?).fit()?;
//! for (muscle, tension) in fit.tensions() {
//!     println!("{muscle} {tension:.1} N per metre: {:.3} of its length", fit.shape.stretch(muscle)?);
//! }
//! let (folder, picture) = (std::env::temp_dir().join("tongue-fit"), fit.shape.picture("S2 /a/")?);
//! report::write(folder, "my program", &[("estimate.json", &Json(&fit.record())), ("tongue.svg", &picture)])?;
//! # assert!(shape.is_converged() && shape.is_traced() && fit.answer.is_trustworthy());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//! Further programs are in `examples/`: data of your own, a body of your own, a scene, tensions that ratios leave undetermined, three
//! dimensions (`cargo run --example own_data`).
//!
//! # Features
//! `parallel`: starts and fits on rayon's threads, with the same bits as without. `files`: reading and writing of files; without it the
//! library takes and gives bytes and text. `cli` (the default, with both): the program `tongue-fit` itself.
//!
//! In a workspace of your own, debug builds compute fast with `[profile.dev.package."*"]` and `opt-level = 3` in its `Cargo.toml`.

#![warn(missing_docs)]

// The program's modules use the library by the names that its users know, and what only they need by `inner`.
#[cfg(feature = "cli")]
extern crate self as tongue_fit;
#[cfg(feature = "cli")]
mod inner {
    pub(crate) use tongue_core::{choice, dynamics, limits, statistics};
    pub(crate) use tongue_files::{report, run, scene, surgery, validate};
    pub(crate) use tongue_infer::{adapt, inverse, posterior, standard_deviations, track};
    pub(crate) use tongue_input::{files, measured};
}

#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;

pub use tongue_files::VERSION;

pub mod adapt {
    //! Bodies of speakers, made from recordings or landmarks.
    pub use tongue_infer::adapt::{
        Adaptation, AdaptationInput, Landmarks, RestShapeMethod, followed_bones, mark_of,
    };
}

pub mod body {
    //! Bodies: meshes with named muscles and bones, from an anatomy, from a file, or of your own.
    pub use tongue_core::body::space::{Filling, Half, Region, Segment, Side};
    pub use tongue_core::body::{
        Anatomy, Body, BodyError, Bone, Cells, ContinuumSettings, DEFAULT_SPACING_M, HYOID, MANDIBLE, Mesh,
        Muscle, MuscleChain, Quality, REFERENCE, build,
    };
    pub use tongue_input::bodies::{AnyBody, MeshContent, Unit};

    pub mod artisynth {
        //! The tongue of ArtiSynth, from its folder.
        pub use tongue_input::bodies::artisynth::read;
    }

    pub mod gmsh {
        //! Meshes of Gmsh, read and written.
        pub use tongue_input::bodies::gmsh::{Content, read, read_space, write};
    }

    pub mod json {
        //! Bodies as JSON.
        pub use tongue_input::bodies::json::{MeshRecord, read};
    }

    pub mod solid {
        //! Simple bodies in space.
        pub use tongue_core::body::solid::{block, cylinder};
    }
}

pub mod dynamics {
    //! Motion: masses, dampers and three-element muscles over time.
    pub use tongue_core::dynamics::{
        Control, IntegrationMethod, Motion, MotionOutcome, MotionStatus, Observer, State, Tensions, run,
        sample_times,
    };
    pub use tongue_input::measured::curves::Curves;
}

pub mod effect {
    //! Effects: what pulls and pushes at the nodes of a body.
    pub use tongue_core::effect::{Configuration, Contact, Effect, Gravity, Tangent};
}

pub mod files {
    //! Reading files with a limit on their size, and advice where the operating system refuses.
    pub use tongue_input::files::read;
}

pub mod geometry {
    //! Points and similarities.
    pub use tongue_core::geometry::topology::outlines;
    pub use tongue_core::geometry::{Point, Similarity};
}

pub mod acoustics {
    //! What is heard of a tongue: formants, and how they answer to its nodes.
    pub use tongue_infer::acoustics::{
        Articulation, Formant, FormantFrequency, MeanVowel, Sound, SpaceVocalTract, Tract, VocalTract,
        mean_vowels, nearest_vowel,
    };
}

pub mod inverse {
    //! The inverse problem: tensions, displaced bones and constants that meet what was measured.
    pub use tongue_infer::inverse::in_space::{Recorded, SpaceSearch};
    pub use tongue_infer::inverse::solution_curve::{SolutionCurve, Termination};
    pub use tongue_infer::inverse::{
        Constant, Fit, FitError, FitSettings, FitStatus, Method, MovableBone, Prior, TargetOnBody, Unknown,
        fit,
    };

    pub mod alarms {
        //! What to doubt in an answer.
        pub use tongue_infer::inverse::alarms::{Alarm, alarms};
    }

    pub mod batch {
        //! Every subject and vowel of a table.
        pub use tongue_infer::inverse::batch::{Selection, plan, settings};
    }
}

pub mod material {
    //! Materials: laws, and coefficients matched to the constants of a model.
    pub use tongue_core::material::{Coefficients, MooneyRivlin, NeoHookean};
}

pub mod measured {
    //! What was measured: lengths of muscles, recordings of tongues, and the targets made of them.
    pub use tongue_input::measured::emg::Activity;
    pub use tongue_input::measured::muscles::Muscles;
    pub use tongue_input::measured::thesis::Thesis;
    pub use tongue_input::measured::{
        ByMuscle, Dataset, Lengths, ReadError, Target, TargetKind, TargetOptions, Vowel,
    };

    pub mod lengths {
        //! Tables of lengths, and how they were read.
        pub use tongue_input::measured::lengths::{Malformed, Row};
    }

    pub mod recording {
        //! Recordings of moving tongues.
        pub use tongue_input::measured::recording::{
            AlignedRecording, FaultKind, Format, Map, Recording, Severity, check_plausibility, other_size,
            remove_outliers,
        };
    }
}

pub mod observe {
    //! What can be observed of a body: its value and its gradient.
    pub use tongue_core::observe::{
        Contour, Curve, Length, NodePosition, Observable, Observation, Ratio, Stretch, Surface,
    };
}

pub mod parallel {
    //! Work on several threads, with the same bits as on one.
    pub use tongue_core::parallel::{map, with_threads};
}

pub mod posterior {
    //! The posterior of tensions: which tensions data and model allow, with every unknown included.
    //! ```
    //! use tongue_fit::posterior::{PosteriorModel, Priors, Sampling};
    //! use tongue_fit::prelude::*;
    //! use tongue_fit::run::PosteriorRun;
    //!
    //! let target = Dataset::reference()?.stretches("S2", "a")?;
    //! let model = PosteriorModel::new(&Body::tongue(12.0 * MM)?, &Model::default(), &Priors::default())?;
    //! let sampling = Sampling { draws: 200, seed: 1 }; // 1000 for intervals
    //! let run = PosteriorRun { model: &model, targets: &[&target], auxiliary: Default::default(), sampling };
    //! let found = run.run(&|doing| println!("{doing}"))?;
    //! let harder = found.posterior.draws.iter().filter(|draw| draw.change(0, 0) > 0.0).count();
    //! println!("GGa pulls harder than in the baseline in {harder} of {} draws", found.posterior.draws.len());
    //! # assert_eq!(found.posterior.draws.len(), 200);
    //! # Ok::<(), Box<dyn std::error::Error>>(())
    //! ```
    pub use tongue_infer::posterior::{
        Draw, Posterior, PosteriorError, PosteriorModel, Priors, Quantiles, Report, Sampling, ShortRun,
        Status, Summary, Verdict,
    };
}

pub mod report {
    //! Outputs: records, tables, pictures and pages.
    pub use tongue_files::report::{
        Export, FitRecord, Json, Msh, Provenance, ReportError, SimulationRecord, SoundRecord, Svg, Vtu, Wav,
        animation, solution_curve, tongue,
    };
    #[cfg(feature = "files")]
    pub use tongue_files::report::{OutputDir, write};

    #[cfg(feature = "files")]
    pub mod batch {
        //! The files of a batch.
        pub use tongue_files::report::batch::Shard;
    }
}

pub mod run {
    //! Runs as plain structs, which the program, the Python module and the page fill in.
    #[cfg(feature = "files")]
    pub use tongue_files::run::BatchRun;
    pub use tongue_files::run::{
        BodySource, Equilibrium, FitRun, Kind, PlaneBody, PosteriorRun, SampledMotion, SampledPosterior,
        ScreenedRecording, Solved, TrackRun, VerdictSource,
    };
}

pub mod scene {
    //! Scenes: files that say what happens to a tongue and what is wanted.
    pub use tongue_files::scene::body::build;
    pub use tongue_files::scene::effects::{Hyoid, Jaw};
    pub use tongue_files::scene::file::{SceneBody, Want};
    pub use tongue_files::scene::prepare::{Prepared, prepare};
    pub use tongue_files::scene::run::{SceneOutcome, fit, run};
    pub use tongue_files::scene::{JOINT_MM, Scene, names, shipped, simulate};
}

pub mod simulation {
    //! The whole library by names of muscles and bones.
    pub use tongue_files::simulation::{
        Assembly, Estimate, InverseProblem, Shape, SimulationError, Solver, read_tensions,
    };
}

pub mod statics {
    //! Equilibria: Newton's method, the branch from rest.
    pub use tongue_core::statics::{
        Connection, FromRest, Solution, SolveSettings, SolveStatus, Stability, Trace, Workspace, solve,
        solve_and_trace, trace,
    };
}

pub mod statistics {
    //! Statistics.
    pub use tongue_core::statistics::median;
}

pub mod choice {
    //! Choices by their names.
    pub use tongue_core::choice::{named, names};
}

pub mod system {
    //! Systems: the effects of a body that are called for, with its unknowns.
    pub use tongue_core::system::{
        Additions, Model, MusclesAs, PrescribedDisplacement, SpaceModel, System, SystemError, TissueModel,
        coefficients,
    };
}

pub mod validate {
    //! Predictions of muscles that were not fitted, beside predictors without mechanics.
    pub use tongue_files::validate::{ValidationPlan, run};
}

pub mod track {
    //! Tensions over time from recordings of a tongue.
    pub use tongue_core::observe::TongueSurface;
    pub use tongue_infer::track::{TrackSettings, Tracked, TrackedRecording};
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
    pub use crate::simulation::{Assembly, Estimate, InverseProblem, Shape, Solver};
    pub use crate::system::{Model, TissueModel};
}
