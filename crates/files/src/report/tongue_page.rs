//! The page in which a tongue moves as its muscles are pulled (`web/tongue.html` with the user's own table, body and fits in it), and the
//! frame of all HTML pages, each one file that needs no network, in light and dark, with one style.

use std::io::{self, Write};

use maud::{DOCTYPE, Markup, PreEscaped, Render, html};
use serde::Serialize;
use serde_json::{Value, json};

use super::export::{Export, Provenance};
use super::record::FitRecord;
use tongue_core::material::Constants;
use tongue_core::system::Model;

const PAGE: &str = include_str!("../../../../web/tongue.html");
const OWN: &str = r#"<script type="application/json" id="own">{}</script>"#;

#[derive(Debug, Clone)]
pub struct PageBody {
    /// Mesh spacing of springs, mm; the page's own if none is given.
    pub springs_h_mm: Option<f64>,
    pub continuum_h_mm: Option<f64>,
    pub continuum: bool,
    pub model: Model,
    pub file: String,
    pub anatomy: Option<String>,
    pub mesh: Option<String>,
}

#[derive(Debug, Clone, Serialize)]
pub struct PageTable {
    pub file: String,
    pub text: String,
}

#[derive(Debug)]
pub struct TonguePage {
    pub body: PageBody,
    pub table: Option<PageTable>,
    /// Fits that the page has when it opens; it computes the others itself.
    pub fits: Vec<FitRecord>,
}

impl TonguePage {
    fn own(&self, by: &Provenance) -> Result<Value, serde_json::Error> {
        let PageBody { springs_h_mm, continuum_h_mm, continuum, model, file, anatomy, mesh } = &self.body;
        let nu = model.constants.poisson_ratio;
        let is_usual = nu == Constants::TONGUE.poisson_ratio;
        let fits = self.fits.iter().map(shortened).collect::<Result<Vec<Value>, _>>()?;
        Ok(json!({
            "version": by.version,
            "command": by.command,
            "body": {"file": file, "anatomy": anatomy, "mesh": mesh},
            "springs_h_mm": springs_h_mm,
            "continuum_h_mm": continuum_h_mm,
            "continuum": continuum,
            "material": if is_usual { json!({}) } else { json!({ "poisson_ratio": nu }) },
            "table": self.table,
            "fits": fits,
        }))
    }
}

fn shortened(fit: &FitRecord) -> Result<Value, serde_json::Error> {
    let mut value = serde_json::to_value(fit)?;
    if let Some(fields) = value.as_object_mut() {
        fields.retain(|name, _| name != "starts" && name != "version" && name != "command");
    }
    let points = value.pointer_mut("/valley/points").and_then(Value::as_array_mut);
    for point in points.into_iter().flatten().filter_map(Value::as_object_mut) {
        point.retain(|name, _| name == "tensions_n");
    }
    Ok(value)
}

impl Export for TonguePage {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        // The text is in a script element: no label may end it or begin a comment.
        let own = self.own(by)?.to_string().replace('<', "\\u003c");
        let (before, after) = PAGE
            .split_once(OWN)
            .ok_or_else(|| io::Error::other("web/tongue.html has no place for a table of one's own"))?;
        let (opening, closing) = OWN.split_once("{}").unwrap_or_default();
        for part in [before, opening, &own, closing, after] {
            out.write_all(part.as_bytes())?;
        }
        Ok(())
    }
}

const STYLE: &str = include_str!("page.css");

pub fn table(headings: impl IntoIterator<Item = impl Render>, rows: &Markup) -> Markup {
    html! {
        div.scrolls tabindex="0" {
            table {
                thead { tr { @for heading in headings { th { (heading) } } } }
                tbody { (rows) }
            }
        }
    }
}

/// The same of a table that its reader can sort.
pub fn sortable<'a>(id: &str, headings: impl IntoIterator<Item = &'a str>, rows: &Markup) -> Markup {
    html! {
        div.scrolls tabindex="0" {
            table.sortable id=(id) {
                thead { tr { @for heading in headings { th { button type="button" { (heading) } } } } }
                tbody { (rows) }
            }
        }
    }
}

pub fn document(title: &str, body: &Markup) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                link rel="icon" href="data:,";
                style { (PreEscaped(STYLE)) }
            }
            body { (body) }
        }
    }
    .into_string()
}
