//! `tongue-fit track FILES --body space` or a folder: activations that bring a body in space to where it was seen.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use miette::{IntoDiagnostic, miette};

use tongue_fit::inverse::in_space::SpaceSearch;
use tongue_fit::inverse::{FitSettings, FitStatus};
use tongue_fit::measured::read_space_marks;
use tongue_fit::report::{self, Export, Json, SpaceTrackRecord, SpaceVtu};
use tongue_fit::system::System;

use super::body::SpaceSource;
use super::space::ModelArguments;
use super::{Global, Outcome, output, table};

/// A share of a combination below this is not worth a word.
const SHARE: f64 = 0.2;

/// Options of searches in space.
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Body in space")]
pub struct Arguments {
    /// Let the sides of a muscle be activated apart; else they are alike
    #[arg(long)]
    sides_apart: bool,
    /// Number of starting points of the search in space; every further frame begins at the one before
    #[arg(long, value_name = "N", default_value_t = FitSettings::default().starts)]
    starts: usize,
    /// Standard deviation of each coordinate, distance or length, mm, where a table has no column sd_mm
    #[arg(long, value_name = "MM", default_value_t = 0.5, allow_negative_numbers = true)]
    sd: f64,
    #[command(flatten)]
    model: ModelArguments,
}

impl Arguments {
    /// What was given that only a body in space understands.
    pub fn given(&self) -> Option<&'static str> {
        let apart = self.sides_apart.then_some("--sides-apart");
        let starts = (self.starts != FitSettings::default().starts).then_some("--starts");
        apart.or(starts).or((self.sd != 0.5).then_some("--sd")).or_else(|| self.model.given())
    }
}

/// Finds the activations of every frame of a table.
pub fn run(
    source: &SpaceSource,
    files: &[PathBuf],
    arguments: &Arguments,
    global: &Global,
) -> miette::Result<Outcome> {
    let clock = Instant::now();
    if !(arguments.sd.is_finite() && arguments.sd > 0.0) {
        return Err(miette!("--sd is {}; it must be a positive number of millimetres", arguments.sd));
    }
    if files.is_empty() {
        return Err(miette!(
            "name the tables of what was seen of the body, such as one with the columns node,x_mm,y_mm,z_mm"
        ));
    }
    let frames = read_space_marks(files, 1e-3 * arguments.sd).into_diagnostic()?;
    let body = arguments.model.body(source)?;
    let model = arguments.model.model()?;
    let system = System::in_space(&body, &model).into_diagnostic()?;
    let half = if arguments.sides_apart { None } else { body.half() };
    let left = half.as_ref().map(|half| System::of_half(half, &model)).transpose().into_diagnostic()?;
    let usual = SpaceSearch::default();
    let settings = FitSettings { starts: arguments.starts, ..usual.settings };
    settings.check().into_diagnostic()?;
    let search = SpaceSearch { sides_apart: arguments.sides_apart, settings, ..usual };
    let mut record = SpaceTrackRecord::new(&body);
    let mut last = None;
    for frame in &frames {
        let fit = match half.as_ref().zip(left.as_ref()).filter(|_| last.is_none()) {
            Some(alike) => search.fit_alike((&body, &system), alike, &frame.marks),
            None => search.fit(&body, &system, &frame.marks, last.as_ref()),
        };
        let fit = fit.into_diagnostic()?;
        output::step(|| {
            let (status, rms) = (fit.answer.status, 1e3 * fit.rms_m);
            format!("{status:?}: {rms:.2} mm RMS in {} factorisations", fit.factorisations)
        });
        record.push(frame.time_s, &fit, search.open_above);
        last = Some(fit.answer);
    }
    record.wall_s = clock.elapsed().as_secs_f64();
    let out = global.folder("results/space-track")?;
    let Some(answer) = last else { return Err(miette!("no frame was found")) };
    let title = "Tongue in space: at rest (light) and as it was seen";
    let picture = report::views(&body, &answer.positions, &answer.tensions, title);
    let (picture, json) = (picture.into_diagnostic()?, Json(&record));
    let vtu = SpaceVtu { body: &body, positions: &answer.positions, activations: &answer.tensions };
    let by = super::provenance().with_tissue(system.tissue());
    let files: [(&str, &dyn Export); 3] =
        [("track.json", &json), ("tongue.svg", &picture), ("tongue.vtu", &vtu)];
    let written = out.export(&files, &by).into_diagnostic()?;
    output::answer(global, &json, &by, &written, || text(&record) + &table::files(&written))?;
    let good = record.frames.iter().all(|f| f.status == FitStatus::Converged && f.alarms.is_empty());
    Ok(if good { Outcome::Good } else { Outcome::Untrustworthy })
}

/// The record for a terminal.
fn text(record: &SpaceTrackRecord) -> String {
    let mut text = String::new();
    for frame in &record.frames {
        if let Some(time) = frame.time_s {
            let _ = writeln!(text, "at {time} s");
        }
        let mut t = table::table(&["muscle", "activation", "sd"]);
        for ((name, a), (_, sd)) in frame.activations.0.iter().zip(&frame.sd.0) {
            t.add_row([
                name.clone(),
                format!("{a:.3}"),
                sd.map_or_else(String::new, |sd| format!("{sd:.3}")),
            ]);
        }
        let _ = writeln!(
            text,
            "{t}\n{:?}: met to {:.2} mm (RMS), {:.2} mm at most; {} factorisations from {} starts",
            frame.status,
            frame.rms_mm,
            frame.distances_mm.iter().copied().fold(0.0, f64::max),
            frame.factorisations,
            frame.starts.len()
        );
        for open in &frame.open {
            let shares = open.direction.0.iter().filter(|(_, s)| s.abs() >= SHARE);
            let shares: Vec<String> = shares.map(|(name, s)| format!("{s:+.2} {name}")).collect();
            let sd = open.sd.map_or_else(|| "without limit".to_owned(), |sd| format!("±{sd:.2}"));
            let _ = writeln!(text, "open ({sd}; the prior decides): {}", shares.join(" "));
        }
        for other in &frame.others_as_good {
            let active = other.0.iter().filter(|(_, a)| *a > 0.01);
            let active: Vec<String> = active.map(|(name, a)| format!("{name} {a:.2}")).collect();
            let _ = writeln!(text, "as good: {}", active.join(", "));
        }
        for alarm in &frame.alarms {
            let _ = writeln!(text, "alarm   {}", alarm.text);
        }
    }
    text
}
