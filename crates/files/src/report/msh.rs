//! A body for Gmsh: the mesh at rest, and results of a deformed shape as views on it.

use std::io::{self, Write};

use nalgebra::SVector;

use super::ReportError;
use super::export::{Export, Provenance};
use super::fields::{DISPLACEMENT, Fields};
use tongue_core::body::{Bone, Mesh};
use tongue_core::material::Stress;
use tongue_input::bodies::gmsh;

/// A body as a Gmsh file of format 4.1: the mesh at rest as [`gmsh::write`] writes it, which [`gmsh::read`]
/// reads.
///
/// A deformed shape has the views `displacement_m` (of nodes), `area_ratio` (in space `volume_ratio`),
/// `stretch` and `tension_n_per_m` (in space `tension_n`), with a value for every element as in
/// [`super::Vtu`]: readers like meshio take a view of some elements for one of all.
#[derive(Debug, Clone)]
pub struct Msh<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    bones: &'a [Bone],
    fields: Option<Fields<'a, D>>,
}

impl<'a, const D: usize> Msh<'a, D> {
    /// The mesh alone, with a group for each bone.
    pub fn at_rest(mesh: &'a Mesh<D>, bones: &'a [Bone]) -> Self {
        Self { mesh, bones, fields: None }
    }

    /// The mesh with one group `bone`, and the shape of these positions (m) and tensions (N; in the plane
    /// per metre of thickness).
    pub fn deformed(
        mesh: &'a Mesh<D>,
        positions: &'a [SVector<f64, D>],
        tensions: &'a [f64],
    ) -> Result<Self, ReportError> {
        Ok(Self { mesh, bones: &[], fields: Some(Fields::new(mesh, positions, tensions)?) })
    }

    /// As [`super::Vtu::with_stresses`].
    pub fn with_stresses(mut self, stresses: Vec<Stress<D>>) -> Self {
        if let Some(fields) = &mut self.fields {
            fields.stresses = stresses;
        }
        self
    }
}

impl<const D: usize> Export for Msh<'_, D> {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        // Readers recognise the format by its first section.
        let mesh = gmsh::write(self.mesh, self.bones);
        let (format, rest) = mesh.split_at(mesh.find("$PhysicalNames").unwrap_or(0));
        writeln!(out, "{format}$Comments")?;
        for (name, value) in by.entries() {
            // Some readers find the end marker of the section anywhere in a line.
            writeln!(out, "tongue-fit {name}: {}", value.replace("$End", "$ End"))?;
        }
        write!(out, "$EndComments\n{rest}")?;
        let Some(fields) = &self.fields else { return Ok(()) };
        let moved = fields.displacements().map(|d| format!("{} {} {}", d[0], d[1], d.get(2).unwrap_or(&0.0)));
        view(out, "NodeData", DISPLACEMENT, 3, moved.collect())?;
        // Elements are the cells, the lines of the muscles and the points of the bones.
        for a in fields.arrays() {
            let points = vec![a.elsewhere.to_owned(); self.mesh.fixed.len()];
            view(out, "ElementData", a.name, a.components, [a.cells, a.lines, points].concat())?;
        }
        Ok(())
    }
}

/// A view: a value for each of the nodes or elements, numbered from 1.
fn view(
    out: &mut dyn Write,
    section: &str,
    name: &str,
    components: usize,
    values: Vec<String>,
) -> io::Result<()> {
    // One string (the name), one real number (the time), three integers (step, components, number of
    // values).
    writeln!(out, "${section}\n1\n\"{name}\"\n1\n0\n3\n0\n{components}\n{}", values.len())?;
    for (number, value) in (1..).zip(&values) {
        writeln!(out, "{number} {value}")?;
    }
    writeln!(out, "$End{section}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_follow_the_mesh_and_number_what_they_are_of() {
        let mesh = tongue_core::body::solid::cylinder(0.01, 0.02, 1, 2);
        let tensions = vec![0.25; mesh.muscles.len()];
        let text = Msh::deformed(&mesh, &mesh.nodes, &tensions)
            .unwrap()
            .text(&Provenance::new("$EndComments"))
            .unwrap();
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
        assert!(matches!(Msh::deformed(&mesh, &mesh.nodes, &[]), Err(ReportError::Number { .. })));
    }
}
