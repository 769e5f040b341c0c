//! Carstens AG500 and AG501 positions (`.pos`): a header of text lines, of which the second has its size, then frames of seven
//! little-endian 32-bit floats for each sensor: x, y, z (mm), phi, theta (degrees), rms, extra. After Praat's reader (Weenink 2023,
//! `EMA.cpp`) and the manufacturer's manual. Files of the AG500 without a header have twelve sensors at 200 Hz (the manufacturer's
//! `loaddata.m`).

use super::limits::{LARGEST_HEADER, RATES_HZ};
use super::{Budget, Format, Malformed, Recording, Sample, SourcePlace, Times, seen};

const VALUES: usize = 7;
/// Number of sensors and rate (Hz) of a file without a header.
const AG500: (usize, f64) = (12, 200.0);
/// Larger coordinates, mm, show that a file without a header has another format.
const FARTHEST_MM: f64 = 1e4;

/// The size of the header, the number of sensors, the rate, Hz, and whether the file gives it.
fn layout(bytes: &[u8], start: SourcePlace<'_>) -> Result<(usize, usize, f64, Times), Malformed> {
    let head = &bytes[..bytes.len().min(LARGEST_HEADER)];
    let mut lines = head.split(|b| *b == b'\n').map(|l| String::from_utf8_lossy(l).trim().to_owned());
    let version = lines.next().unwrap_or_default();
    if !matches!(version.as_str(), "AG50xDATA_V001" | "AG50xDATA_V002" | "AG50xDATA_V003") {
        if is_headerless(bytes) {
            let (sensors, rate) = AG500;
            return Ok((0, sensors, rate, Times::Usual(rate)));
        }
        let help = "give head-corrected positions of an AG500 or AG501 (.pos), versions V001 to V003, or of an AG500 without a \
                    header (12 sensors)";
        return Err(start.error("the first line is not AG50xDATA_V001, V002 or V003", help));
    }
    let text = lines.next().unwrap_or_default();
    let size = text.parse::<usize>().ok().filter(|s| (24..=head.len()).contains(s));
    let size = size.ok_or_else(|| {
        let what = format!("the size of the header is {text:?}");
        SourcePlace { line: 2, ..start }.error(what, "the file is cut off or not a .pos; copy it again")
    })?;
    let header = String::from_utf8_lossy(&bytes[..size]).into_owned();
    let value = |key: &str| {
        let found = header.lines().enumerate().find_map(|(n, l)| Some((n, l.trim().strip_prefix(key)?)));
        let (n, text) = found.ok_or_else(|| start.error(format!("no line {key}"), "copy the file again"))?;
        let number = text.trim().parse::<f64>().ok().filter(|v| v.is_finite() && *v > 0.0);
        let at = SourcePlace { line: n as u64 + 1, ..start };
        number.ok_or_else(|| at.error(format!("{key}{text} is not a positive number"), "copy the file again"))
    };
    let sensors = value("NumberOfChannels=")? as usize;
    let rate = value("SamplingFrequencyHz=")?;
    if !RATES_HZ.contains(&rate) {
        let help = format!("it must be from {} to {} Hz", RATES_HZ.start(), RATES_HZ.end());
        return Err(start.error(format!("SamplingFrequencyHz is {rate:e}"), help));
    }
    Ok((size, sensors, rate, Times::InFile))
}

/// Whether the size of the file and every position are plausible for twelve sensors.
fn is_headerless(bytes: &[u8]) -> bool {
    let is_place = |v: f64| v.is_nan() || (v.abs() <= FARTHEST_MM && (v == 0.0 || v.abs() > 1e-12));
    let is_whole = !bytes.is_empty() && bytes.len().is_multiple_of(AG500.0 * VALUES * 4);
    is_whole && bytes.chunks_exact(VALUES * 4).flat_map(place).all(is_place)
}

fn place(sensor: &[u8]) -> [f64; 3] {
    [0, 4, 8].map(|i| f64::from(f32::from_le_bytes(sensor[i..i + 4].try_into().unwrap_or_default())))
}

pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Recording, Malformed> {
    let start = SourcePlace::start(origin);
    let (size, sensors, rate, times) = layout(bytes, start)?;
    let frame = sensors.saturating_mul(VALUES * 4).max(1);
    let frames = (bytes.len() - size) / frame;
    Budget::default().add_recording(frames, sensors, start)?;
    if !(bytes.len() - size).is_multiple_of(frame) {
        let at = SourcePlace { line: 1, column: size + frames * frame + 1, ..start };
        let what = format!("the last frame is cut off (byte {})", at.column);
        return Err(at.error(what, format!("a frame has {frame} bytes; copy the file again")));
    }
    let samples = bytes[size..].chunks_exact(frame).enumerate().map(|(n, frame)| {
        // A sensor that was not connected or not found has zeros or NaN.
        let sensors = frame.chunks_exact(VALUES * 4);
        let places = sensors.map(|sensor| seen(place(sensor)).filter(|place| *place != [0.0; 3]));
        Sample::new(n as f64 / rate, places.collect())
    });
    let names = (1..=sensors).map(|n| format!("sensor_{n}"));
    let found = Recording::of_file(origin, Format::Ag50x, Some(1e-3), names, samples.collect());
    Ok(Recording { times, ..found })
}
