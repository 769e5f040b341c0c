//! The X-ray microbeam's pellets (`.txy`): a line of 17 numbers for each frame without a header: the time in microseconds, then x and y of
//! eight pellets in thousandths of a millimetre; 1000000 marks a pellet that was mistracked. x grows to the front along the occlusal plane,
//! y upwards, and the origin is the tip of the upper incisors (Westbury 1994, *X-ray microbeam speech production database user's handbook*,
//! chapters 6 and 8).

use super::super::error::{Malformed, SourcePlace};
use super::{Format, Recording, Sample, is_coordinate, numbers};

/// The pellets in the order of the columns: lips, tongue from the tip backwards, lower incisor and molar.
const PELLETS: [&str; 8] = ["UL", "LL", "T1", "T2", "T3", "T4", "MANi", "MANm"];
const MISSING: f64 = 1e6;
const HELP: &str = "a .txy has 17 numbers in a line: the time in microseconds, then x and y of UL, LL, T1, T2, T3, T4, MANi, MANm";

pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Recording, Malformed> {
    let start = SourcePlace::start(origin);
    let rows = numbers::number_rows(bytes, start, &[1 + 2 * PELLETS.len()], HELP)?;
    let samples = numbers::samples(&rows, start, HELP, |_, row| {
        let places = row[1..].chunks_exact(2).map(|pair| {
            let seen = pair.iter().all(|v| *v != MISSING && is_coordinate(*v));
            seen.then_some([pair[0], pair[1], 0.0])
        });
        Sample::new(row[0] * 1e-6, places.collect())
    })?;
    let names = PELLETS.iter().map(|name| (*name).to_owned());
    Ok(Recording::of_file(origin, Format::Microbeam, Some(1e-6), names, samples))
}
