//! Batches: the fits of a table.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

use tongue_core::statistics::distinct;
use tongue_input::measured::lengths::rest_distance::{self, RestDistance};
use tongue_input::measured::{Dataset, Lengths, ReadError, Target, TargetKind, Vowel};

use super::{Fit, FitSettings, Method};

/// Baseline of a subject without /ɯ/; other published models take it for the rest posture.
pub const SUBSTITUTE_BASELINE: &str = "e";

/// Rows to be fitted, and their baselines.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Selection {
    pub subjects: Option<Vec<String>>,
    pub vowels: Option<Vec<Vowel>>,
    pub kinds: Vec<TargetKind>,
    /// The baseline of subjects that are not in [`Selection::baseline_of`]; by default /ɯ/, and /e/ for subjects without /ɯ/.
    pub baseline: Option<Vowel>,
    pub baseline_of: BTreeMap<String, Vowel>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// Line of the row in its file.
    pub line: u64,
    /// Whether the baseline replaces a missing /ɯ/.
    pub substitute: bool,
    pub target: Target,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct BaselineRow {
    pub line: u64,
    pub subject: String,
    pub vowel: Vowel,
    #[serde(rename = "substitute_baseline")]
    pub substitute: bool,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Refusal {
    pub line: u64,
    pub subject: String,
    pub vowel: Vowel,
    /// The quantity, if the other one can be fitted.
    #[serde(rename = "target_kind")]
    pub kind: Option<TargetKind>,
    pub message: String,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { line, subject, vowel, kind, message } = self;
        let kind = kind.map_or_else(String::new, |kind| format!(", {kind}"));
        write!(f, "line {line}, {subject} /{vowel}/{kind}: {message}")
    }
}

/// Fits in the order of the rows and of the kinds; baselines and refusals in the order of the rows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BatchPlan {
    pub jobs: Vec<Job>,
    pub baselines: Vec<BaselineRow>,
    pub refusals: Vec<Refusal>,
}

/// Sorts the rows of `data` into fits, baselines and refusals.
///
/// # Errors
/// For a selected subject, a subject with a baseline, or a selected vowel that has no row.
pub fn plan(data: &Dataset, selection: &Selection) -> Result<BatchPlan, ReadError> {
    for subject in selection.subjects.iter().flatten().chain(selection.baseline_of.keys()) {
        data.vowels(subject)?;
    }
    let rows = data.rows.iter().map(|r| &r.lengths);
    let rows = rows.filter(|l| selection.subjects.as_ref().is_none_or(|all| all.contains(&l.subject)));
    // If a table has no `u`, `u` means its `ɯ`.
    let is_of = |asked: &Vowel, subject: &str, vowel: &Vowel| {
        let exact = rows.clone().any(|l| l.subject == subject && l.vowel == *asked);
        asked == vowel || (!exact && asked.is_like(vowel))
    };
    for asked in selection.vowels.iter().flatten() {
        if !rows.clone().any(|l| is_of(asked, &l.subject, &l.vowel)) {
            let has = distinct(rows.clone().map(|lengths| lengths.vowel.clone()));
            let message = format!("{} has no row for /{asked}/; it has {}", data.origin, Vowel::list(&has));
            return Err(ReadError::Refused(message));
        }
    }
    let mut plan = BatchPlan::default();
    for row in &data.rows {
        let lengths = &row.lengths;
        let (subject, vowel, line) = (&lengths.subject, &lengths.vowel, row.line);
        if selection.subjects.as_ref().is_some_and(|s| !s.contains(subject))
            || selection.vowels.as_ref().is_some_and(|all| !all.iter().any(|v| is_of(v, subject, vowel)))
        {
            continue;
        }
        let refused = |kind, message: String| Refusal {
            line,
            subject: subject.clone(),
            vowel: vowel.clone(),
            kind,
            message,
        };
        let (baseline, substitute) = match baseline(data, selection, subject) {
            Ok(found) => found,
            Err(e) => {
                plan.refusals.push(refused(None, e.to_string()));
                continue;
            }
        };
        if baseline.vowel == *vowel {
            let (subject, vowel) = (subject.clone(), vowel.clone());
            plan.baselines.push(BaselineRow { line, subject, vowel, substitute });
            continue;
        }
        for &kind in &selection.kinds {
            match Target::from_lengths(lengths, baseline, kind, None) {
                Ok(target) => plan.jobs.push(Job { line, substitute, target }),
                Err(e) => plan.refusals.push(refused(Some(kind), e.to_string())),
            }
        }
    }
    Ok(plan)
}

/// The baseline of a subject, and whether it replaces a missing /ɯ/.
fn baseline<'a>(
    data: &'a Dataset,
    selection: &Selection,
    subject: &str,
) -> Result<(&'a Lengths, bool), ReadError> {
    if let Some(vowel) = selection.baseline_of.get(subject).or(selection.baseline.as_ref()) {
        return data.baseline_vowel(subject, vowel).map(|l| (l, false));
    }
    match data.baseline(subject) {
        Ok(own) => Ok((own, false)),
        // The first error is reported, because it names /ɯ/, which the user has to add.
        Err(missing) => {
            let substitute = Vowel::new(SUBSTITUTE_BASELINE).ok();
            let other = substitute.and_then(|vowel| data.baseline_vowel(subject, &vowel).ok());
            other.map(|other| (other, true)).ok_or(missing)
        }
    }
}

/// Settings of a batch: eight starts.
pub fn settings(method: Method) -> FitSettings {
    FitSettings { method, starts: 8, ..FitSettings::default() }
}

/// Distance of the model at rest from the row's baseline; `None` if they have no common ratio.
pub fn rest_distance(fit: &Fit) -> Option<RestDistance> {
    let t = &fit.matched.target;
    let baseline = Lengths {
        subject: t.subject.clone(),
        vowel: t.baseline.clone(),
        muscles: t.muscles.clone().into(),
        length_mm: t.baseline_mm.iter().copied().map(Some).collect(),
        half_width_mm: t.baseline_half_width_mm.clone(),
    };
    rest_distance::distance(
        &t.muscles,
        &fit.rest_lengths[..t.muscles.len()],
        &baseline,
        &t.muscles[t.reference],
    )
}
