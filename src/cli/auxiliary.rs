//! Options of a posterior for what was measured beside the lengths: activity, contours and coils.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail, ensure};
use tongue_fit::body::Body;
use tongue_fit::geometry::Point;
use tongue_fit::inner::adapt::Landmarks;
use tongue_fit::inner::measured::recording::{self, AlignedRecording, Map, Mark, Recording, Severity};
use tongue_fit::inner::posterior::{AuxiliaryData, PosteriorModel};
use tongue_fit::inner::report::joined;
use tongue_fit::inner::statistics::{distinct, median};
use tongue_fit::measured::{Activity, Target, Vowel};
use tongue_fit::track::TongueSurface;

use super::{inputs, output};

const MOST_POINTS: usize = 40;
/// A contour whose points are farther from the surface at rest is in another frame, m.
const FARTHEST_M: f64 = 30e-3;
/// Farthest that a point may lie in front of the tongue at rest or behind it, m.
const BEYOND_M: f64 = 10e-3;
/// If the largest activity is smaller, the unit of the table seems to be wrong.
const LEAST_LARGEST_ACTIVITY: f64 = 0.05;
const BODY_AXES: &str = "back = \"x\"\nup = \"y\"\n";

#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Posterior: data beside the lengths")]
pub struct Arguments {
    /// Relative muscle activity, 0 to 1, of the fitted vowel, its baseline and, with --joint, other vowels: CSV with a column muscle and a
    /// column for each vowel. The gain of each electrode is unknown, so a muscle needs two of these vowels, and full_n_per_m is not used
    #[arg(long, value_name = "FILE", requires = "posterior", hide_short_help = true)]
    emg: Option<PathBuf>,
    /// Contour of the fitted vowel, or of the baseline or another sampled vowel, whose name is then put before it (ɯ=FILE). It is in the
    /// body's own millimetres (as `tongue-fit mesh` draws it, or `adapt` writes it) and in a format of `adapt --contour`. Contours of
    /// several postures say most, because they share the errors of place (5 mm), angle (9 degrees) and size (10 %; standard deviations)
    #[arg(long, value_name = "[VOWEL=]FILE", requires = "posterior", hide_short_help = true)]
    contour: Vec<String>,
    /// With --posterior: coils by their usual names (T1, TT, TB, TD, ...), given like --contour and with the same placement, one frame in
    /// each file (CSV point,x_mm,y_mm). As the first option, without --posterior: the tensions of one posture from points alone, short for
    /// `tongue-fit track FILE`, with its options
    #[arg(long, value_name = "[VOWEL=]FILE")]
    pub points: Vec<String>,
}

impl Arguments {
    /// What was measured of targets that are sampled together, of which the one with index `posture` is fitted.
    pub fn read(&self, model: &PosteriorModel, targets: &[Target], posture: usize) -> Result<AuxiliaryData> {
        let body = &model.body;
        let sampled = SampledTargets { targets, fitted: posture };
        let mut out = match &self.emg {
            Some(path) => emg(path, model, &sampled)?,
            None => AuxiliaryData::default(),
        };
        let contours = sampled.files("--contour", &self.contour, contour)?;
        let coils = sampled.files("--points", &self.points, coils)?;
        if !(contours.is_empty() && coils.is_empty()) {
            out = out.and(sampled.points(body, &contours, coils)?);
        }
        Ok(out)
    }
}

struct SampledTargets<'a> {
    targets: &'a [Target],
    fitted: usize,
}

impl SampledTargets<'_> {
    /// The posture of a file (`None` for the baseline), and its path.
    fn posture<'t>(&self, option: &str, text: &'t str) -> Result<(Option<usize>, &'t Path)> {
        let Some((name, path)) = text.split_once('=').filter(|_| !Path::new(text).exists()) else {
            return Ok((Some(self.fitted), Path::new(text)));
        };
        let vowel = Vowel::new(name).with_context(|| format!("{option} {text}"))?;
        let posture = self.of_vowel(&vowel).ok_or_else(|| {
            let sampled = joined(self.targets.iter().map(|t| format!("/{}/", t.vowel)), ", ");
            anyhow!(
                "{option} {text}: there is no file of this name, and /{vowel}/ is not sampled; sampled are {sampled} and the baseline /{}/ \
                 (--joint samples all vowels of the subject)",
                self.vowel(None)
            )
        })?;
        Ok((posture, Path::new(path)))
    }

    fn vowel(&self, posture: Option<usize>) -> &Vowel {
        posture.map_or(&self.targets[0].baseline, |p| &self.targets[p].vowel)
    }

    /// The posture of a vowel (`Some(None)` for the baseline); `None` if it is not sampled.
    fn of_vowel(&self, vowel: &Vowel) -> Option<Option<usize>> {
        let of_target = self.targets.iter().position(|t| t.vowel == *vowel);
        if vowel == self.vowel(None) { Some(None) } else { of_target.map(Some) }
    }

    fn files<T>(
        &self,
        option: &str,
        files: &[String],
        read: impl Fn(&Path) -> Result<T>,
    ) -> Result<Vec<(Option<usize>, T)>> {
        let mut out: Vec<(Option<usize>, T)> = Vec::new();
        for file in files {
            let (posture, path) = self.posture(option, file)?;
            ensure!(
                !out.iter().any(|(p, _)| *p == posture),
                "{option} {file}: there is another file of the same posture; give one of each"
            );
            out.push((posture, read(path).with_context(|| format!("{option} {}", path.display()))?));
        }
        Ok(out)
    }

    /// Contours and coils together, because they share a frame.
    fn points(
        &self,
        body: &Body<2>,
        contours: &[(Option<usize>, Vec<Point>)],
        coils: Vec<(Option<usize>, Recording)>,
    ) -> Result<AuxiliaryData> {
        let (of_coils, recordings): (Vec<_>, Vec<_>) = coils.into_iter().unzip();
        let postures = distinct(contours.iter().map(|(p, _)| *p).chain(of_coils.iter().copied()));
        let points = |p: &Option<usize>| {
            contours.iter().find(|(other, _)| other == p).map_or(&[][..], |(_, points)| points.as_slice())
        };
        let mut seen = AlignedRecording::of_contours(&postures.iter().map(points).collect::<Vec<_>>());
        if !recordings.is_empty() {
            // All files are read as one recording, because a coil has one place on the tongue.
            let all = Recording::of_coils(&recordings).map_err(|e| anyhow!("--points: {e}"))?;
            let map = Map::from_toml(BODY_AXES, "the axes of the body")?;
            let read = AlignedRecording::new(&all, &map).context("--points")?;
            read.notes.iter().for_each(|note| output::note(&format!("--points: {note}")));
            for (posture, frame) in of_coils.iter().zip(read.frames) {
                let own = postures.iter().position(|p| p == posture);
                own.into_iter().for_each(|own| seen.frames[own].sensors.clone_from(&frame.sensors));
            }
            seen = AlignedRecording { sensors: read.sensors, measured: read.measured, ..seen };
        }
        for (posture, frame) in postures.iter().zip(&seen.frames) {
            let vowel = self.vowel(*posture);
            // Postures are not frames of one motion.
            let alone = AlignedRecording { frames: vec![frame.clone()], ..seen.clone() };
            for doubt in recording::check_plausibility(&alone, None) {
                let message = format!("--contour and --points, /{vowel}/: {}", doubt.message);
                if doubt.severity == Severity::Note { output::note(&message) } else { bail!("{message}") }
            }
            for (option, marks) in [("--contour", &frame.contour), ("--points", &frame.sensors)] {
                near_the_body(body, marks).with_context(|| format!("{option}, /{vowel}/"))?;
            }
        }
        AuxiliaryData::points(body, &seen, &postures).ok_or_else(|| {
            anyhow!("this body has no outline of a tongue; take the built-in one or an adapted one")
        })
    }
}

fn near_the_body(body: &Body<2>, marks: &[Option<Mark>]) -> Result<()> {
    let Some(surface) = TongueSurface::of(body) else { return Ok(()) };
    let away = marks.iter().flatten().map(|m| surface.distance(m.at, &body.mesh.nodes).abs());
    let away_m = median(away).unwrap_or(0.0);
    let tissue = body.mesh.nodes.iter().zip(body.mesh.in_tissue()).filter(|(_, is_tissue)| *is_tissue);
    let [front, back] = tissue
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (at, _)| [low.min(at.x), high.max(at.x)]);
    let beyond =
        marks.iter().flatten().filter(|m| m.at.x < front - BEYOND_M || m.at.x > back + BEYOND_M).count();
    ensure!(
        3 * beyond <= marks.iter().flatten().count(),
        "{beyond} of its points lie in front of the tongue or behind it; give them in the body's own millimetres, with x growing to the back \
         of the head"
    );
    ensure!(
        away_m <= FARTHEST_M,
        "its points lie {:.0} mm from the surface of the body at rest (median); give them in the body's own millimetres, x to the back of \
             the head and y up, as `tongue-fit adapt` writes a body",
        1e3 * away_m
    );
    Ok(())
}

fn emg(path: &Path, model: &PosteriorModel, sampled: &SampledTargets<'_>) -> Result<AuxiliaryData> {
    let origin = path.display().to_string();
    let bytes = inputs::bytes("--emg", path)?;
    let table = Activity::read(&bytes, &origin)?;
    let measured = table.relative(&model.muscles)?;
    let postures = (0..sampled.targets.len()).map(Some).chain([None]);
    let postures = Vec::from_iter(postures.filter_map(|p| Some((table.label_of(sampled.vowel(p))?, p))));
    let posture_of = |label: &Vowel| {
        let is_of = |(known, _): &&(&Vowel, Option<usize>)| *known == label;
        sampled.of_vowel(label).or_else(|| postures.iter().find(is_of).map(|(_, posture)| *posture))
    };
    for (_, fault) in table.bad_cells().filter(|(vowel, _)| posture_of(vowel).is_some()) {
        output::complain(&format!("{fault} (this cell is left out)"));
    }
    let (silent, measured): (Vec<_>, Vec<_>) = measured.into_iter().partition(|row| {
        !row.by_vowel.is_empty() && row.by_vowel.iter().all(|(_, activity)| *activity == 0.0)
    });
    if !silent.is_empty() {
        output::note(&format!(
            "--emg {origin}: {} left out: no activity in any vowel, so the electrode seems to have recorded nothing",
            joined(silent.into_iter().map(|row| row.name), ", ")
        ));
    }
    let activities = measured.iter().flat_map(|row| &row.by_vowel).map(|(_, activity)| *activity);
    let largest = activities.fold(0.0, f64::max);
    if largest > 0.0 && largest < LEAST_LARGEST_ACTIVITY {
        output::note(&format!(
            "--emg {origin}: the largest activity is {largest:.3}, where that of each muscle is about 1; if the columns are in parts of 1, take the % \
             out of their names"
        ));
    }
    let electrodes = Vec::from_iter(measured.into_iter().map(|row| {
        let each = row.by_vowel.iter().filter_map(|(v, activity)| Some((posture_of(v)?, *activity)));
        // A tension that the priors fix says nothing about the gain of an electrode.
        let fixed = |p: Option<usize>, m: &usize| {
            let (priors, name) = (&model.priors, &model.muscles[*m]);
            p.map_or_else(|| priors.fixed_tone(name), |_| priors.fixed_tension(name)).is_some()
        };
        let used: Vec<_> = each.filter(|(p, _)| !row.muscles.iter().all(|m| fixed(*p, m))).collect();
        (row.name, row.muscles, used)
    }));
    let alone: Vec<String> = electrodes.iter().filter(|e| e.2.len() < 2).map(|e| e.0.clone()).collect();
    let electrodes: Vec<_> = electrodes.into_iter().map(|(_, muscles, used)| (muscles, used)).collect();
    let data = AuxiliaryData::emg(&electrodes);
    ensure!(
        !data.is_empty(),
        "--emg {origin}: no muscle has activity in both /{}/ and /{}/; the gain of an electrode is unknown, so give columns for two \
             of the postures that are sampled (--joint samples all vowels of the subject)",
        sampled.vowel(Some(sampled.fitted)),
        sampled.vowel(None)
    );
    if !alone.is_empty() {
        output::note(&format!(
            "--emg {origin}: {} left out: the gain of an electrode is unknown, so activity is needed in at least two of the postures that are sampled",
            alone.join(", ")
        ));
    }
    Ok(data)
}

fn contour(path: &Path) -> Result<Vec<Point>> {
    let bytes = inputs::bytes("the contour", path)?;
    let read = Landmarks::from_bytes(&bytes, &path.display().to_string(), &Default::default())?;
    if let Some(coil) = read.named.keys().find(|name| recording::is_coil(name)) {
        bail!("{coil} is the name of a coil; coils are read with --points");
    }
    // The option says that points are in the frame of the body, so a contour that seems to face the other way is not turned round.
    let points = Landmarks::default().with_contour(read).contour;
    let every = points.len().div_ceil(MOST_POINTS).max(1);
    let points: Vec<Point> = points.into_iter().step_by(every).collect();
    ensure!(points.len() >= 3, "it has {} points; three are needed", points.len());
    Ok(points)
}

fn coils(path: &Path) -> Result<Recording> {
    let recordings = Recording::from_path(path, None)?;
    let [one] = recordings.as_slice() else {
        bail!("it has {} recordings; give a file of one frame for each posture", recordings.len());
    };
    ensure!(one.samples.len() == 1, "it has {} frames; give the one of this posture", one.samples.len());
    let mut channels = one.channels.iter().zip(&one.samples[0].places);
    ensure!(
        channels.any(|(name, place)| place.is_some() && recording::is_coil(name)),
        "it has no coil of a usual name, such as T1, TT, TB or TD (points: {}); a contour is read with --contour",
        one.channels.join(", ")
    );
    let unknown: Vec<&str> =
        one.channels.iter().filter(|c| !recording::is_coil(c)).map(String::as_str).collect();
    if !unknown.is_empty() {
        let (path, unknown) = (path.display(), unknown.join(", "));
        output::note(&format!("--points {path}: {unknown} left out: not a usual name of a coil"));
    }
    Ok(one.clone())
}
