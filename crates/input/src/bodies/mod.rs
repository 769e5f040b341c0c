//! Bodies from files: meshes of Gmsh ([`gmsh`]), the program's own JSON ([`json`]) and ArtiSynth's tongue ([`artisynth`]).

pub mod artisynth;
pub mod gmsh;
pub mod json;

use std::path::Path;

use serde::{Deserialize, Serialize};
use tongue_core::body::space::Side;
use tongue_core::body::{Body, BodyError};

pub use gmsh::Unit;

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MeshContent {
    /// The JSON of `tongue-fit mesh --json`.
    Json(String),
    /// A file of Gmsh, with coordinates in `unit`.
    Gmsh { bytes: Vec<u8>, unit: Unit },
}

impl MeshContent {
    /// Reads a file: the JSON of `tongue-fit mesh --json` if its name ends in `.json`, otherwise Gmsh's, with coordinates in `unit`.
    pub fn read(path: &Path, unit: Unit) -> Result<Self, BodyError> {
        let wrong = |problem: String| BodyError::file(path.display(), problem);
        let bytes = crate::files::read(path)
            .map_err(|e| wrong(format!("cannot be read: {e}; give a mesh of Gmsh (.msh)")))?;
        if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("json")) {
            return Ok(Self::Gmsh { bytes, unit });
        }
        if unit != Unit::M {
            return Err(wrong(
                "contains metres, as its keys say; leave out the unit (--mesh-unit, or `unit` in a scene)"
                    .to_owned(),
            ));
        }
        String::from_utf8(bytes).map(Self::Json).map_err(|_| wrong("is not UTF-8 text".to_owned()))
    }

    /// `origin` is the name of the file in messages; concerns about the body are passed to `tell`.
    pub fn body(&self, origin: &str, tell: &mut dyn FnMut(String)) -> Result<AnyBody, BodyError> {
        let (bytes, unit) = match self {
            Self::Json(text) => {
                let body = json::read(text, origin)?;
                gmsh::review(&body.mesh).into_iter().chain(gmsh::review_of_head(&body)).for_each(tell);
                return Ok(AnyBody::Flat(body));
            }
            Self::Gmsh { bytes, unit } => (bytes, *unit),
        };
        let gmsh::Content { body, concerns, .. } = gmsh::read(bytes, origin, unit)?;
        concerns.into_iter().for_each(&mut *tell);
        let size = match &body {
            AnyBody::Flat(body) => {
                gmsh::review_of_head(body).into_iter().for_each(tell);
                body.mesh.check_size()
            }
            AnyBody::Solid(body) => body.mesh.check_size(),
        };
        size.map(|()| body).map_err(|error| {
            let how = "--mesh-unit mm (in a scene: [body.mesh] unit = \"mm\")";
            BodyError::file(origin, format!("cannot be used: {error}, or read them with {how}"))
        })
    }
}

#[derive(Debug, Clone, PartialEq)]
pub enum AnyBody {
    Flat(Body<2>),
    Solid(Body<3>),
}

impl AnyBody {
    /// Reads a file as [`MeshContent::read`] and [`MeshContent::body`] do, without the concerns.
    pub fn read(path: &Path, unit: Unit) -> Result<Self, BodyError> {
        MeshContent::read(path, unit)?.body(&path.display().to_string(), &mut |_| ())
    }

    pub fn flat(self) -> Result<Body<2>, BodyError> {
        match self {
            Self::Flat(body) => Ok(body),
            Self::Solid(Body { what, .. }) => Err(BodyError(format!(
                "{what} is a body of tetrahedra; one in the midsagittal plane (as a scene, solids are simulated too: \
                 [body.mesh] file = ..) is needed here"
            ))),
        }
    }

    pub fn solid(self) -> Result<Body<3>, BodyError> {
        match self {
            Self::Solid(body) => Ok(body),
            Self::Flat(Body { what, .. }) => {
                let is = "is a body of triangles; one of tetrahedra is needed here";
                Err(BodyError(format!("{what} {is}")))
            }
        }
    }
}

/// The group of a muscle and its side: of `GGP_L`, `GGP` and the left one.
pub(crate) fn group_and_side(name: &str) -> (&str, Side) {
    match name.rsplit_once('_') {
        Some((group, "L")) => (group, Side::Left),
        Some((group, "R")) => (group, Side::Right),
        _ => (name, Side::Middle),
    }
}
