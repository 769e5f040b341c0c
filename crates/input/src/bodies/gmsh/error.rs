//! Errors of reading Gmsh files: what is wrong, where, and what to do.

use tongue_core::body::{MeshFault, SpaceFault};

use crate::bodies::{BodyFileError, FilePlace};

/// What is wrong with a Gmsh file. Nodes and elements are named by their Gmsh tags.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MshProblem {
    #[error("this is not a Gmsh mesh: it does not begin with $MeshFormat; save it as .msh (gmsh my.geo -2)")]
    NotGmsh,
    #[error(
        "the format is {found}; 4.1 and 2.2 are read: save it with -format msh41, or with Mesh.MshFileVersion = 4.1"
    )]
    Version { found: String },
    #[error(
        "numbers have {found} bytes; 8 are read: save it with -format msh41 by Gmsh on a 64-bit computer"
    )]
    DataSize { found: String },
    #[error("the byte order is neither big-endian nor little-endian; save the file again")]
    ByteOrder,
    #[error("the file ends where {what} was expected: it was cut off; save it again")]
    Ended { what: String },
    #[error("{what} is not UTF-8 text; save the file again")]
    NotText { what: String },
    #[error(
        "\"{found}\" stands where {what} was expected; correct it, or save the file again (are there as many \
         entries as the section announces?)"
    )]
    NotANumber { what: String, found: String },
    #[error("\"{found}\" stands where a section (like $Nodes) was expected; save the file again")]
    NoSection { found: String },
    #[error(
        "\"{found}\" stands where $End{section} was expected: the section has more entries than it announces; \
         save the file again"
    )]
    NoEnd { section: &'static str, found: String },
    #[error(
        "there is no section ${section}; mesh the model before it is saved (gmsh my.geo -2, or -3 in space)"
    )]
    NoSuchSection { section: &'static str },
    #[error("the section ${section} comes twice; keep one")]
    SectionTwice { section: &'static str },
    #[error("the mesh is partitioned; save it whole (Mesh.NbPartitions = 0)")]
    Partitioned,
    #[error("physical group without dimension, number and quoted name, like `1 2 \"GGa\"`: \"{found}\"")]
    PhysicalName { found: String },
    #[error("{what} {number} is out of range; save the file again")]
    OutOfRange { what: &'static str, number: i64 },
    #[error("a coordinate of node {node} is not finite; correct the model and mesh it again")]
    NotFinite { node: u64 },
    #[error("node {node} is defined twice; keep one")]
    NodeTwice { node: u64 },
    #[error("element {element} refers to node {node}, which is not in $Nodes; save the file again")]
    NoSuchNode { element: u64, node: u64 },
    #[error("element {element} is a {what}; {remedy}")]
    Element { element: u64, what: String, remedy: &'static str },
    #[error(
        "no triangle or tetrahedron is in a physical group called \"tissue\" ({found}); add \
         Physical Surface(\"tissue\") = {{...}}; in space Physical Volume(\"tissue\")"
    )]
    NoTissue { found: String },
    #[error(
        "node {node} lies at z = {z}; a body of triangles lies in the midsagittal plane, z = 0 (x to the back, y up): \
         turn or shift the model, or mesh a volume of tetrahedra (gmsh -3)"
    )]
    OutOfPlane { node: u64, z: f64 },
    #[error("element {element} (nodes {nodes:?}) has no area or volume; mesh again, or move the nodes apart")]
    Degenerate { element: u64, nodes: Vec<u64> },
    #[error(
        "nodes {a} and {b} lie at the same place but are joined; merge them (gmsh: Coherence Mesh) and mesh again"
    )]
    SamePlace { a: u64, b: u64 },
    #[error(
        "muscle {name} is given twice, as \"{first}\" and as \"{second}\"; join them to one physical curve"
    )]
    MuscleTwice { name: String, first: String, second: String },
    #[error(
        "muscle {name} branches at node {node}, where {lines} of its lines meet; a muscle is one chain: leave out the \
         curves that branch off"
    )]
    Branch { name: String, node: u64, lines: usize },
    #[error(
        "muscle {name} has gaps: it ends at the nodes {ends:?}; a muscle is one chain with two ends: add the curves \
         between, or make two groups"
    )]
    Gap { name: String, ends: Vec<u64> },
    #[error(
        "muscle {name} runs in a circle through node {node}; a muscle is one chain with two ends: leave out one curve"
    )]
    Loop { name: String, node: u64 },
    #[error(
        "muscle {name} shares no node with the tissue, so it would pull on nothing; embed its curve in the surface \
         (Curve {{...}} In Surface {{...}}) or fragment both, and mesh again"
    )]
    Apart { name: String },
    #[error(
        "node {node} of muscle {name} lies in element {element} without being one of its nodes, so the muscle would \
         slide through the tissue; embed its curve in the surface (Curve {{...}} In Surface {{...}}) or fragment both, \
         and mesh again"
    )]
    NotEmbedded { name: String, node: u64, element: u64 },
    #[error(
        "bone \"{name}\" holds node {node}, which belongs to no triangle, tetrahedron or muscle; take a point of them"
    )]
    BoneHoldsNothing { name: String, node: u64 },
    #[error(
        "no hexahedron is in a physical group called \"tissue\" ({found}); add Physical Volume(\"tissue\") = {{...}} of all volumes, \
         which must be meshed with hexahedra (Transfinite Volume, Recombine)"
    )]
    NoHexahedra { found: String },
    #[error(
        "the physical group \"{name}\" of {on} has no meaning here; {hint}; rename it, or call it \"other:{name}\" to leave it out"
    )]
    UnknownGroup { name: String, on: &'static str, hint: String },
    #[error("the physical group \"{name}\" has no elements; mesh what it is of, or remove the group")]
    EmptyGroup { name: String },
    #[error(
        "no bone holds the body; add Physical Point(\"bone\") = {{...}}, or Curve or Surface, of what does not move"
    )]
    NoBone,
    #[error(
        "the part with element {element} is joined to no bone, so it could move freely: join it to the rest (gmsh: Coherence), or give it one"
    )]
    Loose { element: u64 },
    #[error(
        "hexahedron {element} is turned inside out or flat at one of its points; repair the mesh, or reverse the order of its corners"
    )]
    InvertedHexahedron { element: u64 },
    #[error(
        "\"muscle:{found}\": name the muscle and its strength with a unit, like `muscle:GGP_L 18.5 N` or `muscle:GGP_L 49.8 kPa`"
    )]
    Strength { found: String },
    #[error(
        "muscle {name} has no other side: no group is called \"muscle:{other} ..\"; add it, or give the muscle a name without a side"
    )]
    NoOtherSide { name: String, other: String },
    #[error(
        "fibres are given of {name}, but no volume is called \"muscle:{name} ..\"; correct the name, or add the volume"
    )]
    NoMuscleOfFibre { name: String },
    #[error(
        "a curve \"fibre:{name}\" lies outside the tissue at node {node}, where it must run from a node of the tissue to one of a bone; let it \
         end inside the tissue, or give it a node of the mesh where it leaves and one on bone:NAME where it ends"
    )]
    FibreLeaves { name: String, node: u64 },
    #[error(
        "muscle {name} has no directions; add a view \"fibre:{name}\" of vectors, or curves called \"fibre:{name}\""
    )]
    NoFibres { name: String },
    #[error(
        "muscle {name} has a force, but no curves \"fibre:{name}\" whose length makes a stress of it; add them, or give the stress in kPa"
    )]
    NoFibreForForce { name: String },
    #[error(
        "the view \"fibre:{name}\" has no direction in element {element}, or one of length zero; give every element of the muscle one"
    )]
    NoDirection { name: String, element: u64 },
    #[error("{0}")]
    Space(#[from] SpaceFault),
    #[error("{0}")]
    Fault(#[from] MeshFault),
}

/// A problem and its byte, if there is one.
#[derive(Debug)]
pub(super) struct Located {
    pub at: Option<usize>,
    pub problem: MshProblem,
}

impl Located {
    pub fn at(at: usize, problem: MshProblem) -> Self {
        Self { at: Some(at), problem }
    }

    pub fn whole(problem: MshProblem) -> Self {
        Self { at: None, problem }
    }

    /// The error for a file of these bytes.
    pub fn into_error(self, origin: &str, bytes: &[u8], binary: bool) -> BodyFileError {
        let place = match self.at {
            None => FilePlace::Whole,
            Some(at) if binary => FilePlace::Byte(at),
            Some(at) => FilePlace::Line(1 + bytes.iter().take(at).filter(|b| **b == b'\n').count()),
        };
        BodyFileError::Gmsh { origin: origin.to_owned(), place, problem: self.problem }
    }
}

pub(super) type Found<T> = Result<T, Located>;
