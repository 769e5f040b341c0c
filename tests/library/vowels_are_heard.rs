//! The tract around the reference tongue: the derivatives of formants by nodes and tensions are differences,
//! and the vowels of S2 have the relative positions of Japanese vowels.

use std::sync::Arc;

use tongue_core::statics::Response;
use tongue_fit::body::Body;
use tongue_fit::heard::{Airway, Articulation, Heard, mean_vowels};
use tongue_fit::observe::Observable;
use tongue_fit::scene::body::build;
use tongue_fit::scene::prepare::{SceneExtent, prepare};
use tongue_fit::scene::{self, Scene};
use tongue_fit::statics::{self, SolveSettings, Workspace};
use tongue_fit::system::{Additions, Model, System};

fn pulled() -> (Body<2>, System<2>, Vec<f64>) {
    let body = Body::tongue(5.5e-3).unwrap();
    let all: Vec<usize> = (0..body.mesh.muscles.len()).collect();
    let additions = Additions { incompressible: true, ..Additions::default() };
    let system = System::with(&body.mesh, &Model::default(), &all, additions).unwrap();
    (body, system, vec![10.0, 3.0, 6.0, 2.0, 8.0, 4.0, 7.0, 5.0])
}

const POSTURE: Articulation =
    Articulation { jaw_deg: 3.0, hyoid_mm: [0.0; 2], lip_opening_mm: 9.0, lip_protrusion_mm: 1.0 };

#[test]
fn a_formant_is_an_observable_whose_gradient_is_its_derivative() {
    let (body, system, tensions) = pulled();
    let airway = Arc::new(Airway::round(&body, Airway::drawn().unwrap()).unwrap());
    let mut workspace = Workspace::new(&system);
    statics::solve(&system, &mut workspace, &tensions, &SolveSettings::default());
    let positions = workspace.positions().to_vec();
    for number in 0..4 {
        let formant = Heard::new(Arc::clone(&airway), POSTURE, number);
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
                assert!(
                    (exact[node][axis] - difference).abs() <= 1e-6 * largest,
                    "F{} node {node}: {} and {difference}",
                    number + 1,
                    exact[node][axis]
                );
            }
        }
    }
}

#[test]
fn derivatives_of_formants_by_tensions_are_the_differences() {
    let (body, system, tensions) = pulled();
    let airway = Airway::round(&body, Airway::drawn().unwrap()).unwrap();
    let settings = SolveSettings::default();
    let mut workspace = Workspace::new(&system);
    let formants = |workspace: &mut Workspace<2>, tensions: &[f64]| -> Vec<f64> {
        assert_eq!(
            statics::solve(&system, workspace, tensions, &settings).status,
            statics::SolveStatus::Converged
        );
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
        let exact = Airway::by_tension(&rates, &mut Response::new(&system, &mut workspace).unwrap(), muscle);
        let largest = exact.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        for (k, exact) in exact.iter().enumerate() {
            let difference = (8.0 * (a[k] - b[k]) - (c[k] - d[k])) / (12.0 * h);
            let off = (exact - difference).abs() / largest;
            assert!(off <= 1e-5, "F{} by muscle {muscle}: {exact} and {difference}, {off:e}", k + 1);
        }
    }
}

fn spoken(vowel: &str) -> Scene {
    let posture = Airway::drawn().unwrap().posture[vowel];
    let fit = match vowel {
        "ɯ" => String::new(),
        _ => format!("[fit]\nsubject = \"S2\"\nvowel = \"{vowel}\"\ntarget = \"stretch\"\n"),
    };
    let text = format!(
        "title = \"t\"\nwant = \"sound\"\n[body.tongue]\n{fit}[tract]\nlip_opening_mm = {}\nlip_protrusion_mm = {}\n\
         [effects]\nincompressibility = true\njaw = {{ opening_deg = {} }}\n",
        posture.lip_opening_mm, posture.lip_protrusion_mm, posture.jaw_deg
    );
    Scene::from_toml(&text, "t.toml").unwrap()
}

#[test]
fn the_vowels_of_s2_lie_to_each_other_as_vowels_do() {
    let means = mean_vowels().unwrap();
    let heard: Vec<(String, Vec<f64>)> = means
        .iter()
        .map(|m| (m.vowel.clone(), scene::simulate(&spoken(&m.vowel)).unwrap().sound.unwrap().formants_hz))
        .collect();
    let most = |of: &dyn Fn(&[f64]) -> f64| {
        heard.iter().max_by(|a, b| of(&a.1).total_cmp(&of(&b.1))).map(|(v, _)| v.as_str()).unwrap()
    };
    assert_eq!(most(&|f| f[0]), "a", "{heard:?}");
    assert_eq!(most(&|f| f[1]), "i", "{heard:?}");
    assert_eq!(most(&|f| -f[1]), "o", "{heard:?}");
}

#[test]
fn no_acoustics_are_computed_unless_a_scene_asks_for_them() {
    let made = |text: &str| {
        let scene = Scene::from_toml(text, "t.toml").unwrap();
        let tongue_fit::body::AnyBody::Flat(body) = build(&scene.body).unwrap() else { panic!() };
        prepare(&scene, body, SceneExtent::Pruned)
    };
    let of = |want: &str, more: &str| {
        made(&format!(
            "title = \"t\"\nwant = \"{want}\"\n[body.tongue]\n[effects]\nincompressibility = true\n{more}"
        ))
    };
    assert!(of("shape", "").unwrap().airway.is_none());
    assert!(of("sound", "[tract]\n").unwrap().airway.is_some());
    let refused = |want: &str, more: &str| of(want, more).unwrap_err().to_string();
    assert!(refused("sound", "").contains("the lack of [tract]"));
    assert!(refused("shape", "[tract]\n").contains("want = \"sound\""));
    assert!(refused("sound", "[tract]\nlip_opening_mm = -1.0\n").contains("tract.lip_opening_mm"));
    assert!(refused("sound", "[tract]\nfile = \"none.toml\"\n").contains("cannot read \"none.toml\""));
    let block =
        "title = \"t\"\nwant = \"sound\"\n[body.block]\nsize_mm = [1.0, 1.0, 1.0]\nh_mm = 0.5\n[tract]\n";
    let scene = Scene::from_toml(block, "t.toml").unwrap();
    assert!(scene::simulate(&scene).unwrap_err().to_string().contains("midsagittal plane"));
}

#[test]
fn a_trajectory_with_a_tract_has_formants_over_time() {
    let text = "title = \"t\"\nwant = \"trajectory\"\n[body.tongue]\n[tensions_n]\nGGa = 12.0\n[tract]\n\
                [effects]\nincompressibility = true\n[trajectory]\nduration_s = 0.3\n";
    let way = scene::simulate(&Scene::from_toml(text, "t.toml").unwrap()).unwrap().trajectory.unwrap();
    let of = |i: usize| way.moments[i].formants_hz.clone().unwrap();
    assert!((of(0)[0] - of(way.moments.len() - 1)[0]).abs() > 1.0);
}
