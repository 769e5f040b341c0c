//! How the shape of a frame is reached.

use nalgebra::{DVector, SVector};
use tongue_core::body::{Body, DEFAULT_SPACING_M, largest_distance};
use tongue_core::statics::{self, SAME_SHAPE_M, Workspace};
use tongue_core::system::{Model, System};
use tongue_infer::track::{Frame, FrameSolver, Reachability, Softplus, TrackingContext};

#[test]
fn a_shape_that_one_muscle_before_the_others_leads_to_is_reached_in_another_way() {
    let body = Body::tongue(DEFAULT_SPACING_M).unwrap();
    let muscles: Vec<usize> = (0..body.mesh.muscles.len()).collect();
    let system = System::new(&body.mesh, &Model::default(), &muscles).unwrap();
    // At these tensions, N/m, the tongue has two shapes: Newton's method from rest finds the one to which the load path does not lead.
    let tensions = [77.0, 47.6, 14.4, 89.0, 0.0, 4.7, 38.6, 70.2];
    let link = Softplus::default();
    let x = DVector::from_iterator(8, tensions.map(|f| link.bend_n * (f / link.bend_n).exp_m1().ln()));
    let mut solver = FrameSolver::new(TrackingContext::fixed(&system), link);
    let frame = Frame::default();
    let other = solver.solve(&frame, &x, None).unwrap().to_vec();
    let mut w = Workspace::new(&system);
    statics::trace(&system, &mut w, &tensions, &solver.settings);
    let together = w.positions();
    assert!(largest_distance(&other, together) > 1e-3);
    let reached = |solver: &mut FrameSolver<'_>, positions: &[SVector<f64, 2>]| {
        solver.how_reached(&frame, &x, positions)
    };
    assert_eq!(reached(&mut solver, together), Some(Reachability::FromRest));
    assert_eq!(reached(&mut solver, &other), Some(Reachability::OtherWay));
    // Without observations the nearest reached shape is the end of the load path, not that of Newton's method.
    let nearest = solver.nearest_reached(&frame, &x).unwrap();
    assert!(largest_distance(&nearest, together) <= SAME_SHAPE_M);
    // Positions that are no equilibrium are not reached.
    let nowhere: Vec<_> = other.iter().map(|p| p * 1.1).collect();
    assert_eq!(reached(&mut solver, &nowhere), None);
}
