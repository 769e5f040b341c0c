//! Tables of numbers without a header, separated by spaces, tabs or commas: MOCHA's sensors and the X-ray microbeam's pellets. Last numbers
//! that are cut off.

use super::super::error::{Malformed, SourcePlace};
use super::limits::{self, Budget};
use super::{Format, Recording, Sample, Times, is_coordinate, rows, seen};

/// The last number of a text that has no line end behind it, and the last numbers of the lines above; each with its number of decimals.
pub(super) struct LastNumber<'a> {
    cell: &'a str,
    value: (f64, usize),
    above: Vec<(f64, usize)>,
}

impl<'a> LastNumber<'a> {
    pub fn of(text: &'a str) -> Option<Self> {
        let (above, last) = text.rsplit_once('\n')?;
        let between = ['\t', ';', ','].into_iter().find(|c| last.contains(*c)).unwrap_or(' ');
        let cell = |line: &'a str| line.rsplit(between).next().unwrap_or_default().trim();
        let number = |line: &'a str| -> Option<(f64, usize)> {
            let cell = cell(line).replace(',', ".");
            Some((cell.parse().ok()?, cell.split_once('.').map_or(0, |(_, decimals)| decimals.len())))
        };
        Some(Self {
            cell: cell(last),
            value: number(last)?,
            above: above.lines().filter_map(number).collect(),
        })
    }

    /// Whether it has fewer decimals than every number above it.
    pub fn is_short(&self) -> bool {
        self.above.iter().map(|(_, decimals)| *decimals).min() > Some(self.value.1)
    }
}

/// A note if a text file seems to be cut off: it ends without a line end in a number that has fewer digits than those above it in the same
/// column.
pub(super) fn truncation_note(bytes: &[u8]) -> Option<String> {
    const TAIL: usize = 1 << 16;
    const FEWEST_LINES: usize = 5;
    // Text in UTF-16 has NUL bytes.
    let tail: Vec<u8> =
        bytes[bytes.len().saturating_sub(TAIL)..].iter().copied().filter(|b| *b != 0).collect();
    let text = String::from_utf8_lossy(&tail);
    let last = LastNumber::of(&text).filter(|last| last.above.len() >= FEWEST_LINES)?;
    let LastNumber { cell, value: (value, decimals), above } = &last;
    let most = above.iter().map(|o| o.1).max()?;
    let usual = (0..=most).max_by_key(|n| above.iter().filter(|o| o.1 == *n).count())?;
    let is_cut = match usual {
        0 => *value != 0.0 && above.iter().all(|o| o.0.abs() > 5.0 * value.abs()),
        _ => last.is_short() || decimals + 2 <= usual,
    };
    is_cut.then(|| {
        format!("the file ends without a line end in a number, {cell}, that is shorter than those above it: it may be cut off; export it again")
    })
}

/// The line and the numbers of a row; NaN where the file has NaN.
type NumberRow = (u64, Vec<f64>);

/// Reads a table that begins at `start` and has the same number of values in every line; `widths` are the allowed numbers, and `help` is the
/// advice for other lines. A first line without numbers is a header and is skipped.
pub(super) fn number_rows(
    bytes: &[u8],
    start: SourcePlace<'_>,
    widths: &[usize],
    help: &str,
) -> Result<Vec<NumberRow>, Malformed> {
    let mut budget = Budget::default();
    let text = limits::text(bytes, start.origin)?;
    let mut out: Vec<NumberRow> = Vec::new();
    for row in rows::split(&text, start, rows::words) {
        if row.at.line == start.line && row.cells.iter().all(|c| c.parse::<f64>().is_err()) {
            continue;
        }
        let mut values = Vec::with_capacity(row.cells.len());
        for (field, cell) in row.cells.iter().enumerate() {
            let wrong = |_| row.place(field).error(format!("{cell:?} is not a number"), help);
            values.push(cell.parse::<f64>().map_err(wrong)?);
        }
        let width = values.len();
        let first = out.first().map(|(_, first)| [first.len()]);
        let wanted = first.as_ref().map_or(widths, |first| first);
        if !wanted.contains(&width) {
            let wanted = wanted.iter().map(usize::to_string).collect::<Vec<_>>().join(" or ");
            let what = format!("the line has {width} numbers where {wanted} are needed");
            return Err(row.at.at_column(width.max(1)).error(what, help));
        }
        out.push((row.at.line, values));
        budget.frame(out.len(), width, row.at)?;
    }
    Ok(out)
}

/// The samples that `read` makes of the number and the values of each row. Their times must ascend.
fn samples(
    rows: &[NumberRow],
    start: SourcePlace<'_>,
    help: &str,
    read: impl Fn(usize, &[f64]) -> Sample,
) -> Result<Vec<Sample>, Malformed> {
    let mut samples: Vec<Sample> = Vec::with_capacity(rows.len());
    for (line, row) in rows {
        let sample = read(samples.len(), row);
        let time_s = sample.time_s;
        if !is_coordinate(time_s) || samples.last().is_some_and(|last| last.time_s >= time_s) {
            let what = format!("the time {time_s} s does not come after that of the line before");
            return Err(SourcePlace { line: *line, ..start }.error(what, help));
        }
        samples.push(sample);
    }
    Ok(samples)
}

/// The sensors of MOCHA, with the channels of their x and y.
const SENSORS: [(&str, usize, usize); 9] = [
    ("ui", 0, 5),
    ("li", 1, 6),
    ("ul", 2, 7),
    ("ll", 3, 8),
    ("tt", 4, 9),
    ("tb", 10, 15),
    ("td", 11, 16),
    ("v", 12, 17),
    ("bn", 14, 19),
];
const CHANNELS: usize = 20;
const RATE_HZ: f64 = 500.0;

/// Reads MOCHA's sensors as plain text (`.ema`): a line for each frame, with the time (s), a flag (0: nothing seen) and twenty channels in
/// hundredths of a millimetre, at 500 Hz; or the twenty channels alone. The order is that of MOCHA's EST files (Wrench 1999; Qin and
/// Carreira-Perpinan 2009, `MOCHAread.m`).
pub(super) fn mocha(bytes: &[u8], origin: &str) -> Result<Recording, Malformed> {
    const HELP: &str = "a MOCHA .ema as text has 22 numbers in a line: the time, a flag and 20 channels (or the 20 channels); other \
                        sensors go into a table recording,time_s,point,x_mm,y_mm";
    let start = SourcePlace::start(origin);
    let rows = number_rows(bytes, start, &[CHANNELS + 2, CHANNELS], HELP)?;
    let timed = rows.first().is_some_and(|(_, first)| first.len() == CHANNELS + 2);
    let samples = samples(&rows, start, HELP, |n, row| {
        let (time_s, is_seen, values) =
            if timed { (row[0], row[1] != 0.0, &row[2..]) } else { (n as f64 / RATE_HZ, true, row) };
        let places =
            SENSORS.iter().map(|&(_, x, y)| is_seen.then(|| seen([values[x], values[y], 0.0])).flatten());
        Sample::new(time_s, places.collect())
    })?;
    let names = SENSORS.iter().map(|(name, ..)| (*name).to_owned());
    let found = Recording::of_file(origin, Format::Est, Some(1e-5), names, samples);
    Ok(Recording { times: if timed { Times::InFile } else { Times::Usual(RATE_HZ) }, ..found })
}

/// The pellets of the X-ray microbeam in the order of the columns: lips, tongue from the tip backwards, lower incisor and molar.
const PELLETS: [&str; 8] = ["UL", "LL", "T1", "T2", "T3", "T4", "MANi", "MANm"];
const MISTRACKED: f64 = 1e6;

/// Reads the X-ray microbeam's pellets (`.txy`): a line of 17 numbers for each frame: the time in microseconds, then x and y of eight pellets
/// in thousandths of a millimetre; 1000000 marks a pellet that was mistracked. x grows to the front along the occlusal plane, y upwards, and
/// the origin is the tip of the upper incisors (Westbury 1994, *X-ray microbeam speech production database user's handbook*, chapters 6 and
/// 8).
pub(super) fn microbeam(bytes: &[u8], origin: &str) -> Result<Recording, Malformed> {
    const HELP: &str = "a .txy has 17 numbers in a line: the time in microseconds, then x and y of UL, LL, T1, T2, T3, T4, MANi, MANm";
    let start = SourcePlace::start(origin);
    let rows = number_rows(bytes, start, &[1 + 2 * PELLETS.len()], HELP)?;
    let samples = samples(&rows, start, HELP, |_, row| {
        let places = row[1..].chunks_exact(2).map(|pair| {
            let is_tracked = pair.iter().all(|v| *v != MISTRACKED);
            seen([pair[0], pair[1], 0.0]).filter(|_| is_tracked)
        });
        Sample::new(row[0] * 1e-6, places.collect())
    })?;
    let names = PELLETS.iter().map(|name| (*name).to_owned());
    Ok(Recording::of_file(origin, Format::Microbeam, Some(1e-6), names, samples))
}
