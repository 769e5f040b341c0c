//! What a speaker's own frames say of tensions to expect.

use nalgebra::{DMatrix, DVector};

use crate::track::Prior;

/// Frames of the half-normal prior to which the learned one is drawn: few frames know little.
const DRAWN_BY: f64 = 4.0;

/// The prior of tensions learned from frames: mean and covariance of the scores, the posterior covariance of each frame included,
/// drawn towards `before` as if by four frames of it.
pub fn learned(before: &Prior, scores: &[DVector<f64>], covariances: &[DMatrix<f64>]) -> Prior {
    let weight = scores.len() as f64 + DRAWN_BY;
    let mean = (scores.iter().sum::<DVector<f64>>() + &before.mean * DRAWN_BY) / weight;
    let mut covariance = &before.covariance * DRAWN_BY;
    for (x, c) in scores.iter().zip(covariances) {
        let away = x - &mean;
        covariance += &away * away.transpose() + c;
    }
    let away = &before.mean - &mean;
    covariance += &away * away.transpose() * DRAWN_BY;
    Prior { mean, covariance: covariance / weight, ..before.clone() }
}
