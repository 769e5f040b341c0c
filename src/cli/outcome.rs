//! How commands end, and why their results cannot be trusted.

use std::collections::BTreeMap;

use tongue_infer::inverse::alarms::Alarm;

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
    /// The outcome of a result that cannot be trusted for these reasons, if there are any.
    pub fn of_reasons(why: impl IntoIterator<Item = String>) -> Self {
        let why: Vec<String> = why.into_iter().collect();
        if why.is_empty() {
            Self::Good
        } else {
            Self::Untrustworthy(format!("{}; see the results", why.join("; ")))
        }
    }

    /// The outcome of a result with its alarms; `failed` says why the result failed, if it did.
    pub fn of_alarms(failed: Option<String>, alarms: &[Alarm]) -> Self {
        Self::of_reasons(failed.into_iter().chain(alarms.iter().map(Alarm::to_string)))
    }
}

/// A sentence about the results that cannot be trusted, by status, of `all` results; `None` if there are none.
pub fn untrusted_sentence(bad: &BTreeMap<String, usize>, all: usize, what: &str) -> Option<String> {
    let count: usize = bad.values().sum();
    let statuses = super::table::status_counts(bad);
    (count > 0).then(|| format!("{count} of the {all} {what} cannot be trusted ({statuses})"))
}

pub fn word(status: &impl serde::Serialize) -> String {
    tongue_files::report::status_name(status).replace('_', " ")
}
