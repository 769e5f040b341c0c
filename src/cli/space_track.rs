//! `tongue-fit track FILES --body space` or a folder: activations that move a body in space to the measured points, which are in tables of
//! its nodes or in recordings.

use anyhow::{Context, Result, anyhow, bail, ensure};

use tongue_fit::body::{Body, DEFAULT_SPACING_M};
use tongue_fit::inner::measured::is_space_table;
use tongue_fit::inner::measured::recording::AlignedRecording;
use tongue_fit::inner::report::{self, Export, Json, Pvd, Vtu, joined, status_in_words, tally};
use tongue_fit::inner::run::{self, ScreenedRecording, SpaceSource, SpaceTrack, SpaceTrackFrame};
use tongue_fit::inner::standard_deviations::SPACE_MARK_MM;
use tongue_fit::inverse::{FitSettings, FitStatus, Recorded, SpaceSearch};
use tongue_fit::measured::Target;
use tongue_fit::system::TissueModel;

use super::space::ModelArguments;
use super::{Global, Outcome, output, recordings, table, untrusted_sentence};

/// Smaller shares of a muscle in a combination are not printed.
const SHARE: f64 = 0.2;
/// Each frame has a file for ParaView if there are at most so many; otherwise only the last one has.
const MOST_SHAPES: usize = 200;

#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Body in space")]
pub struct Arguments {
    /// Let the sides of a muscle be activated apart; by default they are alike
    #[arg(long, hide_short_help = true)]
    sides_apart: bool,
    /// Number of starting points of the search in space; the search of every further frame begins at the answer of the frame before
    #[arg(long, value_name = "N", default_value_t = FitSettings::default().starts, hide_short_help = true)]
    starts: usize,
    /// Standard deviation of each coordinate, distance or length, mm, for tables without a column sd_mm
    #[arg(long, value_name = "MM", default_value_t = SPACE_MARK_MM, hide_short_help = true)]
    sd: f64,
    #[command(flatten)]
    model: ModelArguments,
}

pub fn run(
    source: &SpaceSource,
    (recordings, as_is): (&recordings::Arguments, bool),
    arguments: &Arguments,
    global: &Global,
) -> Result<Outcome> {
    ensure!(
        arguments.sd.is_finite() && arguments.sd > 0.0,
        "--sd is {}; it must be a positive number of millimetres",
        arguments.sd
    );
    let body = arguments.model.body(source)?;
    // The columns of the first file say whether the files are tables of a body in space or recordings.
    let are_tables = match recordings.files.first() {
        Some(first) => is_space_table(first)
            .with_context(|| format!("cannot read \"{}\"; name a table or a recording", first.display()))?,
        None => false,
    };
    let (recorded, notes, implausible) = if are_tables {
        let recordings::Arguments { map, palate, speaker, format, .. } = recordings;
        if as_is || map.is_some() || palate.is_some() || speaker.is_some() || format.is_some() {
            bail!(
                "--map, --palate, --speaker, --format and --as-is are for recordings; leave them out with a table of a body in space"
            );
        }
        (Recorded::of_tables(&recordings.files, 1e-3 * arguments.sd)?, Vec::new(), None)
    } else {
        read_frames(source, &body, recordings, as_is)?
    };
    arguments.answer(&body, &recorded, (notes, implausible), "results/space-track", global)
}

/// Finds the activations of one vowel from its lengths: every measured muscle is an observation, and every muscle of the body may be
/// active.
pub fn fit(source: &SpaceSource, target: &Target, global: &Global) -> Result<Outcome> {
    let (starts, model) = (FitSettings::default().starts, ModelArguments::default());
    let arguments = Arguments { sides_apart: false, starts, sd: 0.0, model };
    let body = arguments.model.body(source)?;
    let note = format!(
        "{} /{}/ against /{}/, {}, in {}: the lines between the same points as in the plane; rest is /{}/ without tone",
        target.subject, target.vowel, target.baseline, target.kind, body.what, target.baseline
    );
    arguments.answer(&body, &Recorded::of_lengths(target, &body), (vec![note], None), "results/space", global)
}

impl Arguments {
    /// Searches one frame after another, and writes and prints the result. `implausible` says which recordings cannot be trusted.
    fn answer(
        &self,
        body: &Body<3>,
        recorded: &Recorded,
        (mut notes, implausible): (Vec<String>, Option<String>),
        folder: &str,
        global: &Global,
    ) -> Result<Outcome> {
        let (model, usual) = (self.model.model()?, SpaceSearch::default());
        let settings = FitSettings { starts: self.starts, ..usual.settings };
        let search = SpaceSearch { sides_apart: self.sides_apart, settings, ..usual };
        if let Some(tip) = body.tip().filter(|_| recorded.has_coils()) {
            let [x, _, z]: [f64; 3] = (1e3 * body.mesh.nodes[tip]).into();
            let at = format!("node {}, which is at x {x:.1}, z {z:.1} mm at rest", tip + 1);
            notes.push(format!("places of coils are counted from the tip, {at}; --tip names another"));
        }
        notes.iter().for_each(|note| output::note(note));
        let mut track = SpaceTrack::find(body, &model, recorded, &search, MOST_SHAPES, &output::tell_step)?;
        let mut statuses = track.frames.iter().map(|frame| frame.fit.answer.status);
        if track.is_alike && statuses.any(|status| status == FitStatus::TargetNotMet) {
            let note = "left and right were kept alike; --sides-apart meets what differs between them";
            output::note(note);
            notes.push(note.to_owned());
        }
        let bad = track.frames.iter().filter_map(|SpaceTrackFrame { fit, .. }| match fit.answer.status {
            FitStatus::Converged if fit.alarms.is_empty() => None,
            FitStatus::Converged => Some("with alarms".to_owned()),
            status => Some(status_in_words(&status)),
        });
        let doubtful = untrusted_sentence(&tally(bad), track.frames.len(), "frames");
        track.untrusted =
            implausible.into_iter().chain(doubtful).reduce(|all, next| format!("{all}; {next}"));
        track.notes = notes;
        let out = global.folder(folder)?;
        let Some(last) = track.frames.last() else { return Err(anyhow!("no frame was found")) };
        let title = "Tongue in space: at rest (light) and fitted to the measured points";
        let answer = &last.fit.answer;
        let picture = report::views(body, &answer.positions, &answer.tensions, title, None);
        let (picture, json) = (picture?, Json(&track));
        let shapes = track.frames.iter().map(|frame| &frame.fit.answer).filter(|a| !a.positions.is_empty());
        let vtus = shapes.map(|shape| Vtu::of(body, &shape.positions, &shape.tensions));
        let vtus = vtus.collect::<Result<Vec<_>, _>>()?;
        let is_one = vtus.len() == 1;
        let moments = track.frames.iter().enumerate().take(vtus.len()).map(|(nth, frame)| {
            if is_one {
                (0.0, "tongue.vtu".to_owned())
            } else {
                (frame.time_s.unwrap_or(nth as f64), format!("tongue_{nth:04}.vtu"))
            }
        });
        let pvd = Pvd(moments.collect());
        let by = super::provenance().with_tissue(TissueModel::Hexahedra);
        let mut files: Vec<(&str, &dyn Export)> = vec![("track.json", &json), ("tongue.svg", &picture)];
        files.extend((!is_one).then_some(("tongue.pvd", &pvd as &dyn Export)));
        files.extend(pvd.0.iter().zip(&vtus).map(|((_, name), vtu)| (name.as_str(), vtu as &dyn Export)));
        output::write_and_answer(global, (Some(&out), &files), &json, &by, || text(&track))?;
        Ok(Outcome::of_reasons(track.untrusted))
    }
}

/// The frames of recordings of the midsagittal plane, notes about them, and why recordings cannot be trusted.
fn read_frames(
    source: &SpaceSource,
    body: &Body<3>,
    recordings: &recordings::Arguments,
    as_is: bool,
) -> Result<(Recorded, Vec<String>, Option<String>)> {
    let (screened, left_out) = recordings.screen(&recordings.read()?, None)?;
    let seen: Vec<&AlignedRecording> = screened.iter().map(|r| &r.seen).collect();
    let is_placed = as_is || recordings.map()?.is_in_frame();
    // The built-in body has the outline of the tongue in the plane, whose bones are where recordings mark them.
    let section = match source {
        _ if is_placed => None,
        SpaceSource::BuiltIn => Some(Body::tongue(DEFAULT_SPACING_M)?),
        _ => Some(body.section()),
    };
    let palate = screened.iter().find_map(|r| r.palate.as_deref());
    let recorded = Recorded::of_recordings(&seen, section.as_ref(), palate)?;
    let mut notes = vec![
        "bones stay where the body has them, and every frame is a best estimate with the width that its own data leave: no intervals over \
         time, as `track` has them in the plane"
            .to_owned(),
    ];
    if let Some(placed) = &recorded.placed {
        let unusual = run::check_scale(placed.similarity.scale(), placed.bones_apart_m);
        notes.extend(unusual?);
        notes.push(format!(
            "the body was placed by the measured points: {:.3} times as large, turned by {:.1} degrees; that is uncertain by about a tenth and 9 \
             degrees, which the widths of activations do not include",
            placed.similarity.scale(),
            placed.similarity.angle().to_degrees()
        ));
    }
    notes.extend(
        screened.iter().flat_map(|r| r.seen.notes.iter().map(|note| format!("{}: {note}", r.seen.name))),
    );
    notes.extend(left_out);
    Ok((recorded, notes, ScreenedRecording::implausible(&screened)))
}

fn text(track: &SpaceTrack) -> String {
    let mut text = String::new();
    for SpaceTrackFrame { recording, time_s, fit } in &track.frames {
        if let Some(time) = time_s {
            let name = recording.as_ref().map_or_else(String::new, |name| format!("{name}, "));
            text += &format!("{name}at {time} s\n");
        }
        let t = table::rows(&["muscle", "activation", "95 %"], &fit.activations.0, |(name, a)| {
            let interval = fit.interval_95.get(name);
            let interval = interval.map_or_else(String::new, |[low, high]| format!("{low:.3} to {high:.3}"));
            [name.clone(), format!("{a:.3}"), interval]
        });
        text += &format!(
            "{t}\n{}: met to {:.2} mm (RMS), {:.2} mm at most; {} of {} starts ended here; {} factorisations\n",
            status_in_words(&fit.answer.status),
            1e3 * fit.rms_m,
            fit.distances_m.iter().map(|d| 1e3 * d).fold(0.0, f64::max),
            fit.ended_here(),
            fit.starts.len(),
            fit.factorisations
        );
        for open in fit.open() {
            let shares = open.direction.0.iter().filter(|(_, s)| s.abs() >= SHARE);
            let shares = joined(shares.map(|(name, s)| format!("{s:+.2} {name}")), " ");
            // An activation is at most 1.
            let sd = if open.sd < 1.0 { format!("±{:.2}", open.sd) } else { "without limit".to_owned() };
            text += &format!("open ({sd}; the prior decides): {shares}\n");
        }
        for other in fit.others_as_good() {
            let active = other.0.iter().filter(|(_, a)| *a > 0.01);
            text += &format!("as good: {}\n", joined(active.map(|(name, a)| format!("{name} {a:.2}")), ", "));
        }
        for alarm in &fit.alarms {
            text += &format!("alarm   {alarm}\n");
        }
    }
    text
}
