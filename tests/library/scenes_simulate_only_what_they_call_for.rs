//! Scenes: parts that are left out change nothing, disabled effects cost nothing, enabled effects are correct, and contradictions are
//! reported.

use nalgebra::Vector2;
use tongue_fit::body::{AnyBody, Body};
use tongue_fit::dynamics::MotionStatus;
use tongue_fit::inverse;
use tongue_fit::scene::{self, Prepared, Scene, SceneOutcome, Want, build, prepare, run, simulate};
use tongue_fit::statics::Workspace;
use tongue_fit::system::{Model, System};
use tongue_fit::track::TongueSurface;

use crate::fixtures::{self, says, solve};

const TONGUE: &str = "title = \"t\"\nwant = \"shape\"\n[body.tongue]\nh_mm = 5.5\n";
const CYLINDER: &str =
    "title = \"t\"\nwant = \"shape\"\n[body.cylinder]\nradius_mm = 10.0\nlength_mm = 30.0\nh_mm = 10.0\n";

fn flat(scene: &Scene) -> Body<2> {
    match build(scene, &mut |_| ()).unwrap() {
        AnyBody::Flat(built) => built,
        AnyBody::Solid(_) => panic!("{} is solid", scene.title),
    }
}

fn planned(text: &str) -> (Scene, Prepared<2>) {
    let scene = Scene::from_toml(text, "test").unwrap();
    let prepared = prepare(&scene, flat(&scene)).unwrap();
    (scene, prepared)
}

fn outcome(text: &str) -> SceneOutcome {
    let (scene, mut prepared) = planned(text);
    run(&scene, &mut prepared).unwrap()
}

fn solved<const D: usize>(prepared: &Prepared<D>) -> Workspace<D> {
    fixtures::solved(&prepared.system, &prepared.tensions)
}

/// The scene in which every muscle pulls, if only with 0 N, with weight of zero strength and a wall that nothing reaches.
fn everything<const D: usize>(scene: &Scene, body: &Body<D>) -> Scene {
    let mut all = scene.clone();
    for muscle in &body.mesh.muscles {
        all.tensions_n.entry(muscle.name.clone()).or_insert(0.0);
    }
    let down = if D == 2 { "[0.0, -1.0]" } else { "[0.0, -1.0, 0.0]" };
    let idle = format!(
        "{TONGUE}[effects]\ngravity = {{ direction = {down}, acceleration_m_per_s2 = 0.0 }}\ncontact = {{ outline_mm = [[-200.0, 200.0], [200.0, 200.0]] }}\n"
    );
    let idle = Scene::from_toml(&idle, "test").unwrap().effects;
    all.effects.gravity = all.effects.gravity.or(idle.gravity);
    all.effects.contact = all.effects.contact.or(idle.contact.filter(|_| body.palate.is_some()));
    all
}

/// Compares the equilibrium of a scene as planned with that of the scene with all effects, and with the end of its motion.
fn compare_with_everything<const D: usize>(name: &str, scene: &Scene, body: &Body<D>) {
    let prepared = |scene: &Scene| prepare(scene, body.clone()).unwrap();
    let mut pruned = prepared(scene);
    if scene.fit.is_some() {
        assert!(run(scene, &mut pruned).unwrap().converged, "{name}");
        return;
    }
    let full = prepared(&everything(scene, body));
    let elements = |p: &Prepared<D>| p.system.effects().iter().map(|e| e.elements()).sum::<usize>();
    assert!(elements(&pruned) <= elements(&full), "{name}");
    let planned = solved(&pruned);
    // Passive muscles with three elements move differently from tissue, so that of a trajectory only the equilibrium is compared.
    if scene.want != Want::Trajectory {
        let everything = solved(&full);
        let apart = planned.positions().iter().zip(everything.positions()).map(|(p, q)| (p - q).norm());
        assert!(apart.fold(0.0, f64::max) < 1e-9, "{name}");
    }
    // The slowest mode of the tissue takes about a second, in space several seconds.
    let long = format!("{TONGUE}[trajectory]\nduration_s = 200.0\nramp_s = 0.0\ntolerance_mm = 1e-6\n");
    let trajectory = Scene::from_toml(&long, "test").unwrap().trajectory;
    let moving = Scene { want: Want::Trajectory, trajectory, ..everything(scene, body) };
    let end = run(&moving, &mut prepared(&moving)).unwrap();
    assert_eq!(end.trajectory.unwrap().outcome.status, MotionStatus::Completed, "{name}");
    for (p, q) in planned.positions().iter().zip(&end.positions_m) {
        assert!(p.iter().zip(q).all(|(a, b)| (a - b).abs() < 1e-9), "{name}");
    }
}

#[test]
fn the_parts_left_out_of_shipped_scenes_do_not_change_their_answers() {
    for name in scene::names() {
        let scene = scene::shipped(name).unwrap();
        match build(&scene, &mut |_| ()).unwrap() {
            AnyBody::Flat(built) => compare_with_everything(name, &scene, &built),
            AnyBody::Solid(built) => compare_with_everything(name, &scene, &built),
        }
    }
}

#[test]
fn an_effect_that_is_off_costs_nothing() {
    let (_, prepared) =
        planned(&format!("{TONGUE}[tensions_n]\nGGa = 12.0\n[effects]\nincompressibility = true\n"));
    let plain = System::new(&prepared.body.mesh, &Model::default(), &[0]).unwrap();
    let names = |s: &System<2>| s.effects().iter().map(|e| (e.name(), e.elements())).collect::<Vec<_>>();
    assert_eq!(names(&prepared.system), names(&plain));
    assert_eq!(prepared.system.pattern().matrix_blocks(), plain.pattern().matrix_blocks());
    assert_eq!(prepared.system.pattern().blocks(), plain.pattern().blocks());
    let (solution, workspace) = solve(&prepared.system, &prepared.tensions);
    let (plain_solution, other) = solve(&plain, &prepared.tensions);
    assert_eq!(solution, plain_solution, "the same work, and the same bits");
    assert_eq!(workspace.positions(), other.positions());

    // Without incompressibility only its cells are missing.
    let (_, loose) = planned(&format!("{TONGUE}[tensions_n]\nGGa = 12.0\n"));
    let fewer: Vec<_> = names(&plain).into_iter().filter(|(n, _)| *n != "incompressibility").collect();
    assert_eq!(names(&loose.system), fewer);
}

#[test]
fn an_effect_of_zero_strength_is_as_good_as_absent() {
    let base = format!("{TONGUE}[tensions_n]\nGGp = 45.0\n[effects]\nincompressibility = true\n");
    let (_, prepared) = planned(&base);
    let without = solved(&prepared);
    // Weight and wall of zero strength are tested in `the_parts_left_out_of_shipped_scenes_do_not_change_their_answers`.
    for effect in ["jaw = { opening_deg = 0.0 }", "hyoid = { shift_mm = [0.0, 0.0] }"] {
        let (_, prepared) = planned(&format!("{base}{effect}\n"));
        let workspace = solved(&prepared);
        for (p, q) in workspace.positions().iter().zip(without.positions()) {
            assert!((p - q).norm() < 1e-9, "{effect}: {p} {q}");
        }
    }
}

#[test]
fn the_plan_says_what_is_simulated_and_why_not() {
    let scene = scene::shipped("vowel-a").unwrap();
    let plan = prepare(&scene, flat(&scene)).unwrap().plan;
    let on: Vec<_> = plan.effects.iter().filter(|e| e.simulated).map(|e| e.effect).collect();
    assert_eq!(on, ["springs", "muscle", "incompressibility", "straight paths", "bone"]);
    assert!(plan.effect("inertia").unwrap().why.contains("equilibrium is wanted"));
    assert_eq!(plan.effect("incompressibility").unwrap().elements, 188);
    assert_eq!(plan.unknowns, 2 * (123 - 4 - 10), "nodes less bones and inner nodes of straight paths");
    assert!(plan.factor_nonzeros < plan.nonzeros * 2 && plan.factor_operations > 0);
    let contracting: Vec<_> = plan.muscles.iter().filter(|m| m.contracting).map(|m| &m.muscle).collect();
    assert_eq!(contracting, ["GGa", "SGm", "HGa"]);
    assert!(plan.muscles[1].why.contains("passive: its connections are tissue"));

    let moving = scene::shipped("vowel-a-trajectory").unwrap();
    let plan = prepare(&moving, flat(&moving)).unwrap().plan;
    for effect in ["inertia", "viscosity", "muscle dynamics"] {
        assert!(plan.effect(effect).unwrap().simulated, "{effect}");
    }
    // A connection that contracts has no damper in parallel with its spring.
    let [viscosity, springs] = ["viscosity", "springs"].map(|effect| plan.effect(effect).unwrap().elements);
    assert!(viscosity == springs && springs > 0);
    let asked = Scene::from_toml(&format!("{TONGUE}[effects]\ninertia = true\n"), "test").unwrap();
    let plan = prepare(&asked, flat(&asked)).unwrap().plan;
    let inertia = plan.effect("inertia").unwrap();
    assert!(!inertia.simulated && inertia.why.starts_with("asked for, but"), "{}", inertia.why);
}

#[test]
fn a_fit_in_a_scene_is_the_fit_of_the_main_flow() {
    let scene = scene::shipped("fit-vowel-a").unwrap();
    let mut prepared = prepare(&scene, flat(&scene)).unwrap();
    let target = prepared.target.clone().unwrap().target;
    let mesh = prepared.body.mesh.clone();
    let there = run(&scene, &mut prepared).unwrap();
    let here = inverse::fit(&mesh, &Model::default(), &target, &inverse::FitSettings::default()).unwrap();
    assert_eq!(there.pulls.values(), &here.tensions());
}

#[test]
fn the_palate_holds_the_tongue_back_and_lets_no_node_through() {
    let [free, walled] = ["", "contact = {}\n"].map(|effect| {
        outcome(&format!("{TONGUE}[tensions_n]\nGGp = 90.0\n[effects]\nincompressibility = true\n{effect}"))
    });
    assert!(free.converged && free.contact.is_none());
    assert!(walled.converged, "{:?}", walled.contact);
    let contact = walled.contact.as_ref().unwrap();
    assert!(contact.touching > 1 && contact.closest_mm > 0.0, "{contact:?}");
    // The forces on wall and bones cancel, because there are no other external forces.
    for (wall, bone) in contact.on_wall_n.iter().zip(walled.on_bones_n.as_ref().unwrap()) {
        assert!((wall + bone).abs() < 1e-7, "{wall} {bone}");
    }
    let front = |o: &SceneOutcome| o.positions_m.iter().map(|p| p[0]).fold(f64::INFINITY, f64::min);
    assert!(front(&free) < front(&walled) - 1e-3, "{} {}", front(&free), front(&walled));
}

#[test]
fn the_jaw_takes_the_genioglossus_along_and_the_hyoid_its_muscles() {
    let with = |effect: &str| outcome(&format!("{TONGUE}[effects]\nincompressibility = true\n{effect}\n"));
    let jaw = with("jaw = { opening_deg = 10.0 }");
    assert!(jaw.converged && jaw.min_cell_ratio > 0.5, "{jaw:?}");
    let [x, y] = scene::JOINT_MM;
    let (sin, cos) = 10f64.to_radians().sin_cos();
    // At rest the mental spine is at the origin.
    let spine = [x - cos * x + sin * y, y - sin * x - cos * y];
    let found = jaw.positions_m.iter().any(|p| (1e3 * p[0] - spine[0]).hypot(1e3 * p[1] - spine[1]) < 1e-9);
    assert!(found, "{spine:?}");
    assert!(spine[0] > 0.0 && spine[1] < 0.0, "opening takes the chin back and down");

    let hyoid = with("hyoid = { shift_mm = [-3.0, 6.0] }");
    assert!(hyoid.converged, "{hyoid:?}");
    let rest = flat(&Scene::from_toml(TONGUE, "test").unwrap()).mesh;
    let held = |n: usize| Vector2::from_column_slice(&hyoid.positions_m[n]) - rest.nodes[n];
    let moved = rest.fixed.iter().filter(|&&n| (held(n) - Vector2::new(-3e-3, 6e-3)).norm() < 1e-15).count();
    let still = rest.fixed.iter().filter(|&&n| held(n).norm() == 0.0).count();
    assert_eq!((moved, still), (2, 2));
}

#[test]
fn a_cylinder_with_axial_fibres_shortens_and_thickens_and_keeps_its_volume() {
    let scene = scene::shipped("cylinder-3d").unwrap();
    let AnyBody::Solid(built) = build(&scene, &mut |_| ()).unwrap() else { panic!("a cylinder is solid") };
    let rest = built.mesh.nodes.clone();
    let result = run(&scene, &mut prepare(&scene, built).unwrap()).unwrap();
    assert!(result.converged);
    assert!(result.muscles[0].stretch < 0.9, "{:?}", result.muscles);
    assert!((result.measure_ratio - 1.0).abs() < 0.01, "{}", result.measure_ratio);
    let radius = |z: &dyn Fn(usize) -> f64, r: &dyn Fn(usize) -> f64| {
        (0..rest.len()).filter(|&i| z(i) > 0.019 && z(i) < 0.021).map(r).fold(0.0, f64::max)
    };
    let before = radius(&|i| rest[i].z, &|i| rest[i].x.hypot(rest[i].y));
    let after = radius(&|i| rest[i].z, &|i| result.positions_m[i][0].hypot(result.positions_m[i][1]));
    assert!(after > 1.04 * before, "{before} {after}");
}

#[test]
fn the_published_schema_is_that_of_the_program() {
    let published: serde_json::Value =
        serde_json::from_str(include_str!("../../targets/scenes/scene.schema.json")).unwrap();
    let own = serde_json::to_value(Scene::schema()).unwrap();
    assert_eq!(published, own, "run `tongue-fit scene schema`");
}

/// A built-in scene whose body is a continuum.
fn as_continuum(name: &str) -> String {
    let path = format!("{}/targets/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap().replace("incompressibility = true\n", "");
    let text = text.replace("h_mm = 5.5\n", "h_mm = 8.0\nkind = \"continuum\"\n");
    text.replace("h_mm = 3.4\n", "h_mm = 10.0\nkind = \"continuum\"\n")
        .replace("h_mm = 5.0\n", "h_mm = 15.0\nkind = \"continuum\"\n")
}

#[test]
fn a_continuum_has_weight_walls_displaced_bones_and_motion_as_every_body() {
    let plain = outcome(&as_continuum("vowel-a"));
    // The last two are solids of ten-node tetrahedra, which contract and sag.
    let names =
        ["vowel-a-jaw", "vowel-i-palate", "supine", "protrusion", "fit-vowel-a", "cylinder-3d", "block-3d"];
    for name in names {
        let done = simulate(&Scene::from_toml(&as_continuum(name), "test").unwrap()).unwrap();
        assert!(done.converged && done.min_cell_ratio > 0.5, "{name}: {:?}", done.solution);
    }
    let (_, jaw) = planned(&as_continuum("vowel-a-jaw"));
    let names: Vec<&str> = jaw.system.effects().iter().map(|e| e.name()).collect();
    assert!(names.contains(&"quadratic elements") && names.contains(&"fibres"), "{names:?}");
    // Nodes touch the palate and do not pass it.
    let (_, palate) = planned(&as_continuum("vowel-i-palate"));
    let workspace = solved(&palate);
    let wall = palate.wall.as_ref().unwrap();
    assert!(wall.first_penetration(workspace.positions(), &palate.body.mesh.connections).is_none());
    // The trajectory ends at the equilibrium if the viscous tissue has enough time.
    let motion = as_continuum("vowel-a-trajectory").replace("duration_s = 3.0", "duration_s = 60.0");
    let motion = outcome(&motion);
    assert!(motion.converged);
    let idle: Vec<_> = motion.plan.effects.iter().filter(|e| e.simulated && e.elements == 0).collect();
    assert!(idle.is_empty(), "{idle:?}");
    let ends = motion.positions_m.iter().zip(&plain.positions_m);
    let apart = ends.map(|(p, q)| (p[0] - q[0]).hypot(p[1] - q[1])).fold(0.0, f64::max);
    assert!(apart < 1e-5, "{apart:e} m");
}

#[test]
fn a_trajectory_starts_at_rest_with_its_bones_where_they_are_displaced() {
    let start = |effects: &str| {
        let (scene, mut prepared) = planned(&format!(
            "{}[trajectory]\nduration_s = 0.01\n[tensions_n]\nGGa = 5.0\n[effects]\nincompressibility = true\n\
             gravity = {{ posture = \"upright\" }}\n{effects}",
            TONGUE.replace("shape", "trajectory")
        ));
        run(&scene, &mut prepared)
    };
    let lengths = |o: SceneOutcome| {
        assert!(o.converged && o.on_bones_n.is_none() && o.time_by_effect.len() > 2, "{o:?}");
        o.trajectory.unwrap().moments[0].lengths_mm.clone()
    };
    let still = lengths(start("").unwrap());
    let nearly = lengths(start("jaw = { opening_deg = 1e-9 }\n").unwrap());
    for (a, b) in still.iter().zip(&nearly) {
        assert!((a - b).abs() < 1e-6, "a jaw that does not move changes the start: {a} {b}");
    }
    assert!((lengths(start("jaw = { opening_deg = 5.0 }\n").unwrap())[0] - still[0]).abs() > 0.1);
    // The mandible would move the origin of the tongue through the lower end of the outline.
    let error = start("jaw = { opening_deg = -25.0 }\ncontact = {}\n").unwrap_err().to_string();
    assert!(error.contains("effects.jaw") && error.contains("before the motion began"), "{error}");
}

#[test]
fn a_muscle_pulls_whatever_the_case_of_its_name() {
    let muscles = |name: &str| outcome(&format!("{TONGUE}[tensions_n]\n{name} = 12.0\n")).muscles;
    assert_eq!(muscles("gga"), muscles("GGa"));
}

#[test]
fn weight_acts_in_its_direction_of_any_length() {
    let sag = |direction: &str| {
        let text = "[effects]\nincompressibility = true\ngravity = { direction = ";
        outcome(&format!("{TONGUE}{text}{direction} }}\n")).positions_m
    };
    let plain = sag("[1.0, 1.0]");
    for long in ["[1e200, 1e200]", "[1e-200, 1e-200]"] {
        assert_eq!(sag(long), plain, "{long}");
    }
}

/// Each scene with the parts of its message.
#[test]
fn contradictions_are_named() {
    let without_times = TONGUE.replace("shape", "trajectory");
    let motion = |more: &str| format!("{without_times}{more}\n[trajectory]\nduration_s = 1.0\n");
    let tongue = |more: &str| format!("{TONGUE}{more}\n");
    let effect = |of: &str| format!("{TONGUE}[effects]\n{of}\n");
    let wall = |of: &str| effect(&format!("contact = {{ {of} }}"));
    let continuum = |of: &str| format!("{TONGUE}kind = \"continuum\"\n[effects]\n{of}\n");
    let cylinder = |more: &str| format!("{CYLINDER}{more}\n");
    let fit = "[fit]\nsubject = \"S2\"\nvowel = \"a\"";
    let points = "[points]\ncontour_mm = [[1, 2], [3, 4], [5, 6]]";
    let contour = |points: &str| {
        tongue(&format!("[points]\ncontour_mm = {points}\n[effects]\nincompressibility = true"))
    };
    let cases = [
        (motion("[material]\ndensity_kg_per_m3 = 0.0"), "want = \"trajectory\"; density_kg_per_m3 = 0; mass"),
        (motion("[effects]\ninertia = false"), "want = \"trajectory\"; effects.inertia = false"),
        (without_times.clone(), "trajectory; lack of [trajectory]; duration_s"),
        (tongue("[trajectory]\nduration_s = 1.0"), "[trajectory]; want"),
        (motion("") + "ramp_s = 2.0\n", "trajectory.ramp_s; trajectory.duration_s; below their values"),
        (motion("") + "tolerance_mm = 900.0\n", "trajectory.tolerance_mm; 900; to 1:"),
        (contour("[[-9, 10], [9, 46], [43, 33]]"), "points.contour_mm; in front of; change the sign of x"),
        (contour("[[10, 43], [46, 9], [33, -9]]"), "points.contour_mm; in front of; exchange x and y"),
        (cylinder(fit), "[fit]; [body.cylinder]; GGa"),
        (cylinder("[tensions_n]\nGGa = 1.0"), "tensions_n.GGa; [body.cylinder]; axial"),
        (tongue("[tensions_n]\nGGa = 1.0\ngga = 2.0"), "tensions_n.gga; GGa is given twice"),
        (tongue("[tensions_n]\nGGx = 1.0"), "tensions_n.GGx; [body.tongue]; did you mean \"GGa\"?"),
        (effect("springs = false"), "effects.springs = false; hold the body"),
        (continuum("springs = true"), "kind = \"continuum\"; springs = true"),
        (continuum("incompressibility = true"), "kind = \"continuum\"; incompressibility = true"),
        (wall("outline_mm = [[-20.0, 20.0], [60.0, 21.0]]"), "effects.contact; [body.tongue]; passes"),
        // The wall is smaller than a cell, so that it meets no connection.
        (wall("outline_mm = [[38.94, 3.13], [39.34, 3.13]]"), "at rest, near [38.9, 3.1]"),
        (
            wall("outline_mm = [[0, 62], [-20, 55], [25, 66], [45, 62]]"),
            "outline_mm; from its row 1 to its row 3",
        ),
        (
            wall("outline_mm = [[-20, 55], [25, 66], [0, 62], [45, 62]]"),
            "outline_mm; from its row 1 to its row 3",
        ),
        (
            wall("outline_mm = [[0, 60], [10, 70], [10, 60], [0, 70]]"),
            "outline_mm; from its row 1 to its row 4",
        ),
        (wall("outline_mm = [[0.0, 60.0], [1e-200, 60.0]]"), "distance in mm between two points of"),
        (wall("reach_mm = 1e-5"), "effects.contact.reach_mm; 0.00001; 0.001"),
        (tongue("[material]\ndensity_kg_per_m3 = -5e3"), "density; -5000"),
        (tongue("[material]\ndensity_kg_per_m3 = 1.04"), "density; 1.04; g/cm^3"),
        (tongue("[material]\nyoung_modulus_pa = 1e300"), "Young's modulus; 1e12"),
        (tongue("[material]\npoisson_ratio = 0.5"), "Poisson; 0.5"),
        (CYLINDER.replace("h_mm = 10.0", "h_mm = 0.6"), "h_mm; 0.6; 12,000 nodes"),
        (CYLINDER.replace("h_mm = 10.0", "h_mm = 0.01"), "h_mm; 0.01; sixtieth"),
        (cylinder("[effects]\ncontact = {}"), "effects.contact; [body.cylinder]; outline_mm"),
        (
            cylinder("[effects]\njaw = { opening_deg = 5.0 }"),
            "effects.jaw; [body.cylinder]; no bone \"mental_spine\"; its bones: ",
        ),
        (
            effect("gravity = { posture = \"supine\", direction = [1.0, 0.0] }"),
            "gravity.posture; gravity.direction; exactly one",
        ),
        (effect("gravity = { direction = [1.0, 0.0, 0.0] }"), "direction with 3 numbers; a body in 2"),
        (tongue(&format!("[tensions_n]\nGGa = 1.0\n{fit}")), "[fit]; tensions_n.GGa"),
        (tongue(&format!("[tensions_n]\nGGa = 1.0\n{points}")), "[points]; tensions_n.GGa"),
        (contour("[[1.0, 2.0]]"), "at least 3"),
        (tongue(points), "[points]; incompressibility = true"),
        (cylinder(&format!("{points}\n[effects]\nincompressibility = true")), "[points]; [body.cylinder]"),
        (tongue("[tensions_n]\nGGa = -1.0"), "tensions_n; -1; does not push"),
        (effect("jaw = { opening_deg = 90.0 }"), "opening_deg; 90; 60"),
        (TONGUE.replace("5.5", "-5.5"), "-5.5 mm; not usable"),
        (tongue(&fit.replace("S2", "S9")), "S9"),
        // A faulty scene is reported with its line and the nearest known word.
        (
            tongue("[body.block]\nsize_mm = [1.0, 1.0, 1.0]\nh_mm = 0.5"),
            "exactly one of tongue, tongue-in-space, mesh,",
        ),
        (effect("gravty = { posture = \"supine\" }"), "my.toml:6:1:; did you mean `gravity`?"),
        (TONGUE.replace("h_mm", "h"), "my.toml:4:1:; h_mm"),
        (TONGUE.replace("shape", "length"), "my.toml:2:8:; did you mean `lengths`?"),
        (TONGUE.replace("tongue", "tounge"), "did you mean `tongue`?"),
    ];
    for (text, wanted) in cases {
        let prepared = |scene: Scene| {
            scene.check()?;
            match build(&scene, &mut |_| ())? {
                AnyBody::Flat(built) => prepare(&scene, built).map(drop),
                AnyBody::Solid(built) => prepare(&scene, built).map(drop),
            }
        };
        let error = Scene::from_toml(&text, "my.toml").and_then(prepared).expect_err(&text).to_string();
        for word in wanted.split("; ") {
            assert!(error.contains(word), "\"{word}\" is missing in: {error}");
        }
    }
    says(scene::shipped("vowel-b"), "did you mean \"vowel-a\"?");
}

#[test]
fn points_of_a_scene_with_weight_and_a_shifted_hyoid_determine_its_tensions() {
    let kept = "[effects]\nincompressibility = true\n";
    let effects =
        format!("{kept}gravity = {{ posture = \"upright\" }}\nhyoid = {{ shift_mm = [2.0, -1.0] }}\n");
    let tensions = [("GGa", 12.0), ("GGp", 20.0), ("HGa", 8.0)];
    let body = "title = \"t\"\nwant = \"shape\"\n[body.tongue]\n";
    let given: String = tensions.iter().map(|(m, f)| format!("{m} = {f:?}\n")).collect();
    let truth = simulate(&Scene::from_toml(&format!("{body}[tensions_n]\n{given}{effects}"), "t").unwrap());
    let truth = truth.unwrap();
    let tongue = Body::tongue(5.5e-3).unwrap();
    let surface = TongueSurface::of(&tongue).unwrap();
    let points: Vec<String> = (1..40)
        .map(|i| {
            let at = surface.curve.length() * f64::from(i) / 40.0;
            let weights = surface.curve.weights(at);
            let along =
                |axis: usize| weights.iter().map(|(n, w)| w * truth.positions_m[*n][axis]).sum::<f64>() * 1e3;
            format!("[{}, {}]", along(0), along(1))
        })
        .collect();
    let points = format!("[points]\ncontour_mm = [{}]\nnoise_mm = 0.02\n", points.join(", "));
    let found = simulate(&Scene::from_toml(&format!("{body}{points}{effects}"), "t").unwrap()).unwrap();
    let points_fit = found.points.as_ref().unwrap();
    assert!(found.converged && points_fit.rms_mm.unwrap() < 0.02, "{points_fit:?}");
    for muscle in &found.muscles {
        let truth = tensions.iter().find(|(m, _)| *m == muscle.muscle).map_or(0.0, |(_, f)| *f);
        let [low, high] = muscle.interval_n.unwrap();
        let tension = muscle.pull.value();
        assert!(low <= tension && tension <= high, "{muscle:?}");
        assert!((tension - truth).abs() < 3.0, "{muscle:?}");
    }
    // Without the weight and the hyoid the same points give other tensions.
    let other = simulate(&Scene::from_toml(&format!("{body}{points}{kept}"), "t").unwrap()).unwrap();
    assert!(other.points.unwrap().rms_mm.unwrap() > 3.0 * points_fit.rms_mm.unwrap());
}

/// Found by the fuzz target of scenes: without incompressibility, a muscle folds the springs.
#[test]
fn a_scene_of_springs_alone_whose_cells_turn_over_does_not_count_as_converged() {
    let text =
        "title = \"SGa alone\"\nwant = \"shape\"\n[body.tongue]\nh_mm = 5.5\n[tensions_n]\nSGa = 10.0\n";
    let outcome = outcome(text);
    assert!(outcome.min_cell_ratio < 0.0 && !outcome.converged, "{:?}", outcome.solution);
}
