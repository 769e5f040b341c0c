//! The gradient of every observable is that of its values, in the plane and in space, and its rate is the gradient along a motion.

use nalgebra::{SVector, Vector2, Vector3};
use tongue_core::observe::{Line, LineEnd, Midsagittal};
use tongue_fit::observe::{
    Contour, Curve, Length, NodePosition, Observable, Observation, Ratio, Stretch, Surface,
};

use crate::fixtures::{block, lattice, shaken};

/// Observables of a body, each with a name.
type Named<const D: usize> = Vec<(&'static str, Box<dyn Observable<D>>)>;

fn common<const D: usize>(direction: SVector<f64, D>) -> Named<D> {
    let (a, b) = (Length::new([3, 17]), Length::new([5, 12]));
    let between = LineEnd { weights: vec![(1, 0.4), (6, 0.6)], fixed: SVector::zeros() };
    let line = Line { ends: [between, LineEnd { weights: Vec::new(), fixed: direction * 0.1 }] };
    vec![
        ("length", Box::new(a)),
        ("ratio", Box::new(Ratio::new(a, b))),
        ("ratio of lengths that share an end", Box::new(Ratio::new(a, Length::new([17, 9])))),
        ("stretch", Box::new(Stretch::new(a, 0.013))),
        ("line", Box::new(line.clone())),
        ("lines", Box::new(Ratio::new(line.clone(), Line { ends: [LineEnd::node(2), LineEnd::node(11)] }))),
        ("stretch of a line", Box::new(Stretch::new(line, 0.02))),
        ("node", Box::new(NodePosition::node(7, direction))),
        ("mean of nodes", Box::new(NodePosition::mean(vec![(3, 0.2), (4, 0.5), (9, 0.3)], direction))),
    ]
}

/// The upper edge of a lattice of 5 x 4 nodes, towards -x, so that the tissue is on the left.
fn upper_edge(rest: &[Vector2<f64>]) -> Curve {
    Curve::through((15..20).rev().collect(), rest).unwrap()
}

fn check<const D: usize>(observables: &Named<D>, positions: &[SVector<f64, D>]) {
    for (name, observable) in observables {
        let scale = observable.value(positions).abs().max(1e-2);
        let mut gradient = vec![SVector::<f64, D>::zeros(); positions.len()];
        observable.gradient(positions, &mut |node, slope| gradient[node] += slope);
        assert!(gradient.iter().any(|g| g.norm() > 0.0), "{name} depends on nothing");
        for node in 0..positions.len() {
            for d in 0..D {
                let h = 1e-6;
                let at = |by: f64| {
                    let mut x = positions.to_vec();
                    x[node][d] += by;
                    observable.value(&x)
                };
                let difference = (at(h) - at(-h)) / (2.0 * h);
                let error = (difference - gradient[node][d]).abs();
                assert!(error < 1e-6 * (scale / 1e-2).max(1.0), "{name}, node {node}: {difference}");
            }
        }
        let motion: Vec<SVector<f64, D>> =
            (0..positions.len()).map(|i| SVector::from_fn(|d, _| ((i * D + d) as f64 * 1.3).sin())).collect();
        let along: f64 = gradient.iter().zip(&motion).map(|(g, m)| g.dot(m)).sum();
        let mut twice = [f64::NAN; 2];
        let half: Vec<SVector<f64, D>> = motion.iter().map(|m| m * 0.5).collect();
        observable.rates(positions, &[motion, half], &mut twice);
        for found in [twice[0], 2.0 * twice[1]] {
            assert!((found - along).abs() < 1e-12 * along.abs().max(1.0), "{name}");
        }
    }
}

#[test]
fn in_the_plane() {
    let mesh = lattice(5, 4, 0.01);
    let curve = upper_edge(&mesh.nodes);
    let mut all = common(Vector2::new(0.6, 0.8));
    // Points above, below, beside a node, and beyond both ends.
    for (name, x, y) in [
        ("contour, outside", 0.031, 0.030),
        ("contour, inside", 0.037, 0.022),
        ("contour, near a node", 0.0352, 0.0292),
        ("contour, beyond its beginning", 0.063, 0.027),
        ("contour, beyond its end", 0.009, 0.024),
    ] {
        all.push((name, Box::new(Contour::new(curve.clone(), Vector2::new(x, y)))));
    }
    all.push(("on a curve", Box::new(NodePosition::on_curve(&curve, 0.0137, Vector2::new(0.0, 1.0)))));
    check(&all, &shaken(&mesh, 5e-4));
}

#[test]
fn in_space() {
    let mesh = block(2, 0.01);
    let mut all = common(Vector3::new(0.6, 0.0, 0.8));
    // The upper faces of the four upper cubes, counter-clockwise when seen from above.
    let node = |i: usize, j: usize| 18 + 3 * j + i;
    let faces: Vec<[usize; 3]> = (0..4)
        .flat_map(|c| {
            let at = node(c % 2, c / 2);
            [[at, at + 1, at + 4], [at, at + 4, at + 3]]
        })
        .collect();
    for (name, point) in [
        ("surface, above a face", [0.007, 0.004, 0.024]),
        ("surface, below a face", [0.013, 0.012, 0.018]),
        ("surface, beside an edge", [0.012, -0.003, 0.023]),
        ("surface, beside a corner", [0.024, 0.023, 0.023]),
    ] {
        all.push((name, Box::new(Surface::new(faces.clone(), Vector3::from(point)))));
    }
    // The upper front edge of the block as a curve of x and z.
    let edge: Vec<usize> = vec![20, 19, 18];
    let flat: Vec<Vector2<f64>> = edge.iter().map(|&n| mesh.nodes[n].xz()).collect();
    let contour = Contour::new(Curve::through(vec![0, 1, 2], &flat).unwrap(), Vector2::new(0.008, 0.023));
    all.push(("contour in the midsagittal plane", Box::new(Midsagittal::new(edge.into(), contour))));
    check(&all, &shaken(&mesh, 5e-4));
}

#[test]
fn a_contour_through_points_of_a_circle_measures_distances_from_it_with_the_order_of_a_parabola() {
    let error = |n: usize| {
        let nodes: Vec<Vector2<f64>> = (0..=n)
            .map(|i| {
                let angle = std::f64::consts::PI * i as f64 / n as f64;
                Vector2::new(angle.cos(), angle.sin()) * 0.03
            })
            .collect();
        let curve = Curve::through((0..=n).collect(), &nodes).unwrap();
        let distances = (0..50).map(|i| {
            // Points away from the ends, where the curve has only one neighbour.
            let angle = 0.8 + 1.5 * f64::from(i) / 50.0;
            let point = Vector2::new(angle.cos(), angle.sin()) * 0.034;
            (Contour::new(curve.clone(), point).value(&nodes) - 0.004).abs()
        });
        distances.fold(0.0, f64::max)
    };
    let (coarse, fine) = (error(12), error(24));
    assert!(coarse < 5e-5 && (coarse / fine).log2() > 2.5, "{coarse} {fine}");
}

#[test]
fn places_on_a_curve_are_where_their_arc_length_says_and_its_nodes_are_on_it() {
    let mesh = lattice(5, 4, 0.01);
    let curve = upper_edge(&mesh.nodes);
    assert!((curve.length() - 0.04).abs() < 1e-15);
    for (arc_length, x) in [(0.0, 0.055), (0.01, 0.045), (0.025, 0.030), (0.04, 0.015), (9.0, 0.015)] {
        let place = NodePosition::on_curve(&curve, arc_length, Vector2::x()).value(&mesh.nodes);
        assert!((place - x).abs() < 1e-15, "{arc_length}: {place}");
    }
    assert!(Curve::through(vec![0, 1], &mesh.nodes).is_none(), "two nodes");
    assert!(Curve::through(vec![0, 1, 1], &mesh.nodes).is_none(), "no length");
    assert!(Curve::through(vec![0, 1, 99], &mesh.nodes).is_none(), "no such node");
}

#[test]
fn a_residual_is_divided_by_its_standard_deviation() {
    let positions = [Vector2::zeros(), Vector2::new(0.02, 0.0)];
    let motion = vec![Vector2::zeros(), Vector2::x()];
    let sure = Observation::new(Length::new([0, 1]), 0.019).with_standard_deviation(0.0005);
    assert!((sure.residual(&positions) - 2.0).abs() < 1e-12);
    let mut rate = [f64::NAN];
    sure.rates(&positions, std::slice::from_ref(&motion), &mut rate);
    assert!((rate[0] - 2000.0).abs() < 1e-9);
}
