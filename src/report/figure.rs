//! What the figures share: the sheet, its text and its accessible description.

use std::io;

use plotters::backend::SVGBackend;
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind, IntoDrawingArea};
use plotters::element::PathElement;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontFamily, FontStyle, IntoFont, RGBColor, ShapeStyle, TextStyle, WHITE};

use super::ReportError;

pub(super) type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(super) type DrawError = DrawingAreaErrorKind<io::Error>;

/// Width of every figure, px. Printed in a journal column of 85 mm, 24 px are 6.4 points: no text is smaller.
pub(super) const WIDTH: i32 = 900;
/// Size of ordinary text, px.
pub(super) const TEXT: i32 = 24;
/// Size of the title, px, and the height of one of its lines.
const TITLE: i32 = 28;
const TITLE_LINE: i32 = 36;
/// Lines of a title that are shown; the rest is in the accessible title only.
const TITLE_LINES: usize = 6;
/// Free margin at the edges, px.
pub(super) const MARGIN: i32 = 16;

pub(super) const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);
pub(super) const RULE: RGBColor = RGBColor(0xDD, 0xDD, 0xDD);

/// Canvas units in a pixel. The drawing library rounds to whole units, which would make fine meshes jagged.
const FINE: i32 = 8;

/// Pixels in canvas units.
pub(super) const fn px(pixels: i32) -> i32 {
    pixels * FINE
}

/// A line of a width in tenths of a pixel.
pub(super) fn stroke(color: RGBColor, tenths: u32) -> ShapeStyle {
    color.stroke_width(tenths * FINE as u32 / 10)
}

/// Ordinary text.
pub(super) fn text(anchor: HPos) -> TextStyle<'static> {
    font(TEXT, FontStyle::Normal, anchor)
}

/// Emphasised text.
pub(super) fn bold(anchor: HPos) -> TextStyle<'static> {
    font(TEXT, FontStyle::Bold, anchor)
}

fn font(size: i32, style: FontStyle, anchor: HPos) -> TextStyle<'static> {
    // The SVG backend divides sizes by 1.24 to turn them into CSS pixels.
    let size = 1.24 * f64::from(px(size));
    TextStyle::from((FontFamily::SansSerif, size, style).into_font())
        .color(&INK)
        .pos(Pos::new(anchor, VPos::Center))
}

/// A figure before it is drawn.
pub(super) struct Sheet<'a> {
    /// Title over the figure; wrapped where it is too long for one line.
    pub title: &'a str,
    /// What is to be seen, for readers who cannot see it.
    pub description: String,
    /// Height below the title, px.
    pub height: i32,
}

impl Sheet<'_> {
    /// Draws the figure; `body` receives the area below the title. The same calls give the same bytes.
    ///
    /// # Errors
    /// [`ReportError::Drawing`] if the drawing library fails.
    pub fn draw(&self, body: impl FnOnce(&Canvas) -> Result<(), DrawError>) -> Result<String, ReportError> {
        let mut lines = wrapped(&printable(self.title), (WIDTH - 2 * MARGIN) * 100 / (TITLE * 55));
        lines.truncate(TITLE_LINES);
        let top = lines.iter().fold(MARGIN, |y, _| y + TITLE_LINE);
        let height = top + self.height;
        let mut svg = String::new();
        self.paint(&mut svg, height, top, &lines, body)
            .map_err(|source| ReportError::Drawing { title: self.title.to_owned(), source })?;
        // The library's root element has the size of the fine canvas and no room for a description.
        let elements = svg.split_once('\n').map_or("", |(_, elements)| elements);
        Ok(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" width=\"{WIDTH}\" height=\"{height}\" \
             viewBox=\"0 0 {} {}\">\n<title>{}</title>\n<desc>{}</desc>\n{elements}",
            px(WIDTH),
            px(height),
            escaped(&printable(self.title)),
            escaped(&printable(&self.description)),
        ))
    }

    fn paint(
        &self,
        svg: &mut String,
        height: i32,
        top: i32,
        lines: &[String],
        body: impl FnOnce(&Canvas) -> Result<(), DrawError>,
    ) -> Result<(), DrawError> {
        let size = (px(WIDTH).unsigned_abs(), px(height).unsigned_abs());
        let canvas = SVGBackend::with_string(svg, size).into_drawing_area();
        canvas.fill(&WHITE)?;
        let style = font(TITLE, FontStyle::Bold, HPos::Center);
        for (line, y) in lines.iter().zip((MARGIN + TITLE_LINE / 2..).step_by(TITLE_LINE as usize)) {
            canvas.draw_text(line, &style, (px(WIDTH / 2), px(y)))?;
        }
        body(&canvas.split_vertically(px(top)).1)?;
        canvas.present()
    }
}

/// A straight line between two points of the canvas.
pub(super) fn line(from: (i32, i32), to: (i32, i32), style: ShapeStyle) -> PathElement<(i32, i32)> {
    PathElement::new(vec![from, to], style)
}

/// Text without the control characters that XML 1.0 forbids even when escaped.
pub(super) fn printable(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() || matches!(c, '\u{FFFE}' | '\u{FFFF}') { ' ' } else { c })
        .collect()
}

pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// The words of `text` in lines of at most `most` letters; a longer word has a line of its own.
fn wrapped(text: &str, most: i32) -> Vec<String> {
    let most = usize::try_from(most).unwrap_or(1);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_titles_wrap_between_words_and_lose_no_letter() {
        let title = "one two three four";
        assert_eq!(wrapped(title, 9), ["one two", "three", "four"]);
        assert_eq!(wrapped(title, 2), ["one", "two", "three", "four"]);
        assert!(wrapped("  ", 9).is_empty());
    }

    #[test]
    fn hostile_titles_stay_well_formed_and_readable() {
        let title = "a < b & \"c\" > 'd' \u{0}\u{1b}\u{ffff} /ɯ/";
        let sheet = Sheet { title, description: title.to_owned(), height: 10 };
        let svg = sheet.draw(|_| Ok(())).unwrap();
        let document = roxmltree::Document::parse(&svg).unwrap();
        let told = |name| {
            let element = document.descendants().find(|n| n.has_tag_name(name)).unwrap();
            element.text().unwrap().split_whitespace().collect::<Vec<_>>().join(" ")
        };
        for name in ["title", "desc", "text"] {
            assert_eq!(told(name), "a < b & \"c\" > 'd' /ɯ/", "{name}");
        }
    }
}
