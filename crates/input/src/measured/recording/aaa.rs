//! Articulate Assistant Advanced's export of splines: a table separated by tabs (semicolons or commas where a spreadsheet has saved it),
//! with a header, perhaps below a title, a row for each frame, and columns `X0 SPLINE`, `Y0 SPLINE` and so on, mm, y up. Missing values are
//! empty or `*`; numbers may have a decimal comma. The names of columns are those of the R package rticulate (Coretta 2021, `read_aaa`) and
//! of AAA's list of DeepLabCut splines.

use std::collections::BTreeMap;

use super::{Budget, Format, Label, Malformed, Recording, Sample, SourcePlace, limits, records, rows};

const TIMES: [&str; 4] =
    ["Time of sample in recording", "Time of sample in annot", "Time of sample in sweep", "time_s"];

const CUT: &str = "the file is cut off; export it again";

/// Beginnings of the names of the columns that identify a recording; the first has the speaker.
const OF_RECORDING: [&str; 3] = ["Client", "Date", "Prompt"];

struct PointColumns {
    name: String,
    x: usize,
    y: usize,
}

pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Vec<Recording>, Malformed> {
    let text = limits::text(bytes, origin)?;
    let start = SourcePlace::start(origin);
    let csv = &mut csv::ReaderBuilder::new();
    let help = "export the table from AAA again, separated by tabs";
    let (separator, title_lines) = rows::header(&text, |name| {
        spline_of(name).is_some() || TIMES.iter().any(|t| name.eq_ignore_ascii_case(t))
    });
    let csv = csv.delimiter(separator).flexible(true);
    let mut table = records(&text, origin, title_lines, csv, help);
    let header = table.next().transpose()?.map(|header| header.cells).unwrap_or_default();
    let column = |title: &str| header.iter().position(|h| h.eq_ignore_ascii_case(title));
    let begins = |word: &str| header.iter().position(|h| h.starts_with(word));
    let time = TIMES.iter().find_map(|t| column(t)).ok_or_else(|| {
        let help =
            "export the time of the sample in the recording, as a table separated by tabs with a header";
        start.error(format!("no column \"{}\"", TIMES[0]), help)
    })?;
    let (points, shared, without_y) = points(&header, start)?;
    let of_recording: Vec<usize> = OF_RECORDING.iter().filter_map(|word| begins(word)).collect();
    let tiers = [("annotation", column("Annotation Title")), ("prompt", begins(OF_RECORDING[2]))];
    let last_column = points.iter().map(|p| p.x.max(p.y)).max().unwrap_or(0).max(time);
    let mut recordings = RecordingRows::new(points.iter().map(|p| p.name.clone()).collect());
    recordings.restarts = ![TIMES[0], "time_s"].iter().any(|title| title.eq_ignore_ascii_case(&header[time]));
    recordings.has_speaker = begins(OF_RECORDING[0]).is_some();
    let mut short: Vec<u64> = Vec::new();
    let last_line = if text.ends_with('\n') { 0 } else { text.lines().count() as u64 };
    for row in table {
        let row = row?;
        if row.cells.iter().all(str::is_empty) {
            continue;
        }
        let (width, wanted) = (row.cells.len(), header.len());
        let is_short = width <= last_column;
        let has_surplus = separator == b',' && row.cells.iter().skip(wanted).any(|cell| !cell.is_empty());
        if is_short && width > time && row.at.line != last_line {
            short.push(row.at.line);
        } else if is_short || has_surplus {
            let what = format!("the line has {width} fields where the header has {wanted}");
            let comma = "decimals with a comma cannot be distinguished from separators; export the table separated by tabs";
            let (column, help) = if is_short { (width, CUT) } else { (wanted + 1, comma) };
            return Err(row.at.at_column(column).error(what, help));
        }
        let time_s = row.seconds(time)?;
        let place = |p: &PointColumns| row.point([p.x, p.y], format_args!("a coordinate of {}", p.name));
        let places = points.iter().map(place).collect::<Result<Vec<_>, _>>()?;
        for (first, second) in &shared {
            let both = places[*first].zip(place(second)?);
            let apart_mm = both.map_or(0.0, |([x, y, _], [u, v, _])| (u - x).hypot(v - y));
            if apart_mm > SHARED_APART_MM {
                let [a, b] = [points[*first].x, second.x].map(|x| &header[x]);
                let what =
                    format!("{b:?} lies {apart_mm:.0} mm from {a:?}, though both are the {}", second.name);
                let help = "points of a spline are exchanged, or it has another's name; correct the header, or leave it out";
                return Err(row.place(second.x).error(what, help));
            }
        }
        if let Some(x) = without_y.iter().find(|x| !rows::is_missing(row.cell(**x))) {
            let what = format!("{:?} has a value, but no column for y beside it", &header[*x]);
            return Err(row.place(*x).error(what, "export both, or leave the spline out"));
        }
        let key = of_recording.iter().map(|field| row.cell(*field).to_owned()).collect();
        let run = recordings.add(key, time_s, places, row.at)?;
        for (tier, column) in tiers {
            if let Some(name) = column.map(|field| row.cell(field)).filter(|name| !name.is_empty()) {
                run.label(tier, name, time_s);
            }
        }
    }
    if rows::LastNumber::of(&text).is_some_and(|last| last.is_short()) {
        let column = text.lines().next_back().map_or(1, |line| line.split(char::from(separator)).count());
        let at = SourcePlace { line: last_line, column, ..start };
        return Err(at.error("the last number is cut off", CUT));
    }
    let mut found = recordings.recordings(Format::Aaa, start)?;
    if let (Some(line), Some(first)) = (short.first(), found.first_mut()) {
        first.notes.push(format!(
            "{} rows of {origin} end before the last column (the first is line {line}); the points that they lack count as not seen",
            short.len()
        ));
    }
    Ok(found)
}

#[derive(Default)]
pub(super) struct RecordingRows {
    channels: Vec<String>,
    /// Whether times start again with every annotation, so that every step back in time begins another recording.
    restarts: bool,
    /// Whether the first part of the key is the speaker.
    has_speaker: bool,
    /// The key of each recording, and its runs of rows in which times do not step back, in the order of the file.
    found: Vec<(Vec<String>, Vec<RowRun>)>,
    numbers: BTreeMap<Vec<String>, usize>,
    budget: Budget,
    count: usize,
}

#[derive(Default)]
pub(super) struct RowRun {
    rows: Vec<(u64, Sample)>,
    labels: Vec<Label>,
}

impl RowRun {
    /// Extends the last label of the tier to this row if it has the same name, or adds a label.
    fn label(&mut self, tier: &str, name: &str, time_s: f64) {
        match self.labels.iter_mut().rev().find(|l| l.tier == tier) {
            Some(last) if last.name == name && last.to_s <= time_s => last.to_s = time_s,
            _ => {
                let (tier, name) = (tier.to_owned(), name.to_owned());
                self.labels.push(Label { tier, name, from_s: time_s, to_s: time_s });
            }
        }
    }
}

impl RecordingRows {
    pub fn new(channels: Vec<String>) -> Self {
        Self { channels, ..Self::default() }
    }

    /// Adds a row of the recording with this key, and returns the run that it belongs to.
    pub fn add(
        &mut self,
        key: Vec<String>,
        time_s: f64,
        places: Vec<Option<[f64; 3]>>,
        at: SourcePlace<'_>,
    ) -> Result<&mut RowRun, Malformed> {
        self.count += 1;
        self.budget.frame(self.count, self.channels.len(), at)?;
        let known = self.numbers.get(&key).copied();
        if known.is_none() {
            self.budget.add_recording(0, self.channels.len(), at)?;
            self.numbers.insert(key.clone(), self.found.len());
            self.found.push((key, vec![RowRun::default()]));
        }
        let number = known.unwrap_or(self.found.len() - 1);
        let runs = &mut self.found[number].1;
        let last_s = runs.last().and_then(|run| Some(run.rows.last()?.1.time_s));
        if last_s.is_some_and(|last| last > time_s || (self.restarts && last == time_s)) {
            runs.push(RowRun::default());
        }
        let last = runs.len() - 1;
        runs[last].rows.push((at.line, Sample::new(time_s, places)));
        Ok(&mut runs[last])
    }

    /// The recordings, each sorted by time. A row that is repeated for several labels is taken once, although AAA may interpolate its time
    /// and its coordinates again for each.
    pub fn recordings(mut self, format: Format, start: SourcePlace<'_>) -> Result<Vec<Recording>, Malformed> {
        let mut out: Vec<Recording> = Vec::new();
        let parts = std::mem::take(&mut self.found).into_iter().flat_map(|(key, runs)| {
            let parts = parts(runs, self.restarts).into_iter().enumerate();
            parts.map(move |(nth, part)| (key.clone(), nth, part))
        });
        for (key, nth, (RowRun { mut rows, labels }, notes)) in parts {
            if nth > 0 {
                let first = rows.first().map_or(start, |(line, _)| SourcePlace { line: *line, ..start });
                self.budget.add_recording(0, self.channels.len(), first)?;
            }
            rows.sort_by(|a, b| a.1.time_s.total_cmp(&b.1.time_s));
            let advice = if key.iter().any(|word| word.contains(':')) {
                "its times are rounded or repeated; export \"Time of sample in recording\" again, in seconds with all decimals"
            } else {
                "export the date and time of recording, so that recordings can be distinguished, and the times with all decimals"
            };
            let wrong = |line, what: String| Err(SourcePlace { line, ..start }.error(what, advice));
            if let [(_, first), _, .., (line, last)] = &rows[..]
                && first.time_s == last.time_s
                && rows.iter().any(|(_, s)| !is_same(s, first))
            {
                let what =
                    format!("all {} rows of this recording have the time {} s", rows.len(), first.time_s);
                return wrong(*line, what);
            }
            let mut samples: Vec<Sample> = Vec::with_capacity(rows.len());
            let mut last_line = 0;
            for (line, sample) in rows {
                match samples.last() {
                    Some(last) if is_same(last, &sample) => {}
                    Some(last) if last.time_s >= sample.time_s => {
                        let what = format!(
                            "the time {} s is also that of line {last_line}, which has other coordinates",
                            sample.time_s
                        );
                        return wrong(line, what);
                    }
                    _ => samples.push(sample),
                }
                last_line = line;
            }
            let words: Vec<&str> = key.iter().map(String::as_str).filter(|w| !w.is_empty()).collect();
            out.push(Recording {
                labels: join_labels(labels, &samples),
                notes,
                speaker: key.first().filter(|s| self.has_speaker && !s.is_empty()).cloned(),
                name: if words.is_empty() { Recording::stem(start.origin) } else { words.join(", ") },
                ..Recording::of_file(start.origin, format, Some(1e-3), self.channels.iter().cloned(), samples)
            });
        }
        Ok(out)
    }
}

/// Joins runs of rows to recordings, each with its notes. A run begins another recording if times start again with every annotation
/// (`restarts`), or if most of its rows lie between earlier ones in time but have other coordinates. Otherwise its rows are of another
/// label of the same recording, or out of order.
fn parts(runs: Vec<RowRun>, restarts: bool) -> Vec<(RowRun, Vec<String>)> {
    let steps = runs.iter().flat_map(|run| run.rows.windows(2)).map(|w| w[1].1.time_s - w[0].1.time_s);
    let step_s = steps.filter(|s| *s > SAME_S).fold(f64::INFINITY, f64::min);
    let of_one_row: Vec<f64> =
        runs.iter().filter(|r| r.rows.len() == 1).map(|r| r.rows[0].1.time_s).collect();
    let descends =
        runs.len() > FEW_RUNS && of_one_row.len() == runs.len() && of_one_row.windows(2).all(|w| w[0] > w[1]);
    let mut rows_of_last: BTreeMap<i64, Sample> = BTreeMap::new();
    let mut parts: Vec<(RowRun, Vec<String>)> = Vec::new();
    let is_one = runs.len() == 1;
    for mut run in runs {
        let is_other = |(_, sample): &&(u64, Sample)| {
            let near = tick(sample.time_s - NEAR_PART * step_s)..=tick(sample.time_s + NEAR_PART * step_s);
            let mut near = rows_of_last.range(near).peekable();
            near.peek().is_some() && near.all(|(_, known)| !is_same(known, sample))
        };
        let others = if step_s.is_finite() { run.rows.iter().filter(is_other).count() } else { 0 };
        let is_new = !descends && (restarts || 2 * others > run.rows.len());
        let notes = match run.rows.first() {
            Some((line, _)) if is_new && !restarts && !parts.is_empty() => vec![format!(
                "times step back at line {line}, so another recording begins there; export the date and time of each, so that they can be \
                     distinguished"
            )],
            _ if descends && parts.is_empty() => {
                vec!["its rows descend in time; they are read in ascending order".to_owned()]
            }
            _ => Vec::new(),
        };
        let is_known = run.rows.iter().all(|(_, sample)| {
            let near = tick(sample.time_s - SAME_S)..=tick(sample.time_s + SAME_S);
            rows_of_last.range(near).any(|(_, known)| is_same(known, sample))
        });
        if is_new {
            rows_of_last.clear();
        }
        if !is_one {
            rows_of_last.extend(run.rows.iter().map(|(_, sample)| (tick(sample.time_s), sample.clone())));
        }
        match parts.last_mut() {
            Some((last, notes)) if !is_new => {
                run.labels.retain(|label| !last.labels.iter().any(|known| contains_label(known, label)));
                if let Some((line, _)) = run.rows.first().filter(|_| is_known && run.labels.is_empty()) {
                    notes.push(format!("the rows from line {line} on are given twice, and are taken once"));
                }
                last.rows.extend(run.rows);
                last.labels.extend(run.labels);
            }
            _ => parts.push((run, notes)),
        }
    }
    parts
}

/// Labels by their beginning, with those of one tier and name joined between which no sample lies: rows that are out of order give a label
/// in several parts.
fn join_labels(mut labels: Vec<Label>, samples: &[Sample]) -> Vec<Label> {
    labels.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
    let mut out: Vec<Label> = Vec::with_capacity(labels.len());
    for label in labels {
        let last = out.iter_mut().rev().find(|last| last.tier == label.tier);
        let after = |to_s: f64| samples.get(samples.partition_point(|s| s.time_s <= to_s));
        match last.filter(|last| last.name == label.name) {
            Some(last) if after(last.to_s).is_none_or(|next| next.time_s >= label.from_s) => {
                last.to_s = last.to_s.max(label.to_s);
            }
            _ => out.push(label),
        }
    }
    out
}

fn contains_label(known: &Label, label: &Label) -> bool {
    (&known.tier, &known.name) == (&label.tier, &label.name)
        && known.from_s <= label.from_s + SAME_S
        && known.to_s >= label.to_s - SAME_S
}

fn tick(time_s: f64) -> i64 {
    (time_s * 1e6).round() as i64
}

/// Times of one frame, which AAA interpolates again for each label, differ by less, s.
const SAME_S: f64 = 5e-4;
/// So few runs of one row each may descend in time by chance.
const FEW_RUNS: usize = 5;
/// Rows are compared with earlier rows that are at most this part of the time between frames away.
const NEAR_PART: f64 = 0.75;

/// Whether two samples are of one frame: their times and coordinates differ by rounding and interpolation only.
fn is_same(a: &Sample, b: &Sample) -> bool {
    const PLACE_MM: f64 = 0.1;
    (a.time_s - b.time_s).abs() <= SAME_S
        && a.places.iter().zip(&b.places).all(|(p, q)| match (p, q) {
            (Some(p), Some(q)) => (0..3).all(|i| (p[i] - q[i]).abs() <= PLACE_MM),
            _ => p == q,
        })
}

/// Largest distance between the two positions that a file gives for a point of two splines, mm.
const SHARED_APART_MM: f64 = 3.0;

/// The number and the spline of a column, such as `X3 SPLINE`.
fn spline_of(title: &str) -> Option<(&str, &str)> {
    let (number, spline) = title.strip_prefix('X')?.split_once(' ')?;
    (!number.is_empty() && number.bytes().all(|b| b.is_ascii_digit())).then_some((number, spline))
}

/// The points of a header, second columns for a point that two splines share (with the point's number), and columns of x without y.
type HeaderPoints = (Vec<PointColumns>, Vec<(usize, PointColumns)>, Vec<usize>);

/// Finds pairs of columns such as `X3 SPLINE` and `Y3 SPLINE`. AAA writes `X0 SPLINE` alone for an empty spline.
fn points(header: &csv::StringRecord, start: SourcePlace<'_>) -> Result<HeaderPoints, Malformed> {
    let mut points: Vec<PointColumns> = Vec::new();
    let mut shared: Vec<(usize, PointColumns)> = Vec::new();
    let mut without_y: Vec<usize> = Vec::new();
    let mut names: BTreeMap<String, usize> = BTreeMap::new();
    // The first column of each title; a map, because a header may have very many columns.
    let columns: BTreeMap<&str, usize> = (0..header.len()).rev().map(|at| (&header[at], at)).collect();
    for (x, title) in header.iter().enumerate() {
        let Some((number, spline)) = spline_of(title) else { continue };
        if columns.get(title) != Some(&x) {
            let help = "keep one of the two columns, with its y";
            return Err(start.at_column(x + 1).error(format!("the column {title:?} is given twice"), help));
        }
        match columns.get(format!("Y{number} {spline}").as_str()) {
            None => without_y.push(x),
            Some(&y) => {
                let name = name_of(spline.trim(), number);
                let first = *names.entry(name.clone()).or_insert(points.len());
                let point = PointColumns { name, x, y };
                if first < points.len() { shared.push((first, point)) } else { points.push(point) }
            }
        }
    }
    if points.is_empty() {
        let help = "export the splines with \"X,Y values\" in a column each";
        return Err(start.error("no columns of a spline (\"X0 DLC_Tongue\", \"Y0 DLC_Tongue\", ..)", help));
    }
    Ok((points, shared, without_y))
}

/// Anatomical names for the keypoints of AAA's DeepLabCut models; other splines keep their names.
fn name_of(spline: &str, number: &str) -> String {
    match (spline, number) {
        ("DLC_Tongue", n) => format!("tongue_{n}"),
        ("DLC_HyoidMandible", "0") => "hyoid".to_owned(),
        ("DLC_ShorttendonMandible", "0") => "mental_spine".to_owned(),
        ("DLC_HyoidMandible" | "DLC_ShorttendonMandible", "1") => "mandible".to_owned(),
        (spline, n) if spline.eq_ignore_ascii_case("tongue") => format!("tongue_{n}"),
        (spline, n) => format!("{spline}_{n}"),
    }
}
