//! MOCHA's sensors as plain text (`.ema`): a line for each frame without a header, with the time (s), a flag (0: nothing seen) and twenty
//! channels in hundredths of a millimetre, at 500 Hz; or the twenty channels alone. The order is that of MOCHA's EST files (Wrench 1999;
//! Qin and Carreira-Perpinan 2009, `MOCHAread.m`).

use super::super::error::{Malformed, SourcePlace};
use super::{Format, Recording, Sample, Times, numbers, seen};

/// The sensors, with the channels of their x and y.
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
const HELP: &str = "a MOCHA .ema as text has 22 numbers in a line: the time, a flag and 20 channels (or the 20 channels); other \
                    sensors go into a table recording,time_s,point,x_mm,y_mm";

pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Recording, Malformed> {
    let start = SourcePlace::start(origin);
    let rows = numbers::number_rows(bytes, start, &[CHANNELS + 2, CHANNELS], HELP)?;
    let timed = rows.first().is_some_and(|(_, first)| first.len() == CHANNELS + 2);
    let samples = numbers::samples(&rows, start, HELP, |n, row| {
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
