//! Options of the body and its model.

use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow, bail};
use clap::parser::ValueSource;
use clap::{ArgMatches, Command};
use tongue_fit::body::{Anatomy, Body, Unit};
use tongue_fit::inner::choice;
use tongue_fit::inner::run::{BodySource, Kind, PlaneBody, SpaceSource};
use tongue_fit::inverse::Method;
use tongue_fit::system::Model;

use super::{inputs, output};

const NODES_AT_DEFAULT: f64 = 123.0;
/// Time of one equilibrium that is followed from rest, at the default spacing on one core, s.
pub const EQUILIBRIUM_S: f64 = 0.01;
/// Time of one fit with its verdict, at the default spacing on one core, s.
pub const FIT_WITH_VERDICT_S: f64 = 3.0;
/// Above this Poisson's ratio the equations are ill-conditioned, which a note says.
const HIGH_POISSON_RATIO: f64 = 0.4999;

/// Time of one fit without a verdict, at the default spacing on one core, s.
pub fn fit_s(method: Method) -> f64 {
    match method {
        Method::GaussNewton => 0.05,
        Method::NelderMead => 0.3,
    }
}

/// Time of an equilibrium over that on the reference tongue: nested dissection in the plane takes a time as the nodes to the power of 1.5.
pub fn growth(nodes: usize) -> f64 {
    (nodes as f64 / NODES_AT_DEFAULT).max(1.0).powf(1.5)
}

pub fn tell_duration_of_equilibrium(nodes: usize) {
    let what = format!("one equilibrium on a body of {nodes} nodes");
    output::tell_duration_of_equilibrium(&what, EQUILIBRIUM_S * growth(nodes), "a larger --h is faster");
}

/// Prints a note before solves that take longer than a minute; `at_default_s` is their time at the default spacing.
pub fn tell_duration(what: &str, nodes: usize, at_default_s: f64) {
    let what = format!("{what} on a body of {nodes} nodes");
    output::tell_duration(&what, at_default_s * growth(nodes), "a larger --h is faster");
}

#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Body", allow_negative_numbers = true)]
pub struct Arguments {
    /// Mesh spacing, such as 5.5mm or 2.75mm; a bare number is millimetres [default: 5.5mm, of a continuum 4mm]
    #[arg(long, value_name = "LENGTH", hide_short_help = true)]
    h: Option<String>,
    /// Anatomy file (TOML) instead of the built-in one
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    anatomy: Option<PathBuf>,
    /// Gmsh mesh (.msh, 4.1 or 2.2), or the JSON of `mesh --json` (.json), instead of an anatomy; `tongue-fit mesh --help` explains what a
    /// .msh needs
    #[arg(long, value_name = "FILE", conflicts_with_all = ["h", "anatomy"])]
    pub mesh: Option<PathBuf>,
    /// Unit of the coordinates in that file
    #[arg(long, value_name = "UNIT", value_parser = inputs::choice::<Unit>(), default_value = "m", requires = "mesh", hide_short_help = true)]
    mesh_unit: Unit,
    /// Poisson's ratio of the tissue (the thesis: 0.49), below 0.5
    #[arg(long, value_name = "NU", default_value_t = Model::default().poisson_ratio, hide_short_help = true)]
    poisson_ratio: f64,
    /// Body: springs on connections (as in the thesis); a continuum of quadratic elements with muscles of finite width, whose answers
    /// hardly depend on the mesh; or, for a vowel, `simulate`, `muscles` and `track`, a tongue in space: the built-in one, a folder with
    /// ArtiSynth's, or hexahedra from Gmsh [springs, continuum, space, FOLDER, FILE.msh]
    #[arg(long, value_parser = body_name, default_value = "springs")]
    body: BodyName,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum BodyName {
    Plane(Kind),
    Space(SpaceSource),
}

fn body_name(word: &str) -> Result<BodyName, String> {
    match choice::named(word) {
        Some(kind) => Ok(BodyName::Plane(kind)),
        None => space_name(word)
            .map(BodyName::Space)
            .map_err(|_| not_a_body(word, &["springs", "continuum", "space"])),
    }
}

pub fn space_name(word: &str) -> Result<SpaceSource, String> {
    match word {
        "space" => Ok(SpaceSource::BuiltIn),
        // A path that does not exist is reported when it is read.
        _ if Path::new(word).extension().is_some_and(|e| e.eq_ignore_ascii_case("msh")) => {
            Ok(SpaceSource::Mesh(PathBuf::from(word)))
        }
        _ if Path::new(word).is_dir() || word.contains('/') => Ok(SpaceSource::Folder(PathBuf::from(word))),
        _ => Err(not_a_body(word, &["space"])),
    }
}

fn not_a_body(word: &str, known: &[&str]) -> String {
    let hint = choice::hint(word, known.iter().copied());
    format!("it is not a folder or a .msh of a body in space either; {hint}")
}

impl Arguments {
    pub fn is_given(&self) -> bool {
        self.mesh.is_some() || self.anatomy.is_some()
    }

    /// The anatomy of the mesh; `None` for a mesh file.
    pub fn anatomy(&self) -> Result<Option<Anatomy>> {
        if self.mesh.is_some() {
            return Ok(None);
        }
        Ok(Some(match self.plane()?.source {
            BodySource::Anatomy { toml, origin } => Anatomy::from_toml(&toml, &origin)?,
            _ => Anatomy::reference()?,
        }))
    }

    pub fn plane(&self) -> Result<PlaneBody> {
        let kind = match &self.body {
            BodyName::Plane(kind) => *kind,
            BodyName::Space(source) => bail!(
                "{source} is a body in space, which `tongue-fit --vowel`, `simulate`, `muscles`, `track` and `sound` answer for; this needs a \
                 body in the plane: --body springs, --body continuum, or --mesh FILE"
            ),
        };
        let spacing_m = self.h.as_deref().map(spacing).transpose()?;
        let source = match (&self.mesh, &self.anatomy) {
            (Some(path), _) => BodySource::read(path, self.mesh_unit)?,
            (None, Some(path)) => {
                let toml = inputs::text("the anatomy file", path)?;
                BodySource::Anatomy { toml, origin: path.display().to_string() }
            }
            (None, None) => BodySource::Tongue,
        };
        Ok(PlaneBody { source, kind, spacing_m })
    }

    pub fn body(&self) -> Result<Body<2>> {
        let file = self.mesh.as_deref().or(self.anatomy.as_deref()).unwrap_or(Path::new("")).display();
        let body = self.plane()?.make(&mut |concern| output::note(&format!("{file}: {concern}")))?;
        self.warn();
        output::step(|| {
            let mesh = &body.mesh;
            let (nodes, triangles) = (mesh.nodes.len(), mesh.cells.len());
            format!("{}: {nodes} nodes, {triangles} triangles, {} muscles", body.what, mesh.muscles.len())
        });
        Ok(body)
    }

    /// Prints a note on tissue that is hardly compressible, before the first solve.
    fn warn(&self) {
        let nu = self.poisson_ratio;
        if nu > HIGH_POISSON_RATIO && nu < 0.5 {
            let bulk_over_shear = 2.0 * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu));
            output::note(&format!(
                "--poisson-ratio {nu}: the bulk modulus is {bulk_over_shear:.0e} times the shear modulus, so a search \
                 may take minutes and end without converging; 0.499 is nearly incompressible"
            ));
        }
    }

    pub fn space(&self) -> Option<&SpaceSource> {
        match &self.body {
            BodyName::Space(source) => Some(source),
            _ => None,
        }
    }

    pub fn model(&self) -> Model {
        Model { poisson_ratio: self.poisson_ratio, ..Model::default() }
    }
}

fn spacing(text: &str) -> Result<f64> {
    let number = text.trim().strip_suffix("mm").unwrap_or(text).trim();
    let mm: Result<f64, _> = number.parse();
    mm.map(|mm| mm * 1e-3)
        .map_err(|_| anyhow!("--h is \"{text}\", not a length; write millimetres, like 5.5mm"))
}

const SPACE_HEADINGS: [&str; 2] = ["Body in space", "Surgery"];

/// Options that bodies in the plane and in space share, and options of space under other headings, by their names in [`clap`]; `None` for a
/// command without bodies in space.
fn options_of_bodies(command: &str) -> Option<(&'static [&'static str], &'static [&'static str])> {
    match command {
        "" => Some((&["vowel", "subject", "target", "baseline", "lengths", "error_mm"], &[])),
        "simulate" => Some((&["direct"], &[])),
        "muscles" => Some((&[], &["activation"])),
        "sound" => Some((&["tract", "lip_opening", "lip_protrusion", "pitch", "seconds"], &[])),
        "track" => {
            Some((&["files", "example", "map", "map_template", "palate", "speaker", "format", "as_is"], &[]))
        }
        _ => None,
    }
}

/// Refuses options that only bodies in the plane, or only those in space, have if the body is of the other kind.
pub fn check_options(command: &Command, matches: &ArgMatches) -> Result<()> {
    let (name, own, command) = match matches.subcommand() {
        Some((name, own)) => (name, own, command.find_subcommand(name)),
        None => ("", matches, Some(command)),
    };
    let Some(((shared, of_space), command)) = options_of_bodies(name).zip(command) else { return Ok(()) };
    let body = own.try_get_raw("body").ok().flatten().and_then(|mut words| words.next());
    let body = body.map(|word| word.to_string_lossy().into_owned());
    let body = body.filter(|word| space_name(word).is_ok());
    for option in command.get_arguments().filter(|a| !a.is_global_set()) {
        let id = option.get_id().as_str();
        if id == "body" || shared.contains(&id) || own.value_source(id) != Some(ValueSource::CommandLine) {
            continue;
        }
        let heading = option.get_help_heading();
        let in_space = of_space.contains(&id) || heading.is_some_and(|h| SPACE_HEADINGS.contains(&h));
        let option = option.get_long().map_or_else(|| id.to_owned(), |long| format!("--{long}"));
        match &body {
            Some(body) if !in_space => {
                bail!(
                    "{option} is for bodies in the plane, and --body {body} is in space: leave one of the two out (muscles in space have \
                     strengths, so give activations, like --activation GGP=0.1)"
                );
            }
            None if in_space => {
                bail!(
                    "{option} needs a body in space: --body space, --body FOLDER with the files of ArtiSynth's tongue, or --body FILE.msh"
                );
            }
            _ => {}
        }
    }
    Ok(())
}
