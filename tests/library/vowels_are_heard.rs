//! The vocal tract of the reference tongue: the derivatives of formants by nodes and tensions are correct, and only scenes that ask for
//! sound have formants.

use std::sync::Arc;

use nalgebra::Vector3;
use tongue_core::statics::Response;
use tongue_fit::acoustics::{Articulation, FormantFrequency, SpaceVocalTract, Tract, VocalTract};
use tongue_fit::body::{AnyBody, Body};
use tongue_fit::observe::Observable;
use tongue_fit::scene::{self, Scene, build, prepare};
use tongue_fit::statics::{self, SolveSettings, Workspace};
use tongue_fit::system::{Additions, Model, System};

use crate::fixtures::space_block::hexahedra;
use crate::fixtures::{says, solved};

fn pulled() -> (Body<2>, System<2>, Vec<f64>) {
    let body = Body::tongue(5.5e-3).unwrap();
    let all: Vec<usize> = (0..body.mesh.muscles.len()).collect();
    let additions = Additions { incompressible: true, ..Additions::default() };
    let system = System::with_additions(&body.mesh, &Model::default(), &all, additions).unwrap();
    (body, system, vec![10.0, 3.0, 6.0, 2.0, 8.0, 4.0, 7.0, 5.0])
}

const POSTURE: Articulation =
    Articulation { jaw_deg: 3.0, hyoid_mm: [0.0; 2], lip_opening_mm: 9.0, lip_protrusion_mm: 1.0 };

#[test]
fn a_formant_is_an_observable_whose_gradient_is_its_derivative() {
    let (body, system, tensions) = pulled();
    let airway = Arc::new(VocalTract::round(&body, VocalTract::reference().unwrap()).unwrap());
    let positions = solved(&system, &tensions).positions().to_vec();
    for number in 0..4 {
        let formant = FormantFrequency::new(Arc::clone(&airway), POSTURE, number);
        let mut exact = vec![[0.0; 2]; positions.len()];
        formant.gradient(&positions, &mut |n, by| exact[n] = [by.x, by.y]);
        let largest = exact.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        for node in body.mesh.surface_nodes() {
            for axis in 0..2 {
                let at = |h: f64| {
                    let mut moved = positions.clone();
                    moved[node][axis] += h;
                    formant.value(&moved)
                };
                let h = 1e-7;
                let difference = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
                let off = (exact[node][axis] - difference).abs();
                assert!(off <= 1e-6 * largest, "F{} node {node}: {off} of {difference}", number + 1);
            }
        }
    }
}

#[test]
fn derivatives_of_formants_by_tensions_are_the_differences() {
    let (body, system, tensions) = pulled();
    let airway = VocalTract::round(&body, VocalTract::reference().unwrap()).unwrap();
    let settings = SolveSettings::default();
    let mut workspace = Workspace::new(&system);
    let formants = |workspace: &mut Workspace<2>, tensions: &[f64]| -> Vec<f64> {
        let solved = statics::solve(&system, workspace, tensions, &settings);
        assert_eq!(solved.status, statics::SolveStatus::Converged);
        let sound = airway.sound(workspace.positions(), &POSTURE).unwrap();
        sound.formants.iter().map(|f| f.frequency_hz).collect()
    };
    for muscle in 0..tensions.len() {
        let mut at = |by: f64| {
            let mut moved = tensions.clone();
            moved[muscle] += by;
            formants(&mut workspace, &moved)
        };
        let h = 1e-3;
        let [a, b, c, d] = [at(h), at(-h), at(2.0 * h), at(-2.0 * h)];
        formants(&mut workspace, &tensions);
        let sound = airway.sound(workspace.positions(), &POSTURE).unwrap();
        let rates = airway.rates(&sound);
        let exact =
            VocalTract::by_tension(&rates, &mut Response::new(&system, &mut workspace).unwrap(), muscle);
        let largest = exact.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        for (k, exact) in exact.iter().enumerate() {
            let difference = (8.0 * (a[k] - b[k]) - (c[k] - d[k])) / (12.0 * h);
            let off = (exact - difference).abs() / largest;
            assert!(off <= 1e-5, "F{} by muscle {muscle}: {exact} and {difference}, {off:e}", k + 1);
        }
    }
}

#[test]
fn no_acoustics_are_computed_unless_a_scene_asks_for_them() {
    let of = |want: &str, more: &str| {
        let effects = "[effects]\nincompressibility = true";
        let text = format!("title = \"t\"\nwant = \"{want}\"\n[body.tongue]\n{effects}\n{more}");
        let scene = Scene::from_toml(&text, "t.toml").unwrap();
        let AnyBody::Flat(body) = build(&scene, &mut |_| ())? else { panic!() };
        prepare(&scene, body)
    };
    assert!(of("shape", "").unwrap().airway.is_none());
    assert!(of("sound", "[tract]\n").unwrap().airway.is_some());
    for (want, more, why) in [
        ("sound", "", "the lack of [tract]"),
        ("shape", "[tract]\n", "want = \"sound\""),
        ("sound", "[tract]\nlip_opening_mm = -1.0\n", "tract.lip_opening_mm"),
        ("sound", "[tract]\nfile = \"none.toml\"\n", "cannot read \"none.toml\""),
    ] {
        says(of(want, more), why);
    }
    let block =
        "title = \"t\"\nwant = \"sound\"\n[body.block]\nsize_mm = [1.0, 1.0, 1.0]\nh_mm = 0.5\n[tract]\n";
    let scene = Scene::from_toml(block, "t.toml").unwrap();
    assert!(scene::simulate(&scene).unwrap_err().to_string().contains("midsagittal plane"));
}

#[test]
fn a_trajectory_with_a_tract_has_formants_over_time() {
    let text = "title = \"t\"\nwant = \"trajectory\"\n[body.tongue]\n[tensions_n]\nGGp = 40.0\n[tract]\n\
                [effects]\nincompressibility = true\n[trajectory]\nduration_s = 0.3\n";
    let way = scene::simulate(&Scene::from_toml(text, "t.toml").unwrap()).unwrap().trajectory.unwrap();
    let of = |i: usize| way.moments[i].formants_hz.clone().unwrap();
    assert!((of(0)[1] - of(way.moments.len() - 1)[1]).abs() > 1.0);
}

/// A box of hexahedra from x = 0 to 60 mm, 40 mm wide, from z = 0 to 20 mm, with faces in the midsagittal plane.
fn block_in_space() -> Body<3> {
    let place = |[x, y, z]: [f64; 3]| [x / 12.0 * 60e-3, (y / 80.0 - 0.5) * 40e-3, z / 2.0 * 20e-3];
    let mesh = hexahedra([12, 80, 2], place);
    let mut body = Body { what: "a box".to_owned(), mesh, ..Body::default() };
    body.mesh.fixed = vec![0];
    body.mesh.connect();
    body
}

/// A straight wall 10 mm above this box, from x = 55 mm at its back to x = 5 mm at its front.
fn straight_tract(half_width_mm: f64, arch_mm: f64) -> Tract {
    let text = format!(
        "name = \"straight\"\n[[wall]]\nname = \"roof\"\nalpha = [1.0, 1.0]\nbeta = [1.0, 1.0]\n\
         half_width_mm = [{half_width_mm}, {half_width_mm}]\narch_mm = [{arch_mm}, {arch_mm}]\n\
         points_mm = [[55.0, 30.0, 55.0, 10.0], [5.0, 30.0, 5.0, 10.0]]\n\
         [larynx]\nfront_mm = [[80.0, 20.0]]\nfollows_hyoid = 0.5\n[tongue]\nroot_mm = [60.0, 20.0]\ntip_mm = [0.0, 20.0]\n\
         [jaw]\njoint_mm = [70.0, 85.0]\nfloor_mm = [[-5.0, 20.0]]\n[lips]\nlength_mm = 8.0\nwidth_mm = 20.0\n[grid]\nstep_mm = 5.0\n"
    );
    VocalTract::read(&text, "straight.toml").unwrap()
}

#[test]
fn cross_sections_of_a_tongue_in_space_have_the_areas_of_exact_solids() {
    let body = block_in_space();
    let areas =
        |half_width_mm: f64, arch_mm: f64, shape: &dyn Fn(Vector3<f64>) -> Vector3<f64>| -> Vec<f64> {
            let airway = SpaceVocalTract::round(&body, straight_tract(half_width_mm, arch_mm)).unwrap();
            let positions: Vec<_> = body.mesh.nodes.iter().map(|p| shape(*p)).collect();
            let sound = airway.sound(&positions, &Articulation::default()).unwrap();
            let of_tongue = sound.profile.sections.len() - 2;
            sound.profile.sections[..of_tongue].iter().map(|s| 1e6 * s.area_m2).collect()
        };
    let meets = |found: &[f64], exact: f64, relative: f64| {
        assert_eq!(found.len(), 10);
        for area in found {
            assert!((area / exact - 1.0).abs() < relative, "{area} mm2 for {exact}");
        }
    };
    let rest = |p: Vector3<f64>| p;
    meets(&areas(12.0, 0.0, &rest), 2.0 * 12.0 * 10.0, 1e-9);
    // The airway is a parabola above a plane, open at the sides.
    meets(&areas(12.0, 6.0, &rest), 2.0 * 12.0 * (10.0 - 6.0 / 3.0), 1e-3);
    // The airway closes where 20 (y / 16)^2 = 10.
    let closed = 16.0 * 0.5_f64.sqrt();
    meets(&areas(16.0, 20.0, &rest), 2.0 * closed * 10.0 * 2.0 / 3.0, 2e-3);
    // Beside the tongue, which is 40 mm wide, there is no airway.
    meets(&areas(25.0, 0.0, &rest), 40.0 * 10.0, 1e-9);
    // The tongue is a circular cylinder of radius 30 mm along the tract, as high as the box.
    let radius = 30e-3;
    let round = |p: Vector3<f64>| {
        let drop = radius - (radius * radius - p.y * p.y).sqrt();
        Vector3::new(p.x, p.y, p.z - drop * p.z / 20e-3)
    };
    let (r, w) = (30.0_f64, 15.0_f64);
    let segment = w * (r * r - w * w).sqrt() + r * r * (w / r).asin();
    meets(&areas(w, 0.0, &round), 2.0 * w * (10.0 + r) - segment, 1e-3);
    // The tongue is raised on one side only.
    let tilted = |p: Vector3<f64>| Vector3::new(p.x, p.y, p.z + 0.2 * p.y * p.z / 20e-3);
    meets(&areas(12.0, 0.0, &tilted), 2.0 * 12.0 * 10.0, 1e-9);
}

#[test]
fn the_built_in_tongue_in_space_sounds_nearly_as_its_plane_does_at_rest() {
    let plane = Body::tongue(5.5e-3).unwrap();
    let tract = VocalTract::reference().unwrap();
    let flat = VocalTract::round(&plane, tract.clone()).unwrap();
    let flat = flat.sound(&plane.mesh.nodes, &Articulation::default()).unwrap();
    let body = Body::tongue_in_space(1).unwrap();
    let airway = SpaceVocalTract::round(&body, tract.clone()).unwrap();
    let sound = airway.sound(&body.mesh.nodes, &Articulation::default()).unwrap();
    for (i, (space, plane)) in sound.formants.iter().zip(&flat.formants).take(3).enumerate() {
        assert!((space.frequency_hz / plane.frequency_hz - 1.0).abs() < 0.2, "F{}", i + 1);
    }
    let mut without = tract;
    without.wall[1].half_width_mm = None;
    let airway = SpaceVocalTract::round(&body, without).unwrap();
    says(
        airway.sound(&body.mesh.nodes, &Articulation::default()),
        "wall `back wall of the pharynx` has no half_width_mm and arch_mm",
    );
}
