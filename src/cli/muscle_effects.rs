//! What one muscle alone does, as text and as files; in the plane and in space.

use miette::IntoDiagnostic;
use nalgebra::SVector;
use serde::Serialize;
use tongue_fit::body::Mesh;
use tongue_fit::report::{Export, Json, OutputDir, Provenance, Rows, Svg};

use super::{Global, output, table};

/// What a muscle does to itself and to the surface.
pub struct Effect<'a> {
    pub pulling: &'a str,
    /// Its length over that at rest.
    pub stretch: f64,
    /// How far tip, top and root move forward and up, and by how much a body in space becomes wider, mm.
    pub ways_mm: Vec<f64>,
    /// Reasons for doubt; empty where there are none.
    pub alarms: &'a str,
}

/// Writes rows and picture, and prints the rows or the text.
pub fn answer<R: Serialize>(
    rows: &[R],
    picture: &Svg,
    text: String,
    by: &Provenance,
    (out, global): (&OutputDir, &Global),
) -> miette::Result<()> {
    #[derive(Serialize)]
    struct Record<'a, R> {
        muscles: &'a [R],
    }
    let files: [(&str, &dyn Export); 2] = [("muscles.svg", picture), ("muscles.csv", &Rows(rows))];
    let written = out.export(&files, by).into_diagnostic()?;
    output::answer(global, &Json(&Record { muscles: rows }), by, &written, || text + &table::files(&written))
}

/// A table of effects on three points of a surface.
pub fn text(title: &str, effects: &[Effect<'_>], surface: &str) -> String {
    let columns =
        ["pulling", "its length", "tip forward", "up", "top forward", "up", "root forward", "up", "wider"];
    let ways = effects.iter().map(|e| e.ways_mm.len()).max().unwrap_or(0);
    let mut t = table::table(&columns[..2 + ways]);
    for e in effects {
        let mm = |v: &f64| format!("{:+.1} mm", (10.0 * v).round() / 10.0 + 0.0);
        let own = [e.pulling.to_owned(), format!("{:+.1} %", 100.0 * (e.stretch - 1.0))];
        t.add_row(own.into_iter().chain(e.ways_mm.iter().map(mm)));
    }
    let doubtful = effects.iter().filter(|e| !e.alarms.is_empty());
    let doubts: String = doubtful.map(|e| format!("but of {}: {}\n", e.pulling, e.alarms)).collect();
    format!(
        "{title}\n\n{t}\n{doubts}\ntip, top and root: the foremost, highest and rearmost point of the {surface} at rest\n\n"
    )
}

/// By how much the foremost, the highest and the rearmost node of the surface at rest have moved forward and up, mm.
pub fn moved_mm(mesh: &Mesh<2>, positions: &[SVector<f64, 2>]) -> [[f64; 2]; 3] {
    let surface = mesh.surface_nodes();
    let most = |of: fn(&SVector<f64, 2>) -> f64| {
        let best = surface.iter().max_by(|a, b| of(&mesh.nodes[**a]).total_cmp(&of(&mesh.nodes[**b])));
        best.copied().unwrap_or_default()
    };
    [most(|p| -p.x), most(|p| p.y), most(|p| p.x)].map(|node| {
        let way = positions[node] - mesh.nodes[node];
        // Forward is towards smaller x.
        [-1e3 * way.x, 1e3 * way.y]
    })
}

/// `3.1 mm forward, 0.4 up`.
pub fn way([forward, up]: [f64; 2]) -> String {
    let along = |v: f64, unit: &str, [plus, minus]: [&str; 2]| {
        (v.abs() >= 0.05).then(|| format!("{:.1}{unit} {}", v.abs(), if v < 0.0 { minus } else { plus }))
    };
    match (along(forward, " mm", ["forward", "back"]), along(up, "", ["up", "down"])) {
        (Some(forward), Some(up)) => format!("{forward}, {up}"),
        (Some(forward), None) => forward,
        (None, Some(_)) => along(up, " mm", ["up", "down"]).unwrap_or_default(),
        (None, None) => "stays".to_owned(),
    }
}
