//! The part of a batch's page for one fit.

use maud::{Markup, PreEscaped, html};
use nalgebra::SVector;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::number;
use crate::report::{ReportError, Series, Told, changes};
use tongue_core::body::Mesh;
use tongue_infer::posterior::{Said, Verdict, VerdictFrom};

/// Residual at which a cell of the heat map has its full colour.
const FULL_COLOUR: f64 = 0.25;

/// What the page shows of a fit that is not in its record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Shown {
    /// Displacement of every node from rest, µm.
    pub moved: Vec<[i64; 2]>,
    /// The ridges of its posterior, SVG.
    pub ridges: Option<String>,
}

/// Displacements of all nodes from rest, µm.
pub fn displacements(positions: &[SVector<f64, 2>], mesh: &Mesh<2>) -> Vec<[i64; 2]> {
    let ways = positions.iter().zip(&mesh.nodes).map(|(p, rest)| p - rest);
    ways.map(|way| [way.x, way.y].map(micrometres)).collect()
}

/// What the page shows of one fit, ready to be put in its places.
#[derive(Debug, Clone, PartialEq)]
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
    /// Row of the table of posteriors; empty where the fit has none.
    pub posterior_row: String,
    /// Displacement of every node from rest, µm.
    pub moved: Vec<[i64; 2]>,
    /// Names of the contracting muscles, which have a tension.
    pub active: Vec<String>,
    /// One for every muscle that was fitted.
    pub tensions: Vec<Option<f64>>,
}

/// Metres as whole micrometres.
pub fn micrometres(metres: f64) -> i64 {
    (metres * 1e6).round() as i64
}

impl PageFit {
    /// Of a record; `muscles` are those of the mesh in the order of columns.
    pub fn new(number: usize, r: &Told, shown: Shown, muscles: &[String]) -> Result<Self, ReportError> {
        let mark = if r.is("/substitute_baseline") { "†" } else { "" };
        let label = format!("{}{mark} /{}/ {}", r.text("/subject"), r.text("/vowel"), r.text("/target_kind"));
        let contracts = |m: &str| r.number_of("/tensions_n", m).is_some_and(|t| t > 0.0);
        let tension = |m: &String| r.number_of("/tensions_n", m).filter(|_| r.lists("/active", m));
        let ridges = shown.ridges.as_deref();
        Ok(Self {
            number,
            heat_row: heat_row(number, r, mark, muscles).into_string(),
            table_row: table_row(number, r, mark, muscles).into_string(),
            detail: detail(number, r, &label, &figure(r)?, ridges).into_string(),
            posterior_row: match r.at("/posterior") {
                Value::Null => String::new(),
                _ => posterior_row(number, r, mark, muscles).into_string(),
            },
            moved: shown.moved,
            active: muscles.iter().filter(|m| contracts(m)).cloned().collect(),
            tensions: muscles.iter().map(tension).collect(),
            label,
        })
    }
}

fn heat_row(id: usize, r: &Told, mark: &str, muscles: &[String]) -> Markup {
    html! {
        tr {
            td { (r.text("/subject")) (mark) }
            td { a href={ "#fit-" (id) } { "/" (r.text("/vowel")) "/" } }
            td { (r.text("/target_kind")) }
            @for m in muscles {
                @match r.number_of("/residuals", m) {
                    Some(residual) => td data-v=(residual) style=(colour(residual)) {
                        @if r.lists("/fitted", m) { "● " }
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

fn table_row(id: usize, r: &Told, mark: &str, muscles: &[String]) -> Markup {
    let optional = |pointer: &str| match r.number(pointer) {
        Some(v) => number(v, 3),
        None => html! { td { "–" } },
    };
    let misfit = r.number("/misfit").unwrap_or(f64::NAN);
    html! {
        tr {
            td { (r.text("/subject")) (mark) }
            td { a href={ "#fit-" (id) } { "/" (r.text("/vowel")) "/" } }
            td { "/" (r.text("/baseline")) "/" }
            td { (r.text("/target_kind")) }
            td { (r.text("/status").replace('_', " ")) }
            td data-v=(misfit) { (format!("{misfit:.1e}")) }
            (optional("/passive/rms_stretch"))
            (optional("/passive/no_change_rms_stretch"))
            (number(r.list("/alarms").len() as f64, 0))
            @for m in muscles {
                @let tension = r.number_of("/tensions_n", m).unwrap_or(0.0);
                td data-v=(tension) {
                    @if r.lists("/active", m) {
                        (format!("{tension:.1}"))
                    }
                }
            }
        }
    }
}

/// Row of the posterior: the change of every muscle's tension from the baseline, in deeper colour the surer
/// its sign.
fn posterior_row(id: usize, r: &Told, mark: &str, muscles: &[String]) -> Markup {
    // Adding zero removes the sign of -0.
    let whole = |v: f64| format!("{:.0}", v.round() + 0.0);
    let change = |m: &str| {
        let change = r.of("/posterior/summary/changes_n", m);
        let number = |pointer: &str| change.pointer(pointer).and_then(Value::as_f64);
        Some((number("/probability_rises")?, number("/interval_95/0")?, number("/interval_95/1")?))
    };
    html! {
        tr {
            td { (r.text("/subject")) (mark) }
            td { a href={ "#fit-" (id) } { "/" (r.text("/vowel")) "/" } }
            td title=(sentences(r).unwrap_or_default().join(" ")) { "/" (r.text("/baseline")) "/" }
            @for m in muscles {
                @match change(m) {
                    Some((rises, low, high)) => td data-v=(rises) style=(shade(2.0 * rises - 1.0)) {
                        (format!("{rises:.2}"))
                        span.interval { " [" (whole(low)) ", " (whole(high)) "]" }
                    },
                    None => td title=(r.text("/posterior/why")) { "not mixed" },
                }
            }
        }
    }
}

/// What the program says first of a row with a posterior.
fn sentences(r: &Told) -> Option<[String; 3]> {
    let muscles: Vec<Said> = serde_json::from_value(r.at("/verdict").clone()).ok()?;
    Some(Verdict { from: VerdictFrom::Draws, hyoid_mm: None, muscles }.sentences(r.text("/baseline")))
}

fn detail(id: usize, r: &Told, label: &str, figure: &str, ridges: Option<&str>) -> Markup {
    let groups = |pointer: &str| match r.names(pointer) {
        none if none.is_empty() => "none".to_owned(),
        all => all.join(", "),
    };
    let rms = |pointer: &str| r.number(pointer).map_or("–".to_owned(), |x| format!("{x:.3}"));
    let thesis = |pointer: &str| {
        let said = |t: f64| format!(", the thesis's own simulation {t:.3}");
        r.number(pointer).map(said).unwrap_or_default()
    };
    let exponent = |value: &Value| format!("{:.1e}", value.as_f64().unwrap_or(f64::NAN));
    let alarms = r.list("/alarms");
    html! {
        details id={ "fit-" (id) } {
            summary { (label) ": " (r.text("/status").replace('_', " ")) @if !alarms.is_empty() { ", " (alarms.len()) @if alarms.len() == 1 { " alarm" } @else { " alarms" } } }
            div.figure { (PreEscaped(figure)) }
            @if let Some(sentences) = sentences(r) { p.verdict { (sentences.join(" ")) } }
            @if let Some(ridges) = ridges { " " div.figure { (PreEscaped(ridges)) } }
            @if !alarms.is_empty() { ul.alarms { @for a in alarms { li { (a["text"].as_str().unwrap_or_default()) } } } }
            p {
                "Passive muscles, stretches: " (rms("/passive/rms_stretch")) " RMS, no change " (rms("/passive/no_change_rms_stretch"))
                (thesis("/passive/thesis_rms_stretch"))
                ". Ratios: " (rms("/passive/rms_ratio")) ", no change " (rms("/passive/no_change_rms_ratio"))
                (thesis("/passive/thesis_rms_ratio"))
                "."
            }
            @if !r.at("/pattern").is_null() {
                p {
                    "Published pattern: found " (groups("/pattern/found")) "; missing " (groups("/pattern/missing"))
                    "; unexpected " (groups("/pattern/unexpected")) "."
                }
            }
            @if !r.list("/other_optima").is_empty() {
                p { "Other local optima:" }
                ul { @for o in r.list("/other_optima") { li { (tensions(&o["tensions_n"])) ", cost " (exponent(&o["cost"])) " against " (exponent(r.at("/cost"))) } } }
            }
        }
    }
}

fn tensions(values: &Value) -> String {
    let one = |(m, v): (&String, &Value)| format!("{m} {:.1}", v.as_f64().unwrap_or(f64::NAN));
    let all: Vec<String> = values.as_object().into_iter().flatten().map(one).collect();
    all.join(", ") + " N"
}

/// Figure 4.9 for this fit. The page has the title, so the figure has only the label.
fn figure(r: &Told) -> Result<String, ReportError> {
    let measured = r.muscles("/target_stretches");
    let contracts = |m: &str| r.number_of("/tensions_n", m).is_some_and(|t| t > 0.0);
    let labels: Vec<String> =
        measured.iter().map(|m| format!("{m}{}", if contracts(m) { "*" } else { "" })).collect();
    let values = |pointer: &str| measured.iter().filter_map(|m| r.number_of(pointer, m)).collect();
    let series = [
        Series { name: "measured".into(), values: values("/target_stretches") },
        Series { name: "simulated".into(), values: values("/stretches") },
    ];
    let baseline = r.text("/baseline");
    let title = format!(
        "{} /{}/ against /{baseline}/, {}",
        r.text("/subject"),
        r.text("/vowel"),
        r.text("/target_kind")
    );
    Ok(changes(&labels, &series, baseline, &title)?.to_string())
}
