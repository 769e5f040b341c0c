//! Results on the nodes, cells and muscle connections of a deformed body, for [`super::Vtu`].

use nalgebra::{SMatrix, SVector};

use super::ReportError;
use super::svg::check;
use tongue_core::body::Mesh;
use tongue_core::geometry::simplex;
use tongue_core::material::Stress;

/// A shape of a mesh and the tensions of its muscles, which were checked to fit the mesh.
#[derive(Debug, Clone)]
pub(super) struct Fields<'a, const D: usize> {
    pub mesh: &'a Mesh<D>,
    pub positions: &'a [SVector<f64, D>],
    tensions: &'a [f64],
    pub stresses: Vec<Stress<D>>,
}

/// Values of the cells, then of the connections of the muscles, one muscle after another.
pub(super) struct Array {
    pub name: &'static str,
    pub components: usize,
    pub values: Vec<String>,
}

impl<'a, const D: usize> Fields<'a, D> {
    pub fn new(
        mesh: &'a Mesh<D>,
        positions: &'a [SVector<f64, D>],
        tensions: &'a [f64],
    ) -> Result<Self, ReportError> {
        check(mesh, positions, tensions)?;
        Ok(Self { mesh, positions, tensions, stresses: Vec::new() })
    }

    /// Arrays on the cells and lines. Cells are the elements of a continuum, with means over their linear
    /// parts, and those of the mesh otherwise.
    ///
    /// The first is `area_ratio` (in space `volume_ratio`): of every cell to that at rest, 1 for lines. Then
    /// `stretch`: of every line to its length at rest, 1 for tissue. Then `tension_n_per_m` (in space
    /// `tension_n`: the plane has unit thickness): of every line that of its muscle, 0 for tissue.
    ///
    /// For finite elements follow Green's `strain` and `cauchy_stress_pa` as 3 x 3 tensors, row by row, in
    /// the plane with the components across it; `von_mises_pa`; `pressure_pa`, a third of Cauchy's trace with
    /// the sign of a pressure; and `fibre_stress_pa` along the muscle in the cell, 0 if there is none. They
    /// are 0 for lines.
    pub(crate) fn arrays(&self) -> Vec<Array> {
        let (mesh, lines) = (self.mesh, self.pairs().count());
        let count = mesh.elements().count();
        let parts = mesh.cells.len() / count.max(1);
        // The parts have equal size at rest.
        let mean = |values: Vec<f64>| {
            let of_cell = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
            values.chunks(parts.max(1)).map(of_cell).collect::<Vec<_>>()
        };
        let text = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v.to_string()).collect::<Vec<_>>();
        let same = |value: &str, count: usize| vec![value.to_owned(); count];
        let ratios = mesh.cells.iter().map(|cell| {
            let measure = |x: &[SVector<f64, D>]| simplex::measure(&simplex::corners(x, cell));
            measure(self.positions) / measure(&mesh.nodes)
        });
        let length = |x: &[SVector<f64, D>], pair: &[usize]| (x[pair[1]] - x[pair[0]]).norm();
        let stretches =
            self.pairs().map(|(_, pair)| length(self.positions, pair) / length(&mesh.nodes, pair));
        let tensions = self.pairs().map(|(muscle, _)| self.tensions[muscle]);
        let [ratio, tension] =
            if D == 2 { ["area_ratio", "tension_n_per_m"] } else { ["volume_ratio", "tension_n"] };
        let of = |name, components, cells: Vec<String>, lines: Vec<String>| Array {
            name,
            components,
            values: [cells, lines].concat(),
        };
        let mut all = vec![
            of(ratio, 1, text(&mut mean(ratios.collect()).into_iter()), same("1", lines)),
            of("stretch", 1, same("1", count), text(&mut { stretches })),
            of(tension, 1, same("0", count), text(&mut { tensions })),
        ];
        if self.stresses.len() == mesh.cells.len() && !self.stresses.is_empty() {
            let stresses: Vec<Stress<D>> = self.stresses.chunks(parts).map(Stress::mean).collect();
            let fibres = mesh.fibres(self.positions).into_iter().step_by(parts);
            let along =
                |(s, fibre): (&Stress<D>, Option<SVector<f64, D>>)| fibre.map_or(0.0, |f| s.along(&f));
            let strain = stresses.iter().map(|s| tensor(&s.strain, 0.0)).collect();
            let cauchy = stresses.iter().map(|s| tensor(&s.cauchy_pa, s.across_pa)).collect();
            let mises = text(&mut stresses.iter().map(|s| s.von_mises_pa));
            let pressure = text(&mut stresses.iter().map(Stress::pressure_pa));
            let fibre = text(&mut stresses.iter().zip(fibres).map(along));
            all.extend([
                of("strain", 9, strain, same(NO_TENSOR, lines)),
                of("cauchy_stress_pa", 9, cauchy, same(NO_TENSOR, lines)),
                of("von_mises_pa", 1, mises, same("0", lines)),
                of("pressure_pa", 1, pressure, same("0", lines)),
                of("fibre_stress_pa", 1, fibre, same("0", lines)),
            ]);
        }
        all
    }

    /// The connections of the muscles, one muscle after another, each with the number of its muscle.
    pub fn pairs(&self) -> impl Iterator<Item = (usize, &'a [usize])> {
        let muscles = self.mesh.muscles.iter().enumerate();
        muscles.flat_map(|(number, m)| m.nodes.windows(2).map(move |pair| (number, pair)))
    }
}

const NO_TENSOR: &str = "0 0 0 0 0 0 0 0 0";

/// The nine components in space, row by row; `across` is the component in the third direction of a tensor in
/// the plane.
fn tensor<const D: usize>(of: &SMatrix<f64, D, D>, across: f64) -> String {
    let component = |n: usize| match (n / 3, n % 3) {
        (i, j) if i < D && j < D => of[(i, j)],
        (2, 2) => across,
        _ => 0.0,
    };
    (0..9).map(|n| component(n).to_string()).collect::<Vec<_>>().join(" ")
}
