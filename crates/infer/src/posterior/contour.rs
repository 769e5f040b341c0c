//! A contour of one posture as data of a posterior.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use tongue_core::body::Body;
use tongue_core::geometry::{Point, Similarity};
use tongue_core::observe::{Contour, Observable};

use crate::track::{Errors, SCALE_SD, SHIFT_SD_M, Surface, TURN_SD};
use tongue_input::measured::recording::CONTOUR_SD_M;

use super::beside::{Beside, Of};

/// Step of a central difference along shift, turn and scale, in standard deviations.
const STEP: f64 = 1e-4;

impl Beside {
    /// The distances of the points of a contour from the surface of posture number `posture`, m; the points are in the order of the
    /// contour. Their errors are those of `track` for one frame and those of the placement, linearised at rest. `None` where the body has
    /// no surface or there are no points.
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
            &|p, by| Similarity::new(1.0, TURN_SD * by, centre).place(p - centre),
            &|p, by| Similarity::new((SCALE_SD * by).exp(), 0.0, centre).place(p - centre),
        ];
        let of_placing = placing.map(|moved| {
            let rate = |p: &Point| (distance(moved(*p, STEP)) - distance(moved(*p, -STEP))) / (2.0 * STEP);
            DVector::from_iterator(points.len(), points.iter().map(rate))
        });
        let errors = Errors::default();
        let of_points = DMatrix::from_fn(points.len(), points.len(), |i, j| {
            1e-6 * errors.of_pair((along[i], 1e3 * CONTOUR_SD_M), (along[j], 1e3 * CONTOUR_SD_M), i == j)
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
