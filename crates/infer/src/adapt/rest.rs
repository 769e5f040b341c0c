//! A body whose rest shape is changed by displacements of control points, and the prior of the areas of its cells.

use nalgebra::{DMatrix, DVector};

use super::mark_of;
use crate::least_squares::minimise;
use crate::standard_deviations as sd;
use crate::standard_deviations::LN_AREA;
use tongue_core::body::{Body, HYOID, MANDIBLE, Mesh};
use tongue_core::geometry::{Point, Similarity, ThinPlate, simplex};
use tongue_core::observe::{Contour, Observable, TongueSurface};
use tongue_input::measured::recording::Mark;

/// Control points of the built-in tongue, mm: around its outline, and one in its middle.
const CONTROLS_MM: [[f64; 2]; 13] = [
    [0.0, 0.0],
    [-2.9, 8.8],
    [-9.6, 24.9],
    [-11.3, 30.0],
    [-3.0, 38.9],
    [10.4, 45.8],
    [28.9, 50.1],
    [42.9, 39.4],
    [46.7, 24.5],
    [47.0, 9.1],
    [37.6, -3.1],
    [16.1, -2.1],
    [20.0, 22.0],
];
/// Distance between mental spine and hyoid in the built-in tongue, m, to which the size of other bodies is relative.
const SPINE_TO_HYOID_M: f64 = 37.75e-3;
/// Displacements below this count as zero, m.
const NOTHING_M: f64 = 1e-9;

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RestError {
    /// The body has no outline or no bones, or its control points lie on one line.
    #[error("this body cannot be adapted: {0}")]
    Body(String),
    /// A bone lies where no tongue with this contour has it.
    #[error("{0}")]
    NotOneFrame(String),
    #[error(
        "the rest shape would fold the tissue: a cell would keep {ratio:.2} of its area (at least {LEAST_AREA_RATIO} is needed)"
    )]
    Folds { ratio: f64 },
}

/// Control points with the prior of their displacements.
#[derive(Debug, Clone)]
pub struct ControlPoints {
    /// Their places at rest, m.
    pub points: Vec<Point>,
    /// Inverse of the covariance of their displacements along an axis, 1/m².
    pub precision: DMatrix<f64>,
    /// For every node of the body, the weight of each control point's displacement.
    pub weights: Vec<Vec<f64>>,
}

impl ControlPoints {
    /// The built-in control points, moved to the body by its mental spine and hyoid.
    pub fn of(body: &Body<2>) -> Result<Self, RestError> {
        let missing = || RestError::Body(format!("it needs the bones \"{MANDIBLE}\" and \"{HYOID}\""));
        let spine = mark_of(body, MANDIBLE).ok_or_else(missing)?;
        let hyoid = mark_of(body, HYOID).ok_or_else(missing)?;
        let built_in: Vec<Point> = CONTROLS_MM.iter().map(|p| Point::from(*p) * 1e-3).collect();
        let place = Similarity::between(&[built_in[0], built_in[10]], &[spine, hyoid])
            .ok_or_else(|| RestError::Body("its spine and hyoid coincide".to_owned()))?;
        // A body within a tenth of a millimetre of the built-in points gets exactly these.
        let near = (spine - built_in[0]).norm() < 1e-4 && (hyoid - built_in[10]).norm() < 1e-4;
        let points: Vec<Point> =
            if near { built_in } else { built_in.iter().map(|p| place.place(*p)).collect() };
        let size = (hyoid - spine).norm() / SPINE_TO_HYOID_M;
        let mm = |i: usize| if matches!(i, 0 | 10) { sd::CONTROL_BONE_MM } else { sd::CONTROL_MM };
        let sd = |i: usize| size * (1e-3 * mm(i));
        let covariance = DMatrix::from_fn(points.len(), points.len(), |i, j| {
            let apart = (points[i] - points[j]).norm_squared();
            let alone = if i == j { (size * (1e-3 * sd::CONTROL_ALONE_MM)).powi(2) } else { 0.0 };
            sd(i) * sd(j) * (-0.5 * apart / (size * (1e-3 * sd::CONTROL_FAR_MM)).powi(2)).exp() + alone
        });
        let precision =
            covariance.try_inverse().ok_or_else(|| RestError::Body("control points coincide".to_owned()))?;
        let plate = ThinPlate::new(&points)
            .ok_or_else(|| RestError::Body("its control points lie in one line".to_owned()))?;
        let weights = body.mesh.nodes.iter().map(|p| plate.weights(*p)).collect();
        Ok(Self { points, precision, weights })
    }
}

#[derive(Debug, Clone)]
pub struct Rest<'a> {
    body: &'a Body<2>,
    controls: ControlPoints,
    pub similarity: Similarity,
    /// Bones far from the tissue, such as the styloid, and the places of their marks after placing, m.
    pub far: Vec<(String, Point)>,
}

impl<'a> Rest<'a> {
    /// A body that is first changed and then placed.
    pub fn new(body: &'a Body<2>, similarity: Similarity) -> Result<Self, RestError> {
        Ok(Self { body, controls: ControlPoints::of(body)?, similarity, far: Vec::new() })
    }

    /// Number of unknowns: two for each control point, x and y in turn.
    pub fn unknowns(&self) -> usize {
        2 * self.controls.points.len()
    }

    /// Nodes after the displacements and before the similarity, m.
    fn changed(&self, displacements: &DVector<f64>) -> Vec<Point> {
        Vec::from_iter(self.body.mesh.nodes.iter().zip(&self.controls.weights).map(|(p, weights)| {
            let controls = weights.iter().zip(displacements.as_slice().chunks_exact(2));
            let moved: Point = controls.map(|(weight, d)| Point::new(d[0], d[1]) * *weight).sum();
            // A zero displacement keeps even the sign of a zero.
            if moved == Point::zeros() { *p } else { p + moved }
        }))
    }

    /// The changed and placed body; displacements in m.
    pub fn body(&self, displacements: &DVector<f64>) -> Body<2> {
        let mut body = self.body.clone();
        body.mesh.nodes = self.changed(displacements).iter().map(|p| self.similarity.place(*p)).collect();
        for (bone, to) in &self.far {
            let by = mark_of(&body, bone).map_or_else(Point::zeros, |mark| to - mark);
            for n in body.bone(bone).to_vec() {
                body.mesh.nodes[n] += by;
            }
        }
        straighten(&self.body.mesh, &mut body.mesh.nodes);
        body.palate = None;
        body
    }

    /// Weighted residuals of the prior of the displacements and of the cells' areas.
    fn prior_residuals(&self, displacements: &DVector<f64>) -> DVector<f64> {
        let n = self.controls.points.len();
        let factor = self.controls.precision.clone().cholesky().map(|c| c.l().transpose());
        let mut out = Vec::with_capacity(2 * n + self.body.mesh.cells.len());
        for axis in 0..2 {
            let d = DVector::from_fn(n, |i, _| displacements[2 * i + axis]);
            out.extend(factor.as_ref().map_or_else(|| d.clone(), |f| f * &d).iter().copied());
        }
        out.extend(area_residuals(&self.body.mesh, &self.changed(displacements)));
        DVector::from_vec(out)
    }

    pub fn least_area_ratio(&self, displacements: &DVector<f64>) -> f64 {
        area_ratios(&self.body.mesh, &self.changed(displacements)).fold(f64::INFINITY, f64::min)
    }
}

/// Puts displaced nodes of muscles outside the tissue back on straight lines, with the same relative spacing as in the mesh.
pub(crate) fn straighten(mesh: &Mesh<2>, nodes: &mut [Point]) {
    let (inside, before) = (mesh.in_tissue(), &mesh.nodes);
    let free = |n: usize| !inside[n] && mesh.fixed.binary_search(&n).is_err();
    for muscle in &mesh.muscles {
        let stops: Vec<usize> = (0..muscle.nodes.len()).filter(|&i| !free(muscle.nodes[i])).collect();
        for stop in stops.windows(2).filter(|s| s[1] - s[0] > 1) {
            let ends = [muscle.nodes[stop[0]], muscle.nodes[stop[1]]];
            let whole = (before[ends[1]] - before[ends[0]]).norm();
            let (from, to) = (nodes[ends[0]], nodes[ends[1]]);
            if from == before[ends[0]] && to == before[ends[1]] {
                continue;
            }
            for &node in &muscle.nodes[stop[0] + 1..stop[1]] {
                let part = (before[node] - before[ends[0]]).norm() / whole;
                nodes[node] = from + (to - from) * part;
            }
        }
    }
}

/// The displacements (m) with which the body at rest best fits contour points and marks of bones.
pub fn fit_rest_shape(
    rest: &Rest<'_>,
    contour: &[Mark],
    bones: &[(&str, Mark)],
) -> Result<DVector<f64>, RestError> {
    let residuals = |d: &DVector<f64>| {
        let body = rest.body(d);
        let surface = TongueSurface::of(&body)?;
        let away = |m: &Mark| Contour::new(surface.curve.clone(), m.at).value(&body.mesh.nodes) / m.sd;
        let bones = bones
            .iter()
            .filter_map(|(name, seen)| Some((mark_of(&body, name)? - seen.at) / seen.sd))
            .flat_map(|away| [away.x, away.y]);
        let seen =
            contour.iter().map(away).chain(bones).chain(rest.prior_residuals(d).iter().copied()).collect();
        Some(DVector::from_vec(seen))
    };
    let start = [DVector::zeros(rest.unknowns())];
    let d = minimise(start, &residuals, &|d| rest.least_area_ratio(d) >= LEAST_AREA_RATIO, (1e-6, 1e-6))
        .ok_or_else(|| RestError::Body("it has no outline".to_owned()))?
        .x;
    let ratio = rest.least_area_ratio(&d);
    let cleaned = d.map(|d| if d.abs() < NOTHING_M { 0.0 } else { d });
    if ratio < LEAST_AREA_RATIO { Err(RestError::Folds { ratio }) } else { Ok(cleaned) }
}

/// Weight of all cells together in the cost.
const AREA_WEIGHT: f64 = 40.0;
/// A cell that keeps less than the first number of its area resists further compression by the second number times as much.
const SQUEEZED: (f64, f64) = (0.7, 4.0);
/// A cell that keeps less than this part of its area counts as folded.
pub(crate) const LEAST_AREA_RATIO: f64 = 0.15;

/// Least ratio of a cell's area, and largest factor of a muscle's length, by which the rest shape of a speaker's tongue may differ.
pub(crate) const TRUSTED_AREA: f64 = 0.5;
pub(crate) const TRUSTED_STRETCH: f64 = 1.35;

/// Whether a speaker's tongue may have its nodes at these places, m, before it is turned and scaled.
pub(crate) fn is_believable(mesh: &Mesh<2>, nodes: &[Point]) -> bool {
    let ends = mesh.muscles.iter().map(|m| m.ends());
    let stretches = ends.map(|[a, b]| (nodes[a] - nodes[b]).norm() / (mesh.nodes[a] - mesh.nodes[b]).norm());
    area_ratios(mesh, nodes).all(|r| r > TRUSTED_AREA)
        && stretches.map(f64::ln).all(|s| s.abs() < TRUSTED_STRETCH.ln())
}

/// Ratio of every cell's area, with the nodes at these places, m, to that in the mesh; negative for an inverted cell.
pub(crate) fn area_ratios(mesh: &Mesh<2>, nodes: &[Point]) -> impl Iterator<Item = f64> {
    mesh.cells.iter().map(move |cell| {
        let [area, at_rest] = [nodes, &mesh.nodes].map(|x| simplex::measure(&simplex::corners(x, cell)));
        area / at_rest
    })
}

/// Change of the logarithm of every cell's area, in weighted standard deviations. An inverted cell counts as one with a millionth of its
/// area; such a shape is rejected anyway.
pub(crate) fn area_residuals(mesh: &Mesh<2>, nodes: &[Point]) -> impl Iterator<Item = f64> {
    let weight = (AREA_WEIGHT / mesh.cells.len().max(1) as f64).sqrt() / LN_AREA;
    let (from, factor) = (SQUEEZED.0.ln(), SQUEEZED.1 - 1.0);
    let logs = area_ratios(mesh, nodes).map(|ratio| ratio.max(1e-6).ln());
    logs.map(move |log| weight * (log + factor * (log - from).min(0.0)))
}
