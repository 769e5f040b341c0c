//! A deformed body for Gmsh: the mesh at rest, and what is known of the deformed shape as views on it.

use std::fmt::Write as _;

use nalgebra::SVector;

use super::ReportError;
use super::fields::{DISPLACEMENT, Fields, STRETCH};
use crate::body::{Mesh, gmsh};

/// One shape of the body as a Gmsh file of format 4.1: the mesh at rest as [`gmsh::write`] writes it, which [`gmsh::read`]
/// reads, with one group `bone`, and the views `displacement_m` (of nodes), `area_ratio` (in space `volume_ratio`), `stretch` and `tension_n_per_m` (in
/// space `tension_n`), with a value for every element as in [`super::vtu()`]: readers like meshio take a view of some
/// elements for one of all.
///
/// # Errors
/// As [`super::vtu()`].
pub fn msh<const D: usize>(
    mesh: &Mesh<D>,
    positions: &[SVector<f64, D>],
    tensions: &[f64],
) -> Result<String, ReportError> {
    let fields = Fields::new(mesh, positions, tensions)?;
    let mut out = gmsh::write(mesh, &[]);
    let moved = fields.displacements().map(|d| format!("{} {} {}", d[0], d[1], d.get(2).unwrap_or(&0.0)));
    view(&mut out, "NodeData", DISPLACEMENT, 3, moved.collect());
    // Elements are the cells, the lines of the muscles and the points of the bones.
    let (cells, lines, points) = (mesh.cells.len(), fields.stretches().len(), mesh.fixed.len());
    let mut of_elements = |name: &str, values: Vec<f64>| {
        view(&mut out, "ElementData", name, 1, values.iter().map(f64::to_string).collect());
    };
    let ratios = fields.cell_ratios().chain(vec![1.0; lines + points]).collect();
    of_elements(fields.cell_ratio_name(), ratios);
    of_elements(STRETCH, [vec![1.0; cells], fields.stretches(), vec![1.0; points]].concat());
    of_elements(fields.tension_name(), [vec![0.0; cells], fields.tensions(), vec![0.0; points]].concat());
    Ok(out)
}

/// A view: a value for each of the nodes or elements, which are numbered from 1 on.
fn view(out: &mut String, section: &str, name: &str, components: usize, values: Vec<String>) {
    // One word: the name. One real number: the time. Three whole ones: step, components, values.
    let _ = writeln!(out, "${section}\n1\n\"{name}\"\n1\n0\n3\n0\n{components}\n{}", values.len());
    for (number, value) in (1..).zip(&values) {
        let _ = writeln!(out, "{number} {value}");
    }
    let _ = writeln!(out, "$End{section}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_follow_the_mesh_and_number_what_they_are_of() {
        let mesh = crate::body::solid::cylinder(0.01, 0.02, 1, 2);
        let tensions = vec![0.25; mesh.muscles.len()];
        let text = msh(&mesh, &mesh.nodes, &tensions).unwrap();
        let gmsh::File::Solid(back) = gmsh::read(text.as_bytes(), "own", gmsh::Unit::M).unwrap() else {
            panic!("a solid")
        };
        assert_eq!(back.body.mesh.nodes, mesh.nodes);
        let view = text.split("\"tension_n\"\n").nth(1).unwrap();
        let lines: usize = mesh.muscles.iter().map(|m| m.nodes.len() - 1).sum();
        let (cells, points) = (mesh.cells.len(), mesh.fixed.len());
        let wanted = format!("1\n0\n3\n0\n1\n{}\n1 0\n", cells + lines + points);
        assert!(view.starts_with(&wanted), "{}", &view[..60]);
        assert!(view.contains(&format!("\n{cells} 0\n{} 0.25\n", cells + 1)));
        assert!(view.contains(&format!("\n{} 0.25\n{} 0\n", cells + lines, cells + lines + 1)));
        assert_eq!(text.matches("Data\n").count(), 2 * 4);
        assert!(matches!(msh(&mesh, &mesh.nodes, &[]), Err(ReportError::Number { .. })));
    }
}
