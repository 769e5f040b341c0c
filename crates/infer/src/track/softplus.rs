//! Tensions as a smooth function of unbounded numbers, so that a slack muscle is not on a bound: `F = s ln(1 + exp(h / s))`.

use crate::standard_deviations as sd;

/// The link of tensions, and their prior: `h = middle + M + e(t)` with `M ~ N(0, level²)` shared by all frames and `e` an
/// Ornstein-Uhlenbeck process. Independent priors of the frames would treat the mean of all frames as known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Softplus {
    /// The constant `s`, where the exponential turns into a straight line, N per metre of thickness.
    pub bend_n: f64,
    /// Prior mean of `h`, N/m.
    pub middle_n: f64,
    /// Standard deviation of the level, N/m.
    pub level_sd_n: f64,
    /// Standard deviation of the course, N/m.
    pub course_sd_n: f64,
}

impl Default for Softplus {
    fn default() -> Self {
        Self::of_scale(sd::TENSION_N)
    }
}

impl Softplus {
    /// A link with all values in proportion to a scale of the tensions, N/m; the default is 20 N/m.
    pub fn of_scale(scale_n: f64) -> Self {
        let by = scale_n / sd::TENSION_N;
        Self {
            bend_n: sd::BEND_N * by,
            middle_n: sd::LEVEL_MIDDLE_N * by,
            level_sd_n: sd::LEVEL_N * by,
            course_sd_n: sd::COURSE_N * by,
        }
    }

    pub fn scale_n(&self) -> f64 {
        sd::TENSION_N * self.bend_n / sd::BEND_N
    }

    /// Tension, N/m, and its derivative by `h`.
    pub fn tension(&self, h: f64) -> (f64, f64) {
        let t = h / self.bend_n;
        // ln(1 + e^t) without overflow.
        let value = t.max(0.0) + (-t.abs()).exp().ln_1p();
        (self.bend_n * value, 1.0 / (1.0 + (-t).exp()))
    }

    /// The tension in the middle of the bend, N/m: a muscle below it cannot be distinguished from a slack one.
    pub fn slack_n(&self) -> f64 {
        self.tension(0.0).0
    }

    /// Quantile of a tension in the prior, N/m; `z` is the standard normal quantile of the same probability.
    pub fn prior_quantile(&self, z: f64) -> f64 {
        self.tension(self.middle_n + z * self.level_sd_n.hypot(self.course_sd_n)).0
    }

    /// Standard deviation of a tension in the prior, N/m.
    pub fn prior_sd_n(&self) -> f64 {
        let moment = |power: i32| {
            let grid = (-60..=60).map(|i| 0.1 * f64::from(i)).map(|z| (z, (-0.5 * z * z).exp()));
            let (sum, all) =
                grid.fold((0.0, 0.0), |(s, a), (z, w)| (s + w * self.prior_quantile(z).powi(power), a + w));
            sum / all
        };
        (moment(2) - moment(1).powi(2)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
