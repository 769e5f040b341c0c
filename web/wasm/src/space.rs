//! The built-in tongue in space, with both sides activated alike: one half is solved, from the last shape.

use std::sync::Arc;

use serde_json::{Value, json};
use tongue_fit::body::Half;
use tongue_fit::body::{Body, Mesh};
use tongue_fit::report::SimulationRecord;
use tongue_fit::run::Solved;
use tongue_fit::statics::{self, SolveSettings, SolveStatus, Workspace};
use tongue_fit::system::{SpaceModel, System};

/// Most Newton iterations of a frame.
const MOST_ITERATIONS: usize = 60;

/// A body in space, its left half, and its shape.
pub struct Space {
    body: Body<3>,
    half: Half,
    system: Arc<System<3>>,
    workspace: Workspace<3>,
}

impl Space {
    /// The built-in body at rest. Errors are the program's.
    pub fn new() -> Result<Self, String> {
        let body = Body::tongue_in_space(1).map_err(|e| e.to_string())?;
        let half = body.half().ok_or("the two sides of the body differ")?;
        let system = Arc::new(System::of_half(&half, &SpaceModel::default()).map_err(|e| e.to_string())?);
        let workspace = Workspace::new(&system);
        Ok(Self { body, half, system, workspace })
    }

    /// Data for a picture: positions in micrometres, one coordinate after another; muscles of both sides; the faces of the whole surface
    /// and of that of the right half, each with its nodes and the muscles that run through its element; for each muscle its fibres in
    /// elements (index, then half of the fibre in local coordinates) and its lines outside the tissue (two nodes); bones with their nodes.
    pub fn describe(&self) -> Value {
        let groups = self.body.groups();
        let mesh = &self.body.mesh;
        let mut through = vec![Vec::new(); mesh.hexahedra.len()];
        for muscle in &self.body.muscles {
            let group = groups.iter().position(|g| *g == muscle.group);
            muscle.region.iter().for_each(|&e| through[e].extend(group));
        }
        let faces = |of: &[usize]| -> Vec<Value> {
            let hexahedra = of.iter().map(|&e| mesh.hexahedra[e]).collect();
            let faces = Mesh::<3> { hexahedra, ..Mesh::default() }.outward_quadrilaterals();
            faces.into_iter().map(|(e, f)| json!({"nodes": f, "muscles": through[of[e]]})).collect()
        };
        let hundredth = |x: f64| (100.0 * x).round() / 100.0;
        let mut fibres = vec![Vec::new(); groups.len()];
        let mut lines = vec![Vec::new(); groups.len()];
        for (m, muscle) in self.body.muscles.iter().enumerate() {
            let Some(group) = groups.iter().position(|g| *g == muscle.group) else { continue };
            let halves = muscle.region.iter().filter_map(|&e| Some((e, self.body.local_fibre(m, e)?)));
            fibres[group]
                .extend(halves.map(|(e, c)| json!([e, hundredth(c.x), hundredth(c.y), hundredth(c.z)])));
            lines[group].extend(muscle.segments.iter().filter(|s| s.outside).map(|s| s.nodes));
        }
        let bones = self.body.bones.iter().map(|b| json!({"name": b.name, "nodes": b.nodes}));
        let all: Vec<usize> = (0..mesh.hexahedra.len()).collect();
        let is_right = |&e: &usize| mesh.hexahedra[e].iter().map(|&n| mesh.nodes[n].y).sum::<f64>() > 0.0;
        let right: Vec<usize> = all.iter().copied().filter(is_right).collect();
        json!({
            "version": tongue_fit::VERSION,
            "what": self.body.what,
            "muscles": groups,
            "rest_um": micrometres(&mesh.nodes),
            "hexahedra": mesh.hexahedra,
            "fibres": fibres,
            "lines": lines,
            "bones": bones.collect::<Vec<_>>(),
            "faces": faces(&all),
            "cut_faces": faces(&right),
        })
    }

    /// At most `iterations` Newton iterations from the last shape towards the equilibrium of these activations of both sides.
    pub fn frame(&mut self, activations: &[f64], iterations: usize) -> Result<Value, String> {
        let (_, own) = self.activations(activations)?;
        let settings = SolveSettings {
            max_iterations: iterations.clamp(1, MOST_ITERATIONS),
            load_steps: 0,
            ..SolveSettings::default()
        };
        let solution = statics::solve(&self.system, &mut self.workspace, &own, &settings);
        let positions = micrometres(&self.half.positions_of_whole(self.workspace.positions()));
        if !matches!(solution.status, SolveStatus::Converged | SolveStatus::IterationLimit) {
            self.workspace.start_from_rest(&self.system);
        }
        Ok(
            json!({"status": solution.status, "positions_um": positions, "residual_n": solution.max_residual_force}),
        )
    }

    /// The result of `tongue-fit simulate --body space` for these activations of both sides, from which further frames start.
    pub fn settle(&mut self, activations: &[f64]) -> Result<SimulationRecord, String> {
        let (whole, own) = self.activations(activations)?;
        let solved = Solved::of(Arc::clone(&self.system), &own, false);
        self.workspace.start_from_rest(&self.system);
        self.workspace.start_from(&solved.positions);
        let positions = self.half.positions_of_whole(&solved.positions);
        Ok(Solved { positions, pulls: whole, ..solved }.record(&self.body, None))
    }

    /// Activations of all muscles of the body, and of its half, from those of the muscles of both sides.
    fn activations(&self, of_groups: &[f64]) -> Result<(Vec<f64>, Vec<f64>), String> {
        let groups = self.body.groups();
        if of_groups.len() != groups.len() {
            return Err(format!(
                "{} activations are given; there are {} muscles",
                of_groups.len(),
                groups.len()
            ));
        }
        let given: Vec<_> = groups.iter().zip(of_groups.iter().copied()).collect();
        let whole = self.body.activations(&given).map_err(|e| e.to_string())?;
        let own = self.half.activations(&whole).ok_or("the two sides of the body differ")?;
        Ok((whole, own))
    }
}

/// Coordinates of all points, one after another, rounded to micrometres.
fn micrometres(points: &[nalgebra::Vector3<f64>]) -> Vec<i32> {
    points.iter().flat_map(|p| p.iter().map(|x| (1e6 * x).round() as i32)).collect()
}
