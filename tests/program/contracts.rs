//! The command as users meet it: contracts, exit statuses, messages.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use assert_cmd::cargo::cargo_bin;
use serde_json::Value;

const MUSCLES: [&str; 8] = ["GGa", "GGm", "GGp", "SGp", "SGm", "SGa", "HGa", "HGp"];

fn run_in(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(cargo_bin("tongue-fit")).args(arguments).current_dir(folder).output().unwrap()
}

fn run(arguments: &[&str]) -> Output {
    run_in(tempfile::tempdir().unwrap().path(), arguments)
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn json(arguments: &[&str]) -> Value {
    let output = run(arguments);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Runs a command that must fail, checks the status and that stdout is empty, and returns its only message.
fn refused(arguments: &[&str], status: i32) -> String {
    let folder = tempfile::tempdir().unwrap();
    let output = run_in(folder.path(), arguments);
    let message = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {message}");
    assert!(output.stdout.is_empty(), "{arguments:?} printed {}", stdout(&output));
    assert_eq!(message.matches("error:").count(), 1, "{message}");
    assert!(!message.contains("panicked"), "{message}");
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
    assert!(left.is_empty(), "{arguments:?} left {left:?}");
    message
}

/// If the barrier acts or the branch from rest was left, table, JSON and exit status of every command say so.
#[test]
fn doubtful_equilibria_are_reported_everywhere() {
    let barrier = "the barrier against inversion acts in";
    let branch = "the branch of equilibria from rest ends at";
    let folder = tempfile::tempdir().unwrap();
    let scene = "title = \"x\"\nwant = \"shape\"\n[body.tongue]\n[tensions_n]\nHGp = 441.12\n";
    std::fs::write(folder.path().join("s.toml"), scene).unwrap();
    let cases: [(&str, &[&str]); 5] = [
        ("simulate --tension HGp=441.12", &[barrier]),
        ("simulate --tension HGp=441.12 --direct", &[barrier]),
        ("simulate --tension GGa=1e6", &[barrier, branch]),
        ("muscles --tension 1e6", &[barrier]),
        ("scene run s.toml", &[barrier]),
    ];
    for (command, parts) in cases {
        let words: Vec<&str> = command.split(' ').collect();
        let output = run_in(folder.path(), &words);
        assert_eq!(output.status.code(), Some(3), "{command}");
        let text = stdout(&output);
        assert!(parts.iter().all(|part| text.contains(part)), "{command}: {text}");
        assert!(!output.stderr.is_empty(), "{command}");
        if words[0] == "simulate" {
            let output = run_in(folder.path(), &[&words[..], &["--json"]].concat());
            assert_eq!(output.status.code(), Some(3), "{command}");
            let record: Value = serde_json::from_slice(&output.stdout).unwrap();
            let alarms = record["alarms"].as_array().unwrap();
            assert_eq!(alarms.len(), parts.len(), "{alarms:?}");
            assert_eq!(alarms[0]["kind"], "barrier_acts");
        }
    }
}

#[test]
fn fitting_a_vowel_prints_a_table_of_100_columns_and_writes_four_files() {
    let folder = tempfile::tempdir().unwrap();
    let output = run_in(folder.path(), &["--vowel", "a"]);
    assert_eq!(output.status.code(), Some(0));
    let text = stdout(&output);
    assert!(text.lines().count() <= 25, "{text}");
    for line in text.lines() {
        assert!(line.chars().count() <= 100, "{} columns: {line}", line.chars().count());
    }
    for wanted in [
        "Harder than in /ɯ/",
        "Not known: ",
        "12.00",
        "11.50",
        "4.50",
        "NOT UNIQUE: 2 equations for 3 tensions",
        "converged",
    ] {
        assert!(text.contains(wanted), "{wanted} is missing in\n{text}");
    }
    for file in ["fit.json", "fit.csv", "tongue.svg", "changes.svg"] {
        assert!(text.contains(file));
        assert!(folder.path().join("results").join(file).metadata().unwrap().len() > 500, "{file}");
    }
    let mut csv = csv::Reader::from_path(folder.path().join("results/fit.csv")).unwrap();
    assert!(csv.headers().unwrap().iter().any(|h| h == "tension_n_per_m"));
    assert_eq!(csv.records().count(), 8);
}

#[test]
fn the_json_of_a_fit_has_the_promised_fields() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("deep/er");
    let fit = json(&["--vowel", "a", "--json", "--out", out.to_str().unwrap()]);
    assert_eq!(fit["subject"], "S2");
    assert_eq!((fit["vowel"].as_str(), fit["baseline"].as_str()), (Some("a"), Some("ɯ")));
    assert_eq!(fit["target_kind"], "ratio");
    assert_eq!(fit["active"], serde_json::json!(["GGa", "SGm", "HGa"]));
    assert_eq!(fit["status"], "converged");
    assert_eq!(fit["verdict_from"], "short_run");
    for (said, m) in fit["verdict"].as_array().unwrap().iter().zip(MUSCLES) {
        assert_eq!(said["muscle"], m);
        assert!(
            (0.0..=1.0).contains(&said["p_rises"].as_f64().unwrap()) && said["word"].is_string(),
            "{said}"
        );
    }
    for field in ["tensions_n", "lengths_mm", "ratios", "target_ratios", "residuals"] {
        for m in MUSCLES {
            assert!(fit[field][m].is_number(), "{field} {m}");
        }
    }
    assert!(fit["evaluations"].as_u64().unwrap() > 100 && fit["wall_s"].as_f64().unwrap() > 0.0);
    let i = &fit["identifiability"];
    assert_eq!(i["singular_values"].as_array().unwrap().len(), 3);
    assert_eq!(i["null_directions"].as_array().unwrap().len(), 1);
    let file: Value = serde_json::from_slice(&std::fs::read(out.join("fit.json")).unwrap()).unwrap();
    assert_eq!(file, fit);
}

#[test]
fn u_is_taken_for_the_vowel_it_stands_for_and_is_the_baseline() {
    let message = refused(&["--vowel", "u"], 1);
    assert!(message.contains("/ɯ/ of S2 is the baseline"), "{message}");
}

#[test]
fn a_simulation_reports_lengths_that_its_positions_have() {
    let all = ["simulate", "--tension", "GGa=12", "--tension", "SGm=11.5", "--tension", "hga=4.5", "--json"];
    let s = json(&all);
    let mesh = json(&["mesh", "--json"]);
    assert_eq!(s["status"], "converged");
    assert!(s["max_residual_force_n"].as_f64().unwrap() < 1e-9);
    assert_eq!(s["tensions_n"]["HGa"], 4.5);
    let at =
        |node: &Value, axis: usize| s["positions_m"][node.as_u64().unwrap() as usize][axis].as_f64().unwrap();
    for m in MUSCLES {
        let chain = mesh["muscles"][m].as_array().unwrap();
        let (a, b) = (&chain[0], &chain[chain.len() - 1]);
        let length = f64::hypot(at(b, 0) - at(a, 0), at(b, 1) - at(a, 1)) * 1e3;
        assert!((length - s["lengths_mm"][m].as_f64().unwrap()).abs() < 1e-9, "{m}");
        let stretch = length / mesh["rest_lengths_mm"][m].as_f64().unwrap();
        assert!((stretch - s["stretches"][m].as_f64().unwrap()).abs() < 1e-9, "{m}");
    }
    for field in ["iterations", "min_area_ratio", "max_area_ratio", "wall_s"] {
        assert!(s[field].is_number(), "{field}");
    }
}

/// Independent check of the outputs: forces recomputed here from the mesh's JSON balance at the simulation's
/// positions.
#[test]
fn the_published_mesh_and_positions_balance_in_an_independent_recalculation() {
    let s =
        json(&["simulate", "--tension", "GGa=12", "--tension", "SGm=11.5", "--tension", "HGa=4.5", "--json"]);
    let mesh = json(&["mesh", "--json"]);
    let pair = |v: &Value| [v[0].as_f64().unwrap(), v[1].as_f64().unwrap()];
    let x: Vec<[f64; 2]> = s["positions_m"].as_array().unwrap().iter().map(pair).collect();
    let x0: Vec<[f64; 2]> = mesh["nodes_m"].as_array().unwrap().iter().map(pair).collect();
    let number = |v: &Value| v.as_u64().unwrap() as usize;
    let mut f = vec![[0.0; 2]; x.len()];
    let mut pull = |a: usize, b: usize, tension: f64| {
        let d = [x[b][0] - x[a][0], x[b][1] - x[a][1]];
        let l = f64::hypot(d[0], d[1]);
        for axis in 0..2 {
            f[a][axis] += tension * d[axis] / l;
            f[b][axis] -= tension * d[axis] / l;
        }
    };
    for c in mesh["connections"].as_array().unwrap() {
        let (a, b) = (number(&c["nodes"][0]), number(&c["nodes"][1]));
        let l = f64::hypot(x[b][0] - x[a][0], x[b][1] - x[a][1]);
        let k = c["stiffness_n_per_m"].as_f64().unwrap();
        pull(a, b, k * (l - c["rest_length_m"].as_f64().unwrap()));
    }
    for (m, tension) in [("GGa", 12.0), ("SGm", 11.5), ("HGa", 4.5)] {
        for step in mesh["muscles"][m].as_array().unwrap().windows(2) {
            pull(number(&step[0]), number(&step[1]), tension);
        }
    }
    let kappa = mesh["kappa_s_j"].as_f64().unwrap();
    let area = |p: &[[f64; 2]], t: [usize; 3]| {
        let [a, b, c] = t.map(|n| p[n]);
        0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
    };
    for t in mesh["triangles"].as_array().unwrap() {
        let t = [number(&t[0]), number(&t[1]), number(&t[2])];
        let (now, rest) = (area(&x, t), area(&x0, t));
        for i in 0..3 {
            let (b, c) = (x[t[(i + 1) % 3]], x[t[(i + 2) % 3]]);
            let pressure = -kappa * (now - rest) / (rest * rest);
            f[t[i]][0] += pressure * 0.5 * (b[1] - c[1]);
            f[t[i]][1] += pressure * 0.5 * (c[0] - b[0]);
        }
    }
    let fixed: Vec<usize> = mesh["fixed"].as_array().unwrap().iter().map(number).collect();
    for (node, f) in f.iter().enumerate().filter(|(n, _)| !fixed.contains(n)) {
        assert!(f64::hypot(f[0], f[1]) < 2e-9, "node {node}: {f:?}");
    }
}

#[test]
fn the_mesh_meets_its_contract() {
    let mesh = json(&["mesh", "--json"]);
    assert_eq!(mesh["nodes_m"].as_array().unwrap().len(), 123);
    assert_eq!(mesh["triangles"].as_array().unwrap().len(), 188);
    assert_eq!(mesh["connections"].as_array().unwrap().len(), 310);
    assert_eq!(mesh["fixed"].as_array().unwrap().len(), 4);
    assert!((mesh["kappa_s_j"].as_f64().unwrap() - 1.456).abs() < 0.1);
}

#[test]
fn unknown_names_suggest_the_nearest_and_exit_with_1() {
    let message = refused(&["--vowel", "y"], 1);
    assert!(
        message.contains("S2 has no row for /y/") && message.contains("it has /i/, /e/, /a/"),
        "{message}"
    );
    let message = refused(&["--vowel", "a", "--subject", "S22"], 1);
    assert!(message.contains("S22") && message.contains("did you mean \"S2\"?"), "{message}");
    let message = refused(&["--vowel", "a", "--muscles", "GGa,SGn"], 1);
    assert!(message.contains("unknown muscle \"SGn\"") && message.contains("did you mean"), "{message}");
    let message = refused(&["simulate", "--tension", "GGx=3"], 1);
    assert!(message.contains("there is no muscle \"GGx\"") && message.contains("did you mean"), "{message}");
    assert!(refused(&["--vowel", "a", "--target", "rato"], 1).contains("did you mean \"ratio\"?"));
}

#[test]
fn a_simulation_says_whether_it_is_on_the_branch_from_rest_and_where_that_ends() {
    let s = json(&["simulate", "--tension", "GGa=12", "--tension", "SGm=11.5", "--json"]);
    assert_eq!((&s["connection"], &s["branch"]["critical"]), (&Value::from("traced"), &Value::Null));
    let plain = json(&["simulate", "--tension", "GGa=12", "--tension", "SGm=11.5", "--direct", "--json"]);
    assert_eq!((&plain["connection"], &plain["branch"]), (&Value::from("direct"), &Value::Null));
    assert_eq!((&s["positions_m"], &s["iterations"]), (&plain["positions_m"], &plain["iterations"]));
    let mut far = vec!["simulate", "--json"];
    for pull in ["GGa=100", "GGm=100", "GGp=100", "SGp=100", "SGm=100"] {
        far.extend(["--tension", pull]);
    }
    let output = run(&far);
    assert_eq!(output.status.code(), Some(3), "the branch from rest was left");
    let far: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_ne!(far["connection"], "traced");
    assert_eq!(far["alarms"][0]["kind"], "not_on_branch");
    let end = far["branch"]["critical"]["load"].as_f64().unwrap();
    assert!((0.5..1.0).contains(&end) && far["status"] == "converged", "{}", far["branch"]);
}

#[test]
fn a_table_of_nothing_but_contracting_muscles_is_fitted_and_drawn_anew() {
    let folder = tempfile::tempdir().unwrap();
    let rows = "subject,vowel,GGa_mm,SGm_mm,HGa_mm\nX,ɯ,45,30,40\nX,a,41,26,35\n";
    std::fs::write(folder.path().join("three.csv"), rows).unwrap();
    let batch = ["batch", "--lengths", "three.csv", "--draws", "5", "--subsets", "0", "--json"];
    let output = run_in(folder.path(), &batch);
    let batch: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(batch["summary"]["fits"], 2, "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn invalid_tensions_are_refused() {
    assert!(refused(&["simulate", "--tension", "GGa=twelve"], 1).contains("not a number"));
    assert!(refused(&["simulate", "--tension", "GGa=-1"], 1).contains("not negative"));
    assert!(refused(&["simulate", "--tension", "GGa=NaN"], 1).contains("finite"));
    assert!(refused(&["simulate", "--tension", "GGa=inf"], 1).contains("finite"));
    assert!(refused(&["simulate", "--tension", "GGa"], 1).contains("MUSCLE=NEWTONS"));
    assert!(refused(&["simulate", "--tension", "GGa=1", "--tension", "gga=2"], 1).contains("twice"));
}

#[test]
fn the_tissue_of_finite_elements_and_the_printed_table_are_no_options() {
    assert!(refused(&["simulate", "--tissue", "fe", "--tension", "GGa=1"], 2).contains("--tissue"));
    let printed = refused(&["simulate", "--preset", "as-printed", "--tension", "GGa=1"], 2);
    assert!(printed.contains("consistent, thesis"), "{printed}");
}

#[test]
fn the_published_answer_is_shown_only_for_its_own_row() {
    let folder = tempfile::tempdir().unwrap();
    let printed =
        |options: &[&str]| stdout(&run_in(folder.path(), &[&["--vowel", "a", "-v"], options].concat()));
    assert!(printed(&[]).contains("table 4.8"));
    assert!(!printed(&["--muscles", "GGa,SGm"]).contains("table 4.8"));
    assert!(!printed(&["--subject", "S1"]).contains("table 4.8"));
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/targets/takano2007_lengths.csv");
    assert!(!printed(&["--lengths", own]).contains("table 4.8"));
}

#[test]
fn wrong_usage_exits_with_2() {
    refused(&["--vowl", "a"], 2);
    refused(&[], 2);
    refused(&["simulate", "--tension"], 2);
    refused(&["mesh", "--preset", "golden"], 2);
    assert!(refused(&["--vowel", "a", "mesh"], 2).contains("--vowel"));
    assert!(refused(&["--h", "2.75mm", "mesh"], 2).contains("--h"));
    assert!(refused(&["--method", "nelder-mead", "simulate"], 2).contains("--method"));
    assert_eq!(
        run(&["--threads", "1", "mesh"]).status.code(),
        Some(0),
        "options of every command may stand anywhere"
    );
    refused(&["--vowel", "a", "--threads", "0"], 2);
}

#[test]
fn spacings_and_settings_out_of_range_are_refused() {
    for h in ["0", "-1mm", "100mm", "NaN", "five"] {
        let message = refused(&["mesh", "--h", h], if h.starts_with('-') { 2 } else { 1 });
        assert!(message.contains("mm") || message.contains("--h"), "{message}");
    }
    assert!(refused(&["--vowel", "a", "--h", "100"], 1).contains("mm"));
    assert!(refused(&["--vowel", "a", "--anatomy", "no/such.toml"], 1).contains("no/such.toml"));
    assert!(refused(&["--vowel", "a", "--threads", "100000"], 1).contains("--threads"));
}

#[test]
fn faulty_length_files_are_reported_with_line_and_column() {
    let folder = tempfile::tempdir().unwrap();
    let header = "subject,vowel,GGa_mm,GGm_mm,GGp_mm,SGp_mm,SGm_mm,SGa_mm,HGa_mm,HGp_mm\n";
    let rest = "X,ɯ,46,60,45,59,32,42,42,31\n";
    let cases = [
        ("X,a,41,62,53,59,23,44,zero,35\n", "lengths.csv:3:9", "not a number"),
        ("X,a,41,62,53,59,23,44,0,35\n", "lengths.csv:3:9", "0"),
        ("X,a,41,62,-53,59,23,44,33,35\n", "lengths.csv:3:5", "-53"),
        ("X,a,41,62,inf,59,23,44,33,35\n", "lengths.csv:3:5", "inf"),
    ];
    for (row, place, what) in cases {
        let path = folder.path().join("lengths.csv");
        std::fs::File::create(&path).unwrap().write_all(format!("{header}{rest}{row}").as_bytes()).unwrap();
        let arguments = ["--vowel", "a", "--subject", "X", "--lengths", path.to_str().unwrap()];
        let output = run_in(folder.path(), &arguments);
        let message = String::from_utf8(output.stderr.clone()).unwrap();
        assert_eq!(output.status.code(), Some(0), "one bad cell loses one cell: {message}");
        assert!(message.contains(place) && message.contains(what), "{message}");
        assert!(message.contains("this length is left out"), "{message}");
    }
    let path = folder.path().join("lengths.csv");
    std::fs::write(&path, format!("{header}{rest}X,a,41,62\n")).unwrap();
    let message = refused(&["--vowel", "a", "--subject", "X", "--lengths", path.to_str().unwrap()], 1);
    assert!(message.contains("lengths.csv:3:"), "{message}");
    let message = refused(&["--vowel", "a", "--lengths", "no/such.csv"], 1);
    assert!(message.contains("no/such.csv"), "{message}");
    let message = refused(&["--vowel", "a", "--subject", "S4"], 1);
    assert!(message.contains("S4") && message.contains("/ɯ/"), "{message}");
}

#[test]
fn a_faulty_anatomy_is_reported_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("anatomy.toml");
    std::fs::write(&path, "outline = [[0, 0], [1, \"x\"]]\n").unwrap();
    let message = refused(&["mesh", "--anatomy", path.to_str().unwrap()], 1);
    assert!(message.contains("anatomy.toml:1"), "{message}");
}

#[test]
fn an_unwritable_folder_is_refused_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "in the way").unwrap();
    let message = refused(&["--vowel", "a", "--out", file.join("sub").to_str().unwrap()], 1);
    assert!(message.contains("cannot write into the output folder"), "{message}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "in the way");
}

#[test]
fn a_closed_pipe_is_not_an_error() {
    let mut child = Command::new(cargo_bin("tongue-fit"))
        .args(["mesh", "--h", "1mm", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(0));
}

#[test]
fn the_answer_does_not_depend_on_the_number_of_threads() {
    let fit = |threads: &str| {
        let mut v = json(&["--vowel", "a", "--target", "stretch", "--threads", threads, "--json"]);
        for field in ["wall_s", "command"] {
            v.as_object_mut().unwrap().remove(field);
        }
        v
    };
    assert_eq!(fit("1"), fit("2"));
}
