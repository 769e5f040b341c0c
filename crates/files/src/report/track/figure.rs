//! Figures of a recording: packed numbers that the page's script draws, and files.

use std::collections::BTreeSet;
use std::io;

use serde::Serialize;
use serde_json::{Value, json};

use super::{ENDS, RecordingResult, TrackRecord, TrackResults};
use crate::report::svg::colours;
use crate::report::{AnimationFrame, Export, Provenance, ReportError, Svg, Vtu, animation};
use tongue_core::body::Mesh;
use tongue_core::geometry::Point;
use tongue_infer::track::{Interval, Tracked};
use tongue_input::measured::recording::{AlignedRecording, Waveform};

const MOST_FRAMES: usize = 2000;
const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
/// The largest code of a packed number; the next one marks a missing number.
const LARGEST: f64 = 4094.0;

/// Numbers in a range, each in two characters: the ends of the range, and the text.
#[derive(Serialize)]
struct Packed(f64, f64, String);

impl Packed {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let values: Vec<f64> = values.collect();
        let finite = values.iter().copied().filter(|v| v.is_finite());
        let (low, high) =
            (finite.clone().fold(f64::INFINITY, f64::min), finite.fold(f64::NEG_INFINITY, f64::max));
        let span = (high - low).max(f64::MIN_POSITIVE);
        let digits = values.iter().flat_map(|v| {
            let part = ((v - low) / span * LARGEST).round();
            let code = if v.is_finite() { part as usize } else { LARGEST as usize + 1 };
            [code / 64, code % 64].map(|digit| char::from(DIGITS[digit]))
        });
        let text = digits.collect();
        // Four decimals are enough for a figure.
        let [low, high] =
            if low > high { [0.0; 2] } else { [low, high].map(|end| (end * 1e4).round() / 1e4) };
        Self(low, high, text)
    }

    /// Coordinates in mm, x and y in turn.
    fn of_points(points: impl Iterator<Item = Option<Point>>) -> Self {
        Self::of(points.flat_map(|p| p.map_or([f64::NAN; 2], |p| [1e3 * p.x, 1e3 * p.y])))
    }
}

fn drawn_nodes(mesh: &Mesh<2>) -> Vec<usize> {
    let lines = mesh.muscles.iter().flat_map(|m| m.nodes.iter().copied());
    let nodes: BTreeSet<usize> = lines.chain(mesh.outlines().concat()).chain(mesh.fixed.clone()).collect();
    nodes.into_iter().collect()
}

/// The body in the figures of all recordings. Nodes are indices of the drawn ones; `number` is the index of a contracting muscle.
pub(super) fn body_of_figures(record: &TrackRecord) -> Value {
    let TrackResults { body, contracting, palate, .. } = &record.results;
    let mesh = &body.mesh;
    let drawn = drawn_nodes(mesh);
    let places =
        |nodes: &[usize]| nodes.iter().filter_map(|n| drawn.binary_search(n).ok()).collect::<Vec<usize>>();
    let lines =
        mesh.muscles.iter().zip(colours(&mesh.muscle_names())).enumerate().map(|(i, (muscle, colour))| {
            let number = contracting.iter().position(|m| *m == i);
            json!({ "name": muscle.name, "colour": colour, "number": number, "nodes": places(&muscle.nodes) })
        });
    json!({
        "muscles": record.courses.iter().map(|c| (&c.muscle, c.known)).collect::<Vec<_>>(),
        "outlines": mesh.outlines().iter().map(|nodes| places(nodes)).collect::<Vec<_>>(),
        "lines": lines.collect::<Vec<_>>(),
        "bones": places(&mesh.fixed),
        "palate": Packed::of_points(palate.iter().copied().map(Some)),
    })
}

/// The figure of a recording. `doubtful` has a character for each frame, 1 where it cannot be trusted; `courses` and `tensions` have median
/// and ends of the interval for every muscle; times, tensions, nodes and measured points are those of the frames that are shown.
pub(super) fn figure(results: &TrackResults, one: &RecordingResult) -> Value {
    let frames: Vec<&Tracked> =
        one.tracked.frames.iter().step_by(one.tracked.frames.len().div_ceil(MOST_FRAMES).max(1)).collect();
    let shown = || one.tracked.frames.iter().filter(|f| !f.positions.is_empty());
    let of = |values: fn(&Tracked) -> &[Interval]| -> Vec<[Packed; 3]> {
        (0..results.muscles.len())
            .map(|i| ENDS.map(|end| Packed::of(frames.iter().map(|f| end(&values(f)[i])))))
            .collect()
    };
    let drawn = drawn_nodes(&results.body.mesh);
    let nodes = shown().flat_map(|f| drawn.iter().map(|n| f.positions.get(*n).copied()));
    json!({
        "times": Packed::of(frames.iter().map(|f| f.time_s)),
        "doubtful": frames.iter().map(|f| if f.status.is_trusted() { '0' } else { '1' }).collect::<String>(),
        "rms_mm": Packed::of(frames.iter().map(|f| f.rms_m.map_or(f64::NAN, |r| r * 1e3))),
        "labels": one.shown_labels().into_iter().map(|l| (l.from_s, l.to_s, &l.name)).collect::<Vec<_>>(),
        "sound": one.sound.as_ref().and_then(|sound| drawn_sound(sound, &frames)),
        "courses": of(|f| &f.courses),
        "tensions": of(|f| &f.tensions),
        "mirrored": one.seen.mirrored,
        "shown": Packed::of(shown().map(|f| f.time_s)),
        "shown_tensions": Packed::of(shown().flat_map(Tracked::tensions_n)),
        "nodes": Packed::of_points(nodes),
        "rest": Packed::of_points(drawn.iter().map(|n| one.tracked.rest.get(*n).copied())),
        "marks": Packed::of_points(one.marks().flatten()),
    })
}

/// The sound between the first and the last frame: beginning and width of a bin, s, and smallest and largest sample of each bin.
fn drawn_sound(sound: &Waveform, frames: &[&Tracked]) -> Option<(f64, f64, [Packed; 2])> {
    const MOST_BINS: usize = 2000;
    let [from_s, to_s] = [frames.first()?, frames.last()?].map(|f| f.time_s);
    let [first, last] =
        [from_s, to_s].map(|time_s| ((time_s / Waveform::BIN_S).max(0.0) as usize).min(sound.ends.len()));
    let together = (last - first).div_ceil(MOST_BINS).max(1);
    let bins: Vec<[f64; 2]> = sound.ends[first..last].chunks(together).map(Waveform::ends_of).collect();
    let packed = [0, 1].map(|end| Packed::of(bins.iter().map(|ends| ends[end])));
    (!bins.is_empty()).then_some((first as f64 * Waveform::BIN_S, together as f64 * Waveform::BIN_S, packed))
}

impl TrackResults {
    fn mesh(&self, one: &RecordingResult) -> Mesh<2> {
        Mesh { nodes: one.tracked.rest.clone(), ..self.body.mesh.clone() }
    }

    fn shape(&self, frame: &Tracked) -> AnimationFrame {
        let mut tensions = vec![0.0; self.body.mesh.muscles.len()];
        for (muscle, tension) in self.contracting.iter().zip(frame.tensions_n()) {
            tensions[*muscle] = tension;
        }
        AnimationFrame { time: frame.time_s, positions: frame.positions.clone(), tensions }
    }

    pub fn animation(&self, one: &RecordingResult) -> Result<Svg, ReportError> {
        let shown = one.tracked.frames.iter().filter(|f| !f.positions.is_empty());
        let shapes: Vec<AnimationFrame> = shown.map(|f| self.shape(f)).collect();
        let marks: Vec<Vec<Point>> =
            one.marks().map(|points| points.into_iter().flatten().collect()).collect();
        let AlignedRecording { name, mirrored, .. } = &one.seen;
        let title =
            format!("{name}: measured (dots) and simulated; muscles coloured by tension, with their largest");
        animation(&self.mesh(one), &self.palate, &shapes, &marks, *mirrored, &title)
    }

    pub fn vtu(&self, one: &RecordingResult, frame: &Tracked) -> impl Export {
        move |out: &mut dyn io::Write, by: &Provenance| {
            let (mesh, shape) = (self.mesh(one), self.shape(frame));
            let vtu = Vtu::new(&mesh, &shape.positions, &shape.tensions).map_err(io::Error::other)?;
            vtu.write(out, by)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_numbers_are_as_near_as_their_range_allows_and_missing_ones_are_marked() {
        let values = [-3.5, 0.0, f64::NAN, 60.25, 12.0];
        let Packed(low, high, text) = Packed::of(values.into_iter());
        let digit = |c: u8| DIGITS.iter().position(|d| *d == c).unwrap() as f64;
        let codes: Vec<f64> =
            text.as_bytes().chunks(2).map(|pair| 64.0 * digit(pair[0]) + digit(pair[1])).collect();
        assert_eq!(codes.len(), values.len());
        for (code, value) in codes.iter().zip(values) {
            let back = low + (high - low) * code / LARGEST;
            assert_eq!(*code > LARGEST, value.is_nan());
            assert!(value.is_nan() || (back - value).abs() < 0.01, "{back} {value}");
        }
        let Packed(low, high, text) = Packed::of([f64::NAN].into_iter());
        assert_eq!((low, high, text.as_str()), (0.0, 0.0, "__"));
    }
}
