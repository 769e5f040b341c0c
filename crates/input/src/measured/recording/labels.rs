//! Labels of intervals of a recording: AAA's annotations and prompts, and Praat's TextGrids.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Malformed, ReadError, Recording, SourcePlace, limits};

const MOST_LABELS: usize = 100_000;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Label {
    /// The tier of the label: `annotation` or `prompt` of AAA, or a tier of a TextGrid.
    pub tier: String,
    #[serde(rename = "label")]
    pub name: String,
    pub from_s: f64,
    pub to_s: f64,
}

impl Label {
    /// Whether the interval contains a time, its ends included.
    pub fn holds(&self, time_s: f64) -> bool {
        const SAME_S: f64 = 1e-9;
        self.from_s - SAME_S <= time_s && time_s <= self.to_s + SAME_S
    }
}

/// Adds the labels of `NAME.TextGrid` to the only recording of the file `NAME` beside it.
pub(super) fn read_labels_beside(path: &Path, recordings: &mut [Recording]) -> Result<(), ReadError> {
    let beside = ["TextGrid", "textgrid"].map(|e| path.with_extension(e));
    let Some(path) = beside.into_iter().find(|p| p.is_file()) else { return Ok(()) };
    let origin = path.display().to_string();
    let count = recordings.len();
    let [recording] = recordings else {
        let what = format!("{origin} is not used, since the file has {count} recordings");
        let note = format!("{what}; give each recording a file of its own");
        recordings.first_mut().iter_mut().for_each(|first| first.notes.push(note.clone()));
        return Ok(());
    };
    let bytes = crate::files::read_up_to(limits::LARGEST, &path);
    let bytes = bytes.map_err(|error| ReadError::unreadable(&origin, &error))?;
    recording.labels.extend(text_grid(&bytes, &origin)?);
    Ok(())
}

/// The intervals with text in a TextGrid (Boersma and Weenink, Praat's manual: "TextGrid file formats"), long or short.
pub fn text_grid(bytes: &[u8], origin: &str) -> Result<Vec<Label>, Malformed> {
    let text = limits::text(bytes, origin)?;
    let mut tokens = Tokens { text: &text, line: 1, origin };
    let help = "export the TextGrid from Praat as a text file";
    if tokens.token()?.as_deref() != Some("ooTextFile") || tokens.token()?.as_deref() != Some("TextGrid") {
        return Err(tokens.wrong("this is not a TextGrid in text form", help));
    }
    for _ in 0..2 {
        tokens.number("the time of the whole")?;
    }
    let mut out = Vec::new();
    for _ in 0..tokens.number("the number of tiers")? as usize {
        let is_interval = tokens.required("the class of a tier")? == "IntervalTier";
        let tier = tokens.required("the name of a tier")?;
        for _ in 0..2 {
            tokens.number("the time of a tier")?;
        }
        for _ in 0..tokens.number("the number of intervals")? as usize {
            let from_s = tokens.number("the beginning of an interval")?;
            let to_s = if is_interval { tokens.number("the end of an interval")? } else { from_s };
            let name = tokens.required("the text of an interval")?.trim().to_owned();
            if name.is_empty() || !is_interval {
                continue;
            }
            if from_s > to_s {
                return Err(tokens.wrong("an interval ends before it begins", help));
            }
            if out.len() == MOST_LABELS {
                return Err(tokens.wrong("too many intervals", help));
            }
            out.push(Label { tier: tier.clone(), name, from_s, to_s });
        }
    }
    Ok(out)
}

/// The texts in quotes and the numbers of a TextGrid. As in Praat, everything else is ignored.
struct Tokens<'a> {
    text: &'a str,
    line: u64,
    origin: &'a str,
}

impl Tokens<'_> {
    fn wrong(&self, what: &str, help: &str) -> Malformed {
        SourcePlace { origin: self.origin, line: self.line, column: 1 }.error(what.to_owned(), help)
    }

    /// The next number, or the next text in quotes, in which `""` is a quote.
    fn token(&mut self) -> Result<Option<String>, Malformed> {
        loop {
            self.text = self.text.trim_start_matches(|c: char| c.is_whitespace() && c != '\n');
            match self.text.chars().next() {
                None => return Ok(None),
                Some('\n') => {
                    self.line += 1;
                    self.text = &self.text[1..];
                }
                Some('"') => {
                    let mut out = String::new();
                    // A quote directly behind a closing one belongs to the text, which goes on.
                    while let Some(rest) = self.text.strip_prefix('"') {
                        let Some((part, after)) = rest.split_once('"') else {
                            let help = "the file is cut off; export it again";
                            return Err(self.wrong("a text has no closing quote", help));
                        };
                        out += part;
                        self.text = after;
                        if after.starts_with('"') {
                            out.push('"');
                        }
                    }
                    self.line += out.matches('\n').count() as u64;
                    return Ok(Some(out));
                }
                Some(_) => {
                    let end = self.text.find(|c: char| c.is_whitespace() || c == '"');
                    let (token, rest) = self.text.split_at(end.unwrap_or(self.text.len()));
                    self.text = rest;
                    if token.parse::<f64>().is_ok_and(f64::is_finite) {
                        return Ok(Some(token.to_owned()));
                    }
                }
            }
        }
    }

    fn required(&mut self, what: &str) -> Result<String, Malformed> {
        let found = self.token()?;
        found.ok_or_else(|| self.wrong(&format!("{what} is missing"), "the file is cut off; export it again"))
    }

    fn number(&mut self, what: &str) -> Result<f64, Malformed> {
        let token = self.required(what)?;
        let number = token.parse().ok().filter(|v: &f64| v.is_finite());
        number.ok_or_else(|| self.wrong(&format!("{what} is {token:?}"), "give a number"))
    }
}
