//! A body at rest for Gmsh.

use std::io::{self, Write};

use super::export::{Export, Provenance};
use tongue_core::body::{Bone, Mesh};
use tongue_input::bodies::gmsh;

/// A body at rest as a Gmsh file of format 4.1, as [`gmsh::write`] writes and [`gmsh::read`] reads it.
#[derive(Debug, Clone)]
pub struct Msh<'a, const D: usize> {
    pub mesh: &'a Mesh<D>,
    /// Each is a group.
    pub bones: &'a [Bone],
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
        write!(out, "$EndComments\n{rest}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_do_not_end_their_section_and_the_mesh_reads_back() {
        let mesh = tongue_core::body::solid::cylinder(0.01, 0.02, 1, 2);
        let text = Msh { mesh: &mesh, bones: &[] }.text(&Provenance::new("$EndComments")).unwrap();
        assert_eq!(text.matches("$EndComments").count(), 1);
        let back = gmsh::read(text.as_bytes(), "own", gmsh::Unit::M).unwrap().body.solid().unwrap();
        assert_eq!(back.mesh.nodes, mesh.nodes);
    }
}
