//! Validation cases: the muscles of a vowel that do not contract are predicted from those that do.

use tongue_core::body::Mesh;
use tongue_core::statistics::distinct;
use tongue_infer::inverse::TargetOnBody;
use tongue_input::measured::{Dataset, Lengths, Target, TargetKind, Vowel};

#[derive(Debug, Clone)]
pub struct Case {
    pub subject: String,
    pub vowel: Vowel,
    /// The measurements, and the muscles of the body that they belong to.
    pub matched: TargetOnBody,
    pub unseen: Vec<usize>,
}

impl Case {
    /// The case of a target whose passive muscles are unseen; `None` if the body lacks a muscle that is
    /// needed.
    pub fn new(mesh: &Mesh<2>, target: &Target) -> Option<Self> {
        let matched = TargetOnBody::new(mesh, target).ok()?;
        let target = &matched.target;
        let unseen = (0..target.muscles.len()).filter(|m| !target.active.contains(m)).collect();
        Some(Self { subject: target.subject.clone(), vowel: target.vowel.clone(), unseen, matched })
    }

    pub fn target(&self) -> &Target {
        &self.matched.target
    }

    pub fn stretch_of(&self, muscle: &str) -> Option<f64> {
        let at = self.target().muscles.iter().position(|m| m == muscle)?;
        Some(self.target().values[at])
    }

    /// Mean square error of predicted stretches (of all muscles of the target) over the unseen muscles.
    pub fn error(&self, predicted: &[f64]) -> f64 {
        let squares = self.unseen.iter().map(|&m| (predicted[m] - self.target().values[m]).powi(2));
        squares.sum::<f64>() / self.unseen.len() as f64
    }

    /// The case with each muscle as the only unseen one.
    pub fn each_left_out(&self) -> impl Iterator<Item = Self> {
        (0..self.target().muscles.len()).map(|m| Self { unseen: vec![m], ..self.clone() })
    }
}

/// Every vowel of every subject that has the baseline, in the order of the table, if it has passive muscles.
pub fn cases(data: &Dataset, mesh: &Mesh<2>, baseline: &Vowel) -> Vec<Case> {
    of_rows(data, mesh, baseline, |lengths| lengths.clone())
}

/// As [`cases`], for given rows of lengths.
pub fn of_rows(
    data: &Dataset,
    mesh: &Mesh<2>,
    baseline: &Vowel,
    make: impl Fn(&Lengths) -> Lengths,
) -> Vec<Case> {
    let rows = data.rows().iter().map(|row| &row.lengths);
    rows.filter_map(|lengths| {
        let own = data.baseline_vowel(&lengths.subject, baseline).ok()?;
        let target = Target::from_lengths(&make(lengths), &make(own), TargetKind::Stretch, None).ok()?;
        Case::new(mesh, &target).filter(|case| !case.unseen.is_empty())
    })
    .collect()
}

pub fn subjects(cases: &[Case]) -> Vec<&str> {
    distinct(cases.iter().map(|case| case.subject.as_str()))
}
