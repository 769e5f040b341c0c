//! Frame of all HTML pages: one file that needs no network, in light and dark, with one style.

use maud::{DOCTYPE, Markup, PreEscaped, Render, html};

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
