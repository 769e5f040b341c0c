//! The measurements of a speaker, in one posture or in several that share a baseline.

use nalgebra::DMatrix;

use crate::inverse::TargetOnBody;

use super::auxiliary::AuxiliaryData;
use tongue_input::measured::Vowel;

/// The stretch of a muscle in a posture.
#[derive(Debug, Clone)]
pub struct MeasuredStretch {
    pub name: String,
    pub muscle: usize,
    pub posture: usize,
    pub value: f64,
}

/// Stretches of a speaker's postures against one baseline.
#[derive(Debug, Clone, Default)]
pub struct Measurements {
    pub stretches: Vec<MeasuredStretch>,
    /// Covariance due to rounding of lengths; postures share that of the baseline.
    pub rounding: DMatrix<f64>,
    pub labels: Vec<String>,
    /// Number of the posture that is /ɯ/, in which the hyoid has its place, or the number after the last posture if the baseline is /ɯ/.
    pub neutral: Option<usize>,
    pub auxiliary: AuxiliaryData,
}

impl Measurements {
    pub fn of_vowel(matched: &TargetOnBody) -> Self {
        Self::of_vowels(&[matched])
    }

    /// All measurements of a speaker's vowels against one baseline. The stretch `m/b` of lengths with rounding half widths `h` has the
    /// variance `(h_m²/b² + h_b² m²/b⁴)/3`, and with the stretch of another vowel the covariance `h_b² m m'/b⁴/3`.
    pub fn of_vowels(vowels: &[&TargetOnBody]) -> Self {
        let mut all = Self::default();
        // Variance of every stretch by its own length, and its derivative by the baseline's length times the half width of that.
        let (mut own, mut shared) = (Vec::new(), Vec::new());
        for (posture, matched) in vowels.iter().enumerate() {
            let target = &matched.target;
            let is_neutral = target.vowel == Vowel::unrounded_u();
            let of_baseline = (!target.has_active_baseline()).then_some(vowels.len());
            all.neutral = all.neutral.or(of_baseline).or(is_neutral.then_some(posture));
            all.labels.push(target.vowel.to_string());
            for (m, name) in target.muscles.iter().enumerate() {
                let (length, over) = (target.measured_mm[m], target.baseline_mm[m]);
                let (name, muscle, value) = (name.clone(), matched.numbers[m], length / over);
                all.stretches.push(MeasuredStretch { name, muscle, posture, value });
                own.push((target.half_width_mm[m] / over).powi(2) / 3.0);
                shared.push(target.baseline_half_width_mm[m] * length / (over * over));
            }
        }
        let n = own.len();
        all.rounding = DMatrix::from_fn(n, n, |i, j| {
            let is_same_muscle = all.stretches[i].muscle == all.stretches[j].muscle;
            let of_baseline = if is_same_muscle { shared[i] * shared[j] / 3.0 } else { 0.0 };
            of_baseline + if i == j { own[i] } else { 0.0 }
        });
        all
    }

    pub fn without(&self, position: usize) -> Self {
        let mut all = self.clone();
        all.stretches.remove(position);
        all.rounding = all.rounding.remove_row(position).remove_column(position);
        all
    }

    /// Index of each measured number in the list of the stretches of all muscles, posture by posture, followed by the auxiliary data.
    pub fn rows(&self, muscles: usize) -> Vec<usize> {
        let stretches = self.stretches.iter().map(|s| s.posture * muscles + s.muscle);
        let from = self.labels.len() * muscles;
        stretches.chain(from..from + self.auxiliary.len()).collect()
    }

    pub fn of_posture(&self, posture: usize) -> Vec<usize> {
        (0..self.stretches.len()).filter(|&i| self.stretches[i].posture == posture).collect()
    }
}
