//! AAA's older exports of a spline on a fan, without a header: rows separated by tabs, one for each frame, whose last 84 fields are x and y
//! (mm) of the spline on 42 fan lines, `*` where it does not meet one. The fields before them are the user's choice, among them a time, a
//! date, a prompt, a label (rticulate, Coretta 2021, `read_aaa`).

use super::super::error::{Malformed, SourcePlace};
use super::aaa::RecordingRows;
use super::{Format, Recording, limits, numbers};

const FAN_LINES: usize = 42;
const FIELDS: usize = 2 * FAN_LINES;
const HELP: &str = "export the spline from AAA again with x and y of 42 fan lines in the last 84 columns";

pub(super) fn is_row(line: &str) -> bool {
    let cells = cells(line);
    cells.len() > FIELDS
        && cells[cells.len() - FIELDS..]
            .iter()
            .all(|c| numbers::is_missing(c) || numbers::number(c).is_some())
}

/// The fields of a line; a tab at its end adds none.
fn cells(line: &str) -> Vec<&str> {
    let line = line.trim_end_matches(['\r', '\n']);
    line.strip_suffix('\t').unwrap_or(line).split('\t').map(str::trim).collect()
}

pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Vec<Recording>, Malformed> {
    let text = limits::text(bytes, origin)?;
    let start = SourcePlace::start(origin);
    let lines = limits::lines(&text, start).map(|(at, line)| (at, cells(line)));
    let width = lines.clone().next().map_or(0, |(_, cells)| cells.len());
    if width <= FIELDS {
        return Err(start.error(format!("the line has {width} fields"), HELP));
    }
    let before = width - FIELDS;
    let columns = FanColumns::of(lines.clone().map(|(_, cells)| cells), before);
    let time = columns.time.ok_or_else(|| {
        let what = "no field before the fan is a time that grows from row to row";
        start.error(what, "export the time of the sample in the recording")
    })?;
    let mut rows = RecordingRows::new((1..=FAN_LINES).map(|n| format!("tongue_{n}")).collect(), false, false);
    for (at, cells) in lines {
        if cells.len() != width {
            let what = format!("the line has {} fields where the first has {width}", cells.len());
            return Err(at.at_column(cells.len()).error(what, "the file is cut off; export it again"));
        }
        let time_s = numbers::seconds(cells[time], at.at_column(time + 1))?;
        let places = (0..FAN_LINES)
            .map(|nth| {
                let x = before + 2 * nth;
                let [x, y] = [x, x + 1].map(|field| {
                    let what = format_args!("a coordinate of fan line {}", nth + 1);
                    numbers::value(cells[field], what, at.at_column(field + 1))
                });
                Ok(x?.zip(y?).map(|(x, y)| [x, y, 0.0]))
            })
            .collect::<Result<_, Malformed>>()?;
        let key = columns.of_recording.iter().map(|c| cells[*c].to_owned()).collect();
        rows.add(key, time_s, places, at)?;
    }
    rows.recordings(Format::AaaFan, start)
}

struct FanColumns {
    time: Option<usize>,
    of_recording: Vec<usize>,
}

impl FanColumns {
    /// The time is a number that grows while all words stay the same; words that change within one date are labels and do not identify a
    /// recording.
    fn of<'a>(rows: impl Iterator<Item = Vec<&'a str>>, before: usize) -> Self {
        let mut rows: Vec<Vec<&str>> = rows.filter(|r| r.len() >= before).collect();
        rows.iter_mut().for_each(|r| r.truncate(before));
        let (numbers, words): (Vec<usize>, Vec<usize>) =
            (0..before).partition(|c| rows.iter().all(|r| numbers::number(r[*c]).is_some()));
        let of_recording = match words.iter().find(|c| {
            rows.iter().all(|r| r[**c].contains([':', '/']) && r[**c].bytes().any(|b| b.is_ascii_digit()))
        }) {
            None => words.clone(),
            Some(&date) => words
                .iter()
                .copied()
                .filter(|c| rows.windows(2).all(|w| w[0][date] != w[1][date] || w[0][*c] == w[1][*c]))
                .collect(),
        };
        let alike = |w: &[Vec<&str>]| words.iter().all(|c| w[0][*c] == w[1][*c]);
        let time = numbers.into_iter().find(|c| {
            let value = |r: &Vec<&str>| numbers::number(r[*c]).unwrap_or(f64::NAN);
            rows.windows(2).filter(|w| alike(w)).all(|w| value(&w[0]) < value(&w[1]))
        });
        Self { time, of_recording }
    }
}
