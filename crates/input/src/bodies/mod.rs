//! Bodies from files: meshes of Gmsh ([`gmsh`]), the program's own JSON ([`json`]) and the tongue of
//! ArtiSynth ([`artisynth`]).

pub mod artisynth;
pub mod gmsh;
pub mod json;

use std::fmt;
use std::path::Path;

use tongue_core::body::{Body, BodyError};

pub use gmsh::Unit;

/// Why a file contains no usable body.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "fields without a unit are in the messages")]
pub enum BodyFileError {
    /// Its body cannot be used.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// The file of Gmsh is invalid.
    #[error("{origin}{place}: {problem}")]
    Gmsh { origin: String, place: FilePlace, problem: gmsh::MshProblem },
    /// A file of ArtiSynth is missing or invalid.
    #[error("{origin}{place}: {problem}")]
    ArtiSynth { origin: String, place: FilePlace, problem: artisynth::ArtiSynthProblem },
}

/// A place in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FilePlace {
    /// The file as a whole.
    Whole,
    /// A line, from 1.
    Line(usize),
    /// A byte of a binary file, from 0.
    Byte(usize),
}

impl fmt::Display for FilePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole => Ok(()),
            Self::Line(line) => write!(f, ":{line}"),
            Self::Byte(byte) => write!(f, " (byte {byte})"),
        }
    }
}

/// A body in the plane or in space.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyBody {
    /// In the midsagittal plane.
    Flat(Body<2>),
    /// In space.
    Solid(Body<3>),
}

impl AnyBody {
    /// Reads a file: Gmsh's, with coordinates in `unit`, or the JSON of `tongue-fit mesh --json` if its name
    /// ends in `.json`.
    ///
    /// # Errors
    /// [`BodyError::File`] and [`BodyFileError::Gmsh`] for files that cannot be read, contain no body or one that
    /// is far too large.
    pub fn read(path: &Path, unit: Unit) -> Result<Self, BodyFileError> {
        Self::read_telling(path, unit, &mut |_| ())
    }

    /// As [`AnyBody::read`], and passes concerns about a Gmsh file to `tell`.
    ///
    /// # Errors
    /// As [`AnyBody::read`].
    pub fn read_telling(
        path: &Path,
        unit: Unit,
        tell: &mut dyn FnMut(gmsh::Concern),
    ) -> Result<Self, BodyFileError> {
        let file = path.display().to_string();
        let wrong = |problem: String| BodyFileError::from(BodyError::File { file: file.clone(), problem });
        let bytes = crate::files::read(path)
            .map_err(|e| wrong(format!("cannot be read: {e}; give a mesh of Gmsh (.msh)")))?;
        if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("json")) {
            return Self::from_msh_telling(&bytes, &file, unit, tell);
        }
        if unit != Unit::M {
            return Err(wrong("contains metres, as its keys say; leave out [body.mesh] unit".to_owned()));
        }
        let text = String::from_utf8(bytes).map_err(|_| wrong("is not UTF-8 text".to_owned()))?;
        let body = json::read(&text, &file)?;
        gmsh::unit_suspicion(&body.mesh).into_iter().for_each(tell);
        Ok(Self::Flat(body))
    }

    /// Reads the bytes of a Gmsh file; `origin` is its name in messages, usually its path.
    ///
    /// # Errors
    /// [`BodyFileError::Gmsh`], and [`BodyError::File`] for a body that is far too large.
    pub fn from_msh(bytes: &[u8], origin: &str, unit: Unit) -> Result<Self, BodyFileError> {
        Self::from_msh_telling(bytes, origin, unit, &mut |_| ())
    }

    fn from_msh_telling(
        bytes: &[u8],
        origin: &str,
        unit: Unit,
        tell: &mut dyn FnMut(gmsh::Concern),
    ) -> Result<Self, BodyFileError> {
        let (size, suspicion, bent, any) = match gmsh::read(bytes, origin, unit)? {
            gmsh::File::Flat(gmsh::Content { body, bent, .. }) => {
                (body.mesh.check_size(), gmsh::unit_suspicion(&body.mesh), bent, Self::Flat(body))
            }
            gmsh::File::Solid(gmsh::Content { body, bent, .. }) => {
                (body.mesh.check_size(), gmsh::unit_suspicion(&body.mesh), bent, Self::Solid(body))
            }
        };
        suspicion.into_iter().chain(bent.map(gmsh::Concern::Bent)).for_each(tell);
        size.map(|()| any).map_err(|error| BodyFileError::from(BodyError::File {
            file: origin.to_owned(),
            problem: format!(
                "cannot be used: {error}, or read them with --mesh-unit mm (in a scene: [body.mesh] unit = \"mm\")"
            ),
        }))
    }

    /// The body in the plane.
    ///
    /// # Errors
    /// [`BodyError::Dimension`] for a body in space.
    pub fn flat(self) -> Result<Body<2>, BodyError> {
        match self {
            Self::Flat(body) => Ok(body),
            Self::Solid(Body { what, .. }) => Err(BodyError::Dimension {
                what,
                is: "tetrahedra",
                wanted: "one in the midsagittal plane (as a scene, solids are simulated too: [body.mesh] file = ..)",
            }),
        }
    }

    /// The body in space.
    ///
    /// # Errors
    /// [`BodyError::Dimension`] for a body in the plane.
    pub fn solid(self) -> Result<Body<3>, BodyError> {
        match self {
            Self::Solid(body) => Ok(body),
            Self::Flat(Body { what, .. }) => {
                Err(BodyError::Dimension { what, is: "triangles", wanted: "one of tetrahedra" })
            }
        }
    }
}
