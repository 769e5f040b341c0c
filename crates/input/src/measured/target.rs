//! Target of a fit: the contracting muscles, and the numbers to be met.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::error::ReadError;
use super::lengths::{Activation, Dataset, Lengths, Vowel, position_of};
use tongue_core::choice;

const STRETCHES: std::ops::RangeInclusive<f64> = 0.5..=1.7;

/// A user's choices in place of the rules of thesis 4.3.2.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TargetOptions {
    /// The contracting muscles, in any order; by default those that are shorter than in the baseline.
    pub muscles: Option<Vec<String>>,
    /// By default /ɯ/.
    pub baseline: Option<Vowel>,
}

/// Target of a fit, made from a measured row and its baseline. Muscles are those measured in both rows, in the order of the table's
/// columns; all lists are parallel to [`Target::muscles`] or contain positions in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    pub subject: String,
    pub vowel: Vowel,
    /// The vowel whose shape is taken as rest.
    pub baseline: Vowel,
    pub kind: TargetKind,
    pub muscles: Vec<String>,
    pub reference: usize,
    /// Positions of the muscles with unknown tensions, ascending; at least one.
    pub active: Vec<usize>,
    /// Positions of the muscles whose values are fitted, at least one: the active ones, for ratios except the reference, whose ratio is 1
    /// by definition.
    pub fitted: Vec<usize>,
    pub measured_mm: Vec<f64>,
    pub baseline_mm: Vec<f64>,
    /// Half widths of the rounding of the measured lengths and of the baseline's, mm.
    pub half_width_mm: Vec<f64>,
    pub baseline_half_width_mm: Vec<f64>,
    /// Change of each length; it determines [`Target::active`] unless the user does.
    pub activation: Vec<Activation>,
    /// Measured ratios or stretches of all muscles ([`TargetKind::values`]).
    pub values: Vec<f64>,
    /// Muscles of the table that are not in the target, because one of the rows has no length of them.
    pub not_measured: Vec<String>,
}

impl Target {
    /// Whether muscles may pull in the baseline as in any vowel, so that the model's error there counts: in every baseline but /ɯ/.
    pub fn has_active_baseline(&self) -> bool {
        self.baseline != Vowel::unrounded_u()
    }

    pub fn new(
        data: &Dataset,
        subject: &str,
        vowel: &Vowel,
        kind: TargetKind,
        options: &TargetOptions,
    ) -> Result<Self, ReadError> {
        let measured = data.row(subject, vowel)?;
        let usual = Vowel::unrounded_u();
        let baseline = data.baseline_vowel(subject, options.baseline.as_ref().unwrap_or(&usual))?;
        Self::from_lengths(measured, baseline, kind, options.muscles.as_deref())
    }

    /// The target of the row `measured` against the row `baseline` of the same table; the contracting muscles are `muscles`, if given.
    pub fn from_lengths(
        measured: &Lengths,
        baseline: &Lengths,
        kind: TargetKind,
        muscles: Option<&[String]>,
    ) -> Result<Self, ReadError> {
        let Lengths { subject, vowel, muscles: table, .. } = measured;
        let of = &baseline.vowel;
        if vowel == of {
            return refused(format!(
                "/{vowel}/ of {subject} is the baseline itself, so there is nothing to fit; choose another vowel or another baseline"
            ));
        }
        let changes = measured.activation(baseline).into_iter().enumerate();
        let both: Vec<(usize, f64, f64, Activation)> = changes
            .filter_map(|(i, change)| Some((i, measured.length_mm[i]?, baseline.length_mm[i]?, change?)))
            .collect();
        if let Some((i, mm, from_mm, _)) = both.iter().find(|(_, a, b, _)| !STRETCHES.contains(&(a / b))) {
            return refused(format!(
                "{} of {subject} is {mm} mm in /{vowel}/ and {from_mm} mm in /{of}/, but no muscle of a tongue changes its length to less \
                 than 0.5 or more than 1.7 times; correct the length that is wrong, or leave it empty",
                table[*i]
            ));
        }
        let names: Vec<String> = both.iter().map(|(i, ..)| table[*i].clone()).collect();
        let activation: Vec<Activation> = both.iter().map(|(.., change)| *change).collect();
        let active = match muscles {
            Some(chosen) => chosen_positions(chosen, &names, measured, baseline)?,
            None => (0..names.len()).filter(|&m| activation[m].contracting).collect(),
        };
        if active.is_empty() {
            return refused(format!(
                "no muscle of {subject} is shorter in /{vowel}/ than in /{of}/, so none contracts; name the muscles that may with \
                 --muscles and --vowel {vowel} (a posterior of that fit lets every muscle pull)"
            ));
        }
        let of_ratios = &table[reference_muscle(table)];
        let reference = match names.iter().position(|n| n == of_ratios) {
            Some(reference) => reference,
            None if kind == TargetKind::Stretch => 0,
            None => {
                return refused(format!(
                    "{of_ratios} of {subject} was not measured in /{vowel}/, but ratios are relative to it; use the stretch target, or \
                     add its length"
                ));
            }
        };
        let is_free = |m: &usize| kind == TargetKind::Stretch || *m != reference;
        let fitted: Vec<usize> = active.iter().copied().filter(is_free).collect();
        if fitted.is_empty() {
            return refused(format!(
                "only {} contracts in /{vowel}/ of {subject}, and its ratio to itself is always 1, so a ratio target says nothing about \
                 it; use the stretch target or name more muscles",
                names[reference]
            ));
        }
        let measured_mm: Vec<f64> = both.iter().map(|b| b.1).collect();
        let baseline_mm: Vec<f64> = both.iter().map(|b| b.2).collect();
        let [half_width_mm, baseline_half_width_mm] =
            [measured, baseline].map(|row| both.iter().map(|b| row.half_width_mm[b.0]).collect());
        Ok(Self {
            subject: subject.clone(),
            vowel: vowel.clone(),
            baseline: of.clone(),
            kind,
            reference,
            active,
            fitted,
            values: kind.values(&measured_mm, &baseline_mm, reference),
            measured_mm,
            baseline_mm,
            half_width_mm,
            baseline_half_width_mm,
            activation,
            not_measured: table.iter().filter(|m| !names.contains(m)).cloned().collect(),
            muscles: names,
        })
    }

    /// The target without the muscles that a body lacks. The error is the name of one that the target needs, because it contracts or is the
    /// reference of ratios.
    pub fn of_body(&self, has: impl Fn(&str) -> bool) -> Result<Self, String> {
        fn pick<T: Clone>(from: &[T], kept: &[usize]) -> Vec<T> {
            kept.iter().map(|&m| from[m].clone()).collect()
        }
        let (kept, lacking): (Vec<usize>, Vec<usize>) =
            (0..self.muscles.len()).partition(|&m| has(&self.muscles[m]));
        let is_reference = |m: usize| self.kind == TargetKind::Ratio && m == self.reference;
        if let Some(&missing) = lacking.iter().find(|m| self.active.contains(m) || is_reference(**m)) {
            return Err(self.muscles[missing].clone());
        }
        let position = |m: &usize| kept.iter().position(|k| k == m);
        Ok(Self {
            muscles: pick(&self.muscles, &kept),
            reference: position(&self.reference).unwrap_or(0),
            active: self.active.iter().filter_map(position).collect(),
            fitted: self.fitted.iter().filter_map(position).collect(),
            measured_mm: pick(&self.measured_mm, &kept),
            baseline_mm: pick(&self.baseline_mm, &kept),
            half_width_mm: pick(&self.half_width_mm, &kept),
            baseline_half_width_mm: pick(&self.baseline_half_width_mm, &kept),
            activation: pick(&self.activation, &kept),
            values: pick(&self.values, &kept),
            ..self.clone()
        })
    }

    /// The measured ratios or stretches of all muscles.
    pub fn measured_in(&self, kind: TargetKind) -> Vec<f64> {
        kind.values(&self.measured_mm, &self.baseline_mm, self.reference)
    }

    /// Positions of the muscles that can be compared: for ratios all except the reference, whose ratio is 1 by definition.
    pub fn comparable(&self, kind: TargetKind) -> impl Iterator<Item = usize> + '_ {
        (0..self.muscles.len()).filter(move |&m| kind == TargetKind::Stretch || m != self.reference)
    }

    /// Root mean square difference over the comparable muscles that do not contract; `None` if there are none.
    pub fn passive_rms(&self, kind: TargetKind, simulated: &[f64], measured: &[f64]) -> Option<f64> {
        let passive = self.comparable(kind).filter(|m| !self.active.contains(m));
        let squares = Vec::from_iter(passive.map(|m| (simulated[m] - measured[m]).powi(2)));
        (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    }

    pub fn active_names(&self) -> Vec<&str> {
        self.active.iter().map(|&m| self.muscles[m].as_str()).collect()
    }
}

impl Dataset {
    /// The target of a fit to stretches, in which the muscles that are shorter in `vowel` of `subject` than in /ɯ/ contract.
    pub fn stretches(&self, subject: &str, vowel: &str) -> Result<Target, ReadError> {
        Target::new(self, subject, &vowel.parse()?, TargetKind::Stretch, &TargetOptions::default())
    }

    /// The target of a fit to ratios to the muscle of [`reference_muscle`], in which the muscles that are shorter in `vowel` of `subject`
    /// than in /ɯ/ contract.
    pub fn ratios(&self, subject: &str, vowel: &str) -> Result<Target, ReadError> {
        Target::new(self, subject, &vowel.parse()?, TargetKind::Ratio, &TargetOptions::default())
    }
}

/// Positions in `names` of the muscles that a user chose, ascending.
fn chosen_positions(
    chosen: &[String],
    names: &[String],
    measured: &Lengths,
    baseline: &Lengths,
) -> Result<Vec<usize>, ReadError> {
    let Lengths { subject, vowel, muscles: known, .. } = measured;
    let mut positions = Vec::new();
    for name in chosen {
        let Some(position) = position_of(names, name) else {
            let hint = choice::hint(name, known.iter().map(String::as_str));
            return refused(position_of(known, name).map_or_else(
                || format!("unknown muscle \"{name}\"; {hint}"),
                |i| {
                    let (muscle, baseline) = (&known[i], &baseline.vowel);
                    format!("{muscle} of {subject} was not measured in both /{vowel}/ and /{baseline}/; choose other muscles")
                },
            ));
        };
        positions.push(position);
    }
    positions.sort_unstable();
    if positions.is_empty() {
        let known = known.join(", ");
        return refused(format!("the list of contracting muscles is empty; name at least one of {known}"));
    }
    match positions.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => {
            refused(format!("muscle {} is listed twice; name each contracting muscle once", names[pair[0]]))
        }
        None => Ok(positions),
    }
}

fn refused<T>(why: String) -> Result<T, ReadError> {
    Err(ReadError::Refused(why))
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TargetKind {
    /// Length over the length of a reference muscle in the same shape (GGa in thesis 4.3.1 and 4.4.1): independent of scale.
    #[default]
    Ratio,
    /// Length over the same muscle's length in the baseline: independent of each muscle's rest length.
    Stretch,
}

impl TargetKind {
    pub const ALL: [TargetKind; 2] = [TargetKind::Ratio, TargetKind::Stretch];

    pub fn name(self) -> &'static str {
        choice::name_of(&self)
    }

    /// The compared quantity of a shape with these `lengths`, whose baseline or rest shape has the lengths `at_rest`. Both are positive and
    /// in the same unit and order. `reference` is the position of the reference muscle of ratios.
    pub fn values(self, lengths: &[f64], at_rest: &[f64], reference: usize) -> Vec<f64> {
        match self {
            TargetKind::Ratio => lengths.iter().map(|l| l / lengths[reference]).collect(),
            TargetKind::Stretch => lengths.iter().zip(at_rest).map(|(l, r)| l / r).collect(),
        }
    }
}

/// Position of the reference muscle of ratios: GGa (thesis 4.3.1), or the first muscle if there is no GGa.
pub fn reference_muscle(names: &[String]) -> usize {
    position_of(names, "GGa").unwrap_or(0)
}

impl fmt::Display for TargetKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for TargetKind {
    type Err = ReadError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        choice::named(&name.trim().to_ascii_lowercase()).ok_or_else(|| {
            let hint = choice::hint(name, TargetKind::ALL.map(TargetKind::name));
            ReadError::Refused(format!("unknown target kind \"{name}\"; {hint}"))
        })
    }
}
