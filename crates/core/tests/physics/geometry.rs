//! Shapes of cells, curves, and topology of meshes.

use std::f64::consts::TAU;

use nalgebra::{SVector, Vector3};
use tongue_core::geometry::hexahedron::{FACES, LOCAL, volume};
use tongue_core::geometry::simplex::{self, Corners, MAX_CORNERS, safe_part};
use tongue_core::geometry::{ClosedSpline, NaturalSpline, Point, ThinPlate, quadratic, topology};

#[test]
fn the_volume_is_that_inside_the_faces() {
    assert!((volume(&LOCAL.map(Vector3::from)) - 8.0).abs() < 1e-14);
    // The top of the frustum is half as wide as its bottom.
    let frustum = LOCAL.map(|[x, y, z]| {
        let width = 0.75 - 0.25 * z;
        Vector3::new(width * x, width * y, z)
    });
    let exact = 2.0 * (4.0 + 1.0 + 2.0) / 3.0;
    assert!((volume(&frustum) - exact).abs() < 1e-14);
}

#[test]
fn faces_look_outwards() {
    let x = LOCAL.map(Vector3::from);
    for [a, b, c, d] in FACES {
        let normal = (x[b] - x[a]).cross(&(x[c] - x[b]));
        assert!(normal.dot(&(x[a] + x[b] + x[c] + x[d])) > 0.0);
    }
}

#[test]
fn a_step_stops_before_the_cell_turns_over_even_if_it_would_turn_back() {
    let mut x = [SVector::<f64, 2>::zeros(); MAX_CORNERS];
    (x[1][0], x[2][1], x[2][0]) = (1.0, 1.1, 0.1);
    // Corner C passes through the opposite edge, so that the triangle is inverted from about half the path on.
    let mut p = [SVector::zeros(); MAX_CORNERS];
    p[2][1] = -2.0 * x[2][1];
    let t = safe_part(&x, &p);
    assert!(t > 0.3 && t <= 0.45, "{t}");
    // Each corner moves straight to its place after half a turn, so that the area is positive at both ends and zero in the middle.
    let mut spin = [SVector::zeros(); MAX_CORNERS];
    let centre = (x[0] + x[1] + x[2]) / 3.0;
    for a in 0..3 {
        spin[a] = (centre - x[a]) * 2.0;
    }
    // At `t` the area is `(1 - 2 t)²` of that at rest, which is a tenth at 0.3419; the result is at most 1/64 less.
    let t = safe_part(&x, &spin);
    assert!(t > 0.342 - 1.0 / 64.0 && t < 0.342, "{t}");
    assert_eq!(safe_part(&x, &[SVector::zeros(); MAX_CORNERS]), 1.0);
}

fn corners<const D: usize>() -> Corners<D> {
    let mut x = [SVector::zeros(); MAX_CORNERS];
    for (i, corner) in x.iter_mut().enumerate().take(D + 1) {
        for d in 0..D {
            corner[d] = if i == d + 1 { 1.0 } else { 0.0 } + 0.1 * ((3 * i + 5 * d) as f64).sin();
        }
    }
    x
}

fn all_nodes<const D: usize>(x: &Corners<D>) -> Vec<SVector<f64, D>> {
    let middles = quadratic::edges::<D>().iter().map(|&[i, j]| (x[i] + x[j]) * 0.5);
    x[..=D].iter().copied().chain(middles).collect()
}

fn are_what_they_should_be<const D: usize>() {
    let x = corners::<D>();
    let nodes = all_nodes(&x);
    assert_eq!(nodes.len(), quadratic::nodes::<D>());
    // Shape functions reproduce a quadratic field and its gradient exactly.
    let field = |p: &SVector<f64, D>| 1.0 + 2.0 * p[0] - p[1] + 3.0 * p[0] * p[1] - p[1] * p[1];
    let slope = |p: &SVector<f64, D>| {
        let mut g = SVector::<f64, D>::zeros();
        (g[0], g[1]) = (2.0 + 3.0 * p[1], -1.0 + 3.0 * p[0] - 2.0 * p[1]);
        g
    };
    let measure = simplex::measure(&x);
    let coordinates = simplex::gradient(&x).map(|g| g / measure);
    let (mut first, mut second) = (0.0, 0.0);
    for at in quadratic::points::<D>() {
        let p: SVector<f64, D> = x.iter().zip(at).map(|(x, l)| x * *l).sum();
        let (n, g) = (quadratic::values::<D>(at), quadratic::gradients(at, &coordinates));
        let value: f64 = nodes.iter().zip(n).map(|(node, n)| n * field(node)).sum();
        let gradient: SVector<f64, D> = nodes.iter().zip(g).map(|(node, g)| g * field(node)).sum();
        assert!((value - field(&p)).abs() < 1e-13 && (gradient - slope(&p)).norm() < 1e-12);
        first += at[0] / quadratic::points::<D>().len() as f64;
        second += at[0] * at[1] / quadratic::points::<D>().len() as f64;
    }
    let d = D as f64;
    assert!((first - 1.0 / (d + 1.0)).abs() < 1e-15);
    assert!((second - 1.0 / ((d + 1.0) * (d + 2.0))).abs() < 1e-15);
    let parts = quadratic::parts::<D>().iter().map(|part| simplex::measure(&simplex::corners(&nodes, part)));
    for part in parts {
        assert!((part / measure * (1 << D) as f64 - 1.0).abs() < 1e-12, "{part} {measure}");
    }
}

#[test]
fn quadratic_fields_are_met_and_the_parts_fill_the_cell() {
    are_what_they_should_be::<2>();
    are_what_they_should_be::<3>();
}

#[test]
fn powers_are_integrated_exactly_as_far_as_promised() {
    for count in 1..=9 {
        let rule = quadratic::gauss_legendre(count);
        for power in 0..2 * count {
            let exact = if power % 2 == 0 { 2.0 / (power as f64 + 1.0) } else { 0.0 };
            let sum: f64 = rule.iter().map(|(x, w)| w * x.powi(power as i32)).sum();
            assert!((sum - exact).abs() < 1e-14, "{count} points, power {power}: {sum}");
        }
    }
}

fn circle(count: usize) -> ClosedSpline {
    let angles = (0..count as u32).map(|i| TAU * f64::from(i) / count as f64);
    ClosedSpline::through(angles.map(|at| Point::new(-at.sin(), at.cos())).rev().collect()).unwrap()
}

#[test]
fn a_spline_through_a_circle_approaches_it_with_the_fourth_power() {
    let order = ((circle(12).area() - TAU / 2.0).abs() / (circle(24).area() - TAU / 2.0).abs()).log2();
    assert!((3.7..4.3).contains(&order), "order {order}");
    assert!((circle(48).perimeter - TAU).abs() < 1e-4);
}

#[test]
fn goes_through_its_points_and_finds_them_again() {
    let curve = circle(9);
    for p in &curve.points {
        let (along, away) = curve.nearest(*p);
        assert!(away < 1e-12);
        assert!((curve.point(along) - p).norm() < 1e-12);
    }
    assert!((curve.point(curve.perimeter * 1.25) - curve.point(curve.perimeter * 0.25)).norm() < 1e-12);
}

#[test]
fn a_line_through_the_middle_crosses_twice() {
    let found = circle(24).crossings([Point::new(-2.0, 0.1), Point::new(2.0, 0.1)]);
    let expected = (1.0_f64 - 0.01).sqrt();
    assert_eq!(found.len(), 2);
    assert!((found[0] * 4.0 - 2.0 + expected).abs() < 1e-3 && (found[1] * 4.0 - 2.0 - expected).abs() < 1e-3);
}

#[test]
fn repeated_points_have_no_curve() {
    let p = Point::new(0.0, 0.0);
    assert_eq!(ClosedSpline::through(vec![p, p, Point::new(1.0, 0.0)]), None);
}

#[test]
fn approaches_an_arc_and_goes_through_its_points() {
    let worst = |n: usize| {
        let curve = NaturalSpline::through(&arc(n)).unwrap();
        // The ends are left out, because the spline has no curvature there.
        let inner = curve.polygon.iter().filter(|p| (0.8..2.2).contains(&p.y.atan2(p.x)));
        inner.map(|p| (p.norm() - 1.0).abs()).fold(0.0, f64::max)
    };
    assert!(worst(24) < worst(12) / 8.0, "{} {}", worst(24), worst(12));
    let points = arc(7);
    let curve = NaturalSpline::through(&points).unwrap();
    assert!(points.iter().all(|p| curve.distance(*p) < 1e-12));
    let line = NaturalSpline::through(&[Point::new(0.0, 0.0), Point::new(2.0, 0.0)]).unwrap();
    assert!((line.distance(Point::new(1.0, 0.5)) - 0.5).abs() < 1e-15);
    assert!((line.distance(Point::new(3.0, 0.5)) - 1.25_f64.sqrt()).abs() < 1e-15);
    assert!((line.extended(2.0).distance(Point::new(3.0, 0.5)) - 0.5).abs() < 1e-15);
    assert!(NaturalSpline::through(&[Point::zeros(), Point::zeros()]).is_none());
}

fn arc(n: usize) -> Vec<Point> {
    (0..=n).map(|i| 3.0 * i as f64 / n as f64).map(|t| Point::new(t.cos(), t.sin())).collect()
}

#[test]
fn control_points_arrive_and_affine_ways_are_kept() {
    let controls = [[0.0, 0.0], [1.0, 0.1], [0.2, 1.0], [1.1, 0.9], [0.5, 0.4]].map(Point::from);
    let plate = ThinPlate::new(&controls).unwrap();
    let carried = |p: Point, d: &[Point]| -> Point {
        p + plate.weights(p).iter().zip(d).map(|(w, d)| d * *w).sum::<Point>()
    };
    let any = [[0.1, 0.0], [-0.2, 0.3], [0.0, 0.1], [0.3, 0.3], [0.0, -0.1]].map(Point::from);
    for (c, d) in controls.iter().zip(&any) {
        assert!((carried(*c, &any) - (c + d)).norm() < 1e-12);
    }
    let near = Point::new(1.0 + 1e-6, 0.1);
    assert!((carried(near, &any) - carried(controls[1], &any) - Point::new(1e-6, 0.0)).norm() < 1e-5);
    let affine = |p: Point| Point::new(0.2 * p.x - 0.1 * p.y + 0.05, 0.3 * p.y);
    let d = controls.map(affine);
    let p = Point::new(0.7, -0.4);
    assert!((carried(p, &d) - p - affine(p)).norm() < 1e-12);
    assert!(ThinPlate::new(&controls[..2]).is_none());
    assert!(ThinPlate::new(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]].map(Point::from)).is_none());
}

/// A ring of 16 triangles around a hole: nodes 0..8 on the outer outline and 8..16 on the inner one, counter-clockwise.
fn ring() -> Vec<[usize; 3]> {
    (0..8).flat_map(|i| [[i, (i + 1) % 8, 8 + i], [(i + 1) % 8, 8 + (i + 1) % 8, 8 + i]]).collect()
}

fn slices(cells: &[[usize; 3]]) -> impl Iterator<Item = &[usize]> {
    cells.iter().map(<[usize; 3]>::as_slice)
}

#[test]
fn a_ring_has_an_outer_outline_and_a_hole_that_runs_the_other_way() {
    let ring = ring();
    let loops = topology::outlines(slices(&ring));
    assert_eq!(loops, [vec![0, 1, 2, 3, 4, 5, 6, 7], vec![8, 15, 14, 13, 12, 11, 10, 9]]);
    let on_outline: Vec<[usize; 2]> = topology::edges(slices(&ring))
        .into_iter()
        .filter(|(_, cells)| *cells == 1)
        .map(|(edge, _)| edge)
        .collect();
    let surface: Vec<Vec<usize>> = topology::surface(slices(&ring)).into_keys().collect();
    assert_eq!(surface, on_outline.iter().map(|e| e.to_vec()).collect::<Vec<_>>());
    assert_eq!(on_outline.len(), 16);
}

#[test]
fn parts_that_meet_in_a_node_and_parts_that_do_not_are_all_outlined() {
    let cells = [[0, 1, 2], [2, 3, 4], [5, 6, 7]];
    let loops = topology::outlines(slices(&cells));
    assert_eq!(loops.iter().map(Vec::len).sum::<usize>(), 9);
    assert_eq!(loops.last(), Some(&vec![5, 6, 7]));
}
