//! Tensions, displaced bones and constants of the tissue are recovered from their effects, in the plane and in space, and their Jacobian is
//! the derivative of the residuals.

use nalgebra::{SVector, Vector3};
use tongue_fit::body::{Body, ContinuumSettings, Mesh, MeshContent, MuscleChain};
use tongue_fit::inverse::{FitSettings, FitStatus, Method, MovableBone, Unknown};
use tongue_fit::observe::{Length, NodePosition, Observation, Stretch, Surface};
use tongue_fit::statics;
use tongue_fit::system::{Model, System};
use tongue_infer::inverse::{Forward, LeastSquaresProblem, TissueUnknown};
use tongue_input::bodies::gmsh;

use crate::fixtures::{block, says, solved_to};

fn settings() -> FitSettings {
    let equilibrium = statics::SolveSettings { tolerance: 1e-11, ..statics::SolveSettings::default() };
    FitSettings { method: Method::GaussNewton, starts: 2, equilibrium, ..FitSettings::default() }
}

/// A block of tissue on bone with two muscles along upper edges, written and read as a Gmsh file.
fn solid() -> Body<3> {
    let mut mesh = block(3, 0.008);
    let edge = |step: usize| -> Vec<usize> { (0..4).map(|i| 48 + i * step).collect() };
    mesh.muscles = vec![
        MuscleChain { name: "lengthwise".into(), nodes: edge(1) },
        MuscleChain { name: "across".into(), nodes: edge(4) },
    ];
    let text = gmsh::write(&mesh, &[]);
    let content = MeshContent::Gmsh { bytes: text.into(), unit: gmsh::Unit::M };
    content.body("block.msh", &mut |_| ()).unwrap().solid().unwrap()
}

#[test]
fn tensions_of_a_solid_come_back_from_lengths_and_from_surface_points() {
    let body = solid();
    let truth: Vec<f64> =
        body.mesh.muscles.iter().map(|m| if m.name == "across" { 0.11 } else { 0.23 }).collect();
    let system = System::new(&body.mesh, &Model::default(), &[0, 1]).unwrap();
    let positions = solved_to(1e-11, &system, &truth);
    let unknowns = || vec![Unknown::tension(0, 1.0), Unknown::tension(1, 1.0)];
    let fit = |observations, method, room: f64| {
        let problem = LeastSquaresProblem::new(&system, observations, unknowns());
        let answer = problem.solve(&FitSettings { method, ..settings() }).unwrap();
        assert_eq!(answer.status, FitStatus::Converged, "{method:?}");
        let off = answer.x.iter().zip(&truth).map(|(f, t)| (f / t - 1.0).abs()).fold(0.0, f64::max);
        assert!(off < room, "{method:?}: {:?}", answer.x);
    };
    let stretch = |m| {
        let length = Length::new(system.muscle_ends(m));
        let o = Observation::new(Stretch::new(length, system.length(system.rest(), m)), 0.0);
        Observation { measured: o.observable.value(&positions), ..o }
    };
    fit((0..2).map(stretch).collect(), Method::GaussNewton, 1e-6);
    fit((0..2).map(stretch).collect(), Method::NelderMead, 1e-2);

    // Points on the upper face as from a scanner: without names, not at nodes, with a standard deviation of 0.1 mm.
    let top: Vec<[usize; 3]> = body
        .mesh
        .surface()
        .into_iter()
        .filter(|face| face.iter().all(|&n| body.mesh.nodes[n].z > 0.0239))
        .map(|f| {
            let [a, b, c] = [f[0], f[1], f[2]];
            let [p, q, r] = [a, b, c].map(|n| body.mesh.nodes[n]);
            if (q - p).cross(&(r - p)).z > 0.0 { [a, b, c] } else { [a, c, b] }
        })
        .collect();
    assert_eq!(top.len(), 18);
    let centres = top.iter().map(|f| f.iter().map(|&n| positions[n]).sum::<Vector3<f64>>() / 3.0);
    let points =
        centres.map(|p| Observation::new(Surface::new(top.clone(), p), 0.0).with_standard_deviation(1e-4));
    fit(points.collect(), Method::GaussNewton, 1e-6);
}

/// The reference tongue with GGa and HGa, and unknown hyoid and constants.
struct Tongue {
    mesh: Mesh<2>,
    hyoid: Vec<usize>,
    muscles: [usize; 2],
}

fn tongue() -> Tongue {
    of(Body::tongue(0.0055).unwrap())
}

fn of(body: Body<2>) -> Tongue {
    let muscles = ["GGa", "HGa"].map(|name| body.muscle(name).unwrap());
    Tongue { hyoid: body.bone("hyoid").to_vec(), muscles, mesh: body.mesh }
}

/// Observations of a contour, sensors and lengths; the caller sets the measured values.
fn observations(system: &System<2>) -> Vec<Observation<2>> {
    let mut out = Vec::new();
    for muscle in 0..system.muscle_count() {
        let stretch =
            Stretch::new(Length::new(system.muscle_ends(muscle)), system.length(system.rest(), muscle));
        out.push(Observation::new(stretch, 1.0).with_standard_deviation(0.01));
    }
    for node in [20, 40, 60] {
        for axis in 0..2 {
            let direction = SVector::from_fn(|d, _| if d == axis { 1.0 } else { 0.0 });
            out.push(
                Observation::new(NodePosition::node(node, direction), 0.0).with_standard_deviation(5e-4),
            );
        }
    }
    out
}

#[test]
fn the_jacobian_is_the_difference_of_solved_residuals_for_every_kind_of_unknown() {
    let continuum = Body::continuum(0.008, &ContinuumSettings::default()).unwrap();
    let model = Model::default();
    for (tissue, t) in [("springs", tongue()), ("continuum", of(continuum))] {
        // In a continuum only muscles that can pull hold the hyoid.
        let all: Vec<usize> = (0..t.mesh.muscles.len()).collect();
        let system = System::new(&t.mesh, &model, &all).unwrap();
        let bones = [MovableBone::new(&t.mesh, &model, &all, &t.hyoid).unwrap()];
        let constants = TissueUnknown { mesh: &t.mesh, model, contracting: &all };
        let unknowns = vec![
            Unknown::tension(t.muscles[0], 100.0),
            Unknown::bone(0, 0, 10.0).with_prior(1.0, 0.2),
            Unknown::bone(0, 1, 10.0),
            Unknown::young_modulus(10.0, 200.0),
            Unknown::tension(t.muscles[1], 100.0),
            Unknown::poisson_ratio(30.0, 49.9),
        ];
        let problem = LeastSquaresProblem {
            bones: &bones,
            tissue: Some(&constants),
            ..LeastSquaresProblem::new(&system, observations(&system), unknowns)
        };
        let settings = settings();
        let mut forward = Forward::new(&problem, &settings);
        let x = [12.0, 2.0, -1.5, 60.0, 8.0, 46.0];
        let linear = forward.linearise(&x).unwrap();
        assert_eq!(linear.residuals.len(), problem.observations.len() + 1, "a prior is a residual");
        for i in 0..x.len() {
            let h = 1e-3;
            let mut at = |by: f64| {
                let mut moved = x;
                moved[i] += by;
                forward.residuals(&moved).unwrap()
            };
            let difference = (at(h) - at(-h)) / (2.0 * h);
            let column = linear.jacobian.column(i);
            let error = (difference - column).amax();
            assert!(error < 2e-5 * column.amax().max(1e-2), "{tissue}, unknown {i}: {error:e}");
        }
    }
}

#[test]
fn incompatible_problems_are_refused_with_a_sentence() {
    let t = tongue();
    let system = System::new(&t.mesh, &Model::default(), &t.muscles).unwrap();
    let of_system = || observations(&system);
    let gga = t.muscles[0];
    for (observations, unknown, why) in [
        (of_system(), Unknown::tension(2, 100.0), "does not contract"),
        (of_system(), Unknown::bone(0, 0, 5.0), "was not freed"),
        (of_system(), Unknown::young_modulus(10.0, 100.0), "no tissue was given"),
        (Vec::new(), Unknown::tension(gga, 100.0), "at least one observation"),
        (of_system(), Unknown::tension(gga, f64::NAN), "finite and in order"),
    ] {
        let problem = LeastSquaresProblem::new(&system, observations, vec![unknown]);
        says(problem.solve(&settings()), why);
    }
}
