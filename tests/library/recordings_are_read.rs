//! Recordings of every format are read, and their faults are reported with their place.

use tongue_fit::geometry::Point;
use tongue_fit::measured::recording::{AlignedRecording, FaultKind, Map, Recording, remove_outliers};
use tongue_input::measured::recording::text_grid;

use crate::other_tables_are_read::TEXT_GRID;

pub const AAA: &str = "Client family name\tDate Time of recording\tTime of sample in recording\tPrompt\tX0 DLC_Tongue\tY0 DLC_Tongue\t\
    X1 DLC_Tongue\tY1 DLC_Tongue\tX0 DLC_HyoidMandible\tY0 DLC_HyoidMandible\tX1 DLC_HyoidMandible\tY1 DLC_HyoidMandible\t\
    X0 DLC_ShorttendonMandible\tY0 DLC_ShorttendonMandible\tX1 DLC_ShorttendonMandible\tY1 DLC_ShorttendonMandible\n";

pub fn read(bytes: &[u8], origin: &str) -> Vec<Recording> {
    Recording::from_bytes(bytes, origin, None).unwrap()
}

pub fn refused(bytes: &[u8], origin: &str) -> String {
    Recording::from_bytes(bytes, origin, None).unwrap_err().to_string()
}

pub fn aligned(recording: &Recording, map: &str) -> Result<AlignedRecording, String> {
    AlignedRecording::new(recording, &Map::from_toml(map, "m.toml").unwrap()).map_err(|e| e.to_string())
}

pub fn aligned_recording(recording: &Recording, map: &str) -> AlignedRecording {
    aligned(recording, map).unwrap()
}

/// Whether a point is at this position, m.
pub fn near(a: Option<Point>, b: [f64; 2]) -> bool {
    a.is_some_and(|a| (a - Point::from(b)).norm() < 1e-9)
}

#[test]
fn aaa_tables_part_into_recordings_and_need_no_map() {
    let rows = "s\td1\t0.01\tpa\t10\t20\t30\t40\t5\t1\t60\t2\t55\t3\t60\t2\n\
                s\td1\t0.02\tpa\t*\t*\t31\t41\t\t\t60\t2\t55\t3\t60\t2\n\
                s\td2\t0.01\tta\t12\t22\t32\t42\t5\t1\t60\t2\t55\t3\t60\t2\n";
    let found = read(format!("{AAA}{rows}").as_bytes(), "a.tsv");
    assert_eq!(found.iter().map(|r| r.samples.len()).collect::<Vec<_>>(), [2, 1]);
    assert_eq!(found[0].name, "s, d1, pa");
    assert_eq!(found[0].channels, ["tongue_0", "tongue_1", "hyoid", "mandible", "mental_spine"]);
    let recording = aligned_recording(&found[0], "");
    // The spine has a larger x than the hyoid, so the face looks to the right and x is reversed.
    assert!(recording.mirrored);
    let first = &recording.frames[0];
    assert!(near(first.contour[0].map(|m| m.at), [-0.010, 0.020]));
    assert!((first.contour[0].unwrap().sd - 0.93e-3).abs() < 1e-12);
    assert!(near(first.bones[recording.bone("mental_spine").unwrap()], [-0.055, 0.003]));
    assert_eq!(recording.frames[1].contour[0], None);
    assert_eq!(recording.frames[1].bones[recording.bone("hyoid").unwrap()], None);
    assert_eq!((recording.ignored, recording.notes), (vec!["mandible".to_owned()], Vec::new()));
    // Spreadsheets save the table with other separators, perhaps with decimal commas and a title above the header.
    let table = format!("{AAA}{rows}").replace("pa\t", "ɯ pa\t");
    let plain = read(table.as_bytes(), "a.tsv");
    for text in [
        table.replace('\t', ";"),
        table.replace('\t', ","),
        format!("a title; of two fields\n\n{table}"),
        format!("a title\n{}", table.replace('\t', ";").replace("0.01", "0,01").replace("0.02", "0,02")),
        format!("\u{feff}{}", table.replace('\t', ";")),
    ] {
        assert_eq!(read(text.as_bytes(), "a.csv"), plain.clone(), "{text}");
    }
    let commas = format!("{AAA}{rows}").replace('\t', ",").replace("10,20", "10,5,20,5");
    let message = refused(commas.as_bytes(), "a.csv");
    assert!(message.starts_with("a.csv:2:17: ") && message.contains("separated by tabs"), "{message}");
    let cut = format!("t\n{AAA}{}", rows.replace("60\t2\n", "60\t2.25\n")).replace('\t', ";");
    let message = refused(&cut.as_bytes()[..cut.len() - 2], "a.csv");
    assert!(message.starts_with("a.csv:5:16: ") && message.contains("cut off"), "{message}");
}

#[test]
fn tidy_tables_hold_any_points_in_any_order() {
    let text = "point,time_s,recording,y_mm,x_mm,sigma_mm\n\
                tongue_1,0,a,2,1,0.5\ntongue_0,0,a,4,3,\nhyoid,0,a,0,30,\ntongue_0,0.5,a,5,3.5,\ntongue_0,0,b,1,1,\n";
    let all = read(text.as_bytes(), "t.csv");
    assert_eq!((all.len(), all[0].samples.len()), (2, 2));
    let found = aligned_recording(&all[0], "");
    assert_eq!(found.contour, ["tongue_0", "tongue_1"]);
    assert!(near(found.frames[1].contour[0].map(|m| m.at), [0.0035, 0.005]));
    assert_eq!(found.frames[1].contour[1], None);
    assert!((found.frames[0].contour[1].unwrap().sd - 0.5e-3).abs() < 1e-12);
    // Names are known in any case and with spaces; unknown ones are reported.
    let named = "a title\ntime_s;point;x_mm;y_mm\n0;Tongue 1;1,5;2\n0;TONGUE_0;3;4\n0;Hyoid;30;0\n0;Mental Spine;1;0\n0;tonuge_2;2;2\n0;UI;0;9\n";
    let found = aligned_recording(&read(named.as_bytes(), "t.csv")[0], "");
    assert_eq!(found.contour, ["TONGUE_0", "Tongue 1"]);
    assert!(near(found.frames[0].contour[1].map(|m| m.at), [0.0015, 0.002]));
    assert_eq!(found.bones, ["hyoid", "mental_spine"]);
    let message = "nothing is known of the channels tonuge_2, so they are not used";
    assert!(found.notes.len() == 1 && found.notes[0].starts_with(message), "{:?}", found.notes);
    // A map can also leave bones out by their own names when their channels have other names.
    let map = "[points]\ntonuge_2 = \"ignore\"\nhyoid = \"ignore\"\nmental_spine = \"ignore\"";
    let found = aligned_recording(&read(named.as_bytes(), "t.csv")[0], map);
    let notes = found.notes.concat();
    assert!(found.bones.is_empty() && !notes.contains("nothing is known"), "{notes}");
}

#[test]
fn a_head_that_moves_is_brought_back_to_its_references() {
    // There are two reference points. From the first to the second frame everything is rotated by a right angle and shifted.
    let mut text = "time_s,point,x_mm,y_mm\n".to_owned();
    for (t, turn) in [(0, false), (1, true)] {
        for (name, x, y) in [("r1", 0.0, 50.0), ("r2", 40.0, 60.0), ("T", 20.0, 10.0)] {
            let (x, y) = if turn { (5.0 - y, 7.0 + x) } else { (x, y) };
            text += &format!("{t},{name},{x},{y}\n");
        }
    }
    let map = "back = \"x\"\n[points]\nr1 = \"reference\"\nr2 = \"reference\"\nT = \"contour\"";
    let recording = aligned_recording(&read(text.as_bytes(), "t.csv")[0], map);
    assert!(near(recording.frames[1].contour[0].map(|m| m.at), [0.020, 0.010]));
}

/// Seven points along a line in eight frames, of which `change` changes those in `frames`.
fn changed_in(frames: &[i32], change: impl Fn(&mut [[f64; 2]; 7])) -> AlignedRecording {
    let mut text = "time_s,point,x_mm,y_mm\n".to_owned();
    for frame in 0..8 {
        let mut places: [[f64; 2]; 7] =
            std::array::from_fn(|i| [50.0 - 8.0 * i as f64, 30.0 + 0.2 * f64::from(frame)]);
        if frames.contains(&frame) {
            change(&mut places);
        }
        for (i, [x, y]) in places.iter().enumerate() {
            text += &format!("{},tongue_{i},{x},{y}\n", 0.02 * f64::from(frame));
        }
    }
    aligned_recording(&read(text.as_bytes(), "t.csv")[0], "")
}

#[test]
fn implausible_points_are_removed_and_reported() {
    let changed = |change: fn(&mut [[f64; 2]; 7])| changed_in(&[4], change);
    let faults_of = |recording: &mut AlignedRecording, palate: Option<&[Point]>| {
        let faults = remove_outliers(recording, palate);
        assert!(faults.iter().enumerate().all(|(t, f)| t == 4 || f.is_empty()), "{faults:?}");
        faults[4].clone()
    };
    let mut good = changed(|_| {});
    assert!(faults_of(&mut good, None).is_empty());
    let palate = [Point::new(0.0, 0.036), Point::new(0.06, 0.036)];
    type Change = fn(&mut [[f64; 2]; 7]);
    let cases: [(Change, FaultKind, &str); 3] = [
        (|p| p[3][1] += 30.0, FaultKind::Jumped, "tongue_3"),
        (|p| p.swap(2, 3), FaultKind::OutOfOrder, "tongue_2 tongue_3"),
        (|p| p[2][1] += 9.0, FaultKind::BeyondPalate, "tongue_2"),
    ];
    for (change, kind, points) in cases {
        let mut recording = changed(change);
        let faults = faults_of(&mut recording, (kind == FaultKind::BeyondPalate).then_some(&palate));
        assert_eq!((faults[0].kind, faults[0].points.join(" ")), (kind, points.to_owned()));
        let is_left = |t: usize, i: usize| recording.frames[t].contour[i].is_some();
        assert!((0..7).all(|i| is_left(4, i) != points.contains(&format!("_{i}")) && is_left(3, i)));
    }
    // A point stands out of the contour in every third frame by as much as tongues move.
    let faults = remove_outliers(&mut changed_in(&[0, 3, 6], |p| p[3][1] += 12.0), None);
    for (frame, fault) in faults.iter().enumerate() {
        let named: Vec<&str> = fault.iter().flat_map(|f| &f.points).map(String::as_str).collect();
        assert_eq!(named, if frame % 3 == 0 { vec!["tongue_3"] } else { vec![] }, "{frame}: {faults:?}");
    }
}

#[test]
fn a_text_grid_beside_a_recording_gives_its_labels() {
    let folder = tempfile::tempdir().unwrap();
    let [table, grid] = ["one.csv", "one.TextGrid"].map(|name| folder.path().join(name));
    std::fs::write(&table, "time_s,point,x_mm,y_mm\n0,T1,1,2\n").unwrap();
    std::fs::write(&grid, TEXT_GRID).unwrap();
    let found = Recording::from_path(&table, None).unwrap().remove(0).labels;
    assert_eq!(found, text_grid(TEXT_GRID.as_bytes(), "").unwrap());
    std::fs::write(&grid, &TEXT_GRID[..TEXT_GRID.len() - 12]).unwrap();
    crate::fixtures::says(Recording::from_path(&table, None), "one.TextGrid:; cut off");
}
