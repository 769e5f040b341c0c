//! `simulate`, `track` and surgery of the built-in tongue in space.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use assert_cmd::cargo::cargo_bin;
use serde_json::Value;

fn told(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let done = Command::new(cargo_bin("tongue-fit")).args(arguments).current_dir(folder).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (done.status.code(), text(done.stdout), text(done.stderr))
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let (status, out, complaints) = told(folder, arguments);
    assert_eq!(status, Some(0), "{complaints}");
    serde_json::from_str(&out).unwrap()
}

#[test]
fn activations_come_back_from_the_places_that_they_made_and_pictures_are_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let simulate = [
        "simulate",
        "--body",
        "space",
        "--activation",
        "GGP=0.1",
        "--activation",
        "TRANS=0.05",
        "--json",
        "--out",
        "out",
    ];
    let made = json(folder.path(), &simulate);
    assert_eq!((made["status"].as_str(), made["half"].as_bool()), (Some("converged"), Some(true)));
    assert!(
        made["foremost_moved_mm"][0].as_f64().unwrap() < -0.5,
        "it protrudes: {}",
        made["foremost_moved_mm"]
    );
    let svg = std::fs::read_to_string(folder.path().join("out/tongue.svg")).unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let words: Vec<&str> =
        document.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect();
    for word in ["side", "front", "top", "GGP 0.10", "TRANS 0.05"] {
        assert!(words.contains(&word), "{word}: {words:?}");
    }

    let mut table = "node,x_mm,y_mm,z_mm\n".to_owned();
    for (node, place) in made["positions_m"].as_array().unwrap().iter().enumerate().skip(3).step_by(11) {
        let [x, y, z] = [0, 1, 2].map(|i| 1e3 * place[i].as_f64().unwrap());
        if node < 13 * 8 * 9 {
            writeln!(table, "{},{x},{y},{z}", node + 1).unwrap();
        }
    }
    std::fs::write(folder.path().join("nodes.csv"), table).unwrap();
    let found = json(folder.path(), &["--points", "nodes.csv", "--body", "space", "--starts", "1", "--json"]);
    let frame = &found["frames"][0];
    assert!(frame["rms_mm"].as_f64().unwrap() < 0.05, "{frame}");
    for (muscle, a) in frame["activations"].as_object().unwrap() {
        let truth =
            [("GGP", 0.1), ("TRANS", 0.05)].iter().find(|(m, _)| m == muscle).map_or(0.0, |(_, a)| *a);
        assert!((a.as_f64().unwrap() - truth).abs() < 0.01, "{muscle} {a}");
    }
    assert!(frame["factorisations"].as_u64().unwrap() > 0);

    // The same from the midsagittal contour and the stretches, in two tables.
    let mut table = "x_mm,z_mm,sd_mm\n".to_owned();
    for node in (0..8).flat_map(|j| [0, 12].map(|i| i + 13 * j)).chain((1..12).map(|i| i + 13 * 7)) {
        let at = &made["positions_m"][4 * 13 * 8 + node];
        writeln!(table, "{},{},0.2", 1e3 * at[0].as_f64().unwrap(), 1e3 * at[2].as_f64().unwrap()).unwrap();
    }
    std::fs::write(folder.path().join("contour.csv"), table).unwrap();
    let mut table = "muscle,stretch,sd_mm\n".to_owned();
    for (muscle, stretch) in made["stretches"].as_object().unwrap() {
        writeln!(table, "{muscle},{stretch},0.1").unwrap();
    }
    std::fs::write(folder.path().join("stretches.csv"), table).unwrap();
    let tables = ["track", "contour.csv", "stretches.csv", "--body", "space", "--starts", "1", "--json"];
    let found = json(folder.path(), &tables);
    let frame = &found["frames"][0];
    assert_eq!(frame["distances_mm"].as_array().unwrap().len(), 27 + 21);
    assert!(frame["rms_mm"].as_f64().unwrap() < 0.05, "{frame}");
    for (muscle, a) in frame["activations"].as_object().unwrap() {
        let truth =
            [("GGP", 0.1), ("TRANS", 0.05)].iter().find(|(m, _)| m == muscle).map_or(0.0, |(_, a)| *a);
        assert!((a.as_f64().unwrap() - truth).abs() < 0.02, "{muscle} {a}");
    }

    // A recording in the frame of the body: two frames of three coils, at rest and raised.
    let coils = "recording,time_s,point,x_mm,y_mm\nr,0,T1,-8,35\nr,0,T2,5,44\nr,0,T3,20,48.5\nr,0.1,T1,-9,36\nr,0.1,T2,4,46\nr,0.1,T3,19,50\n";
    std::fs::write(folder.path().join("coils.csv"), coils).unwrap();
    std::fs::write(
        folder.path().join("map.toml"),
        "back = \"x\"\nup = \"y\"\n[points]\nT1 = { surface_mm = 7.0 }\nT2 = { surface_mm = 22.0 }\nT3 = { surface_mm = 38.0 }\n",
    )
    .unwrap();
    let track =
        ["track", "coils.csv", "--map", "map.toml", "--as-is", "--body", "space", "--starts", "1", "--json"];
    let (_, out, complaints) = told(folder.path(), &track);
    let found: Value = serde_json::from_str(&out).expect(&complaints);
    let frames = found["frames"].as_array().unwrap();
    assert_eq!((frames.len(), &frames[1]["recording"], &frames[1]["time_s"]), (2, &"r".into(), &0.1.into()));
    for frame in frames {
        assert!(frame["rms_mm"].as_f64().unwrap() < 1.5, "{frame}");
        assert!(!frame["open"].as_array().unwrap().is_empty(), "three coils leave much open");
    }
    assert!(found["notes"][0].as_str().unwrap().contains("no intervals over time"), "{found}");
}

#[test]
fn a_vowel_is_fitted_in_space_from_its_lengths() {
    let folder = tempfile::tempdir().unwrap();
    let vowel = ["--vowel", "a", "--body", "space", "--json", "--out", "a"];
    // At rest the stretches are missed by 5 mm. Activations of one strength meet them only in part.
    for (target, lengths, limit) in [("stretch", 8, 3.2), ("ratio", 7, 1.0)] {
        let (_, out, complaints) = told(folder.path(), &[&vowel[..], &["--target", target]].concat());
        let found: Value = serde_json::from_str(&out).expect(&complaints);
        let frame = &found["frames"][0];
        assert_eq!(frame["distances_mm"].as_array().unwrap().len(), lengths);
        assert_eq!(frame["activations"].as_object().unwrap().len(), 11);
        assert!(!frame["open"].as_array().unwrap().is_empty(), "eight lengths leave some of eleven open");
        assert!(found["notes"][0].as_str().unwrap().contains("S2 /a/ against /ɯ/"), "{found}");
        let rms = frame["rms_mm"].as_f64().unwrap();
        assert!(rms < limit, "{target}: {rms}");
    }
    let (status, _, said) = told(folder.path(), &[&vowel[..], &["--method", "gauss-newton"]].concat());
    assert!(status == Some(1) && said.contains("--method is for bodies in the plane"), "{said}");
}

#[test]
fn surgery_of_one_side_deviates_and_what_is_left_must_be_said() {
    let folder = tempfile::tempdir().unwrap();
    let activations =
        ["simulate", "--body", "space", "--activation", "GGP=0.15", "--activation", "TRANS=0.1", "--json"];
    let with = |more: &[&'static str]| [&activations[..], more].concat();
    let region: [&'static str; 2] = ["--operate", "left:box:-20,20,-40,40,15,60"];
    let mut deviations = Vec::new();
    for filling in ["flap", "scar"] {
        let made = json(folder.path(), &with(&[&region[..], &["--filling", filling]].concat()));
        let operation = &made["operation"];
        assert!(operation["elements"].as_u64().unwrap() > 20, "{operation}");
        assert!(operation["tip_before_mm"][1].as_f64().unwrap().abs() < 1e-6);
        deviations.push(operation["deviation_mm"].as_f64().unwrap());
    }
    assert!(deviations.iter().all(|d| d.abs() > 0.2), "{deviations:?}");
    let (status, _, complaint) = told(folder.path(), &with(&region));
    assert_eq!(status, Some(2));
    assert!(complaint.contains("--filling"), "{complaint}");
}

#[test]
fn what_cannot_be_used_is_refused_in_one_message() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("far.csv"), "node,x_mm,y_mm,z_mm\n5000,1,2,3\n").unwrap();
    std::fs::write(folder.path().join("short.csv"), "node,x_mm,y_mm\n5,1,2\n").unwrap();
    std::fs::write(folder.path().join("words.csv"), "node,x_mm,y_mm,z_mm\n5,1,two,3\n").unwrap();
    std::fs::write(folder.path().join("late.csv"), "node,x_mm,y_mm,z_mm,time_s\n5,1,2,3,1\n5,1,2,3,0\n")
        .unwrap();
    std::fs::write(folder.path().join("timed.csv"), "x_mm,z_mm,time_s\n1,2,0\n").unwrap();
    std::fs::write(folder.path().join("doubled.csv"), "muscle,length_mm,stretch\nGGP,40,1\n").unwrap();
    std::fs::write(folder.path().join("flat.csv"), "muscle,stretch\nGGP,0\n").unwrap();
    let simulate = ["simulate", "--body", "space"];
    let track = ["track", "--body", "space"];
    let operate = |region| [&simulate[..], &["--operate", region, "--filling", "removed"]].concat();
    let cases = [
        ([&simulate[..], &["--activation", "GGX=0.1"]].concat(), "no muscle \"GGX\""),
        ([&simulate[..], &["--activation", "GGP=2"]].concat(), "between 0 and 1"),
        ([&simulate[..], &["--muscles-as", "lines"]].concat(), "does not have"),
        ([&simulate[..], &["--tension", "GGP=2"]].concat(), "give activations"),
        (operate("box:1,2,3"), "six numbers"),
        (operate("ball:500,0,0,1"), "no element"),
        (operate("ball:0,0,0,12"), "may not remove a bone"),
        ([&track[..], &["far.csv"]].concat(), "node 5000 was seen"),
        ([&track[..], &["short.csv"]].concat(), "no column z_mm"),
        ([&track[..], &["words.csv"]].concat(), "line 2: y_mm is \"two\""),
        ([&track[..], &["late.csv"]].concat(), "sort them by time_s"),
        ([&track[..], &["none.csv"]].concat(), "none.csv"),
        (track.to_vec(), "name at least one recording"),
        ([&track[..], &["far.csv", "timed.csv"]].concat(), "in all tables of a recording or in none"),
        ([&track[..], &["doubled.csv"]].concat(), "length_mm and stretch"),
        ([&track[..], &["flat.csv"]].concat(), "line 2: stretch must be positive"),
        (vec!["mesh", "--body", "space"], "is a body in space"),
        (vec!["muscles", "--refined"], "--refined needs a body in space"),
        (vec!["simulate", "--activation", "GGP=0.1"], "--body space"),
        ([&simulate[..], &["--preset", "consistent"]].concat(), "--preset is for bodies in the plane"),
        ([&track[..], &["far.csv", "--draws", "1000"]].concat(), "--draws is for bodies in the plane"),
        (vec!["sound", "--body", "space", "--subject", "S2"], "--subject is for bodies in the plane"),
        (vec!["track", "far.csv", "--sd", "0.5"], "--sd needs a body in space"),
    ];
    for (arguments, why) in cases {
        let (status, out, complaint) = told(folder.path(), &arguments);
        assert_eq!(status, Some(1), "{arguments:?}: {complaint}");
        let plain = complaint.split_whitespace().filter(|w| *w != "│").collect::<Vec<_>>().join(" ");
        assert!(plain.contains(why) && out.is_empty(), "{arguments:?}: {plain}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 7, "nothing else was written");
}

#[test]
fn a_body_of_hexahedra_from_gmsh_contracts() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/gmsh/hexahedra_41.msh");
    let found = json(folder.path(), &["simulate", "--body", mesh, "--activation", "A=0.3", "--json"]);
    assert_eq!(
        (&found["status"], &found["hexahedra"], &found["half"]),
        (&"converged".into(), &48.into(), &true.into())
    );
    assert!(found["stretches"]["A_L"].as_f64().unwrap() < 0.97, "{}", found["stretches"]);
    let (status, _, told) = told(folder.path(), &["simulate", "--body", "none.msh"]);
    assert!(status == Some(1) && told.contains("cannot read the mesh"), "{told}");
}

#[test]
fn the_tongue_in_space_sounds_and_its_scenes_run() {
    let folder = tempfile::tempdir().unwrap();
    let heard = |more: &[&str]| {
        let arguments = [&["sound", "--body", "space", "--json", "--out", "s"], more].concat();
        let found = json(folder.path(), &arguments);
        [0, 1].map(|i| found["formants_hz"][i].as_f64().unwrap())
    };
    let (rest, raised) = (heard(&[]), heard(&["--activation", "GGP=0.05"]));
    // The tongue comes to the front: the pharynx widens and the front cavity narrows.
    assert!(raised[0] < rest[0] && raised[1] > rest[1], "{rest:?} {raised:?}");
    let (status, _, refused) = told(folder.path(), &["sound", "--body", "space", "--jaw", "3"]);
    assert!(status == Some(1) && refused.contains("--jaw is for bodies in the plane"), "{refused}");
    let scene = "title = \"t\"\nwant = \"shape\"\n[body.tongue-in-space]\n[activations]\nGGP = 0.1\n[effects]\ngravity = { posture = \"supine\" }\n";
    std::fs::write(folder.path().join("s.toml"), scene).unwrap();
    let (status, printed, errors) = told(folder.path(), &["scene", "run", "s.toml", "--out", "s"]);
    assert_eq!(status, Some(0), "{errors}");
    assert!(printed.contains("| activation |") && printed.contains("672 hexahedra"), "{printed}");
    let vtu = std::fs::read_to_string(folder.path().join("s/s.vtu")).unwrap();
    assert!(vtu.contains("activation"), "{}", &vtu[..400]);
}

#[test]
fn each_muscle_of_the_tongue_in_space_is_shown_alone() {
    let folder = tempfile::tempdir().unwrap();
    let found =
        json(folder.path(), &["muscles", "--body", "space", "--activation", "0.05", "--json", "--out", "m"]);
    let rows = found["muscles"].as_array().unwrap();
    let of = |name: &str, key: &str| {
        let row = rows.iter().find(|r| r["pulling"] == name).unwrap();
        row[key].as_f64().unwrap()
    };
    assert_eq!(rows.len(), 11);
    // Transversus narrows the tongue and raises it; the posterior genioglossus brings its root forward.
    assert!(of("TRANS", "wider_mm") < -0.5 && of("TRANS", "top_up_mm") > 0.5, "{found}");
    assert!(of("GGP", "root_forward_mm") > 1.0 && of("GGP", "stretch") < 0.97, "{found}");
    assert!(std::fs::read_to_string(folder.path().join("m/muscles.svg")).unwrap().contains("TRANS"));
    let (status, _, told) = told(folder.path(), &["muscles", "--body", "space", "--activation", "2"]);
    assert!(status == Some(1) && told.contains("it must lie between 0 and 1"), "{told}");
}
