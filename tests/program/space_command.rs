//! `simulate`, `track` and surgery of the built-in tongue in space.

use std::fmt::Write as _;

use super::run::{json, run};

/// `marks_in_space` in tests/library shows how well activations are recovered from contours, lengths and coils.
#[test]
fn activations_come_back_from_the_places_that_they_made_and_pictures_are_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let simulate = "simulate --body space --activation GGP=0.1 --activation TRANS=0.05 --json --out out";
    let made = json(folder.path(), simulate);
    assert_eq!((made["status"].as_str(), made["half"].as_bool()), (Some("converged"), Some(true)));
    let protrudes = &made["foremost_moved_mm"][0];
    assert!(protrudes.as_f64().unwrap() < -0.5, "{protrudes}");
    let svg = std::fs::read_to_string(folder.path().join("out/tongue.svg")).unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let words: Vec<&str> =
        document.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect();
    for word in ["left side", "front", "top", "left", "right", "GGP 0.10", "TRANS 0.05"] {
        assert!(words.contains(&word), "{word}: {words:?}");
    }
    let mut nodes = "node,x_mm,y_mm,z_mm\n".to_owned();
    for (node, place) in
        made["positions_m"].as_array().unwrap()[..13 * 8 * 9].iter().enumerate().skip(3).step_by(11)
    {
        let [x, y, z] = [0, 1, 2].map(|i| 1e3 * place[i].as_f64().unwrap());
        writeln!(nodes, "{},{x},{y},{z}", node + 1).unwrap();
    }
    write("nodes.csv", &nodes);
    let mut stretches = "muscle,stretch,sd_mm\n".to_owned();
    for (muscle, stretch) in made["stretches"].as_object().unwrap() {
        writeln!(stretches, "{muscle},{stretch},0.1").unwrap();
    }
    write("stretches.csv", &stretches);
    for (line, marks) in [("--points nodes.csv", 85), ("track nodes.csv stretches.csv", 85 + 21)] {
        let frame = &json(folder.path(), &format!("{line} --body space --starts 1 --json"))["frames"][0];
        assert!(frame["rms_mm"].as_f64().unwrap() < 0.05, "{frame}");
        assert_eq!(frame["distances_mm"].as_array().unwrap().len(), marks);
        for (muscle, a) in frame["activations"].as_object().unwrap() {
            let truth =
                [("GGP", 0.1), ("TRANS", 0.05)].iter().find(|(m, _)| m == muscle).map_or(0.0, |(_, a)| *a);
            assert!((a.as_f64().unwrap() - truth).abs() < 0.01, "{muscle} {a}");
        }
    }
    // A contour in metres says nothing about any muscle.
    write("metres.csv", "x_mm,z_mm\n0.01,0.03\n0.02,0.02\n");
    let done = run(folder.path(), "track metres.csv --body space --starts 1");
    assert!(done.status == Some(3) && done.out.contains("alarm   nothing is resolved"), "{}", done.out);
    write("metres.csv", "muscle,length_mm\nGGP,0.05\nTRANS,0.03\n");
    let done = run(folder.path(), "track metres.csv --body space --starts 1");
    assert!(done.status == Some(3) && done.out.contains("alarm   what was measured lies"), "{}", done.out);
    // A recording in the frame of the body has two frames of three coils, at rest and raised.
    let coils = "recording,time_s,point,x_mm,y_mm\nr,0,T1,-8,35\nr,0,T2,5,44\nr,0,T3,20,48.5\nr,0.1,T1,-9,36\nr,0.1,T2,4,46\nr,0.1,T3,19,50\n";
    write("coils.csv", coils);
    let places = "T1 = { surface_mm = 7.0 }\nT2 = { surface_mm = 22.0 }\nT3 = { surface_mm = 38.0 }\n";
    write("map.toml", &format!("back = \"x\"\nup = \"y\"\n[points]\n{places}"));
    let found =
        run(folder.path(), "track coils.csv --map map.toml --as-is --body space --starts 1 --json").record();
    let frames = found["frames"].as_array().unwrap();
    assert_eq!((frames.len(), &frames[1]["recording"], &frames[1]["time_s"]), (2, &"r".into(), &0.1.into()));
    for frame in frames {
        let open = frame["open"].as_array().unwrap();
        assert!(frame["rms_mm"].as_f64().unwrap() < 1.5 && !open.is_empty(), "{frame}");
    }
    assert!(found["notes"][0].as_str().unwrap().contains("no intervals over time"), "{found}");
}

/// `marks_in_space` in tests/library shows how well lengths as they were measured are met, which takes longer.
#[test]
fn a_vowel_is_fitted_in_space_from_its_lengths() {
    let folder = tempfile::tempdir().unwrap();
    let header = "subject,vowel,GGa_mm,GGm_mm,GGp_mm,SGp_mm,SGm_mm,SGa_mm,HGa_mm,HGp_mm";
    let rows = "X,ɯ,46,60,45,59,32,42,42,31\nX,a,45,60,46,59,31,42,41,31\n";
    std::fs::write(folder.path().join("near.csv"), format!("{header}\n{rows}")).unwrap();
    let vowel = "--vowel a --subject X --lengths near.csv --body space --target stretch --json --out a";
    let found = run(folder.path(), vowel).record();
    let frame = &found["frames"][0];
    assert_eq!(frame["distances_mm"].as_array().unwrap().len(), 8);
    assert!(!frame["open"].as_array().unwrap().is_empty(), "eight lengths leave some of eleven open");
    assert!(found["notes"][0].as_str().unwrap().contains("X /a/ against /ɯ/"), "{found}");
    assert!(frame["rms_mm"].as_f64().unwrap() < 0.5, "{frame}");
}

#[test]
fn frames_of_a_one_sided_posture_have_a_file_each_and_want_their_sides_apart() {
    let folder = tempfile::tempdir().unwrap();
    let made = json(folder.path(), "simulate --body space --activation GGP_L=0.2 --json --out made");
    let mut table = "time_s,node,x_mm,y_mm,z_mm\n".to_owned();
    let nodes = &made["positions_m"].as_array().unwrap()[..13 * 8 * 9];
    for (time, node) in (0..2).flat_map(|time| (3..nodes.len()).step_by(41).map(move |node| (time, node))) {
        let [x, y, z] = [0, 1, 2].map(|i| 1e3 * nodes[node][i].as_f64().unwrap());
        writeln!(table, "0.{time},{},{x},{y},{z}", node + 1).unwrap();
    }
    std::fs::write(folder.path().join("nodes.csv"), table).unwrap();
    let alike = run(folder.path(), "track nodes.csv --body space --starts 1 --out alike");
    assert_eq!(alike.status, Some(3), "{}", alike.err);
    assert!(alike.out.contains("target not met") && alike.err.contains("--sides-apart"), "{}", alike.err);
    let apart = run(folder.path(), "track nodes.csv --body space --starts 1 --sides-apart --out apart");
    assert_eq!(apart.status, Some(0), "{}", apart.err);
    let frames = std::fs::read_to_string(folder.path().join("apart/tongue.pvd")).unwrap();
    for (time, file) in [("0", "tongue_0000.vtu"), ("0.1", "tongue_0001.vtu")] {
        assert!(frames.contains(&format!("timestep=\"{time}\" part=\"0\" file=\"{file}\"")), "{frames}");
        assert!(folder.path().join("apart").join(file).is_file());
    }
}

#[test]
fn surgery_of_one_side_deviates() {
    let folder = tempfile::tempdir().unwrap();
    let line = "simulate --body space --activation GGP=0.15 --activation TRANS=0.1 --json \
                --operate left:box:-20,20,-40,40,15,60";
    // `scenes_in_space` in tests/library shows the same for a flap.
    let operation = &json(folder.path(), &format!("{line} --filling scar --out cut"))["operation"];
    assert!(operation["elements"].as_u64().unwrap() > 20, "{operation}");
    assert!(operation["tip_before_mm"][1].as_f64().unwrap().abs() < 1e-6);
    let [back, right] = ["reach_lost_mm", "deviation_mm"].map(|key| operation[key].as_f64().unwrap());
    assert!(right.abs() > 0.2, "{operation}");
    // The picture shows the displacement of the tip at one scale from the left and from the front, where the speaker's right is on the
    // left.
    let picture = std::fs::read_to_string(folder.path().join("cut/tongue.svg")).unwrap();
    let across = |circle: &str| circle.split('"').next().unwrap().parse::<f64>().unwrap();
    let x: Vec<f64> = picture.split("<circle cx=\"").skip(1).map(across).collect();
    assert!(((x[3] - x[2]) / (x[1] - x[0]) + right / back).abs() < 0.03, "{x:?} {operation}");
    assert!(["tip before", "tip after", "operated"].iter().all(|name| picture.contains(name)));
}

#[test]
fn a_tip_that_is_removed_has_no_displacement() {
    let folder = tempfile::tempdir().unwrap();
    let done = run(
        folder.path(),
        "simulate --body space --activation GGP=0.1 --operate ball:-11,0,30,15 --filling removed --make-up --out cut",
    );
    assert!(
        done.out.contains("): removed; all nodes") && done.out.contains("before and is removed"),
        "{}",
        done.out
    );
    assert!(done.err.contains("the tip itself is removed"), "{}", done.err);
    let text = std::fs::read_to_string(folder.path().join("cut/simulation.json")).unwrap();
    let found: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(found["foremost_moved_mm"].is_null() && found["operation"]["reach_lost_mm"].is_null(), "{found}");
    assert!(found["operation"]["made_up_by"].is_null());
}

#[test]
fn the_tongue_in_space_sounds_as_told() {
    let folder = tempfile::tempdir().unwrap();
    let heard = |options: &str| {
        let found = json(folder.path(), &format!("sound {options} --json --out s"));
        [0, 1, 2].map(|i| found["formants_hz"][i].as_f64().unwrap())
    };
    let page = include_str!("../../docs/sound.md").split_whitespace().collect::<Vec<_>>().join(" ");
    let is_told = |[f1, f2, f3]: [f64; 3], words: &str| {
        let told = words.replace("FORMANTS", &format!("{f1:.0}, {f2:.0} and {f3:.0} Hz"));
        assert!(page.contains(&told), "{told}");
    };
    let (rest, raised) = (heard("--body space"), heard("--body space --activation GGP=0.05"));
    is_told(rest, "At rest F1 to F3 are FORMANTS");
    is_told(heard("--tension GGp=0"), "in the plane FORMANTS");
    is_told(heard("--body space --activation TRANS=0.1"), "raises the tongue: FORMANTS");
    is_told(heard("--body space --activation HG=0.05"), "hyoglossus at 0.05 gives FORMANTS");
    // The tongue moves to the front: the pharynx widens and the front cavity narrows.
    assert!(raised[0] < rest[0] && raised[1] > rest[1], "{rest:?} {raised:?}");
}

#[test]
fn each_muscle_of_the_tongue_in_space_is_shown_alone() {
    let folder = tempfile::tempdir().unwrap();
    let found = json(folder.path(), "muscles --body space --activation 0.05 --json --out m");
    let rows = found["muscles"].as_array().unwrap();
    let of = |name: &str, key: &str| {
        let row = rows.iter().find(|r| r["pulling"] == name).unwrap();
        row[key].as_f64().unwrap()
    };
    assert_eq!(rows.len(), 11);
    // Transversus narrows the tongue and raises it; the posterior genioglossus moves its root forward.
    assert!(of("TRANS", "wider_mm") < -0.5 && of("TRANS", "top_up_mm") > 0.5, "{found}");
    assert!(of("GGP", "root_forward_mm") > 1.0 && of("GGP", "stretch") < 0.97, "{found}");
    assert!(std::fs::read_to_string(folder.path().join("m/muscles.svg")).unwrap().contains("TRANS"));
}
