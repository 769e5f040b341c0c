use std::fmt::Write as _;

use anyhow::Result;
use tongue_fit::body::json::MeshRecord;
use tongue_fit::body::{Mesh, Quality};
use tongue_fit::inner::report::{Export, Json, Msh, Vtu};
use tongue_fit::material::Coefficients;
use tongue_fit::system;

use super::{Global, Outcome, body, output};

#[derive(Debug, Clone, clap::Args)]
#[command(
    after_help = "Examples:\n  tongue-fit mesh --h 2.75mm --json > mesh.json\n  tongue-fit mesh --mesh my.msh\n\n\
                  Physical groups of a mesh from Gmsh say what is what: a surface (in space a volume) called tissue, \
                  curves called GGa, GGm, ... or muscle:NAME, points or curves called bone or bone:NAME, \
                  and other:NAME for what is left out."
)]
pub struct Arguments {
    #[command(flatten)]
    body: body::Arguments,
}

pub fn run(arguments: &Arguments, global: &Global) -> Result<Outcome> {
    let body = arguments.body.body()?;
    let mesh = &body.mesh;
    let out = global.given_folder()?;
    let coefficients = system::coefficients(mesh, &arguments.body.model())?;
    let record = MeshRecord::of(&body, &arguments.body.model())?;
    let json = Json(&record);
    let at_rest = vec![0.0; mesh.muscles.len()];
    let vtu = Vtu::new(mesh, &mesh.nodes, &at_rest)?;
    let msh = Msh { mesh, bones: &body.bones };
    let files: [(&str, &dyn Export); 3] = [("mesh.json", &json), ("mesh.msh", &msh), ("mesh.vtu", &vtu)];
    output::write_and_answer(global, (out.as_ref(), &files), &json, &super::provenance(), || {
        text(mesh, &coefficients)
    })?;
    Ok(Outcome::Good)
}

fn text(mesh: &Mesh<2>, coefficients: &Coefficients) -> String {
    let q = Quality::of(mesh);
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
    for chain in &mesh.muscles {
        let length_mm = mesh.distance(chain.ends()) * 1e3;
        line(&chain.name, format!("{length_mm:.1} mm, {} connections", chain.nodes.len() - 1));
    }
    text
}
