//! Output files of tracking.

use std::path::PathBuf;

use miette::IntoDiagnostic;
use tongue_fit::body::Body;
use tongue_fit::geometry::Point;
use tongue_fit::measured::recording::AlignedRecording;
use tongue_fit::report::{
    AnimationFrame, Export, Json, OutputDir, Pvd, Timeline, TrackPage, TrackPicture, TrackRecord, Vtu,
    animation_of_seen, timelines,
};
use tongue_fit::system::TissueModel;
use tongue_fit::track::{FrameStatus, Gesture, LabelMean, Tracked, TrackedRecording};

use super::body_file::BodyFile;

/// Result of one recording.
pub struct Found {
    /// The body with which it was tracked.
    pub body: Body<2>,
    /// Numbers of the contracting muscles, in the order of tensions.
    pub contracting: Vec<usize>,
    pub frames: Vec<Tracked>,
    /// Its gestures.
    pub gestures: Vec<Gesture>,
    /// Its labelled stretches.
    pub segments: Vec<LabelMean>,
}

impl Found {
    /// The result of a recording that was tracked with a body, shown at the rest shape that was found.
    pub fn of(mut body: Body<2>, contracting: &[usize], recording: TrackedRecording) -> Self {
        let TrackedRecording { rest, frames, gestures, segments } = recording;
        body.mesh.nodes = rest;
        Self { body, contracting: contracting.to_vec(), frames, gestures, segments }
    }
}

/// Options of the files beside the tables.
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Files")]
pub struct Arguments {
    /// Maximum number of frames of a recording in the animation and for ParaView, equally spaced; 0 writes
    /// neither
    #[arg(long, value_name = "N", default_value_t = 100)]
    frames: usize,
}

type File<'a> = (String, Box<dyn Export + 'a>);

/// Writes all files and returns those of interest to a reader.
pub fn write(
    out: &OutputDir,
    record: &TrackRecord,
    bodies: &[(String, BodyFile)],
    (seen, found): (&[&AlignedRecording], &[Found]),
    palate: &[Point],
    tissue: TissueModel,
    arguments: &Arguments,
) -> miette::Result<Vec<PathBuf>> {
    let by = super::provenance().with_tissue(tissue);
    let shapes: Vec<Vec<AnimationFrame>> =
        found.iter().map(|f| moments(&f.frames, arguments.frames).map(|t| frame(f, t)).collect()).collect();
    let mut files: Vec<File<'_>> = vec![
        ("track.json".to_owned(), Box::new(Json(record))),
        ("track.csv".to_owned(), Box::new(record.table())),
    ];
    for (name, body) in bodies {
        files.push((name.clone(), Box::new(Json(body))));
    }
    if !record.segments.is_empty() {
        files.push(("segments.csv".to_owned(), Box::new(record.segments_table())));
    }
    if record.formants.is_some() {
        files.push(("formants.csv".to_owned(), Box::new(record.formants_table())));
    }
    let repeated = record.repeats.as_ref().map(|found| found.picture());
    if let (Some(found), Some(picture)) = (&record.repeats, &repeated) {
        files.push(("repeats.csv".to_owned(), Box::new(found.table())));
        files.push(("repeats.svg".to_owned(), Box::new(picture.clone())));
    }
    let mut pictures = Vec::new();
    let mut others: Vec<File<'_>> = Vec::new();
    for (nth, (one, of)) in seen.iter().zip(found).enumerate() {
        let number = nth + 1;
        let courses = courses(record, one, &of.frames);
        files.push((format!("track_{number}.sto"), Box::new(record.sto(&one.name))));
        files.push((format!("track_{number}.svg"), Box::new(courses.clone())));
        let mut animation = None;
        if !shapes[nth].is_empty() {
            let name = format!("shapes_{number}.svg");
            let marks: Vec<Vec<_>> = moments(&of.frames, arguments.frames)
                .map(|t| {
                    let frame = &one.frames[t];
                    let marks = frame.contour.iter().chain(&frame.sensors).flatten().map(|m| m.at);
                    marks.chain(frame.bones.iter().flatten().copied()).collect()
                })
                .collect();
            let title = format!(
                "{}: measured (dots) and simulated; muscles coloured by tension, with their largest",
                one.name
            );
            let svg = animation_of_seen(&of.body.mesh, palate, &shapes[nth], &marks, one.mirrored, &title)
                .into_diagnostic()?;
            files.push((name.clone(), Box::new(svg.clone())));
            let span_s = shapes[nth].last().map_or(0.0, |last| last.time) - shapes[nth][0].time;
            animation = Some((name, svg, span_s.max(0.1)));
            let mut moments = Vec::new();
            for (t, shape) in shapes[nth].iter().enumerate() {
                let name = format!("shapes_{number}_{t:04}.vtu");
                let vtu = Vtu::new(&of.body.mesh, &shape.positions, &shape.tensions).into_diagnostic()?;
                moments.push((shape.time, name.clone()));
                others.push((name, Box::new(vtu)));
            }
            others.push((format!("shapes_{number}.pvd"), Box::new(Pvd(moments))));
        }
        pictures.push(TrackPicture { recording: one.name.clone(), courses, animation });
    }
    let page = TrackPage { record, pictures, repeats: repeated };
    files.insert(0, ("track.html".to_owned(), Box::new(page)));
    let shown = files.len();
    files.extend(others);
    let all: Vec<(&str, &dyn Export)> = files.iter().map(|(n, e)| (n.as_str(), e.as_ref())).collect();
    let mut written = out.export(&all, &by).into_diagnostic()?;
    written.truncate(shown);
    Ok(written)
}

/// Numbers of at most `most` frames, equally spaced.
fn moments(frames: &[Tracked], most: usize) -> impl Iterator<Item = usize> {
    let every = if most == 0 { usize::MAX } else { frames.len().div_ceil(most).max(1) };
    (0..if most == 0 { 0 } else { frames.len() }).step_by(every)
}

fn frame(found: &Found, t: usize) -> AnimationFrame {
    let tracked = &found.frames[t];
    let mut tensions = vec![0.0; found.body.mesh.muscles.len()];
    for (muscle, tension) in found.contracting.iter().zip(tracked.tensions_n()) {
        tensions[*muscle] = tension;
    }
    AnimationFrame { time: tracked.time_s, positions: tracked.positions.clone(), tensions }
}

fn courses(record: &TrackRecord, seen: &AlignedRecording, frames: &[Tracked]) -> tongue_fit::report::Svg {
    let times: Vec<f64> = frames.iter().map(|f| f.time_s).collect();
    let doubtful: Vec<bool> = frames.iter().map(|f| f.status != FrameStatus::Converged).collect();
    let line = |(i, course): (usize, &tongue_fit::report::CourseRecord)| Timeline {
        name: course.muscle.clone(),
        known: course.known,
        values: frames.iter().map(|f| [f.levels[i].median, f.levels[i].low, f.levels[i].high]).collect(),
    };
    let lines: Vec<Timeline> = record.courses.iter().enumerate().map(line).collect();
    let rms_mm: Vec<Option<f64>> = frames.iter().map(|f| f.rms_m.map(|r| 1e3 * r)).collect();
    timelines(&seen.name, &times, &doubtful, &rms_mm, &seen.labels, &lines)
}
