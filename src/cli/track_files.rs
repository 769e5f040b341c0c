//! Output files of tracking, among them that of the speaker's body, which `--mesh` of every command reads.

use std::io;
use std::path::PathBuf;

use anyhow::Result;
use serde_json::{Value, json};
use tongue_fit::body::Body;
use tongue_fit::body::json::MeshRecord;
use tongue_fit::inner::adapt::Adaptation;
use tongue_fit::inner::report::column;
use tongue_fit::inner::report::{
    Export, Json, OutputDir, Provenance, Pvd, RecordingResult, Ssff, TrackRecord, contrasts, draws_csv,
    formants_csv, repeats_columns, segments_csv, timelines, track_csv, track_page,
};
use tongue_fit::inner::track::Tracked;
use tongue_fit::system::Model;

use super::Outcome;

pub struct Done {
    pub record: TrackRecord,
    pub by: Provenance,
    pub written: Vec<PathBuf>,
    pub outcome: Outcome,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Also {
    /// Pictures: `track_1.svg` and the animation `shapes_1.svg` of the first recording
    Svg,
    /// Tensions over time for OpenSim: `track_1.sto`
    Sto,
    /// The same at one rate for EMU: `track_1.ssff`
    Ssff,
    /// Times in which the 95 % interval of a course excludes 0, for Praat: `track_1.TextGrid`
    Textgrid,
    /// Up to 100 draws of the tensions over every label in long form, for mixed models: `draws.csv`, 1 MB a label
    Draws,
    /// How well each course repeats where labels do: `repeats.csv`, as on the page
    Repeats,
    /// Shapes for ParaView: `shapes_1.pvd` with a `.vtu` for each frame
    Vtu,
}

#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Files")]
pub struct Arguments {
    /// Maximum number of frames of a recording whose shapes are kept for the page, animations and ParaView, equally spaced
    #[arg(long, value_name = "N", default_value_t = 100, hide_short_help = true)]
    pub frames: usize,
    /// Files beside the page and the tables, most of them for each recording, such as svg,sto
    #[arg(long, value_name = "FORMATS", value_delimiter = ',', hide_short_help = true)]
    also: Vec<Also>,
}

impl Arguments {
    pub fn kept_draws(&self) -> usize {
        if self.also.contains(&Also::Draws) { 100 } else { 0 }
    }
}

/// A file that is made when it is written.
fn made_later<'a, E: Export>(make: impl Fn() -> io::Result<E> + 'a) -> Box<dyn Export + 'a> {
    Box::new(move |out: &mut dyn io::Write, by: &Provenance| make()?.write(out, by))
}

pub fn write(
    out: &OutputDir,
    record: &TrackRecord,
    body: &Value,
    by: &Provenance,
    arguments: &Arguments,
) -> Result<Vec<PathBuf>> {
    let results = &record.results;
    let wants = |also: Also| arguments.also.contains(&also);
    let has_segments = results.recordings.iter().any(|one| !one.tracked.segments.is_empty());
    let repeats = record.repeats.as_ref().filter(|_| wants(Also::Repeats));
    let repeats = repeats.map(|found| column::table(&repeats_columns(found), &found.muscles.0));
    // Each file after whether it is written.
    let mut all: Vec<(bool, String, Box<dyn Export + '_>)> = vec![
        (true, "track.html".to_owned(), Box::new(track_page(record))),
        (true, "track.json".to_owned(), Box::new(Json(record))),
        (true, "track.csv".to_owned(), Box::new(track_csv(record))),
        (true, "body.json".to_owned(), Box::new(Json(body))),
        (has_segments, "segments.csv".to_owned(), Box::new(segments_csv(results))),
        (record.formants.is_some(), "formants.csv".to_owned(), Box::new(formants_csv(results))),
        (
            !record.comparisons.is_empty(),
            "contrasts.csv".to_owned(),
            Box::new(contrasts(&record.comparisons)),
        ),
        (repeats.is_some(), "repeats.csv".to_owned(), Box::new(repeats.unwrap_or_default())),
        (wants(Also::Draws), "draws.csv".to_owned(), Box::new(draws_csv(results))),
    ];
    let mut shapes: Vec<(String, Box<dyn Export + '_>)> = Vec::new();
    for (nth, one) in results.recordings.iter().enumerate() {
        let (number, muscles) = (nth + 1, &results.muscles);
        let shown: Vec<&Tracked> = one.tracked.frames.iter().filter(|f| !f.positions.is_empty()).collect();
        let has_animation = wants(Also::Svg) && !shown.is_empty();
        let mut moments = Vec::new();
        for (t, frame) in shown.into_iter().enumerate().filter(|_| wants(Also::Vtu)) {
            let name = format!("shapes_{number}_{t:04}.vtu");
            moments.push((frame.time_s, name.clone()));
            shapes.push((name, Box::new(results.vtu(one, frame))));
        }
        let text_grid = move |out: &mut dyn io::Write, _: &Provenance| one.write_text_grid(muscles, out);
        let drawing = made_later(move || Ok(timelines(one, &record.courses)));
        let animation = made_later(move || results.animation(one).map_err(io::Error::other));
        all.extend([
            (wants(Also::Sto), format!("track_{number}.sto"), made_later(move || Ok(one.sto(muscles)))),
            (
                wants(Also::Ssff),
                format!("track_{number}.ssff"),
                made_later(move || Ok(Ssff(one.sto(muscles)))),
            ),
            (wants(Also::Textgrid), format!("track_{number}.TextGrid"), Box::new(text_grid)),
            (wants(Also::Svg), format!("track_{number}.svg"), drawing),
            (has_animation, format!("shapes_{number}.svg"), animation),
            (!moments.is_empty(), format!("shapes_{number}.pvd"), Box::new(Pvd(moments))),
        ]);
    }
    all.retain(|(is_written, ..)| *is_written);
    let shown = all.len();
    let files: Vec<_> = all.into_iter().map(|(_, name, file)| (name, file)).chain(shapes).collect();
    let mut written = out.export(&files, by)?;
    written.truncate(shown);
    Ok(written)
}

/// A body with the shape at rest of the first recording, how it was adapted, and the other shapes at rest of recordings that were tracked
/// apart from the first one.
pub fn body_record(
    body: &Body<2>,
    model: &Model,
    adaptation: &Adaptation,
    recordings: &[RecordingResult],
) -> Result<Value> {
    let mut record = json!(MeshRecord::of(body, model)?);
    record["adaptation"] = json!(adaptation);
    let groups = recordings.chunk_by(|a, b| a.tracked.rest == b.tracked.rest).skip(1);
    let others = Vec::from_iter(groups.map(|group| {
        json!({
            "recordings": group.iter().map(|one| &one.seen.name).collect::<Vec<_>>(),
            "nodes_m": group[0].tracked.rest.iter().map(|p| [p.x, p.y]).collect::<Vec<_>>(),
        })
    }));
    if !others.is_empty() {
        record["other_rest_shapes"] = others.into();
    }
    Ok(record)
}
