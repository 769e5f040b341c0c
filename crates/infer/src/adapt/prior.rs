//! The prior of tensions learned from a speaker's own frames.

use nalgebra::{DMatrix, DVector};

use crate::track::CoursePrior;

/// Weight of the previous prior, in frames, because few frames carry little information.
const DRAWN_BY: f64 = 4.0;

/// The prior of tensions learned from frames: mean and covariance of the scores, including the posterior covariance of each frame, shrunk
/// towards `before` with the weight of four frames.
pub fn learned(before: &CoursePrior, scores: &[DVector<f64>], covariances: &[DMatrix<f64>]) -> CoursePrior {
    let weight = scores.len() as f64 + DRAWN_BY;
    let mean = (scores.iter().sum::<DVector<f64>>() + &before.mean * DRAWN_BY) / weight;
    let mut covariance = &before.covariance * DRAWN_BY;
    for (x, c) in scores.iter().zip(covariances) {
        let away = x - &mean;
        covariance += &away * away.transpose() + c;
    }
    let away = &before.mean - &mean;
    covariance += &away * away.transpose() * DRAWN_BY;
    CoursePrior { mean, covariance: covariance / weight, ..before.clone() }
}
