//! Blocks and cylinders, and the parts of lines in the elements of a continuum.

use nalgebra::SVector;
use tongue_core::body::Mesh;
use tongue_core::body::continuum::locate::Locator;
use tongue_core::body::solid::{block, cylinder};
use tongue_core::geometry::{simplex, topology};

fn volume(mesh: &Mesh<3>) -> f64 {
    mesh.cells.iter().map(|c| simplex::measure(&simplex::corners(&mesh.nodes, c))).sum()
}

/// Whether every edge of the surface belongs to two of its faces.
fn surface_is_closed(mesh: &Mesh<3>) -> bool {
    let faces = mesh.surface();
    topology::edges(faces.iter().map(Vec::as_slice)).values().all(|faces| *faces == 2)
}

#[test]
fn a_block_fills_its_volume_and_hangs_together() {
    let mesh = block([0.02, 0.03, 0.01], [2, 3, 1]);
    mesh.check().unwrap();
    assert!((volume(&mesh) - 6e-6).abs() < 1e-18 && surface_is_closed(&mesh));
    assert_eq!((mesh.nodes.len(), mesh.cells.len(), mesh.fixed.len()), (24, 36, 12));
}

#[test]
fn a_cylinder_fills_the_prism_over_its_polygon_and_hangs_together() {
    for rings in 1..5 {
        let mesh = cylinder(0.01, 0.04, rings, 3);
        mesh.check().unwrap();
        let sides = (6 * rings) as f64;
        let polygon = 0.5 * sides * 1e-4 * (std::f64::consts::TAU / sides).sin();
        assert!((volume(&mesh) / (0.04 * polygon) - 1.0).abs() < 1e-12 && surface_is_closed(&mesh));
        assert_eq!(mesh.muscles.len(), 1 + 3 * rings * (rings + 1));
    }
}

#[test]
fn a_line_along_an_edge_is_in_one_element_only_and_one_across_is_cut_at_the_edge() {
    let nodes: Vec<SVector<f64, 2>> =
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(SVector::from).to_vec();
    let elements = vec![vec![0, 1, 2], vec![0, 2, 3]];
    let locator = Locator::new(&nodes, &elements);
    let along = locator.cut(&SVector::from([-1.0, -1.0]), &SVector::from([2.0, 2.0]));
    assert_eq!(along.len(), 1);
    let length = along[0].1[1] - along[0].1[0];
    assert!((length - 1.0 / 3.0).abs() < 1e-8, "{along:?}");
    let across = locator.cut(&SVector::from([0.0, 0.75]), &SVector::from([2.0, 0.25]));
    assert_eq!(across.iter().map(|p| p.0).collect::<Vec<_>>(), [1, 0]);
    assert!((across[0].1[1] - across[1].1[0]).abs() < 1e-8 && (across[1].1[1] - 0.5).abs() < 1e-8);
    // Floating-point numbers cannot represent this direction exactly.
    let turned: Vec<_> = nodes.iter().map(|p| nalgebra::Rotation2::new(0.3) * p / 3.0).collect();
    let locator = Locator::new(&turned, &elements);
    for part in [0.1, 0.37, 0.6] {
        let line = locator.cut(&(turned[2] * -part), &(turned[2] * (1.0 + part)));
        let length: f64 = line.iter().map(|p| p.1[1] - p.1[0]).sum();
        assert!((length - 1.0 / (1.0 + 2.0 * part)).abs() < 1e-8, "{line:?}");
    }
}
