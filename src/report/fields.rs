//! What is known of a deformed body at its nodes, cells and muscle connections; the formats write the same arrays.

use nalgebra::SVector;

use super::ReportError;
use super::svg::check;
use crate::body::Mesh;
use crate::geometry::simplex;

/// Name of the displacement from rest, m, of the nodes.
pub(super) const DISPLACEMENT: &str = "displacement_m";
/// Name of the length of a muscle's connection to that at rest, dimensionless.
pub(super) const STRETCH: &str = "stretch";

/// A shape of a mesh and the tensions of its muscles, which were checked to fit the mesh.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fields<'a, const D: usize> {
    pub mesh: &'a Mesh<D>,
    pub positions: &'a [SVector<f64, D>],
    tensions: &'a [f64],
}

impl<'a, const D: usize> Fields<'a, D> {
    pub fn new(
        mesh: &'a Mesh<D>,
        positions: &'a [SVector<f64, D>],
        tensions: &'a [f64],
    ) -> Result<Self, ReportError> {
        check(mesh, positions, tensions)?;
        Ok(Self { mesh, positions, tensions })
    }

    /// Name of the ratios of [`Fields::cell_ratios`].
    pub fn cell_ratio_name(&self) -> &'static str {
        if D == 2 { "area_ratio" } else { "volume_ratio" }
    }

    /// Name of the values of [`Fields::tensions`]: the plane is of unit thickness.
    pub fn tension_name(&self) -> &'static str {
        if D == 2 { "tension_n_per_m" } else { "tension_n" }
    }

    /// Of every node, m.
    pub fn displacements(&self) -> impl Iterator<Item = SVector<f64, D>> {
        self.positions.iter().zip(&self.mesh.nodes).map(|(p, rest)| p - rest)
    }

    /// Of every cell its area or volume to that at rest.
    pub fn cell_ratios(&self) -> impl Iterator<Item = f64> {
        self.mesh.cells.iter().map(|cell| {
            let measure = |x: &[SVector<f64, D>]| simplex::measure(&simplex::corners(x, cell));
            measure(self.positions) / measure(&self.mesh.nodes)
        })
    }

    /// Of every connection of the muscles, one muscle after another, its length to that at rest.
    pub fn stretches(&self) -> Vec<f64> {
        let pairs = self.mesh.muscles.iter().flat_map(|m| m.nodes.windows(2));
        let length = |x: &[SVector<f64, D>], pair: &[usize]| (x[pair[1]] - x[pair[0]]).norm();
        pairs.map(|pair| length(self.positions, pair) / length(&self.mesh.nodes, pair)).collect()
    }

    /// Of every connection of the muscles, in the same order, the tension of its muscle, N (in the plane per metre of thickness).
    pub fn tensions(&self) -> Vec<f64> {
        let of = self.mesh.muscles.iter().zip(self.tensions);
        of.flat_map(|(m, tension)| m.nodes.windows(2).map(move |_| *tension)).collect()
    }
}
