//! The body: a mesh (nodes, connections, cells), its named muscles and its named bones.
//!
//! `D = 2` is the midsagittal plane (cells are triangles), `D = 3` space (tetrahedra). A body comes from an anatomy
//! ([`Body::from_anatomy`], [`Body::tongue`]), from a file (`AnyBody::read`), from [`mod@solid`], or from any mesh ([`Body::new`]).

mod check;
pub mod continuum;
mod mesh;
mod refine;
pub mod solid;
pub mod space;
pub mod tongue;

use std::sync::Arc;

use nalgebra::SVector;

use crate::choice;
use crate::observe::Line;
use crate::statistics::distinct;

pub use crate::geometry::{ClosedSpline, Point};
pub use check::{MeshFault, Quality};
pub use continuum::{Continuum, ContinuumSettings, Follower, Strand, Tie};
pub use mesh::{Cells, Mesh, MuscleChain, largest_distance};
pub use space::Muscle;
pub use tongue::{Anatomy, DEFAULT_SPACING_M, MuscleLine, OutsidePart, REFERENCE, build};

/// The part of the jaw at which the genioglossus and the geniohyoid begin.
pub const MANDIBLE: &str = "mental_spine";
pub const HYOID: &str = "hyoid";

/// A bone: nodes that are held.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Bone {
    /// Name, such as [`HYOID`], or `bone` without one.
    pub name: String,
    /// Numbers of its nodes, ascending.
    pub nodes: Vec<usize>,
}

/// A body: its mesh with the named muscles, its bones and its palate.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Body<const D: usize> {
    /// A description, such as `the reference tongue at 5.5 mm`.
    pub what: String,
    /// Nodes, cells, connections, muscles and fixed nodes.
    pub mesh: Mesh<D>,
    /// The fixed nodes by bone, each name once; fixed nodes without a named bone are missing.
    pub bones: Vec<Bone>,
    /// The palate of the body, if there is one, as a line of points, m.
    pub palate: Option<Vec<Point>>,
    /// The linear mesh from which a continuum was made.
    pub origin: Option<Arc<Origin<D>>>,
    /// The muscles of a body of hexahedra, with regions and strengths, in the order of those of the mesh; otherwise empty.
    pub muscles: Vec<Muscle>,
    /// Factors of the constants of the tissue in each hexahedron (scars); empty if all are 1.
    pub factors: Vec<f64>,
    /// In a body of hexahedra, lines of muscles in the midsagittal plane by their names in tables of lengths.
    pub lines: Vec<(String, Line<D>)>,
    /// In a body of hexahedra, the node of the midsagittal plane at the tip; the foremost if `None`.
    pub tip_node: Option<usize>,
}

/// The linear mesh from which a continuum was made.
#[derive(Debug, Clone, PartialEq)]
pub struct Origin<const D: usize> {
    body: Body<D>,
    lines: Option<Vec<Vec<SVector<f64, D>>>>,
}

/// Why a body cannot be made: the file and the place in it if there is one, what is wrong, and what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct BodyError(pub String);

impl BodyError {
    /// A fault of a mesh file.
    pub fn file(file: impl std::fmt::Display, problem: impl std::fmt::Display) -> Self {
        Self(format!("the mesh file \"{file}\" {problem}"))
    }
}

impl<const D: usize> Body<D> {
    /// A body of a mesh, without named bones and palate.
    pub fn new(what: impl Into<String>, mesh: Mesh<D>) -> Self {
        Self { what: what.into(), mesh, ..Self::default() }
    }

    /// The number of the first muscle of this name in `mesh.muscles`; without an exact match the case is ignored.
    pub fn muscle(&self, name: &str) -> Result<usize, BodyError> {
        let any_case = || self.mesh.muscles.iter().position(|m| m.name.eq_ignore_ascii_case(name));
        self.muscles_called(name).next().or_else(any_case).ok_or_else(|| {
            let known = distinct(self.mesh.muscles.iter().map(|m| m.name.as_str()));
            let none = "it has no muscles".to_owned();
            let hint = if known.is_empty() { none } else { choice::hint(name, known) };
            BodyError(format!("there is no muscle \"{name}\" in this body; {hint}"))
        })
    }

    /// The numbers of all muscles of this name, which in a solid may be many fibres.
    pub fn muscles_called(&self, name: &str) -> impl Iterator<Item = usize> {
        self.mesh.muscles.iter().enumerate().filter(move |(_, m)| m.name == name).map(|(number, _)| number)
    }

    /// The body as a continuum ([`continuum`]): quadratic elements, muscles of finite width along their chains, bones that hold patches.
    pub fn into_continuum(self, settings: &ContinuumSettings) -> Result<Self, BodyError> {
        Origin { body: self, lines: None }.into_continuum(settings)
    }

    /// A continuum on the same linear cells with other settings; `None` if the body is not a continuum or has no [`Body::origin`].
    pub fn with_continuum(&self, settings: &ContinuumSettings) -> Option<Result<Self, BodyError>> {
        self.origin.as_ref().map(|origin| Origin::clone(origin).into_continuum(settings))
    }

    /// The nodes of the bone of this name, ascending; empty if there is no such bone.
    pub fn bone(&self, name: &str) -> &[usize] {
        self.bones.iter().find(|b| b.name == name).map_or(&[], |b| &b.nodes)
    }
}

impl<const D: usize> Origin<D> {
    fn into_continuum(self, settings: &ContinuumSettings) -> Result<Body<D>, BodyError> {
        let (mesh, replaced) = continuum::from_mesh(&self.body.mesh, self.lines.as_deref(), settings)?;
        let mut bones = self.body.bones.clone();
        for bone in &mut bones {
            let replacements = replaced.iter().filter(|(node, _)| bone.nodes.contains(node));
            bone.nodes = replacements.flat_map(|(_, nodes)| nodes.iter().copied()).collect();
            bone.nodes.sort_unstable();
        }
        Ok(Body {
            what: format!("{}, a continuum", self.body.what),
            mesh,
            bones,
            palate: self.body.palate.clone(),
            origin: Some(Arc::new(self)),
            ..Body::default()
        })
    }
}

impl Body<2> {
    /// The reference tongue (`targets/anatomy.toml`, with its palate) at a mesh spacing, m.
    pub fn tongue(spacing_m: f64) -> Result<Self, BodyError> {
        let body = Self::from_anatomy(&Anatomy::reference()?, spacing_m)?;
        let what = format!("the reference tongue at {} mm", rounded_mm(spacing_m));
        Ok(Self { what, palate: Some(tongue::palate()?), ..body })
    }

    /// The reference tongue as a continuum at a mesh spacing, m. With the default settings a ratio has an error of 0.002 at 4 mm, and of
    /// 0.01 at 8 mm.
    pub fn continuum(spacing_m: f64, settings: &ContinuumSettings) -> Result<Self, BodyError> {
        Self::tongue(spacing_m)?.into_continuum_of(&Anatomy::reference()?, settings)
    }

    /// A body that was meshed from an anatomy, as a continuum whose muscles run along the lines of the anatomy.
    pub fn into_continuum_of(
        self,
        anatomy: &Anatomy,
        settings: &ContinuumSettings,
    ) -> Result<Self, BodyError> {
        let lines: Vec<Vec<Point>> = anatomy.muscles().iter().map(|m| m.ends.to_vec()).collect();
        Origin { body: self, lines: Some(lines) }.into_continuum(settings)
    }

    /// A tongue of an anatomy at a mesh spacing, m.
    pub fn from_anatomy(anatomy: &Anatomy, spacing_m: f64) -> Result<Self, BodyError> {
        let mesh = build(anatomy, spacing_m)?;
        let bones = tongue::bones(anatomy, &mesh);
        let what = format!("a tongue at {} mm", rounded_mm(spacing_m));
        Ok(Self { what, mesh, bones, ..Self::default() })
    }
}

/// Millimetres, rounded to a nanometre to hide the rounding error of the conversion.
fn rounded_mm(metres: f64) -> f64 {
    (metres * 1e9).round() / 1e6
}
