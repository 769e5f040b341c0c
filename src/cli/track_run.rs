//! Progress and journal of a run of `tongue-fit track`.

use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use tongue_files::report::OutputDir;
use tongue_files::report::batch::journal::{Journal, JournalEntry};
use tongue_files::report::batch::sha256;
use tongue_files::run::{self, TrackRun, TrackedBody};
use tongue_infer::track::{TrackedRecording, Watch};
use tongue_input::measured::recording::AlignedRecording;

use super::{batch, output};

/// The given body, or one adapted to these recordings while a progress bar is shown.
pub fn speaker(run: &TrackRun<'_>, seen: &[&AlignedRecording]) -> anyhow::Result<TrackedBody> {
    let made = output::with_bar("{bar:40} rest shape, {eta} left", |progress| run.body(seen, progress))??;
    if let Some(similarity) = &made.similarity {
        run::check_scale(similarity.scale(), run::bones_apart_m(&made.followed))?;
        output::step(|| {
            let rms = made.rms_m.map_or_else(String::new, |r| format!(", contours met to {:.2} mm", r * 1e3));
            format!("{}: scale {:.3}{rms}", made.body.what, similarity.scale())
        });
    }
    Ok(made)
}

/// The journal of a run, with the recordings that an earlier run with the same inputs finished. `sound` is the tract that was read.
pub fn journal(
    run: &TrackRun<'_>,
    out: &OutputDir,
    seen: &[&AlignedRecording],
    sound: &str,
) -> anyhow::Result<Journal> {
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
pub fn resume(
    journal: Journal,
    count: usize,
    search: impl FnOnce(&Watch<'_>) -> anyhow::Result<()>,
) -> anyhow::Result<(Journal, Vec<TrackedRecording>)> {
    let clock = Instant::now();
    let recordings: Vec<Option<TrackedRecording>> = (0..count)
        .map(|nth| Ok(journal.read(nth)?.and_then(|entry| entry.result.ok())))
        .collect::<anyhow::Result<_>>()?;
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
