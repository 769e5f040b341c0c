//! Tables of numbers without a header, separated by spaces, tabs or commas: the X-ray microbeam's pellets and MOCHA's sensors as text.

use super::{
    Budget, Format, Malformed, Recording, Sample, SourcePlace, Times, is_coordinate, limits, rows, seen,
};

/// The pellets of the X-ray microbeam in the order of the columns: lips, tongue from the tip backwards, lower incisor and molar.
const PELLETS: [&str; 8] = ["UL", "LL", "T1", "T2", "T3", "T4", "MANi", "MANm"];
const MISTRACKED: f64 = 1e6;
const HELP_TXY: &str = "a .txy has 17 numbers in a line: the time in microseconds, then x and y of UL, LL, T1, T2, T3, T4, MANi, MANm";

/// Reads the X-ray microbeam's pellets (`.txy`): a line of 17 numbers for each frame: the time in microseconds, then x and y of eight
/// pellets in thousandths of a millimetre; 1000000 marks a pellet that was mistracked. x grows to the front along the occlusal plane, y
/// upwards, and the origin is the tip of the upper incisors (Westbury 1994, *X-ray microbeam speech production database user's handbook*,
/// chapters 6 and 8).
pub(super) fn read_txy(bytes: &[u8], origin: &str) -> Result<Recording, Malformed> {
    let start = SourcePlace::start(origin);
    let rows = number_rows(bytes, start, &[1 + 2 * PELLETS.len()], HELP_TXY)?;
    let samples = samples(&rows, start, HELP_TXY, |_, row| {
        let pairs = row[1..].chunks_exact(2);
        let places = pairs.map(|xy| seen([xy[0], xy[1], 0.0]).filter(|_| !xy.contains(&MISTRACKED)));
        Sample::new(row[0] * 1e-6, places.collect())
    })?;
    let names = PELLETS.iter().map(|name| (*name).to_owned());
    Ok(Recording::of_file(origin, Format::Microbeam, Some(1e-6), names, samples))
}

/// The sensors of MOCHA, with the channel of their x; y is five channels behind it.
const SENSORS: [(&str, usize); 9] =
    [("ui", 0), ("li", 1), ("ul", 2), ("ll", 3), ("tt", 4), ("tb", 10), ("td", 11), ("v", 12), ("bn", 14)];
const CHANNELS: usize = 20;
const MOCHA_HZ: f64 = 500.0;
const HELP_MOCHA: &str = "a MOCHA .ema as text has 22 numbers in a line: the time, a flag and 20 channels (or the 20 channels); other \
                          sensors go into a table recording,time_s,point,x_mm,y_mm";

/// Reads MOCHA's sensors as text (`.ema`): a line for each frame, with the time (s), a flag (0: nothing seen) and twenty channels in
/// hundredths of a millimetre, at 500 Hz; or the twenty channels alone. The order is that of MOCHA's EST files (Wrench 1999; Qin and
/// Carreira-Perpinan 2009, `MOCHAread.m`).
pub(super) fn read_mocha(bytes: &[u8], origin: &str) -> Result<Recording, Malformed> {
    let start = SourcePlace::start(origin);
    let rows = number_rows(bytes, start, &[CHANNELS + 2, CHANNELS], HELP_MOCHA)?;
    let timed = rows.first().is_some_and(|(_, first)| first.len() == CHANNELS + 2);
    let samples = samples(&rows, start, HELP_MOCHA, |n, row| {
        let (time_s, is_seen, values) =
            if timed { (row[0], row[1] != 0.0, &row[2..]) } else { (n as f64 / MOCHA_HZ, true, row) };
        let places = SENSORS.map(|(_, x)| seen([values[x], values[x + 5], 0.0]).filter(|_| is_seen));
        Sample::new(time_s, places.to_vec())
    })?;
    let names = SENSORS.map(|(name, _)| name.to_owned()).into_iter();
    let found = Recording::of_file(origin, Format::Est, Some(1e-5), names, samples);
    Ok(Recording { times: if timed { Times::InFile } else { Times::Usual(MOCHA_HZ) }, ..found })
}

/// The line and the numbers of a row; NaN where the file has NaN.
pub(super) type NumberRow = (u64, Vec<f64>);

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
pub(super) fn samples(
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
