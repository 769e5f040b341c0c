//! Output files of tracking, among them that of the speaker's body, which `--mesh` of every command reads.

use std::io;
use std::path::PathBuf;

use serde_json::{Value, json};
use tongue_fit::body::Body;
use tongue_fit::body::json::MeshRecord;
use tongue_fit::inner::adapt::Adaptation;
use tongue_fit::inner::report::column;
use tongue_fit::inner::report::{
    Export, Json, OutputDir, Provenance, Pvd, RecordingResult, Ssff, TrackRecord, contrasts, draws_csv,
    formants_csv, repeats_columns, segments_csv, timelines, track_csv, track_page,
};
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

type NamedExport<'a> = (String, Box<dyn Export + 'a>);

pub fn write(
    out: &OutputDir,
    record: &TrackRecord,
    body: &Value,
    by: &Provenance,
    arguments: &Arguments,
) -> anyhow::Result<Vec<PathBuf>> {
    let results = &record.results;
    let mut files: Vec<NamedExport<'_>> = vec![
        ("track.html".to_owned(), Box::new(track_page(record))),
        ("track.json".to_owned(), Box::new(Json(record))),
        ("track.csv".to_owned(), Box::new(track_csv(record))),
        ("body.json".to_owned(), Box::new(Json(body))),
    ];
    let wants = |also: Also| arguments.also.contains(&also);
    let has_segments = results.recordings.iter().any(|one| !one.tracked.segments.is_empty());
    let repeats = record.repeats.as_ref().filter(|_| wants(Also::Repeats));
    let repeats = repeats.map(|found| column::table(&repeats_columns(found), &found.muscles.0));
    let of_all: [(bool, &str, Box<dyn Export + '_>); 5] = [
        (has_segments, "segments.csv", Box::new(segments_csv(results))),
        (record.formants.is_some(), "formants.csv", Box::new(formants_csv(results))),
        (!record.comparisons.is_empty(), "contrasts.csv", Box::new(contrasts(&record.comparisons))),
        (repeats.is_some(), "repeats.csv", Box::new(repeats.unwrap_or_default())),
        (wants(Also::Draws), "draws.csv", Box::new(draws_csv(results))),
    ];
    let of_all = of_all.into_iter().filter(|(is_there, ..)| *is_there);
    files.extend(of_all.map(|(_, name, made)| (name.to_owned(), made)));
    let mut others: Vec<NamedExport<'_>> = Vec::new();
    for (nth, one) in results.recordings.iter().enumerate() {
        let number = nth + 1;
        let shown = one.tracked.frames.iter().filter(|f| !f.positions.is_empty());
        if wants(Also::Sto) {
            files.push((format!("track_{number}.sto"), Box::new(one.sto(&results.muscles))));
        }
        if wants(Also::Ssff) {
            files.push((format!("track_{number}.ssff"), Box::new(Ssff(one.sto(&results.muscles)))));
        }
        if wants(Also::Textgrid) {
            let made = |out: &mut dyn io::Write, _: &Provenance| one.write_text_grid(&results.muscles, out);
            files.push((format!("track_{number}.TextGrid"), Box::new(made)));
        }
        if wants(Also::Svg) {
            let made = move |out: &mut dyn io::Write, by: &Provenance| {
                timelines(one, &record.courses).write(out, by)
            };
            files.push((format!("track_{number}.svg"), Box::new(made)));
        }
        if wants(Also::Svg) && shown.clone().next().is_some() {
            let made = move |out: &mut dyn io::Write, by: &Provenance| {
                results.animation(one).map_err(io::Error::other)?.write(out, by)
            };
            files.push((format!("shapes_{number}.svg"), Box::new(made)));
        }
        if wants(Also::Vtu) && shown.clone().next().is_some() {
            let mut moments = Vec::new();
            for (t, frame) in shown.enumerate() {
                let name = format!("shapes_{number}_{t:04}.vtu");
                moments.push((frame.time_s, name.clone()));
                others.push((name, Box::new(results.vtu(one, frame))));
            }
            files.push((format!("shapes_{number}.pvd"), Box::new(Pvd(moments))));
        }
    }
    let shown = files.len();
    files.extend(others);
    let all: Vec<(&str, &dyn Export)> = files.iter().map(|(n, e)| (n.as_str(), e.as_ref())).collect();
    let mut written = out.export(&all, by)?;
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
) -> anyhow::Result<Value> {
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
