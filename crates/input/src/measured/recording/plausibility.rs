//! Plausibility of a recording: checks that consist of a quantity, its range, and the message for a value outside it.

use tongue_core::geometry::Point;

use super::AlignedRecording;
use super::dynamics::{FEWEST_FRAMES, NamedValue, unnamed};
use super::flat::STEEPEST_BONES_DEG;
use super::map::WITHOUT_BONES;
use super::measures::{ANY, MM, Measures, detour, sag};
use super::outliers::above;
use Severity::{Note, Refused, Untrusted};

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    Note,
    /// There are results, but they cannot be trusted unless the user knows better.
    Untrusted,
    Refused,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Doubt {
    pub message: String,
    pub severity: Severity,
}

impl Doubt {
    pub fn is_refused(&self) -> bool {
        self.severity == Refused
    }
}

/// Doubts, each with the subject of its check.
#[derive(Default)]
struct DoubtList(Vec<(&'static str, Doubt)>);

impl DoubtList {
    /// Adds a doubt for each value outside a range, but only for the first check of a subject that fails. `words` is the message with
    /// `{value}`, `{name}` of what has it, `{without_bones}` ([`WITHOUT_BONES`]) and `{give_palate}` ([`GIVE_PALATE`]).
    fn check(
        &mut self,
        subject: &'static str,
        found: impl IntoIterator<Item = NamedValue>,
        [least, most]: [f64; 2],
        severity: Severity,
        words: &str,
    ) {
        if self.0.iter().any(|(known, _)| *known == subject) {
            return;
        }
        for (value, name) in found.into_iter().filter(|(value, _)| *value < least || *value > most) {
            let message = words.replace("{value}", &three_significant_digits(value)).replace("{name}", &name);
            let message =
                message.replace("{without_bones}", WITHOUT_BONES).replace("{give_palate}", GIVE_PALATE);
            self.0.push((subject, Doubt { message, severity }));
        }
    }

    /// Checks of times, number of points and size.
    #[rustfmt::skip]
    fn size(&mut self, m: &Measures<'_>) {
        self.check("rate", m.step_ms(), [0.1, 1e4], Refused,
            "its frames are {value} ms apart, which is implausible for speech; correct rate_hz in the map, or the times, which are in seconds");
        self.check("labels", m.labels_within(), [0.5, ANY], Note,
            "its labels of the tier {name}, so most of these are not used; give both the same clock");
        self.check("pause", m.longest_pause_s(), [0.0, 600.0], Refused,
            "no frame lies in the {value} s after {name}: correct the times, which are in seconds, or give the parts as recordings of their own");
        self.check("points", m.most_points(), [1.0, ANY], Refused, "no point of the tongue is seen in any frame; correct the map");
        self.check("points", m.most_points().filter(|_| m.recording.sensors.is_empty()), [3.0, ANY], Refused,
            "only {value} of the points of the contour is seen at once, which does not determine the shape of a tongue; give three or more");
        self.check("points", m.most_points(), [2.0, ANY], Refused,
            "only {value} coil is seen, which does not determine the shape of a tongue; give three or more (two at least)");
        self.check("noise", m.usual_sd_mm(), [0.0, 5.0], Note,
            "its points have a standard deviation of {value} mm, where 0.2 to 2 are usual, so they say little; correct sigma_mm in the table, or \
             noise_mm in the map");
        let is_as_a_tongue = m.contour_width_mm().is_some_and(|(mm, _)| (30.0..=90.0).contains(&mm));
        self.check("size", m.bones_apart_mm().filter(|_| is_as_a_tongue), [20.0, 75.0], Refused,
            "the mental spine and the hyoid are apart by {value} mm, where 20 to 75 are possible, while the contour is as large as a tongue: \
             one of them is another point; correct their names in the map, or leave the bones out with a map (--map) of the line \
             {without_bones}");
        self.check("size", m.bones_apart_mm(), [20.0, 75.0], Refused,
            "the mental spine and the hyoid are apart by {value} mm, where 20 to 75 are possible; correct unit_mm in the map, or give a table \
             in millimetres");
        self.check("size", m.contour_width_mm(), [10.0, 200.0], Refused,
            "half of the contour spans {value} mm, where 10 to 200 are possible; correct unit_mm in the map, or give a table in millimetres");
        self.check("size", m.coil_alone_mm(), [0.0, 30.0], Refused,
            "{name} lies {value} mm from the nearest other coil, more than twice as far as these from one another: it has come off or its tracking \
             has slipped; write \"{name}\" = \"ignore\" into a map");
        self.check("size", m.copied_coils(), [0.0, 0.0], Refused,
            "the coils {name} have exactly the same place in most frames: one is a copy of the other; correct it, or write \"ignore\" for it into \
             a map");
        self.check("size", m.gaps_mm().into_iter().max_by(f64::total_cmp).map(unnamed), [4.0, 50.0], Refused,
            "neighbouring coils are apart by up to {value} mm, where 4 to 50 are possible; correct unit_mm in the map, or give a table in \
             millimetres");
    }

    /// Checks of the order of points and bones in the head, and of the upward axis.
    #[rustfmt::skip]
    fn shape(&mut self, m: &Measures<'_>) {
        self.check("far", m.far_points_mm(), [0.0, 150.0], Note,
            "{name} lies {value} mm from the other points, which is too far; correct it, or write \"{name}\" = \"ignore\" into a map");
        self.check("slip", m.motion.slipped_points_mm(), [0.0, 8.0], Refused,
            "{name}, while the other points do not: its tracking has slipped; correct it, or leave the point out with \"ignore\" in a map");
        self.check("axes", m.steep_bones().filter(|(_, upright)| *upright).map(|(deg, _)| deg), [0.0, STEEPEST_BONES_DEG], Refused,
            "the hyoid and the mental spine lie one above the other, while the tongue is arched upwards: the tracking of one of them has \
             slipped; correct it, or leave the bones out with a map (--map) of the line {without_bones}");
        self.check("axes", m.steep_bones().map(|(deg, _)| deg), [0.0, STEEPEST_BONES_DEG], Refused, EXCHANGED);
        self.check("axes", m.tongue_above_bones_mm(), [0.0, ANY], Refused,
            "the tongue lies below the hyoid and the mental spine: the recording is upside down; give the axis that grows upwards in a map, \
             such as up = \"-y\"");
        self.check("axes", m.spine_and_hyoid().map(|(spine, hyoid)| unnamed((spine.x - hyoid.x) * MM)), [-ANY, 0.0], Refused,
            "the mental spine lies behind the hyoid; correct back in the map, or the names of the two");
        self.check("axes", m.root_nearer_to_spine_mm(), [-ANY, 0.0], Refused,
            "the end of the contour at the root lies by the mental spine and not by the hyoid: the names of these two are wrong, or contour and \
             bones are not in one frame; correct them, or leave the bones out with a map (--map) of the line {without_bones}");
        self.check("axes", m.near_contour(5).map(|contour| unnamed(detour(&contour))), [0.0, MOST_DETOUR], Refused, DISORDERED);
        self.check("axes", m.near_contour(5).and_then(|contour| sag(&contour)).map(|m| unnamed(m * MM)), [-ANY, 5.0], Refused,
            "the contour hangs below the line of its ends, where a tongue is arched upwards: the recording is upside down; give the axis that \
             grows upwards in a map, such as up = \"-y\"");
        self.check("axes", m.disordered_coils_steep_deg(), [0.0, 60.0], Refused, EXCHANGED);
        self.check("axes", m.coils_that_turn(), [0.0, 0.0], Refused,
            "the coils {name} do not lie along the tongue in this order: two of them seem to be exchanged; correct their names or numbers in a map");
        self.check("axes", m.tip_behind_mm(), [-ANY, 3.0], Refused,
            "the coil at the tip lies behind the others; correct back in the map, or correct their names or numbers in a map");
        self.check("names", m.coils_out_of_rank(), [0.0, 0.0], Note,
            "from the tip backwards the coils lie in the order {name}: their names seem to be exchanged; they are taken as they lie");
        self.check("unit", m.size_of_coils(), [0.0, 1.0], Refused,
            "its coils lie {name}, where 10 to 20 mm on the front 60 mm of a tongue are usual; give unit_mm in a map: the right one, or the same \
             (1 for millimetres) if the coils do lie so");
        self.check("hollow", m.hollow_mm(), [-ANY, 2.0], Refused,
            "{name} throughout, where a tongue is arched upwards: either the recording is upside down, or the tongue is held hollow, as in a \
             retroflex; say which by up = \"-y\" or up = \"y\" in a map");
        self.check("high", m.height_over_bones(), [0.0, 1.0], Note,
            "the contour reaches {name} times as far above the line from the mental spine to the hyoid as these are apart, and both of its \
             ends are high: the contour is too high for the bones; correct these, or give both in one frame");
        self.check("spike", m.spike_mm(), [0.0, 6.0], Untrusted,
            "{name} stands out of the contour by {value} mm; correct it, or write \"{name}\" = \"ignore\" into a map");
    }

    /// Checks of motion. On average pellets on the tongue move at 60 to 130 mm/s in speech (Tasko and Westbury 2002), and tips at 400 mm/s
    /// in the fastest gestures; a gesture takes 0.1 to 0.3 s.
    #[rustfmt::skip]
    fn motion(&mut self, m: &Measures<'_>) {
        self.check("still", m.motion.frozen(), [0.0, 0.0], Refused,
            "nothing moves: all {value} frames have exactly the same places, which no measurement has; export the recording again, or give one \
             frame alone");
        self.check("still", m.motion.repeated(), [0.0, 0.5], Note,
            "most frames repeat the one before; export the recording at the rate of its video, or take the repeated frames out");
        self.check("still", m.motion.part_rounded(), [0.0, 0.5], Note,
            "most points stay at exactly the same place in most frames: the places are rounded to steps that are larger than the motion; export more \
             decimals");
        self.check("still", m.motion.stuck(), [0.0, 0.5], Note,
            "{name} stays at exactly the same place in most frames while others move; write \"ignore\" for it into a map");
        self.check("still", m.motion.longest_freeze(), [0.0, 10.0], Note,
            "all points stay at exactly the same place in {value} frames from {name} on, which no measurement has; take these frames out");
        self.check("rate", m.motion.disorder(), [0.0, 0.6], Refused,
            "its frames do not follow one another: points are as far from where they were in the frame before as from anywhere; sort them by time");
        self.check("rate", m.motion.fastest_tenth_mm_s(), [0.0, 320.0], Untrusted,
            "in a tenth of the time the tongue moves faster than {value} mm/s, where 80 to 200 are usual in speech; if that is wrong, correct \
             rate_hz in the map, or the times, which are in seconds");
        // The part is 0.94 to 1 in slow careful speech, 0.61 to 0.84 if its times are doubled, and 0.30 to 0.47 if they are multiplied by
        // five.
        self.check("rate", m.motion.quickest_part(), [0.5, ANY], Untrusted,
            "the quickest motion takes {name}, where a tongue in speech needs 0.1 to 0.3 s: the times are too long, or nothing is spoken; if they \
             are wrong, correct rate_hz in the map, or the times, which are in seconds");
        self.check("rate", m.step_ms().filter(|_| m.recording.frames.len() >= FEWEST_FRAMES && m.motion.is_moving()), [0.0, 200.0], Untrusted,
            "its frames are {value} ms apart, where 2 to 200 ms are usual, so nothing is known of the motion between them; if that is wrong, \
             correct rate_hz in the map, or the times, which are in seconds");
        self.check("rate", m.step_ms(), [1.99, 200.0], Note,
            "its frames are {value} ms apart, where 2 to 200 ms are usual; if that is wrong, correct rate_hz in the map, or the times, which \
             are in seconds");
        self.check("slip", m.motion.slip_mm(), [0.0, 0.0], Refused,
            "all points of the tongue are shifted by {value} mm at once {name}: the head or the probe has slipped; name points of the head as \
             \"reference\" in a map, or give the parts as recordings of their own");
        self.check("slip", m.hyoid_moves_mm(), [0.0, 10.0], Note,
            "the hyoid moves by {value} mm against the mental spine, where 3 to 6 are usual in speech: the speaker swallows, or the tracking of one of them \
             has slipped; correct it, or leave the bones out with a map (--map) of the line {without_bones}");
    }

    /// Checks of the palate. Three coils in vowels are at most 23 mm below a traced palate, and a single posture may be farther below it.
    #[rustfmt::skip]
    fn palate(&mut self, m: &Measures<'_>) {
        let Some(palate) = m.palate else { return };
        let heights = heights_mm(palate, m);
        let names = m.recording.names().zip(&heights).filter(|(_, own)| own.len() >= FEWEST_FRAMES);
        let often_beyond: Vec<NamedValue> = names.map(|(name, own)| (percent(own, is_beyond), name.clone())).collect();
        let all = heights.concat();
        let in_range: Vec<Option<f64>> = all.iter().copied().filter(Option::is_some).collect();
        let room_mm = in_range.iter().flatten().copied().max_by(f64::total_cmp).map(|highest| unnamed(-highest));
        let side = if m.recording.mirrored { -1.0 } else { 1.0 };
        let exchanged: Vec<Point> = palate.iter().map(|p| side * Point::new(p.y, p.x)).collect();
        let if_exchanged = percent(&heights_mm(&exchanged, m).concat(), is_under);
        self.check("palate", [unnamed(if_exchanged)], [0.0, 2.0 * percent(&all, is_under) + 20.0], Refused,
            "{value} % of the points lie under the palate if its x_mm and y_mm are exchanged, far more than as it is given: exchange them; {give_palate}");
        self.check("palate", sag(palate).filter(|_| palate.len() >= 3).map(|m| unnamed(m * MM)), [-ANY, 2.0], Refused,
            "the palate sags by {value} mm below the line of its ends: it is upside down; change the sign of its y_mm");
        self.check("palate", (!all.is_empty()).then(|| unnamed(in_range.len() as f64)), [1.0, ANY], Refused,
            "no point of the tongue lies under the palate; {give_palate}");
        self.check("palate", [unnamed(percent(&in_range, is_beyond))], [0.0, 20.0], Refused, "{value} % of the points lie beyond the palate; {give_palate}");
        self.check("palate", often_beyond, [0.0, 50.0], Untrusted,
            "{name} lies beyond the palate in {value} % of the frames: the palate or the point is in a wrong place; {give_palate}");
        self.check("palate", room_mm.clone(), [-ANY, 60.0], Refused,
            "the palate lies {value} mm above the highest point of the tongue; {give_palate}");
        self.check("palate", room_mm.filter(|_| m.recording.frames.len() >= FEWEST_FRAMES), [-ANY, 25.0], Note,
            "the palate lies {value} mm above the highest point of the tongue; {give_palate}");
    }
}

/// Farthest that a point may lie beyond a palate, and farthest that one usually lies under it.
const BEYOND_MM: f64 = 3.0;
const UNDER_MM: f64 = 30.0;

fn is_beyond(height_mm: f64) -> bool {
    height_mm > BEYOND_MM
}

fn is_under(height_mm: f64) -> bool {
    (-UNDER_MM..=BEYOND_MM).contains(&height_mm)
}

/// Heights of every point of the tongue above a palate, mm, in the frames that show it; `None` in front of the palate and behind it.
fn heights_mm(palate: &[Point], m: &Measures<'_>) -> Vec<Vec<Option<f64>>> {
    let points = 0..m.recording.contour.len() + m.recording.sensors.len();
    let each = points.map(|point| {
        let positions = m.recording.positions_over_time(point);
        positions.map(|(_, mark)| above(palate, mark.at).map(|over| over * MM)).collect()
    });
    each.collect()
}

/// Percentage of all heights that have a property; zero if there are none.
fn percent(heights_mm: &[Option<f64>], has_property: fn(f64) -> bool) -> f64 {
    let count = heights_mm.iter().flatten().filter(|mm| has_property(**mm)).count();
    100.0 * count as f64 / heights_mm.len().max(1) as f64
}

const MOST_DETOUR: f64 = 1.6;
const DISORDERED: &str =
    "the points of the contour are not in their order along the tongue; number them from the root to the tip";

/// A message if the points of a contour are not in their order along the tongue.
pub fn disorder_of_contour(contour: &[Point]) -> Option<&'static str> {
    (contour.len() >= 5 && detour(contour) > MOST_DETOUR).then_some(DISORDERED)
}

const GIVE_PALATE: &str =
    "give it in the frame and the unit of the recording (millimetres), from front to back";
const EXCHANGED: &str = "coils or bones that lie one behind the other are recorded one above the other: x and y seem to be exchanged; give back = \
     \"y\" and up = \"x\" in a map, with a minus before an axis that grows the other way";

/// The doubts about a recording: its size, then its shape, its motion, and the position of the palate (m, in the frame of the recording).
/// Checks end after the first of these four in which a doubt refuses the recording.
pub fn check_plausibility(recording: &AlignedRecording, palate: Option<&[Point]>) -> Vec<Doubt> {
    let measures = Measures::of(recording, palate);
    let mut list = DoubtList::default();
    for stage in [DoubtList::size, DoubtList::shape, DoubtList::motion, DoubtList::palate] {
        stage(&mut list, &measures);
        if list.0.iter().any(|(_, doubt)| doubt.is_refused()) {
            break;
        }
    }
    let stated = recording.stated;
    for (subject, doubt) in &mut list.0 {
        let key = match *subject {
            "axes" if stated.axes => "the axes",
            "size" | "unit" if stated.unit => "unit_mm",
            _ => continue,
        };
        doubt.message += &format!(" (the map given states {key}: correct that, or the names in it)");
    }
    list.0.into_iter().map(|(_, doubt)| doubt).collect()
}

fn three_significant_digits(value: f64) -> String {
    let decimals = (2 - value.abs().max(1e-9).log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// The first recording whose tongue differs in size from that of the first one, as if it were of another speaker, with the doubt.
pub fn other_size(recordings: &[&AlignedRecording]) -> Option<(usize, Doubt)> {
    /// Smallest ratio of sizes that is reported: if the tongue moves in both recordings, since the distances of bones and coils vary by a
    /// tenth in speech, and if it is held in one of them, since an /i/ is up to a third longer than an /a/ of the same speaker.
    const RATIO: f64 = 1.18;
    const RATIO_OF_POSTURES: f64 = 1.45;
    let (first, others) = recordings.split_first()?;
    let of_first = Measures::of(first, None);
    let sizes = of_first.sizes_mm()?;
    others.iter().enumerate().find_map(|(n, other)| {
        let alike = first.contour == other.contour && first.sensors.len() == other.sensors.len();
        let measured = Measures::of(other, None);
        let [tongue, bones] = measured.sizes_mm().filter(|_| alike)?;
        let (a, b) = (tongue / sizes[0], bones / sizes[1]);
        let ratio = if of_first.motion.is_moving() && measured.motion.is_moving() { RATIO } else { RATIO_OF_POSTURES };
        (a.min(b) > ratio || a.max(b) < 1.0 / ratio).then(|| {
            let message = format!(
                "its tongue is {:.2} times as large as that of {}, as if it were of another speaker; each speaker needs a body of his or her \
                 own, so track them separately",
                (a * b).sqrt(),
                first.name
            );
            (n + 1, Doubt { message, severity: Note })
        })
    })
}
