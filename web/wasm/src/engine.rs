//! A body that is solved repeatedly.

use std::sync::Arc;

use nalgebra::SVector;
use serde::Deserialize;
use serde_json::{Value, json};
use tongue_fit::acoustics::{Articulation, Formant, VocalTract, mean_vowels};
use tongue_fit::body::{Body, HYOID, MANDIBLE, MeshContent};
use tongue_fit::effect::Contact;
use tongue_fit::geometry;
use tongue_fit::measured::{Dataset, Muscles, Vowel};
use tongue_fit::report::SimulationRecord;
use tongue_fit::run::{BodySource, Kind, PlaneBody, Solved};
use tongue_fit::scene::{Hyoid, JOINT_MM, Jaw, Scene, prepare};
use tongue_fit::simulation::read_tensions;
use tongue_fit::statics::{self, SolveSettings, SolveStatus, Workspace};
use tongue_fit::system::{Model, PrescribedDisplacement, System};

use crate::space::Space;

/// Origin of a body.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyText {
    /// The name of the user's own body in messages, and its text: an anatomy (TOML), or the JSON of `tongue-fit mesh --json`.
    #[serde(default)]
    pub file: String,
    #[serde(default)]
    pub anatomy: Option<String>,
    #[serde(default)]
    pub mesh: Option<String>,
    /// Mesh spacing, mm.
    pub h_mm: f64,
    #[serde(default)]
    pub continuum: bool,
}

impl BodyText {
    fn plane(&self) -> PlaneBody {
        let origin = self.file.clone();
        let source = match (&self.mesh, &self.anatomy) {
            (Some(text), _) => BodySource::Mesh { content: MeshContent::Json(text.clone()), origin },
            (None, Some(text)) => BodySource::Anatomy { toml: text.clone(), origin },
            (None, None) => BodySource::Tongue,
        };
        let kind = if self.continuum { Kind::Continuum } else { Kind::Springs };
        PlaneBody { source, kind, spacing_m: Some(self.h_mm * 1e-3) }
    }
}

/// Values of a frame that are not tensions, lengths or positions: jaw, hyoid and lips as input, other results as output.
const POSTURE: usize = 5;
const FINDINGS: usize = 5;
const FORMANTS: usize = 5;

/// A body, the loads on it, and its shape.
pub struct Engine {
    pub body: Body<2>,
    pub model: Model,
    pub data: Dataset,
    /// The scene as it was opened, with the origin of the body.
    scene: Scene,
    system: Arc<System<2>>,
    workspace: Workspace<2>,
    /// Palate and teeth, if the body has them; `surface` are the nodes of the surface that are on no bone.
    wall: Option<Contact>,
    surface: Vec<usize>,
    /// The tract around the body, if the body has a tongue's outline.
    airway: Option<VocalTract>,
    /// Whether the next posture can start from this one.
    settled: bool,
    /// The tongue in space, once a request has named it.
    space: Option<Space>,
}

impl Engine {
    /// A body at rest, with the table of lengths for comparison. Errors are the program's.
    pub fn new(text: &BodyText, scene: Scene, data: Option<Dataset>) -> Result<Self, String> {
        let body = text.plane().make(&mut |_| ()).map_err(|e| e.to_string())?;
        let model = scene.model();
        let system = system(&scene, &body, &[])?;
        let workspace = Workspace::new(&system);
        let data = match data {
            Some(data) => data,
            None => Dataset::reference().map_err(|e| e.to_string())?,
        };
        // The built-in tract does not fit the user's own body.
        let own = text.mesh.is_some() || text.anatomy.is_some();
        let round = || VocalTract::round(&body, VocalTract::reference().ok()?).ok();
        let airway = if own { None } else { round() };
        let held = system.held();
        let surface: Vec<usize> =
            body.mesh.surface_nodes().into_iter().filter(|node| !held.contains(node)).collect();
        let wall = body.palate.as_ref().map(|outline| Contact::new(outline.clone(), &[], 0.0, 1e-3));
        Ok(Self {
            body,
            model,
            data,
            scene,
            system,
            workspace,
            wall,
            surface,
            airway,
            settled: true,
            space: None,
        })
    }

    /// The built-in tongue in space. Errors are the program's.
    pub fn space(&mut self) -> Result<&mut Space, String> {
        let space = match self.space.take() {
            Some(space) => space,
            None => Space::new()?,
        };
        Ok(self.space.insert(space))
    }

    /// Jaw, hyoid and lips of a vowel, in upper or lower case, if the body has a tract whose file has that vowel.
    pub fn posture(&self, vowel: &Vowel) -> Option<Articulation> {
        let mut postures = self.airway.as_ref()?.tract.posture.iter();
        let found = postures.find(|(name, _)| name.parse::<Vowel>().is_ok_and(|v| v.is_like(vowel)))?;
        Some(*found.1)
    }

    /// The scene as it was opened.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Data for a picture: positions, m, and indices of nodes.
    pub fn describe(&self) -> Value {
        let mesh = &self.body.mesh;
        let names = mesh.muscle_names();
        let muscles: Vec<Value> = mesh
            .muscles
            .iter()
            .zip(Muscles::built_in().info(&names))
            .zip(self.system.lengths(self.system.rest()))
            .map(|((m, info), length)| {
                json!({"name": m.name, "nodes": m.nodes, "full_name": info.full_name, "colour": info.colour, "rest_length_m": length})
            })
            .collect();
        let inside = mesh.in_tissue();
        let edges: Vec<_> = mesh.connections.iter().filter(|c| c.iter().all(|&n| inside[n])).collect();
        let points = |points: &[SVector<f64, 2>]| points.iter().map(|p| [p.x, p.y]).collect::<Vec<_>>();
        json!({
            "version": tongue_fit::VERSION,
            "what": self.body.what,
            "nodes_m": points(&mesh.nodes),
            "outlines": geometry::outlines(mesh.cells.iter()),
            "edges": edges,
            "muscles": muscles,
            "bones": self.body.bones.iter().map(|b| json!({"name": b.name, "nodes": b.nodes})).collect::<Vec<_>>(),
            "fixed": mesh.fixed,
            "palate_m": self.body.palate.as_deref().map(points),
            "joint_mm": JOINT_MM,
            "continuum": mesh.continuum.is_some(),
            "tract": self.airway.as_ref().map(|a| &a.tract),
            "means": mean_vowels().unwrap_or_default(),
        })
    }

    /// Sets loads, such as weight and walls. Errors are the program's.
    pub fn act(&mut self, mut scene: Scene) -> Result<(), String> {
        // Bones are moved with every frame.
        (scene.effects.jaw, scene.effects.hyoid) = (None, None);
        let system = system(&scene, &self.body, &[])?;
        let mut workspace = Workspace::new(&system);
        workspace.start_from(self.workspace.positions());
        (self.system, self.workspace, self.scene) = (system, workspace, scene);
        Ok(())
    }

    pub fn numbers(&self) -> usize {
        let positions = 2 * self.body.mesh.nodes.len();
        POSTURE.max(FINDINGS) + self.system.muscle_count() * 2 + positions + 2 * FORMANTS + 1
    }

    /// Solves one posture from the last one. On input `numbers` has the opening of the jaw (degrees), the displacement of the hyoid (mm),
    /// opening and protrusion of the lips (mm; without an opening there is no sound), and from index 5 the tension of every muscle (N per
    /// metre of thickness). On output the first five are the smallest and the largest ratio of a triangle's area to that at rest, the
    /// number of elements in which the barrier acts, the iterations, and the largest residual force (N/m). After the tensions come the
    /// length of every muscle (m), the positions (m), the frequencies and then the bandwidths of the formants (Hz; zero without sound), and
    /// how far the tongue is beyond palate or teeth (m). NaN on input counts as zero.
    pub fn frame(&mut self, numbers: &mut [f64]) -> bool {
        let muscles = self.system.muscle_count();
        if numbers.len() != self.numbers() {
            return false;
        }
        let finite = |x: f64| if x.is_finite() { x } else { 0.0 };
        let (jaw, hyoid) = (finite(numbers[0]), [finite(numbers[1]), finite(numbers[2])]);
        let tensions: Vec<f64> =
            numbers[FINDINGS..FINDINGS + muscles].iter().map(|t| finite(*t).max(0.0)).collect();
        let (jaw, lips) = (jaw.clamp(-60.0, 60.0), [finite(numbers[3]), finite(numbers[4])]);
        self.carry(jaw, hyoid);
        if !self.settled {
            self.workspace.start_from_rest(&self.system);
        }
        let solution =
            statics::solve(&self.system, &mut self.workspace, &tensions, &SolveSettings::default());
        self.settled = solution.status == SolveStatus::Converged;
        let positions = self.workspace.positions();
        let (low, high) = self.system.cell_ratios(positions);
        let found =
            [low, high, solution.guarded as f64, solution.iterations as f64, solution.max_residual_force];
        numbers[..FINDINGS].copy_from_slice(&found);
        let rest = &mut numbers[FINDINGS + muscles..];
        let lengths = self.system.lengths(positions);
        let heard = self.airway.as_ref().filter(|_| lips[0] > 0.0).and_then(|airway| {
            let [lip_opening_mm, lip_protrusion_mm] = lips;
            let posture = Articulation { jaw_deg: jaw, hyoid_mm: hyoid, lip_opening_mm, lip_protrusion_mm };
            airway.sound(positions, &posture).ok()
        });
        let formants = heard.map(|sound| sound.formants).unwrap_or_default();
        let of = |number: fn(&Formant) -> f64| {
            let all = formants.iter().map(number).chain(std::iter::repeat(0.0));
            all.take(FORMANTS).collect::<Vec<_>>()
        };
        let values = lengths.into_iter().chain(positions.iter().flat_map(|p| [p.x, p.y]));
        let values = values.chain(of(|f| f.frequency_hz)).chain(of(|f| f.bandwidth_hz));
        let values = values.chain([self.beyond(positions)]);
        rest.iter_mut().zip(values).for_each(|(to, value)| *to = value);
        self.settled
    }

    /// How far the surface is beyond palate or teeth, m: the largest distance from them of a node whose straight way from rest crosses
    /// them, or 0.
    fn beyond(&self, positions: &[SVector<f64, 2>]) -> f64 {
        let Some(wall) = &self.wall else { return 0.0 };
        let passed = |&&n: &&usize| {
            let way = [self.system.rest()[n], positions[n]];
            wall.first_penetration(&way, &[[0, 1]]).is_some()
        };
        self.surface.iter().filter(passed).map(|&n| wall.distance(&positions[n])).fold(0.0, f64::max)
    }

    /// The tension of every muscle, N per metre of thickness, from texts such as `GGa=12`; 0 for muscles without one. Errors are the
    /// program's.
    pub fn tensions(&self, words: &[String]) -> Result<Vec<f64>, String> {
        let mut all = vec![0.0; self.body.mesh.muscles.len()];
        let given = read_tensions(words, &self.body).map_err(|e| e.to_string())?;
        given.into_iter().for_each(|(m, tension)| all[m] = tension);
        Ok(all)
    }

    /// Sets the positions to a shape that was solved elsewhere, from which the next posture starts; refuses another number of nodes.
    pub fn place(&mut self, positions_m: &[[f64; 2]]) -> Result<(), String> {
        let finite = positions_m.iter().flatten().all(|x| x.is_finite());
        if !finite || positions_m.len() != self.body.mesh.nodes.len() {
            return Err("these are positions of another body".to_owned());
        }
        self.workspace.start_from(&positions_m.iter().map(|p| SVector::from(*p)).collect::<Vec<_>>());
        Ok(())
    }

    fn carry(&mut self, opening_deg: f64, hyoid_mm: [f64; 2]) {
        let turned = PrescribedDisplacement::Turned {
            joint: SVector::from(JOINT_MM) * 1e-3,
            angle: opening_deg.to_radians(),
        };
        let shifted = PrescribedDisplacement::Shifted(SVector::from(hyoid_mm) * 1e-3);
        for (bone, displacement) in [(MANDIBLE, turned), (HYOID, shifted)] {
            for &node in self.body.bone(bone) {
                let rest = self.system.rest()[node];
                self.workspace.displace_bone(&self.system, &[node], displacement.place(rest) - rest);
            }
        }
    }

    /// The result of `tongue-fit simulate` in a scene, with tensions from texts such as `GGa=12`. Errors are the program's.
    pub fn simulate(&mut self, words: &[String], scene: Scene) -> Result<SimulationRecord, String> {
        let given = read_tensions(words, &self.body).map_err(|e| e.to_string())?;
        let scene = checked(scene)?;
        let system = system(&scene, &self.body, &given.iter().map(|(m, _)| *m).collect::<Vec<_>>())?;
        let mut tensions = vec![0.0; system.muscle_count()];
        given.iter().for_each(|(m, tension)| tensions[*m] = *tension);
        Ok(Solved::of(system, &tensions, false).record(&self.body, None))
    }
}

/// The system of a scene in which the muscles `pulling` can contract; all if it is empty.
fn system(scene: &Scene, body: &Body<2>, pulling: &[usize]) -> Result<Arc<System<2>>, String> {
    let names = body.mesh.muscles.iter().enumerate();
    let pulls = names.filter(|(m, _)| pulling.is_empty() || pulling.contains(m));
    let tensions_n = pulls.map(|(_, m)| (m.name.clone(), 0.0)).collect();
    let scene = Scene { tensions_n, ..scene.clone() };
    prepare(&scene, body.clone()).map(|p| p.system).map_err(|e| e.to_string())
}

/// Removes a jaw that is not opened and a hyoid that is not displaced, and checks the scene.
fn checked(mut scene: Scene) -> Result<Scene, String> {
    scene.check().map_err(|e| e.to_string())?;
    scene.effects.jaw = scene.effects.jaw.filter(|Jaw { opening_deg, .. }| *opening_deg != 0.0);
    scene.effects.hyoid = scene.effects.hyoid.filter(|Hyoid { shift_mm }| *shift_mm != [0.0; 2]);
    Ok(scene)
}
