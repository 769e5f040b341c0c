//! `tongue-fit track` and `tongue-fit adapt`: from a recording to tensions, and messages about files that are not recordings.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use super::run::{names, program, record, run};

const RECORDING: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/targets/recordings/synthetic.tsv");

/// The record of a run that ends with status 0 or 3.
fn found(folder: &Path, line: &str) -> Value {
    run(folder, &format!("{} --frames 0 --json", line.replace("RECORDING", RECORDING))).record()
}

/// The built-in recording as a row of titles and a row for every frame.
fn cells() -> Vec<Vec<String>> {
    let text = fs::read_to_string(RECORDING).unwrap();
    text.lines().map(|l| l.split('\t').map(str::to_owned).collect()).collect()
}

fn write(folder: &Path, file: &str, lines: &[Vec<String>]) {
    let text: String = lines.iter().map(|l| l.join("\t") + "\n").collect();
    fs::write(folder.join(file), text).unwrap();
}

/// Several copies of the built-in recordings, each with only its first frames.
fn copies(count: usize, frames: impl Fn(usize) -> usize) -> Vec<Vec<String>> {
    let lines = cells();
    let mut out = vec![lines[0].clone()];
    for copy in 0..count {
        for (_, line) in lines[1..].iter().enumerate().filter(|(nth, _)| nth % 45 < frames(copy)) {
            let name = |cell: &String| cell.replace("synthetic one", &format!("one {copy}"));
            let name = |cell: &String| name(cell).replace("synthetic two", &format!("two {copy}"));
            out.push(line.iter().map(name).collect());
        }
    }
    out
}

/// `tensions_are_tracked` in tests/library and the calibrations show that intervals hold the truth and that draws are those of the frames.
#[test]
fn a_recording_without_a_body_is_adapted_to_and_tracked() {
    let folder = tempfile::tempdir().unwrap();
    let line = format!("track '{RECORDING}' --json --frames 10 --formants --also svg,sto,vtu,draws");
    let found = run(folder.path(), &line).record();
    let frames = found["frames"].as_array().unwrap();
    assert_eq!((frames.len(), found["recordings"].as_array().unwrap().len()), (90, 2));
    assert_eq!(found["rest"], "similarity");
    assert!(found["median_rms_mm"].as_f64().unwrap() < 1.0, "{}", found["median_rms_mm"]);
    for frame in frames {
        for (muscle, tension) in frame["tensions_n"].as_object().unwrap() {
            let end = |of: &str| frame[of][muscle].as_f64().unwrap();
            assert!((end("low")..=end("high")).contains(&tension.as_f64().unwrap()));
            assert!(end("course_low") <= end("course") && end("course") <= end("course_high"));
        }
    }
    // Most frames have formants, and frames without formants are counted by reason.
    let told = frames.iter().filter(|f| f.get("formants").is_some()).count();
    let without = found["formants"]["without"].as_object().unwrap();
    assert_eq!(without.values().map(|n| n.as_u64().unwrap()).sum::<u64>(), 90 - told as u64);
    assert!(told > 45 && found["formants"]["frames"] == told, "{}", found["formants"]);
    // Every file exists and has the content of its format.
    let out = folder.path().join("results/track");
    let read = |name: &str| fs::read_to_string(out.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    assert_eq!(read("track.csv").lines().count(), 1 + 90 * 8);
    assert_eq!(read("formants.csv").lines().count(), 1 + 2 * told + (90 - told));
    assert!(read("draws.csv").lines().count() > 25_000);
    assert!(read("track.html").contains("Without data a tension is 13.5"));
    for name in ["track_1.svg", "track_2.svg", "shapes_1.svg", "shapes_2.svg", "shapes_1_0000.vtu"] {
        roxmltree::Document::parse(&read(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    }
    let drawn = read("track_1.svg");
    for told in ["known courses:", "url(#hatch)", "course not known", "RMS", "N/m", "time (s)"] {
        assert!(drawn.contains(told), "{told}");
    }
    // The body is written with the shape at rest that was found, and is read back unchanged.
    let body = record(&out, "body.json");
    let mesh = run(folder.path(), "mesh --mesh results/track/body.json --json").record();
    assert_eq!(mesh["nodes_m"], body["nodes_m"]);
    let sto = read("track_2.sto");
    assert!(sto.contains("nRows=45\nnColumns=50\n"), "{}", &sto[..300]);
    assert!(read("shapes_1.pvd").contains("shapes_1_0008.vtu"));
}

/// Lower end, median and upper end of a level and of a course.
type Intervals = [[f64; 3]; 2];

/// The intervals of all frames and muscles.
fn intervals(found: &Value) -> Vec<Intervals> {
    let mut out = Vec::new();
    for frame in found["frames"].as_array().unwrap() {
        for muscle in frame["tensions_n"].as_object().unwrap().keys() {
            let of = |names: [&str; 3]| names.map(|n| frame[n][muscle].as_f64().unwrap());
            let level = of(["level_low", "tensions_n", "level_high"]);
            out.push([level, of(["course_low", "course", "course_high"])]);
        }
    }
    out
}

/// `tests/slow/tracked_intervals_cover_the_truth.rs` shows that more points of a contour are no new data.
#[test]
fn gaps_and_hidden_points_leave_the_answer_within_its_intervals() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let lines = cells();
    let track = |lines: &[Vec<String>], more: &str| {
        write(at, "r.tsv", lines);
        found(at, &format!("track r.tsv {more}"))
    };
    let full = intervals(&track(&lines, ""));
    let part = |other: &[Intervals], good: &dyn Fn(&Intervals, &Intervals) -> bool| {
        full.iter().zip(other).filter(|(a, b)| good(a, b)).count() as f64 / full.len() as f64
    };
    // Three of eleven points are missing in every fifth frame.
    let mut gaps = lines.clone();
    for (t, line) in gaps.iter_mut().enumerate().skip(1).filter(|(t, _)| t % 5 == 3) {
        for i in [t % 11, (t + 4) % 11, (t + 7) % 11] {
            (0..2).for_each(|axis| line[4 + 2 * i + axis].clear());
        }
    }
    let near = part(&intervals(&track(&gaps, "")), &|[a, _], [b, _]| {
        (a[1] - b[1]).abs() <= 0.15 * 0.5 * (a[2] - a[0])
    });
    assert!(near >= 0.9, "{near} of medians lie within 0.15 of a half width");
    // Intervals without points 2, 5 and 8 hold the medians of the fit with them.
    let found = track(&lines, "--hold-out 2,5,8");
    let hidden = intervals(&found);
    for which in 0..2 {
        let held = part(&hidden, &|a, b| b[which][0] <= a[which][1] && a[which][1] <= b[which][2]);
        assert!(held >= 0.95, "{held}");
    }
    // The hidden points are predicted better by the mechanics than by interpolation, and their intervals hold them.
    let held = &found["held_out"];
    assert_eq!(held["points"], json!(["tongue_2", "tongue_5", "tongue_8"]));
    let opponents = held["opponents"].as_array().unwrap();
    let medians: Vec<f64> = opponents.iter().map(|o| o["median_mm"].as_f64().unwrap()).collect();
    assert!(opponents.len() == 4 && opponents[0]["name"] == "the model" && medians[0] < medians[1], "{held}");
    let frames = found["frames"].as_array().unwrap();
    assert!(frames[0]["held_out_rms_mm"].as_f64().unwrap() > 0.0);
    let hidden: Vec<_> = frames.iter().flat_map(|f| f["held_out"].as_array().unwrap()).collect();
    let is_held = |h: &&&Value| {
        let [low, high] = [0, 1].map(|end| h["interval_mm"][end].as_f64().unwrap());
        (low..=high).contains(&h["missed_mm"].as_f64().unwrap())
    };
    let part = hidden.iter().filter(is_held).count() as f64 / hidden.len() as f64;
    assert!(part >= 0.9, "{part} of {}", hidden.len());
    // Six points judge these intervals, so they are up to six times as wide as the error.
    let squares = hidden.iter().map(|h| h["missed_mm"].as_f64().unwrap().powi(2));
    let rms = (squares.sum::<f64>() / hidden.len() as f64).sqrt();
    assert!(hidden.iter().all(|h| h["interval_mm"][1].as_f64().unwrap() < 6.0 * rms));
}

/// `tensions_are_tracked` in tests/library shows that the number of threads changes no bit.
#[test]
fn an_adapted_body_goes_into_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let done = run(at, &format!("adapt '{RECORDING}' --out speaker"));
    assert_eq!(done.status, Some(0), "{}", done.err);
    assert!(done.out.contains("rest shape: the shape that explains many frames at once"), "{}", done.out);
    assert!(!at.join("speaker/anatomy.toml").exists(), "one body, whatever file is read back");
    let simulated = run(at, "simulate --mesh speaker/body.json --tension GGa=10 --json");
    assert_eq!(simulated.status, Some(0), "{}", simulated.err);
    // The displacement of a bone that was never seen can be an unknown.
    let mut lines = cells();
    lines.iter_mut().skip(1).for_each(|l| (26..28).for_each(|c| l[c] = "*".into()));
    write(at, "unseen.tsv", &lines);
    let line = "track unseen.tsv --mesh speaker/body.json --also sto --out o";
    for (more, told, bones) in
        [("", "track --free-bone hyoid", 0), ("--free-bone hyoid", "its displacement is an unknown", 2)]
    {
        let found = found(at, &format!("{line} {more}"));
        assert!(found["rest"] == "joint" && found["notes"].to_string().contains(told), "{}", found["notes"]);
        let interval = &found["frames"][0]["bones"]["hyoid"]["interval_mm"];
        assert_eq!(interval.as_array().map_or(0, Vec::len), bones, "{interval}");
    }
    let sto = fs::read_to_string(at.join("o/track_1.sto")).unwrap();
    assert!(sto.contains("hyoid_shift_x_mm\thyoid_shift_y_mm\tresolved"));
}

/// The built-in recording as three coils near the tip would record it, turned by 12 degrees.
fn coils() -> String {
    let lines = cells();
    let mut out = "recording,time_s,point,x_mm,y_mm\n".to_owned();
    for row in &lines[1..] {
        let of = |title: &str| &row[lines[0].iter().position(|t| *t == title).unwrap()];
        for (coil, number) in [("T1", 9), ("T2", 7), ("T3", 5)] {
            let [x, y] =
                ["X", "Y"].map(|axis| of(&format!("{axis}{number} DLC_Tongue")).parse::<f64>().unwrap());
            let (sin, cos) = 12f64.to_radians().sin_cos();
            let [x, y] = [cos * x - sin * y, sin * x + cos * y];
            out += &format!("{},{},{coil},{x},{y}\n", of("Prompt"), of("Time of sample in recording"));
        }
    }
    out
}

/// tests/slow/coils_place_the_body.rs and tests/slow/hidden_coils_are_predicted.rs show how well.
#[test]
fn coils_place_the_body_and_one_that_is_hidden_is_predicted() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("coils.csv"), coils()).unwrap();
    let seen = found(at, "track coils.csv");
    let converged = seen["statuses"]["converged"].as_u64().unwrap_or(0);
    assert!(converged >= 72, "of 90 frames: {}", seen["statuses"]);
    let placement = &seen["placement"];
    for (what, least, most) in [("scale", 0.2, 0.6), ("turn_deg", 20.0, 50.0), ("up_mm", 6.0, 30.0)] {
        let [middle, low, high] = [0, 1, 2].map(|i| placement[what][i].as_f64().unwrap());
        assert!(low < middle && middle < high && (least..most).contains(&(high - low)), "{placement}");
    }
    // Coils hardly say where the hyoid is, but its displacement is not less certain than its prior of 5 mm.
    for frame in found(at, "track coils.csv --free-bone hyoid")["frames"].as_array().unwrap() {
        for axis in frame["bones"]["hyoid"]["interval_mm"].as_array().unwrap() {
            let [low, high] = [0, 1].map(|end| axis[end].as_f64().unwrap());
            assert!(high - low < 21.0, "{axis}");
        }
    }
    // The body that `adapt` writes has the same coils in the same places.
    run(at, "adapt coils.csv --out body");
    let again = found(at, "track coils.csv --mesh body/body.json");
    let rms = [&seen, &again].map(|f| f["median_rms_mm"].as_f64().unwrap());
    assert!((rms[0] - rms[1]).abs() < 0.1 && rms[0] < 1.5, "{rms:?}");
    let hidden = found(at, "track coils.csv --hold-out T3");
    let opponents = hidden["held_out"]["opponents"].as_array().unwrap();
    assert!(opponents.len() > 1 && opponents.iter().all(|o| o["points"] == 90), "{opponents:?}");
    assert_eq!(hidden["frames"][0]["held_out"].as_array().unwrap().len(), 2, "a coil has two coordinates");
}

#[test]
fn labels_become_segments_what_repeats_is_that_of_the_results_and_what_is_harder_is_said_first() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let done = run(at, "track --example --frames 0 --out out");
    let found = record(at, "out/track.json");
    let segments = found["segments"].as_array().unwrap();
    let of = |tier: &str| segments.iter().filter(|s| s["tier"] == tier).count();
    assert_eq!((of("annotation"), of("prompt")), (6, 2));
    assert_eq!(found["repeats"]["labels"], json!({ "a": 2, "i": 2, "u": 2 }));
    assert_eq!(csv::Reader::from_path(at.join("out/segments.csv")).unwrap().records().count(), 8 * 8);
    let kept = concat!(env!("CARGO_MANIFEST_DIR"), "/results/track/repeats.csv");
    let mut rows = 0;
    for row in csv::Reader::from_path(kept).unwrap().records() {
        let row = row.unwrap();
        let now = &found["repeats"]["muscles"][&row[0]];
        let names = "icc by_chance chance_95 by_exchange exchange_95 of_label of_label_95";
        for (column, what) in (1..).zip(names.split(' ')) {
            let (kept, now): (f64, f64) = (row[column].parse().unwrap(), now[what].as_f64().unwrap());
            assert!((kept - now).abs() < 0.02, "{what}: {kept}, now {now}; make results/track anew");
        }
        rows += 1;
    }
    assert_eq!(rows, 8);
    // Differences between labels are listed.
    let compared = &found["comparisons"][0];
    assert_eq!((&compared["tier"], &compared["labels"][2]["label"]), (&"annotation".into(), &"u".into()));
    assert_eq!((&compared["labels"][2]["repetitions"], found["comparisons"].get(1)), (&2.into(), None));
    let mut table = csv::Reader::from_path(at.join("out/contrasts.csv")).unwrap();
    let mut decided = 0;
    for (row, c) in table.records().map(Result::unwrap).zip(compared["contrasts"].as_array().unwrap()) {
        let [muscle, word, a, b] = ["muscle", "word", "a", "b"].map(|key| c[key].as_str().unwrap());
        assert_eq!([&row[1], &row[2], &row[3], &row[8]], [muscle, a, b, word]);
        assert_eq!(row[4].parse::<f64>().unwrap(), c["median"].as_f64().unwrap());
        if let Some((how, rest)) = word.split_once(' ').filter(|_| word != "not known") {
            decided += 1;
            let [more, less] = if rest == "harder" { [a, b] } else { [b, a] };
            let sentence = format!("{muscle}: {how} harder in /{more}/ than in /{less}/, by ");
            assert!(done.out.find(&sentence).unwrap() < done.out.find("| muscle").unwrap(), "{}", done.out);
        }
    }
    assert!(decided >= 6, "{decided} decided");
    for sentence in ["it is\nknown if it varies by more than", "\nLabels are known if the same is true"] {
        assert!(done.out.contains(sentence), "{}", done.out);
    }
    assert!(fs::read_to_string(at.join("out/track.html")).unwrap().contains("harder in /u/ than in /a/"));
}

#[test]
fn a_run_writes_six_files_however_many_recordings_it_has_and_its_page_draws_what_is_opened() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // Six recordings in place of two; the last one has no hyoid.
    let mut many = copies(3, |copy| 45 - 6 * copy);
    for line in many.iter_mut().filter(|line| line.iter().any(|cell| cell.contains("two 2"))) {
        line[26..30].iter_mut().for_each(String::clear);
    }
    write(at, "many.tsv", &many);
    // A copy of the file is noted, and adds nothing.
    write(at, "copy.tsv", &many);
    let done = run(at, "track many.tsv copy.tsv --draws 100 --out out");
    assert_eq!(done.status, Some(0), "{}", done.err);
    assert_eq!(
        done.err.matches("of copy.tsv has the same frames and is left out").count(),
        6,
        "{}",
        done.err
    );
    let expected = ["body.json", "contrasts.csv", "segments.csv", "track.csv", "track.html", "track.json"];
    assert_eq!(names(&at.join("out")), expected);
    // The page has all shapes of all recordings in less than 800 bytes for each frame.
    let page = fs::read_to_string(at.join("out/track.html")).unwrap();
    assert!(page.len() < 40_000 + 800 * 234, "{}", page.len());
    assert_eq!(page.matches("<details class=\"recording\"").count(), 6);
    assert!(!page.contains("Gestures") && !page.contains("-0.00<"));
    let found = record(at, "out/track.json");
    assert!(found.get("gestures").is_none() && found["frames"].as_array().unwrap().len() == 234);
    // Recordings that show the same bones share a shape at rest; that of the others is in the same file.
    let body = record(at, "out/body.json");
    let others = body["other_rest_shapes"].as_array().unwrap();
    assert_eq!(others.len(), 1);
    let apart = others[0]["recordings"].as_array().unwrap();
    assert!(apart.len() == 1 && apart[0].as_str().unwrap().ends_with("two 2"), "{apart:?}");
    assert_eq!(others[0]["nodes_m"].as_array().unwrap().len(), body["nodes_m"].as_array().unwrap().len());
}

#[test]
fn a_run_that_was_killed_goes_on_after_the_recordings_that_were_done() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // There are many short recordings, tracked one after another, so that the run can be killed between them.
    write(at, "many.tsv", &copies(6, |copy| 9 + copy));
    let line = "track many.tsv --rest similarity --frames 0 --threads 1 --draws 200";
    let mut child = program(at, line).stdout(std::process::Stdio::null()).spawn().unwrap();
    let journal = at.join("results/track/track.journal");
    let lines = || fs::read(&journal).map_or(0, |b| b.iter().filter(|b| **b == b'\n').count());
    while lines() < 4 && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let done = child.try_wait().unwrap().is_some();
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!done && lines() >= 4, "{done} {}", lines());
    let told = run(at, line).err;
    assert!(told.contains("resuming after") && told.contains("of 12 recordings"), "{told}");
    assert!(!journal.exists(), "all of it stands in the outputs");
    let resumed = fs::read(at.join("results/track/track.csv")).unwrap();
    run(at, line);
    assert!(resumed == fs::read(at.join("results/track/track.csv")).unwrap(), "the same as at one go");
}

#[test]
fn one_posture_is_fitted_from_points_and_a_palate_is_met() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let points = "point,x_mm,y_mm\ntongue_0,46.5,20\ntongue_1,45.5,33\ntongue_2,37.5,45\ntongue_3,28.5,51\ntongue_4,19.5,49\n\
                  tongue_5,10.5,45.5\ntongue_6,1.5,42\ntongue_7,-7,35\n";
    fs::write(at.join("my.csv"), points).unwrap();
    let whole = found(at, "--points my.csv --as-is");
    let frames = whole["frames"].as_array().unwrap();
    assert_eq!((frames.len(), frames[0]["status"].as_str()), (1, Some("converged")));
    assert!(frames[0]["rms_mm"].as_f64().unwrap() < 1.0, "{}", frames[0]["rms_mm"]);
    // Two of the points would have to pass through this palate.
    fs::write(at.join("palate.csv"), "point,x_mm,y_mm\na,-20,46.5\nb,0,46.5\nc,23,46.5\nd,25,55\ne,60,55\n")
        .unwrap();
    let told = found(at, "--points my.csv --as-is --palate palate.csv");
    let fault = &told["frames"][0]["faults"][0];
    assert_eq!((fault["kind"].as_str(), &fault["points"]), (Some("beyond_palate"), &json!(["tongue_4"])));
}
