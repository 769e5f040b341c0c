//! Figures as SVG, which load nothing: a writer of elements here, and a file for each kind. The same numbers give the same bytes.

mod animation;
mod axes;
mod body_view;
mod changes;
mod labels;
mod muscles;
mod plot;
mod section;
mod solution_curve;
mod tensions;
mod timelines;
mod views;
mod vowel;
mod work_precision;

use std::fmt::{self, Write as _};
use std::io::{self, Write};

use super::export::{Export, Provenance, joined};

pub use animation::{AnimationFrame, animation};
#[cfg(feature = "files")]
pub(super) use body_view::picture_bounds;
pub use changes::{Series, changes, parts, ridges};
#[cfg(feature = "files")]
pub(super) use labels::colours;
pub use muscles::{Panel, panels};
pub use plot::{Scatter, scatter};
pub(super) use section::check;
pub use section::{SectionPicture, tongue};
pub use solution_curve::solution_curve;
pub use tensions::tensions;
pub use timelines::timelines;
pub use views::{solid, views};
pub use vowel::vowel;
pub use work_precision::{PrecisionCurve, work_precision};

/// Width of an ordinary figure, px. In a journal column of 85 mm, text of 24 px is 6.4 points high.
const WIDTH: f64 = 900.0;
const TEXT: f64 = 24.0;
/// Mean width of a letter of a sans-serif face over its size: plain, and bold.
const LETTER: f64 = 0.55;
const BOLD_LETTER: f64 = 0.62;
const TITLE: f64 = 28.0;
const TITLE_LINE: f64 = 36.0;
/// Most visible lines of a title; the accessible title is complete.
const TITLE_LINES: usize = 6;
const MARGIN: f64 = 16.0;

const INK: &str = "#222222";
const RULE: &str = "#dddddd";
const HALO: &str = " stroke=\"#ffffff\" stroke-width=\"6\" stroke-linejoin=\"round\" paint-order=\"stroke\"";

/// A point on the sheet, px, y downwards.
type Px = [f64; 2];

/// A figure as SVG, which [`fmt::Display`] writes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Svg {
    title: String,
    description: String,
    width: u32,
    height: u32,
    elements: String,
}

/// Horizontal alignment of a text at its point; vertically it is centred.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Anchor {
    Start,
    Middle,
    End,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FontFace {
    Plain,
    Bold,
}

impl FontFace {
    fn width(self, text: &str) -> f64 {
        let letter = if self == Self::Bold { BOLD_LETTER } else { LETTER };
        text.chars().count() as f64 * TEXT * letter
    }
}

impl Svg {
    /// A figure with only its title, and the lower end of the title, px.
    fn new(title: &str, description: &str, width: f64) -> (Self, f64) {
        let mut svg = Self {
            title: printable(title),
            description: printable(description),
            width: width as u32,
            height: 0,
            elements: String::new(),
        };
        let mut lines = wrap_text(&svg.title, ((width - 2.0 * MARGIN) / (TITLE * BOLD_LETTER)) as usize);
        lines.truncate(TITLE_LINES);
        let mut top = MARGIN;
        for line in lines {
            let at = [0.5 * width, top + 0.5 * TITLE_LINE];
            svg.sized_text(at, Anchor::Middle, FontFace::Bold, TITLE, "", &line);
            top += TITLE_LINE;
        }
        (svg, top)
    }

    fn finish(mut self, height: f64) -> Self {
        self.height = height.ceil() as u32;
        self
    }

    /// An element without content; `attributes` must not need escaping.
    fn element(&mut self, name: &str, attributes: &str) {
        let _ = writeln!(self.elements, "<{name} {attributes}/>");
    }

    fn path(&mut self, d: &str, style: &str) {
        self.element("path", &format!(r#"d="{d}" {style}"#));
    }

    fn stroke(&mut self, d: &str, colour: &str, width: f64) {
        let pen = format!(r#"stroke="{colour}" stroke-width="{width}" stroke-linejoin="round""#);
        self.path(d, &format!(r#"fill="none" {pen}"#));
    }

    fn dashes(&mut self, d: &str, colour: &str, width: f64) {
        let pen = format!(r#"stroke="{colour}" stroke-width="{width}" stroke-dasharray="14 8""#);
        self.path(d, &format!(r#"fill="none" {pen}"#));
    }

    fn fill(&mut self, d: &str, colour: &str) {
        self.path(d, &format!(r#"fill="{colour}""#));
    }

    fn line(&mut self, from: Px, to: Px, colour: &str, width: f64) {
        self.stroke(&data([[from, to]]), colour, width);
    }

    fn rectangle(&mut self, a: Px, b: Px, fill: &str, edge: Option<&str>) {
        let [x, y] = [a[0].min(b[0]), a[1].min(b[1])];
        let [w, h] = [(a[0] - b[0]).abs(), (a[1] - b[1]).abs()];
        let edge = edge.map_or_else(String::new, |c| format!(" stroke=\"{c}\" stroke-width=\"1.2\""));
        let place = format!(r#"x="{x:.2}" y="{y:.2}" width="{w:.2}" height="{h:.2}""#);
        self.element("rect", &format!(r#"{place} fill="{fill}"{edge}"#));
    }

    fn dot(&mut self, [x, y]: Px, radius: f64, fill: &str, edge: &str) {
        let place = format!(r#"cx="{x:.1}" cy="{y:.1}" r="{radius}""#);
        self.element("circle", &format!(r#"{place} fill="{fill}" stroke="{edge}" stroke-width="1.2""#));
    }

    fn text(&mut self, at: Px, anchor: Anchor, face: FontFace, text: &str) {
        self.sized_text(at, anchor, face, TEXT, "", text);
    }

    fn label(&mut self, at: Px, face: FontFace, text: &str) {
        self.sized_text(at, Anchor::Middle, face, TEXT, HALO, text);
    }

    fn upright_text(&mut self, at: Px, text: &str) {
        let turned = format!(" transform=\"rotate(-90 {:.1} {:.1})\"", at[0], at[1]);
        self.sized_text(at, Anchor::Middle, FontFace::Plain, TEXT, &turned, text);
    }

    fn sized_text(&mut self, at: Px, anchor: Anchor, face: FontFace, size: f64, more: &str, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let weight = if face == FontFace::Bold { " font-weight=\"bold\"" } else { "" };
        // The middle of a letter is about a third of the size above the baseline; viewers interpret `dominant-baseline` differently.
        let (x, y, text) = (at[0], at[1] + 0.35 * size, escape_xml(&printable(text)));
        let _ = writeln!(
            self.elements,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" font-family=\"sans-serif\" font-size=\"{size}\" fill=\"{INK}\"{weight}{more}>{text}</text>"
        );
    }

    fn render(&self, metadata: &str) -> String {
        let Self { width, height, elements, .. } = self;
        let [title, description] = [&self.title, &self.description].map(|text| escape_xml(text));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\">\n<title>{title}</title>\n<desc>{description}</desc>\n{metadata}\
             <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{elements}</svg>\n"
        )
    }
}

impl fmt::Display for Svg {
    /// As a part of a page, which has its own provenance.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(""))
    }
}

impl Export for Svg {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        let entries = by.entries().map(|(name, value)| format!("{name}: {}", escape_xml(&printable(&value))));
        let metadata = format!("<metadata>{}</metadata>\n", joined(entries, "\n"));
        out.write_all(self.render(&metadata).as_bytes())
    }
}

/// Chains of points as the data of a path, rounded to a tenth of a pixel.
fn data<L: IntoIterator<Item = Px>>(lines: impl IntoIterator<Item = L>) -> String {
    let mut out = String::new();
    for line in lines {
        for (nth, [x, y]) in line.into_iter().enumerate() {
            let command = if nth == 0 { 'M' } else { 'L' };
            let _ = write!(out, "{command}{x:.1} {y:.1}");
        }
    }
    out
}

fn closed_paths<L: IntoIterator<Item = Px>>(lines: impl IntoIterator<Item = L>) -> String {
    lines.into_iter().map(|line| data([line]) + "Z").collect()
}

/// Text without the control characters that XML 1.0 forbids even if escaped.
fn printable(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() || matches!(c, '\u{FFFE}' | '\u{FFFF}') { ' ' } else { c })
        .collect()
}

pub(super) fn escape_xml(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// The words of `text` in lines of at most `most` letters; a longer word has a line of its own.
pub fn wrap_text(text: &str, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

const LEGEND_ROW: f64 = 36.0;

/// A legend in as many rows as needed between two edges, px.
struct Legend {
    edges: [f64; 2],
    top: f64,
    /// Where the next entry begins.
    at: Px,
}

impl Legend {
    fn new(edges: [f64; 2], top: f64) -> Self {
        Self { edges, top, at: [edges[0], top + 0.5 * LEGEND_ROW] }
    }

    /// Draws an entry: its symbol of the width `symbol`, px, from its left end on, and its name.
    fn entry(&mut self, svg: &mut Svg, symbol: f64, name: &str, draw: impl FnOnce(&mut Svg, Px)) {
        let ([left, right], width) = (self.edges, symbol + FontFace::Plain.width(name));
        if self.at[0] > left && self.at[0] + width > right {
            self.at = [left, self.at[1] + LEGEND_ROW];
        }
        let [x, y] = self.at;
        draw(svg, [x, y]);
        svg.text([x + symbol, y], Anchor::Start, FontFace::Plain, name);
        self.at[0] += width + 2.0 * MARGIN;
    }

    fn area(&mut self, svg: &mut Svg, symbol: f64, name: &str, fill: &str) {
        self.entry(svg, symbol, name, |svg, [x, y]| {
            svg.rectangle([x, y - 10.0], [x + symbol - 10.0, y + 10.0], fill, Some(INK));
        });
    }

    /// The height of all rows, px.
    fn height(&self) -> f64 {
        if self.at[0] > self.edges[0] { self.at[1] + 0.5 * LEGEND_ROW - self.top } else { 0.0 }
    }
}
