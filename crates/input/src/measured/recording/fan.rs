//! AAA's older exports of a spline on a fan, without a header: rows separated by tabs, one for each frame, whose last 84 fields are x and y
//! (mm) of the spline on 42 fan lines, `*` where it does not meet one. The fields before them are the user's choice, among them a time, a
//! date, a prompt, a label (rticulate, Coretta 2021, `read_aaa`).

use super::aaa::RecordingRows;
use super::{Format, Malformed, Recording, SourcePlace, TableLine, limits, rows};

const FAN_LINES: usize = 42;
const FIELDS: usize = 2 * FAN_LINES;
const HELP: &str = "export the spline from AAA again with x and y of 42 fan lines in the last 84 columns";

pub(super) fn is_row(line: &str) -> bool {
    let cells: Vec<&str> = cells(line).collect();
    cells.len() > FIELDS
        && cells[cells.len() - FIELDS..].iter().all(|c| rows::is_missing(c) || rows::number(c).is_some())
}

/// The fields of a line; a tab at its end adds none.
fn cells(line: &str) -> impl Iterator<Item = &str> {
    let line = line.trim_end_matches(['\r', '\n']);
    line.strip_suffix('\t').unwrap_or(line).split('\t').map(str::trim)
}

pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Vec<Recording>, Malformed> {
    let text = limits::text(bytes, origin)?;
    let start = SourcePlace::start(origin);
    let table: Vec<TableLine<'_>> = rows::split(&text, start, cells).collect();
    let width = table.first().map_or(0, |row| row.cells.len());
    if width <= FIELDS {
        return Err(start.error(format!("the line has {width} fields"), HELP));
    }
    if let Some(row) = table.iter().find(|row| row.cells.len() != width) {
        let fields = row.cells.len();
        let what = format!("the line has {fields} fields where the first has {width}");
        return Err(row.at.at_column(fields).error(what, "the file is cut off; export it again"));
    }
    let before = width - FIELDS;
    let (time, of_recording) = columns(&table, before);
    let time = time.ok_or_else(|| {
        let what = "no field before the fan is a time that grows from row to row";
        start.error(what, "export the time of the sample in the recording")
    })?;
    let channels = (1..=FAN_LINES).map(|n| format!("tongue_{n}")).collect();
    let mut recordings = RecordingRows::new(channels);
    for row in &table {
        let time_s = row.seconds(time)?;
        let places = (0..FAN_LINES).map(|nth| {
            let x = before + 2 * nth;
            row.point([x, x + 1], format_args!("a coordinate of fan line {}", nth + 1))
        });
        let places = places.collect::<Result<_, _>>()?;
        let key = of_recording.iter().map(|field| row.cell(*field).to_owned()).collect();
        recordings.add(key, time_s, places, row.at)?;
    }
    recordings.recordings(Format::AaaFan, start)
}

/// The columns of the time and of what identifies a recording, of the `before` columns before the fan. The time is a number that grows while
/// all words stay the same; words that change within one date are labels and do not identify a recording.
fn columns(table: &[TableLine<'_>], before: usize) -> (Option<usize>, Vec<usize>) {
    let (numbers, words): (Vec<usize>, Vec<usize>) =
        (0..before).partition(|c| table.iter().all(|row| rows::number(row.cell(*c)).is_some()));
    let of_recording = match words.iter().find(|c| table.iter().all(|row| is_date(row.cell(**c)))) {
        None => words.clone(),
        Some(&date) => words
            .iter()
            .copied()
            .filter(|c| table.windows(2).all(|w| !is_alike(w, &[date]) || is_alike(w, &[*c])))
            .collect(),
    };
    let time = numbers.into_iter().find(|c| {
        let of_one_recording = table.windows(2).filter(|w| is_alike(w, &words));
        let mut times = of_one_recording.map(|w| [&w[0], &w[1]].map(|row| rows::number(row.cell(*c))));
        times.all(|[before, after]| before < after)
    });
    (time, of_recording)
}

fn is_date(text: &str) -> bool {
    text.contains([':', '/']) && text.bytes().any(|b| b.is_ascii_digit())
}

/// Whether two successive rows have the same text in these columns.
fn is_alike(pair: &[TableLine<'_>], columns: &[usize]) -> bool {
    columns.iter().all(|&c| pair[0].cell(c) == pair[1].cell(c))
}
