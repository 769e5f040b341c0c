//! A body in the midsagittal plane or in space, from options.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tongue_core::body::{Anatomy, Body, BodyError, ContinuumSettings, DEFAULT_SPACING_M};
use tongue_input::bodies::{MeshContent, Unit, artisynth, gmsh};
use tongue_input::files;

const CONTINUUM_SPACING_M: f64 = 4e-3;

/// Elements of a body.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Springs, with muscles along connections and bones that hold nodes.
    #[default]
    Springs,
    /// Quadratic elements with muscles of finite width and bones that hold patches; answers hardly depend on the mesh.
    Continuum,
}

impl Kind {
    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum BodySource {
    /// The built-in anatomy.
    #[default]
    Tongue,
    /// An anatomy; `origin` is its name in messages, usually a path.
    Anatomy { toml: String, origin: String },
    /// A mesh, with its name in messages.
    Mesh { content: MeshContent, origin: String },
}

impl BodySource {
    /// Reads a mesh file ([`MeshContent::read`]).
    pub fn read(path: &Path, unit: Unit) -> Result<Self, BodyError> {
        Ok(Self::Mesh { content: MeshContent::read(path, unit)?, origin: path.display().to_string() })
    }
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneBody {
    #[serde(default)]
    pub source: BodySource,
    #[serde(default)]
    pub kind: Kind,
    /// Mesh spacing of an anatomy, m; by default 5.5 mm, or 4 mm for a continuum. It has no effect on a mesh.
    #[serde(default)]
    pub spacing_m: Option<f64>,
}

impl PlaneBody {
    pub fn spacing_m(&self) -> f64 {
        self.spacing_m.unwrap_or(match self.kind {
            Kind::Springs => DEFAULT_SPACING_M,
            Kind::Continuum => CONTINUUM_SPACING_M,
        })
    }

    /// Makes the body; `tell` gets what a file gives reason to doubt.
    ///
    /// # Errors
    /// For a text that is no anatomy, a file that contains no body in the plane, a spacing out of range, and a body that cannot be made a
    /// continuum.
    pub fn make(&self, tell: &mut dyn FnMut(String)) -> Result<Body<2>, BodyError> {
        let settings = ContinuumSettings::default();
        let spacing_m = self.spacing_m();
        let continuum = self.kind == Kind::Continuum;
        match &self.source {
            BodySource::Tongue if continuum => Body::continuum(spacing_m, &settings),
            BodySource::Tongue => Body::tongue(spacing_m),
            BodySource::Anatomy { toml, origin } => {
                let anatomy = Anatomy::from_toml(toml, origin)?;
                let body = Body::from_anatomy(&anatomy, spacing_m).and_then(|body| {
                    gmsh::review_of_head(&body).into_iter().for_each(tell);
                    if continuum { body.into_continuum_of(&anatomy, &settings) } else { Ok(body) }
                });
                body.map_err(|error| BodyError(format!("{origin}: {error}")))
            }
            BodySource::Mesh { content, origin } => {
                let body = content.body(origin, tell)?.flat()?;
                if continuum { body.into_continuum(&settings) } else { Ok(body) }
            }
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SpaceSource {
    BuiltIn,
    /// A folder with the files of ArtiSynth's tongue.
    Folder(PathBuf),
    /// Hexahedra from Gmsh.
    Mesh(PathBuf),
}

impl std::fmt::Display for SpaceSource {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::BuiltIn => write!(f, "--body space"),
            Self::Folder(path) | Self::Mesh(path) => write!(f, "{}", path.display()),
        }
    }
}

impl SpaceSource {
    /// The body in its own axes. `unit` is that of the coordinates of a mesh; if `refined`, every hexahedron is cut in eight. An
    /// error for a file that cannot be read or that has no such body.
    pub fn make(&self, unit: Unit, refined: bool) -> Result<Body<3>, BodyError> {
        let body = match self {
            Self::BuiltIn => return Body::tongue_in_space(if refined { 2 } else { 1 }),
            Self::Folder(folder) => artisynth::read(folder)?,
            Self::Mesh(file) => {
                let origin = file.display().to_string();
                let bytes = files::read(file).map_err(|error| {
                    let advice = files::advice(&error);
                    BodyError(format!("cannot read the mesh \"{origin}\": {error}; {advice}"))
                })?;
                gmsh::read_space(&bytes, &origin, unit)?
            }
        };
        Ok(if refined { body.refined() } else { body })
    }
}
