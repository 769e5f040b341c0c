//! Bodies from Gmsh (Geuzaine and Remacle 2009, <https://gmsh.info>): `.msh` files of the formats 4.1 and
//! 2.2, text or binary, read into a body and written from one. Physical groups have these meanings:
//!
//! | physical group | on | is |
//! |---|---|---|
//! | `tissue`, `tissue:NAME` | surfaces (in space: volumes) | the cells |
//! | `GGa` .. `HGp`, `muscle:NAME` | curves | a muscle; its lines must make one chain |
//! | `bone`, `bone:NAME` | points, curves, surfaces or volumes | nodes that do not move |
//! | `other:NAME` | anything | left out |
//!
//! Case does not matter, except in a NAME. A group of another name is an error. A scene's jaw carries `bone:mental_spine`, and its hyoid
//! shifts `bone:hyoid`. A body of triangles lies in the midsagittal plane, z = 0, with x to the back and y up; clockwise triangles are
//! reversed. A muscle may run outside the tissue if its curve is on no surface. Gmsh files have no unit,
//! so the caller must give it ([`Unit`]).
//!
//! Of elements of the second order (types 8, 9 and 11) the corners are read and the sides are taken as
//! straight: a continuum places its own nodes in their middles. Sides that are curved in the file are
//! reported, as is all else that a user should look at ([`Content::concerns`]). A continuum is written with elements of the second order.
//!
//! Bodies in space of hexahedra are read by [`read_space`], where muscles are volumes.
//!
//! The crate `mshio` (0.4.2) reads only format 4.1 and no physical names, so the reader is our own.

mod assemble;
mod chain;
mod cursor;
mod fibres;
mod groups;
mod parse;
mod review;
mod space;
mod write;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::AnyBody;
pub(super) use review::{review, review_of_head};
use tongue_core::body::{Body, BodyError};
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
    pub const fn metres(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Mm => 1e-3,
        }
    }
}

/// A body as it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Content {
    /// The body, m. Nodes are in the order of their tags, without those that no cell and no muscle uses;
    /// cells in the order of the file; the eight published muscles in the order of the tables, then others in
    /// the order of their groups.
    pub body: AnyBody,
    pub tags: Vec<u64>,
    pub concerns: Vec<String>,
}

/// Reads a body of triangles or tetrahedra. `origin` is its name in messages, usually its path.
pub fn read(bytes: &[u8], origin: &str, unit: Unit) -> Result<Content, BodyError> {
    parsed(bytes, origin, |raw| assemble::assemble(raw, origin, unit))
}

/// Reads a body in space of hexahedra, as [`read`].
pub fn read_space(bytes: &[u8], origin: &str, unit: Unit) -> Result<Body<3>, BodyError> {
    parsed(bytes, origin, |raw| space::assemble(raw, origin, unit))
}

fn parsed<T>(
    bytes: &[u8],
    origin: &str,
    assemble: impl FnOnce(&parse::Raw) -> cursor::Parsed<T>,
) -> Result<T, BodyError> {
    let mut cursor = cursor::Cursor::new(bytes);
    let assembled = parse::parse(&mut cursor).and_then(|raw| assemble(&raw));
    assembled.map_err(|located| located.into_error(origin, bytes, cursor.is_binary()))
}
