//! A body of your own: an outline and muscle lines in millimetres, with muscles of any names, is meshed,
//! saved for Gmsh and solved. (`AnyBody::read(path, Unit::Mm)?.flat()?` reads a mesh of Gmsh.)
//!
//!     cargo run --example own_body [FOLDER]
#![allow(clippy::print_stdout, reason = "a program says what it found")]

use std::env;
use std::error::Error;

use tongue_fit::prelude::*;
use tongue_fit::report::Msh;

/// A smaller tongue with three muscles: one from the chin, one from the hyoid, one intrinsic. The outline is a closed smooth curve.
const ANATOMY: &str = "
outline = [
  [0, 0], [-3, 10], [-8, 20], [-9, 25], [-4, 31], [8, 36], [22, 39], [31, 34], [36, 25], [37, 13], [34, 3], [30, -3],
  [18, -2],
]
[muscles] # straight lines from end to end
genioglossus = [[0, 0], [8, 36]]
hyoglossus = [[30, -3], [24, 25]]
longitudinalis = [[28, 28], [-4, 26]]
[bones] # points that do not move
chin = [[0, 0]]
hyoid = [[30, -3]]
";

fn main() -> Result<(), Box<dyn Error>> {
    let folder = env::args().nth(1).unwrap_or_else(|| "target/own_body".into());
    let anatomy = Anatomy::from_toml(ANATOMY, "my anatomy")?;
    let body = Body::from_anatomy(&anatomy, 4.5 * MM)?;
    println!("{}: {} nodes, {} triangles", body.what, body.mesh.nodes.len(), body.mesh.cells.len());

    // A misspelt name is reported: there is no muscle "hyoglosus" in this body; did you mean "hyoglossus"?
    if let Err(error) = Assembly::new(&Model::default(), &body, ["hyoglosus"]) {
        println!("{error}");
    }

    let model = Assembly::new(&Model::default(), &body, ["genioglossus", "longitudinalis"])?;
    let mut solver = model.solver();
    for tension in [0.0, 5.0, 10.0, 20.0] {
        // The branch from rest is followed, so that the shape is the one to which growing tensions lead.
        let shape = solver.follow_from_rest(&[("genioglossus", 10.0), ("longitudinalis", tension)])?;
        println!(
            "longitudinalis {tension:4.1} N per metre: {:.3} of its length, genioglossus {:.3}, hyoglossus {:.3}{}",
            shape.stretch("longitudinalis")?,
            shape.stretch("genioglossus")?,
            shape.stretch("hyoglossus")?,
            if shape.is_converged() && shape.is_traced() { "" } else { " (do not trust this)" },
        );
    }

    let shape = solver.equilibrium(&[("genioglossus", 10.0), ("longitudinalis", 10.0)])?;
    let (picture, mesh) =
        (shape.picture("A tongue of my own")?, Msh { mesh: &body.mesh, bones: &body.bones });
    report::write(&folder, "own_body", &[("tongue.svg", &picture), ("tongue.msh", &mesh)])?;
    Ok(())
}
