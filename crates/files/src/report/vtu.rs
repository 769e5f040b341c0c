//! Shapes for ParaView, as VTK XML files (ASCII, unstructured grid) with a collection of their times, and a body at rest for Gmsh.

use std::io::{self, Write};

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::export::{Export, Provenance};
use super::simulation::volume;
use super::svg::{check, escape_xml};
use super::{ReportError, joined};
use tongue_core::body::space::mean_axis;
use tongue_core::body::{Body, Bone, Mesh};
use tongue_core::geometry::{hexahedron, simplex};
use tongue_core::material::Stress;
use tongue_input::bodies::gmsh;

/// VTK's types of cells: lines; triangles and tetrahedra, linear and quadratic; hexahedra.
const LINE: u8 = 3;
const CELL: [u8; 2] = [5, 10];
const QUADRATIC: [u8; 2] = [22, 24];
const HEXAHEDRON: u8 = 12;

/// One shape of the body as a VTU file: the triangles (in space tetrahedra, in a continuum quadratic ones), then the connections of the
/// muscles as lines, one muscle after another.
///
/// Points have the given positions (m) and `displacement_m` from rest. Cells have `muscle` (its index in `mesh.muscles`; -1 for tissue),
/// `area_ratio` (in space `volume_ratio`; over that at rest, 1 for lines), `stretch` (of a line, over its length at rest; 1 for tissue) and
/// `tension_n_per_m` (N per metre of thickness; in space `tension_n`, N; 0 for tissue).
///
/// A body of hexahedra has only these, each with `volume_ratio`, `muscle` (the most active one through it; -1 if there is none), its
/// `activation`, and at the centre the present direction `fibre` and the `stretch` of its fibres.
#[derive(Debug, Clone)]
pub struct Vtu<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    positions: &'a [SVector<f64, D>],
    /// Tensions of the muscles, N (2D: N/m), or activations in a body of hexahedra.
    tensions: &'a [f64],
    stresses: Vec<Stress<D>>,
    /// The body, if it is of hexahedra.
    hexahedral: Option<&'a Body<D>>,
}

/// Name and number of components of an array, and its values: of the cells of a grid, then of the connections of the muscles, one muscle
/// after another. Those of `muscle` are integers.
type Array = (&'static str, usize, Vec<String>);

impl<'a, const D: usize> Vtu<'a, D> {
    /// A shape with the positions of all nodes, m, and the tensions of all muscles, N (in the plane per metre of thickness).
    pub fn new(
        mesh: &'a Mesh<D>,
        positions: &'a [SVector<f64, D>],
        tensions: &'a [f64],
    ) -> Result<Self, ReportError> {
        check(mesh, positions, tensions)?;
        Ok(Self { mesh, positions, tensions, stresses: Vec::new(), hexahedral: None })
    }

    /// A shape of a body; `pulls` are tensions, or activations of a body of hexahedra.
    pub fn of(
        body: &'a Body<D>,
        positions: &'a [SVector<f64, D>],
        pulls: &'a [f64],
    ) -> Result<Self, ReportError> {
        let hexahedral = (!body.mesh.hexahedra.is_empty()).then_some(body);
        Ok(Self { hexahedral, ..Self::new(&body.mesh, positions, pulls)? })
    }

    /// Adds strain and stress of every cell, which are known in a continuum ([`tongue_core::system::System::stresses`]): `strain`
    /// (Green's), `cauchy_stress_pa`, `von_mises_pa`, `pressure_pa`, and `fibre_stress_pa` along the muscle in the cell, 0 if there is
    /// none.
    pub fn with_stresses(mut self, stresses: Vec<Stress<D>>) -> Self {
        self.stresses = stresses;
        self
    }

    /// Values of cells and lines. Cells are the elements of a continuum, with means over their linear parts, or otherwise those of the
    /// mesh. Tensors are 3 x 3, row by row, in the plane with the components across it. The pressure is minus a third of the trace of
    /// Cauchy's stress.
    fn arrays(&self) -> Vec<Array> {
        let (mesh, lines) = (self.mesh, self.pairs().count());
        let count = mesh.elements().count();
        let parts = (mesh.cells.len() / count.max(1)).max(1);
        let ratios = mesh.cells.iter().map(|cell| {
            simplex::measure(&simplex::corners(self.positions, cell))
                / simplex::measure(&simplex::corners(&mesh.nodes, cell))
        });
        let ratios: Vec<f64> = ratios.collect();
        // The parts have equal size at rest.
        let means = ratios.chunks(parts).map(|part| part.iter().sum::<f64>() / part.len() as f64);
        let length = |x: &[SVector<f64, D>], pair: &[usize]| (x[pair[1]] - x[pair[0]]).norm();
        let stretches =
            self.pairs().map(|(_, pair)| length(self.positions, pair) / length(&mesh.nodes, pair));
        let tensions = self.pairs().map(|(muscle, _)| self.tensions[muscle]);
        let [ratio, tension] =
            if D == 2 { ["area_ratio", "tension_n_per_m"] } else { ["volume_ratio", "tension_n"] };
        let repeat = |value: &str, count| vec![value.to_owned(); count];
        let mut all = vec![
            (ratio, 1, [texts(means), repeat("1", lines)].concat()),
            ("stretch", 1, [repeat("1", count), texts(stretches)].concat()),
            (tension, 1, [repeat("0", count), texts(tensions)].concat()),
        ];
        if self.stresses.len() == mesh.cells.len() && !self.stresses.is_empty() {
            let stresses: Vec<Stress<D>> = self.stresses.chunks(parts).map(Stress::mean).collect();
            let fibres = mesh.continuum.iter().flat_map(|c| c.fibres(self.positions)).step_by(parts);
            let along = stresses.iter().zip(fibres).map(|(s, fibre)| fibre.map_or(0.0, |f| s.along(&f)));
            let tensors = |of: fn(&Stress<D>) -> String| stresses.iter().map(of).collect();
            let of_cells = [
                ("strain", 9, tensors(|s| tensor(&s.strain, 0.0))),
                ("cauchy_stress_pa", 9, tensors(|s| tensor(&s.cauchy_pa, s.across_pa))),
                ("von_mises_pa", 1, texts(stresses.iter().map(|s| s.von_mises_pa))),
                ("pressure_pa", 1, texts(stresses.iter().map(Stress::pressure_pa))),
                ("fibre_stress_pa", 1, texts(along)),
            ];
            all.extend(of_cells.map(|(name, components, values)| {
                let none = vec!["0"; components].join(" ");
                (name, components, [values, repeat(&none, lines)].concat())
            }));
        }
        let of_lines = self.pairs().map(|(muscle, _)| muscle.to_string()).collect();
        all.push(("muscle", 1, [repeat("-1", count), of_lines].concat()));
        all
    }

    fn arrays_of_hexahedra(&self, body: &Body<D>) -> Vec<Array> {
        let mesh = self.mesh;
        let ratios = mesh.hexahedra.iter().map(|c| volume(self.positions, c) / volume(&mesh.nodes, c));
        let muscles = most_active(body, self.tensions);
        // The muscle, and the direction and the stretch of its fibres at the centre.
        let fibres = muscles.iter().enumerate().map(|(element, muscle)| {
            let (direction, stretch) = fibre(body, self.positions, element, (*muscle)?)?;
            Some(((*muscle)?, direction, stretch))
        });
        let fibres: Vec<Option<(usize, Vector3<f64>, f64)>> = fibres.collect();
        let active = fibres.iter().map(|f| f.map_or(0.0, |(muscle, ..)| self.tensions[muscle]));
        let stretches = fibres.iter().map(|f| f.map_or(1.0, |(.., stretch)| stretch));
        let directions = fibres.iter().map(|f| point(&f.map_or_else(Vector3::zeros, |(_, along, _)| along)));
        let muscles = muscles.iter().map(|m| m.map_or_else(|| "-1".to_owned(), |m| m.to_string()));
        vec![
            ("volume_ratio", 1, texts(ratios)),
            ("activation", 1, texts(active)),
            ("stretch", 1, texts(stretches)),
            ("fibre", 3, directions.collect()),
            ("muscle", 1, muscles.collect()),
        ]
    }

    /// The connections of the muscles, one muscle after another, each with the index of its muscle.
    fn pairs(&self) -> impl Iterator<Item = (usize, &'a [usize])> {
        let muscles = self.mesh.muscles.iter().enumerate();
        muscles.flat_map(|(number, m)| m.nodes.windows(2).map(move |pair| (number, pair)))
    }
}

fn texts(values: impl IntoIterator<Item = f64>) -> Vec<String> {
    values.into_iter().map(|v| v.to_string()).collect()
}

/// The nine components in space, row by row; `across` is the component normal to the plane of a tensor in the plane.
fn tensor<const D: usize>(of: &SMatrix<f64, D, D>, across: f64) -> String {
    let components = (0..9).map(|n| match (n / 3, n % 3) {
        (i, j) if i < D && j < D => of[(i, j)],
        (2, 2) => across,
        _ => 0.0,
    });
    joined(components, " ")
}

impl<const D: usize> Export for Vtu<'_, D> {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        let mesh = self.mesh;
        let (cells, arrays): (Vec<_>, _) = if let Some(body) = self.hexahedral {
            let cells = mesh.hexahedra.iter().map(|c| (c.as_slice(), HEXAHEDRON));
            (cells.collect(), self.arrays_of_hexahedra(body))
        } else {
            let kind = (if mesh.continuum.is_some() { QUADRATIC } else { CELL })[D - 2];
            let lines = self.pairs().map(|(_, pair)| (pair, LINE));
            (mesh.elements().map(|cell| (cell, kind)).chain(lines).collect(), self.arrays())
        };
        let (rest, positions) = (&mesh.nodes, self.positions);
        begin(out, "UnstructuredGrid", by)?;
        let (nodes, count) = (rest.len(), cells.len());
        let piece = format!("<Piece NumberOfPoints=\"{nodes}\" NumberOfCells=\"{count}\">");
        writeln!(out, "<UnstructuredGrid>\n{piece}\n<Points>")?;
        array(out, "position", "Float64", 3, positions.iter().map(point))?;
        out.write_all(b"</Points>\n<Cells>\n")?;
        array(out, "connectivity", "Int64", 1, cells.iter().map(|(c, _)| joined(*c, " ")))?;
        let ends = cells.iter().scan(0, |end, (c, _)| {
            *end += c.len();
            Some(*end)
        });
        array(out, "offsets", "Int64", 1, ends)?;
        array(out, "types", "UInt8", 1, cells.iter().map(|(_, kind)| kind))?;
        writeln!(out, "</Cells>\n<PointData Vectors=\"displacement_m\">")?;
        let moved = positions.iter().zip(rest).map(|(x, rest)| point(&(x - rest)));
        array(out, "displacement_m", "Float64", 3, moved)?;
        // ParaView shows the first array.
        writeln!(out, "</PointData>\n<CellData Scalars=\"{}\">", arrays[0].0)?;
        for (name, components, values) in arrays {
            let kind = if name == "muscle" { "Int64" } else { "Float64" };
            array(out, name, kind, components, values)?;
        }
        out.write_all(b"</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n")
    }
}

/// The most active muscle through each hexahedron; the first of several that are equally active.
pub(super) fn most_active<const D: usize>(body: &Body<D>, activations: &[f64]) -> Vec<Option<usize>> {
    let mut of: Vec<Option<usize>> = vec![None; body.mesh.hexahedra.len()];
    for (number, muscle) in body.muscles.iter().enumerate() {
        for &element in &muscle.region {
            let before = of[element].map_or(f64::NEG_INFINITY, |m| activations[m]);
            if activations[number] > before {
                of[element] = Some(number);
            }
        }
    }
    of
}

/// The present direction of a muscle's fibres at the centre of a hexahedron, and their stretch.
fn fibre<const D: usize>(
    body: &Body<D>,
    positions: &[SVector<f64, D>],
    element: usize,
    muscle: usize,
) -> Option<(Vector3<f64>, f64)> {
    let nodes = &body.mesh.hexahedra[element];
    let [x, now] = [&body.mesh.nodes, positions].map(|x| hexahedron::corners(x, nodes));
    let (gradients, _) = hexahedron::gradients(&x, [0.0; 3])?;
    let parts = now.iter().zip(gradients).map(|(x, g)| x * g.transpose());
    let f = parts.fold(Matrix3::zeros(), |sum, part| sum + part);
    let mean = mean_axis(body.directions(muscle, element).into_iter().flatten());
    let along = f * mean.try_normalize(0.0)?;
    Some((along.try_normalize(0.0)?, along.norm()))
}

/// The coordinates of a point; the third is zero in the plane.
fn point<const D: usize>(p: &SVector<f64, D>) -> String {
    format!("{} {} {}", p[0], p[1], p.get(2).unwrap_or(&0.0))
}

/// The provenance is a processing instruction, which readers ignore and which, unlike a comment, can contain every command line.
fn begin(out: &mut dyn Write, kind: &str, by: &Provenance) -> io::Result<()> {
    write!(out, "<?xml version=\"1.0\"?>\n<?tongue-fit")?;
    for (name, value) in by.entries() {
        write!(out, " {name}=\"{}\"", escape_xml(&value))?;
    }
    writeln!(out, "?>\n<VTKFile type=\"{kind}\" version=\"0.1\" byte_order=\"LittleEndian\">")
}

fn array(
    out: &mut dyn Write,
    name: &str,
    kind: &str,
    components: usize,
    values: impl IntoIterator<Item = impl std::fmt::Display>,
) -> io::Result<()> {
    // Readers take scalars for vectors if the number 1 is given.
    let components = match components {
        1 => String::new(),
        n => format!(" NumberOfComponents=\"{n}\""),
    };
    writeln!(out, "<DataArray type=\"{kind}\" Name=\"{name}\"{components} format=\"ascii\">")?;
    values.into_iter().try_for_each(|value| writeln!(out, "{value}"))?;
    out.write_all(b"</DataArray>\n")
}

/// The PVD file with the time (s) and the plain file name of every frame.
#[derive(Debug, Clone)]
pub struct Pvd(pub Vec<(f64, String)>);

impl Export for Pvd {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        begin(out, "Collection", by)?;
        out.write_all(b"<Collection>\n")?;
        for (time, file) in &self.0 {
            writeln!(out, "<DataSet timestep=\"{time}\" part=\"0\" file=\"{}\"/>", escape_xml(file))?;
        }
        out.write_all(b"</Collection>\n</VTKFile>\n")
    }
}

/// A body at rest as a Gmsh file of format 4.1, which [`gmsh::read`] reads.
#[derive(Debug, Clone)]
pub struct Msh<'a, const D: usize> {
    pub mesh: &'a Mesh<D>,
    /// Each bone becomes a group.
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
