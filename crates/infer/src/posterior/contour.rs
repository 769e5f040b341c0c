//! A contour of one posture as data of a posterior.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use tongue_core::body::Body;
use tongue_core::geometry::Point;
use tongue_core::observe::{Contour, Observable};

use crate::track::{Errors, Surface};

use super::beside::{Beside, Of};

/// What placing a contour beside a body leaves open: shift, m, turn, rad, and the logarithm of its scale.
const SHIFT_SD_M: f64 = 5e-3;
const TURN_SD: f64 = 9.0 * PI / 180.0;
const SCALE_SD: f64 = 0.1;
/// Standard deviation of the error of a point that its neighbours share, mm.
const POINT_SD_MM: f64 = 0.93;
/// Step of a central difference along these, in standard deviations.
const STEP: f64 = 1e-4;

impl Beside {
    /// The distances of the points of a contour from the surface, m, in posture number `posture`; the points in the order of the contour.
    /// Their errors are those of `track` for one frame, and what placing leaves open, linearised at rest. `None` where the body has no
    /// surface or there are no points.
    pub fn contour(body: &Body<2>, posture: usize, points: &[Point]) -> Option<Self> {
        let curve = Surface::of(body)?.curve;
        let first = *points.first()?;
        let centre: Point = points.iter().sum::<Point>() / points.len() as f64;
        let mut along = vec![0.0];
        for pair in points.windows(2) {
            along.push(along[along.len() - 1] + 1e3 * (pair[1] - pair[0]).norm());
        }
        let distance = |at: Point| Contour::new(curve.clone(), at).value(&body.mesh.nodes);
        let placing: [&dyn Fn(Point, f64) -> Point; 4] = [
            &|p, by| p + Point::x() * (SHIFT_SD_M * by),
            &|p, by| p + Point::y() * (SHIFT_SD_M * by),
            &|p, by| {
                let (sin, cos) = (TURN_SD * by).sin_cos();
                let arm = p - centre;
                centre + Point::new(cos * arm.x - sin * arm.y, sin * arm.x + cos * arm.y)
            },
            &|p, by| centre + (p - centre) * (SCALE_SD * by).exp(),
        ];
        let of_placing = placing.map(|moved| {
            let rate = |p: &Point| (distance(moved(*p, STEP)) - distance(moved(*p, -STEP))) / (2.0 * STEP);
            DVector::from_iterator(points.len(), points.iter().map(rate))
        });
        let errors = Errors::default();
        let of_points = DMatrix::from_fn(points.len(), points.len(), |i, j| {
            1e-6 * errors.of_pair((along[i], POINT_SD_MM), (along[j], POINT_SD_MM), i == j)
        });
        let observables: Vec<Arc<dyn Observable<2>>> = points
            .iter()
            .map(|p| Arc::new(Contour::new(curve.clone(), *p)) as Arc<dyn Observable<2>>)
            .collect();
        let name = |(i, p): (usize, &Point)| {
            let mm = (p - first).norm() * 1e3;
            format!("point {} ({mm:.0} mm from the first)", i + 1)
        };
        Some(Self {
            kind: "contour".to_owned(),
            names: points.iter().enumerate().map(name).collect(),
            of: Of::Shape(posture, Arc::new(observables)),
            measured: vec![0.0; points.len()],
            errors: of_placing.iter().fold(of_points, |sum, rate| sum + rate * rate.transpose()),
        })
    }
}
