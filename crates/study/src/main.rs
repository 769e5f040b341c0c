//! Studies of tongue-fit itself: what accuracy costs in time, hard cases, the continuum, and what a plane
//! misses. Each writes a page and its tables.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program prints")]

mod accuracy;
mod continuum;
mod hard_cases;
mod measure;
mod plane;
mod plane_signs;
mod table;
mod test_tensions;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use tongue_core::body::Body;
use tongue_files::report::{Export, Markdown, OutputDir, Provenance, Rows};
use tongue_input::bodies::artisynth;

use measure::Effort;
use plane::SpaceAndPlane;
use test_tensions::{PUBLISHED_A, TestTensions};

type Error = Box<dyn std::error::Error + Send + Sync>;

#[derive(Debug, Parser)]
#[command(name = "tongue-study", about = "Studies of tongue-fit itself", version)]
struct StudyCli {
    #[command(subcommand)]
    study: Study,
    /// Folder of the files [default: results/ and the name of the study]
    #[arg(long, value_name = "DIR", global = true)]
    out: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum Study {
    /// What accuracy costs in time, for every method of solution
    Accuracy {
        /// A shorter study: fewer repeats, no mesh below 1.4 mm, long explicit runs refused
        #[arg(long)]
        quick: bool,
    },
    /// Extreme loads, materials, meshes and time steps
    Stability {
        /// All variants of every case (minutes) instead of a sample (seconds)
        #[arg(long)]
        full: bool,
        /// Run only this case; may be given several times
        #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u8).range(1..=hard_cases::LAST))]
        case: Vec<u8>,
    },
    /// The mesh of the continuum, and the settings that were chosen without data (minutes)
    Continuum,
    /// A body in space against its own midsagittal plane, muscle by muscle: the error, and the signs of differences (minutes)
    Plane {
        /// A folder with ArtiSynth's tongue in place of the built-in one
        #[arg(long, value_name = "FOLDER")]
        space: Option<PathBuf>,
    },
}

impl Study {
    fn name(&self) -> &'static str {
        match self {
            Self::Accuracy { .. } => "accuracy",
            Self::Stability { .. } => "stability",
            Self::Continuum => "continuum",
            Self::Plane { .. } => "plane",
        }
    }

    fn write(&self, out: &OutputDir, by: &Provenance) -> Result<Vec<PathBuf>, Error> {
        let made = format!("Made by `{}` on {}.", by.command, machine());
        Ok(match self {
            Self::Accuracy { quick } => {
                let effort = if *quick { Effort::QUICK } else { Effort::FULL };
                let study = accuracy::run(&effort)?;
                out.export(&accuracy::files(&study, &made)?, by)?
            }
            Self::Stability { full, case } => {
                let rows = hard_cases::run_all(case, *full)?;
                let page = Markdown(hard_cases::markdown(&rows, &made)?);
                let picture = hard_cases::picture(&rows).transpose()?;
                let table = Rows(&rows);
                let mut files: Vec<(&str, &dyn Export)> =
                    vec![("stability.csv", &table), ("stability.md", &page)];
                files.extend(picture.iter().map(|svg| ("stability.svg", svg as &dyn Export)));
                out.export(&files, by)?
            }
            Self::Continuum => {
                let study = continuum::run()?;
                let picture = continuum::picture(&study.spacings)?;
                let files: [(&str, &dyn Export); 5] = [
                    ("README.md", &Markdown(continuum::page(&study, &made)?)),
                    ("spacings.svg", &picture),
                    ("spacings.csv", &Rows(&study.spacings)),
                    ("locking.csv", &Rows(&study.locking)),
                    ("sensitivity.csv", &Rows(&study.sensitivity)),
                ];
                out.export(&files, by)?
            }
            Self::Plane { space } => {
                let body = match space {
                    Some(folder) => artisynth::read(folder)?,
                    None => Body::tongue_in_space(1)?,
                };
                let bodies = SpaceAndPlane::new(&body)?;
                let (alone, inverse, signs) = (bodies.alone(), bodies.inverse()?, plane_signs::run(&body)?);
                let page = plane::page(&body.what, &alone, &inverse, &made)? + &plane_signs::page(&signs)?;
                let picture = plane::picture(&alone)?;
                let files: [(&str, &dyn Export); 5] = [
                    ("README.md", &Markdown(page)),
                    ("alone.svg", &picture),
                    ("alone.csv", &Rows(&alone)),
                    ("inverse.csv", &Rows(&inverse)),
                    ("signs.csv", &Rows(&signs)),
                ];
                out.export(&files, by)?
            }
        })
    }
}

fn tell(what: &str) {
    eprintln!("{what}");
}

fn main() -> ExitCode {
    let cli = StudyCli::parse();
    let command = ["tongue-study".to_owned()].into_iter().chain(std::env::args().skip(1));
    let command = command.collect::<Vec<_>>().join(" ");
    let out = cli.out.unwrap_or_else(|| Path::new("results").join(cli.study.name()));
    let written = OutputDir::prepare(&out).map_err(Error::from);
    let written = written.and_then(|out| cli.study.write(&out, &Provenance::new(command.as_str())));
    match written {
        Ok(written) => {
            written.iter().for_each(|file| println!("{}", file.display()));
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Processor, threads and operating system, as far as they are known.
fn machine() -> String {
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu.lines().find_map(|l| l.strip_prefix("model name")?.split_once(": "));
    format!(
        "{} ({} threads in use, {} {})",
        model.map_or("an unnamed processor", |(_, name)| name.trim()),
        std::thread::available_parallelism().map_or(1, usize::from),
        std::env::consts::OS,
        std::env::consts::ARCH
    )
}
