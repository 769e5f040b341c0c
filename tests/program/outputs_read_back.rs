//! Files for Gmsh, ParaView and OpenSim are read by independent readers: meshio, Gmsh itself, and the rules of OpenSim's format.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::Deserialize;
use serde_json::Value;

use super::run::json as tongue_fit;

/// Names the Python that has the packages meshio and gmsh.
const PYTHON: &str = "TONGUE_FIT_PYTHON";
/// Set if the tests must not be skipped, as in CI.
const REQUIRED: &str = "TONGUE_FIT_REQUIRE_PYTHON";

/// Python with these packages; `None`, with a printed reason, if there is none.
fn python() -> Option<PathBuf> {
    let python = std::env::var_os(PYTHON).map(PathBuf::from);
    if python.is_none() {
        assert!(std::env::var_os(REQUIRED).is_none(), "{REQUIRED} is set, but {PYTHON} names no Python");
        println!("skipped: {PYTHON} names no Python that has meshio and gmsh");
    }
    python
}

fn read_back<T: for<'a> Deserialize<'a>>(python: &Path, reader: &str, file: &Path) -> T {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/gmsh/read_back.py");
    let done = Command::new(python).arg(script).arg(reader).arg(file).output().unwrap();
    assert!(done.status.success(), "{reader}: {}", String::from_utf8_lossy(&done.stderr));
    serde_json::from_slice(&done.stdout).unwrap()
}

fn numbers<T: for<'a> Deserialize<'a>>(value: &Value) -> T {
    serde_json::from_value(value.clone()).unwrap()
}

#[derive(Deserialize)]
struct Seen {
    points: Vec<Vec<f64>>,
    cells: BTreeMap<String, Vec<Vec<usize>>>,
    point_data: BTreeMap<String, Value>,
    cell_data: BTreeMap<String, BTreeMap<String, Vec<f64>>>,
    names: BTreeMap<String, [i64; 2]>,
}

const TENSIONS: &str = "--tension GGa=12 --tension SGm=11.5 --tension HGa=4.5";

fn assert_has_points(seen: &Seen, points_m: &Value) {
    let points_m: Vec<[f64; 2]> = numbers(points_m);
    for (point, [x, y]) in seen.points.iter().zip(&points_m) {
        assert_eq!(point[..], [*x, *y, 0.0]);
    }
    assert_eq!(seen.points.len(), points_m.len());
}

fn assert_is_the_simulation(seen: &Seen, record: &Value, mesh: &Value) {
    assert_has_points(seen, &record["positions_m"]);
    assert_eq!(seen.cells["triangle"], numbers::<Vec<Vec<usize>>>(&mesh["triangles"]));
    let chains: BTreeMap<String, Vec<usize>> = numbers(&mesh["muscles"]);
    let (mut lines, mut tensions) = (Vec::new(), Vec::new());
    // JSON objects and files list the muscles in the order of the tables.
    for muscle in ["GGa", "GGm", "GGp", "SGp", "SGm", "SGa", "HGa", "HGp"] {
        let pairs = chains[muscle].windows(2).map(<[usize]>::to_vec);
        tensions.extend(pairs.clone().map(|_| record["tensions_n"][muscle].as_f64().unwrap()));
        lines.extend(pairs);
    }
    assert_eq!(seen.cells["line"], lines);
    assert_eq!(seen.cell_data["tension_n_per_m"]["line"], tensions);
    assert!(seen.cell_data["tension_n_per_m"]["triangle"].iter().all(|t| *t == 0.0));

    let [rest, deformed]: [Vec<[f64; 2]>; 2] = [&mesh["nodes_m"], &record["positions_m"]].map(numbers);
    let moved: Vec<Vec<f64>> = numbers(&seen.point_data["displacement_m"]);
    for ((d, a), b) in moved.iter().zip(&deformed).zip(&rest) {
        assert_eq!(d[..], [a[0] - b[0], a[1] - b[1], 0.0]);
    }
    let length = |x: &[[f64; 2]], l: &[usize]| (x[l[0]][0] - x[l[1]][0]).hypot(x[l[0]][1] - x[l[1]][1]);
    for (stretch, line) in seen.cell_data["stretch"]["line"].iter().zip(&lines) {
        assert!((stretch - length(&deformed, line) / length(&rest, line)).abs() < 1e-12);
    }
    let ratios = &seen.cell_data["area_ratio"]["triangle"];
    for (kind, end) in [("min", f64::min as fn(f64, f64) -> f64), ("max", f64::max)] {
        let found = ratios.iter().copied().reduce(end);
        assert_eq!(found, record[format!("{kind}_area_ratio")].as_f64());
    }
}

#[derive(Deserialize)]
struct SeenByGmsh {
    nodes: usize,
    groups: BTreeMap<String, usize>,
    complaints: Vec<String>,
}

#[test]
fn meshio_reads_the_shape_from_vtu_and_with_gmsh_the_mesh_at_rest_from_msh() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mesh = tongue_fit(folder.path(), "mesh --json --out out");
    let record = tongue_fit(folder.path(), &format!("simulate {TENSIONS} --json --out out"));
    let out = folder.path().join("out");

    let vtu: Seen = read_back(&python, "meshio", &out.join("tongue.vtu"));
    assert_is_the_simulation(&vtu, &record, &mesh);
    let at_rest: Seen = read_back(&python, "meshio", &out.join("mesh.vtu"));
    assert!(at_rest.cell_data["stretch"]["line"].iter().all(|s| *s == 1.0));
    let msh: Seen = read_back(&python, "meshio", &out.join("mesh.msh"));
    assert_has_points(&msh, &mesh["nodes_m"]);
    assert_eq!((&msh.cells["triangle"], &msh.cells["line"]), (&vtu.cells["triangle"], &vtu.cells["line"]));
    assert_eq!((msh.names["tissue"], msh.names["SGm"][1]), ([1, 2], 1));
    let held = msh.cells["vertex"].iter().map(|v| v[0]).collect::<BTreeSet<_>>();
    assert_eq!(held, numbers(&mesh["fixed"]));

    let seen: SeenByGmsh = read_back(&python, "gmsh", &out.join("mesh.msh"));
    assert_eq!(seen.complaints, [""; 0]);
    let bones: usize = seen.groups.iter().filter(|(name, _)| name.starts_with("bone")).map(|(_, n)| n).sum();
    let count = |value: &Value| value.as_array().unwrap().len();
    assert_eq!((seen.nodes, bones), (count(&mesh["nodes_m"]), count(&mesh["fixed"])));
    assert_eq!(seen.groups["tissue"], count(&mesh["triangles"]));
    assert_eq!(seen.groups["GGa"], count(&mesh["muscles"]["GGa"]) - 1);
}

/// Tensors given as nine numbers in a row, or as three rows of three.
fn tensors(of: &Value) -> Vec<Vec<f64>> {
    let of_cell = |tensor: &Value| match numbers::<Vec<Value>>(tensor)[0].is_array() {
        true => numbers::<Vec<Vec<f64>>>(tensor).concat(),
        false => numbers(tensor),
    };
    of.as_array().unwrap().iter().map(of_cell).collect()
}

/// `gmsh_files` in tests/library shows that the middles of edges lie on them.
#[test]
fn a_continuum_is_read_as_quadratic_triangles_with_strain_stress_and_pressure() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let body = "--body continuum --h 8mm --json --out out";
    let record = tongue_fit(folder.path(), &format!("simulate --direct --tension GGa=12 {body}"));
    let mesh = tongue_fit(folder.path(), &format!("mesh {body}"));
    let out = folder.path().join("out");
    let [shape, rest]: [Value; 2] =
        ["tongue.vtu", "mesh.msh"].map(|file| read_back(&python, "meshio", &out.join(file)));
    for (seen, at) in [(&shape, &record["positions_m"]), (&rest, &mesh["nodes_m"])] {
        let points: Vec<Vec<f64>> = numbers(&seen["points"]);
        assert!(seen["cells"].get("triangle").is_none());
        assert!(points.iter().zip(numbers::<Vec<[f64; 2]>>(at)).all(|(p, q)| p[..2] == q[..]));
    }
    assert_eq!(shape["cells"]["triangle6"], rest["cells"]["triangle6"]);
    let of = |name: &str| shape["cell_data"][name]["triangle6"].clone();
    let [mises, pressure, fibre, ratio] = ["von_mises_pa", "pressure_pa", "fibre_stress_pa", "area_ratio"]
        .map(|name| numbers::<Vec<f64>>(&of(name)));
    let cauchy = tensors(&of("cauchy_stress_pa"));
    assert!(cauchy.len() > 50 && tensors(&of("strain")).len() == cauchy.len());
    for ((t, mises), pressure) in cauchy.iter().zip(&mises).zip(&pressure) {
        let mean = (t[0] + t[4] + t[8]) / 3.0;
        assert!((mean + pressure).abs() < 1e-9 * (1.0 + mean.abs()));
        let squares: f64 = (0..9).map(|i| (t[i] - if i % 4 == 0 { mean } else { 0.0 }).powi(2)).sum();
        assert!(((1.5 * squares).sqrt() / mises - 1.0).abs() < 1e-9);
    }
    assert!(fibre.iter().any(|s| *s != 0.0) && ratio.iter().all(|r| (0.8..1.2).contains(r)));
    let gmsh: Value = read_back(&python, "gmsh", &out.join("mesh.msh"));
    assert_eq!(gmsh["complaints"], serde_json::json!([]));
}

#[derive(Deserialize)]
struct Storage {
    header: BTreeMap<String, String>,
    columns: BTreeMap<String, Vec<f64>>,
}

#[test]
fn a_motion_reads_back_frame_by_frame_and_as_storage() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let motion = "--trajectory --t-end 0.2 --frames 3 --tolerance 1e-3 --json --out out";
    let record = tongue_fit(folder.path(), &format!("simulate {TENSIONS} {motion}"));
    let out = folder.path().join("out");

    let storage: Storage = read_back(&python, "sto", &out.join("trajectory.sto"));
    assert_eq!((storage.header["version"].as_str(), storage.header["inDegrees"].as_str()), ("1", "no"));
    let time = &storage.columns["time"];
    assert_eq!((time[0], *time.last().unwrap()), (0.0, 0.2));
    let last_mm = storage.columns["GGa_length_m"].last().unwrap() * 1e3;
    assert!((last_mm - record["lengths_mm"]["GGa"].as_f64().unwrap()).abs() < 1e-9);
    assert_eq!(storage.columns["SGm_tension_n_per_m"].last(), Some(&11.5));
    let mut csv = csv::Reader::from_path(out.join("trajectory.csv")).unwrap();
    let first_mm: f64 = csv.records().next().unwrap().unwrap()[1].parse().unwrap();
    assert!((storage.columns["GGa_length_m"][0] * 1e3 - first_mm).abs() < 1e-12);

    let collection = std::fs::read_to_string(out.join("trajectory.pvd")).unwrap();
    let collection = roxmltree::Document::parse(&collection).unwrap();
    let frames: Vec<_> = collection.descendants().filter(|n| n.has_tag_name("DataSet")).collect();
    assert_eq!(frames.len(), 3);
    let last: Seen = read_back(&python, "meshio", &out.join(frames[2].attribute("file").unwrap()));
    let gga = &storage.columns["GGa_length_m"];
    let lines = last.cells["line"].iter().zip(&last.cell_data["muscle"]["line"]);
    let ends: Vec<&Vec<usize>> = lines.filter(|(_, m)| **m == 0.0).map(|(line, _)| line).collect();
    let (a, b) = (&last.points[ends[0][0]], &last.points[ends[ends.len() - 1][1]]);
    assert!(((a[0] - b[0]).hypot(a[1] - b[1]) - gga.last().unwrap()).abs() < 1e-12);
}
