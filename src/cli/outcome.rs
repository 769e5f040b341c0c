//! How commands end, and what cannot be trusted of their results.

use std::collections::BTreeMap;

use tongue_fit::inverse::alarms::Alarm;
use tongue_fit::statics::SolveStatus;

/// How a command ended without an error.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// Everything converged: exit status 0.
    Good,
    /// Something did not converge or is at a bound, and what it is: exit status 3.
    Untrustworthy(String),
    /// The input was read and reported, but nothing can be computed with it: exit status 1.
    Unusable,
    /// Everything else is done, but some rows of the input could not be used: exit status 1.
    SomeRowsRefused,
}

/// The end of the reason for an exit status of 3.
const SEE: &str = "; see the results";

impl Outcome {
    /// Good, or untrustworthy for a reason.
    pub fn judged(good: bool, why: impl FnOnce() -> String) -> Self {
        if good { Self::Good } else { Self::Untrustworthy(format!("{}{SEE}", why())) }
    }

    /// Why results cannot be trusted.
    pub fn why(&self) -> Option<String> {
        match self {
            Self::Untrustworthy(why) => Some(why.trim_end_matches(SEE).to_owned()),
            _ => None,
        }
    }

    /// The outcome of many results by the names of their statuses; those of `good` can be trusted.
    pub fn counted(statuses: &BTreeMap<String, usize>, good: &[&str], what: &str) -> Self {
        let all: usize = statuses.values().sum();
        let bad: Vec<_> = statuses.iter().filter(|(status, _)| !good.contains(&status.as_str())).collect();
        let count: usize = bad.iter().map(|(_, n)| **n).sum();
        let kinds: Vec<String> = bad.iter().map(|(s, n)| format!("{n} {}", s.replace('_', " "))).collect();
        Self::judged(bad.is_empty(), || {
            format!("{count} of the {all} {what} cannot be trusted ({})", kinds.join(", "))
        })
    }

    /// The outcome of a search for an equilibrium.
    pub fn of_equilibrium(status: SolveStatus, alarms: &[Alarm]) -> Self {
        let is_found = status == SolveStatus::Converged;
        Self::judged(is_found && alarms.is_empty(), || {
            let ended = (!is_found).then(|| format!("no equilibrium was found ({})", word(&status)));
            ended.into_iter().chain(alarms.iter().map(Alarm::text)).collect::<Vec<_>>().join("; ")
        })
    }

    /// The outcome for muscles that pull alone: their names, the status of each solve, and its number of alarms.
    pub fn of_muscles<'a>(solved: impl Iterator<Item = (&'a str, SolveStatus, usize)>) -> Self {
        let doubtful = solved.filter(|(_, status, alarms)| *status != SolveStatus::Converged || *alarms > 0);
        let mut names: Vec<&str> = doubtful.map(|(name, ..)| name).collect();
        names.dedup();
        Self::judged(names.is_empty(), || {
            format!("no equilibrium that can be trusted where these pull alone: {}", names.join(", "))
        })
    }
}

/// The name of a status in words.
pub fn word(status: &impl serde::Serialize) -> String {
    let name = serde_json::to_value(status).ok();
    name.as_ref().and_then(|n| n.as_str()).unwrap_or_default().replace('_', " ")
}
