//! Bodies from Gmsh (Geuzaine and Remacle 2009, <https://gmsh.info>): `.msh` files of the formats 4.1 and 2.2, text or
//! binary, read into a [`Body`] and written from one. Physical groups say what is what:
//!
//! | physical group | on | is |
//! |---|---|---|
//! | `tissue`, `tissue:NAME` | surfaces (in space: volumes) | the cells |
//! | `GGa` .. `HGp`, `muscle:NAME` | curves | a muscle; its lines must make one chain |
//! | `bone`, `bone:NAME` | points or curves (in space also surfaces) | nodes that do not move |
//!
//! Capitals do not matter, except in a NAME. Groups of other names are left out and listed ([`Content::unused`]).
//! `bone:mental_spine` is what a scene's jaw carries and `bone:hyoid` what its hyoid shifts. A body of triangles lies in the
//! midsagittal plane, z = 0, x to the back and y up; triangles are turned counter-clockwise where they are not. A muscle may
//! run outside the tissue, as far as its curve is on no surface. Gmsh knows no unit, so the reader must be told ([`Unit`]).
//!
//! Of elements of the second order (types 8, 9 and 11) the corners are read, with straight sides between them: a continuum puts its own
//! nodes in their middles. Sides that are curved in the file are told ([`Content::bent`]). A continuum is written with such elements.
//!
//! The crate `mshio` (0.4.2) reads 4.1 alone and no physical names, so the reader is our own: it needs simplices only.

mod assemble;
mod chain;
mod cursor;
mod error;
mod parse;
mod review;
mod write;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use error::{GmshError, Place, Problem};
pub use review::{Concern, TONGUE_M, review, unit_suspicion};
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
    /// How many metres it is.
    pub const fn metres(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Mm => 1e-3,
        }
    }
}

/// How a file is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Format {
    /// `4.1` or `2.2`.
    pub version: &'static str,
    /// Whether its numbers are in binary.
    pub binary: bool,
}

/// What a file holds: a body in the plane or in space.
#[derive(Debug, Clone, PartialEq)]
pub enum File {
    /// Of triangles, in the midsagittal plane.
    Flat(Content<2>),
    /// Of tetrahedra.
    Solid(Content<3>),
}

/// A body and how its file has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Content<const D: usize> {
    /// How the file is written.
    pub format: Format,
    /// The body, m. Nodes are in the order of their tags, without those that no cell and no muscle uses; cells in the order of
    /// the file; the eight muscles in the order of the tables, others after them in the order of their groups.
    pub body: Body<D>,
    /// Physical groups that stand for nothing here.
    pub unused: Vec<Unused>,
    /// Gmsh's tag of every node.
    pub tags: Vec<u64>,
    /// What became of curved sides, where the file has any.
    pub bent: Option<Bent>,
}

/// Sides of elements of the second order that are curved in the file, and straight in the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bent {
    /// How many.
    pub sides: usize,
    /// How far at most the middle of one is off the straight line between its ends, m.
    pub largest_m: f64,
}

/// A physical group that is left out.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Unused {
    /// Of its elements: 0 for points to 3 for volumes.
    pub dimension: usize,
    /// Its name.
    pub name: String,
    /// Number of its elements.
    pub elements: usize,
}

/// Reads a file. `origin` is what messages call it, usually its path.
///
/// # Errors
/// [`GmshError`]: what cannot be read or is no body, with the line (in binary files: the byte) and what to do.
pub fn read(bytes: &[u8], origin: &str, unit: Unit) -> Result<File, GmshError> {
    let mut cursor = cursor::Cursor::new(bytes);
    let file = parse::parse(&mut cursor).and_then(|raw| assemble::assemble(&raw, origin, unit));
    file.map_err(|located| located.into_error(origin, bytes, cursor.is_binary()))
}
