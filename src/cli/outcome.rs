//! How commands end, and what cannot be trusted of their results.

use std::collections::BTreeMap;

use tongue_fit::inverse::alarms::Alarm;
use tongue_fit::run::Equilibrium;
use tongue_fit::statics::SolveStatus;

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// Everything converged: exit status 0.
    Good,
    /// A result that did not converge or is at a bound, with its description: exit status 3.
    Untrustworthy(String),
    /// Everything else is done, but some rows of the input could not be used: exit status 1.
    SomeRowsRefused,
}

impl Outcome {
    pub fn judged(good: bool, why: impl FnOnce() -> String) -> Self {
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

    /// The outcome for a result that may have failed, with its alarms.
    pub fn of_alarms(failed: Option<String>, alarms: &[Alarm]) -> Self {
        let why: Vec<String> = failed.into_iter().chain(alarms.iter().map(Alarm::to_string)).collect();
        Self::judged(why.is_empty(), || why.join("; "))
    }
}

/// How many of the results have a status that is not one of `good`; `None` if all can be trusted.
pub fn untrusted(statuses: &BTreeMap<String, usize>, good: &[&str], what: &str) -> Option<String> {
    let all: usize = statuses.values().sum();
    let bad: Vec<_> = statuses.iter().filter(|(status, _)| !good.contains(&status.as_str())).collect();
    let count: usize = bad.iter().map(|(_, n)| **n).sum();
    (!bad.is_empty())
        .then(|| format!("{count} of the {all} {what} cannot be trusted ({})", super::table::ended(bad)))
}

pub fn word(status: &impl serde::Serialize) -> String {
    tongue_fit::report::status_name(status).replace('_', " ")
}
