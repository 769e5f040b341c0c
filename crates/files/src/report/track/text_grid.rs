//! Stretches of a recording in which a muscle surely pulls harder or less than in its mean, as a TextGrid for Praat and EMU.

use std::io::{self, Write};

use super::RecordingResult;
use tongue_infer::track::Tracked;

impl RecordingResult {
    /// A tier for each muscle, with intervals in which the 95 % interval of its course excludes 0 in every frame that can be trusted:
    /// `above` or `below` its mean over the recording. Borders lie in the middle between frames. The format is that of Praat's manual,
    /// "TextGrid file formats".
    pub fn write_text_grid(&self, muscles: &[String], out: &mut dyn Write) -> io::Result<()> {
        let times: Vec<f64> = self.frames.iter().map(|f| f.time_s).collect();
        let (from_s, to_s) = (times.first().copied().unwrap_or(0.0), times.last().copied().unwrap_or(0.0));
        let whole = format!("xmin = {from_s}\nxmax = {to_s}\n");
        writeln!(out, "File type = \"ooTextFile\"\nObject class = \"TextGrid\"\n\n{whole}tiers? <exists>")?;
        writeln!(out, "size = {}\nitem []:", muscles.len())?;
        for (number, muscle) in muscles.iter().enumerate() {
            let word = |f: &Tracked| match &f.courses[number] {
                _ if !f.status.is_trusted() => "",
                course if course.low > 0.0 => "above",
                course if course.high < 0.0 => "below",
                _ => "",
            };
            let words: Vec<&str> = self.frames.iter().map(word).collect();
            let mut borders_s = vec![from_s];
            let mut names = Vec::new();
            for same in words.chunk_by(PartialEq::eq) {
                let end = names.iter().map(|(_, count)| count).sum::<usize>() + same.len();
                borders_s.push(times.get(end).map_or(to_s, |next| 0.5 * (times[end - 1] + next)));
                names.push((same[0], same.len()));
            }
            let name = muscle.replace('"', "\"\"");
            write!(out, "item [{}]:\nclass = \"IntervalTier\"\nname = \"{name}\"\n{whole}", number + 1)?;
            writeln!(out, "intervals: size = {}", names.len())?;
            for (i, ((word, _), ends)) in names.iter().zip(borders_s.windows(2)).enumerate() {
                write!(out, "intervals [{}]:\nxmin = {}\nxmax = {}\n", i + 1, ends[0], ends[1])?;
                writeln!(out, "text = \"{word}\"")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use tongue_input::measured::recording::text_grid;

    #[test]
    fn the_file_is_read_back_with_the_stretches_that_are_sure() {
        let frame = |(i, (low, high, status)): (usize, &(f64, f64, &str))| {
            let course = json!([{ "median": 0.5 * (low + high), "low": low, "high": high, "variance": 1.0 }]);
            let frame = json!({
                "time_s": 0.1 * i as f64, "status": status, "levels": course, "courses": course, "bones": [], "rms_m": null,
                "hidden": [], "resolved": 1, "positions": [], "faults": [],
            });
            serde_json::from_value(frame).unwrap()
        };
        let (sure, less) = ((1.0, 5.0, "converged"), (-5.0, -1.0, "converged"));
        let frames = [(-1.0, 1.0, "gap"), sure, sure, less, (1.0, 2.0, "out_of_reach"), sure];
        let one = RecordingResult {
            frames: frames.iter().enumerate().map(frame).collect(),
            ..RecordingResult::default()
        };
        let mut bytes = Vec::new();
        one.write_text_grid(&["my \"own\"".to_owned()], &mut bytes).unwrap();
        let labels = text_grid(&bytes, "a.TextGrid").unwrap();
        let read: Vec<(&str, f64, f64)> =
            labels.iter().map(|l| (l.name.as_str(), l.from_s, l.to_s)).collect();
        let expected = [("above", 0.05, 0.25), ("below", 0.25, 0.35), ("above", 0.45, 0.5)];
        assert_eq!(read.len(), expected.len(), "{read:?}");
        for (found, wanted) in read.iter().zip(expected) {
            assert!(
                found.0 == wanted.0
                    && (found.1 - wanted.1).abs() < 1e-12
                    && (found.2 - wanted.2).abs() < 1e-12,
                "{read:?}"
            );
        }
        assert_eq!(labels[0].tier, "my \"own\"");
    }
}
