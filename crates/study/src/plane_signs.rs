//! Signs of differences between postures in the plane: contours of the tongue in space at known activations are tracked in the plane.

use nalgebra::Vector3;
use serde::Serialize;

use tongue_core::body::{Anatomy, Body, DEFAULT_SPACING_M, HYOID, MANDIBLE};
use tongue_core::geometry::Point;
use tongue_core::observe::TongueSurface;
use tongue_core::parallel;
use tongue_core::random::{normal, seed_of};
use tongue_core::system::{Model, SpaceModel, System};
use tongue_files::run::TrackRun;
use tongue_infer::adapt::{AdaptationInput, RestShapeMethod, mark_of};
use tongue_infer::posterior::Certainty;
use tongue_infer::track::{TrackSettings, compare, labels_to_compare};
use tongue_input::measured::recording::{AlignedFrame, AlignedRecording, Label, Mark};

use crate::plane::shape;
use crate::table::markdown;
use crate::{Error, tell};

const PAIRS: u64 = 60;
/// Muscles of the plane, each with its muscle in space.
const MUSCLES: [(&str, &str); 8] = [
    ("GGa", "GGA"),
    ("GGm", "GGM"),
    ("GGp", "GGP"),
    ("SGp", "STY"),
    ("SGm", "STY"),
    ("SGa", "STY"),
    ("HGa", "HG"),
    ("HGp", "HG"),
];
/// Largest activations: of muscles that the plane has, and of others.
const LARGEST: [f64; 2] = [0.12, 0.08];
/// Activations with a smaller difference count as alike.
const LEAST_DIFFERENCE: f64 = 0.02;
/// Number of repetitions of each posture, and of frames in each.
const REPETITIONS: usize = 3;
const FRAMES: usize = 4;
const CONTOUR_POINTS: usize = 11;
/// Noise of a contour point along each axis, and the standard deviation that the tracker assumes, m.
const NOISE_M: f64 = 0.8e-3;
const SD_M: f64 = 0.93e-3;

/// Verdicts in the plane on a muscle whose activations in space are known.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct SignRow {
    /// Which muscles are active in space: those of the plane, or all.
    pub pulling: String,
    pub muscle: String,
    pub in_space: String,
    pub pairs: usize,
    pub surely_right: usize,
    pub surely_wrong: usize,
    pub probably_right: usize,
    pub probably_wrong: usize,
    pub not_known: usize,
    /// Pairs in which a posture could not be tracked.
    pub not_tracked: usize,
    /// Pairs with alike activations, and those of them with the verdict that the muscle surely or probably differs.
    pub alike: usize,
    pub surely_where_alike: usize,
    pub probably_where_alike: usize,
}

/// A tongue in space, and its midsagittal section.
struct SideView<'a> {
    body: &'a Body<3>,
    section: Body<2>,
    surface: TongueSurface,
    system: System<3>,
    names: Vec<String>,
}

pub fn run(body: &Body<3>) -> Result<Vec<SignRow>, Error> {
    let view = SideView::new(body)?;
    let mut rows = Vec::new();
    for (pulling, others) in [("muscles of the plane", false), ("all muscles", true)] {
        tell(&format!("{PAIRS} pairs of postures: {pulling}"));
        let seeds: Vec<u64> = (0..PAIRS).collect();
        let pairs = parallel::map(&seeds, |&seed| view.pair(seed, others));
        let pairs = pairs.into_iter().collect::<Result<Vec<_>, Error>>()?;
        for (number, (muscle, in_space)) in MUSCLES.into_iter().enumerate() {
            let begun = SignRow {
                pulling: pulling.to_owned(),
                muscle: muscle.to_owned(),
                in_space: in_space.to_owned(),
                ..SignRow::default()
            };
            rows.push(pairs.iter().fold(begun, |row, pair| with_pair(row, pair[number])));
        }
    }
    Ok(rows)
}

/// Adds a pair to a row: the true difference, and the verdict if the pair could be tracked.
fn with_pair(mut row: SignRow, (true_difference, verdict): (f64, Option<Certainty>)) -> SignRow {
    use Certainty::{Fixed, NotKnown, ProbablyHarder, ProbablyNotHarder, SurelyHarder, SurelyNotHarder};
    let is_alike = true_difference.abs() < LEAST_DIFFERENCE;
    *(if is_alike { &mut row.alike } else { &mut row.pairs }) += 1;
    let is_right = matches!(verdict, Some(SurelyHarder | ProbablyHarder)) == (true_difference > 0.0);
    let count = match verdict {
        None | Some(NotKnown | Fixed) if is_alike => return row,
        None => &mut row.not_tracked,
        Some(NotKnown | Fixed) => &mut row.not_known,
        Some(SurelyHarder | SurelyNotHarder) if is_alike => &mut row.surely_where_alike,
        Some(ProbablyHarder | ProbablyNotHarder) if is_alike => &mut row.probably_where_alike,
        Some(SurelyHarder | SurelyNotHarder) if is_right => &mut row.surely_right,
        Some(SurelyHarder | SurelyNotHarder) => &mut row.surely_wrong,
        Some(ProbablyHarder | ProbablyNotHarder) if is_right => &mut row.probably_right,
        Some(ProbablyHarder | ProbablyNotHarder) => &mut row.probably_wrong,
    };
    *count += 1;
    row
}

impl<'a> SideView<'a> {
    fn new(body: &'a Body<3>) -> Result<Self, Error> {
        let section = body.section();
        let surface = TongueSurface::of(&section).ok_or("the body has no midsagittal contour")?;
        let system = System::in_space(body, &SpaceModel::default())?;
        Ok(Self { body, section, surface, system, names: body.groups() })
    }

    /// For every muscle of the plane, the true difference of activation between two random postures, and the verdict on the difference of
    /// tension.
    fn pair(&self, seed: u64, others: bool) -> Result<[(f64, Option<Certainty>); 8], Error> {
        let mut rng = fastrand::Rng::with_seed(seed_of(seed, usize::from(others)));
        let postures = [self.posture(&mut rng, others)?, self.posture(&mut rng, others)?];
        let recording = self.recording_of(&postures, &mut rng);
        let verdicts = verdicts(&recording)?;
        Ok(std::array::from_fn(|m| {
            let number = self.names.iter().position(|name| name == MUSCLES[m].1);
            let [a, b] = [0, 1].map(|p| number.map_or(0.0, |n| postures[p].0[n]));
            (a - b, verdicts.as_ref().map(|verdicts| verdicts[m]))
        }))
    }

    /// Activations of all muscles, 40 % of which are 0, and positions of all nodes.
    fn posture(&self, rng: &mut fastrand::Rng, others: bool) -> Result<(Vec<f64>, Vec<Vector3<f64>>), Error> {
        for _ in 0..50 {
            let activations: Vec<f64> = Vec::from_iter(self.names.iter().map(|name| {
                let is_of_plane = MUSCLES.iter().any(|(_, in_space)| in_space == name);
                let most = LARGEST[usize::from(!is_of_plane)];
                let pull = if rng.f64() < 0.4 { 0.0 } else { most * rng.f64() };
                if is_of_plane || others { pull } else { 0.0 }
            }));
            let given: Vec<(&String, f64)> = self.names.iter().zip(activations.iter().copied()).collect();
            let all = self.body.activations(&given)?;
            if let Some(positions) = shape(&self.system, &all) {
                return Ok((activations, positions));
            }
        }
        Err("no equilibrium was found for 50 postures".into())
    }

    /// A recording of the postures, which alternate under the labels `a` and `b`: contour points and bones with noise.
    fn recording_of(
        &self,
        postures: &[(Vec<f64>, Vec<Vector3<f64>>); 2],
        rng: &mut fastrand::Rng,
    ) -> AlignedRecording {
        let (from, to) = (0.010, self.surface.tip - 0.003);
        let places = (0..CONTOUR_POINTS).map(|i| from + (to - from) * i as f64 / (CONTOUR_POINTS - 1) as f64);
        let weights: Vec<_> = places.map(|at| self.surface.curve.weights(at)).collect();
        let bones = [HYOID, MANDIBLE].map(|bone| mark_of(&self.section, bone));
        let (mut frames, mut labels) = (Vec::new(), Vec::new());
        for repetition in 0..2 * REPETITIONS {
            let positions = &postures[repetition % 2].1;
            let start_s = 0.4 * repetition as f64;
            let time = |t: usize| start_s + t as f64 / 80.0;
            for t in 0..FRAMES {
                let mut noise = || Point::new(normal(rng), normal(rng)) * NOISE_M;
                let point = |all: &Vec<(usize, f64)>| {
                    all.iter().map(|(n, w)| Point::new(positions[*n].x, positions[*n].z) * *w).sum::<Point>()
                };
                let contour =
                    weights.iter().map(|w| Some(Mark { at: point(w) + noise(), sd: SD_M })).collect();
                let bones = bones.iter().map(|at| at.map(|at| at + noise())).collect();
                frames.push(AlignedFrame { time_s: time(t), contour, sensors: Vec::new(), bones });
            }
            let name = ["a", "b"][repetition % 2].to_owned();
            labels.push(Label { tier: "word".to_owned(), name, from_s: start_s, to_s: time(FRAMES - 1) });
        }
        AlignedRecording {
            name: "from space".to_owned(),
            labels,
            contour: (0..CONTOUR_POINTS).map(|i| format!("tongue_{i}")).collect(),
            bones: [HYOID, MANDIBLE].map(str::to_owned).to_vec(),
            frames,
            ..AlignedRecording::default()
        }
    }
}

/// For every muscle of the plane the verdict on its tension in `a` less that in `b`; `None` if the recording cannot be tracked.
fn verdicts(recording: &AlignedRecording) -> Result<Option<[Certainty; 8]>, Error> {
    let (body, anatomy) = (Body::tongue(DEFAULT_SPACING_M)?, Anatomy::reference()?);
    let contracting = MUSCLES.iter().map(|(name, _)| body.muscle(name)).collect::<Result<Vec<_>, _>>()?;
    let settings = TrackSettings { shapes: 0, ..TrackSettings::new(20.0, 0.1) };
    let link = settings.link;
    let model = Model::default();
    let basis =
        AdaptationInput { body: &body, anatomy: Some(&anatomy), model, contracting, settings, palate: None };
    let rest = RestShapeMethod::Similarity;
    let run = TrackRun { basis, adaptation: None, is_given: false, rest, free_bones: &[], hide: &[] };
    let Ok(found) = run.run(&[recording], &|_| ()) else { return Ok(None) };
    let names = MUSCLES.map(|(name, _)| name.to_owned());
    let draws = found.iter().map(|one| one.compared.as_slice());
    let Some(comparison) = compare(&labels_to_compare(&[recording]), &names, &link, draws).pop() else {
        return Ok(None);
    };
    let of = |name: &String| {
        comparison.contrasts.iter().find(|c| c.muscle == *name && c.a == "a").map(|c| c.certainty)
    };
    let all: Option<Vec<Certainty>> = names.iter().map(of).collect();
    Ok(all.and_then(|all| all.try_into().ok()))
}

pub fn page(rows: &[SignRow]) -> Result<String, Error> {
    let sum = |of: fn(&SignRow) -> usize| rows.iter().map(of).sum::<usize>();
    let [sure, probable] = [
        [sum(|r| r.surely_right), sum(|r| r.surely_wrong)],
        [sum(|r| r.probably_right), sum(|r| r.probably_wrong)],
    ]
    .map(|[right, wrong]| format!("{right} of {}", right + wrong));
    let (alike, false_alarms) = (sum(|r| r.alike), sum(|r| r.surely_where_alike));
    Ok(format!(
        "\n## Which signs of differences survive\n\n{PAIRS} pairs of postures of this tongue in space, seen from the side as `track` sees a \
         speaker ({CONTOUR_POINTS} points of the contour with a noise of {} mm, hyoid and mandible; each posture {REPETITIONS} times), and tracked \
         with the tongue of the plane. Of the differences in a muscle's activation above {LEAST_DIFFERENCE}, **{sure} that are called sure have the \
         right sign, and {probable} that are called probable**; of {alike} smaller ones {false_alarms} are called sure. The styloglossus and the \
         hyoglossus of space are each compared with every part of theirs in the plane, so these counts are not independent.\n\n{}",
        1e3 * NOISE_M,
        markdown(rows, &[])?
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_muscle_that_pulls_in_one_posture_alone_is_told_in_the_plane() {
        let body = Body::tongue_in_space(1).unwrap();
        let view = SideView::new(&body).unwrap();
        let postures = [0.12, 0.0].map(|a| {
            let all = body.activations(&[("GGA", a)]).unwrap();
            let positions = shape(&view.system, &all).unwrap();
            (all, positions)
        });
        let recording = view.recording_of(&postures, &mut fastrand::Rng::with_seed(1));
        let verdicts = verdicts(&recording).unwrap().unwrap();
        assert_eq!(verdicts[0], Certainty::SurelyHarder, "{verdicts:?}");
        let row = with_pair(SignRow::default(), (0.12, Some(verdicts[0])));
        let row = with_pair(with_pair(row, (-0.12, Some(verdicts[0]))), (0.01, None));
        assert_eq!((row.pairs, row.surely_right, row.surely_wrong, row.alike), (2, 1, 1, 1));
    }
}
