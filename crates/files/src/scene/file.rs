//! Scene files in TOML (loads and wanted results), of which some are built in.
//!
//! Lengths are in mm, angles in degrees, everything else in SI units; keys contain their units.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::effects::Effects;
use crate::run::{Kind, STEP_ERROR_MM};
use crate::simulation::SimulationError;
use crate::surgery::Surgery;
use tongue_core::choice;
use tongue_core::toml_text::{self, Misread};
use tongue_infer::acoustics::Articulation;
use tongue_infer::standard_deviations::TENSION_N;
use tongue_input::bodies::Unit;
use tongue_input::measured::recording::CONTOUR_SD_M;

/// A scene.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// One line that describes the scene.
    pub title: String,
    /// Origin of the numbers, and remarks.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub note: String,
    /// The wanted result; it decides what is computed.
    pub want: Want,
    /// The body.
    pub body: SceneBody,
    /// Constants of the tissue.
    #[serde(default)]
    pub material: Material,
    /// Contractile tensions by muscle, N (2D: per metre of thickness). Other muscles are passive tissue.
    #[serde(default)]
    pub tensions_n: BTreeMap<String, f64>,
    /// Activations by muscle, 0 to 1, of a tongue in space: of both sides (`GGP`) or of one (`GGP_L`).
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub activations: BTreeMap<String, f64>,
    /// Measured lengths to fit, instead of tensions.
    pub fit: Option<FitTarget>,
    /// Points measured on the tongue to fit, instead of tensions.
    pub points: Option<Points>,
    /// Effects on the body.
    #[serde(default)]
    pub effects: Effects,
    /// Surgery of a tongue in space: the result is after it, and is compared with the one before.
    pub surgery: Option<Surgery>,
    /// Duration of the motion; for `want = "trajectory"`.
    pub trajectory: Option<SceneTrajectory>,
    /// The tract around the tongue; for `want = "sound"`, and for a trajectory with formants.
    pub tract: Option<SceneTract>,
}

/// The wanted result of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Want {
    /// The lengths of the muscles at equilibrium.
    Lengths,
    /// The whole shape at equilibrium.
    Shape,
    /// The shape over time.
    Trajectory,
    /// The vowel: areas of the tract around the tongue, its formants, and their derivatives by tensions.
    Sound,
}

/// The body.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SceneBody {
    /// The reference tongue, in the midsagittal plane.
    Tongue(SceneTongue),
    /// The tongue in space, of hexahedra: x to the back, y upwards, z to the left of the speaker.
    TongueInSpace(SceneSpace),
    /// A mesh from a file: Gmsh's (.msh), in the plane or in space, or the JSON of `tongue-fit mesh --json`.
    Mesh(MeshFile),
    /// A solid cylinder of tissue that stands on its fixed base (z = 0), with axial muscle fibres called `axial`.
    Cylinder(Cylinder),
    /// A solid block of tissue that stands on its fixed base (z = 0).
    Block(Block),
}

/// The reference tongue.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneTongue {
    /// Mesh spacing, mm; default 5.5, also for a continuum.
    #[serde(default = "default_spacing")]
    pub h_mm: f64,
    /// `springs` or `continuum`.
    #[serde(default, skip_serializing_if = "Kind::is_default")]
    pub kind: Kind,
}

/// A tongue in space.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SceneSpace {
    /// A folder with the files of ArtiSynth's tongue, used instead of the built-in tongue.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub folder: Option<String>,
    /// A mesh of hexahedra from Gmsh (.msh), used instead of the built-in tongue: x to the back, y to the right, z upwards.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Unit of the coordinates in that file: `m` or `mm`.
    pub unit: Unit,
    /// Whether every hexahedron is cut in eight.
    pub refined: bool,
}

/// A mesh file.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshFile {
    /// Its path, from the current folder; a name that ends in .msh is Gmsh's.
    pub file: String,
    /// Unit of the coordinates in a .msh file: `m` or `mm`.
    #[serde(default)]
    pub unit: Unit,
    /// `springs` or `continuum`.
    #[serde(default, skip_serializing_if = "Kind::is_default")]
    pub kind: Kind,
}

/// A cylinder along z.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cylinder {
    /// Radius, mm.
    pub radius_mm: f64,
    /// Length, mm.
    pub length_mm: f64,
    /// Mesh spacing, mm.
    pub h_mm: f64,
    /// `springs` or `continuum`, each fibre a line of its own.
    #[serde(default, skip_serializing_if = "Kind::is_default")]
    pub kind: Kind,
}

/// A block with a corner at the origin.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Block {
    /// Extent along x, y and z, mm.
    pub size_mm: [f64; 3],
    /// Mesh spacing, mm.
    pub h_mm: f64,
    /// `springs` or `continuum`.
    #[serde(default, skip_serializing_if = "Kind::is_default")]
    pub kind: Kind,
}

impl SceneBody {
    /// A tongue in space has no such choice and counts as the default.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Tongue(SceneTongue { kind, .. })
            | Self::Mesh(MeshFile { kind, .. })
            | Self::Cylinder(Cylinder { kind, .. })
            | Self::Block(Block { kind, .. }) => *kind,
            Self::TongueInSpace(_) => Kind::default(),
        }
    }
}

/// Physical constants; by default those of table 4.1 of the thesis.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Young's modulus, Pa.
    pub young_modulus_pa: Option<f64>,
    /// Poisson's ratio.
    pub poisson_ratio: Option<f64>,
    /// Density, kg/m³.
    pub density_kg_per_m3: Option<f64>,
    /// Viscosity, Pa s.
    pub viscosity_pa_s: Option<f64>,
}

/// Measured lengths to fit.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FitTarget {
    /// Subject, S1 to S4.
    pub subject: String,
    /// Vowel: i, e, a, o or ɯ.
    pub vowel: String,
    /// `ratio` (to GGa) or `stretch` (to the subject's own /ɯ/).
    #[serde(default = "default_kind")]
    pub target: String,
}

/// Points of one posture in the frame of the body, measured on the surface of the tongue in the midsagittal plane. The tensions of all
/// muscles are found as in `tongue-fit track`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Points {
    /// Points somewhere on the surface, in order from root to tip, mm.
    pub contour_mm: Vec<[f64; 2]>,
    /// Points that are fixed to the surface.
    pub sensors: Vec<Sensor>,
    /// Standard deviation of every coordinate, mm.
    pub noise_mm: f64,
    /// Scale of the prior of the tensions, N per metre of thickness, as `--prior` of `track`.
    pub prior_n_per_m: f64,
}

impl Default for Points {
    fn default() -> Self {
        let noise_mm = CONTOUR_SD_M * 1e3;
        Self { contour_mm: Vec::new(), sensors: Vec::new(), noise_mm, prior_n_per_m: TENSION_N }
    }
}

/// A sensor on the tongue.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Distance behind the tip along the surface at rest, mm.
    pub surface_mm: f64,
    /// Measured position, mm.
    pub at_mm: [f64; 2],
}

/// Duration of a motion. It starts at rest, without weight and tension, with the bones at their places in the scene.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneTrajectory {
    /// Duration, s.
    pub duration_s: f64,
    /// Time in which the tensions grow, s; zero is a step.
    #[serde(default)]
    pub ramp_s: f64,
    /// Error allowed in each step, mm.
    #[serde(default = "default_tolerance")]
    pub tolerance_mm: f64,
}

fn default_spacing() -> f64 {
    5.5
}

fn default_kind() -> String {
    "ratio".to_owned()
}

fn default_tolerance() -> f64 {
    STEP_ERROR_MM
}

impl Scene {
    /// Reads a scene; `origin` is its name in messages, usually its path.
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, SimulationError> {
        toml_text::read(text).map_err(|Misread { line, column, problem }| {
            let problem = if problem.starts_with("wanted exactly 1 element") {
                "[body] takes exactly one of tongue, tongue-in-space, mesh, cylinder and block".to_owned()
            } else {
                toml_text::with_nearest(&problem)
            };
            SimulationError::Refused(format!("{origin}:{line}:{column}: {problem}"))
        })
    }

    /// The JSON schema of scene files, with which editors complete and check them.
    pub fn schema() -> schemars::Schema {
        schemars::schema_for!(Scene)
    }
}

const SHIPPED: [(&str, &str); 17] = [
    ("vowel-a", include_str!("../../../../targets/scenes/vowel-a.toml")),
    ("vowel-a-jaw", include_str!("../../../../targets/scenes/vowel-a-jaw.toml")),
    ("vowel-a-trajectory", include_str!("../../../../targets/scenes/vowel-a-trajectory.toml")),
    ("fit-vowel-a", include_str!("../../../../targets/scenes/fit-vowel-a.toml")),
    ("vowel-i-palate", include_str!("../../../../targets/scenes/vowel-i-palate.toml")),
    ("supine", include_str!("../../../../targets/scenes/supine.toml")),
    ("protrusion", include_str!("../../../../targets/scenes/protrusion.toml")),
    ("only-gga", include_str!("../../../../targets/scenes/only-gga.toml")),
    ("only-ggm", include_str!("../../../../targets/scenes/only-ggm.toml")),
    ("only-ggp", include_str!("../../../../targets/scenes/only-ggp.toml")),
    ("only-sgp", include_str!("../../../../targets/scenes/only-sgp.toml")),
    ("only-sgm", include_str!("../../../../targets/scenes/only-sgm.toml")),
    ("only-sga", include_str!("../../../../targets/scenes/only-sga.toml")),
    ("only-hga", include_str!("../../../../targets/scenes/only-hga.toml")),
    ("only-hgp", include_str!("../../../../targets/scenes/only-hgp.toml")),
    ("cylinder-3d", include_str!("../../../../targets/scenes/cylinder-3d.toml")),
    ("block-3d", include_str!("../../../../targets/scenes/block-3d.toml")),
];

pub fn names() -> impl Iterator<Item = &'static str> + Clone {
    SHIPPED.iter().map(|(name, _)| *name)
}

pub fn shipped(name: &str) -> Result<Scene, SimulationError> {
    let unknown = || format!("unknown scene \"{name}\"; {}", choice::hint(name, names()));
    let scene = SHIPPED.iter().find(|(n, _)| *n == name);
    let (name, text) = scene.ok_or_else(|| SimulationError::Refused(unknown()))?;
    Scene::from_toml(text, &format!("targets/scenes/{name}.toml (embedded)"))
}

/// The tract around the tongue. `effects.jaw` and `effects.hyoid` move its jaw and larynx.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SceneTract {
    /// Its file, from the current folder; by default the tract of the reference tongue.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Height of the opening between the lips, mm.
    pub lip_opening_mm: f64,
    /// Protrusion of the lips, mm.
    pub lip_protrusion_mm: f64,
}

impl Default for SceneTract {
    fn default() -> Self {
        let Articulation { lip_opening_mm, lip_protrusion_mm, .. } = Articulation::default();
        Self { file: None, lip_opening_mm, lip_protrusion_mm }
    }
}
