//! How commands end, and why their results cannot be trusted.

use std::collections::BTreeMap;

use tongue_fit::inverse::alarms::Alarm;
use tongue_fit::run::Equilibrium;
use tongue_fit::statics::SolveStatus;

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// Exit status 0.
    Good,
    /// Exit status 3: a result did not converge or cannot be trusted, for this reason.
    Untrustworthy(String),
    /// Exit status 1: some rows of the input could not be used; everything else is done.
    SomeRowsRefused,
}

impl Outcome {
    pub fn good_if(good: bool, why: impl FnOnce() -> String) -> Self {
        Self::of_reason((!good).then(why))
    }

    pub fn of_reason(why: Option<String>) -> Self {
        why.map_or(Self::Good, |why| Self::Untrustworthy(format!("{why}; see the results")))
    }

    pub fn of_equilibrium(found: &Equilibrium) -> Self {
        let status = found.solution.status;
        let failed = status != SolveStatus::Converged;
        Self::of_alarms(
            failed.then(|| format!("no equilibrium was found ({})", word(&status))),
            &found.alarms,
        )
    }

    /// The outcome of a result with its alarms; `failed` says why the result failed, if it did.
    pub fn of_alarms(failed: Option<String>, alarms: &[Alarm]) -> Self {
        let why: Vec<String> = failed.into_iter().chain(alarms.iter().map(Alarm::to_string)).collect();
        Self::good_if(why.is_empty(), || why.join("; "))
    }
}

/// A sentence about the results that cannot be trusted, by status, of `all` results; `None` if there are none.
pub fn untrusted_sentence(bad: &BTreeMap<String, usize>, all: usize, what: &str) -> Option<String> {
    let count: usize = bad.values().sum();
    let statuses = super::table::status_counts(bad);
    (count > 0).then(|| format!("{count} of the {all} {what} cannot be trusted ({statuses})"))
}

pub fn word(status: &impl serde::Serialize) -> String {
    tongue_fit::report::status_name(status).replace('_', " ")
}
