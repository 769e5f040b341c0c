//! `tongue-fit track` for recordings of several speakers: each is tracked on a body of its own, and their differences between labels are
//! combined.

use std::path::PathBuf;

use anyhow::{Result, ensure};
use serde::Serialize;
use serde_json::json;
use tongue_fit::inner::posterior::OverSpeakers;
use tongue_fit::inner::report::{Export, Json, OutputDir, over_speakers};
use tongue_fit::inner::track::Comparison;

use super::recordings::Loaded;
use super::track_files::Done;
use super::{Global, Outcome, output, table};

#[derive(Debug, Serialize)]
struct TrackedSpeaker {
    name: String,
    /// Where the files are; `None` without results.
    folder: Option<PathBuf>,
    frames: usize,
    recordings: usize,
    /// Why the results cannot be trusted, or why there are none.
    problem: Option<String>,
}

/// Tracks each speaker of `names`; `track` gets the recordings of one, the folder of the results and the name.
pub fn run(
    global: &Global,
    mut read: Vec<Loaded>,
    names: &[String],
    track: impl Fn(Vec<Loaded>, &OutputDir, &str) -> Result<Done>,
) -> Result<Outcome> {
    let out = global.folder("results/track")?;
    let unnamed = read.iter().filter(|one| one.recording.speaker.is_none()).count();
    if unnamed > 0 {
        output::note(&format!(
            "left out: {} without the name of a speaker",
            table::count_of(unnamed, "recording")
        ));
    }
    let (mut speakers, mut comparisons, mut is_whole): (_, Vec<Comparison>, _) =
        (Vec::new(), Vec::new(), unnamed == 0);
    for (number, name) in names.iter().enumerate() {
        output::note(&format!("speaker {name} ({} of {})", number + 1, names.len()));
        let own = read.extract_if(.., |one| one.recording.speaker.as_ref() == Some(name)).collect();
        let folder = out.path().join(folder(number, name, &names[..number]));
        let made = OutputDir::prepare(&folder).map_err(Into::into);
        let (mut frames, mut recordings) = (0, 0);
        let problem = match made.and_then(|out| track(own, &out, name)) {
            Ok(done) => {
                (frames, recordings) = (done.record.results.frames().count(), done.record.recordings.len());
                is_whole &= done.outcome != Outcome::SomeRowsRefused;
                // Differences that cannot be trusted are not counted.
                if done.record.untrusted.is_none() {
                    comparisons.extend(done.record.comparisons);
                }
                done.record.untrusted
            }
            Err(why) => {
                is_whole = false;
                let message = why.to_string();
                output::error(&why.context(format!("left out: speaker {name}")));
                Some(message)
            }
        };
        let folder = (recordings > 0).then_some(folder);
        speakers.push(TrackedSpeaker { name: name.clone(), folder, frames, recordings, problem });
    }
    ensure!(speakers.iter().any(|s| s.recordings > 0), "no speaker could be tracked");
    let contrasts = comparisons.iter().flat_map(|c| c.contrasts.iter().map(|one| (c.tier.as_str(), one)));
    let over = OverSpeakers::all(contrasts);
    let record = json!({ "speakers": speakers, "over_speakers": over });
    let (json, csv, by) = (Json(&record), over_speakers(&over), super::provenance());
    let files: [(&str, &dyn Export); 2] = [("speakers.json", &json), ("over_speakers.csv", &csv)];
    output::write_and_answer(global, (Some(&out), &files), &json, &by, || text(&speakers, &over))?;
    let tracked = speakers.iter().filter(|s| s.recordings > 0);
    let doubtful: Vec<String> =
        tracked.filter_map(|s| Some(format!("{}: {}", s.name, s.problem.as_ref()?))).collect();
    Ok(match (doubtful.is_empty(), is_whole) {
        (true, true) => Outcome::Good,
        (true, false) => Outcome::SomeRowsRefused,
        (false, _) => Outcome::of_reasons(doubtful),
    })
}

/// The folder of a speaker: the name if it is short, of ASCII letters, and differs from the names before not only in upper and lower case;
/// otherwise the number.
fn folder(number: usize, name: &str, before: &[String]) -> String {
    const LONGEST: usize = 60;
    let is_own = !before.iter().any(|other| other.eq_ignore_ascii_case(name));
    let is_short = (1..=LONGEST).contains(&name.len()) && !name.to_lowercase().starts_with("speaker_");
    if is_own && is_short && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-') {
        name.to_owned()
    } else {
        format!("speaker_{}", number + 1)
    }
}

fn text(speakers: &[TrackedSpeaker], over: &[OverSpeakers]) -> String {
    let header = ["speaker", "recordings", "frames", "results in", "problem"];
    let mut t = table::rows(&header, speakers, |s| {
        let [recordings, frames] = [s.recordings, s.frames].map(|n| n.to_string());
        [
            s.name.clone(),
            recordings,
            frames,
            s.folder.as_ref().map_or_else(String::new, |folder| folder.display().to_string()),
            s.problem.clone().unwrap_or_default(),
        ]
    });
    table::align_left(&mut t, 3..5);
    let agree = match over {
        [] => {
            "no two labels were repeated by two speakers or more, so that nothing is counted over speakers\n"
                .to_owned()
        }
        all => table::most_agree(all),
    };
    format!("{t}\n\n{agree}\n")
}
