//! `tongue-fit simulate --trajectory` as its users meet it.

use super::run::{json, run};

#[test]
fn lengths_frames_and_an_animation_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let line = "simulate --trajectory --tension GGa=12 --t-end 0.5 --ramp 0.2 --frames 6 --json";
    let json = json(folder.path(), line);
    assert_eq!(json["status"], "completed");
    assert_eq!(json["time_s"], 0.5);
    assert!(json["counts"]["steps"].as_u64().unwrap() > 5);
    let gone = json["part_of_way_to_equilibrium"].as_f64().unwrap();
    assert!((0.05..0.2).contains(&gone), "half a second is not enough: {gone}");

    let out = folder.path().join("results");
    let mut table = csv::Reader::from_path(out.join("trajectory.csv")).unwrap();
    let columns: Vec<String> = table.headers().unwrap().iter().map(str::to_owned).collect();
    assert_eq!([&columns[0], &columns[1], &columns[9]], ["time_s", "GGa_mm", "GGa_n_per_m"]);
    let rows: Vec<Vec<f64>> =
        table.records().map(|r| r.unwrap().iter().take(17).map(|v| v.parse().unwrap()).collect()).collect();
    assert_eq!(rows.len(), 51);
    assert!((rows[10][0] - 0.1).abs() < 1e-12 && (rows[10][9] - 6.0).abs() < 1e-9, "half way up the ramp");
    assert!(rows.windows(2).all(|w| w[1][1] <= w[0][1]), "GGa only shortens");
    assert_eq!(rows[50][1], json["lengths_mm"]["GGa"].as_f64().unwrap());

    let pvd = std::fs::read_to_string(out.join("trajectory.pvd")).unwrap();
    let pvd = roxmltree::Document::parse(&pvd).unwrap();
    let frames: Vec<_> = pvd.descendants().filter_map(|n| n.attribute("file")).collect();
    assert_eq!(frames.len(), 6);
    for frame in frames {
        let vtu = std::fs::read_to_string(out.join(frame)).unwrap();
        let vtu = roxmltree::Document::parse(&vtu).unwrap();
        let piece = vtu.descendants().find(|n| n.has_tag_name("Piece")).unwrap();
        assert_eq!(piece.attribute("NumberOfPoints"), Some("123"));
        assert_eq!(piece.attribute("NumberOfCells"), Some("247"), "188 triangles and 59 lines of muscles");
    }
    let svg = std::fs::read_to_string(out.join("trajectory.svg")).unwrap();
    assert!(roxmltree::Document::parse(&svg).is_ok());
}

#[test]
fn a_failed_run_reports_it_and_keeps_its_frames() {
    let folder = tempfile::tempdir().unwrap();
    let line = "simulate --trajectory --tension GGa=12 --method verlet --dt 1e-5 --t-end 0.1 --force --json";
    let done = run(folder.path(), line);
    assert_eq!(done.status, Some(3), "{}", done.err);
    let json = done.record();
    assert_ne!(json["status"], "completed");
    assert!(json["time_s"].as_f64().unwrap() < 0.1);
}
