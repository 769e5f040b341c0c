//! The uncertainty of a body's shape at rest: displacements of the control points of [`ControlPoints`] and the ends of muscles, and shift,
//! turn, scale and shear of the whole body. Cells resist changes of their areas.

use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

use nalgebra::{DMatrix, DVector, stack};

use crate::adapt::{
    self, ControlPoints, Placement, RestError, area_residuals, is_believable, mark_of, straighten,
};
use crate::least_squares::jacobian_by_differences;
use crate::standard_deviations as sd;
use tongue_core::body::{Body, HYOID, MANDIBLE, Mesh};
use tongue_core::effect::Contact;
use tongue_core::geometry::{Point, Similarity};
use tongue_core::observe::TongueSurface;
use tongue_core::parallel;
use tongue_core::statics::lanes::{Lanes, Reshaped};
use tongue_core::system::{Additions, Layout, Model, System};

/// Standard deviations of what placing leaves open: shift, m, and turn, rad.
const SHIFT_SD_M: f64 = 1e-3 * sd::LEFT_SHIFT_MM;
const TURN_SD: f64 = sd::LEFT_TURN_DEG.to_radians();
/// Unit of a direction that moves a coil along the surface, m.
const COIL_UNIT_M: f64 = 1e-3;
/// Step of differences along a direction, in its units: 1 mm or one standard deviation.
pub(super) const STEP: f64 = 1e-3;

/// Directions in which a body may differ, and the normal prior of their amounts.
#[derive(Debug, Clone)]
pub struct ShapePrior {
    /// For every direction, the displacements of all nodes for one unit, m.
    pub(super) directions: Vec<Vec<Point>>,
    /// Coils with an uncertain place along the surface, with the weights of the nodes in its motion; each has one of the last directions.
    pub(super) coils: Vec<(String, Vec<(usize, f64)>)>,
    /// The directions that shift, turn and scale.
    placing: Range<usize>,
    /// Precision of the amounts and gradient of the cost at zero amounts (by observed places of bones), without the cost of cells.
    own: (DMatrix<f64>, DVector<f64>),
    /// Precision with the cost of cells.
    pub precision: DMatrix<f64>,
    /// Gradient with the cost of cells.
    pub gradient: DVector<f64>,
}

impl ShapePrior {
    /// The prior for a body in the frame of its recordings; `measured` gives the median places of its bones.
    pub fn of(body: &Body<2>, measured: impl Fn(&str) -> Option<Point>) -> Result<Self, RestError> {
        let mesh = &body.mesh;
        let ControlPoints { points, precision: own, weights } = ControlPoints::of(body)?;
        let axes = [Point::x(), Point::y()];
        let mut directions: Vec<Vec<Point>> = Vec::new();
        // Control points in millimetres, x and y in turn.
        let n = points.len();
        for control in 0..n {
            directions.extend(axes.map(|a| weights.iter().map(|w| a * (w[control] * 1e-3)).collect()));
        }
        // The other directions in standard deviations.
        let centre = adapt::centre_of(mesh);
        let about =
            |of: &dyn Fn(Point) -> Point| mesh.nodes.iter().map(|p| of(p - centre)).collect::<Vec<_>>();
        directions.extend(axes.map(|a| about(&|_| a * SHIFT_SD_M)));
        directions.push(about(&|p| Point::new(-p.y, p.x) * TURN_SD));
        directions.push(about(&|p| p * sd::LEFT_SCALE));
        let kept = directions.len();
        directions.push(about(&|p| Point::new(p.x, -p.y) * (0.5 * sd::SHEAR)));
        directions.push(about(&|p| Point::new(p.y, p.x) * (0.5 * sd::SHEAR)));
        directions.extend(attachment_modes(body));

        let all = directions.len();
        let of_controls = (own * 1e-6).kronecker(&DMatrix::<f64>::identity(2, 2));
        let mut precision = stack![of_controls, 0; 0, DMatrix::identity(all - 2 * n, all - 2 * n)];
        let mut gradient = DVector::zeros(all);
        for (bone, sd) in [(MANDIBLE, 1e-3 * sd::SPINE_MM), (HYOID, 1e-3 * sd::HYOID_MM)] {
            let (Some(mark), Some(at)) = (mark_of(body, bone), measured(bone)) else { continue };
            let Some(node) = body.bone(bone).iter().find(|&&i| mesh.nodes[i] == mark) else { continue };
            for axis in 0..2 {
                // The observed place of a bone does not depend on the ends of muscles.
                let rate = |k: usize| if k < kept + 2 { directions[k][*node][axis] / sd } else { 0.0 };
                let row = DVector::from_fn(all, |k, _| rate(k));
                gradient += &row * ((mark[axis] - at[axis]) / sd);
                precision += &row * row.transpose();
            }
        }
        let prior = Self {
            directions,
            coils: Vec::new(),
            placing: 2 * n..kept,
            own: (precision.clone(), gradient.clone()),
            precision,
            gradient,
        };
        Ok(prior.expanded_about(mesh, &DVector::zeros(all)))
    }

    /// The prior with the uncertainty of a placement by coils instead of the default, and with directions that move the coils.
    fn placed(mut self, mesh: &Mesh<2>, surface: &TongueSurface, by: &Placement) -> Self {
        let (first, all) = (self.placing.start, self.directions.len());
        let units = [SHIFT_SD_M, SHIFT_SD_M, TURN_SD, sd::LEFT_SCALE];
        let place = |i: usize| if i < 4 { (first + i, units[i]) } else { (all + i - 4, COIL_UNIT_M) };
        let count = all + by.coils.len();
        let (mut precision, mut gradient) = self.own;
        (0..4).for_each(|i| precision[(first + i, first + i)] = 0.0);
        precision = precision.resize(count, count, 0.0);
        gradient = gradient.resize_vertically(count, 0.0);
        for i in 0..by.known.1.len() {
            let (row, unit) = place(i);
            gradient[row] += by.known.1[i] * unit;
            for j in 0..by.known.1.len() {
                let (column, other) = place(j);
                precision[(row, column)] += by.known.0[(i, j)] * unit * other;
            }
        }
        for (name, behind) in &by.coils {
            let [there, here] = [0.5 * COIL_UNIT_M, -0.5 * COIL_UNIT_M]
                .map(|by| surface.curve.weights(surface.tip - behind - by));
            let less = here.into_iter().map(|(node, weight)| (node, -weight));
            self.coils.push((name.clone(), there.into_iter().chain(less).collect()));
            self.directions.push(vec![Point::zeros(); mesh.nodes.len()]);
        }
        self.own = (precision, gradient);
        self.expanded_about(mesh, &DVector::zeros(count))
    }

    /// Nodes displaced by these amounts, m.
    fn moved(&self, mesh: &Mesh<2>, amounts: &DVector<f64>) -> Vec<Point> {
        let mut nodes = mesh.nodes.clone();
        for (direction, amount) in self.directions.iter().zip(amounts.iter()) {
            nodes.iter_mut().zip(direction).for_each(|(p, d)| *p += d * *amount);
        }
        nodes
    }

    /// Change of the logarithm of every cell's area, in weighted standard deviations, without the placing directions.
    fn area_logs(&self, mesh: &Mesh<2>, amounts: &DVector<f64>) -> DVector<f64> {
        let mut amounts = amounts.clone();
        amounts.rows_range_mut(self.placing.clone()).fill(0.0);
        DVector::from_iterator(mesh.cells.len(), area_residuals(mesh, &self.moved(mesh, &amounts)))
    }

    /// The prior expanded about these amounts.
    fn expanded_about(mut self, mesh: &Mesh<2>, amounts: &DVector<f64>) -> Self {
        let growth = jacobian_by_differences(amounts, &|amounts| Some(self.area_logs(mesh, amounts)), STEP)
            .unwrap_or_default();
        let (precision, gradient) = &self.own;
        self.gradient = gradient + precision * amounts + growth.tr_mul(&self.area_logs(mesh, amounts));
        self.precision = precision + growth.tr_mul(&growth);
        self
    }
}

/// A body whose nodes may be elsewhere than in its mesh.
#[derive(Clone)]
struct MovableBody {
    mesh: Mesh<2>,
    model: Model,
    contracting: Vec<usize>,
    /// A wall that the tongue does not pass, such as the palate.
    wall: Option<Contact>,
}

impl MovableBody {
    fn of(body: &Body<2>, model: &Model, contracting: &[usize]) -> Self {
        Self { mesh: body.mesh.clone(), model: *model, contracting: contracting.to_vec(), wall: None }
    }

    fn system(&self, nodes: Vec<Point>, layout: Option<Arc<Layout>>) -> Result<System<2>, RestError> {
        let mesh = Mesh { nodes, ..self.mesh.clone() };
        let mut additions = Additions { layout, ..Additions::default() };
        self.wall.iter().for_each(|wall| additions.add_contact(wall.clone()));
        System::with_additions(&mesh, &self.model, &self.contracting, additions)
            .map_err(|e| RestError::Body(e.to_string()))
    }
}

/// The uncertainty of a body's shape, with slightly perturbed bodies.
pub struct RestShape {
    pub prior: ShapePrior,
    /// The body, whose mesh has the nodes at zero amounts.
    body: MovableBody,
    /// The nodes from which the system is assembled, m. In its rest shape the parts of muscles outside the tissue are straight.
    nodes: Vec<Point>,
    pub system: System<2>,
    /// The body a small step along every direction, and these bodies for lanes, made when they are first used; most bodies of a search for
    /// a shape are not.
    changed: OnceLock<Option<Vec<System<2>>>>,
    in_lanes: OnceLock<Option<Vec<Reshaped<2>>>>,
    is_kept: bool,
}

impl RestShape {
    /// The shape of a body in the frame of its recordings ([`ShapePrior::of`]).
    pub fn of(
        body: &Body<2>,
        model: &Model,
        contracting: &[usize],
        measured: impl Fn(&str) -> Option<Point>,
    ) -> Result<Self, RestError> {
        Self::checked(ShapePrior::of(body, measured)?, MovableBody::of(body, model, contracting))
    }

    /// The shape of a body that was placed by coils.
    pub fn of_coils(
        body: &Body<2>,
        model: &Model,
        contracting: &[usize],
        by: &Placement,
    ) -> Result<Self, RestError> {
        let prior = ShapePrior::of(body, |_| None)?.placed(&body.mesh, &adapt::outline_of(body)?, by);
        Self::checked(prior, MovableBody::of(body, model, contracting))
    }

    /// The body in contact with a wall.
    pub fn with_wall(self, wall: Contact) -> Result<Self, RestError> {
        Self::checked(self.prior, MovableBody { wall: Some(wall), ..self.body })
    }

    fn new(prior: ShapePrior, body: MovableBody, nodes: Vec<Point>) -> Result<Self, RestError> {
        let system = body.system(nodes.clone(), None)?;
        let (changed, in_lanes) = (OnceLock::new(), OnceLock::new());
        Ok(Self { prior, body, nodes, system, changed, in_lanes, is_kept: false })
    }

    /// The body at zero amounts. Checks that it can be assembled a small step along every direction.
    fn checked(prior: ShapePrior, body: MovableBody) -> Result<Self, RestError> {
        let nodes = body.mesh.nodes.clone();
        let shape = Self::new(prior, body, nodes)?;
        let all = parallel::map(&shape.prior.directions, |d| shape.step(d).map(drop));
        all.into_iter().collect::<Result<(), _>>().map(|()| shape)
    }

    fn step(&self, direction: &Vec<Point>) -> Result<System<2>, RestError> {
        let nodes = self.nodes.iter().zip(direction).map(|(p, d)| p + d * STEP);
        self.body.system(nodes.collect(), Some(self.system.layout()))
    }

    pub(super) fn perturbed_systems(&self) -> Option<&[System<2>]> {
        let made = self.changed.get_or_init(|| {
            parallel::map(&self.prior.directions, |d| self.step(d)).into_iter().collect::<Result<_, _>>().ok()
        });
        made.as_deref()
    }

    /// `None` if lanes cannot take the body.
    pub(super) fn in_lanes(&self) -> Option<&[Reshaped<2>]> {
        let made = self.in_lanes.get_or_init(|| {
            let lanes = Lanes::new(&self.system);
            let all = parallel::map(&self.prior.directions, |d| {
                lanes.reshaped(&self.step(d).ok()?, d.clone(), STEP)
            });
            all.into_iter().collect()
        });
        made.as_deref()
    }

    /// Positions of all nodes at these amounts, m; parts of muscles outside the tissue are straight.
    fn nodes_at(&self, amounts: &DVector<f64>) -> Vec<Point> {
        let mut nodes = self.prior.moved(&self.body.mesh, amounts);
        straighten(&self.body.mesh, &mut nodes);
        nodes
    }

    /// The body displaced by these amounts, with the same prior; `None` if it passes the wall.
    pub(super) fn moved(&self, amounts: &DVector<f64>) -> Option<Self> {
        let (nodes, connections) = (self.nodes_at(amounts), &self.body.mesh.connections);
        if self.body.wall.as_ref().is_some_and(|w| w.first_penetration(&nodes, connections).is_some()) {
            return None;
        }
        Self::new(self.prior.clone(), self.body.clone(), nodes).ok()
    }

    /// The body with the prior expanded about these amounts.
    pub(super) fn expanded(self, amounts: &DVector<f64>) -> Self {
        Self { prior: self.prior.expanded_about(&self.body.mesh, amounts), ..self }
    }

    /// Cost of these amounts relative to that of zero amounts.
    pub(super) fn relative_cost(&self, amounts: &DVector<f64>) -> f64 {
        let (precision, gradient) = &self.prior.own;
        let areas = self.prior.area_logs(&self.body.mesh, amounts).norm_squared();
        amounts.dot(&(precision * amounts)) + 2.0 * gradient.dot(amounts) + areas
    }

    /// Amounts after the largest part of a step with which cells keep enough of their areas and muscles of their lengths.
    pub(super) fn after_step(&self, amounts: &DVector<f64>, step: &DVector<f64>) -> DVector<f64> {
        let mut step = step.clone();
        for _ in 0..10 {
            let there = amounts + &step;
            let mut nodes = self.nodes_at(&there);
            if let Some(placed) = Similarity::between(&self.body.mesh.nodes, &nodes) {
                nodes.iter_mut().for_each(|p| *p = placed.place_back(*p));
                if is_believable(&self.body.mesh, &nodes) {
                    return there;
                }
            }
            step *= 0.7;
        }
        amounts.clone()
    }

    /// The shape of the body as the most probable one, because it was found in recordings of the speaker.
    pub fn as_found(self) -> Self {
        Self { is_kept: true, ..self }
    }

    /// Whether the shape of the body is kept without a search, because it was found before or coils show little of it.
    pub(super) fn is_kept(&self) -> bool {
        self.is_kept || !self.prior.coils.is_empty()
    }

    pub fn count(&self) -> usize {
        self.prior.directions.len()
    }
}

/// Smallest sine of the angle at which a node where muscles cross moves along the other muscle.
const LEAST_SINE: f64 = 0.3;

/// Motion of the nodes with each end of a muscle: the straight line of the muscle turns with the end; ends on the outline slide along it.
fn attachment_modes(body: &Body<2>) -> Vec<Vec<Point>> {
    let mesh = &body.mesh;
    let outline = mesh.outlines().into_iter().max_by_key(Vec::len).unwrap_or_default();
    let inside = mesh.in_tissue();
    let fixed = |n: usize| mesh.fixed.binary_search(&n).is_ok();
    let is_on_measured_bone = |n: usize| [MANDIBLE, HYOID].iter().any(|b| body.bone(b).contains(&n));
    let ends: BTreeSet<usize> = mesh.muscles.iter().flat_map(|m| m.ends()).collect();
    let mut out = Vec::new();
    for end in ends {
        let on_outline = outline.iter().position(|&n| n == end).filter(|_| !fixed(end));
        let directions: Vec<Point> = match on_outline {
            Some(i) => {
                let count = outline.len();
                let (before, after) = (outline[(i + count - 1) % count], outline[(i + 1) % count]);
                (mesh.nodes[after] - mesh.nodes[before]).try_normalize(0.0).into_iter().collect()
            }
            None => vec![Point::x(), Point::y()],
        };
        for direction in directions {
            let mut moved = vec![Point::zeros(); mesh.nodes.len()];
            moved[end] = direction
                * (1e-3
                    * (if fixed(end) && !is_on_measured_bone(end) {
                        sd::FAR_END_MM
                    } else {
                        sd::MUSCLE_END_MM
                    }));
            for (number, muscle) in mesh.muscles.iter().enumerate() {
                let [a, b] = muscle.ends();
                let other = if a == end { b } else { a };
                let line = mesh.nodes[other] - mesh.nodes[end];
                if (a != end && b != end) || line.norm() <= 0.0 {
                    continue;
                }
                let normal = Point::new(-line.y, line.x) / line.norm();
                for &node in muscle.nodes.iter().filter(|&&n| n != a && n != b && !fixed(n)) {
                    let part = 1.0 - (mesh.nodes[node] - mesh.nodes[end]).dot(&line) / line.norm_squared();
                    let across = normal.dot(&moved[end]) * part.clamp(0.0, 1.0);
                    let crossing = crossing(mesh, number, node);
                    let along = crossing.unwrap_or(normal);
                    let sine = normal.dot(&along);
                    if inside[node] && sine.abs() < LEAST_SINE || outline.contains(&node) {
                        continue;
                    }
                    moved[node] = along * (across / sine);
                }
            }
            out.push(moved);
        }
    }
    out
}

/// Direction of another muscle through a node.
fn crossing(mesh: &Mesh<2>, number: usize, node: usize) -> Option<Point> {
    let other = mesh.muscles.iter().enumerate().find(|(i, m)| *i != number && m.nodes.contains(&node))?.1;
    let [a, b] = other.ends();
    (mesh.nodes[b] - mesh.nodes[a]).try_normalize(0.0)
}
