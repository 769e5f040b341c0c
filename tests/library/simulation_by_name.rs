//! The interface by name and runs from options give the same bits as the layers below them, and report wrong names and numbers.

use nalgebra::{SVector, Vector3};
use tongue_core::body::largest_distance;
use tongue_fit::body::json::MeshRecord;
use tongue_fit::body::{Body, ContinuumSettings, MeshContent, MuscleChain, solid};
use tongue_fit::inverse::{self, Constant, FitSettings, Method};
use tongue_fit::measured::TargetKind;
use tongue_fit::prelude::*;
use tongue_fit::report::Provenance;
use tongue_fit::run::{BodySource, FitRun, Kind, PlaneBody};
use tongue_fit::simulation::SimulationError;
use tongue_fit::statics::{self, Workspace};
use tongue_fit::system::System;

use crate::fixtures::{PUBLISHED_A as PUBLISHED, pulling, says, target};

const MUSCLES: [&str; 3] = ["GGa", "SGm", "HGa"];

fn model() -> Assembly<2> {
    Assembly::new(&Model::default(), &Body::tongue(5.5 * MM).unwrap(), MUSCLES).unwrap()
}

/// The system and the tensions of the published answer, without the interface by name.
fn by_hand() -> (System<2>, Vec<f64>) {
    let body = Body::tongue(5.5 * MM).unwrap();
    let (numbers, tensions) = pulling(&body.mesh, &PUBLISHED);
    (System::new(&body.mesh, &Model::default(), &numbers).unwrap(), tensions)
}

#[test]
fn equilibria_have_the_same_bits_whatever_was_solved_before() {
    let (system, tensions) = by_hand();
    let mut workspace = Workspace::new(&system);
    let settings = statics::SolveSettings::default();
    let solution = statics::solve(&system, &mut workspace, &tensions, &settings);
    let mut solver = model().solver();
    let first = solver.equilibrium(&PUBLISHED).unwrap();
    let other = solver.equilibrium(&[("HGa", 60.0)]).unwrap();
    let near = solver.equilibrium_from(&other, &PUBLISHED).unwrap();
    let again = solver.equilibrium(&PUBLISHED).unwrap();
    for shape in [&first, &again] {
        assert_eq!((shape.positions(), shape.solved.equilibrium.solution), (workspace.positions(), solution));
    }
    assert!(near.is_converged() && (near.length("HGa").unwrap() - first.length("HGa").unwrap()).abs() < 1e-9);
    assert_eq!(other.tension("HGa").unwrap(), 60.0, "a shape outlives the next solve");
    let gga = first.length("GGa").unwrap();
    assert_eq!(gga, system.length(workspace.positions(), 0));
    assert_eq!(first.stretch("GGa").unwrap(), gga / first.rest_length("GGa").unwrap());
    assert_eq!(first.ratio("GGa", "GGa").unwrap(), 1.0);

    let mut workspace = Workspace::new(&system);
    let trace = statics::solve_and_trace(&system, &mut workspace, &tensions, &settings);
    let traced = solver.follow_from_rest(&PUBLISHED).unwrap();
    assert_eq!((traced.positions(), traced.solved.equilibrium.trace), (workspace.positions(), Some(trace)));
    assert!(traced.is_traced() && !first.is_traced());
}

#[test]
fn fits_have_the_same_bits() {
    let data = Dataset::reference().unwrap();
    let body = Body::tongue(5.5 * MM).unwrap();
    for (kind, wanted, method) in [
        (TargetKind::Ratio, data.ratios("S2", "a").unwrap(), Method::GaussNewton),
        (TargetKind::Stretch, data.stretches("S2", "a").unwrap(), Method::NelderMead),
    ] {
        let settings = FitSettings { method, ..FitSettings::default() };
        assert_eq!(wanted, target("S2", "a", kind));
        let model = Assembly::new(&Model::default(), &body, wanted.active_names()).unwrap();
        let observations = model.observations(&wanted).unwrap();
        let found = InverseProblem::new(&model, observations).with_settings(settings).fit().unwrap();
        let fit = inverse::fit(&body.mesh, &Model::default(), &wanted, &settings).unwrap();
        assert_eq!((found.answer.status, found.answer.misfit), (fit.answer.status, fit.answer.misfit));
        let equilibrium = &found.shape.solved.equilibrium;
        assert_eq!(equilibrium.trace, Some(fit.answer.replay.trace), "it says how rest leads to it");
        assert_eq!(
            (&found.answer.positions, &found.answer.starts),
            (&fit.answer.positions, &fit.answer.starts)
        );
        assert!(
            found.tensions().into_iter().eq(fit
                .matched
                .target
                .active_names()
                .into_iter()
                .zip(fit.active_tensions()))
        );
        assert_eq!(found.answer.undetermined(), Some(usize::from(kind == TargetKind::Ratio)));
        assert_eq!(found.solution_curve().map_or(0, |v| v.curve.points.len()) > 5, kind == TargetKind::Ratio);
        assert_eq!(found.shape.length("HGp").unwrap(), fit.lengths()[7]);
    }
}

#[test]
fn bones_priors_and_constants_are_fitted_by_name() {
    let body = Body::tongue(5.5 * MM).unwrap();
    let model = Assembly::new(&Model::default(), &body, ["GGa", "HGa"]).unwrap();
    let mut solver = model.solver();
    solver.shift_bone("hyoid", SVector::from([3.0 * MM, -2.0 * MM])).unwrap();
    let truth = [("GGa", 14.0), ("HGa", 9.0)];
    let shape = solver.equilibrium(&truth).unwrap();
    let followed = solver.follow_from_rest(&truth).unwrap();
    assert!(followed.is_traced() && largest_distance(followed.positions(), shape.positions()) < 1e-9);
    let observations = |shape: &Shape<2>| -> Vec<Observation<2>> {
        let names = body.mesh.muscle_names();
        let of = |name: &String| Observation::new(model.length(name).unwrap(), shape.length(name).unwrap());
        names.iter().map(|name| of(name).with_standard_deviation(0.3 * MM)).collect()
    };
    let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
    let problem = || InverseProblem::new(&model, observations(&shape)).with_settings(settings);
    let free = problem().free_bone("hyoid", 10.0 * MM).unwrap().fit().unwrap();
    assert!(free.answer.is_trustworthy(), "{:?}", free.answer.status);
    let shift = free.displacement("hyoid").unwrap();
    assert!((shift - SVector::from([3.0 * MM, -2.0 * MM])).norm() < 1e-6, "{shift:?}");
    assert!(free.tensions().iter().zip(truth).all(|(found, true_)| (found.1 - true_.1).abs() < 1e-3));

    // A bone with a narrow prior moves less, a tension with a small prior is smaller, and one with bounds lies within them.
    let held = problem().free_bone("hyoid", 10.0 * MM).unwrap().with_bone_prior("hyoid", 0.1 * MM).unwrap();
    let held = held.fit().unwrap().displacement("hyoid").unwrap();
    assert!(held.norm() < 0.8 * shift.norm(), "{held:?}");
    let small = problem().free_bone("hyoid", 10.0 * MM).unwrap().with_prior("HGa", 0.0, 0.1).unwrap();
    let small = small.fit().unwrap().shape.tension("HGa").unwrap();
    assert!(small < 0.9 * 9.0, "{small}");
    let capped = problem().with_bounds("HGa", 1.0, 5.0).unwrap().fit().unwrap().shape.tension("HGa").unwrap();
    assert!((1.0..=5.0).contains(&capped), "{capped}");

    // With known tensions the stiffness can be found, and a known tension is not an unknown.
    let soft = Model { young_modulus: 4700.0, ..Model::default() };
    let shape =
        Assembly::new(&soft, &body, ["GGa", "HGa"]).unwrap().solver().equilibrium(&[("GGa", 14.0)]).unwrap();
    let found = InverseProblem::new(&model, observations(&shape))
        .with_settings(settings)
        .with_tension("GGa", 14.0)
        .and_then(|problem| problem.with_tension("HGa", 0.0))
        .unwrap()
        .free_young_modulus(10.0, 20.0)
        .free_young_modulus(1000.0, 20e3)
        .fit()
        .unwrap();
    let young = found.constant(Constant::YoungModulus);
    assert!(young.is_some_and(|e| (e - 4700.0).abs() < 0.1), "{young:?}");
    assert_eq!((found.shape.tension("GGa").unwrap(), found.constant(Constant::PoissonRatio)), (14.0, None));
}

#[test]
fn distances_from_surfaces_are_positive_outside_and_zero_on_them() {
    let model = model();
    let tongue = &model.body.mesh;
    let middle = tongue.nodes.iter().sum::<SVector<f64, 2>>() / tongue.nodes.len() as f64;
    let rest = model.system.rest();
    let distance = |p| model.contour(p).unwrap().value(rest);
    assert!(distance(middle) < -5.0 * MM && distance(middle + SVector::from([0.0, 0.1])) > 0.05);
    for &node in &tongue.outlines()[0] {
        assert!(distance(tongue.nodes[node]).abs() < 1e-12);
    }
    let block = Body::new("a block", solid::block([0.03; 3], [3; 3]));
    let model = Assembly::new(&Model::default(), &block, [""; 0]).unwrap();
    let rest = model.system.rest();
    let distance = |p| model.surface(p).unwrap().value(rest);
    let outside = [([0.015, 0.015, 0.032], 0.002), ([-0.004, 0.011, 0.02], 0.004)];
    for (p, expected) in
        outside.into_iter().chain([([0.015, 0.012, 0.029], -0.001), ([0.011, 0.03, 0.02], 0.0)])
    {
        let found = distance(Vector3::from(p));
        assert!((found - expected).abs() < 1e-15, "{p:?}: {found}");
    }
    assert!(model.surface(Vector3::new(f64::NAN, 0.0, 0.0)).is_err());
}

#[test]
fn a_muscle_of_many_fibres_pulls_with_all_and_is_not_a_single_unknown() {
    let body = Body::new("a cylinder", solid::cylinder(10.0 * MM, 40.0 * MM, 2, 4));
    let model = Assembly::new(&Model::default(), &body, ["axial"]).unwrap();
    let shape = model.solver().equilibrium(&[("axial", 0.01)]).unwrap();
    assert!(shape.is_converged() && shape.stretch("axial").unwrap() < 1.0);
    assert!(model.stretch("axial").unwrap_err().to_string().contains("19 fibres"));
    let z = SVector::from([0.0, 0.0, 1.0]);
    let top = Observation::new(tongue_fit::observe::NodePosition::node(body.mesh.nodes.len() - 1, z), 0.039);
    let problem = InverseProblem::new(&model, vec![top]);
    assert!(problem.fit().unwrap_err().to_string().contains("19 fibres"));
}

#[test]
fn wrong_names_and_numbers_are_reported_in_a_sentence() {
    let body = Body::tongue(5.5 * MM).unwrap();
    let model = model();
    let mut solver = model.solver();
    let problem = || InverseProblem::new(&model, Vec::<Observation<2>>::new());
    let mut small = body.clone();
    small.mesh.muscles.push(MuscleChain { name: "none".into(), nodes: vec![] });
    let coarse = Assembly::new(&Model::default(), &Body::tongue(9.0 * MM).unwrap(), ["GGa"]).unwrap();
    let other = coarse.solver().equilibrium(&[]).unwrap();
    let assembled = |body: &Body<2>, names: &[&str]| {
        Assembly::new(&Model::default(), body, names.iter().copied()).map(drop).unwrap_err()
    };
    let cases: [(SimulationError, &str); 19] = [
        (assembled(&body, &["GGaa"]), "\"GGaa\"; did you mean \"GGa\"?"),
        (assembled(&body, &["GGa", "GGa"]), "GGa is given twice"),
        (assembled(&small, &["GGa"]), "muscle none"),
        (solver.equilibrium(&[("GGx", 1.0)]).unwrap_err(), "did you mean \"GGa\"?"),
        (solver.equilibrium(&[("HGp", 1.0)]).unwrap_err(), "HGp does not contract; GGa, SGm, HGa"),
        (solver.equilibrium(&[("GGa", -1.0)]).unwrap_err(), "tension of GGa is -1; do not push"),
        (solver.equilibrium(&[("GGa", f64::NAN)]).unwrap_err(), "tension of GGa is NaN"),
        (solver.equilibrium(&[("GGa", 1.0), ("gga", 2.0)]).unwrap_err(), "given twice"),
        (solver.equilibrium_from(&other, &[]).unwrap_err(), "of the same body"),
        (solver.position_rates(&other).unwrap_err(), "of the same body"),
        (solver.shift_bone("hyiod", SVector::zeros()).unwrap_err(), "did you mean \"hyoid\"?"),
        (model.stretch("SGmm").unwrap_err(), "did you mean \"SGm\"?"),
        (problem().free_bone("jaw", 0.01).unwrap_err(), "no bone \"jaw\"; mental_spine"),
        (problem().free_bone("hyoid", -0.01).unwrap_err(), "hyoid moves is -0.01; positive"),
        (problem().with_bone_prior("hyoid", 0.01).unwrap_err(), "hyoid is not searched for; free_bone"),
        (problem().with_prior("GGp", 1.0, 1.0).unwrap_err(), "GGp does not contract"),
        (problem().with_bounds("GGa", 3.0, 2.0).unwrap_err(), "upper bound of GGa is 2"),
        (problem().fit().unwrap_err(), "at least one observation"),
        (model.trajectory(&[], 0.0, f64::NAN, 2).unwrap_err(), "time to the end is NaN"),
    ];
    for (error, parts) in cases {
        let message = error.to_string();
        assert!(parts.split("; ").all(|part| message.contains(part)), "{message}");
    }
    let block = Body::new("a block", solid::block([0.03; 3], [1; 3]));
    let message = Assembly::new(&Model::default(), &block, ["GGa"]).unwrap_err().to_string();
    assert!(
        message.contains("no muscles") && Dataset::reference().unwrap().ratios("S2", "").is_err(),
        "{message}"
    );
}

/// The derivatives of all nodes, also of those on straight paths and in the muscles of a continuum.
#[test]
fn derivatives_of_nodes_by_tensions_are_the_differences() {
    let continuum = Body::continuum(8.0 * MM, &ContinuumSettings::default()).unwrap();
    let laid = Assembly::new(&Model::default(), &continuum, MUSCLES).unwrap();
    for model in [model(), laid] {
        let mut solver = model.solver();
        let shape = solver.equilibrium(&PUBLISHED).unwrap();
        let rates = solver.position_rates(&shape).unwrap().unwrap();
        assert_eq!(rates.len(), MUSCLES.len());
        for (muscle, rate) in rates.iter().enumerate() {
            let mut at = |step: f64| {
                let mut tensions = PUBLISHED;
                tensions[muscle].1 += step;
                solver.equilibrium(&tensions).unwrap().positions().to_vec()
            };
            let (before, after) = (at(-1e-3), at(1e-3));
            let largest = rate.iter().map(SVector::amax).fold(0.0, f64::max);
            assert!(largest > 1e-6, "{largest}");
            for (node, r) in rate.iter().enumerate() {
                let difference = (after[node] - before[node]) / 2e-3;
                assert!((difference - r).amax() < 1e-6 * largest, "{muscle} {node}: {difference} {r}");
            }
        }
    }
}

fn made(plane: &PlaneBody) -> Body<2> {
    let text = serde_json::to_string(plane).unwrap();
    let read: PlaneBody = serde_json::from_str(&text).unwrap();
    assert_eq!(&read, plane);
    read.make(&mut |concern| panic!("{concern}")).unwrap()
}

#[test]
fn a_body_from_options_is_that_of_the_library() {
    assert_eq!(made(&PlaneBody::default()), Body::tongue(5.5e-3).unwrap());
    let (kind, settings) = (Kind::Continuum, ContinuumSettings::default());
    assert_eq!(made(&PlaneBody { kind, ..PlaneBody::default() }), Body::continuum(4e-3, &settings).unwrap());
    let toml = include_str!("../../targets/anatomy.toml").to_owned();
    let source = BodySource::Anatomy { toml, origin: "anatomy.toml".to_owned() };
    let of_text = made(&PlaneBody { source, spacing_m: Some(7e-3), ..PlaneBody::default() });
    let tongue = Body::tongue(7e-3).unwrap();
    assert_eq!(of_text.mesh, tongue.mesh);
    let text = serde_json::to_string(&MeshRecord::of(&tongue, &Model::default()).unwrap()).unwrap();
    let source = BodySource::Mesh { content: MeshContent::Json(text), origin: "tongue.json".to_owned() };
    assert_eq!(made(&PlaneBody { source, ..PlaneBody::default() }).mesh, tongue.mesh);
}

#[test]
fn an_anatomy_that_cannot_be_meshed_or_lies_wrong_in_the_head_is_named() {
    let toml = include_str!("../../targets/anatomy.toml").to_owned();
    let exchanged = toml
        .replace("\nhyoid =", "\nother =")
        .replace("\nmental_spine =", "\nhyoid =")
        .replace("\nother =", "\nmental_spine =");
    let source = BodySource::Anatomy { toml: exchanged, origin: "mine.toml".to_owned() };
    let mut told = Vec::new();
    PlaneBody { source, ..PlaneBody::default() }.make(&mut |concern| told.push(concern)).unwrap();
    assert!(told[0].contains("the mental spine lies behind the hyoid"), "{told:?}");
    let source = BodySource::Anatomy { toml, origin: "mine.toml".to_owned() };
    let plane = PlaneBody { source, spacing_m: Some(-1.0), ..PlaneBody::default() };
    says(plane.make(&mut |_| ()), "mine.toml: ");
}

#[test]
fn a_fit_from_options_is_that_of_the_inverse_problem() {
    let target = target("S2", "a", TargetKind::Stretch);
    let (body, model) = (Body::tongue(5.5e-3).unwrap(), Model::default());
    let found = FitRun::quick(&target).run(&body, &model, &Provenance::new("")).unwrap();
    let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
    assert_eq!(found.fit, inverse::fit(&body.mesh, &model, &target, &settings).unwrap());
}
