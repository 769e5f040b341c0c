//! Normal random numbers, and independent seeds.

use std::f64::consts::TAU;

use nalgebra::DVector;

/// A standard normal number (Box and Muller 1958).
pub fn normal(random: &mut fastrand::Rng) -> f64 {
    let radius = (-2.0 * (1.0 - random.f64()).ln()).sqrt();
    radius * (TAU * random.f64()).cos()
}

pub fn normals(count: usize, random: &mut fastrand::Rng) -> DVector<f64> {
    DVector::from_fn(count, |_, _| normal(random))
}

/// A seed for each number, such that the seeds of neighbouring numbers are independent (splitmix64).
pub fn seed_of(seed: u64, number: usize) -> u64 {
    let mut z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(number as u64 + 1));
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
