//! One fit's target: who contracts and which numbers are to be met.

use super::{Activation, Dataset, Error, Lengths, TargetKind, Vowel, activation};
use crate::muscle::{Muscle, PerMuscle};

/// What the user may decide instead of the rules of thesis 4.3.2.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TargetOptions {
    /// The contracting muscles, in any order; by default those that are shorter than in the baseline.
    pub muscles: Option<Vec<Muscle>>,
    /// The vowel to compare with; by default /ɯ/.
    pub baseline: Option<Vowel>,
}

/// What a fit has to hit, made from one measured row and its baseline.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// The subject.
    pub subject: String,
    /// The vowel to fit.
    pub vowel: Vowel,
    /// The vowel it is compared with, taken as the shape at rest.
    pub baseline: Vowel,
    /// The quantity compared.
    pub kind: TargetKind,
    /// The muscles that are given a tension, in the order of [`Muscle::ALL`]; at least one.
    pub active: Vec<Muscle>,
    /// Measured lengths, mm.
    pub measured_mm: PerMuscle<f64>,
    /// Measured lengths in the baseline vowel, mm.
    pub baseline_mm: PerMuscle<f64>,
    /// How each length changed; what decides [`Target::active`] unless the user did.
    pub activation: PerMuscle<Activation>,
    /// The measured quantity of all muscles, dimensionless ([`TargetKind::values`]).
    pub values: PerMuscle<f64>,
    /// The muscles whose value is an equation of the fit: the active ones, for ratios without GGa, whose ratio is
    /// 1 by definition. At least one.
    pub fitted: Vec<Muscle>,
}

impl Target {
    /// The target for `vowel` of `subject`.
    ///
    /// # Errors
    /// Unknown subject, missing row or baseline, and as [`Target::from_lengths`].
    pub fn new(
        data: &Dataset,
        subject: &str,
        vowel: Vowel,
        kind: TargetKind,
        options: &TargetOptions,
    ) -> Result<Self, Error> {
        let measured = data.row(subject, vowel)?;
        let baseline = data.baseline_vowel(subject, options.baseline.unwrap_or(Vowel::U))?;
        Self::from_lengths(measured, baseline, kind, options.muscles.as_deref())
    }

    /// The target that `measured` sets against `baseline`, with the contracting `muscles` where they are given.
    ///
    /// # Errors
    /// [`Error::IsBaseline`], [`Error::NoContraction`], [`Error::NoMuscles`], [`Error::RepeatedMuscle`] and
    /// [`Error::NoEquation`].
    pub fn from_lengths(
        measured: &Lengths,
        baseline: &Lengths,
        kind: TargetKind,
        muscles: Option<&[Muscle]>,
    ) -> Result<Self, Error> {
        let (subject, vowel) = (measured.subject.clone(), measured.vowel);
        if vowel == baseline.vowel {
            return Err(Error::IsBaseline { subject, vowel });
        }
        let activation = activation(&measured.length_mm, &baseline.length_mm);
        let active = match muscles {
            Some(chosen) => in_order(chosen)?,
            None => Muscle::ALL.into_iter().filter(|m| activation[m.index()].contracting).collect(),
        };
        if active.is_empty() {
            return Err(Error::NoContraction { subject, vowel, baseline: baseline.vowel });
        }
        let fitted: Vec<_> = active.iter().copied().filter(|m| kind.constrains(*m)).collect();
        if fitted.is_empty() {
            return Err(Error::NoEquation { subject, vowel });
        }
        Ok(Self {
            subject,
            vowel,
            baseline: baseline.vowel,
            kind,
            active,
            measured_mm: measured.length_mm,
            baseline_mm: baseline.length_mm,
            activation,
            values: kind.values(&measured.length_mm, &baseline.length_mm),
            fitted,
        })
    }

    /// The same quantity as [`Target::values`] for a simulated shape: its muscle lengths and those at rest, both m.
    pub fn simulated(&self, lengths_m: &PerMuscle<f64>, rest_m: &PerMuscle<f64>) -> PerMuscle<f64> {
        self.kind.values(lengths_m, rest_m)
    }
}

/// A user's choice of muscles in the order of the tables, each once.
fn in_order(chosen: &[Muscle]) -> Result<Vec<Muscle>, Error> {
    let mut muscles = chosen.to_vec();
    muscles.sort_unstable();
    match muscles.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(Error::RepeatedMuscle { muscle: pair[0] }),
        None if muscles.is_empty() => Err(Error::NoMuscles),
        None => Ok(muscles),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::published::Tables;

    fn target(subject: &str, vowel: Vowel, kind: TargetKind) -> Result<Target, Error> {
        Target::new(&Dataset::reference()?, subject, vowel, kind, &TargetOptions::default())
    }

    fn message(result: Result<Target, Error>) -> String {
        result.unwrap_err().to_string()
    }

    #[test]
    fn s2_a_is_the_target_of_the_thesis() {
        let t = target("S2", Vowel::A, TargetKind::Ratio).unwrap();
        assert_eq!(t.active, [Muscle::GGa, Muscle::SGm, Muscle::HGa]);
        assert_eq!(t.fitted, [Muscle::SGm, Muscle::HGa]);
        assert_eq!(t.baseline, Vowel::U);
        let of_active = t.active.iter().map(|m| t.values[m.index()]).collect::<Vec<_>>();
        assert_eq!(of_active, [1.0, 23.0 / 41.0, 33.0 / 41.0]);
        let published = Tables::reference().unwrap().measured_ratio_a;
        for m in Muscle::ALL {
            let (ours, theirs) = (t.values[m.index()], published[m.index()]);
            assert!((ours - theirs).abs() <= 0.005, "{m}: {ours} against {theirs} in table 4.7");
        }
        let uncertain: Vec<_> =
            Muscle::ALL.into_iter().filter(|m| t.activation[m.index()].uncertain).collect();
        assert_eq!(uncertain, [Muscle::SGp]);
    }

    #[test]
    fn stretch_of_s2_a_has_three_equations() {
        let t = target("S2", Vowel::A, TargetKind::Stretch).unwrap();
        assert_eq!(t.fitted, t.active);
        assert_eq!(t.values[Muscle::GGa.index()], 41.0 / 46.0);
        assert_eq!(t.values[Muscle::HGp.index()], 35.0 / 31.0);
    }

    #[test]
    fn all_twelve_rows_beside_a_baseline_have_both_kinds_of_target() {
        for subject in ["S1", "S2", "S3"] {
            for vowel in [Vowel::I, Vowel::E, Vowel::A, Vowel::O] {
                for kind in TargetKind::ALL {
                    let t = target(subject, vowel, kind).unwrap();
                    assert!(t.active.iter().all(|m| t.activation[m.index()].change_mm < 0.0));
                    assert!(!t.fitted.is_empty());
                }
            }
        }
    }

    #[test]
    fn a_baseline_vowel_and_muscles_may_be_chosen() {
        let options =
            TargetOptions { muscles: Some(vec![Muscle::HGa, Muscle::GGa]), baseline: Some(Vowel::E) };
        let data = Dataset::reference().unwrap();
        let t = Target::new(&data, "S4", Vowel::A, TargetKind::Ratio, &options).unwrap();
        assert_eq!((t.baseline, t.active), (Vowel::E, vec![Muscle::GGa, Muscle::HGa]));
        assert_eq!(t.baseline_mm, data.row("S4", Vowel::E).unwrap().length_mm);
    }

    #[test]
    fn what_cannot_be_fitted_says_why_and_what_to_do() {
        let data = Dataset::reference().unwrap();
        let choose = |muscles: &[Muscle]| TargetOptions { muscles: Some(muscles.to_vec()), baseline: None };
        let ratio = |options| Target::new(&data, "S2", Vowel::A, TargetKind::Ratio, &options);

        assert!(message(target("S2", Vowel::U, TargetKind::Ratio)).starts_with(
            "/ɯ/ of S2 is the baseline itself, so there is nothing to fit; choose another vowel"
        ));
        assert_eq!(
            message(target("S4", Vowel::A, TargetKind::Ratio)),
            "S4 has no row for the baseline vowel /ɯ/ in targets/takano2007_lengths.csv (built in); it has \
             /i/, /e/, /a/, /o/: choose one of these as the baseline instead"
        );
        assert!(message(ratio(choose(&[]))).starts_with("the list of contracting muscles is empty"));
        assert!(
            message(ratio(choose(&[Muscle::SGm, Muscle::GGa, Muscle::SGm])))
                .starts_with("muscle SGm is listed twice")
        );
        assert!(message(ratio(choose(&[Muscle::GGa]))).contains("its ratio to itself is always 1"));
        assert!(
            Target::new(&data, "S2", Vowel::A, TargetKind::Stretch, &choose(&[Muscle::GGa])).is_ok(),
            "a stretch of GGa alone is an equation"
        );
    }

    #[test]
    fn a_row_in_which_nothing_shortens_says_so() {
        let data = Dataset::reference().unwrap();
        let baseline = data.baseline("S2").unwrap();
        let mut measured = Lengths { vowel: Vowel::A, ..baseline.clone() };
        let result = Target::from_lengths(&measured, baseline, TargetKind::Stretch, None);
        assert_eq!(
            message(result),
            "no muscle of S2 is shorter in /a/ than in /ɯ/, so none contracts; name the contracting muscles yourself"
        );
        // A millimetre shorter is within rounding: contracting all the same, and marked.
        measured.length_mm[Muscle::SGm.index()] -= 1.0;
        let t = Target::from_lengths(&measured, baseline, TargetKind::Stretch, None).unwrap();
        assert_eq!(t.active, [Muscle::SGm]);
        assert!(t.activation[Muscle::SGm.index()].uncertain);
    }
}
