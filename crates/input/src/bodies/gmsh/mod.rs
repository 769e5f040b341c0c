//! Bodies from Gmsh (Geuzaine and Remacle 2009, <https://gmsh.info>): `.msh` files of the formats 4.1 and
//! 2.2, text or binary, read into a [`Body`] and written from one. Physical groups have these meanings:
//!
//! | physical group | on | is |
//! |---|---|---|
//! | `tissue`, `tissue:NAME` | surfaces (in space: volumes) | the cells |
//! | `GGa` .. `HGp`, `muscle:NAME` | curves | a muscle; its lines must make one chain |
//! | `bone`, `bone:NAME` | points or curves (in space also surfaces) | nodes that do not move |
//!
//! Case does not matter, except in a NAME. Groups of other names are ignored and listed
//! ([`Content::unused`]). A scene's jaw carries `bone:mental_spine`, and its hyoid shifts `bone:hyoid`. A
//! body of triangles lies in the midsagittal plane, z = 0, with x to the back and y up; clockwise triangles
//! are reversed. A muscle may run outside the tissue if its curve is on no surface. Gmsh files have no unit,
//! so the caller must give it ([`Unit`]).
//!
//! Of elements of the second order (types 8, 9 and 11) the corners are read and the sides are taken as
//! straight: a continuum places its own nodes in their middles. Sides that are curved in the file are
//! reported ([`Content::bent`]). A continuum is written with elements of the second order.
//!
//! Bodies in space of hexahedra are read by [`read_space`], where muscles are volumes.
//!
//! The crate `mshio` (0.4.2) reads only format 4.1 and no physical names, so the reader is our own.

mod assemble;
mod chain;
mod cursor;
mod error;
mod parse;
mod review;
mod space;
mod views;
mod write;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use error::MshProblem;

use super::BodyFileError;
pub use review::{Concern, TONGUE_M, review, unit_suspicion};
pub use space::read_space;
use tongue_core::body::Body;
pub use write::write;

/// The unit of a file's coordinates.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// Metres.
    #[default]
    M,
    /// Millimetres.
    Mm,
}

impl Unit {
    /// Its length in metres.
    pub const fn metres(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Mm => 1e-3,
        }
    }
}

/// Format of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct MshFormat {
    /// `4.1` or `2.2`.
    pub version: &'static str,
    /// Whether its numbers are binary.
    pub binary: bool,
}

/// Content of a file: a body in the plane or in space.
#[derive(Debug, Clone, PartialEq)]
pub enum File {
    /// Triangles in the midsagittal plane.
    Flat(Content<2>),
    /// Tetrahedra.
    Solid(Content<3>),
}

/// A body and the format of its file.
#[derive(Debug, Clone, PartialEq)]
pub struct Content<const D: usize> {
    /// How the file is written.
    pub format: MshFormat,
    /// The body, m. Nodes are in the order of their tags, without those that no cell and no muscle uses;
    /// cells in the order of the file; the eight published muscles in the order of the tables, then others in
    /// the order of their groups.
    pub body: Body<D>,
    /// Physical groups without a meaning here.
    pub unused: Vec<Unused>,
    /// Gmsh's tag of every node.
    pub tags: Vec<u64>,
    /// Curved sides, if the file has any.
    pub bent: Option<Bent>,
}

/// Sides of elements of the second order that are curved in the file, and straight in the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bent {
    /// Number of sides.
    pub sides: usize,
    /// Largest distance of the middle of a side from the straight line between its ends, m.
    pub largest_m: f64,
}

/// A physical group that is ignored.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Unused {
    /// Dimension of its elements: 0 for points to 3 for volumes.
    pub dimension: usize,
    /// Its name.
    pub name: String,
    /// Number of its elements.
    pub elements: usize,
}

/// Reads a file. `origin` is its name in messages, usually its path.
///
/// # Errors
/// [`BodyFileError::Gmsh`] with the line (in binary files: the byte) and what to do.
pub fn read(bytes: &[u8], origin: &str, unit: Unit) -> Result<File, BodyFileError> {
    let mut cursor = cursor::Cursor::new(bytes);
    let file = parse::parse(&mut cursor).and_then(|raw| assemble::assemble(&raw, origin, unit));
    file.map_err(|located| located.into_error(origin, bytes, cursor.is_binary()))
}
