//! Contracts of the command with its users: exit statuses, messages and files.

use serde_json::Value;

use super::run::{self, refused, run};

const MUSCLES: [&str; 8] = ["GGa", "GGm", "GGp", "SGp", "SGm", "SGa", "HGa", "HGp"];
const PUBLISHED: &str = "--tension GGa=12 --tension SGm=11.5 --tension HGa=4.5";

fn json(line: &str) -> Value {
    run::json(tempfile::tempdir().unwrap().path(), line)
}

/// If the barrier acts or the branch from rest was left, table, JSON and exit status of every command say so.
#[test]
fn doubtful_equilibria_are_reported_everywhere() {
    let barrier = "the barrier against inversion acts in";
    let branch = "the branch of equilibria from rest ends at";
    let folder = tempfile::tempdir().unwrap();
    let scene = "title = \"x\"\nwant = \"shape\"\n[body.tongue]\n[tensions_n]\nHGp = 441.12\n";
    std::fs::write(folder.path().join("s.toml"), scene).unwrap();
    let scene = "title = \"t\"\nwant = \"shape\"\n[body.tongue-in-space]\n[activations]\nGGP = 1.0\n";
    std::fs::write(folder.path().join("strong.toml"), scene).unwrap();
    let strained = "volume at rest";
    let far = MUSCLES[..5].iter().map(|m| format!(" --tension {m}=100")).collect::<String>();
    let far = format!("simulate{far}");
    let cases: [(&str, &str, &str, &[&str]); 8] = [
        (far.as_str(), "simulation", "not_on_branch", &[branch]),
        ("simulate --tension HGp=441.12", "simulation", "barrier_acts", &[barrier]),
        ("simulate --tension HGp=441.12 --direct", "simulation", "barrier_acts", &[barrier]),
        ("simulate --tension GGa=1e4", "simulation", "barrier_acts", &[barrier, branch]),
        ("simulate --body space --activation GGP=1 --direct", "simulation", "overstrained", &[strained]),
        ("muscles --tension 1e6", "", "", &[barrier]),
        ("scene run s.toml", "", "", &[barrier]),
        ("scene run strong.toml", "strong", "overstrained", &[strained]),
    ];
    for (number, (command, file, kind, parts)) in cases.into_iter().enumerate() {
        let done = run(folder.path(), &format!("{command} --out {number}"));
        assert_eq!(done.status, Some(3), "{command}");
        assert!(parts.iter().all(|part| done.out.contains(part)), "{command}: {}", done.out);
        assert!(!done.err.is_empty(), "{command}");
        if !kind.is_empty() {
            let record = run::record(folder.path(), &format!("{number}/{file}.json"));
            let alarms = record["alarms"].as_array().unwrap();
            assert!(alarms.len() >= parts.len() && alarms.iter().any(|a| a["kind"] == kind), "{alarms:?}");
        }
    }
    // The branch's end is a part of the record.
    let found = run::record(folder.path(), "0/simulation.json");
    let end = found["branch"]["critical"]["load"].as_f64().unwrap();
    assert!((0.5..1.0).contains(&end) && found["status"] == "converged", "{}", found["branch"]);
    assert_ne!(found["connection"], "traced");
}

/// The first screen has the verdict, what the fit misses and whether it is one of many, and the files. The fit of /i/ misses its ratios,
/// but its verdict can be trusted; the text, the exit status and JSON agree on both.
#[test]
fn fitting_a_vowel_prints_fourteen_lines_of_100_columns_and_writes_four_files() {
    let folder = tempfile::tempdir().unwrap();
    let screens = [
        ("o", true, "one of many that meet the fitted ratios", "to 100.0"),
        ("i", false, "it misses the fitted ratios", "30 (11)"),
        ("a", true, "one of many that meet the fitted ratios", "11.50"),
    ];
    let mut text = String::new();
    for (vowel, tensions_trusted, fit, cell) in screens {
        let done = run(folder.path(), &format!("--vowel {vowel}"));
        text = done.out;
        let widest = text.lines().map(|line| line.chars().count()).max();
        assert!(text.lines().count() <= 14 && widest <= Some(100), "{text}");
        for wanted in [
            "Harder than in /ɯ/",
            "Not known: ",
            "How hard: ",
            "The thesis's fit: ",
            fit,
            cell,
            "; other ratios are off by ",
        ] {
            assert!(text.contains(wanted), "{wanted} is missing in\n{text}");
        }
        let record = std::fs::read(folder.path().join("results/fit.json")).unwrap();
        let conclusion = &serde_json::from_slice::<Value>(&record).unwrap()["conclusion"];
        assert_eq!((done.status, &conclusion["decided_by"]), (Some(0), &"verdict".into()), "{conclusion}");
        assert_eq!(conclusion["trusted"], true);
        assert_eq!(conclusion["tensions_trusted"], tensions_trusted);
        let last = text.lines().nth_back(1).unwrap();
        assert!(last.starts_with(conclusion["text"].as_str().unwrap()), "{text}");
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
    let fit = run::json(folder.path(), "--vowel a --h 10 --json --out deep/er");
    let fields =
        ["subject", "vowel", "baseline", "target_kind", "status", "verdict_from"].map(|field| &fit[field]);
    assert_eq!(fields, ["S2", "a", "ɯ", "ratio", "converged", "short_run"]);
    assert_eq!(fit["active"], serde_json::json!(["GGa", "SGm", "HGa"]));
    for (said, m) in fit["verdict"].as_array().unwrap().iter().zip(MUSCLES) {
        let is_probability = (0.0..=1.0).contains(&said["p_rises"].as_f64().unwrap());
        assert!(said["muscle"] == m && is_probability && said["word"].is_string(), "{said}");
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

/// An independent check of the outputs: forces that are computed here from the mesh's JSON balance at the simulation's positions.
#[test]
fn the_published_mesh_and_positions_balance_in_an_independent_recalculation() {
    let s = json(&format!("simulate {PUBLISHED} --json"));
    let mesh = json("mesh --json");
    assert!(s["max_residual_force_n"].as_f64().unwrap() < 1e-9);
    let pair = |v: &Value| [v[0].as_f64().unwrap(), v[1].as_f64().unwrap()];
    let x: Vec<[f64; 2]> = s["positions_m"].as_array().unwrap().iter().map(pair).collect();
    let x0: Vec<[f64; 2]> = mesh["nodes_m"].as_array().unwrap().iter().map(pair).collect();
    let number = |v: &Value| v.as_u64().unwrap() as usize;
    let mut f = vec![[0.0; 2]; x.len()];
    let length = |a: usize, b: usize| f64::hypot(x[b][0] - x[a][0], x[b][1] - x[a][1]);
    let mut pull = |a: usize, b: usize, tension: f64| {
        for axis in 0..2 {
            let part = tension * (x[b][axis] - x[a][axis]) / length(a, b);
            f[a][axis] += part;
            f[b][axis] -= part;
        }
    };
    for c in mesh["connections"].as_array().unwrap() {
        let [a, b] = [0, 1].map(|end| number(&c["nodes"][end]));
        let [k, rest] = ["stiffness_n_per_m", "rest_length_m"].map(|key| c[key].as_f64().unwrap());
        pull(a, b, k * (length(a, b) - rest));
    }
    for (m, tension) in [("GGa", 12.0), ("SGm", 11.5), ("HGa", 4.5)] {
        let chain: Vec<usize> = mesh["muscles"][m].as_array().unwrap().iter().map(number).collect();
        chain.windows(2).for_each(|step| pull(step[0], step[1], tension));
    }
    let kappa = mesh["kappa_s_j"].as_f64().unwrap();
    assert!((kappa - 1.52).abs() < 5e-3, "docs/model.md: {kappa} J");
    let area = |p: &[[f64; 2]], t: [usize; 3]| {
        let [a, b, c] = t.map(|n| p[n]);
        0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
    };
    for t in mesh["triangles"].as_array().unwrap() {
        let t = [0, 1, 2].map(|corner| number(&t[corner]));
        let pressure = -kappa * (area(&x, t) - area(&x0, t)) / area(&x0, t).powi(2);
        for i in 0..3 {
            let (b, c) = (x[t[(i + 1) % 3]], x[t[(i + 2) % 3]]);
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
fn a_simulation_says_whether_it_is_on_the_branch_from_rest() {
    let s = json("simulate --tension GGa=12 --tension SGm=11.5 --json");
    assert_eq!((&s["connection"], &s["branch"]["critical"]), (&Value::from("traced"), &Value::Null));
    let plain = json("simulate --tension GGa=12 --tension SGm=11.5 --direct --json");
    assert_eq!((&plain["connection"], &plain["branch"]), (&Value::from("direct"), &Value::Null));
    assert_eq!((&s["positions_m"], &s["iterations"]), (&plain["positions_m"], &plain["iterations"]));
}

#[test]
fn the_published_answer_is_shown_only_for_its_own_row() {
    let folder = tempfile::tempdir().unwrap();
    let own = concat!("--lengths '", env!("CARGO_MANIFEST_DIR"), "/targets/takano2007_lengths.csv'");
    for (option, is_shown) in
        [("", true), ("--muscles GGa,SGm", false), ("--subject S1", false), (own, false)]
    {
        let done = run(folder.path(), &format!("--vowel a -v {option}"));
        assert_eq!(done.out.contains("table 4.8"), is_shown, "{option}");
        // docs/model.md states this number.
        let missed = "the published tensions miss the target by 0.007 here (RMS)";
        assert_eq!(done.out.contains(missed), is_shown, "{option}: {}", done.out);
    }
}

#[test]
fn an_unwritable_folder_is_refused_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "in the way").unwrap();
    let message = refused(folder.path(), "--vowel a --out file/sub");
    assert!(message.contains("cannot write into the output folder"), "{message}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "in the way");
}
