//! Options for recordings, and the recordings that they name.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, ensure};
use tongue_fit::body::{Anatomy, Body};
use tongue_fit::geometry::Point;
use tongue_fit::inner::adapt::{Adaptation, AdaptationInput};
use tongue_fit::inner::measured::recording::{Format, Map, Recording, Waveform};
use tongue_fit::inner::run::ScreenedRecording;
use tongue_fit::inner::standard_deviations::{MEMORY_S, TENSION_N};
use tongue_fit::inner::track::TrackSettings;

use super::{Global, Outcome, body, inputs, output};

#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Recordings")]
pub struct Arguments {
    /// Recordings, several speakers apart: AAA's tables and fans, tidy CSV, AG50x (.pos), Edinburgh Speech Tools or MOCHA (.ema), X-ray
    /// microbeam (.txy), MVIEW (.mat), DeepLabCut (.csv), EdgeTrak (.con)
    #[arg(value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Use the built-in recording: two utterances of a simulated tongue in AAA's export format
    #[arg(long, conflicts_with = "files")]
    pub example: bool,
    /// Meaning of channels, axes and unit (TOML); not needed for recordings whose channels have usual names
    #[arg(long, value_name = "FILE")]
    pub map: Option<PathBuf>,
    /// Write a map for the first recording into this file, to be corrected, and do nothing else
    #[arg(long, value_name = "FILE", conflicts_with = "map")]
    pub map_template: Option<PathBuf>,
    /// The palate in the frame of the recordings (CSV point,x_mm,y_mm from front to back): points beyond it are reported, the tongue is in
    /// contact with it, and it helps to place a body by coils
    #[arg(long, value_name = "FILE")]
    pub palate: Option<PathBuf>,
    /// Only the recordings of this speaker, if files have several
    #[arg(long, value_name = "NAME", hide_short_help = true)]
    pub speaker: Option<String>,
    /// Format of the files: aaa, csv, pos, ema, con, fan, txy, mat, dlc or sensors [default: from their content]
    #[arg(long, value_name = "FORMAT", value_parser = format, hide_short_help = true)]
    pub format: Option<Format>,
}

fn format(name: &str) -> Result<Format, String> {
    let format = Format::NAMES.iter().find(|(n, _)| n.eq_ignore_ascii_case(name));
    format.map(|(_, format)| *format).ok_or_else(|| {
        let names = Format::NAMES.map(|(n, _)| n);
        format!("{}; formats: {}", tongue_fit::inner::choice::hint(name, names), names.join(", "))
    })
}

#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Prior")]
pub struct PriorArguments {
    /// Scale of the tensions in the prior, N per metre of thickness; its median is 0.67 of the scale, its 97.5 % quantile 2.6 of it
    #[arg(long, value_name = "N", default_value_t = TENSION_N, hide_short_help = true)]
    prior: f64,
    /// Correlation time of the tensions, s; 0: every frame by itself
    #[arg(long, value_name = "S", default_value_t = MEMORY_S, hide_short_help = true)]
    memory: f64,
}

impl PriorArguments {
    pub fn settings(&self) -> Result<TrackSettings> {
        let Self { prior, memory } = *self;
        ensure!((0.1..=1000.0).contains(&prior), "--prior is {prior}; it must be from 0.1 to 1000 N/m");
        ensure!((0.0..=1000.0).contains(&memory), "--memory is {memory}; it must be from 0 to 1000 s");
        Ok(TrackSettings::new(prior, memory))
    }
}

/// The methods for a rest shape from recordings; the third method is for contours alone.
pub const REST: [&str; 2] = ["joint", "similarity"];

pub struct Loaded {
    pub file: String,
    /// The file of the sound beside it, if its file has only one recording.
    pub sound: Option<PathBuf>,
    pub recording: Recording,
}

impl Arguments {
    pub fn map(&self) -> Result<Map> {
        let Some(path) = &self.map else { return Ok(Map::default()) };
        let text = inputs::text("the map", path)?;
        Ok(Map::from_toml(&text, &path.display().to_string())?)
    }

    /// The palate in the axes of the recordings, m.
    fn palate(&self) -> Result<Option<Vec<Point>>> {
        let Some(path) = &self.palate else { return Ok(None) };
        let recordings = Recording::from_path(path, Some(Format::Tidy))?;
        let places = recordings.iter().flat_map(|r| &r.samples).flat_map(|s| &s.places).flatten();
        let points: Vec<Point> = places.map(|[x, y, _]| Point::new(*x, *y) * 1e-3).collect();
        ensure!(points.len() >= 2, "{}: a palate needs at least two points", path.display());
        Ok(Some(points))
    }

    fn example(&self) -> Result<Vec<Recording>> {
        let bytes = include_bytes!("../../targets/recordings/synthetic.tsv");
        Ok(Recording::from_bytes(bytes, "synthetic.tsv", self.format)?)
    }

    /// Writes the map that was asked for; `None` if none was.
    pub fn write_template(&self, global: &Global) -> Result<Option<Outcome>> {
        let Some(path) = &self.map_template else { return Ok(None) };
        let recordings = match self.files.first() {
            Some(file) => Recording::from_path(file, self.format)?,
            None if self.example => self.example()?,
            None => return Err(anyhow!("--map-template: name the recording that the map is for")),
        };
        let recording = recordings.iter().find(|r| !r.samples.is_empty());
        let recording = recording.context("--map-template: the recording has no frame")?;
        ensure!(!path.exists(), "{} exists; name another file for the map", path.display());
        std::fs::write(path, Map::template(recording))
            .with_context(|| format!("cannot write the map {}", path.display()))?;
        output::tell(global, &serde_json::json!({ "map": path }), || {
            format!("{}: a map to correct; then give it with --map\n", path.display())
        })?;
        Ok(Some(Outcome::Good))
    }

    /// All recordings with the names of their files. A recording that is given again is left out, with a note on the first one.
    pub fn read(&self) -> Result<Vec<Loaded>> {
        let example = self.example.then(|| Ok(("synthetic.tsv".to_owned(), self.example()?)));
        let named = self
            .files
            .iter()
            .map(|file| Ok((file.display().to_string(), Recording::from_path(file, self.format)?)));
        let files = example.into_iter().chain(named).collect::<Result<Vec<_>>>()?;
        let mut read: Vec<Loaded> = Vec::new();
        for (file, recordings) in files {
            let beside = Waveform::sound_file_beside(Path::new(&file));
            let sound = beside.clone().filter(|_| recordings.len() <= 1);
            if beside != sound {
                output::note(&format!(
                    "the sound beside {file} is not drawn: the file has several recordings"
                ));
            }
            let is_chosen = |r: &Recording| self.speaker.is_none() || r.speaker == self.speaker;
            for recording in recordings.into_iter().filter(is_chosen) {
                match read.iter_mut().find(|first| first.recording.has_frames_of(&recording)) {
                    Some(first) => first.recording.notes.push(format!(
                        "the recording {:?} of {file} has the same frames and is left out, since a copy is no repetition",
                        recording.name
                    )),
                    None => read.push(Loaded { file: file.clone(), sound: sound.clone(), recording }),
                }
            }
        }
        Ok(read)
    }

    /// Recordings of one speaker without outliers, and a sentence for each recording that is left out because nothing can be
    /// read from it.
    pub fn screen(
        &self,
        read: &[Loaded],
        of_body: Option<&[Point]>,
    ) -> Result<(Vec<ScreenedRecording>, Vec<String>)> {
        let speakers: BTreeSet<&str> = read.iter().filter_map(|r| r.recording.speaker.as_deref()).collect();
        if speakers.len() > 1 {
            return Err(of_several(speakers, "each needs a body of his or her own"));
        }
        let (map, own) = (self.map()?, self.palate()?);
        let files = read.iter().map(|one| (one.file.as_str(), &one.recording, one.sound.as_deref()));
        let palates = [own.as_deref(), of_body];
        let (all, left_out) =
            ScreenedRecording::all(&files.collect::<Vec<_>>(), &map, palates, &output::tell_step)?;
        if all.is_empty() {
            return Err(match (left_out.first(), &self.speaker) {
                (Some(why), _) => anyhow!("{why}"),
                (None, None) => anyhow!("name at least one recording"),
                (None, Some(speaker)) => anyhow!("--speaker {speaker}: no recording is of this speaker"),
            });
        }
        Ok((all, left_out.into_iter().map(|why| format!("left out: {why}")).collect()))
    }
}

/// The error for recordings of several speakers; `why` says what allows only one.
pub fn of_several<'a>(speakers: impl IntoIterator<Item = &'a str>, why: &str) -> anyhow::Error {
    let speakers: Vec<&str> = speakers.into_iter().collect();
    anyhow!(
        "the recordings are of {} speakers ({}), and {why}; take one at a time, such as --speaker {:?}",
        speakers.len(),
        speakers.join(", "),
        speakers.first().unwrap_or(&"")
    )
}

pub struct GivenRecordings {
    pub body: Body<2>,
    pub anatomy: Option<Anatomy>,
    pub adaptation: Option<Adaptation>,
}

impl GivenRecordings {
    pub fn read(arguments: &body::Arguments) -> Result<Self> {
        let body = arguments.body()?;
        ensure!(
            body.mesh.continuum.is_none(),
            "a continuum cannot be adapted or tracked yet; leave out --body continuum"
        );
        let adaptation = match arguments.mesh.as_deref() {
            Some(path) if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) => {
                let text = inputs::text("the body", path)?;
                Adaptation::from_json(&text).map_err(|e| anyhow!("{}: {e}", path.display()))?
            }
            _ => None,
        };
        Ok(Self { body, anatomy: arguments.anatomy()?, adaptation })
    }

    pub fn basis(&self, arguments: &body::Arguments, settings: TrackSettings) -> AdaptationInput<'_> {
        AdaptationInput {
            body: &self.body,
            anatomy: self.anatomy.as_ref(),
            model: arguments.model(),
            contracting: (0..self.body.mesh.muscles.len()).collect(),
            settings,
            palate: None,
        }
    }
}
