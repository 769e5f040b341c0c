use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use tongue_fit::body::Body;
use tongue_fit::inner::adapt::{AdaptationInput, RestShapeMethod};
use tongue_fit::inner::choice;
use tongue_fit::inner::measured::recording::AlignedRecording;
use tongue_fit::inner::report::batch::journal::{Journal, JournalEntry};
use tongue_fit::inner::report::batch::sha256;
use tongue_fit::inner::report::{FormantsRecord, Json, OutputDir, RecordingResult, status_name, tally};
use tongue_fit::inner::run::{ScreenedRecording, TrackRun, TrackedBody, bones_apart_m, check_scale};
use tongue_fit::inner::statistics::distinct;
use tongue_fit::inner::track::{
    self, Frame, MOST_UNTRUSTED, TrackSettings, Tracked, TrackedRecording, Watch, is_untrusted,
};
use tongue_fit::system::TissueModel;

use super::inputs::choice_among;
use super::recordings::{self, GivenRecordings, Loaded, PriorArguments};
use super::track_files::{Done, body_record};
use super::track_sound::FORMANTS;
use super::{
    Global, Outcome, batch, body, output, space_track, track_files, track_sound, track_speakers, track_table,
};

#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "Examples:\n  \
    tongue-fit track speaker.tsv --out results/speaker\n  \
    tongue-fit track speaker.tsv --mesh results/speaker/body.json\n  \
    tongue-fit track speaker.tsv --hold-out 2,5,8\n  \
    tongue-fit track nodes.csv --body path/to/tongue3d\n  \
    tongue-fit track contour.csv lengths.csv --body space")]
pub struct Arguments {
    #[command(flatten)]
    recordings: recordings::Arguments,
    /// Method for the rest shape if no body is given. The intervals include what placing (similarity) leaves unknown of it, and the shape
    /// is then fitted for display; joint fits it first
    #[arg(long, value_name = "HOW", value_parser = choice_among::<RestShapeMethod>(&recordings::REST), default_value = "similarity", hide_short_help = true)]
    rest: RestShapeMethod,
    /// Use the body unchanged: the recordings are in its frame
    #[arg(long, conflicts_with = "rest")]
    as_is: bool,
    /// Contour points (numbers or names) or coils that are predicted instead of fitted, and compared with predictions of a spline,
    /// principal components and a Gaussian of the speaker
    #[arg(long, value_name = "POINTS", value_delimiter = ',')]
    hold_out: Vec<String>,
    /// Muscles that can contract [default: all of the body]
    #[arg(long, value_name = "MUSCLES", value_delimiter = ',', hide_short_help = true)]
    muscles: Vec<String>,
    /// A bone that may be displaced in recordings in which it was not seen, such as hyoid: near its place (5 mm), found together with the
    /// tensions; may be given several times
    #[arg(long, value_name = "NAME", hide_short_help = true)]
    free_bone: Vec<String>,
    /// Number of draws for the intervals
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(100..=100_000), hide_short_help = true)]
    draws: u32,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0, hide_short_help = true)]
    seed: u64,
    #[command(flatten)]
    prior: PriorArguments,
    #[command(flatten)]
    files: track_files::Arguments,
    #[command(flatten)]
    body: body::Arguments,
    #[command(flatten)]
    space: space_track::Arguments,
    #[command(flatten)]
    sound: track_sound::Arguments,
}

pub fn run(arguments: &Arguments, global: &Global) -> Result<Outcome> {
    if let Some(outcome) = arguments.recordings.write_template(global)? {
        return Ok(outcome);
    }
    if let Some(source) = arguments.body.space() {
        return space_track::run(source, (&arguments.recordings, arguments.as_is), &arguments.space, global);
    }
    let read = arguments.recordings.read()?;
    let speakers = distinct(read.iter().filter_map(|one| one.recording.speaker.clone()));
    if speakers.len() > 1 {
        let of_one = arguments.placed_by()?;
        if let Some(option) = arguments.recordings.palate.as_ref().map(|_| "--palate").or(of_one) {
            let speakers = speakers.iter().map(String::as_str);
            return Err(recordings::of_several(speakers, &format!("{option} is of one")));
        }
        let track = |read, out: &OutputDir, name: &str| track_speaker(arguments, read, out, Some(name));
        return track_speakers::run(global, read, &speakers, track);
    }
    let unnamed = read.iter().filter(|one| one.recording.speaker.is_none()).count();
    if let Some(name) = speakers.first().filter(|_| unnamed > 0) {
        let count = super::table::count_of(unnamed, "recording");
        output::note(&format!("{count} without the name of a speaker: taken for {name}'s"));
    }
    let done = track_speaker(arguments, read, &global.folder("results/track")?, None)?;
    output::answer(global, &Json(&done.record), &done.by, &done.written, || {
        track_table::track(&done.record)
    })?;
    Ok(done.outcome)
}

impl Arguments {
    /// The option that says that the body is in the frame of the recordings, if there is one.
    fn placed_by(&self) -> Result<Option<&'static str>> {
        let given = [
            (self.body.is_given(), "the body (--mesh, --anatomy)"),
            (self.as_is, "--as-is"),
            (self.recordings.map()?.is_in_frame(), "the placement in --map"),
        ];
        Ok(given.into_iter().find(|(is_given, _)| *is_given).map(|(_, option)| option))
    }
}

/// Tracks recordings of one speaker; `among` is the speaker's name if there are others.
fn track_speaker(
    arguments: &Arguments,
    read: Vec<Loaded>,
    out: &OutputDir,
    among: Option<&str>,
) -> Result<Done> {
    let clock = Instant::now();
    let given = GivenRecordings::read(&arguments.body)?;
    let is_given = arguments.placed_by()?.is_some();
    // The palate of a drawn body is the speaker's only if the body is used as it is.
    let is_drawn = arguments.body.is_given() || arguments.as_is;
    let palate = given.body.palate.as_deref().filter(|_| is_drawn);
    let (recordings, mut left_out) = arguments.recordings.screen(&read, palate)?;
    let contracting = contracting(arguments, &given.body)?;
    let hide = held_out_names(arguments, &recordings)?;
    let settings = TrackSettings {
        draws: arguments.draws as usize,
        seed: arguments.seed,
        shapes: arguments.files.frames,
        kept_draws: arguments.files.kept_draws(),
        ..arguments.prior.settings()?
    };
    // Without a name the seed stays as it is.
    let settings = settings.of_speaker(among.unwrap_or_default());
    let wall = recordings.iter().find_map(|r| r.palate.clone());
    let basis =
        AdaptationInput { contracting, palate: wall.as_deref(), ..given.basis(&arguments.body, settings) };
    let run = TrackRun {
        basis,
        adaptation: given.adaptation.as_ref(),
        is_given,
        rest: arguments.rest,
        free_bones: &arguments.free_bone,
        hide: &hide,
    };
    let seen: Vec<&AlignedRecording> = recordings.iter().map(|r| &r.seen).collect();
    run.check_free_bones(&seen).context("--free-bone")?;
    let mut notes = run.check(&recordings)?;
    let sound = arguments.sound.read()?;
    let speaker = speaker(&run, &seen)?;
    let contact = run.wall(&speaker.body, &output::note)?;
    let shape = run.shape(&speaker, contact.as_ref(), &seen, &output::note)?;
    if speaker.is_fitted() {
        notes.push(
            "the shape at rest was fitted to recordings: take levels from a run without it (neither --mesh nor --rest joint), \
             since bodies that fit alike can differ in them"
                .to_owned(),
        );
    }
    let sound_as_read = format!("{sound:?}");
    let sound = sound.map(|(given, lips)| {
        anyhow::Ok((track_sound::tract_around(&speaker.body, given, wall.as_deref())?, lips))
    });
    let sound = sound.transpose()?;
    let add_sound = |frames: &mut [Frame]| {
        sound.iter().for_each(|(airway, lips)| {
            track::add_formants(frames, airway, &speaker.followed, lips, FORMANTS)
        });
    };
    let unknown = (shape.as_ref(), contact.as_ref());
    // What refuses the input comes before, so that no journal is left.
    let journal = journal(&run, out, &seen, &sound_as_read)?;
    let (journal, found) =
        resume(journal, seen.len(), |watch| Ok(run.track(&speaker, unknown, &seen, &add_sound, watch)?))?;
    let implausible = ScreenedRecording::implausible(&recordings);
    let (mut record, unmet) = run.record(&speaker, recordings, found);
    let results = &record.results.recordings;
    if let Some(why) = unmet.first().filter(|_| results.is_empty()) {
        // A note may say why they cannot be reached.
        notes.iter().for_each(|n| output::note(n));
        journal.remove()?;
        bail!("{why}");
    }
    left_out.extend(unmet.into_iter().map(|why| format!("left out: {why}")));
    notes.splice(0..0, left_out.iter().cloned());
    notes.extend(ScreenedRecording::left_out(results));
    let untrusted = why_untrusted(results, &mut notes);
    let untrusted = implausible.into_iter().chain(untrusted);
    let untrusted = untrusted.reduce(|all, next| format!("{all}; {next}"));
    let outcome = Outcome::of_reasons(untrusted.clone());
    (record.untrusted, record.notes, record.wall_s) = (untrusted, notes, clock.elapsed().as_secs_f64());
    record.formants =
        sound.as_ref().map(|(airway, lips)| FormantsRecord::new(&airway.tract, lips, &record.results));
    record.notes.iter().for_each(|n| output::note(n));
    let recordings = &record.results.recordings;
    let mut body = speaker.body.clone();
    recordings.first().iter().for_each(|one| body.mesh.nodes.clone_from(&one.tracked.rest));
    let adaptation = speaker.adaptation_after_tracking(&body);
    let body = body_record(&body, &run.basis.model, &adaptation, recordings)?;
    let by = super::provenance().with_tissue(TissueModel::of(&speaker.body.mesh));
    let written = track_files::write(out, &record, &body, &by, &arguments.files)?;
    journal.remove()?;
    let is_whole = left_out.is_empty() || outcome != Outcome::Good;
    let outcome = if is_whole { outcome } else { Outcome::SomeRowsRefused };
    Ok(Done { record, by, written, outcome })
}

/// Why recordings cannot be trusted, if one has too many frames that cannot; if there are fewer such frames, a note is added.
fn why_untrusted(results: &[RecordingResult], notes: &mut Vec<String>) -> Option<String> {
    let most = 100.0 * MOST_UNTRUSTED;
    let bad: Vec<&RecordingResult> = results.iter().filter(|one| is_untrusted(&one.tracked.frames)).collect();
    let all = untrusted_frames(&results.iter().flat_map(|one| &one.tracked.frames).collect::<Vec<_>>())?;
    let Some(first) = bad.first() else {
        notes.push(format!(
            "{all}, no more than {most:.0} % of any recording; track.csv has the status of each"
        ));
        return None;
    };
    let own = untrusted_frames(&first.tracked.frames.iter().collect::<Vec<_>>())?;
    Some(match (results.len(), bad.len()) {
        (1, _) => own,
        (_, 1) => format!("{}: {own}", first.seen.name),
        (_, more) => {
            format!(
                "{all}; in {more} recordings these are more than {most:.0} %, first in {}",
                first.seen.name
            )
        }
    })
}

fn untrusted_frames(frames: &[&Tracked]) -> Option<String> {
    let bad = frames.iter().filter(|f| !f.status.is_trusted()).map(|f| status_name(&f.status));
    super::untrusted_sentence(&tally(bad), frames.len(), "frames")
}

fn contracting(arguments: &Arguments, body: &Body<2>) -> Result<Vec<usize>> {
    let names = match &arguments.muscles[..] {
        [] => distinct(body.mesh.muscle_names()),
        given => given.to_vec(),
    };
    ensure!(!names.is_empty(), "{} has no muscles; name curves of its mesh after them", body.what);
    let mut numbers = Vec::new();
    for name in &names {
        let number = body.muscle(name.trim())?;
        let name = &body.mesh.muscles[number].name;
        ensure!(!numbers.contains(&number), "--muscles: {name} is given twice; give each muscle once");
        numbers.push(number);
    }
    Ok(numbers)
}

fn held_out_names(arguments: &Arguments, recordings: &[ScreenedRecording]) -> Result<Vec<String>> {
    let first = recordings.iter().take(1).map(|r| &r.seen);
    let points = first.flat_map(|s| s.contour.iter().chain(s.sensors.iter().map(|(name, _)| name)));
    let known: Vec<&String> = points.collect();
    let mut out = Vec::new();
    for word in arguments.hold_out.iter().map(|word| word.trim()) {
        let ending = format!("_{word}");
        let point = known
            .iter()
            .find(|n| n.as_str() == word || (word.parse::<u32>().is_ok() && n.ends_with(&ending)));
        let point = point.copied().with_context(|| {
            let hint = choice::hint(word, known.iter().map(|name| name.as_str()));
            format!("--hold-out {word}: there is no such contour point or coil; {hint}")
        })?;
        ensure!(!out.contains(point), "--hold-out: {point} is given twice; give each point once");
        out.push(point.clone());
    }
    // A coil has two coordinates.
    let left = |s: &AlignedRecording| {
        s.contour.iter().filter(|n| !out.contains(n)).count()
            + 2 * s.sensors.iter().filter(|(n, _)| !out.contains(n)).count()
    };
    if !out.is_empty() && recordings.iter().any(|r| left(&r.seen) < track::FEWEST) {
        bail!("--hold-out leaves fewer than three contour points or two coils to fit; hold out fewer");
    }
    Ok(out)
}

/// The given body, or one adapted to these recordings while a progress bar is shown.
fn speaker(run: &TrackRun<'_>, seen: &[&AlignedRecording]) -> Result<TrackedBody> {
    let made = output::with_bar("{bar:40} rest shape, {eta} left", |progress| run.body(seen, progress))??;
    if let Some(similarity) = &made.similarity {
        check_scale(similarity.scale(), bones_apart_m(&made.followed))?;
        output::step(|| {
            let rms = made.rms_m.map_or_else(String::new, |r| format!(", contours met to {:.2} mm", r * 1e3));
            format!("{}: scale {:.3}{rms}", made.body.what, similarity.scale())
        });
    }
    Ok(made)
}

/// The journal of a run, with the recordings that an earlier run with the same inputs finished. `sound` is the tract that was read.
fn journal(run: &TrackRun<'_>, out: &OutputDir, seen: &[&AlignedRecording], sound: &str) -> Result<Journal> {
    let (mesh, model) = (&run.basis.body.mesh, run.basis.model);
    let key = sha256(&[
        tongue_fit::VERSION,
        &super::words_of_the_result().join(" "),
        &format!("{seen:?}"),
        &format!("{mesh:?} {model:?} {:?}", run.adaptation),
        sound,
    ]);
    batch::open_journal(out.path().join("track.journal"), &key, seen.len(), (seen.len(), "recordings"))
}

/// Recordings with more frames are not kept, because their entry would be too large for a journal.
const MOST_KEPT: usize = 5000;

/// The results of all `count` recordings: those in the journal, and those of the search, which are added to it.
fn resume(
    journal: Journal,
    count: usize,
    search: impl FnOnce(&Watch<'_>) -> Result<()>,
) -> Result<(Journal, Vec<TrackedRecording>)> {
    let clock = Instant::now();
    let recordings: Vec<Option<TrackedRecording>> = (0..count)
        .map(|nth| Ok(journal.read(nth)?.and_then(|entry| entry.result.ok())))
        .collect::<Result<_>>()?;
    let wanted: Vec<bool> = recordings.iter().map(Option::is_none).collect();
    let state = Mutex::new((journal, recordings, Ok(())));
    let take = |nth: usize, recording: TrackedRecording| {
        let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
        let (journal, recordings, written) = &mut *state;
        let is_kept = recording.frames.len() <= MOST_KEPT;
        let entry = JournalEntry { job: nth, wall_s: clock.elapsed().as_secs_f64(), result: Ok(recording) };
        if is_kept && written.is_ok() {
            *written = journal.append(&entry);
        }
        recordings[nth] = entry.result.ok();
    };
    if wanted.contains(&true) {
        output::with_bar("{bar:40} {percent:>3} % of the tensions, {eta} left", |progress| {
            search(&Watch { progress, is_wanted: &|nth| wanted[nth], take: &take })
        })??;
    }
    let (journal, recordings, written) = state.into_inner().unwrap_or_else(PoisonError::into_inner);
    written?;
    Ok((journal, recordings.into_iter().flatten().collect()))
}
