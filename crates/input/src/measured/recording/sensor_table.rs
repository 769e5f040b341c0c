//! Tables of electromagnetic sensors with a header and a row for every frame: NDI Wave's (`.tsv`: `Wav Time`, then for each sensor its
//! number, frame, state, the quaternion `Q0` to `Qz` and the position `Tx`, `Ty`, `Tz`, as the readers of Sprouse's `ema_head_correction`
//! describe it) and Carstens AG501's exported as text (a time, then x, y, z, phi, theta of every channel). Columns of positions, mm, have
//! x, y, z or Tx, Ty, Tz before or behind the name of the sensor.

use super::map::AXES;
use super::{Budget, Format, Malformed, Recording, Sample, SourcePlace, limits, rows};

const HELP: &str = "give a header with a time and, for each sensor, x, y and z in mm (NDI Wave: Wav Time, State, Tx, Ty, Tz; AG501: Ch1_x, Ch1_y, \
                    Ch1_z), separated by tabs, semicolons or commas";

struct TableSensor {
    name: String,
    columns: [Option<usize>; 3],
    /// The column in which NDI writes OK, or why the sensor was not seen.
    state: Option<usize>,
}

struct SensorHeader {
    /// The column of the time, and its unit in seconds.
    time: Option<(usize, f64)>,
    sensors: Vec<TableSensor>,
    format: Format,
}

fn words(title: &str) -> Vec<&str> {
    let plain = title.split(['(', '[']).next().unwrap_or_default();
    plain.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).collect()
}

fn separator(line: &str) -> char {
    ['\t', ';'].into_iter().find(|c| line.contains(*c)).unwrap_or(',')
}

impl SensorHeader {
    fn of(line: &str) -> Self {
        let mut header = Self { time: None, sensors: Vec::new(), format: Format::Sensors };
        let mut state = None;
        for (column, title) in line.split(separator(line)).enumerate() {
            let words = words(title);
            let is = |word: &str| words.iter().any(|w| w.eq_ignore_ascii_case(word));
            let (Some(first), Some(last)) = (words.first(), words.last()) else { continue };
            header.format = match header.format {
                Format::Sensors if ["wav", "state", "q0", "tx"].into_iter().any(is) => Format::NdiWave,
                Format::Sensors if is("phi") || is("theta") || is_carstens_channel(first) => Format::Ag50x,
                known => known,
            };
            if is("state") || is("status") {
                state = Some(column);
            } else if is("time") || is("timestamp") {
                // Of several times, that of the sound (`Wav Time`) is taken.
                if header.time.is_none() || is("wav") {
                    let is_ms =
                        is("ms") || title.to_ascii_lowercase().contains("(ms") || title.contains("[ms");
                    header.time = Some((column, if is_ms { 1e-3 } else { 1.0 }));
                }
            } else if let Some(axis) = axis(last) {
                header.add(words[..words.len() - 1].join("_"), axis, column, &mut state);
            } else if let Some(axis) = axis(first) {
                header.add(words[1..].join("_"), axis, column, &mut state);
            }
        }
        header
    }

    /// Adds the column of a coordinate; sensors without names are numbered.
    fn add(&mut self, name: String, axis: usize, column: usize, state: &mut Option<usize>) {
        let lower = name.to_ascii_lowercase();
        let number = ["sensor", "channel", "ch", ""]
            .into_iter()
            .find_map(|stem| lower.strip_prefix(stem)?.trim_start_matches('_').parse::<usize>().ok());
        let name = match number {
            Some(number) if !lower.is_empty() => format!("sensor_{number}"),
            _ if lower.is_empty() || lower == "sensor" => {
                let known = self.sensors.len();
                let is_next = self.sensors.last().is_none_or(|s| s.columns[axis].is_some());
                format!("sensor_{}", if is_next { known + 1 } else { known })
            }
            _ => name,
        };
        if self.sensors.iter().all(|s| s.name != name) {
            self.sensors.push(TableSensor { name: name.clone(), columns: [None; 3], state: state.take() });
        }
        let sensor = self.sensors.iter_mut().find(|s| s.name == name);
        sensor.into_iter().for_each(|s| s.columns[axis] = s.columns[axis].or(Some(column)));
    }
}

fn is_carstens_channel(name: &str) -> bool {
    let number = name.to_ascii_lowercase();
    let number = number.strip_prefix("ch").map(|n| n.strip_prefix("annel").unwrap_or(n));
    number.is_some_and(|n| n.parse::<u32>().is_ok())
}

fn axis(word: &str) -> Option<usize> {
    let word = word.to_ascii_lowercase();
    AXES.iter().position(|axis| *axis == word.strip_prefix('t').unwrap_or(&word))
}

/// Whether a line has a time and the three coordinates of at least two sensors.
pub(super) fn is_head(line: &str) -> bool {
    let header = SensorHeader::of(line);
    let whole = header.sensors.iter().filter(|s| s.columns.iter().all(Option::is_some)).count();
    header.time.is_some() && whole >= 2
}

pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Recording, Malformed> {
    let text = limits::text(bytes, origin)?;
    let start = SourcePlace::start(origin);
    let title = text.lines().next().unwrap_or_default();
    let separator = separator(title);
    let SensorHeader { time, mut sensors, format } = SensorHeader::of(title);
    sensors.retain(|s| s.columns.iter().all(Option::is_some));
    let Some((time, unit_s)) = time else { return Err(start.error("no column is called time", HELP)) };
    if sensors.is_empty() {
        return Err(start.error("no sensor has columns of x, y and z", HELP));
    }
    let last_field = 1 + sensors.iter().flat_map(|s| s.columns).flatten().max().unwrap_or(0);
    let last_line = if text.ends_with('\n') { 0 } else { text.lines().count() as u64 };
    let mut samples: Vec<Sample> = Vec::new();
    let mut budget = Budget::default();
    let rows = rows::split(&text, start, |line| line.split(separator).map(str::trim));
    for row in rows.filter(|row| row.at.line > 1) {
        let width = row.cells.len();
        if width < last_field && row.at.line == last_line {
            let what = format!("the line has {width} fields where positions end in field {last_field}");
            return Err(row.at.at_column(width).error(what, "the file is cut off; export it again"));
        }
        let time_s = row.seconds(time)? * unit_s;
        if let Some(last) = samples.last().map(|s| s.time_s).filter(|last| *last >= time_s) {
            let what = format!("the time {time_s} s comes after {last} s");
            let help = "times must ascend from row to row; export the table again";
            return Err(row.place(time).error(what, help));
        }
        budget.frame(samples.len() + 1, sensors.len(), row.at)?;
        let places = sensors.iter().map(|sensor: &TableSensor| -> Result<Option<[f64; 3]>, Malformed> {
            let state = sensor.state.map(|field| row.cell(field)).filter(|s| s.contains(char::is_alphabetic));
            let is_bad = state.is_some_and(|s| !s.eq_ignore_ascii_case("ok"));
            let mut place = [0.0; 3];
            for (value, column) in place.iter_mut().zip(sensor.columns.iter().flatten()) {
                // For a sensor that was not seen NDI writes -3.7e28, other systems NaN.
                if is_bad || row.cell(*column).parse::<f64>().is_ok_and(|v| !super::is_coordinate(v)) {
                    return Ok(None);
                }
                let number = row.number(*column, format_args!("a coordinate of {}", sensor.name))?;
                let Some(number) = number else { return Ok(None) };
                *value = number;
            }
            Ok(Some(place).filter(|p| *p != [0.0; 3]))
        });
        let places = places.collect::<Result<_, _>>()?;
        samples.push(Sample::new(time_s, places));
    }
    Ok(Recording::of_file(origin, format, Some(1e-3), sensors.into_iter().map(|s| s.name), samples))
}
