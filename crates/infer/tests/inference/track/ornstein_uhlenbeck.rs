//! The prior of successive frames, and the tensions of its unbounded numbers.

use nalgebra::DMatrix;
use tongue_infer::track::{OrnsteinUhlenbeck, Softplus};

#[test]
fn solutions_images_and_draws_are_those_of_the_whole_matrix() {
    let (n, times, memory) = (2, [0.0, 0.01, 0.03, 0.035], 0.02);
    let mut rng = fastrand::Rng::with_seed(3);
    let mut random = |rows: usize, columns: usize| DMatrix::from_fn(rows, columns, |_, _| rng.f64() - 0.5);
    let covariance = DMatrix::identity(n, n) * 0.7 + DMatrix::from_element(n, n, 0.2);
    let curvature: Vec<_> = times.iter().map(|_| random(3, n)).map(|j| j.transpose() * j).collect();
    let chain = OrnsteinUhlenbeck::new(covariance.clone().try_inverse().unwrap(), memory, &times);

    // The covariance of the process, element by element.
    let all = n * times.len();
    let process = DMatrix::from_fn(all, all, |i, j| {
        let apart: f64 = times[i / n] - times[j / n];
        covariance[(i % n, j % n)] * (-apart.abs() / memory).exp()
    });
    let mut whole = process.try_inverse().unwrap();
    let z = random(all, 1);
    let blocks =
        |v: &DMatrix<f64>| (0..times.len()).map(|t| v.rows(t * n, n).into_owned()).collect::<Vec<_>>();
    let image = chain.image(&blocks(&z).iter().map(|b| b.column(0).into_owned()).collect::<Vec<_>>());
    for (a, b) in image.iter().zip(blocks(&(&whole * &z))) {
        assert!((a - b.column(0)).amax() < 1e-9);
    }
    for (t, g) in curvature.iter().enumerate() {
        let mut part = whole.view_mut((t * n, t * n), (n, n));
        part += g;
    }
    let inverse = whole.try_inverse().unwrap();
    let factors = chain.factorise(curvature).unwrap();
    let right = random(all, 3);
    let mut solved = blocks(&right);
    factors.solve(&mut solved);
    for (a, b) in solved.iter().zip(blocks(&(&inverse * right))) {
        assert!((a - b).amax() < 1e-10);
    }
    // Draws made window by window, the last first, are the same bits.
    let whole = blocks(&DMatrix::from_fn(all, 2, |i, j| (i + 3 * j) as f64 * 0.1));
    let mut at_once = whole.clone();
    factors.colour(&mut at_once, 0, None);
    let mut last = whole[2..].to_vec();
    factors.colour(&mut last, 2, None);
    let mut first = whole[..2].to_vec();
    factors.colour(&mut first, 0, Some(&last[0]));
    assert_eq!([first, last].concat(), at_once);
    // The images of unit vectors are a square root of the covariance.
    let mut root = blocks(&DMatrix::identity(all, all));
    factors.colour(&mut root, 0, None);
    let mut square = DMatrix::zeros(all, all);
    for (i, a) in root.iter().enumerate() {
        for (j, b) in root.iter().enumerate() {
            square.view_mut((i * n, j * n), (n, n)).copy_from(&(a * b.transpose()));
        }
    }
    assert!((square - inverse).amax() < 1e-10);
}

#[test]
fn the_slope_is_the_derivative_and_nothing_overflows() {
    let link = Softplus::default();
    for h in [-900.0, -20.0, -1.0, 0.0, 0.5, 8.0, 60.0, 5000.0] {
        let (f, slope) = link.tension(h);
        let difference = (link.tension(h + 1e-4).0 - link.tension(h - 1e-4).0) / 2e-4;
        assert!(f >= 0.0 && (slope - difference).abs() < 1e-6, "{h}: {f} {slope} {difference}");
    }
    assert!((link.tension(0.0).0 - 3.0 * 2f64.ln()).abs() < 1e-12);
    // The width of the prior's 95 % interval.
    assert!((link.prior_quantile(1.96) - link.prior_quantile(-1.96) - 52.7).abs() < 0.1);
    // Its standard deviation, from two million draws of another program.
    assert!((link.prior_sd_n() - 15.62).abs() < 0.02, "{}", link.prior_sd_n());
    assert!((Softplus::of_scale(40.0).tension(16.0).0 - 2.0 * link.tension(8.0).0).abs() < 1e-12);
}
