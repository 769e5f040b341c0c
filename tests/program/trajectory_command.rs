//! `tongue-fit simulate --trajectory` as its users meet it.

use super::run::{json, refused, refused_with, run};

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
fn a_motion_before_equilibrium_reports_its_part_of_the_way() {
    let folder = tempfile::tempdir().unwrap();
    let load = "simulate --trajectory --tension GGa=12 --tension SGm=11.5 --tension HGa=4.5 --frames 2";
    for (t_end, said) in [("3", "at 3 s the body has gone 82"), ("30", "at 30 s the body has gone 100.0 %")] {
        let done = run(folder.path(), &format!("{load} --t-end {t_end}"));
        assert_eq!(done.status, Some(0));
        assert!(
            done.out.contains(said) && done.out.contains("% of the way to its equilibrium"),
            "{}",
            done.out
        );
    }
}

#[test]
fn invalid_runs_are_refused_with_one_message_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("curves.csv"), "time_s,GGa\n0,0\n0.2,5\n0.1,6\n").unwrap();
    for (options, expected) in [
        ("--t-end 0", "--t-end is 0"),
        ("--t-end nan", "--t-end is NaN"),
        ("--dt -1", "--dt is -1"),
        ("--tolerance 0", "--tolerance is 0"),
        ("--ramp -0.1", "--ramp is -0.1"),
        ("--t-end 1e-320", "--t-end is 1e-320"),
        ("--ramp 1e-320", "--ramp is 1e-320"),
        ("--frames 1", "--frames is 1"),
        ("--method verlet --dt 1e-3", "beyond the stability limit of verlet, 1.1"),
        ("--method verlet --tolerance 1e-3", "verlet has no error control"),
        ("--method verlet --t-end 1e4", "take --method tr-bdf2"),
        ("--tension-curves curves.csv", "curves.csv:4:1: time_s"),
    ] {
        let message = refused(folder.path(), &format!("simulate --trajectory {options}"));
        assert!(message.contains(expected), "{options}: {message}");
    }
}

#[test]
fn a_method_of_a_wrong_name_is_told_with_and_without_a_trajectory() {
    let folder = tempfile::tempdir().unwrap();
    for line in ["simulate --method verlett", "simulate --trajectory --method verlett"] {
        assert!(refused_with(2, folder.path(), line).contains("did you mean \"verlet\"?"));
    }
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
