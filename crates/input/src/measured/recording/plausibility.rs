//! Plausibility of a whole recording: one table of checks, each with what is measured, its range, and the words for a value outside it.

use tongue_core::geometry::Point;

use super::AlignedRecording;
use super::map::WITHOUT_BONES;
use super::measures::{Measures, STEEPEST_BONES_DEG, Value, sag};
use super::outliers::above;
use Severity::{Note, Refused, Untrusted};

/// What follows from an implausible property of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    Note,
    /// Results exist, but cannot be trusted unless the user knows better.
    Untrusted,
    Refused,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Doubt {
    pub said: String,
    pub severity: Severity,
}

impl Doubt {
    pub fn is_refused(&self) -> bool {
        self.severity == Refused
    }
}

/// A property that is measured, the range that is plausible, and the words for a value outside it.
struct Check<'a> {
    /// Of the checks with one subject only the first that fails is told.
    subject: &'static str,
    measure: fn(&Measures<'a>) -> Vec<Value>,
    range: [f64; 2],
    severity: Severity,
    /// `{value}` is the value, `{name}` what has it, `{without_bones}` the line of a map that leaves the bones out.
    words: &'static str,
}

const fn check<'a>(
    subject: &'static str,
    measure: fn(&Measures<'a>) -> Vec<Value>,
    range: [f64; 2],
    severity: Severity,
    words: &'static str,
) -> Check<'a> {
    Check { subject, measure, range, severity, words }
}

const ANY: f64 = f64::INFINITY;

impl<'a> Check<'a> {
    /// Checks of times, number of points and size. After one that refuses, the shape is not checked.
    #[rustfmt::skip]
    const SIZE: [Check<'a>; 10] = [
        check("rate", Measures::step_ms, [0.1, 1e4], Refused,
            "its frames are {value} ms apart, which is implausible for speech; correct rate_hz in the map, or the times, which are in seconds"),
        check("labels", Measures::labels_within, [1.0, ANY], Note,
            "its labels lie at {name}, so none is used; give both the same clock"),
        check("points", Measures::most_points, [1.0, ANY], Refused, "no point of the tongue is seen in any frame; correct the map"),
        check("points", Measures::most_contour_points, [3.0, ANY], Refused,
            "only {value} of the points of the contour is seen at once, which does not determine the shape of a tongue; give three or more"),
        check("points", Measures::most_points, [2.0, ANY], Refused,
            "only {value} coil is seen, which does not determine the shape of a tongue; give three or more (two at least)"),
        check("size", Measures::bones_apart_beside_tongue_mm, [20.0, 75.0], Refused,
            "the mental spine and the hyoid are apart by {value} mm, where 20 to 75 are possible, while the contour is as large as a tongue: \
             one of them is another point; correct their names in the map, or leave the bones out with a map (--map) of the line \
             {without_bones}"),
        check("size", Measures::bones_apart_mm, [20.0, 75.0], Refused,
            "the mental spine and the hyoid are apart by {value} mm, where 20 to 75 are possible; correct unit_mm in the map, or give a table \
             in millimetres"),
        check("size", Measures::contour_width_mm, [10.0, 200.0], Refused,
            "half of the contour spans {value} mm, where 10 to 200 are possible; correct unit_mm in the map, or give a table in millimetres"),
        check("size", Measures::coil_alone_mm, [0.0, 30.0], Refused,
            "{name} lies {value} mm from the nearest other coil, more than twice as far as these from one another: it has come off or its tracking \
             has slipped; write \"{name}\" = \"ignore\" into a map"),
        check("size", Measures::largest_gap_mm, [4.0, 50.0], Refused,
            "neighbouring coils are apart by up to {value} mm, where 4 to 50 are possible; correct unit_mm in the map, or give a table in \
             millimetres"),
    ];

    /// Checks of the order of points and bones in the head, and of the way up.
    #[rustfmt::skip]
    const SHAPE: [Check<'a>; 18] = [
        check("far", Measures::far_points_mm, [0.0, 150.0], Note,
            "{name} lies {value} mm from the other points, which is too far; correct it, or write \"{name}\" = \"ignore\" into a map"),
        check("slip", Measures::slipped_points_mm, [0.0, 8.0], Refused,
            "{name}, while the other points do not: its tracking has slipped; correct it, or leave the point out with \"ignore\" in a map"),
        check("axes", Measures::bones_alone_steep_deg, [0.0, STEEPEST_BONES_DEG], Refused,
            "the hyoid and the mental spine lie one above the other, while the tongue is the right way up: the tracking of one of them has \
             slipped; correct it, or leave the bones out with a map (--map) of the line {without_bones}"),
        check("axes", Measures::bones_steep_deg, [0.0, STEEPEST_BONES_DEG], Refused, EXCHANGED),
        check("axes", Measures::tongue_above_bones_mm, [0.0, ANY], Refused,
            "the tongue lies below the hyoid and the mental spine: the recording is upside down; give the axis that grows upwards in a map, \
             such as up = \"-y\""),
        check("axes", Measures::spine_behind_hyoid_mm, [-ANY, 0.0], Refused,
            "the mental spine lies behind the hyoid; correct back in the map, or the names of the two"),
        check("axes", Measures::root_nearer_to_spine_mm, [-ANY, 0.0], Refused,
            "the end of the contour at the root lies by the mental spine and not by the hyoid: the names of these two are wrong, or contour and \
             bones are not in one frame; correct them, or leave the bones out with a map (--map) of the line {without_bones}"),
        check("axes", Measures::detour_of_contour, [0.0, 1.6], Refused,
            "the points of the contour are not in their order along the tongue; number them from the root to the tip"),
        check("axes", Measures::sag_of_contour_mm, [-ANY, 5.0], Refused,
            "the contour hangs below the line of its ends, where a tongue is arched upwards: the recording is upside down; give the axis that \
             grows upwards in a map, such as up = \"-y\""),
        check("axes", Measures::disordered_coils_steep_deg, [0.0, 60.0], Refused, EXCHANGED),
        check("axes", Measures::coils_that_turn, [0.0, 0.0], Refused,
            "the coils {name} do not lie along the tongue in this order: two of them seem to be exchanged; correct their names or numbers in a map"),
        check("axes", Measures::tip_behind_mm, [-ANY, 3.0], Refused,
            "the coil at the tip lies behind the others; correct back in the map, or correct their names or numbers in a map"),
        check("names", Measures::coils_out_of_rank, [0.0, 0.0], Note,
            "from the tip backwards the coils lie in the order {name}: their names seem to be exchanged; they are taken as they lie"),
        check("unit", Measures::mean_gap_mm, [9.0, 28.0], Refused,
            "its coils lie {value} mm apart, {name} mm from the first to the last, where 10 to 20 mm on the front 60 mm of a tongue are usual; give \
             unit_mm in a map: the right one, or the same (1 for millimetres) if the coils do lie so"),
        check("unit", Measures::length_of_coils_mm, [0.0, 58.0], Refused,
            "its coils lie {name} mm apart, {value} mm from the first to the last, where 10 to 20 mm on the front 60 mm of a tongue are usual; give \
             unit_mm in a map: the right one, or the same (1 for millimetres) if the coils do lie so"),
        check("hollow", Measures::hollow_mm, [-ANY, 2.0], Refused,
            "{name} throughout, where a tongue is arched upwards: either the recording is upside down, or the tongue is held hollow, as in a \
             retroflex; say which by up = \"-y\" or up = \"y\" in a map"),
        check("high", Measures::height_over_bones, [0.0, 1.0], Note,
            "the contour reaches {name} times as far above the line from the mental spine to the hyoid as these are apart, and both of its \
             ends are high: the contour is too high for the bones; correct these, or give both in one frame"),
        check("spike", Measures::spike_mm, [0.0, 6.0], Note,
            "{name} stands out of the contour by {value} mm; correct it, or write \"{name}\" = \"ignore\" into a map"),
    ];

    /// Checks of motion. Pellets on the tongue move at 60 to 130 mm/s on average in speech (Tasko and Westbury 2002), and tips at 400 mm/s in the
    /// fastest gestures; a gesture takes 0.1 to 0.3 s.
    #[rustfmt::skip]
    const MOTION: [Check<'a>; 9] = [
        check("still", Measures::frozen, [0.0, 0.0], Refused,
            "nothing moves: all {value} frames have exactly the same places, which no measurement has; export the recording anew, or give one \
             frame alone"),
        check("still", Measures::repeated, [0.0, 0.0], Note,
            "most frames repeat the one before; export the recording at the rate of its video, or take the repeated frames out"),
        check("still", Measures::stuck, [0.0, 0.5], Note,
            "{name} stays in the very same place in most frames while others move; write \"{name}\" = \"ignore\" into a map"),
        check("rate", Measures::disorder, [0.0, 0.6], Refused,
            "its frames do not follow one another: points are as far from where they were in the frame before as from anywhere; sort them by time"),
        check("rate", Measures::fastest_tenth_mm_s, [0.0, 320.0], Untrusted,
            "a tenth of the time the tongue moves faster than {value} mm/s, where 80 to 200 are usual in speech; if that is wrong, correct \
             rate_hz in the map, or the times, which are in seconds"),
        check("rate", Measures::quickest_part, [0.3, ANY], Untrusted,
            "the quickest motion takes {name}, where a tongue in speech needs 0.1 to 0.3 s: the times are too long, or nothing is spoken; if they \
             are wrong, correct rate_hz in the map, or the times, which are in seconds"),
        check("rate", Measures::sparse_ms, [0.0, 200.0], Untrusted,
            "its frames are {value} ms apart, where 2 to 200 ms are usual, so nothing is known of the motion between them; if that is wrong, \
             correct rate_hz in the map, or the times, which are in seconds"),
        check("rate", Measures::step_ms, [1.99, 200.0], Note,
            "its frames are {value} ms apart, where 2 to 200 ms are usual; if that is wrong, correct rate_hz in the map, or the times, which \
             are in seconds"),
        check("slip", Measures::slip_mm, [0.0, 0.0], Refused,
            "all points of the tongue are shifted by {value} mm at once {name}: the head or the probe has slipped; name points of the head as \
             \"reference\" in a map, or give the parts as recordings of their own"),
    ];
}

const EXCHANGED: &str = "coils or bones that lie one behind the other are recorded one above the other: x and y seem to be exchanged; give back = \
     \"y\" and up = \"x\" in a map, with a minus before an axis that grows the other way";

pub fn doubts(recording: &AlignedRecording) -> Vec<Doubt> {
    let measures = Measures::of(recording);
    let mut told: Vec<&str> = Vec::new();
    let mut out: Vec<Doubt> = Vec::new();
    for stage in [&Check::SIZE[..], &Check::SHAPE, &Check::MOTION] {
        for check in stage {
            if told.contains(&check.subject) {
                continue;
            }
            let [least, most] = check.range;
            let found = (check.measure)(&measures);
            for found in found.iter().filter(|f| f.value < least || f.value > most) {
                let said = check.words.replace("{value}", &shown(found.value)).replace("{name}", &found.name);
                let said = said.replace("{without_bones}", WITHOUT_BONES);
                out.push(Doubt { said, severity: check.severity });
                told.push(check.subject);
            }
        }
        if out.iter().any(Doubt::is_refused) {
            break;
        }
    }
    out
}

/// A number with three digits that mean something.
fn shown(value: f64) -> String {
    let decimals = (2 - value.abs().max(1e-9).log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// The doubt about a palate (m, in the frame of the recording) for this recording.
pub fn palate_doubt(recording: &AlignedRecording, palate: &[Point]) -> Option<Doubt> {
    /// Largest plausible height of a palate above the highest points, mm: of a posture, and of speech, which touches it.
    const HIGHEST_MM: f64 = 60.0;
    const NEAREST_MM: f64 = 20.0;
    const FEW_FRAMES: usize = 20;
    let doubt = |severity, said: String| Some(Doubt { said, severity });
    let sag_mm = sag(palate).unwrap_or(0.0) * 1e3;
    if palate.len() >= 3 && sag_mm > 2.0 {
        let what = format!("the palate sags by {sag_mm:.0} mm below the line of its ends: it is upside down");
        return doubt(Refused, format!("{what}; change the sign of its y_mm"));
    }
    let points: Vec<Point> = recording
        .frames
        .iter()
        .flat_map(|f| f.contour.iter().chain(&f.sensors))
        .flatten()
        .map(|m| m.at)
        .collect();
    let over_mm: Vec<f64> = points.iter().filter_map(|p| Some(above(palate, *p)? * 1e3)).collect();
    let help = "give it in the frame and the unit of the recording (millimetres), from front to back";
    if over_mm.is_empty() && !points.is_empty() {
        return doubt(Refused, format!("no point of the tongue lies under the palate; {help}"));
    }
    let percent = 100.0 * over_mm.iter().filter(|mm| **mm > 3.0).count() as f64 / over_mm.len().max(1) as f64;
    if percent > 20.0 {
        return doubt(Refused, format!("{percent:.0} % of the points lie beyond the palate; {help}"));
    }
    let free_mm = -over_mm.iter().fold(-ANY, |a, b| a.max(*b));
    let limit = if recording.frames.len() < FEW_FRAMES { HIGHEST_MM } else { NEAREST_MM };
    if !over_mm.is_empty() && free_mm > limit {
        let severity = if free_mm > HIGHEST_MM { Refused } else { Note };
        return doubt(
            severity,
            format!("the palate lies {free_mm:.0} mm above the highest point of the tongue; {help}"),
        );
    }
    None
}

/// The first of these recordings whose tongue is of another size than that of the first, with the doubt whether it is of the same speaker.
pub fn other_size(recordings: &[&AlignedRecording]) -> Option<(usize, Doubt)> {
    /// Smallest ratio of sizes that is told where the tongue moves in both recordings, since the distances of bones and coils vary by a
    /// tenth in speech, and where it is held in one: an /i/ is up to a third longer than an /a/ of the same speaker.
    const RATIO: f64 = 1.18;
    const RATIO_OF_POSTURES: f64 = 1.45;
    let (first, others) = recordings.split_first()?;
    let of_first = Measures::of(first);
    let sizes = of_first.sizes_mm()?;
    others.iter().enumerate().find_map(|(n, other)| {
        let alike = first.contour == other.contour && first.sensors.len() == other.sensors.len();
        let measured = Measures::of(other);
        let [tongue, bones] = measured.sizes_mm().filter(|_| alike)?;
        let (a, b) = (tongue / sizes[0], bones / sizes[1]);
        let ratio = if of_first.is_moving() && measured.is_moving() { RATIO } else { RATIO_OF_POSTURES };
        (a.min(b) > ratio || a.max(b) < 1.0 / ratio).then(|| {
            let said = format!(
                "its tongue is {:.2} times as large as that of {}, as if it were of another speaker; each speaker needs a body of his or her \
                 own, so track them apart",
                (a * b).sqrt(),
                first.name
            );
            (n + 1, Doubt { said, severity: Note })
        })
    })
}
