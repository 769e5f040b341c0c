//! The X-ray microbeam's pellets (`.txy`): one line of 17 numbers for each frame without a header: the time
//! in microseconds, then x and y of eight pellets in thousandths of a millimetre; 1000000 marks a pellet that
//! was mistracked. x grows to the front along the occlusal plane, y upwards, and the origin is the tip of the
//! upper incisors (Westbury 1994, *X-ray microbeam speech production database user's handbook*, chapters 6
//! and 8).

use super::super::lengths::Malformed;
use super::super::lengths::error::Place;
use super::numbers::Numbers;
use super::{Budget, Format, Recording, Sample, Times, is_coordinate};

/// The pellets in the order of the columns: lips, tongue from the tip backwards, lower incisor and molar.
const PELLETS: [&str; 8] = ["UL", "LL", "T1", "T2", "T3", "T4", "MANi", "MANm"];
const MISSING: f64 = 1e6;
const HELP: &str = "a .txy has 17 numbers in a line: the time in microseconds, then x and y of UL, LL, T1, T2, T3, T4, MANi, MANm";

pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Recording, Malformed> {
    let table = Numbers::read(bytes, origin, &[1 + 2 * PELLETS.len()], HELP, &mut Budget::default())?;
    let mut samples: Vec<Sample> = Vec::new();
    for (line, row) in table.rows() {
        let time_s = row[0] * 1e-6;
        if !is_coordinate(time_s) || samples.last().is_some_and(|last| last.time_s >= time_s) {
            let at = Place { origin, line, column: 1 };
            let what = format!("the time {} does not come after that of the line before", row[0]);
            return Err(at.error(what, HELP));
        }
        let place = |pair: &[f64]| {
            let seen = pair.iter().all(|v| v.is_finite() && *v != MISSING && is_coordinate(*v));
            seen.then_some([pair[0], pair[1], 0.0])
        };
        samples.push(Sample::new(time_s, row[1..].chunks_exact(2).map(place).collect()));
    }
    Ok(Recording {
        labels: Vec::new(),
        notes: Vec::new(),
        name: Recording::stem(origin),
        speaker: None,
        channels: PELLETS.map(str::to_owned).to_vec(),
        sigma: vec![None; PELLETS.len()],
        samples,
        metres: Some(1e-6),
        times: Times::InFile,
        format: Format::Microbeam,
    })
}
