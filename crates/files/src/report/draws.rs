//! Draws of a posterior as a table for ArviZ: one row for each draw, with its chain and its number.

use std::f64::consts::TAU;
use std::io::{self, Write};

use nalgebra::DMatrix;

use super::csv;
use super::export::{Export, Provenance};
use tongue_infer::posterior::{Draw, Posterior};

/// Draws as CSV: `chain`, `draw`, a column for each number, then version and command. All chains have one length, so they
/// fill an array. The columns are those of the posture whose number is given; the tensions of other postures follow.
#[derive(Debug, Clone, Copy)]
pub struct Draws<'a>(pub &'a Posterior<'a>, pub usize);

impl Draws<'_> {
    /// Numbers of the measured stretches of the posture among all measured ones.
    fn measured(&self) -> Vec<usize> {
        let postures = &self.0.density.seen.postures;
        (0..postures.len()).filter(|i| postures[*i] == self.1).collect()
    }

    /// At a draw, of each of these stretches the logarithm of its probability density given all other measured stretches, whose errors are
    /// correlated: `ln(Q_ii / 2π)/2 - (Q r)_i²/(2 Q_ii)` with residuals `r` and the inverse `Q` of their covariance (Bürkner, Gabry and
    /// Vehtari 2021, Computational Statistics 36, section 2). Leaving-one-out by importance sampling takes it.
    fn log_likelihoods(&self, inverse: &DMatrix<f64>, stretches: &[usize], draw: &Draw) -> Vec<f64> {
        let pulls = inverse * self.0.density.residuals(&draw.lengths, &draw.baseline_lengths, &draw.beside);
        let each = stretches.iter().map(|&i| {
            let precision = inverse[(i, i)];
            0.5 * ((precision / TAU).ln() - pulls[i] * pulls[i] / precision)
        });
        each.collect()
    }
}

impl Export for Draws<'_> {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        let (muscles, posture) = (&self.0.density.posterior_model.muscles, self.1);
        let labels = &self.0.density.seen.labels;
        let others: Vec<usize> = (0..labels.len()).filter(|p| *p != posture).collect();
        let mut columns = vec!["chain".to_owned(), "draw".to_owned(), "log_density".to_owned()];
        for name in ["tension", "baseline_tension", "change"] {
            columns.extend(muscles.iter().map(|m| format!("{name}_{m}_n_per_m")));
        }
        columns.extend(["hyoid_x_mm", "hyoid_y_mm", "hyoid_tilt_rad_per_m"].map(str::to_owned));
        columns.extend(muscles.iter().map(|m| format!("stretch_{m}")));
        let (measured, inverse) = (self.measured(), self.0.density.factor().inverse());
        let names = &self.0.density.seen.names;
        columns.extend(measured.iter().map(|&i| format!("log_likelihood_{}", names[i])));
        for &other in &others {
            columns.extend(muscles.iter().map(|m| format!("tension_{}_{m}_n_per_m", labels[other])));
        }
        let row = |draw: &Draw| {
            let first = [draw.chain.to_string(), draw.number.to_string(), draw.log.to_string()];
            let each = || 0..muscles.len();
            let own = &draw.meaning.postures[posture];
            let numbers = own.tensions.iter().chain(&draw.meaning.tones).copied();
            let numbers = numbers.chain(each().map(|m| draw.change(posture, m)));
            let numbers = numbers.chain(own.hyoid.iter().map(|d| 1e3 * d));
            let numbers = numbers.chain([draw.meaning.tilt]);
            let numbers = numbers.chain(each().map(|m| draw.stretch(posture * muscles.len() + m)));
            let numbers = numbers.chain(self.log_likelihoods(&inverse, &measured, draw));
            let of_others = others.iter().flat_map(|&p| draw.meaning.postures[p].tensions.iter().copied());
            let numbers = numbers.chain(of_others).map(|value| value.to_string());
            first.into_iter().chain(numbers).collect::<Vec<_>>()
        };
        csv::write(out, by, columns.iter().map(String::as_str), self.0.draws.iter().map(row))
    }
}
