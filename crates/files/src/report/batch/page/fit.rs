use maud::{Markup, PreEscaped, html};
use serde::{Deserialize, Serialize};

use crate::report::batch::record::AssessedRecord;
use crate::report::column::Column;
use crate::report::tongue_page::cells;
use crate::report::{ByMuscle, ReportError, joined, names_or_none, probability, status_in_words};
use tongue_core::body::Mesh;
use tongue_infer::posterior::{Certainty, Quantiles};

/// Residual at which a cell of the table of residuals has its full colour.
const FULL_COLOUR: f64 = 0.25;

/// What the page has of one fit: pieces of HTML, and numbers for its script.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PageFit {
    pub number: usize,
    pub label: String,
    pub heat_row: String,
    pub table_row: String,
    pub detail: String,
    pub posterior_row: String,
    /// Displacements of all nodes from rest, µm.
    pub moved: Vec<[i64; 2]>,
    pub active: Vec<String>,
    /// For the figure of tensions, in the order of columns; `None` for muscles without a tension of their own.
    pub tensions: Vec<Option<f64>>,
}

pub fn micrometres(metres: f64) -> i64 {
    (metres * 1e6).round() as i64
}

impl PageFit {
    /// `muscles` are the names of the mesh's muscles in the order of columns; `ridges` are those of the posterior (SVG).
    pub fn new(
        number: usize,
        r: &AssessedRecord,
        (mesh, muscles): (&Mesh<2>, &[String]),
        ridges: Option<&str>,
    ) -> Result<Self, ReportError> {
        let target = r.target();
        let title =
            format!("{} /{}/ against /{}/, {}", target.subject, target.vowel, target.baseline, target.kind);
        // Figure 4.9 of the thesis for this fit.
        let figure = r.record.changes(&title, "measured", None)?.to_string();
        let ways = r.fit().answer.positions.iter().zip(&mesh.nodes).map(|(p, rest)| p - rest);
        let names = r.fit().active_names();
        let tensions = muscles.iter().map(|m| r.fit().tension(m).filter(|_| names.contains(m)));
        Ok(Self {
            number,
            heat_row: heat_row(number, r, muscles).into_string(),
            table_row: html! { tr { (first_cells(number, r)) (cells(&columns(muscles), r)) } }.into_string(),
            detail: detail(number, r, &figure, ridges).into_string(),
            posterior_row: posterior_row(number, r, muscles).into_string(),
            moved: ways.map(|way| [way.x, way.y].map(micrometres)).collect(),
            active: muscles.iter().filter(|m| r.fit().tension(m).is_some_and(|t| t > 0.0)).cloned().collect(),
            tensions: tensions.collect(),
            label: r.label(),
        })
    }
}

fn first_cells(id: usize, r: &AssessedRecord) -> Markup {
    html! {
        td { (r.target().subject) (r.mark()) }
        td { a href={ "#fit-" (id) } { "/" (r.target().vowel) "/" } }
    }
}

fn heat_row(id: usize, r: &AssessedRecord, muscles: &[String]) -> Markup {
    html! {
        tr {
            (first_cells(id, r))
            td { (r.target().kind) }
            @let residuals = ByMuscle::new(&r.target().muscles, r.fit().residuals());
            @for m in muscles {
                @match residuals.get(m) {
                    Some(residual) => td data-v=(residual) style=(shade(residual / FULL_COLOUR)) {
                        @if r.fitted.contains(m) { "● " }
                        (format!("{:+.1}", (1000.0 * residual).round() / 10.0 + 0.0))
                    },
                    None => td { "–" },
                }
            }
        }
    }
}

/// Vermilion for 1 and blue for -1, which colour-blind readers can distinguish.
fn shade(part: f64) -> String {
    let strength = 0.85 * part.abs().min(1.0);
    let rgb = if part > 0.0 { "213 94 0" } else { "0 114 178" };
    format!("background: rgb({rgb} / {strength:.2})")
}

/// The columns of the table of fits that follow subject and vowel.
pub fn columns(muscles: &[String]) -> Vec<Column<'_, AssessedRecord>> {
    type RowColumn<'a> = Column<'a, AssessedRecord>;
    let mut columns: Vec<RowColumn<'_>> = vec![
        RowColumn::of_page("baseline", |r| format!("/{}/", r.target().baseline).into()),
        RowColumn::of_page("target", |r| r.target().kind.name().into()),
        RowColumn::of_page("status", |r| status_in_words(&r.fit().answer.status).into()),
        RowColumn::of_page("misfit", |r| r.fit().answer.misfit.into())
            .with_text(|r| format!("{:.1e}", r.fit().answer.misfit)),
        RowColumn::of_page("passive stretches", |r| r.passive.rms_stretch.into()).decimals(3),
        RowColumn::of_page("no change", |r| r.passive.no_change_rms_stretch.into()).decimals(3),
        RowColumn::of_page("alarms", |r| r.record.alarms.len().into()),
    ];
    columns.extend(muscles.iter().map(|m| {
        let tension = move |r: &AssessedRecord| r.fit().tension(m).unwrap_or(0.0);
        RowColumn::of_page(m.clone(), move |r| tension(r).into()).with_text(move |r| {
            if r.fit().active_names().contains(m) { format!("{:.1}", tension(r)) } else { String::new() }
        })
    }));
    columns
}

/// A row of the posterior, if there is one: the change of every tension from the baseline, in deeper colour the surer its sign.
fn posterior_row(id: usize, r: &AssessedRecord, muscles: &[String]) -> Markup {
    // Adding zero turns -0 into 0.
    let whole = |v: f64| format!("{:.0}", v.round() + 0.0);
    let Some(posterior) = &r.record.posterior else { return html! {} };
    html! {
        tr {
            (first_cells(id, r))
            td title=(r.verdict().unwrap_or_default()) { "/" (r.target().baseline) "/" }
            @for m in muscles {
                @match posterior.summary.as_ref().and_then(|s| Some((s, s.changes_n.get(m)?))) {
                    Some((s, change)) => {
                        @let p = change.probability_rises;
                        td data-v=(p.unwrap_or(0.5)) style=(shade(2.0 * p.unwrap_or(0.5) - 1.0)) {
                            (p.map_or(Certainty::Fixed, Certainty::of).text().replace(" harder", ""))
                            br;
                            span.interval { (p.map(probability).unwrap_or_default()) " [" (whole(change.spread.interval_95[0])) ", " (whole(change.spread.interval_95[1])) "]" }
                            @if s.tensions_n.get(m).is_some_and(|t| t.spread.is_fixed()) { br; "F fixed" }
                            @if s.baseline_tensions_n.get(m).is_some_and(Quantiles::is_fixed) { br; "F0 fixed" }
                        }
                    }
                    None => td title=(posterior.diagnostics.why) { "not mixed" },
                }
            }
        }
    }
}

fn detail(id: usize, r: &AssessedRecord, figure: &str, ridges: Option<&str>) -> Markup {
    let (alarms, passive) = (&r.record.alarms, &r.passive);
    html! {
        details id={ "fit-" (id) } {
            summary { (r.label()) ": " (status_in_words(&r.fit().answer.status)) @if !alarms.is_empty() { ", " (alarms.len()) @if alarms.len() == 1 { " alarm" } @else { " alarms" } } }
            div.figure { (PreEscaped(figure)) }
            @if let Some(verdict) = r.verdict() { p.verdict { (verdict) } }
            @if let Some(ridges) = ridges { " " div.figure { (PreEscaped(ridges)) } }
            @if !alarms.is_empty() { ul.alarms { @for a in alarms { li { (a) } } } }
            p {
                "Passive muscles, stretches: " (rms(passive.rms_stretch)) " RMS, no change " (rms(passive.no_change_rms_stretch))
                (own_simulation(passive.thesis_rms_stretch))
                ". Ratios: " (rms(passive.rms_ratio)) ", no change " (rms(passive.no_change_rms_ratio))
                (own_simulation(passive.thesis_rms_ratio))
                "."
            }
            @if let Some(pattern) = &r.pattern {
                p {
                    "Published pattern: found " (names_or_none(&pattern.found)) "; missing " (names_or_none(&pattern.missing))
                    "; unexpected " (names_or_none(&pattern.unexpected)) "."
                }
            }
            @if !r.other_optima.is_empty() {
                p { "Other local optima:" }
                ul { @for o in &r.other_optima { li { (joined(o.tensions_n.0.iter().map(|(m, v)| format!("{m} {v:.1}")), ", ")) " N, cost " (format!("{:.1e}", o.cost)) " against " (format!("{:.1e}", r.cost)) } } }
            }
        }
    }
}

fn rms(value: Option<f64>) -> String {
    value.map_or("–".to_owned(), |x| format!("{x:.3}"))
}

fn own_simulation(value: Option<f64>) -> String {
    value.map(|t| format!(", the thesis's own simulation {t:.3}")).unwrap_or_default()
}
