use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use serde_json::{Value, json};
use tongue_fit::body::Body;
use tongue_fit::geometry::Point;
use tongue_fit::inner::adapt::{AdaptationInput, Landmarks, RestShapeMethod, Speaker};
use tongue_fit::inner::measured::recording::AlignedRecording;
use tongue_fit::inner::report::{self, Export, Json, SectionPicture};
use tongue_fit::inner::run::{self, ScreenedRecording};

use super::inputs::choice_among;
use super::recordings::{self, GivenRecordings, PriorArguments};
use super::track_files::body_record;
use super::{Global, Outcome, body, inputs, output, table};

const DRAWN_FRAMES: usize = 20;

#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "Examples:\n  \
    tongue-fit adapt speaker.tsv --out results/speaker\n  \
    tongue-fit adapt --landmarks speaker.csv --contour rest.mrk.json\n\n\
    Writes body.json, which --mesh of every command takes, and rest.svg: the shape at rest over the measured points.")]
pub struct Arguments {
    #[command(flatten)]
    recordings: recordings::Arguments,
    /// Method for the rest shape from recordings: joint, the shape that explains many frames at once, or similarity, the body only turned,
    /// scaled and shifted to the speaker's bones
    #[arg(long, value_name = "HOW", value_parser = choice_among::<RestShapeMethod>(&recordings::REST), default_value = "joint")]
    rest: RestShapeMethod,
    /// Landmarks of one posture at rest instead of recordings: mental_spine, hyoid (CSV point,x_mm,y_mm or 3D Slicer's .mrk.json)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["files", "example", "rest"])]
    landmarks: Option<PathBuf>,
    /// The contour of the tongue in that posture, in the same formats
    #[arg(long, value_name = "FILE", requires = "landmarks")]
    contour: Option<PathBuf>,
    #[command(flatten)]
    prior: PriorArguments,
    #[command(flatten)]
    body: body::Arguments,
}

pub fn run(arguments: &Arguments, global: &Global) -> Result<Outcome> {
    if let Some(outcome) = arguments.recordings.write_template(global)? {
        return Ok(outcome);
    }
    let given = GivenRecordings::read(&arguments.body)?;
    let basis = given.basis(&arguments.body, arguments.prior.settings()?);
    let (mut speaker, seen, mut notes, is_whole, implausible) = match &arguments.landmarks {
        Some(path) => {
            let map = arguments.recordings.map()?;
            let read = |path: &Path| -> Result<Landmarks> {
                let bytes = inputs::bytes("the landmarks", path)?;
                Ok(Landmarks::from_bytes(&bytes, &path.display().to_string(), &map)?)
            };
            let mut landmarks = read(path)?;
            if let Some(contour) = &arguments.contour {
                landmarks = landmarks.with_contour(read(contour)?);
            }
            if let Some(problem) = landmarks.doubt() {
                bail!("{}: {problem}", path.display());
            }
            let seen = landmarks.contour.iter().chain(landmarks.named.values()).copied().collect();
            (basis.adapt_to_landmarks(&landmarks)?, seen, Vec::new(), true, None)
        }
        None => {
            if arguments.recordings.files.is_empty() && !arguments.recordings.example {
                bail!("name recordings of the speaker, or --landmarks of one posture at rest");
            }
            let (recordings, left_out) = arguments.recordings.screen(&arguments.recordings.read()?, None)?;
            ScreenedRecording::check_points(&recordings, &given.body)?;
            let (is_whole, implausible) = (left_out.is_empty(), ScreenedRecording::implausible(&recordings));
            let mut notes = left_out;
            notes.extend(ScreenedRecording::notes(&recordings, &given.body, &[]));
            let palate = recordings.iter().find_map(|r| r.palate.as_deref());
            let basis = AdaptationInput { palate, ..basis };
            let seen: Vec<_> = recordings.iter().map(|r| &r.seen).collect();
            notes.extend(basis.place(&seen, &[])?.doubt());
            notes.iter().for_each(|n| output::note(n));
            let speaker = output::with_bar("{bar:40} rest shape, {eta} left", |progress| {
                basis.adapt_to_recordings(&seen, arguments.rest, &[], progress)
            })?;
            (speaker?, points_of_some_frames(&seen), notes, is_whole, implausible)
        }
    };
    let apart_m = run::bones_apart_m(&speaker.followed);
    speaker.notes.extend(run::check_scale(speaker.similarity.scale(), apart_m)?);
    let out = global.folder("results/speaker")?;
    let mut doubts = speaker.doubts(&given.body);
    doubts.extend(implausible);
    let summary = text(&speaker, &given.body);
    notes.splice(0..0, speaker.notes.iter().cloned());
    let record = record(&speaker, &given.body, &doubts, &notes);
    let body = body_record(&speaker.body, &arguments.body.model(), &speaker.adaptation(), &[])?;
    let (mesh, mut similar) = (&speaker.body.mesh, given.body.mesh.clone());
    similar.nodes.iter_mut().for_each(|p| *p = speaker.similarity.place(*p));
    let (at_rest, grey) = (vec![0.0; mesh.muscles.len()], "only turned and scaled");
    let palate = speaker.body.palate.as_deref().unwrap_or_default();
    let title = "The speaker's tongue at rest over the measured points (dots; grey: only turned and scaled)";
    let section = SectionPicture::new(&similar, &mesh.nodes, &at_rest, palate, title);
    let picture = report::tongue(&SectionPicture { seen: &seen, grey, ..section })?;
    let (body, json) = (Json(&body), Json(&record));
    let files: [(&str, &dyn Export); 3] =
        [("body.json", &body), ("adapt.json", &json), ("rest.svg", &picture)];
    output::write_and_answer(global, (Some(&out), &files), &json, &super::provenance(), || summary)?;
    if doubts.is_empty() {
        return Ok(if is_whole { Outcome::Good } else { Outcome::SomeRowsRefused });
    }
    Ok(Outcome::Untrustworthy(format!(
        "this body is not to be trusted: {}; check rest.svg, and the unit, the places and the names of the landmarks",
        doubts.join("; ")
    )))
}

/// The measured points of some frames, which are spread evenly over all recordings.
fn points_of_some_frames(seen: &[&AlignedRecording]) -> Vec<Point> {
    let frames: Vec<_> = seen.iter().flat_map(|s| &s.frames).collect();
    let every = frames.len().div_ceil(DRAWN_FRAMES).max(1);
    let points = frames.into_iter().step_by(every).flat_map(|frame| {
        let marks = frame.contour.iter().chain(&frame.sensors).flatten().map(|m| m.at);
        marks.chain(frame.bones.iter().flatten().copied())
    });
    points.collect()
}

fn record(speaker: &Speaker, before: &Body<2>, doubts: &[String], notes: &[String]) -> Value {
    let muscles = speaker.lengths_m(before).map(|(muscle, before, after)| {
        json!({ "muscle": muscle, "before_mm": before * 1e3, "after_mm": after * 1e3, "stretch": after / before })
    });
    json!({
        "rest": speaker.how,
        "scale": speaker.similarity.scale(),
        "angle_deg": speaker.similarity.angle().to_degrees(),
        "rms_mm": speaker.rms_m.map(|r| r * 1e3),
        "least_area_ratio": speaker.least_area_ratio,
        "muscles": muscles.collect::<Vec<_>>(),
        "doubts": doubts,
        "notes": notes,
    })
}

fn text(speaker: &Speaker, before: &Body<2>) -> String {
    let header = ["muscle", "before, mm", "after, mm", "ratio"];
    let t = table::rows(&header, speaker.lengths_m(before), |(name, before, after)| {
        let [before_mm, after_mm] = [before, after].map(|m| format!("{:.1}", m * 1e3));
        [name.to_owned(), before_mm, after_mm, format!("{:.3}", after / before)]
    });
    let how = match speaker.how {
        RestShapeMethod::Similarity => "turned, scaled and shifted to the measured points of the speaker",
        RestShapeMethod::Joint => "the shape that explains many frames at once",
        RestShapeMethod::Contour => "the shape of the contour at rest",
    };
    let met =
        speaker.rms_m.map_or_else(String::new, |m| format!("; contours met to {:.2} mm (RMS)", 1e3 * m));
    let notes: String = speaker.notes.iter().map(|note| format!("but {note}\n")).collect();
    format!(
        "rest shape: {how}; scale {:.3}, turned by {:.1}°{met}\ncells keep at least {:.0} % of their area\n\n{t}\n{notes}",
        speaker.similarity.scale(),
        speaker.similarity.angle().to_degrees(),
        100.0 * speaker.least_area_ratio
    )
}
