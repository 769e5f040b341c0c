//! ArtiSynth's tongue against its own recordings and against an independent program with the same law, if its files are beside the
//! repository (`../shared/reference/artisynth_tongue3d`). Tests without these files are in [`super::bodies_in_space`].

use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use tongue_fit::body::{Body, artisynth};
use tongue_fit::statics::Workspace;
use tongue_fit::system::{MusclesAs, SpaceModel, System};

use crate::fixtures::solved;

const TIP: usize = 919;
/// The nodes of ArtiSynth's recordings, in their order.
pub const RECORDED: [usize; 22] = [
    338, 339, 340, 341, 919, 359, 926, 361, 751, 752, 753, 754, 772, 774, 166, 301, 299, 141, 579, 554, 712,
    714,
];
/// Order of the excitations in the recordings.
const EXCITED: [&str; 11] = ["GGP", "GGM", "GGA", "STY", "GH", "MH", "HG", "VERT", "TRANS", "IL", "SL"];
/// Displacement of the tip (x back, z up, mm) from an independent program, for each muscle at a = 0.1 on both sides, without stiffening:
/// with lines from node to node, and with stress along fibres.
const LINES_MM: [[f64; 2]; 11] = [
    [-3.85, -5.50],
    [-3.05, -2.82],
    [-4.08, -10.76],
    [8.93, 0.23],
    [-0.09, -0.86],
    [1.23, 3.05],
    [14.60, 11.93],
    [-1.79, -3.64],
    [-2.54, -0.39],
    [4.68, -5.85],
    [17.53, 17.42],
];
const STRESS_MM: [[f64; 2]; 11] = [
    [-3.87, -5.53],
    [-3.29, -2.93],
    [-4.12, -10.28],
    [11.89, -3.84],
    [-0.08, -0.38],
    [1.70, 4.15],
    [14.34, 11.59],
    [-1.68, -4.29],
    [-3.18, -0.18],
    [4.04, -4.93],
    [18.25, 17.48],
];
/// Displacements for lines with ArtiSynth's stiffening.
const STIFFENED_MM: [(&str, [f64; 2]); 4] =
    [("GGP", [-3.50, -4.60]), ("TRANS", [-1.88, -0.53]), ("HG", [12.96, 11.12]), ("SL", [13.56, 15.33])];

/// The rows of a recording of ArtiSynth: time (s) and numbers. The first two lines describe its form.
pub fn recording(path: &Path) -> Vec<(f64, Vec<f64>)> {
    let text = std::fs::read_to_string(path).unwrap();
    let lines = text.lines().filter(|line| !line.trim().is_empty() && !line.starts_with('#'));
    let numbers = lines.skip(2).map(|line| line.split_whitespace().map(|word| word.parse().unwrap()));
    numbers.map(|mut row| (row.next().unwrap(), row.collect())).collect()
}

pub fn folder() -> Option<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/reference/artisynth_tongue3d");
    if !folder.is_dir() {
        eprintln!("skipped: ArtiSynth's tongue is not at {}", folder.display());
        return None;
    }
    Some(folder)
}

fn tongue() -> Option<Body<3>> {
    folder().map(|folder| artisynth::read(&folder).unwrap())
}

/// The equilibrium of muscles by name, from rest.
fn equilibrium(body: &Body<3>, system: &System<3>, given: &[(&str, f64)]) -> Workspace<3> {
    solved(system, &body.activations(given).unwrap())
}

/// The displacement of the tip, mm.
fn tip_mm(body: &Body<3>, w: &Workspace<3>) -> Vector3<f64> {
    (w.positions()[TIP] - body.mesh.nodes[TIP]) * 1e3
}

#[test]
fn the_files_are_read_as_they_are() {
    let Some(body) = tongue() else { return };
    assert_eq!((body.mesh.nodes.len(), body.mesh.hexahedra.len(), body.muscles.len()), (948, 740, 21));
    assert_eq!(body.mesh.fixed.len(), 115 + 2);
    let volume: f64 = body.mesh.hexahedron_volumes().sum();
    assert!((volume * 1e6 - 102.29).abs() < 0.005, "{volume}");
    let width = body.mesh.nodes[..946].iter().map(|p| p.y).fold(0.0, f64::max);
    assert!((2e3 * width - 64.9).abs() < 0.1, "{width}");
    // Forces of muscles as stresses, kPa.
    let names = "GGP_L GGM_L GGA_L STY_L GH_R MH_R HG_R VERT_L TRANS_L IL_R SL";
    let stresses = [49.8, 57.1, 74.7, 385.0, 162.0, 154.0, 245.0, 12.3, 15.9, 126.0, 51.6];
    for (name, kpa) in names.split(' ').zip(stresses) {
        let muscle = &body.muscles[body.both_sides(name).unwrap()[0]];
        assert!((muscle.stress_pa / (1e3 * kpa) - 1.0).abs() < 3e-3, "{name} {}", muscle.stress_pa);
    }
}

#[test]
fn each_muscle_moves_the_tip_as_in_an_independent_program() {
    let Some(body) = tongue() else { return };
    let lines = SpaceModel { muscles: MusclesAs::Lines, ..SpaceModel::default() };
    let system = System::in_space(&body, &lines).unwrap();
    for (name, [x, z]) in EXCITED.into_iter().zip(LINES_MM) {
        let w = equilibrium(&body, &system, &[(name, 0.1)]);
        let tip = tip_mm(&body, &w);
        assert!((tip.x - x).abs() < 0.01 && (tip.z - z).abs() < 0.01 && tip.y.abs() < 0.01, "{name} {tip}");
    }
    let stiffened = System::in_space(&body, &SpaceModel { stiffening: 9.0, ..lines }).unwrap();
    for (name, [x, z]) in STIFFENED_MM {
        let w = equilibrium(&body, &stiffened, &[(name, 0.1)]);
        let tip = tip_mm(&body, &w);
        assert!((tip.x - x).abs() < 0.01 && (tip.z - z).abs() < 0.01, "stiffened {name} {tip}");
    }
    // Each muscle at full activation.
    for name in EXCITED {
        let w = equilibrium(&body, &stiffened, &[(name, 1.0)]);
        assert!(stiffened.cell_ratios(w.positions()).0 > 0.5, "{name} at 1");
    }
}

#[test]
fn stress_along_fibres_moves_the_tip_nearly_as_much() {
    let Some(body) = tongue() else { return };
    let system = System::in_space(&body, &SpaceModel::default()).unwrap();
    for (name, [x, z]) in EXCITED.into_iter().zip(STRESS_MM) {
        let w = equilibrium(&body, &system, &[(name, 0.1)]);
        let (tip, other) = (tip_mm(&body, &w), Vector3::new(x, 0.0, z));
        let apart = (tip - other).norm() / other.norm();
        assert!(apart < 0.0145, "{name} {tip} {apart}");
    }
}

#[test]
fn excitations_that_artisynth_recorded_bring_its_points_where_it_recorded_them() {
    let Some((body, folder)) = tongue().zip(folder()) else { return };
    let excited = recording(&folder.join("protrude_excitations.txt"));
    let reached = recording(&folder.join("protrude_model_target_position.txt"));
    let model = SpaceModel { muscles: MusclesAs::Lines, stiffening: 9.0, ..SpaceModel::default() };
    let system = System::in_space(&body, &model).unwrap();
    // At half the time the targets are farthest from their start.
    let at = |row: &[f64], i: usize| Vector3::new(row[3 * i], row[3 * i + 1], row[3 * i + 2]);
    let first = &reached[0].1;
    let rms = |difference: &dyn Fn(usize) -> Vector3<f64>| {
        ((0..22).map(|i| difference(i).norm_squared()).sum::<f64>() / 22.0).sqrt() * 1e3
    };
    let moved = |row: &[f64]| rms(&|i| at(row, i) - at(first, i));
    let (turn, row) =
        reached.iter().enumerate().max_by(|a, b| moved(&a.1.1).total_cmp(&moved(&b.1.1))).unwrap();
    let excitations = &excited[turn].1;
    let given: Vec<_> = EXCITED.into_iter().zip(excitations.iter().map(|a| a.clamp(0.0, 1.0))).collect();
    let w = equilibrium(&body, &system, &given);
    let apart = rms(&|i| w.positions()[RECORDED[i]] - at(&row.1, i));
    let whole = moved(&row.1);
    assert!((apart - 0.11).abs() < 0.005 && (whole - 6.11).abs() < 0.005, "{apart} {whole}");
}
