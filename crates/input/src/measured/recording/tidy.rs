//! Tables with a row for each point, `recording,time_s,point,x_mm,y_mm[,sigma_mm]`, into which every other format can be converted.

use std::collections::BTreeMap;

use super::{Budget, Format, Malformed, Recording, Sample, SourcePlace, limits, records, rows};

const COLUMNS: [&str; 6] = ["recording", "time_s", "point", "x_mm", "y_mm", "sigma_mm"];
const LEAST_SIGMA_MM: f64 = 1e-3;

pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Vec<Recording>, Malformed> {
    let text = limits::text(bytes, origin)?;
    let csv = &mut csv::ReaderBuilder::new();
    let help = "give every row as many fields as the header";
    let (separator, title_lines) =
        rows::header(&text, |name| COLUMNS.iter().any(|c| name.eq_ignore_ascii_case(c)));
    let csv = csv.comment(Some(b'#')).delimiter(separator);
    let mut rows = records(&text, origin, title_lines, csv, help);
    let header = rows.next().transpose()?.map(|header| header.cells).unwrap_or_default();
    let column = |name: &str| header.iter().position(|h| h.eq_ignore_ascii_case(name));
    let start = SourcePlace::start(origin);
    let needed = |name: &str| {
        let help = "begin with recording,time_s,point,x_mm,y_mm (and sigma_mm, where it is known)";
        column(name).ok_or_else(|| start.error(format!("there is no column {name}"), help))
    };
    let (point, x, y) = (needed("point")?, needed("x_mm")?, needed("y_mm")?);
    let (recording, time, sigma) = (column("recording"), column("time_s"), column("sigma_mm"));
    if time.is_none()
        && let Some(other) = header.iter().find(|name| name.to_lowercase().starts_with("time"))
    {
        let what = format!("there is a column {other:?}, but no column time_s");
        return Err(start.error(what, "give the times in seconds, in a column time_s"));
    }

    let mut found: Vec<Recording> = Vec::new();
    let mut budget = Budget::default();
    // Numbers of the recordings by name, and of each recording's channels.
    let mut numbers: BTreeMap<String, usize> = BTreeMap::new();
    let mut channels: Vec<BTreeMap<String, usize>> = Vec::new();
    for row in rows {
        let row = row?;
        let named = recording.map(|field| row.cell(field)).filter(|n| !n.is_empty());
        let named = named.map_or_else(|| Recording::stem(origin), str::to_owned);
        let nth = *numbers.entry(named).or_insert_with_key(|name| {
            budget.recording();
            let new = Recording::of_file(origin, Format::Tidy, Some(1e-3), std::iter::empty(), Vec::new());
            found.push(Recording { name: name.clone(), ..new });
            channels.push(BTreeMap::new());
            found.len() - 1
        });
        let this = &mut found[nth];
        let name = row.cell(point);
        if name.is_empty() || name.contains(char::is_control) {
            let what = format!("the point is {name:?}");
            return Err(row.place(point).error(what, "name it, like tongue_0, hyoid or mental_spine"));
        }
        let channel = match channels[nth].get(name) {
            Some(known) => *known,
            None => {
                budget.channel(this.samples.len(), this.channels.len() + 1, row.at)?;
                channels[nth].insert(name.to_owned(), this.channels.len());
                this.channels.push(name.to_owned());
                this.sigma.push(None);
                this.samples.iter_mut().for_each(|s| s.places.push(None));
                this.channels.len() - 1
            }
        };
        // A table without times has one posture.
        let time_s = time.map_or(Ok(0.0), |field| row.seconds(field))?;
        match this.samples.last().map(|s| s.time_s) {
            Some(last) if last == time_s => {}
            Some(last) if last > time_s => {
                let what = format!("the time {time_s} s comes after {last} s");
                let help = match recording {
                    Some(_) => "sort the rows of each recording by time",
                    None => "sort the rows by time, or name the recording of each in a column \"recording\"",
                };
                return Err(row.place(time.unwrap_or(0)).error(what, help));
            }
            _ => {
                budget.frame(this.samples.len() + 1, this.channels.len(), row.at)?;
                this.samples.push(Sample::new(time_s, vec![None; this.channels.len()]));
            }
        }
        let place = row.number(x, "x_mm")?.zip(row.number(y, "y_mm")?).map(|(x, y)| [x, y, 0.0]);
        let last = this.samples.len() - 1;
        let slot = &mut this.samples[last].places[channel];
        if slot.is_some() {
            let what = format!("{name} is given twice at {time_s} s");
            return Err(row.place(point).error(what, "keep one of the two rows"));
        }
        *slot = place;
        if let Some(field) = sigma
            && let Some(sd) = row.number(field, "sigma_mm")?
        {
            if sd < LEAST_SIGMA_MM {
                let help = format!("give a standard deviation of at least {LEAST_SIGMA_MM} mm, or nothing");
                return Err(row.place(field).error(format!("sigma_mm is {sd:?}"), help));
            }
            this.sigma[channel] = Some(this.sigma[channel].map_or(sd, |before| before.max(sd)));
        }
    }
    Ok(found)
}
