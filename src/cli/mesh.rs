//! `tongue-fit mesh`: the mesh and its quality.

use std::fmt::Write as _;

use miette::IntoDiagnostic;
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};
use tongue_fit::body::{MuscleChain, Quality, gmsh};
use tongue_fit::report::{self, ByMuscle, OutputDir};
use tongue_fit::{inverse, system};

use super::{Global, Outcome, body, mesh_check, output, table};

/// Options of `tongue-fit mesh`.
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "Examples:\n  tongue-fit mesh --h 2.75mm --json > mesh.json\n  tongue-fit mesh check my.msh"
)]
pub struct Arguments {
    #[command(subcommand)]
    action: Option<Action>,
    #[command(flatten)]
    body: body::Arguments,
}

#[derive(Debug, Clone, clap::Subcommand)]
enum Action {
    /// Read a Gmsh mesh (.msh) and say what it is, how good, and what it lacks
    Check(mesh_check::Arguments),
}

#[derive(Serialize)]
struct Connection {
    nodes: [usize; 2],
    rest_length_m: f64,
    stiffness_n_per_m: f64,
}

/// Muscles by name, each with its chain of nodes.
struct Chains(Vec<MuscleChain>);

impl Serialize for Chains {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for chain in &self.0 {
            map.serialize_entry(&chain.name, &chain.nodes)?;
        }
        map.end()
    }
}

#[derive(Serialize)]
struct Record {
    nodes_m: Vec<[f64; 2]>,
    triangles: Vec<Vec<usize>>,
    connections: Vec<Connection>,
    fixed: Vec<usize>,
    muscles: Chains,
    kappa_s_j: f64,
    node_mass_kg: f64,
    rest_lengths_mm: ByMuscle<f64>,
    quality: Quality,
}

/// Runs it.
pub fn run(arguments: &Arguments, global: &Global) -> miette::Result<Outcome> {
    if let Some(Action::Check(check)) = &arguments.action {
        return mesh_check::run(check, global);
    }
    let (mesh, bones) = arguments.body.mesh_and_bones()?;
    let out = global.out.as_ref().map(OutputDir::prepare).transpose().into_diagnostic()?;
    let coefficients = system::coefficients(&mesh, &arguments.body.model()).into_diagnostic()?;
    let stiffness = system::connection_stiffness(&mesh, &coefficients);
    let quality = Quality::of(&mesh);
    let length = |[a, b]: [usize; 2]| (mesh.nodes[b] - mesh.nodes[a]).norm();
    let rest_lengths =
        inverse::muscle_numbers(&mesh).into_diagnostic()?.map(|m| length(mesh.muscles[m].ends()));
    let record = Record {
        nodes_m: mesh.nodes.iter().map(|p| [p.x, p.y]).collect(),
        triangles: mesh.cells.iter().map(<[usize]>::to_vec).collect(),
        connections: mesh
            .connections
            .iter()
            .zip(&stiffness)
            .map(|(&nodes, &k)| Connection { nodes, rest_length_m: length(nodes), stiffness_n_per_m: k })
            .collect(),
        fixed: mesh.fixed.clone(),
        muscles: Chains(mesh.muscles.clone()),
        kappa_s_j: coefficients.kappa,
        node_mass_kg: coefficients.node_mass,
        rest_lengths_mm: ByMuscle(rest_lengths.map(|l| l * 1e3)),
        quality: quality.clone(),
    };
    let json = output::json(&record)?;
    let written = match &out {
        Some(out) => {
            let at_rest = vec![0.0; mesh.muscles.len()];
            let vtu = report::vtu(&mesh, &mesh.nodes, &at_rest).into_diagnostic()?;
            let msh = gmsh::write(&mesh, &bones);
            let files =
                [("mesh.json", json.as_bytes()), ("mesh.msh", msh.as_bytes()), ("mesh.vtu", vtu.as_bytes())];
            out.write_all(&files).into_diagnostic()?
        }
        None => Vec::new(),
    };
    if global.json {
        output::print(&json)?;
        return Ok(Outcome::Good);
    }
    let q = &quality;
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<28}{value}");
    };
    let in_tissue = q.nodes - q.nodes_outside_tissue;
    line("nodes", format!("{} ({in_tissue} in tissue, {} outside)", q.nodes, q.nodes_outside_tissue));
    line("boundary nodes", q.boundary_nodes.to_string());
    line("triangles", q.cells.to_string());
    line("connections", q.connections.to_string());
    line("area", format!("{:.1} mm²", q.area_m2 * 1e6));
    line("smallest angle", format!("{:.1}°", q.smallest_angle_deg));
    line(
        "connection length",
        format!(
            "{:.2} / {:.2} / {:.2} mm (shortest, mean, longest)",
            q.shortest_connection_m * 1e3,
            q.mean_connection_m * 1e3,
            q.longest_connection_m * 1e3
        ),
    );
    line(
        "k, kappa_s",
        format!(
            "{:.1} N/m, {:.4} J per metre of thickness",
            coefficients.tissue_stiffness, coefficients.kappa
        ),
    );
    for (chain, length) in mesh.muscles.iter().zip(mesh.muscles.iter().map(|m| length(m.ends()))) {
        line(&chain.name, format!("{:.1} mm, {} connections", length * 1e3, chain.nodes.len() - 1));
    }
    output::summary(&(text + &table::files(&written)), &written)?;
    Ok(Outcome::Good)
}
