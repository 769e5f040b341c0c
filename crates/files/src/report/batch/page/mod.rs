//! The page of a batch: one HTML file that needs no network, in light and dark. Its script `page.js` sorts tables and moves the shape.

mod fit;

use std::io::{self, Write};

use maud::{Markup, PreEscaped, html};
use serde_json::{Value, json};

use super::Batch;
use super::summary::PassiveGroup;
use crate::report::column::columns_with_heading;
use crate::report::svg::{self, Svg, colours, picture_bounds};
use crate::report::{status_counts, tongue_page};
use tongue_core::body::Mesh;

pub use self::fit::PageFit;

/// Most fits on the page, because a table of thousands is too large for a browser.
pub const MOST_FITS: usize = 200;

const SCRIPT: &str = include_str!("page.js");

pub fn write(w: &mut dyn Write, batch: &Batch<'_>, fits: &[PageFit]) -> io::Result<()> {
    let body = html! {
        main {
            (top(batch, fits.len()))
            (posteriors(fits, batch.muscles))
            (fit_table(fits, batch.muscles))
            (viewer(fits))
            (heat_map(fits, batch.muscles))
            (passive(&batch.summary.passive))
            section {
                h2 { "Every fit" }
                p { "Measured and simulated change of every muscle against the baseline (figure 4.9 of the thesis), and reasons for doubt." }
                @for f in fits { (PreEscaped(&f.detail)) }
            }
            (others(batch))
            footer { "Inputs, SHA-256: " code { (batch.provenance.inputs_sha256.as_deref().unwrap_or_default()) } }
        }
        script type="application/json" id="data" { (PreEscaped(data(batch.mesh, fits))) }
        script { (PreEscaped(SCRIPT)) }
    };
    w.write_all(tongue_page::document("tongue-fit batch", &body).as_bytes())
}

fn top(batch: &Batch<'_>, shown: usize) -> Markup {
    let (p, s) = (batch.provenance, batch.summary);
    html! {
        header {
            h1 { "Tongue muscle tensions fitted to measured lengths" }
            button #theme type="button" { "Dark or light" }
            p { "tongue-fit " (p.version) " · " code { (p.command) } }
            p {
                (s.rows) " rows: " (s.fits) " fits (" (status_counts(&s.statuses)) "), " (s.baselines) @if s.baselines == 1 { " baseline, " } @else { " baselines, " } (s.not_fitted) " not fitted, " (s.unreadable_rows) " unreadable. "
                @if shown < s.fits { strong { "This page shows the first " (shown) " fits; all of them are in the CSV and JSON files." } }
            }
            @if !s.substitute_baselines.is_empty() {
                p { "No /ɯ/ was measured for " (s.substitute_baselines.join(", ")) ": fitted against /e/, in which muscles pull too (less sure than against /ɯ/), and marked †." }
            }
            @if let Some(n) = &s.nearest_row_to_rest {
                p { "The model at rest is nearest to /" (n.vowel) "/ of " (n.subject) ": " (format!("{:.3}", n.distance.rms_ratio)) " (" (s.rest_shape_measure) ")." }
            }
            p { "Tensions are newtons per metre of thickness." }
        }
    }
}

fn passive(groups: &[PassiveGroup]) -> Markup {
    let columns = PassiveGroup::columns();
    let rows = html! { @for g in groups { tr { (tongue_page::cells(&columns, g)) } } };
    table_section(
        "Muscles that do not contract",
        "Root mean square error of the passive stretches, each fit of the same weight, beside predicting no change. Where a target leaves tensions open, the fit takes those that come nearest to these muscles, and the figures are no test of prediction.",
        &tongue_page::sortable("passive", columns_with_heading(&columns).0, &rows),
    )
}

fn heat_map(fits: &[PageFit], muscles: &[String]) -> Markup {
    let headings = with_muscle_headings(&["subject", "vowel", "target"], muscles);
    let rows = html! { @for f in fits { (PreEscaped(&f.heat_row)) } };
    table_section(
        "Residuals",
        "Simulated less measured, in the quantity that was fitted, in hundredths; ● marks the contracting muscles, whose values the fit has to meet.",
        &tongue_page::sortable("heat", headings, &rows),
    )
}

fn posteriors(fits: &[PageFit], muscles: &[String]) -> Markup {
    let rows = html! { @for f in fits { (PreEscaped(&f.posterior_row)) } };
    if rows.0.is_empty() {
        return rows;
    }
    let headings = with_muscle_headings(&["subject", "vowel", "baseline"], muscles);
    table_section(
        "Which muscles pull harder than in the baseline",
        "What the posterior of every row says: surely (probability at least 0.95) or probably (0.8) harder, surely not or probably not, or not known; then the probability, and the 95 % interval of the change F − F0 of the tension. A posterior uses all measured stretches of a row, so each row is listed once; its ridges are below, with the fit. posterior.csv has all numbers.",
        &tongue_page::sortable("posteriors", headings, &rows),
    )
}

fn table_section(title: &str, text: &str, table: &Markup) -> Markup {
    html! { section { h2 { (title) } p { (text) } (table) } }
}

fn viewer(fits: &[PageFit]) -> Markup {
    html! {
        section {
            h2 { "Shapes" }
            p {
                label { "Fit " select #shape { @for f in fits { option value=(f.number) { (f.label) } } } }
                " "
                label { "rest " input #slider type="range" min="0" max="100" value="100"; " fitted" }
                " " output #part { "100 %" }
            }
            svg #tongue role="img" aria-label="Mesh of the tongue between rest and the fitted shape" {}
            p.legend { "Grey: rest. Thick: contracting muscles; thin: passive. The front of the mouth is to the left; a line that leaves the view goes on to its bone." }
        }
    }
}

fn fit_table(fits: &[PageFit], muscles: &[String]) -> Markup {
    let columns = fit::columns(muscles);
    let headings = ["subject", "vowel"].into_iter().chain(columns_with_heading(&columns).0);
    html! {
        section {
            h2 { "Tensions" }
            div.figure.wide { (PreEscaped(tensions(muscles, fits).to_string())) }
            (tongue_page::sortable("fits", headings, &html! { @for f in fits { (PreEscaped(&f.table_row)) } }))
        }
    }
}

fn others(batch: &Batch<'_>) -> Markup {
    html! {
        section {
            h2 { "Rows without a fit" }
            ul {
                @for b in batch.baselines.iter().take(MOST_FITS) {
                    li { (b.subject) " /" (b.vowel) "/: the baseline itself" @if b.substitute { " (in place of a missing /ɯ/)" } }
                }
                @for r in batch.refusals.iter().take(MOST_FITS) {
                    li { (r.to_string()) }
                }
                @for u in batch.unreadable.iter().take(MOST_FITS) { li { (u) } }
            }
        }
    }
}

pub fn tensions(muscles: &[String], fits: &[PageFit]) -> Svg {
    let fits: Vec<_> = fits.iter().map(|f| (f.label.as_str(), f.tensions.as_slice())).collect();
    svg::tensions(muscles, &fits, "Tensions that the fits found")
}

/// Headings, followed by those of the muscles.
fn with_muscle_headings<'a>(first: &'a [&str], muscles: &'a [String]) -> impl Iterator<Item = &'a str> {
    first.iter().copied().chain(muscles.iter().map(String::as_str))
}

/// The mesh, and for every fit the displacements of its nodes; lengths are integers in µm.
fn data(mesh: &Mesh<2>, fits: &[PageFit]) -> String {
    let rest: Vec<[i64; 2]> = mesh.nodes.iter().map(|p| [p.x, p.y].map(fit::micrometres)).collect();
    let coloured = mesh.muscles.iter().zip(colours(&mesh.muscle_names()));
    let muscles = coloured.map(|(m, colour)| json!({"name": m.name, "nodes": m.nodes, "colour": colour}));
    let muscles: Vec<Value> = muscles.collect();
    let view = picture_bounds(mesh, &[], []);
    let [low, high] = [view.low, view.high].map(|corner| corner.map(fit::micrometres));
    let shapes = fits.iter().map(|f| json!({"fit": f.number, "moved": f.moved, "active": f.active}));
    let shapes: Vec<Value> = shapes.collect();
    json!({
        "view": [low[0], -high[1], high[0] - low[0], high[1] - low[1]], "rest": rest, "connections": mesh.connections, "fixed": mesh.fixed, "muscles": muscles, "shapes": shapes,
    })
    .to_string()
    // This is the only sequence that could end a script element.
    .replace("</", "<\\/")
}
