//! Bodies from Gmsh (Geuzaine and Remacle 2009, <https://gmsh.info>): `.msh` files of the formats 4.1 and 2.2, text or binary, read into a
//! body and written from one. `docs/guide.md` lists the physical groups; `tissue:NAME` is tissue, too, bones may be on anything, and the
//! lines of a muscle make one chain.
//!
//! Case does not matter, except in a NAME. A group of another name is an error. In a scene the jaw moves `bone:mental_spine` and the hyoid
//! `bone:hyoid`. A body of triangles lies in the midsagittal plane, z = 0, with x to the back and y up; clockwise triangles are reversed. A
//! muscle may run outside the tissue if its curve is on no surface. Gmsh files have no unit, so the caller gives it ([`Unit`]).
//!
//! Of elements of the second order (types 8, 9 and 11) only the corners are read, so that sides are straight; a continuum places nodes of
//! its own in the middles of sides. A continuum is written with elements of the second order.
//!
//! Bodies in space of hexahedra, whose muscles are volumes, are read by [`read_space`].
//!
//! The crate `mshio` (0.4.2) reads only format 4.1 and no physical names, which is why this reader exists.

mod assemble;
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
pub(super) use review::review;
pub use review::review_of_head;
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

#[derive(Debug, Clone, PartialEq)]
pub struct Content {
    /// In m. Nodes are in the order of their tags, without those that no cell and no muscle uses; cells are in the order of the file; the
    /// eight published muscles come first, in the order of the tables, then others in the order of their groups.
    pub body: AnyBody,
    pub tags: Vec<u64>,
    pub concerns: Vec<String>,
}

/// Reads a body of triangles or tetrahedra. `origin` is its name in messages, usually its path.
pub fn read(bytes: &[u8], origin: &str, unit: Unit) -> Result<Content, BodyError> {
    parsed(bytes, origin, |raw| assemble::assemble(raw, origin, unit))
}

/// Reads a body in space of hexahedra; `origin` is its name in messages.
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
    assembled.map_err(|cursor::Located { at, problem }| {
        let place = match at {
            None => String::new(),
            Some(at) if cursor.is_binary => format!(" (byte {at})"),
            Some(at) => format!(":{}", 1 + bytes.iter().take(at).filter(|b| **b == b'\n').count()),
        };
        BodyError(format!("{origin}{place}: {problem}"))
    })
}
