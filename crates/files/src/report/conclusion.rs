//! What is concluded of the fit of a vowel: its last words and its exit status are this one statement.

use serde::Serialize;
use tongue_infer::inverse::Fit;
use tongue_infer::inverse::alarms::Alarm;
use tongue_infer::posterior::{Report, Verdict};

use super::status_name;

/// The part of a report that decides whether the report can be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DecidedBy {
    Verdict,
    /// A posterior that was asked for and gives no verdict.
    Posterior,
    /// The fit, where there is neither.
    Fit,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Conclusion {
    pub decided_by: DecidedBy,
    /// Whether that part can be trusted: the exit status is 0, otherwise 3.
    pub trusted: bool,
    /// Whether the fit's tensions can be trusted too ([`Fit::is_trustworthy`]).
    pub tensions_trusted: bool,
    pub text: String,
}

impl Conclusion {
    pub fn new(fit: &Fit, alarms: &[Alarm], posterior: Option<&Report>, verdict: Option<&Verdict>) -> Self {
        let cause = || {
            let cause = alarms.iter().find(|alarm| alarm.forbids_trust());
            cause.map_or_else(|| status_name(&fit.status).replace('_', " "), Alarm::to_string)
        };
        let tensions_trusted = fit.is_trustworthy();
        let beside = |what: &str| match tensions_trusted {
            true => format!("Trust the {what} more than these tensions"),
            false => format!("Trust the {what}, not these tensions: {}", cause()),
        };
        let (decided_by, trusted, text) = match (verdict, posterior) {
            (Some(_), _) => (DecidedBy::Verdict, true, beside("verdict")),
            (None, Some(report)) if report.summary.is_none() => (
                DecidedBy::Posterior,
                false,
                format!("the chains of the posterior have not mixed: {}", report.why),
            ),
            (None, Some(_)) => (DecidedBy::Posterior, true, beside("posterior")),
            (None, None) if tensions_trusted => {
                let text = "Without a verdict these tensions ignore errors of anatomy and model".to_owned();
                (DecidedBy::Fit, true, text)
            }
            (None, None) => (DecidedBy::Fit, false, format!("the fit cannot be trusted: {}", cause())),
        };
        Self { decided_by, trusted, tensions_trusted, text }
    }
}
