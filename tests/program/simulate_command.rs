//! `tongue-fit simulate --trajectory` and `tongue-fit muscles` as users run them.

use super::run::{json, run};

/// `outputs_read_back` shows that other readers read the files.
#[test]
fn lengths_frames_and_an_animation_of_a_motion_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let line = "simulate --trajectory --tension GGa=12 --t-end 0.5 --ramp 0.2 --frames 6 --json";
    let json = json(folder.path(), line);
    assert_eq!((&json["status"], &json["time_s"]), (&"completed".into(), &0.5.into()));
    let gone = json["part_of_way_to_equilibrium"].as_f64().unwrap();
    assert!((0.05..0.2).contains(&gone), "half a second is not enough: {gone}");
    let read = |name: &str| std::fs::read_to_string(folder.path().join("results").join(name)).unwrap();
    let table = read("trajectory.csv");
    let mut table = csv::Reader::from_reader(table.as_bytes());
    let columns: Vec<String> = table.headers().unwrap().iter().map(str::to_owned).collect();
    assert_eq!([&columns[0], &columns[1], &columns[9]], ["time_s", "GGa_mm", "GGa_n_per_m"]);
    let rows: Vec<Vec<f64>> =
        table.records().map(|r| r.unwrap().iter().take(17).map(|v| v.parse().unwrap()).collect()).collect();
    assert_eq!(rows.len(), 51);
    assert!((rows[10][0] - 0.1).abs() < 1e-12 && (rows[10][9] - 6.0).abs() < 1e-9, "half way up the ramp");
    assert_eq!(rows[50][1], json["lengths_mm"]["GGa"].as_f64().unwrap());
    let pvd = read("trajectory.pvd");
    let frames: Vec<&str> =
        pvd.split("file=\"").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    assert_eq!(frames.len(), 6);
    for frame in frames {
        // These are 188 triangles and 59 lines of muscles.
        assert!(read(frame).contains("NumberOfPoints=\"123\" NumberOfCells=\"247\""), "{frame}");
    }
    assert!(roxmltree::Document::parse(&read("trajectory.svg")).is_ok());
}

#[test]
fn a_motion_that_ends_before_its_tension_curves_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let told = |last: &str| {
        std::fs::write(folder.path().join("pull.csv"), format!("time_s,GGa\n0,0\n{last},12\n")).unwrap();
        run(folder.path(), "simulate --trajectory --tension-curves pull.csv --t-end 0.5 --frames 2 --out out")
            .err
    };
    assert!(
        told("500").contains("the motion ends at 0.5 s (--t-end), before the last time of pull.csv, 500 s")
    );
    assert_eq!(told("0.5"), "");
}

#[test]
fn a_failed_motion_reports_it_and_keeps_its_frames() {
    let folder = tempfile::tempdir().unwrap();
    let line = "simulate --trajectory --tension GGa=12 --method verlet --dt 1e-5 --t-end 0.1 --force --json";
    let done = run(folder.path(), line);
    assert_eq!(done.status, Some(3), "{}", done.err);
    let json = done.record();
    assert!(json["status"] != "completed" && json["time_s"].as_f64().unwrap() < 0.1, "{json}");
}

/// SGp shortens to a fifth at 110 N/m, which is beyond what the law is meant for.
#[test]
fn a_muscle_alone_has_the_shape_and_the_alarms_of_its_simulation() {
    let folder = tempfile::tempdir().unwrap();
    let each = run(folder.path(), "muscles --tension 110 --json --out out");
    assert_eq!(each.status, Some(3), "{}", each.err);
    let each = each.record();
    for (name, is_doubtful) in [("SGp", true), ("GGm", false)] {
        let alone = run(folder.path(), &format!("simulate --tension {name}=110 --json")).record();
        let rows = each["muscles"].as_array().unwrap().iter().filter(|row| row["pulling"] == name);
        for row in rows {
            let muscle = row["muscle"].as_str().unwrap();
            assert_eq!(row["stretch"], alone["stretches"][muscle], "{name}, {muscle}");
            let alarms = row["alarms"].as_str().unwrap();
            assert!(alarms.contains("times as long as at rest") == is_doubtful, "{name}: {alarms}");
            assert_eq!(alone["alarms"].as_array().unwrap().is_empty(), !is_doubtful, "{name}: {alone}");
        }
    }
}

/// `figures` in tests/library shows that pictures of one body have the same axes.
#[test]
fn every_muscle_shortens_where_it_pulls_and_is_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let json = json(folder.path(), "muscles --json --out out");
    let rows = json["muscles"].as_array().unwrap();
    assert_eq!(rows.len(), 8 * 8);
    let own: Vec<_> = rows.iter().filter(|r| r["pulling"] == r["muscle"]).collect();
    assert!(own.iter().all(|r| r["status"] == "converged" && r["stretch"].as_f64() < Some(0.95)), "{json}");
    // The posterior genioglossus pushes the tongue forward, and the styloglossus pulls its tip back (Takano and Honda 2007).
    let tip =
        |name: &str| own.iter().find(|r| r["pulling"] == name).unwrap()["tip_forward_mm"].as_f64().unwrap();
    assert!(tip("GGp") > 1.0 && tip("SGa") < -1.0);
    let mut table = csv::Reader::from_path(folder.path().join("out/muscles.csv")).unwrap();
    assert_eq!(table.records().count(), rows.len());
    let svg = std::fs::read_to_string(folder.path().join("out/muscles.svg")).unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let told: Vec<&str> =
        document.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect();
    for row in own {
        let name = row["muscle"].as_str().unwrap();
        assert_eq!(told.iter().filter(|t| t.starts_with(name)).count(), 1, "{name}");
    }
}
