//! The part of a batch's page for one fit.

use maud::{Markup, PreEscaped, html};
use serde::{Deserialize, Serialize};

use super::number;
use crate::report::ByMuscle;
use crate::report::batch::record::{AssessedRecord, SubsetRecord};
use crate::report::batch::tables::name;
use crate::report::svg::Tension;
use crate::report::{ReportError, Series, changes};
use tongue_core::body::Mesh;
use tongue_infer::inverse::batch::Assessment;
use tongue_infer::posterior::Report;

/// Residual at which a cell of the heat map has its full colour.
const FULL_COLOUR: f64 = 0.25;

/// The parts of the page for one fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PageFit {
    /// Number of the job.
    pub number: usize,
    /// `S2 /a/ ratio`.
    pub label: String,
    /// Row of the heat map.
    pub heat_row: String,
    /// Row of the table of fits.
    pub table_row: String,
    /// Figure and findings.
    pub detail: String,
    /// Row of the table of posteriors; empty if the fit has none.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub posterior_row: String,
    /// Displacement of every node from rest, µm.
    pub moved: Vec<[i64; 2]>,
    /// Names of the contracting muscles, which have a tension.
    pub active: Vec<String>,
    /// One for every muscle, if it was fitted.
    pub tensions: Vec<Option<Tension>>,
}

/// A length in metres as an integer number of micrometres.
pub fn micrometres(metres: f64) -> i64 {
    (metres * 1e6).round() as i64
}

impl PageFit {
    /// The parts for a record and its fit; `muscles` are those of the mesh in the order of columns, `ridges`
    /// is the picture of the row's posterior.
    ///
    /// # Errors
    /// [`ReportError`] for a figure that cannot be drawn.
    pub fn new(
        number: usize,
        r: &AssessedRecord,
        assessment: &Assessment,
        mesh: &Mesh<2>,
        muscles: &[String],
        ridges: Option<&str>,
    ) -> Result<Self, ReportError> {
        let f = &r.fit;
        let mark = if r.substitute_baseline { "†" } else { "" };
        let label = format!("{}{mark} /{}/ {}", f.subject, f.vowel, f.target_kind);
        let moved = assessment.fit.positions.iter().zip(&mesh.nodes).map(|(p, rest)| {
            let way = p - rest;
            [way.x, way.y].map(micrometres)
        });
        let contracts = |m: &str| f.tensions_n.of(m).is_some_and(|t| *t > 0.0);
        let tension = |m: &String| {
            let interval = r.intervals.as_ref().and_then(|i| *i.tensions_n.of(m)?);
            let value = f.tensions_n.of(m).filter(|_| f.active.contains(m))?;
            Some(Tension { value: *value, interval: interval.map(|i| [i.low, i.high]) })
        };
        Ok(Self {
            number,
            heat_row: heat_row(number, r, mark, muscles).into_string(),
            table_row: table_row(number, r, mark, muscles).into_string(),
            detail: detail(number, r, &label, &figure(r)?, ridges).into_string(),
            posterior_row: f.posterior.as_ref().map_or_else(String::new, |posterior| {
                posterior_row(number, r, posterior, mark, muscles).into_string()
            }),
            moved: moved.collect(),
            active: muscles.iter().filter(|m| contracts(m)).cloned().collect(),
            tensions: muscles.iter().map(tension).collect(),
            label,
        })
    }
}

fn heat_row(id: usize, r: &AssessedRecord, mark: &str, muscles: &[String]) -> Markup {
    let f = &r.fit;
    html! {
        tr {
            td { (f.subject) (mark) }
            td { a href={ "#fit-" (id) } { "/" (f.vowel) "/" } }
            td { (f.target_kind) }
            @for m in muscles {
                @match f.residuals.of(m) {
                    Some(residual) => td data-v=(residual) style=(colour(*residual)) {
                        @if r.fitted.contains(m) { "● " }
                        (format!("{:+.1}", (1000.0 * residual).round() / 10.0 + 0.0))
                    },
                    None => td { "–" },
                }
            }
        }
    }
}

/// Vermilion for too long, blue for too short: colours that colour-blind readers can distinguish.
fn colour(residual: f64) -> String {
    shade(residual / FULL_COLOUR)
}

/// Vermilion for 1, blue for -1.
fn shade(part: f64) -> String {
    let strength = 0.85 * part.abs().min(1.0);
    let rgb = if part > 0.0 { "213 94 0" } else { "0 114 178" };
    format!("background: rgb({rgb} / {strength:.2})")
}

fn table_row(id: usize, r: &AssessedRecord, mark: &str, muscles: &[String]) -> Markup {
    let f = &r.fit;
    let optional = |value: Option<f64>| match value {
        Some(v) => number(v, 3),
        None => html! { td { "–" } },
    };
    html! {
        tr {
            td { (f.subject) (mark) }
            td { a href={ "#fit-" (id) } { "/" (f.vowel) "/" } }
            td { "/" (f.baseline) "/" }
            td { (f.target_kind) }
            td { (name(&f.status).replace('_', " ")) }
            td data-v=(f.misfit) { (format!("{:.1e}", f.misfit)) }
            (optional(r.passive.rms_stretch))
            (optional(r.passive.no_change_rms_stretch))
            (number(f.alarms.len() as f64, 0))
            @for m in muscles {
                @let tension = f.tensions_n.of(m).copied().unwrap_or(0.0);
                td data-v=(tension) {
                    @if f.active.contains(m) {
                        (format!("{tension:.1}"))
                        @if let Some(i) = r.intervals.as_ref().and_then(|i| *i.tensions_n.of(m)?) {
                            span.interval { " [" (format!("{:.1}", i.low)) ", " (format!("{:.1}", i.high)) "]" }
                        }
                    }
                }
            }
        }
    }
}

/// Row of the posterior: the change of every muscle's tension from the baseline, in deeper colour the surer
/// its sign.
fn posterior_row(
    id: usize,
    r: &AssessedRecord,
    posterior: &Report,
    mark: &str,
    muscles: &[String],
) -> Markup {
    let f = &r.fit;
    // Adding zero removes the sign of -0.
    let whole = |v: f64| format!("{:.0}", v.round() + 0.0);
    html! {
        tr {
            td { (f.subject) (mark) }
            td { a href={ "#fit-" (id) } { "/" (f.vowel) "/" } }
            td { "/" (f.baseline) "/" }
            @for m in muscles {
                @match posterior.summary.as_ref().and_then(|s| s.changes_n.of(m)) {
                    Some(change) => {
                        @let (rises, [low, high]) = (change.probability_rises, change.spread.interval_95);
                        td data-v=(rises) style=(shade(2.0 * rises - 1.0)) {
                            (format!("{rises:.2}"))
                            span.interval { " [" (whole(low)) ", " (whole(high)) "]" }
                        }
                    },
                    None => td title=(posterior.why) { "not mixed" },
                }
            }
        }
    }
}

fn detail(id: usize, r: &AssessedRecord, label: &str, figure: &str, ridges: Option<&str>) -> Markup {
    let f = &r.fit;
    let groups = |g: &[String]| if g.is_empty() { "none".to_owned() } else { g.join(", ") };
    let rms = |x: Option<f64>| x.map_or("–".to_owned(), |x| format!("{x:.3}"));
    html! {
        details id={ "fit-" (id) } {
            summary { (label) ": " (name(&f.status).replace('_', " ")) @if !f.alarms.is_empty() { ", " (f.alarms.len()) @if f.alarms.len() == 1 { " alarm" } @else { " alarms" } } }
            div.figure { (PreEscaped(figure)) }
            @if let Some(ridges) = ridges { " " div.figure { (PreEscaped(ridges)) } }
            @if !f.alarms.is_empty() { ul.alarms { @for a in &f.alarms { li { (a.text) } } } }
            p {
                "Passive muscles, stretches: " (rms(r.passive.rms_stretch)) " RMS, no change " (rms(r.passive.no_change_rms_stretch))
                @if let Some(t) = r.passive.thesis_rms_stretch { ", the thesis's own simulation " (format!("{t:.3}")) }
                ". Ratios: " (rms(r.passive.rms_ratio)) ", no change " (rms(r.passive.no_change_rms_ratio))
                @if let Some(t) = r.passive.thesis_rms_ratio { ", the thesis's own simulation " (format!("{t:.3}")) }
                "."
            }
            @if let Some(pattern) = &r.pattern {
                p {
                    "Published pattern: found " (groups(&pattern.found)) "; missing " (groups(&pattern.missing))
                    "; unexpected " (groups(&pattern.unexpected)) "."
                }
            }
            @if let Some(segments) = &r.within_rounding {
                p { "Along each singular direction, tensions that keep the targets within the rounding of the data:" }
                ul { @for s in segments {
                    li { (format!("{:.1e}", s.singular_value)) " per N: " (tensions(&s.from_n)) " to " (tensions(&s.to_n)) }
                } }
            }
            @if !r.other_optima.is_empty() {
                p { "Other local optima:" }
                ul { @for o in &r.other_optima { li { (tensions(&o.tensions_n)) ", cost " (format!("{:.1e}", o.cost)) " against " (format!("{:.1e}", r.cost)) } } }
            }
            @if !r.other_subsets.is_empty() {
                p { (r.other_subsets_within_rounding) " other subsets of contracting muscles meet the target within rounding. The best:" }
                ul { @for s in &r.other_subsets { li { (subset(s)) } } }
            }
        }
    }
}

fn subset(s: &SubsetRecord) -> Markup {
    html! {
        (tensions(&s.tensions_n)) ": misfit " (format!("{:.1e}", s.misfit)) ", whole row " (format!("{:.3}", s.row_rms))
        @if s.within_rounding { ", within rounding" }
    }
}

fn tensions(values: &ByMuscle<f64>) -> String {
    values.0.iter().map(|(m, v)| format!("{m} {v:.1}")).collect::<Vec<_>>().join(", ") + " N"
}

/// Figure 4.9 for this fit. The page has the title, so the figure has only the label.
fn figure(r: &AssessedRecord) -> Result<String, ReportError> {
    let f = &r.fit;
    let measured: Vec<&String> = f.target_stretches.0.iter().map(|(m, _)| m).collect();
    let contracts = |m: &str| f.tensions_n.of(m).is_some_and(|t| *t > 0.0);
    let labels: Vec<String> =
        measured.iter().map(|m| format!("{m}{}", if contracts(m) { "*" } else { "" })).collect();
    let values = |of: &ByMuscle<f64>| measured.iter().filter_map(|m| of.of(m).copied()).collect();
    let series = [
        Series { name: "measured".into(), values: values(&f.target_stretches) },
        Series { name: "simulated".into(), values: values(&f.stretches) },
    ];
    let title = format!("{} /{}/ against /{}/, {}", f.subject, f.vowel, f.baseline, f.target_kind);
    Ok(changes(&labels, &series, f.baseline.label(), &title)?.to_string())
}
