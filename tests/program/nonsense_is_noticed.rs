//! Recordings, landmarks and tables that cannot be right are reported once, with advice; good inputs raise no doubt.

use std::fs;

use serde_json::Value;

use super::run::{record, refused, run};

const RECORDING: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/targets/recordings/synthetic.tsv");

/// The built-in recording as a tidy table with changed coordinates.
fn tidy(change: impl Fn(usize, f64, f64) -> [f64; 2]) -> String {
    let text = fs::read_to_string(RECORDING).unwrap();
    let mut rows = text.lines().map(|l| l.split('\t').collect::<Vec<_>>());
    let header = rows.next().unwrap();
    let names = |column: usize| match header[column].trim_start_matches(['X']).split_once(' ') {
        Some((n, "DLC_Tongue")) => Some(format!("tongue_{n}")),
        Some(("0", "DLC_HyoidMandible")) => Some("hyoid".to_owned()),
        Some(("1", "DLC_HyoidMandible")) => Some("mental_spine".to_owned()),
        _ => None,
    };
    let mut out = "recording,time_s,point,x_mm,y_mm\n".to_owned();
    for (nth, row) in rows.enumerate() {
        for column in (4..header.len()).step_by(2).filter(|c| header[*c].starts_with('X')) {
            let Some(name) = names(column) else { continue };
            let [x, y] = change(nth, row[column].parse().unwrap(), row[column + 1].parse().unwrap());
            out += &format!("{},{},{name},{x},{y}\n", row[3], row[2]);
        }
    }
    out
}

/// The contours of the built-in recording in the frame of the built-in body, raised by some millimetres.
fn contours_of_the_body(raised_mm: f64) -> String {
    let all = tidy(|_, x, y| [98.1 - x, y - 15.8 + raised_mm]);
    let lines = all.lines().filter(|l| l.contains("time_s") || l.contains(",tongue_"));
    lines.map(|l| format!("{l}\n")).collect()
}

#[test]
fn recordings_that_cannot_be_right_are_refused_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let write = |name: &str, text: &str| fs::write(at.join(name), text).unwrap();
    write("far.csv", &tidy(|_, x, y| [x, y + 40.0]));
    let two = fs::read_to_string(RECORDING).unwrap().replacen("synthetic\t", "other\t", 1);
    write("two.tsv", &two);
    // The spine and the hyoid are where the body has them, and the contour is 25 mm above the dorsum.
    let mut high = "time_s,point,x_mm,y_mm\n".to_owned();
    for time in (0..4).map(|frame| 0.0125 * f64::from(frame)) {
        high += &format!("{time},mental_spine,0,0\n{time},hyoid,37.6,-3.1\n");
        for (point, angle) in (0..11).map(|point| (point, 0.2 + 0.25 * f64::from(point))) {
            let [x, y] = [18.0 + 45.0 * angle.cos(), 20.0 + 55.0 * angle.sin()];
            high += &format!("{time},tongue_{point},{x:.2},{y:.2}\n");
        }
    }
    write("high.csv", &high);
    write("contours.csv", &contours_of_the_body(0.0));
    let mut body: Value = serde_json::from_str(&run(at, "mesh --json").out).unwrap();
    body["bones"].as_object_mut().unwrap().remove("hyoid");
    write("no_hyoid.json", &body.to_string());
    for (arguments, told) in [
        ("track high.csv --as-is --frames 0", "cannot be reached by this body"),
        ("track far.csv --as-is", "not in the body's frame"),
        ("track contours.csv --mesh no_hyoid.json --formants", "by which the drawn tract could be placed"),
        ("adapt two.tsv", "are of 2 speakers (other, synthetic)"),
        ("track two.tsv --as-is", "are of 2 speakers (other, synthetic)"),
        ("track two.tsv --speaker nobody", "no recording is of this speaker"),
    ] {
        let said = refused(at, arguments);
        assert!(said.contains(told), "{arguments}: {said}");
    }
}

#[test]
fn a_contour_that_no_tongue_has_ends_with_3() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("bones.csv"), "point,x_mm,y_mm\nmental_spine,0,0\nhyoid,37.6,-3.1\n").unwrap();
    // Every third point is far above its neighbours.
    let spikes = (0..12).map(|i| format!("p{i},{},{}\n", 48 - 5 * i, 25 + (i % 3) * 14)).collect::<String>();
    fs::write(at.join("spikes.csv"), format!("point,x_mm,y_mm\n{spikes}")).unwrap();
    let done = run(at, "adapt --landmarks bones.csv --contour spikes.csv --out body");
    assert!(done.status == Some(3) && done.err.contains("not to be trusted"), "{}", done.err);
}

#[test]
fn faults_that_leave_an_answer_are_told_once_on_terminal_json_and_page_and_status_3_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // A point of every contour is 12 mm too high, and another one is 20 mm too high in one frame.
    let mut seen = 0;
    let raised = |line: &str| {
        let (row, y) = line.rsplit_once(',').unwrap();
        seen += usize::from(line.contains(",tongue_8,"));
        let by = match () {
            () if line.contains(",tongue_4,") => 12.0,
            () if line.contains(",tongue_8,") && seen == 40 => 20.0,
            () => return format!("{line}\n"),
        };
        format!("{row},{}\n", y.parse::<f64>().unwrap() + by)
    };
    let spike: String = tidy(|_, x, y| [x, y]).lines().map(raised).collect();
    fs::write(at.join("spike.csv"), spike).unwrap();
    let done = run(at, "track spike.csv --frames 0 --draws 100 --prior 1000 --out spike");
    let told = &done.err;
    let name = "synthetic one: tongue_4 stands out of the contour by 1";
    assert_eq!(told.matches(name).count(), 1, "{told}");
    for file in ["track.json", "track.html"] {
        let text = fs::read_to_string(at.join("spike").join(file)).unwrap();
        assert_eq!(text.matches(name).count(), 1, "{file}");
    }
    assert_eq!(told.matches("in 1 of 45 frames points jump; they are left out").count(), 1, "{told}");
    assert_eq!(done.status, Some(3), "{told}");
    assert!(told.contains(" frames cannot be trusted (") && told.contains(" off branch"), "{told}");
    let json = record(at, "spike/track.json");
    assert!(json["untrusted"].as_str().unwrap().contains("cannot be trusted"), "{}", json["untrusted"]);
    for (raised_mm, status) in [(0.0, 0), (17.0, 3)] {
        fs::write(at.join("contours.csv"), contours_of_the_body(raised_mm)).unwrap();
        let done = run(at, "track contours.csv --as-is --frames 0 --draws 100 --out contours");
        assert_eq!(done.status, Some(status), "{}", done.err);
        assert_eq!(done.err.contains("in 45 of 45 frames points lie beyond the palate"), status == 3);
    }
}

#[test]
fn a_recording_whose_tensions_mean_nothing_is_left_out_everywhere_and_a_gap_can_be_trusted() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // From one frame on the tongue of the second recording is shifted, and the first one is not seen for ten frames.
    let text: String = tidy(|nth, x, y| [x, if nth > 70 { y + 14.0 } else { y }])
        .lines()
        .filter(|line| {
            let time = line.split(',').nth(1).and_then(|t| t.parse::<f64>().ok()).unwrap_or(0.0);
            !(line.starts_with("synthetic one") && line.contains("tongue") && (0.2..0.32).contains(&time))
        })
        .map(|line| format!("{line}\n"))
        .collect();
    fs::write(at.join("slip.csv"), text).unwrap();
    let done = run(at, "track slip.csv --frames 0 --draws 100 --out slip");
    let told = &done.err;
    let name = "left out: slip.csv, synthetic two: all points of the tongue are shifted";
    assert_eq!((done.status, told.matches(name).count()), (Some(1), 1), "{told}");
    let read = |file: &str| fs::read_to_string(at.join("slip").join(file)).unwrap();
    assert!(read("track.json").contains(name) && read("track.html").contains(name));
    assert!(read("track.csv").contains("synthetic one,") && !read("track.csv").contains("synthetic two,"));
    assert!(read("track.csv").contains(",gap,") && !read("track.json").contains("untrusted"));
    // Coils in turned axes are out of reach.
    let (sin, cos) = 50_f64.to_radians().sin_cos();
    let coils = tidy(|_, x, y| [cos * x - sin * y, sin * x + cos * y])
        .lines()
        .filter(|l| ["time_s", "tongue_3,", "tongue_6,", "tongue_9,"].iter().any(|n| l.contains(n)))
        .map(|l| l.replace("tongue_9", "T1").replace("tongue_6", "T2").replace("tongue_3", "T3") + "\n")
        .collect::<String>();
    fs::write(at.join("turned.csv"), coils).unwrap();
    let told = refused(at, "track turned.csv");
    assert!(told.contains("turn_deg"), "{told}");
    fs::write(at.join("back.toml"), "turn_deg = 50\n").unwrap();
    let done = run(at, "track turned.csv --map back.toml --frames 0 --draws 100 --out turned");
    assert_eq!(done.status, Some(0), "{}", done.err);
    // A note that two recordings have in common is printed once.
    assert!(done.err.contains("synthetic one; synthetic two: the hyoid was never seen"), "{}", done.err);
}

/// `a_recording_with_more_than_one_untrusted_frame_in_twenty_is_untrusted` shows the other side of the limit.
#[test]
fn frames_that_cannot_be_trusted_below_5_percent_of_a_recording_are_a_note() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // The contour of two frames of the first recording gets a wave of 14 mm with half its length: no tongue is shaped so.
    let point = std::cell::Cell::new(0);
    let wavy = tidy(|frame, x, y| {
        let along = f64::from(point.replace(point.get() + 1) % 13);
        let wave = 14.0 * (along / 5.5 * std::f64::consts::TAU).sin();
        [x, if [5, 13].contains(&frame) && along < 11.0 { y + wave } else { y }]
    });
    fs::write(at.join("wavy.csv"), wavy).unwrap();
    let done = run(at, "track wavy.csv --frames 0 --draws 100 --out wavy");
    assert!(done.status == Some(0) && record(at, "wavy/track.json")["untrusted"].is_null());
    let told = done.message();
    let told_frames =
        "2 of the 90 frames cannot be trusted (2 out of reach), no more than 5 % of any recording";
    assert!(told.contains(told_frames), "{told}");
}
