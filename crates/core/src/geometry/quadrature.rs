//! Gauss's rules.

/// Places in -1..1 and weights, whose sum is 2, of Gauss's rule with `count` points: exact for polynomials up
/// to degree `2 count - 1`. Roots of the Legendre polynomial by Newton's method (Press et al., Numerical
/// Recipes, 3rd ed., 4.6).
pub fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    let n = count as f64;
    // The polynomial of degree `count` and its slope.
    let legendre = |x: f64| {
        let (mut before, mut value) = (1.0, x);
        for k in 2..=count {
            let k = k as f64;
            (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
        }
        (value, n * (x * value - before) / (x * x - 1.0))
    };
    let root = |i: usize| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        for _ in 0..50 {
            let (value, slope) = legendre(x);
            x -= value / slope;
        }
        let (_, slope) = legendre(x);
        (-x, 2.0 / ((1.0 - x * x) * slope * slope))
    };
    match count {
        0 => Vec::new(),
        1 => vec![(0.0, 2.0)],
        _ => (0..count).map(root).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_integrated_exactly_as_far_as_promised() {
        for count in 1..=9 {
            let rule = gauss_legendre(count);
            for power in 0..2 * count {
                let exact = if power % 2 == 0 { 2.0 / (power as f64 + 1.0) } else { 0.0 };
                let sum: f64 = rule.iter().map(|(x, w)| w * x.powi(power as i32)).sum();
                assert!((sum - exact).abs() < 1e-14, "{count} points, power {power}: {sum}");
            }
        }
    }
}
