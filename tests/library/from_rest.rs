//! All interfaces give the same answer to the question of how loads lead from rest to a shape.

use nalgebra::{DVector, SVector, Vector2};
use tongue_core::body::largest_distance;
use tongue_core::observe::Length;
use tongue_core::statics::SAME_SHAPE_M;
use tongue_files::run::Equilibrium;
use tongue_fit::body::Body;
use tongue_fit::observe::Observation;
use tongue_fit::scene::{Scene, simulate};
use tongue_fit::simulation::Assembly;
use tongue_fit::statics::{self, Connection, FromRest, SolveSettings, SolveStatus, Workspace};
use tongue_fit::system::{Model, System};
use tongue_infer::inverse::alarms::Alarm;
use tongue_infer::inverse::{FitSettings, Forward, LeastSquaresProblem, Unknown};
use tongue_infer::posterior::{
    Evaluator, ParameterValues, PosteriorModel, PosteriorProblem, Posture, Priors,
};
use tongue_infer::track::{Frame, FrameSolver, Softplus, TrackingContext};

use crate::posterior::measurements;

/// Of 2574 loads of up to 90 N/m, 29 have two shapes. With these two, Newton's method from rest finds the shape to which the load path does
/// not lead, and passes no unstable equilibrium.
const TWO_SHAPES: [[f64; 8]; 2] =
    [[31.9, 10.6, 56.0, 82.8, 0.0, 0.0, 24.9, 55.8], [0.0, 0.0, 80.4, 89.2, 7.3, 0.0, 48.4, 61.4]];
const ORDINARY: [[f64; 8]; 2] =
    [[12.0, 0.0, 0.0, 0.0, 11.5, 0.0, 4.5, 0.0], [5.0, 10.0, 30.0, 8.0, 0.0, 3.0, 2.0, 12.0]];
/// The branch from rest ends before this load.
const FALL: [f64; 8] = [0.0, 0.0, 100.0, 0.0, 100.0, 100.0, 100.0, 100.0];

type Positions = [SVector<f64, 2>];

/// A tongue in which every muscle can contract.
struct Tongue<'a> {
    body: &'a Body<2>,
    system: &'a System<2>,
    problem: &'a PosteriorProblem<'a>,
}

fn are_same(a: &Positions, b: &Positions) -> bool {
    largest_distance(a, b) <= SAME_SHAPE_M
}

impl Tongue<'_> {
    fn posterior(&self, load: &[f64], positions: &Positions) -> bool {
        let posture = Posture { tensions: load.to_vec(), hyoid: Vector2::zeros() };
        let baseline = Posture { tensions: vec![0.0; load.len()], hyoid: Vector2::zeros() };
        let at = ParameterValues { postures: vec![posture, baseline], tilt: 0.0 };
        let found = Evaluator::new(self.problem).solve_from_rest(&[&at]).remove(0);
        found.is_some_and(|found| are_same(&found.shapes[0], positions))
    }

    fn track(&self, load: &[f64], positions: &Positions) -> bool {
        let link = Softplus::default();
        let x = load.iter().map(|f| link.bend_n * (f / link.bend_n).exp_m1().ln());
        let x = DVector::from_iterator(load.len(), x);
        let mut solver = FrameSolver::new(TrackingContext::fixed(self.system), link);
        solver.are_reached_from_rest(&[(&Frame::default(), &x, Some(positions))]) == [true]
    }

    /// Compares all interfaces at a load. Returns the shape to which the load leads, how it was reached, and whether Newton's method from
    /// rest finds it, too.
    fn ask(&self, load: &[f64; 8]) -> (Vec<SVector<f64, 2>>, FromRest, bool) {
        let settings = SolveSettings::default();
        let mut w = Workspace::new(self.system);
        let newton = statics::solve(self.system, &mut w, load, &settings);
        assert_eq!((newton.status, newton.connection), (SolveStatus::Converged, Connection::Direct));
        let by_newton = w.positions().to_vec();
        w.start_from_rest(self.system);
        let traced = statics::trace(self.system, &mut w, load, &settings);
        let (there, how) = (w.positions().to_vec(), traced.from_rest);
        let same = are_same(&there, &by_newton);
        assert_eq!(traced.solution.connection == Connection::Traced, how == FromRest::Branch);

        // The program, the interface by name and a fit's replay follow the load themselves.
        w.start_from_rest(self.system);
        let program = Equilibrium::of(self.system, &mut w, load, false);
        let program = program.trace.map(|b| (b.from_rest, b.same_by_newton));
        assert!(program == Some((how, same)) && are_same(w.positions(), &there));
        let named: Vec<(&str, f64)> =
            self.body.mesh.muscles.iter().map(|m| m.name.as_str()).zip(*load).collect();
        let assembly =
            Assembly::new(&Model::default(), self.body, named.iter().map(|(name, _)| *name)).unwrap();
        let shape = assembly.solver().follow_from_rest(&named).unwrap();
        assert_eq!(
            (shape.solved.equilibrium.trace.unwrap().from_rest, shape.is_traced()),
            (how, how == FromRest::Branch)
        );
        assert!(are_same(shape.positions(), &there));
        let unknowns = (0..load.len()).map(|m| Unknown::tension(m, 200.0)).collect();
        let length = Observation::new(Length::new(self.system.muscle_ends(0)), 0.0);
        let settings_of_fit = FitSettings::default();
        let problem = LeastSquaresProblem::new(self.system, vec![length], unknowns);
        let forward = Forward::new(&problem, &settings_of_fit);
        let (replay, at_end) = forward.follow_load_path(load);
        assert_eq!((replay.from_rest, replay.same_by_newton), (how, same));
        assert!(are_same(at_end.positions(), &there));

        let tensions: String = named.iter().map(|(name, f)| format!("{name} = {f:?}\n")).collect();
        let text = format!(
            "title = \"t\"\nwant = \"shape\"\n[body.tongue]\nh_mm = 5.5\n[effects]\nincompressibility = true\n[tensions_n]\n{tensions}"
        );
        let scene = simulate(&Scene::from_toml(&text, "t").unwrap()).unwrap();
        let positions: Vec<_> = scene.positions_m.iter().map(|p| Vector2::from_column_slice(p)).collect();
        assert!(are_same(&positions, &there));
        let alarm = match how {
            FromRest::Branch => None,
            FromRest::Jumped(critical) => Some(Alarm::NotOnBranch { ends_at: Some(critical.load) }),
            other => panic!("{other:?}"),
        };
        assert_eq!(scene.alarms, Vec::from_iter(alarm));

        // The others judge a given shape: that to which the load leads, and that of Newton's method.
        assert_eq!((self.posterior(load, &there), self.track(load, &there)), (true, true), "{load:?}");
        assert_eq!(
            (self.posterior(load, &by_newton), self.track(load, &by_newton)),
            (same, same),
            "{load:?}"
        );
        (there, how, same)
    }
}

#[test]
fn all_who_ask_how_loads_lead_from_rest_to_a_shape_get_one_answer() {
    let body = Body::tongue(5.5e-3).unwrap();
    let muscles: Vec<usize> = (0..body.mesh.muscles.len()).collect();
    let system = System::new(&body.mesh, &Model::default(), &muscles).unwrap();
    let mut priors = Priors::default();
    priors.compressibility.off = true; // The same body everywhere.
    let posterior_model = PosteriorModel::new(&body, &Model::default(), &priors).unwrap();
    let problem = PosteriorProblem::new(&posterior_model, measurements("S2", "a")).unwrap();
    let tongue = Tongue { body: &body, system: &system, problem: &problem };
    for load in TWO_SHAPES {
        let (_, how, same) = tongue.ask(&load);
        assert_eq!((how, same), (FromRest::Branch, false));
    }
    let few = SolveSettings { most_solves: 2, ..SolveSettings::default() };
    for load in ORDINARY {
        let (_, how, same) = tongue.ask(&load);
        assert_eq!((how, same), (FromRest::Branch, true));
        // With too few solves the answer is not known.
        let found = statics::trace(&system, &mut Workspace::new(&system), &load, &few);
        assert!(matches!(found.from_rest, FromRest::NotKnown { reached } if reached < 1.0), "{found:?}");
    }
    // Beyond a jump all find the same shape, and those that follow the branch report its end.
    let (there, how, _) = tongue.ask(&FALL);
    assert!(matches!(how, FromRest::Jumped(critical) if critical.load < 1.0), "{how:?}");
    // Half of the load leads to another shape.
    let half = FALL.map(|f| 0.5 * f);
    assert!(!tongue.track(&half, &there) && !tongue.posterior(&half, &there));
}
