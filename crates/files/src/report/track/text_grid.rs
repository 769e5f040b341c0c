//! The times in which the 95 % interval of a muscle's course excludes 0, as a TextGrid for Praat and EMU.

use std::io::{self, Write};

use super::RecordingResult;
use crate::report::ssff::LONGEST_STEP;
use tongue_core::statistics::median;
use tongue_infer::track::Tracked;

impl RecordingResult {
    /// Writes a tier for each muscle, with `above` or `below` over the times in which the 95 % interval of its course lies above or below 0
    /// in every frame and every frame can be trusted. Borders lie in the middle between frames. A step much longer than usual is a hole,
    /// whose borders lie half a usual step from the frames beside it. The format is that of Praat's manual, "TextGrid file formats".
    pub fn write_text_grid(&self, muscles: &[String], out: &mut dyn Write) -> io::Result<()> {
        // With one text for all frames there is one span, if there are no holes.
        let [first, last] = self.spans(|_| "").first().map_or([0.0, 1.0], |(_, ends)| *ends);
        let whole = format!("xmin = {first}\nxmax = {last}\n");
        writeln!(out, "File type = \"ooTextFile\"\nObject class = \"TextGrid\"\n\n{whole}tiers? <exists>")?;
        writeln!(out, "size = {}\nitem []:", muscles.len())?;
        for (number, muscle) in muscles.iter().enumerate() {
            let spans = self.spans(|f| match &f.courses[number] {
                _ if !f.status.is_trusted() => "",
                course if course.low > 0.0 => "above",
                course if course.high < 0.0 => "below",
                _ => "",
            });
            let name = muscle.replace('"', "\"\"");
            write!(out, "item [{}]:\nclass = \"IntervalTier\"\nname = \"{name}\"\n{whole}", number + 1)?;
            writeln!(out, "intervals: size = {}", spans.len())?;
            for (i, (word, [from_s, to_s])) in spans.iter().enumerate() {
                write!(out, "intervals [{}]:\nxmin = {from_s}\nxmax = {to_s}\n", i + 1)?;
                writeln!(out, "text = \"{word}\"")?;
            }
        }
        Ok(())
    }

    /// The whole recording in time spans, s, in which all frames have the same text; a hole has none.
    fn spans(&self, word: impl Fn(&Tracked) -> &'static str) -> Vec<(&'static str, [f64; 2])> {
        let times: Vec<f64> = self.tracked.frames.iter().map(|f| f.time_s).collect();
        let usual_s = median(times.windows(2).map(|pair| pair[1] - pair[0])).unwrap_or(0.02);
        let mut out: Vec<(&'static str, [f64; 2])> = Vec::new();
        let mut add = |word, ends: [f64; 2]| match out.last_mut() {
            Some((last, before)) if *last == word => before[1] = ends[1],
            _ if ends[0] < ends[1] => out.push((word, ends)),
            _ => {}
        };
        for (t, frame) in self.tracked.frames.iter().enumerate() {
            let neighbours = [t.checked_sub(1).map(|t| &times[t]), times.get(t + 1)];
            let [from, to] = neighbours.map(|other| match other {
                Some(other) if (other - times[t]).abs() <= LONGEST_STEP * usual_s => 0.5 * (times[t] + other),
                Some(other) => times[t] + 0.5 * usual_s * (other - times[t]).signum(),
                None => times[t],
            });
            let to = if times.len() == 1 { to + usual_s } else { to };
            add(word(frame), [from, to]);
            if let Some(next) = times.get(t + 1).filter(|next| *next - times[t] > LONGEST_STEP * usual_s) {
                add("", [to, next - 0.5 * usual_s]);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use tongue_infer::track::TrackedRecording;
    use tongue_input::measured::recording::text_grid;

    #[test]
    fn the_file_is_read_back_with_the_spans_that_are_sure() {
        let (sure, less) = ((1.0, 5.0, "converged"), (-5.0, -1.0, "converged"));
        let frames = [(-1.0, 1.0, "gap"), sure, sure, less, (1.0, 2.0, "out_of_reach"), sure, sure];
        let times = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 5.0];
        let frames: Vec<Tracked> = frames.iter().zip(times).map(|((low, high, status), time_s)| {
            let course = json!([{ "median": 0.5 * (low + high), "low": low, "high": high, "variance": 1.0 }]);
            let frame = json!({
                "time_s": time_s, "status": status, "levels": course, "courses": course, "bones": [], "rms_m": null,
                "hidden": [], "resolved": 1, "other_way": false, "positions": [], "formants": [], "faults": [],
            });
            serde_json::from_value(frame).unwrap()
        }).collect();
        let written = |muscle: &str, frames: &[Tracked]| {
            let tracked = TrackedRecording { frames: frames.to_vec(), ..TrackedRecording::default() };
            let mut bytes = Vec::new();
            let one = RecordingResult { tracked, ..RecordingResult::default() };
            one.write_text_grid(&[muscle.to_owned()], &mut bytes).unwrap();
            text_grid(&bytes, "a.TextGrid").unwrap()
        };
        let labels = written("my \"own\"", &frames);
        let read = Vec::from_iter(labels.iter().map(|l| format!("{} {:.9} {:.9}", l.name, l.from_s, l.to_s)));
        let expected =
            [("above", 0.05, 0.25), ("below", 0.25, 0.35), ("above", 0.45, 0.55), ("above", 4.95, 5.0)];
        assert_eq!(read, expected.map(|(word, from_s, to_s)| format!("{word} {from_s:.9} {to_s:.9}")));
        let label = &written("GGa", &frames[1..2])[0];
        assert!(label.from_s == 0.1 && label.to_s > 0.1, "{label:?}");
        assert_eq!(labels[0].tier, "my \"own\"");
    }
}
