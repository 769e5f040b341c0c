//! What each muscle of a body does alone.

use serde_json::{Value, json};
use tongue_core::body::{Body, Mesh};
use tongue_core::geometry::Point;
use tongue_core::statics::SolveStatus;
use tongue_core::system::{Model, SpaceModel};
use tongue_infer::inverse::alarms::Alarm;

use super::equilibrium::Solved;
use crate::simulation::SimulationError;

/// A muscle that pulls alone, and what it does to the surface.
#[derive(Debug, Clone)]
pub struct MuscleEffect {
    pub name: String,
    pub status: SolveStatus,
    pub alarms: Vec<Alarm>,
    /// Its length over that at rest.
    pub stretch: f64,
    /// By how much the foremost, highest and rearmost node of the surface at rest have moved forward and up, mm.
    pub moved_mm: [[f64; 2]; 3],
    /// In space, by how much the body is wider.
    pub wider_mm: Option<f64>,
    /// Positions of the nodes of the midsagittal section, m.
    pub positions: Vec<Point>,
    /// Tensions of all muscles, N per metre of thickness, of a body in the plane.
    pub tensions: Vec<f64>,
    /// How hard it pulls, with the name of its column, and in the plane the lengths of all muscles at rest and now, m.
    pull: (&'static str, f64),
    lengths_m: Vec<(String, [f64; 2])>,
}

impl MuscleEffect {
    /// The effect of the muscles of this name with a tension, N per metre of thickness.
    pub fn in_plane(
        body: &Body<2>,
        model: &Model,
        name: &str,
        tension: f64,
    ) -> Result<Self, SimulationError> {
        let pulling: Vec<usize> = body.muscles_called(name).collect();
        let mut tensions = vec![0.0; body.mesh.muscles.len()];
        pulling.iter().for_each(|&m| tensions[m] = tension);
        let solved = Solved::in_plane(body, model, (&pulling, &tensions), false)?;
        let positions = &solved.positions;
        let lengths_m = (0..tensions.len()).map(|m| {
            let both = [solved.system.rest(), positions].map(|x| solved.system.length(x, m));
            (body.mesh.muscles[m].name.clone(), both)
        });
        let lengths_m: Vec<_> = lengths_m.collect();
        let stretch = pulling.first().map_or(1.0, |&m| lengths_m[m].1[1] / lengths_m[m].1[0]);
        let pull = ("tension_n_per_m", tension);
        let alone = Self::new(name, pull, (&solved, body), stretch, (&body.mesh, positions));
        Ok(Self { tensions, lengths_m, ..alone })
    }

    /// The effect of the muscles of this name on both sides with an activation, on the midsagittal `section` of the body; `tell` is as
    /// in [`Solved::in_space`].
    pub fn in_space(
        body: &Body<3>,
        model: &SpaceModel,
        section: &Mesh<2>,
        (name, activation): (&str, f64),
        tell: &dyn Fn(&str),
    ) -> Result<Self, SimulationError> {
        let refused = |e: String| SimulationError::Refused(format!("--activation: {e}"));
        let activations = body.activations(&[(name, activation)]).map_err(|e| refused(e.to_string()))?;
        let solved = Solved::in_space(body, model, &activations, false, tell)?;
        let (rest, positions) = (&body.mesh.nodes, &solved.positions);
        let surface = body.mesh.surface_nodes();
        let [before_mm, after_mm] = [rest, positions].map(|x| {
            let sides = surface.iter().map(|&n| 1e3 * x[n].y);
            let [low, high] = sides.fold([0.0_f64; 2], |[low, high], y| [low.min(y), high.max(y)]);
            high - low
        });
        let first = body.both_sides(name).map_err(|e| refused(e.to_string()))?[0];
        let [a, b] = body.mesh.muscles[first].ends();
        let stretch = (positions[b] - positions[a]).norm() / (rest[b] - rest[a]).norm();
        let flat = solved.midsagittal_positions();
        let alone = Self::new(name, ("activation", activation), (&solved, body), stretch, (section, &flat));
        Ok(Self { wider_mm: Some(after_mm - before_mm), ..alone })
    }

    fn new<const D: usize>(
        name: &str,
        pull: (&'static str, f64),
        (solved, body): (&Solved<D>, &Body<D>),
        stretch: f64,
        (section, positions): (&Mesh<2>, &[Point]),
    ) -> Self {
        let surface = section.surface_nodes();
        let sides: [fn(&Point) -> f64; 3] = [|p| -p.x, |p| p.y, |p| p.x];
        let moved_mm = sides.map(|of| {
            let at_rest = |node: &usize| of(&section.nodes[*node]);
            let most = surface.iter().max_by(|a, b| at_rest(a).total_cmp(&at_rest(b)));
            let node = most.copied().unwrap_or_default();
            let way = positions[node] - section.nodes[node];
            // Forward is towards smaller x.
            [-1e3 * way.x, 1e3 * way.y]
        });
        Self {
            name: name.to_owned(),
            status: solved.found.solution.status,
            alarms: solved.alarms(body),
            stretch,
            moved_mm,
            wider_mm: None,
            positions: positions.to_vec(),
            tensions: Vec::new(),
            pull,
            lengths_m: Vec::new(),
        }
    }

    pub fn alarm_texts(&self) -> String {
        self.alarms.iter().map(Alarm::to_string).collect::<Vec<_>>().join("; ")
    }

    /// Its rows of `muscles.csv`: in the plane one for every muscle of the body, in space one.
    pub fn rows(&self) -> Vec<Value> {
        if self.lengths_m.is_empty() {
            return vec![self.row(json!({}), self.stretch)];
        }
        let rows = self.lengths_m.iter().map(|(muscle, [rest, length])| {
            let of_muscle =
                json!({ "muscle": muscle, "rest_length_mm": 1e3 * rest, "length_mm": 1e3 * length });
            self.row(of_muscle, length / rest)
        });
        rows.collect()
    }

    /// A row with the lengths of a muscle and its stretch.
    fn row(&self, muscle: Value, stretch: f64) -> Value {
        let [tip, top, root] = self.moved_mm;
        let (name, pull) = self.pull;
        let moved = json!({
            "stretch": stretch,
            "tip_forward_mm": tip[0], "tip_up_mm": tip[1],
            "top_forward_mm": top[0], "top_up_mm": top[1],
            "root_forward_mm": root[0], "root_up_mm": root[1],
        });
        let parts = [
            json!({ "pulling": self.name }),
            json!({ name: pull }),
            json!({ "status": self.status }),
            muscle,
            moved,
            self.wider_mm.map_or_else(|| json!({}), |mm| json!({ "wider_mm": mm })),
            json!({ "alarms": self.alarm_texts() }),
        ];
        parts.iter().filter_map(Value::as_object).flatten().map(|(k, v)| (k.clone(), v.clone())).collect()
    }
}
