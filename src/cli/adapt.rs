//! `tongue-fit adapt`: makes a speaker's body.

use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, miette};
use serde::Serialize;
use tongue_fit::adapt::{Basis, How, Landmarks, Speaker};
use tongue_fit::body::Body;
use tongue_fit::geometry::Point;
use tongue_fit::measured::recording::AlignedRecording;
use tongue_fit::report::{self, Export, Json, OutputDir, SectionPicture};

use super::body_file::BodyFile;
use super::choice::choice_among;
use super::recordings::{self, Given, PriorArguments};
use super::{Global, Outcome, body, output, recording_checks, table};

/// Most frames of recordings in the picture.
const DRAWN_FRAMES: usize = 20;

/// Options of `tongue-fit adapt`.
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(after_help = "Examples:\n  \
    tongue-fit adapt speaker.tsv --out results/speaker\n  \
    tongue-fit adapt --landmarks speaker.csv --contour rest.mrk.json\n\n\
    Writes body.json, which --mesh of every command takes, and rest.svg: the shape at rest over what was seen.")]
pub struct Arguments {
    #[command(flatten)]
    recordings: recordings::Arguments,
    /// Method for the rest shape from recordings: joint, the shape that explains many frames at once, or
    /// similarity, the body only turned, scaled and shifted to the speaker's bones
    #[arg(long, value_name = "HOW", value_parser = choice_among::<How>(&recordings::REST), default_value = "joint")]
    rest: How,
    /// Landmarks of one posture at rest instead of recordings: mental_spine, hyoid (CSV point,x_mm,y_mm
    /// or 3D Slicer's .mrk.json)
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

#[derive(Serialize)]
struct Length {
    muscle: String,
    before_mm: f64,
    after_mm: f64,
    stretch: f64,
}

#[derive(Serialize)]
struct Record {
    rest: How,
    scale: f64,
    angle_deg: f64,
    rms_mm: Option<f64>,
    least_area_ratio: f64,
    muscles: Vec<Length>,
    /// Reasons not to trust the body; empty where there are none.
    doubts: Vec<String>,
    notes: Vec<String>,
}

pub fn run(arguments: &Arguments, global: &Global) -> miette::Result<Outcome> {
    let given = Given::read(&arguments.body)?;
    let basis = given.basis(&arguments.body, arguments.prior.settings()?);
    let (mut notes, mut is_whole, mut implausible) = (Vec::new(), true, None);
    let (mut speaker, seen) = match &arguments.landmarks {
        Some(path) => {
            let map = arguments.recordings.map()?;
            let read = |path: &Path| -> miette::Result<Landmarks> {
                let bytes = tongue_fit::files::read(path).map_err(|e| {
                    miette!("cannot read {}: {e}; {}", path.display(), tongue_fit::files::advice(&e))
                })?;
                Landmarks::from_bytes(&bytes, &path.display().to_string(), &map).into_diagnostic()
            };
            let mut landmarks = read(path)?;
            if let Some(contour) = &arguments.contour {
                landmarks = landmarks.with_contour(read(contour)?);
            }
            if let Some(problem) = landmarks.doubt() {
                return Err(miette!("{}: {problem}", path.display()));
            }
            let seen = landmarks.contour.iter().chain(landmarks.named.values()).copied().collect();
            (basis.to_landmarks(&landmarks).into_diagnostic()?, seen)
        }
        None => {
            if arguments.recordings.files.is_empty() && !arguments.recordings.example {
                return Err(miette!("name recordings of the speaker, or --landmarks of one posture at rest"));
            }
            let (recordings, left_out) = arguments.recordings.read(None)?;
            recording_checks::check_points(&recordings, &given.body)?;
            is_whole = left_out.is_empty();
            implausible = recording_checks::with_implausible(&recordings, None);
            notes = left_out;
            notes.extend(recording_checks::notes(&recordings, &given.body, &[]));
            let palate = recordings.iter().find_map(|r| r.palate.as_deref());
            let basis = Basis { palate, ..basis };
            let seen: Vec<_> = recordings.iter().map(|r| &r.seen).collect();
            notes.extend(basis.place(&seen, &[]).into_diagnostic()?.doubt());
            notes.iter().for_each(|n| output::note(n));
            let speaker = output::with_bar("{bar:40} rest shape, {eta} left", |progress| {
                basis.to_recordings(&seen, arguments.rest, &[], progress)
            })?;
            (speaker.into_diagnostic()?, drawn(&seen))
        }
    };
    let apart_m = recording_checks::bones_apart_m(&speaker.followed);
    speaker.notes.extend(recording_checks::check_scale(speaker.similarity.scale(), apart_m)?);
    let out = global.folder("results/speaker")?;
    let mut doubts = speaker.doubts(&given.body);
    doubts.extend(implausible);
    let mut record = Record { doubts: doubts.clone(), ..record(&speaker, &given.body) };
    let said = text(&record);
    record.notes.extend(notes);
    let written = write(&out, &speaker, &given.body, &seen, &record, arguments)?;
    output::answer(global, &Json(&record), &super::provenance(), &written, || said)?;
    if doubts.is_empty() {
        return Ok(if is_whole { Outcome::Good } else { Outcome::SomeRowsRefused });
    }
    Ok(Outcome::Untrustworthy(format!(
        "this body is not to be trusted: {}; check rest.svg, and the unit, the places and the names of the landmarks",
        doubts.join("; ")
    )))
}

/// What was seen in some frames of recordings, evenly chosen.
fn drawn(seen: &[&AlignedRecording]) -> Vec<Point> {
    let frames: Vec<_> = seen.iter().flat_map(|s| &s.frames).collect();
    let every = frames.len().div_ceil(DRAWN_FRAMES).max(1);
    let mut out = Vec::new();
    for frame in frames.iter().step_by(every) {
        out.extend(frame.contour.iter().chain(&frame.sensors).flatten().map(|m| m.at));
        out.extend(frame.bones.iter().flatten());
    }
    out
}

fn record(speaker: &Speaker, before: &Body<2>) -> Record {
    let length = |(a, b): (&tongue_fit::body::MuscleChain, &tongue_fit::body::MuscleChain)| {
        let (before_m, after_m) = (before.mesh.distance(a.ends()), speaker.body.mesh.distance(b.ends()));
        Length {
            muscle: a.name.clone(),
            before_mm: before_m * 1e3,
            after_mm: after_m * 1e3,
            stretch: after_m / before_m,
        }
    };
    Record {
        rest: speaker.how,
        scale: speaker.similarity.scale(),
        angle_deg: speaker.similarity.angle().to_degrees(),
        rms_mm: speaker.rms_m.map(|r| r * 1e3),
        least_area_ratio: speaker.least_area_ratio,
        muscles: before.mesh.muscles.iter().zip(&speaker.body.mesh.muscles).map(length).collect(),
        doubts: Vec::new(),
        notes: speaker.notes.clone(),
    }
}

fn write(
    out: &OutputDir,
    speaker: &Speaker,
    before: &Body<2>,
    seen: &[Point],
    record: &Record,
    arguments: &Arguments,
) -> miette::Result<Vec<PathBuf>> {
    let mesh = &speaker.body.mesh;
    let adaptation = speaker.adaptation();
    let file = BodyFile::new(&speaker.body, &arguments.body.model(), adaptation)?;
    let at_rest = vec![0.0; mesh.muscles.len()];
    let palate = speaker.body.palate.as_deref().unwrap_or_default();
    let mut similar = before.mesh.clone();
    similar.nodes.iter_mut().for_each(|p| *p = speaker.similarity.place(*p));
    let (title, grey) = (
        "The speaker's tongue at rest over what was seen (dots; grey: turned and scaled only)",
        "turned and scaled only",
    );
    let section = SectionPicture::new(&similar, &mesh.nodes, &at_rest, palate, title);
    let picture = report::tongue(&SectionPicture { seen, grey, ..section }).into_diagnostic()?;
    let files: [(&str, &dyn Export); 3] =
        [("body.json", &Json(&file)), ("adapt.json", &Json(record)), ("rest.svg", &picture)];
    out.export(&files, &super::provenance()).into_diagnostic()
}

fn text(record: &Record) -> String {
    let t = table::rows(&["muscle", "before, mm", "after, mm", "ratio"], &record.muscles, |m| {
        let [before, after] = [m.before_mm, m.after_mm].map(|mm| format!("{mm:.1}"));
        [m.muscle.clone(), before, after, format!("{:.3}", m.stretch)]
    });
    let how = match record.rest {
        How::Similarity => "turned, scaled and shifted to what was seen of the speaker",
        How::Joint => "the shape that explains many frames at once",
        How::Contour => "the shape of the contour at rest",
    };
    let met = record.rms_mm.map_or_else(String::new, |mm| format!("; contours met to {mm:.2} mm (RMS)"));
    let notes: String = record.notes.iter().map(|note| format!("but {note}\n")).collect();
    format!(
        "rest shape: {how}; scale {:.3}, turned by {:.1}°{met}\ncells keep at least {:.0} % of their area\n\n{t}\n{notes}",
        record.scale,
        record.angle_deg,
        100.0 * record.least_area_ratio
    )
}
