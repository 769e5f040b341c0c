//! `tongue-fit accuracy`: accuracy and its cost in time.

use miette::IntoDiagnostic;
use tongue_fit::body::{SpaceBody, artisynth};
use tongue_fit::report::{Export, Markdown, OutputDir, Rows};
use tongue_fit::system::SpaceModel;
use tongue_study::accuracy::{self, Circumstances, Effort};
use tongue_study::{continuum, plane};

use super::{Global, Outcome, output, table};

/// Options of `tongue-fit accuracy`.
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(after_help = "Example:\n  tongue-fit accuracy --quick --out results/accuracy-here")]
pub struct Arguments {
    /// A quick study of half a minute: fewer repeats, no mesh below 1.4 mm, long explicit runs refused (the
    /// full study: ten minutes)
    #[arg(long)]
    quick: bool,
    /// Only the continuum: its mesh, and the settings that were chosen without data (a minute or two)
    #[arg(long, conflicts_with = "quick")]
    continuum: bool,
    /// Only the plane: a body in space against its own midsagittal plane, muscle by muscle (a minute)
    #[arg(long, conflicts_with_all = ["quick", "continuum"])]
    plane: bool,
    /// With --plane: a folder with ArtiSynth's tongue in place of the built-in one
    #[arg(long, value_name = "FOLDER", requires = "plane")]
    space: Option<std::path::PathBuf>,
}

/// Number of nested meshes of the continuum, from 11 mm to 1.4 mm.
const LEVELS: usize = 4;

fn continuum(global: &Global) -> miette::Result<Outcome> {
    let out = global.folder("results/continuum")?;
    let before = busy();
    let study = continuum::run(LEVELS, &mut |what| output::progress(what)).into_diagnostic()?;
    let mut made = format!("Made by `{}` on {}.", super::command_line(), machine());
    if let Some((before, after)) = before.zip(busy()) {
        made += &format!(
            " Programs ready to run, with this one: {before} before and {after} after (load average)."
        );
    }
    let page = Markdown(continuum::page(&study, &made).into_diagnostic()?);
    let (spacings, locking, sensitivity) =
        (Rows(&study.spacings), Rows(&study.locking), Rows(&study.sensitivity));
    let files: [(&str, &dyn Export); 4] = [
        ("README.md", &page),
        ("spacings.csv", &spacings),
        ("locking.csv", &locking),
        ("sensitivity.csv", &sensitivity),
    ];
    written(&out, &files, global)
}

fn plane(arguments: &Arguments, global: &Global) -> miette::Result<Outcome> {
    let body = match &arguments.space {
        Some(folder) => artisynth::read(folder).into_diagnostic()?,
        None => SpaceBody::tongue(1).into_diagnostic()?,
    };
    let out = global.folder("results/plane")?;
    let model = SpaceModel::default();
    let study = plane::run(&body, &model, &mut |what| output::progress(what)).into_diagnostic()?;
    let made = format!("Made by `{}`.", super::command_line());
    let page = Markdown(plane::page(&study, &made).into_diagnostic()?);
    let (alone, inverse) = (Rows(&study.alone), Rows(&study.inverse));
    let files: [(&str, &dyn Export); 3] =
        [("README.md", &page), ("alone.csv", &alone), ("inverse.csv", &inverse)];
    written(&out, &files, global)
}

/// The load average of the last minute, if the system has one.
fn busy() -> Option<String> {
    let text = tongue_fit::files::read(std::path::Path::new("/proc/loadavg")).ok()?;
    let text = String::from_utf8(text).ok()?;
    text.split_whitespace().next().map(str::to_owned)
}

pub fn run(arguments: &Arguments, global: &Global) -> miette::Result<Outcome> {
    if arguments.plane {
        return plane(arguments, global);
    }
    if arguments.continuum {
        return continuum(global);
    }
    let out = global.folder("results/accuracy")?;
    let effort = if arguments.quick { Effort::QUICK } else { Effort::FULL };
    let study = accuracy::run(&effort, &mut |what| output::progress(what)).into_diagnostic()?;
    let made = Circumstances { command: super::command_line(), machine: machine() };
    let page = Markdown(accuracy::page(&study, &made).into_diagnostic()?);
    let files = accuracy::files(&study).into_diagnostic()?;
    let mut all: Vec<(&str, &dyn Export)> = files.iter().map(|(n, f)| (*n, f.as_ref())).collect();
    all.push(("README.md", &page));
    written(&out, &all, global)
}

/// Writes the files of a study and returns the list of them.
fn written(out: &OutputDir, files: &[(&str, &dyn Export)], global: &Global) -> miette::Result<Outcome> {
    let written = out.export(files, &super::provenance()).into_diagnostic()?;
    if global.json {
        output::print(&output::json(&serde_json::json!({ "written": written }))?)?;
    } else {
        output::summary(&table::files(&written), &written)?;
    }
    Ok(Outcome::Good)
}

/// Processor, threads and operating system, as far as they are known.
fn machine() -> String {
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu.lines().find_map(|l| l.strip_prefix("model name")?.split_once(": "));
    format!(
        "{} ({} threads in use, {} {})",
        model.map_or("an unnamed processor", |(_, name)| name.trim()),
        rayon::current_num_threads(),
        std::env::consts::OS,
        std::env::consts::ARCH
    )
}
