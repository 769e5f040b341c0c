//! Tidy tables with one row for each point: `recording,time_s,point,x_mm,y_mm[,sigma_mm]`. Every other format
//! can be converted to them.

use std::collections::BTreeMap;

use super::super::lengths::error::{Malformed, Place};
use super::{Budget, Format, Recording, Sample, coordinate, limits};

const LEAST_SIGMA_MM: f64 = 1e-3;

pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Vec<Recording>, Malformed> {
    let text = limits::text(bytes, origin)?;
    let start = Place { origin, line: 1, column: 1 };
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .has_headers(true)
        .from_reader(text.as_bytes());
    let broken = |e: csv::Error| {
        let line = e.position().map_or(1, csv::Position::line);
        Place { line, ..start }.error(e.to_string(), "give every row as many fields as the header")
    };
    let header = reader.headers().map_err(broken)?.clone();
    let column = |name: &str| header.iter().position(|h| h.eq_ignore_ascii_case(name));
    let needed = |name: &str| {
        column(name).ok_or_else(|| {
            let help = "begin with recording,time_s,point,x_mm,y_mm (and sigma_mm, where it is known)";
            start.error(format!("there is no column {name}"), help)
        })
    };
    let (point, x, y) = (needed("point")?, needed("x_mm")?, needed("y_mm")?);
    let (recording, time, sigma) = (column("recording"), column("time_s"), column("sigma_mm"));

    let mut found: Vec<Recording> = Vec::new();
    let mut budget = Budget::default();
    // Indices of each recording, and in it of each channel and of the frame of each time.
    let mut numbers: BTreeMap<String, usize> = BTreeMap::new();
    let mut channels: Vec<BTreeMap<String, usize>> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(broken)?;
        let at = Place { line: record.position().map_or(1, csv::Position::line), ..start };
        let field = |f: usize| record.get(f).unwrap_or_default();
        let number = |f: usize, what: &str| {
            let text = field(f);
            let value = match text {
                "" | "*" | "NA" => return Ok(None),
                text => coordinate(text),
            };
            let wrong = || {
                at.at_column(f + 1).error(format!("{what} is {text:?}"), "give a finite number, or nothing")
            };
            value.map(Some).ok_or_else(wrong)
        };
        let named = recording.map(field).filter(|n| !n.is_empty());
        let named = named.map_or_else(|| Recording::stem(origin), str::to_owned);
        let nth = *numbers.entry(named).or_insert_with_key(|name| {
            budget.recording();
            found.push(Recording {
                name: name.clone(),
                ..Recording::of_file(origin, Format::Tidy, Some(1e-3), std::iter::empty(), Vec::new())
            });
            channels.push(BTreeMap::new());
            found.len() - 1
        });
        let this = &mut found[nth];
        let name = field(point);
        if name.is_empty() || name.contains(char::is_control) {
            return Err(at
                .at_column(point + 1)
                .error(format!("the point is {name:?}"), "name it, like tongue_0, hyoid or mental_spine"));
        }
        let channel = match channels[nth].get(name) {
            Some(known) => *known,
            None => {
                budget.channel(this.samples.len(), this.channels.len() + 1, at)?;
                channels[nth].insert(name.to_owned(), this.channels.len());
                this.channels.push(name.to_owned());
                this.sigma.push(None);
                this.samples.iter_mut().for_each(|s| s.places.push(None));
                this.channels.len() - 1
            }
        };
        // A table without times has one posture.
        let time_s = match time {
            Some(f) => number(f, "the time")?
                .ok_or_else(|| at.at_column(f + 1).error("the time is missing", "give it in seconds"))?,
            None => 0.0,
        };
        match this.samples.last().map(|s| s.time_s) {
            Some(last) if last == time_s => {}
            Some(last) if last > time_s => {
                let what = format!("the time {time_s} s comes after {last} s");
                let at = at.at_column(time.unwrap_or(0) + 1);
                return Err(at.error(what, "sort the rows of each recording by time"));
            }
            _ => {
                budget.frame(this.samples.len() + 1, this.channels.len(), at)?;
                this.samples.push(Sample::new(time_s, vec![None; this.channels.len()]));
            }
        }
        let place = number(x, "x_mm")?.zip(number(y, "y_mm")?).map(|(x, y)| [x, y, 0.0]);
        let Some(slot) = this.samples.last_mut().and_then(|s| s.places.get_mut(channel)) else { continue };
        if slot.is_some() {
            let what = format!("{name} is given twice at {time_s} s");
            return Err(at.at_column(point + 1).error(what, "keep one of the two rows"));
        }
        *slot = place;
        if let Some(f) = sigma
            && let Some(sd) = number(f, "sigma_mm")?
        {
            if sd < LEAST_SIGMA_MM {
                return Err(at.at_column(f + 1).error(
                    format!("sigma_mm is {sd:?}"),
                    format!("give a standard deviation of at least {LEAST_SIGMA_MM} mm, or nothing"),
                ));
            }
            let before = &mut this.sigma[channel];
            *before = Some(before.map_or(sd, |b| b.max(sd)));
        }
    }
    Ok(found)
}
