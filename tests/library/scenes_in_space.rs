//! Scenes with the tongue in space: weight, palate, jaw and hyoid act on it as they do in the plane.

use nalgebra::Vector3;
use tongue_core::body::largest_distance;
use tongue_fit::body::Body;
use tongue_fit::scene::{self, Scene, SceneOutcome};
use tongue_fit::statics::Connection;
use tongue_fit::system::{Model, SpaceModel, System};
use tongue_infer::inverse::alarms::Alarm;

use crate::fixtures::solved;

fn run(rest: &str) -> SceneOutcome {
    let text = format!("title = \"t\"\nwant = \"shape\"\n[body.tongue-in-space]\n{rest}");
    let answer = scene::simulate(&Scene::from_toml(&text, "t.toml").unwrap()).unwrap();
    assert!(answer.converged, "{rest}");
    answer
}

fn refused(text: &str) -> String {
    let scene = Scene::from_toml(&format!("title = \"t\"\nwant = \"shape\"\n{text}"), "t.toml");
    scene.and_then(|scene| scene::simulate(&scene)).unwrap_err().to_string()
}

#[test]
fn surgery_in_a_scene_is_that_of_simulate_with_the_loads_of_the_scene() {
    let surgery = "[surgery]\noperate = [\"left:box:-20,20,-40,40,15,60\"]\nfilling = \"flap\"\n";
    let activations = "[activations]\nGGP = 0.15\nTRANS = 0.1\n";
    let plain = run(&format!("{activations}{surgery}")).operation.unwrap();
    let body = Body::tongue_in_space(1).unwrap();
    let text = format!("title = \"t\"\nwant = \"shape\"\n[body.tongue-in-space]\n{surgery}");
    let wanted = Scene::from_toml(&text, "t.toml").unwrap().surgery.unwrap();
    let operated = wanted.operate(&body).unwrap();
    let system = System::in_space(&operated.body, &SpaceModel::default()).unwrap();
    let all = body.activations(&[("GGP", 0.15), ("TRANS", 0.1)]).unwrap();
    let left: Vec<f64> = operated.muscles.iter().map(|&m| all[m]).collect();
    let tip = body.tip().unwrap();
    let moved = (solved(&system, &left).positions()[tip] - body.mesh.nodes[tip]) * 1e3;
    let after = Vector3::from(plain.tip_after_mm.unwrap());
    assert!((moved - after).norm() < 1e-3, "{moved} {after}");
    assert!(plain.tip_before_mm[1].abs() < 1e-4 && plain.deviation_mm.unwrap().abs() > 0.2, "{plain:?}");

    // A supine speaker whose muscles make up for the surgery as far as they can.
    let loaded =
        format!("{activations}{surgery}make_up = true\n[effects]\ngravity = {{ posture = \"supine\" }}\n");
    let loaded = run(&loaded);
    // Newton's method meets an unstable equilibrium on its way, so the tensions were raised in steps from the shape under weight.
    assert_eq!(loaded.solution.unwrap().connection, Connection::Traced);
    let loaded = loaded.operation.unwrap();
    assert!(
        (Vector3::from(loaded.tip_after_mm.unwrap()) - after).norm() > 0.1,
        "weight moves it: {loaded:?}"
    );
    let missed = Vector3::from(loaded.tip_after_mm.unwrap()) - Vector3::from(loaded.tip_before_mm);
    assert!(loaded.made_up_to_mm.unwrap() < missed.norm());
    assert!(loaded.made_up_status.is_some() && loaded.made_up_starts.unwrap()[1] > 1, "{loaded:?}");
    // What is wrong with these activations is a reason not to trust the whole answer.
    let mut strained = loaded.clone();
    strained.made_up_alarms = vec![Alarm::FarFromData { rms_mm: 20.0 }];
    assert_eq!(strained.doubts().count(), loaded.doubts().count() + 1 - loaded.made_up_alarms.len());
    assert!(loaded.made_up_by.unwrap().0.iter().any(|(name, a)| name.ends_with("_L") && *a > 0.0));
}

#[test]
fn hexahedra_from_gmsh_are_a_body_of_scenes() {
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/gmsh/hexahedra_41.msh");
    let text = format!(
        "title = \"t\"\nwant = \"shape\"\n[body.tongue-in-space]\nfile = \"{mesh}\"\n[activations]\nA = 0.3\n"
    );
    let found = scene::simulate(&Scene::from_toml(&text, "t.toml").unwrap()).unwrap();
    assert!(found.converged && found.plan.body.contains("hexahedra_41"), "{}", found.plan.body);
    assert!(found.muscles.iter().any(|m| m.muscle == "A_L" && m.stretch < 0.97));
}

/// Positions in the axes of the body: y to the right, z upwards.
fn positions(answer: &SceneOutcome) -> Vec<Vector3<f64>> {
    answer.positions_m.iter().map(|p| Vector3::new(p[0], -p[2], p[1])).collect()
}

#[test]
fn a_scene_moves_the_tongue_as_its_muscles_do_alone() {
    let answer = run("[activations]\nGGP = 0.1\nTRANS_L = 0.05\n");
    let body = Body::tongue_in_space(1).unwrap();
    let system = System::in_space(&body, &SpaceModel::default()).unwrap();
    let activations = body.activations(&[("GGP", 0.1), ("TRANS_L", 0.05)]).unwrap();
    let apart = largest_distance(solved(&system, &activations).positions(), &positions(&answer));
    assert!(apart < 1e-7, "{apart}");
    let active: Vec<&str> =
        answer.muscles.iter().filter(|m| m.pull.value() > 0.0).map(|m| m.muscle.as_str()).collect();
    assert_eq!(active, ["GGP_L", "GGP_R", "TRANS_L"]);
}

#[test]
fn bones_carry_the_weight_of_the_tongue() {
    let answer = run("[effects]\ngravity = { posture = \"supine\" }\n");
    let volume: f64 = Body::tongue_in_space(1).unwrap().mesh.hexahedron_volumes().sum();
    let weight = volume * Model::default().density * 9.81;
    let on_bones = answer.on_bones_n.as_ref().unwrap();
    assert!((on_bones[0] / weight - 1.0).abs() < 0.01, "{on_bones:?} {weight}");
    assert!(on_bones[1].abs().max(on_bones[2].abs()) < 1e-6 * weight, "{on_bones:?}");
    // In a supine speaker the tongue sinks to the back, symmetrically.
    let (rest, now) = (Body::tongue_in_space(1).unwrap(), positions(&answer));
    let tip = rest.tip().unwrap();
    let way = now[tip] - rest.mesh.nodes[tip];
    assert!(way.x > 1e-4 && way.y.abs() < 1e-8, "{way}");
}

#[test]
fn palate_and_teeth_stop_a_tongue_that_would_pass_them() {
    let muscles = "[activations]\nGGP = 0.05\nTRANS = 0.2\n";
    let free = run(muscles);
    let stopped = run(&format!("{muscles}[effects.contact]\n"));
    let surface = Body::tongue_in_space(1).unwrap().mesh.surface_nodes();
    let foremost = |answer: &SceneOutcome| {
        let places = positions(answer);
        surface.iter().map(|&n| places[n].x).fold(0.0, f64::min)
    };
    let contact = stopped.contact.as_ref().unwrap();
    assert!(foremost(&stopped) > foremost(&free) + 0.5e-3, "{} {}", foremost(&stopped), foremost(&free));
    assert!(contact.touching > 0 && contact.closest_mm > 0.0 && !contact.edge_through_wall, "{contact:?}");
    assert!(contact.on_wall_n[1] > 0.0, "{contact:?}");
}

#[test]
fn jaw_and_hyoid_carry_what_is_attached_to_them() {
    let answer = run("[effects]\njaw = { opening_deg = 5.0 }\nhyoid = { shift_mm = [-2.0, 1.0] }\n");
    let body = Body::tongue_in_space(1).unwrap();
    let now = positions(&answer);
    let moved = |bone: &str| {
        let nodes = &body.bones.iter().find(|b| b.name == bone).unwrap().nodes;
        nodes.iter().map(|&n| (now[n] - body.mesh.nodes[n]) * 1e3).collect::<Vec<_>>()
    };
    assert!(moved("hyoid").iter().all(|way| (way - Vector3::new(-2.0, 0.0, 1.0)).norm() < 1e-9));
    // The mental spine is 110 mm from the joint, so 5 degrees lower it by 9.6 mm.
    let spine = moved("mandible").iter().map(Vector3::norm).fold(0.0, f64::max);
    assert!((spine - 9.6).abs() < 1.5, "{spine}");
}

#[test]
fn what_space_does_not_have_and_surgery_that_cannot_be_is_refused() {
    let flap = "operate = [\"left:box:-20,20,-40,40,15,60\"]\nfilling = \"flap\"";
    for (of_space, why) in [
        ("[tensions_n]\nGGp = 1.0", "give [activations] from 0 to 1"),
        ("[activations]\nGGP = 1.5", "it must lie between 0 and 1"),
        ("[activations]\nGGX = 0.1", "there is no muscle \"GGX\""),
        ("[material]\npoisson_ratio = 0.3", "material.poisson_ratio"),
        ("folder = \"no/such\"", "no/such: cannot be read"),
        ("file = \"none.msh\"", "cannot read the mesh \"none.msh\""),
        ("file = \"a.msh\"\nfolder = \"b\"", "each is a body"),
        ("[surgery]\noperate = [\"ball:0,0,0,12\"]\nfilling = \"removed\"", "may not remove a bone"),
        ("[surgery]\noperate = [\"ball:900,0,0,1\"]\nfilling = \"flap\"", "no element"),
        ("[surgery]\noperate = [\"ball:0,0,0,-1\"]\nfilling = \"flap\"", "-1"),
        ("[surgery]\noperate = [\"GGX_L\"]\nfilling = \"flap\"", "GGX_L"),
        ("[surgery]\noperate = [\"GGP_L\"]", "there is no value for `filling`"),
        ("[surgery]\noperate = []\nfilling = \"flap\"", "no region is given"),
        ("[surgery]\noperate = [\"ball:1,2\"]\nfilling = \"flap\"", "a ball has four numbers"),
        ("[surgery]\noperate = [\"GGP_L\"]\nfilling = \"scar\"\nscar = 0.0", "scar is 0"),
        (
            "[surgery]\noperate = [\"GGP_L\"]\nfilling = \"scar\"\nscar = 1e6",
            "scar is 1000000; it must be above 0",
        ),
    ] {
        let message = refused(&format!("[body.tongue-in-space]\n{of_space}\n"));
        assert!(message.contains(why), "{message}");
    }
    assert!(refused("[body.tongue]\n[activations]\nGGP = 0.1\n").contains("give tensions_n"));
    let message = refused(&format!("[body.tongue]\n[surgery]\n{flap}\n"));
    assert!(message.contains("only [body.tongue-in-space] is operated"), "{message}");
}
