//! The JSON record of one fit of a batch, and shards: parts of a batch that run separately, each as one task of a cluster's engine.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

use serde::Serialize;

use crate::report::FitRecord;
use tongue_infer::inverse::batch::{Job, rest_distance};
use tongue_infer::inverse::{Fit, Optimum, optima};
use tongue_infer::posterior::Verdict;
use tongue_input::measured::Target;
use tongue_input::measured::TargetKind::{self, Ratio, Stretch};
use tongue_input::measured::lengths::rest_distance::RestDistance;
use tongue_input::measured::published_patterns::{PatternCheck, Patterns};
use tongue_input::measured::thesis::Thesis;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AssessedRecord {
    #[serde(flatten)]
    pub record: FitRecord,
    pub line: u64,
    pub substitute_baseline: bool,
    pub fitted: Vec<String>,
    pub cost: f64,
    pub passive: Passive,
    pub rest_shape: Option<RestDistance>,
    pub other_optima: Vec<Optimum>,
    pub pattern: Option<PatternCheck>,
}

/// Root mean square residuals of the passive muscles; null if there are none. Ratios are without GGa, whose ratio is 1 by definition.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Passive {
    pub rms_stretch: Option<f64>,
    pub no_change_rms_stretch: Option<f64>,
    /// Stretches in the thesis's own simulation (table 4.8 over table 4.5), with the stretch of GGa of this fit.
    pub thesis_rms_stretch: Option<f64>,
    pub rms_ratio: Option<f64>,
    pub no_change_rms_ratio: Option<f64>,
    /// Ratios in the thesis's own simulation (table 4.8).
    pub thesis_rms_ratio: Option<f64>,
}

impl AssessedRecord {
    pub fn new(job: &Job, record: FitRecord) -> Self {
        let fit = &record.fit;
        let target = &fit.matched.target;
        Self {
            line: job.line,
            substitute_baseline: job.substitute,
            fitted: target.fitted.iter().map(|&m| target.muscles[m].clone()).collect(),
            cost: fit.answer.starts.iter().map(|s| s.cost).fold(f64::INFINITY, f64::min),
            passive: passive(fit),
            rest_shape: rest_distance(fit),
            other_optima: optima(fit),
            pattern: Patterns::reference().check(&target.vowel, &fit.matched.muscles, &fit.tensions()),
            record,
        }
    }

    pub fn fit(&self) -> &Fit {
        &self.record.fit
    }

    pub fn target(&self) -> &Target {
        &self.fit().matched.target
    }

    /// For example `S2 /a/`, with a mark if the baseline replaces a missing /ɯ/.
    pub fn row(&self) -> String {
        let target = self.target();
        format!("{}{} /{}/", target.subject, self.mark(), target.vowel)
    }

    /// For example `S2 /a/ ratio`.
    pub fn label(&self) -> String {
        format!("{} {}", self.row(), self.target().kind)
    }

    /// The verdict in sentences, without that on the hyoid.
    pub fn verdict(&self) -> Option<String> {
        let verdict = Verdict { hyoid_mm: None, ..self.record.verdict.clone()? };
        Some(verdict.sentences(self.target().baseline.label()).join(" "))
    }

    pub fn mark(&self) -> &'static str {
        if self.substitute_baseline { "†" } else { "" }
    }
}

/// Errors of the passive muscles. The thesis's simulation is a reference if it simulated this row.
fn passive(fit: &Fit) -> Passive {
    let target = &fit.matched.target;
    let error =
        |kind: TargetKind, simulated: &[f64]| target.passive_rms(kind, simulated, &target.measured_in(kind));
    let no_change = |kind: TargetKind| {
        error(kind, &kind.values(&target.baseline_mm, &target.baseline_mm, target.reference))
    };
    let thesis = Some(Thesis::reference()).filter(|t| t.simulated(target));
    let thesis_stretches =
        thesis.and_then(|t| t.stretches_a(&target.muscles, fit.simulated(Stretch)[target.reference]));
    let thesis_ratios = thesis.and_then(|t| t.ratios_a(&target.muscles));
    Passive {
        rms_stretch: error(Stretch, &fit.simulated(Stretch)),
        no_change_rms_stretch: no_change(Stretch),
        thesis_rms_stretch: thesis_stretches.and_then(|values| error(Stretch, &values)),
        rms_ratio: error(Ratio, &fit.simulated(Ratio)),
        no_change_rms_ratio: no_change(Ratio),
        thesis_rms_ratio: thesis_ratios.and_then(|values| error(Ratio, &values)),
    }
}

/// One of several parts of a batch: every `of`th job, so that all parts take about equally long.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Shard {
    pub number: usize,
    pub of: usize,
}

const MOST: usize = 100_000;

impl Shard {
    pub fn has(self, job: usize) -> bool {
        job % self.of == self.number - 1
    }

    pub fn journal(self) -> String {
        format!("batch-{}-of-{}.journal", self.number, self.of)
    }

    pub fn of_journal(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?;
        let numbers = name.strip_prefix("batch-")?.strip_suffix(".journal")?.replace("-of-", "/");
        numbers.parse().ok().filter(|shard: &Self| shard.journal() == name)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let parsed = word.split_once('/').and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
        match parsed {
            Some((number, of)) if number >= 1 && number <= of && of <= MOST => Ok(Self { number, of }),
            _ => Err(format!(
                "a shard is its number and how many there are, such as 3/16: from 1/1 to {MOST}/{MOST}"
            )),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_job_is_in_one_shard_and_its_journal_tells_which() {
        for of in 1..8 {
            let shards: Vec<Shard> = (1..=of).map(|number| Shard { number, of }).collect();
            for job in 0..30 {
                assert_eq!(shards.iter().filter(|s| s.has(job)).count(), 1);
            }
            for shard in shards {
                assert_eq!(shard.to_string().parse(), Ok(shard));
                assert_eq!(Shard::of_journal(Path::new("a").join(shard.journal()).as_path()), Some(shard));
            }
        }
        for word in ["0/3", "4/3", "1", "a/b", "1/0", "-1/3", "1/3/5", "", "1/1000000"] {
            assert!(word.parse::<Shard>().is_err(), "{word}");
        }
        for name in ["batch.journal", "batch-1-of-3.json", "batch-01-of-3.journal", "batch-4-of-3.journal"] {
            assert_eq!(Shard::of_journal(Path::new(name)), None, "{name}");
        }
    }
}
