//! `tongue-fit mesh check`: content of a Gmsh file, its quality, and what it lacks.

use std::fmt::Write as _;
use std::path::PathBuf;

use miette::{IntoDiagnostic, WrapErr};
use serde::Serialize;
use tongue_fit::body::gmsh::{self, Concern, Content, File, MshFormat, Unused};
use tongue_fit::body::{Quality, SolidQuality, Unit};
use tongue_fit::system::{Model, System, SystemError};

use super::choice::choice;
use super::{Global, Outcome, output};

/// Options of `tongue-fit mesh check`.
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(after_help = "Example:\n  tongue-fit mesh check my.msh\n\n\
                  Physical groups say what is what: a surface (in space a volume) called tissue, \
                  curves called GGa, GGm, ... or muscle:NAME, and points or curves called bone or bone:NAME.\n\
                  Exit status: 0 can be used (warnings say what to look at), 1 cannot be used.")]
pub struct Arguments {
    /// The mesh, of format 4.1 or 2.2
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Unit of the coordinates in the file
    #[arg(long, value_name = "UNIT", value_parser = choice::<Unit>(), default_value = "m")]
    mesh_unit: Unit,
}

#[derive(Serialize)]
struct Record {
    file: String,
    format: MshFormat,
    dimension: usize,
    usable: bool,
    concerns: Vec<Told>,
    quality: AnyQuality,
    extent_m: f64,
    muscles: Vec<MuscleRecord>,
    bones: Vec<BoneRecord>,
    unused: Vec<Unused>,
}

#[derive(Serialize)]
struct Told {
    severity: Severity,
    message: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Severity {
    Error,
    Warning,
    Remark,
}

#[derive(Serialize)]
#[serde(untagged)]
enum AnyQuality {
    Flat(Quality),
    Solid(SolidQuality),
}

#[derive(Serialize)]
struct MuscleRecord {
    name: String,
    length_mm: f64,
    nodes: usize,
}

#[derive(Serialize)]
struct BoneRecord {
    name: String,
    nodes: usize,
}

pub fn run(arguments: &Arguments, global: &Global) -> miette::Result<Outcome> {
    let path = arguments.file.display().to_string();
    let bytes = tongue_fit::files::read(&arguments.file)
        .into_diagnostic()
        .wrap_err_with(|| format!("cannot read the mesh file \"{path}\"; name a Gmsh mesh (.msh)"))?;
    let record = match gmsh::read(&bytes, &path, arguments.mesh_unit).into_diagnostic()? {
        File::Flat(content) => {
            let quality = Quality::of(&content.body.mesh);
            record(path, &content, quality.smallest_angle_deg, AnyQuality::Flat(quality))
        }
        File::Solid(content) => {
            let quality = SolidQuality::of(&content.body.mesh);
            record(path, &content, quality.smallest_angle_deg, AnyQuality::Solid(quality))
        }
    };
    match global.json {
        true => output::print(&output::json(&record)?)?,
        false => output::print(&text(&record))?,
    }
    // Status 3 is for results that cannot be trusted; a warning is about the user's intention.
    Ok(if record.usable { Outcome::Good } else { Outcome::Unusable })
}

fn record<const D: usize>(
    file: String,
    content: &Content<D>,
    smallest_angle_deg: f64,
    quality: AnyQuality,
) -> Record {
    let told = |concern: &Concern| {
        let severity = match concern {
            c if c.is_fatal() => Severity::Error,
            c if c.is_remark() => Severity::Remark,
            _ => Severity::Warning,
        };
        Told { severity, message: concern.to_string() }
    };
    let mut concerns: Vec<Told> = gmsh::review(content, smallest_angle_deg).iter().map(told).collect();
    let mesh = &content.body.mesh;
    let refusal = System::new(mesh, &Model::default(), &[]).err();
    match &refusal {
        // Already reported, with advice for the file.
        None | Some(SystemError::TooLarge(_)) => {}
        Some(SystemError::Loose { .. }) if mesh.fixed.is_empty() => {}
        Some(SystemError::Loose { node }) => {
            let tag = content.tags.get(*node).copied().unwrap_or_default();
            let message = format!(
                "the part with Gmsh's node {tag} is joined to no bone, so it could move freely: join it to the rest, or give it one"
            );
            concerns.push(Told { severity: Severity::Error, message });
        }
        Some(other) => concerns.push(Told { severity: Severity::Error, message: other.to_string() }),
    }
    let muscles = mesh.muscles.iter().map(|m| MuscleRecord {
        name: m.name.clone(),
        length_mm: mesh.distance(m.ends()) * 1e3,
        nodes: m.nodes.len(),
    });
    let bones = content.body.bones.iter().map(|b| BoneRecord { name: b.name.clone(), nodes: b.nodes.len() });
    Record {
        file,
        format: content.format,
        dimension: D,
        usable: refusal.is_none(),
        concerns,
        quality,
        extent_m: mesh.extent(),
        muscles: muscles.collect(),
        bones: bones.collect(),
        unused: content.unused.clone(),
    }
}

fn text(record: &Record) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<28}{value}");
    };
    let form = if record.format.binary { "binary" } else { "text" };
    line("file", format!("{} (Gmsh {}, {form})", record.file, record.format.version));
    let nodes =
        |all: usize, outside: usize| format!("{all} ({} in tissue, {outside} outside)", all - outside);
    match &record.quality {
        AnyQuality::Flat(q) => {
            line("nodes", nodes(q.nodes, q.nodes_outside_tissue));
            line("triangles, area", format!("{}, {:.1} mm²", q.cells, q.area_m2 * 1e6));
            line("smallest angle", format!("{:.1}°", q.smallest_angle_deg));
            line("connections", connections(q.connections, q.shortest_connection_m, q.longest_connection_m));
        }
        AnyQuality::Solid(q) => {
            line("nodes", nodes(q.nodes, q.nodes_outside_tissue));
            line("tetrahedra, volume", format!("{}, {:.1} mm³", q.cells, q.volume_m3 * 1e9));
            line("smallest angle", format!("{:.1}° between faces", q.smallest_angle_deg));
            line("connections", connections(q.connections, q.shortest_connection_m, q.longest_connection_m));
        }
    }
    line("extent", format!("{:.1} mm", record.extent_m * 1e3));
    for muscle in &record.muscles {
        line(&muscle.name, format!("{:.1} mm, {} connections", muscle.length_mm, muscle.nodes - 1));
    }
    for bone in &record.bones {
        let nodes = if bone.nodes == 1 { "node" } else { "nodes" };
        line(&format!("bone {}", bone.name), format!("{} {nodes}", bone.nodes));
    }
    for Told { severity, message } in &record.concerns {
        let word = match severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Remark => "remark",
        };
        let _ = writeln!(text, "{word}: {message}");
    }
    text + if record.usable { "usable\n" } else { "NOT USABLE\n" }
}

fn connections(count: usize, shortest_m: f64, longest_m: f64) -> String {
    format!("{count}, {:.2} to {:.2} mm long", shortest_m * 1e3, longest_m * 1e3)
}
