//! Shapes for ParaView and other readers of VTK's XML format (unstructured grid, text).

use std::fmt::Write as _;

use nalgebra::SVector;

use crate::mesh::{Mesh, simplex};

/// VTK's numbers for the kinds of cells: a line, a triangle, a tetrahedron.
const LINE: usize = 3;
const TRIANGLE: usize = 5;
const TETRAHEDRON: usize = 10;

/// The deformed mesh as text of a `.vtu` file: its tissue, and its muscle chains as lines; in the plane z is zero.
///
/// `positions` holds the position of every node, m. Point data: `displacement` from rest, m. Cell data: `measure_ratio`, area
/// or volume to that at rest (1 for lines), and `muscle`, 0 for tissue and the number of the chain, from 1, for lines.
pub fn vtu<const D: usize>(mesh: &Mesh<D>, positions: &[SVector<f64, D>]) -> String {
    let lines: Vec<[usize; 2]> =
        mesh.muscles.iter().flat_map(|m| m.nodes.windows(2).map(|w| [w[0], w[1]])).collect();
    let chain_of =
        mesh.muscles.iter().enumerate().flat_map(|(i, m)| vec![i + 1; m.nodes.len().saturating_sub(1)]);
    let tissue = mesh.cells.len();
    let ratio = |cell: &[usize]| {
        let measure = |x| simplex::measure(&simplex::corners(x, cell));
        measure(positions) / measure(&mesh.nodes)
    };

    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n",
    );
    let _ = writeln!(
        text,
        "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">",
        positions.len(),
        tissue + lines.len()
    );
    text += "<Points>\n";
    array(&mut text, "Float64", "position_m", 3, positions.iter().map(in_space));
    text += "</Points>\n<Cells>\n";
    let corners = mesh.cells.iter().chain(lines.iter().map(<[usize; 2]>::as_slice));
    array(&mut text, "Int64", "connectivity", 1, corners.clone().map(numbers));
    let mut end = 0;
    let ends = corners.map(|c| {
        end += c.len();
        end.to_string()
    });
    array(&mut text, "Int64", "offsets", 1, ends);
    let kind = if D == 2 { TRIANGLE } else { TETRAHEDRON };
    let kinds = (0..tissue + lines.len()).map(|i| if i < tissue { kind } else { LINE }.to_string());
    array(&mut text, "UInt8", "types", 1, kinds);
    text += "</Cells>\n<PointData Vectors=\"displacement_m\">\n";
    let moved = positions.iter().zip(&mesh.nodes).map(|(x, rest)| in_space(&(x - rest)));
    array(&mut text, "Float64", "displacement_m", 3, moved);
    text += "</PointData>\n<CellData>\n";
    let ratios = mesh.cells.iter().map(|c| ratio(c).to_string()).chain(lines.iter().map(|_| "1".to_owned()));
    array(&mut text, "Float64", "measure_ratio", 1, ratios);
    let chains = std::iter::repeat_n(0, tissue).chain(chain_of).map(|n| n.to_string());
    array(&mut text, "Int64", "muscle", 1, chains);
    text += "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
    text
}

fn array(text: &mut String, kind: &str, name: &str, components: usize, values: impl Iterator<Item = String>) {
    let _ = writeln!(
        text,
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"ascii\">"
    );
    for value in values {
        let _ = writeln!(text, "{value}");
    }
    text.push_str("</DataArray>\n");
}

fn numbers(cell: &[usize]) -> String {
    cell.iter().map(usize::to_string).collect::<Vec<_>>().join(" ")
}

fn in_space<const D: usize>(v: &SVector<f64, D>) -> String {
    let at = |d: usize| v.get(d).copied().unwrap_or(0.0);
    format!("{} {} {}", at(0), at(1), at(2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::solid;

    #[test]
    fn every_array_has_the_length_that_the_header_announces() {
        let mesh = solid::cylinder(0.01, 0.02, 1, 2);
        let text = vtu(&mesh, &mesh.nodes);
        let document = roxmltree::Document::parse(&text).unwrap();
        let array = |name: &str| -> Vec<f64> {
            let element = document.descendants().find(|n| n.attribute("Name") == Some(name)).unwrap();
            element.text().unwrap().split_whitespace().map(|w| w.parse().unwrap()).collect()
        };
        let (points, cells) = (mesh.nodes.len(), mesh.cells.len() + 7 * 2);
        assert_eq!(array("position_m").len(), 3 * points);
        assert_eq!(array("displacement_m"), vec![0.0; 3 * points]);
        assert_eq!((array("offsets").len(), array("types").len()), (cells, cells));
        assert_eq!(*array("offsets").last().unwrap() as usize, array("connectivity").len());
        assert_eq!(array("measure_ratio"), vec![1.0; cells]);
        assert!(array("connectivity").iter().all(|n| (*n as usize) < points));
        assert_eq!(array("muscle").iter().fold(0.0f64, |a, b| a.max(*b)), 7.0);
    }
}
