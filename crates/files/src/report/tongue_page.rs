//! The page in which a tongue moves (`web/tongue.html` with the user's own table, body and fits), and the frame and style of all HTML
//! pages.

use std::io::{self, Write};

use maud::{DOCTYPE, Markup, PreEscaped, Render, html};
use serde_json::{Value, json};

use super::column::{Column, columns_with_heading};
use super::export::{Export, Provenance};
use super::record::FitRecord;
use crate::run::{BodySource, Kind, PlaneBody};
use tongue_core::system::Model;
use tongue_input::bodies::json::MeshRecord;

const PAGE: &str = include_str!("../../../../web/tongue.html");
const OWN: &str = r#"<script type="application/json" id="own">{}</script>"#;

#[derive(Debug)]
pub struct TonguePage {
    /// The page makes its bodies from this again, as springs and as a continuum.
    pub body: PlaneBody,
    pub model: Model,
    /// Name and text of the file of a table of lengths.
    pub table: Option<(String, String)>,
    /// Fits that the page has when it opens; it computes all others itself.
    pub fits: Vec<FitRecord>,
}

impl TonguePage {
    fn own(&self, by: &Provenance) -> io::Result<Value> {
        let PlaneBody { source, kind, spacing_m } = &self.body;
        let is_continuum = *kind == Kind::Continuum;
        let own_spacing_m = is_continuum.then(|| self.body.spacing_m());
        let body = match source {
            BodySource::Tongue => json!({"file": "", "anatomy": null, "mesh": null}),
            BodySource::Anatomy { toml, origin } => json!({"file": origin, "anatomy": toml, "mesh": null}),
            BodySource::Mesh { origin, .. } => {
                let springs = PlaneBody { kind: Kind::Springs, ..self.body.clone() };
                // Notes on the file were given when the body was first made.
                let flat = springs.make(&mut |_| ()).map_err(io::Error::other)?;
                let mesh = MeshRecord::of(&flat, &self.model).map_err(io::Error::other)?;
                let text = serde_json::to_string_pretty(&mesh)? + "\n";
                json!({"file": origin, "anatomy": null, "mesh": text})
            }
        };
        let nu = self.model.poisson_ratio;
        let is_usual = nu == Model::default().poisson_ratio;
        let fits = self.fits.iter().map(short_record).collect::<Result<Vec<Value>, _>>()?;
        Ok(json!({
            "version": by.version,
            "command": by.command,
            "body": body,
            "springs_h_mm": spacing_m.map(|h| h * 1e3),
            "continuum_h_mm": spacing_m.or(own_spacing_m).map(|h| h * 1e3),
            "continuum": is_continuum,
            "material": if is_usual { json!({}) } else { json!({ "poisson_ratio": nu }) },
            "table": self.table.as_ref().map(|(file, text)| json!({"file": file, "text": text})),
            "fits": fits,
        }))
    }
}

fn short_record(fit: &FitRecord) -> Result<Value, serde_json::Error> {
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
        // The text is inside a script element, which no label may end, nor begin a comment in it.
        let own = self.own(by)?.to_string().replace('<', "\\u003c");
        if !PAGE.contains(OWN) {
            return Err(io::Error::other("web/tongue.html has no place for a table of one's own"));
        }
        out.write_all(PAGE.replacen(OWN, &OWN.replace("{}", &own), 1).as_bytes())
    }
}

const STYLE: &str = include_str!("page.css");

pub fn table(headings: impl IntoIterator<Item = impl Render>, rows: &Markup) -> Markup {
    let headings = html! { @for heading in headings { th { (heading) } } };
    html! { div.scrolls tabindex="0" { table { thead { tr { (headings) } } tbody { (rows) } } } }
}

pub fn table_of_columns<'a, R: 'a>(columns: &[Column<'a, R>], rows: &[R]) -> Markup {
    let (headings, shown) = columns_with_heading(columns);
    table(headings, &html! { @for row in rows { tr { @for c in &shown { td { (c.page_text(row)) } } } } })
}

pub fn cells<'a, R: 'a>(columns: &[Column<'a, R>], row: &R) -> Markup {
    html! { @for c in columns_with_heading(columns).1 { td data-v=[c.number(row)] { (c.page_text(row)) } } }
}

pub fn sortable<'a>(id: &str, headings: impl IntoIterator<Item = &'a str>, rows: &Markup) -> Markup {
    let headings = html! { @for heading in headings { th { button type="button" { (heading) } } } };
    html! {
        div.scrolls tabindex="0" { table.sortable id=(id) { thead { tr { (headings) } } tbody { (rows) } } }
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
