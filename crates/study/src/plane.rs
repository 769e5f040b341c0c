//! The error of the plane: a body in space against its own midsagittal plane, muscle by muscle.
//!
//! Both have the same mesh, muscles and law; in the plane no node moves sideways. The displacements of the free nodes of the midsagittal
//! contour are compared. Those in the plane are multiplied by the best factor for each muscle, because a wrong strength is not an error of
//! the plane.

use nalgebra::Vector3;
use serde::Serialize;

use tongue_core::body::Body;
use tongue_core::effect::{Effect, SymmetryPlane};
use tongue_core::statics::{self, SolveSettings, SolveStatus, Workspace};
use tongue_core::statistics::median;
use tongue_core::system::{Additions, SpaceModel, System};
use tongue_files::report::{ReportError, Series, Svg, parts};
use tongue_infer::inverse::in_space::SpaceSearch;
use tongue_input::measured::SpaceMark;

use crate::table::markdown;
use crate::{Error, tell};

/// Stiffness that holds a node at its sideways position, N/m.
const HELD: f64 = 1e7;
/// Activation of each muscle alone.
const ALONE: f64 = 0.1;
/// Standard deviation of positions in the inverse problems, m.
const SD_M: f64 = 5e-4;
/// Activations of postures that are simulated in space and inverted in the plane.
const POSTURES: [(&str, &[(&str, f64)]); 3] = [
    ("low and back, as in /a/", &[("GGA", 0.05), ("HG", 0.06), ("TRANS", 0.03)]),
    ("high and front, as in /i/", &[("GGP", 0.15), ("TRANS", 0.05)]),
    ("protruded", &[("GGP", 0.1), ("TRANS", 0.1), ("VERT", 0.05)]),
];

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaneRow {
    pub muscle: String,
    /// Root mean square displacement of the contour in space, mm.
    pub way_mm: f64,
    /// The factor by which displacements in the plane are multiplied.
    pub best_scale: f64,
    /// Error of the displacements after scaling, over the displacements in space (RMS).
    pub error: f64,
    /// Change of the area of the midsagittal section in space, per cent; in the plane the tissue keeps its area.
    pub area_change_percent: f64,
}

/// A muscle in a fit, in the plane, of a contour that was simulated in space.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InverseRow {
    pub posture: String,
    pub muscle: String,
    pub true_activation: f64,
    pub found_in_plane: f64,
    /// Root mean square residual of the contour, mm.
    pub rms_mm: f64,
}

/// Positions of all nodes; `None` if there is no equilibrium.
pub fn shape(system: &System<3>, activations: &[f64]) -> Option<Vec<Vector3<f64>>> {
    let mut w = Workspace::new(system);
    let solution = statics::solve(system, &mut w, activations, &SolveSettings::default());
    (solution.status == SolveStatus::Converged).then(|| w.positions().to_vec())
}

#[derive(Debug)]
pub struct SpaceAndPlane<'a> {
    body: &'a Body<3>,
    /// Free nodes of the midsagittal contour.
    contour: Vec<usize>,
    space: System<3>,
    /// The body with all nodes held at their sideways positions.
    plane: System<3>,
}

impl<'a> SpaceAndPlane<'a> {
    pub fn new(body: &'a Body<3>) -> Result<Self, Error> {
        let model = SpaceModel::default();
        let is_free = |node: &usize| body.mesh.fixed.binary_search(node).is_err();
        let free: Vec<usize> = (0..body.mesh.nodes.len()).filter(is_free).collect();
        let held: Box<dyn Effect<3>> = Box::new(SymmetryPlane::new(1, HELD, &free, &body.mesh.nodes));
        let additions = Additions { effects: vec![held], ..Additions::default() };
        let mut contour = body.midsagittal_mesh().surface_nodes();
        contour.retain(is_free);
        let (space, plane) =
            (System::in_space(body, &model)?, System::in_space_with(body, &model, additions)?);
        Ok(Self { body, contour, space, plane })
    }

    fn displacements(&self, x: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        self.contour.iter().map(|&n| x[n] - self.body.mesh.nodes[n]).collect()
    }

    pub fn alone(&self) -> Vec<PlaneRow> {
        let Self { body, space, plane, .. } = self;
        let faces = body.midsagittal();
        let mut alone = Vec::new();
        for muscle in body.groups() {
            tell(&format!("{muscle} in space and in the plane"));
            let Ok(activations) = body.activations(&[(&muscle, ALONE)]) else { continue };
            let Some((s, p)) = shape(space, &activations).zip(shape(plane, &activations)) else { continue };
            let (ways, flat) = (self.displacements(&s), self.displacements(&p));
            let dot =
                |a: &[Vector3<f64>], b: &[Vector3<f64>]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
            let best_scale = dot(&ways, &flat) / dot(&flat, &flat);
            let left: f64 = ways.iter().zip(&flat).map(|(a, b)| (a - b * best_scale).norm_squared()).sum();
            let squares = dot(&ways, &ways);
            alone.push(PlaneRow {
                muscle,
                way_mm: 1e3 * (squares / ways.len() as f64).sqrt(),
                best_scale,
                error: (left / squares).sqrt(),
                area_change_percent: 100.0 * (area(&faces, &s) / area(&faces, &body.mesh.nodes) - 1.0),
            });
        }
        alone
    }

    /// Simulates contours in space, and fits them in the plane. Only muscles with an activation in space or in the plane have rows.
    pub fn inverse(&self) -> Result<Vec<InverseRow>, Error> {
        let Self { body, contour, space, plane } = self;
        let mut inverse = Vec::new();
        for (posture, given) in POSTURES {
            tell(&format!("{posture}: made in space, inverted in the plane"));
            let Ok(truth) = body.activations(given) else { continue };
            let Some(s) = shape(space, &truth) else { continue };
            let marks: Vec<SpaceMark> =
                contour.iter().map(|&node| SpaceMark::node(node, s[node], SD_M)).collect();
            let fit = SpaceSearch::default().fit(body, plane, &marks, None)?;
            for (muscle, found_in_plane) in fit.activations.0 {
                let true_activation = given.iter().find(|(m, _)| *m == muscle).map_or(0.0, |(_, a)| *a);
                if true_activation > 0.0 || found_in_plane > 0.01 {
                    inverse.push(InverseRow {
                        posture: posture.to_owned(),
                        muscle,
                        true_activation,
                        found_in_plane,
                        rms_mm: 1e3 * fit.rms_m,
                    });
                }
            }
        }
        Ok(inverse)
    }
}

/// Area of faces in the midsagittal plane.
fn area(faces: &[[usize; 4]], x: &[Vector3<f64>]) -> f64 {
    faces.iter().map(|f| 0.5 * (x[f[2]] - x[f[0]]).cross(&(x[f[3]] - x[f[1]])).y.abs()).sum()
}

pub fn picture(alone: &[PlaneRow]) -> Result<Svg, ReportError> {
    let (muscles, values): (Vec<String>, _) = alone.iter().map(|row| (row.muscle.clone(), row.error)).unzip();
    let error = Series { name: "after the best scaling".to_owned(), values };
    let title = "What a plane misses of the displacement of the midsagittal contour when one muscle pulls";
    parts(&muscles, &[error], "error, as a part of the displacement", title)
}

pub fn page(body: &str, alone: &[PlaneRow], inverse: &[InverseRow], made: &str) -> Result<String, Error> {
    let middle = median(alone.iter().map(|r| r.error)).unwrap_or(f64::NAN);
    Ok(format!(
        "# How wrong the plane is\n\n{made}\n\nOf {body}, against itself with no node moving sideways: **the plane misses {:.0} % of the displacement of the \
         midsagittal contour (the median of {} muscles), after the best scaling.**\n\n\
         ![Error of the plane for each muscle](alone.svg)\n\n## Each muscle alone, at an activation of {ALONE}\n\n{}\n\
         ## Contours made in space and inverted in the plane\n\nFree nodes of the midsagittal contour, known to {} mm. Muscles that act, and those \
         that act in the plane but not in space (above 0.01).\n\n{}",
        100.0 * middle,
        alone.len(),
        markdown(alone, &[])?,
        1e3 * SD_M,
        markdown(inverse, &[])?
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tongue_files::report::MISSED_BY_PLANE;

    #[test]
    fn planar_commands_quote_what_the_plane_misses_of_the_built_in_tongue() {
        let body = Body::tongue_in_space(1).unwrap();
        let rows = SpaceAndPlane::new(&body).unwrap().alone();
        assert_eq!(rows.len(), 11);
        let middle = median(rows.iter().map(|r| r.error)).unwrap();
        assert!((middle - MISSED_BY_PLANE).abs() < 5e-3, "{rows:?}");
    }

    #[test]
    fn the_plane_misses_a_quarter_of_artisynths_tongue() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../../shared/reference/artisynth_tongue3d");
        let Ok(body) = tongue_input::bodies::artisynth::read(&folder) else {
            return eprintln!("skipped: ArtiSynth's tongue is not at {}", folder.display());
        };
        let rows = SpaceAndPlane::new(&body).unwrap().alone();
        let of = |name: &str| rows.iter().find(|r| r.muscle == name).unwrap();
        assert_eq!(rows.len(), 11);
        for (name, missed) in [("GGP", 0.25), ("GGM", 0.22), ("IL", 0.27), ("TRANS", 0.91)] {
            assert!((of(name).error - missed).abs() < 5e-3, "{name}: {}", of(name).error);
        }
        assert!((of("TRANS").area_change_percent - 10.4).abs() < 1.0);
        assert!((of("GGP").area_change_percent + 6.0).abs() < 1.0);
    }
}
