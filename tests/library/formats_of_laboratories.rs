//! Recordings in the formats of laboratories, in files that were written from the descriptions of the formats.

use tongue_fit::measured::recording::{AlignedRecording, Format, Map, Recording};
use tongue_input::measured::recording::{Times, Waveform};

use crate::recordings::{
    AAA, AG501, CON, DLC, est, fan_row, files, headerless_pos, matlab, mocha, mview, pos, txy, wave,
};
use crate::recordings_are_read::{AAA as WITH_BONES, aligned, aligned_recording, near, read, refused};

/// For each file its format, channels, times (s), and positions by frame and channel.
const EXPECTED: &str = "\
Microbeam; UL LL T1 T2 T3 T4 MANi MANm; 0 0.006866 0.013732; 0.5=- 0.6=-60000,5000,0
NdiWave; sensor_1 sensor_2 sensor_3; 0 0.01; 0.1=25,5,-50 1.1=- 1.2=40,8,-50
NdiWave; sensor_1 sensor_2 sensor_3; 0 0.01; 0.1=- 1.1=-
Ag50x; TT T2; 0.004 0.008; 0.1=4,5,6 1.0=-
Est; ui li ul ll tt tb td v bn; 0 0.002 0.004 0.006; 0.4=400,900,0 1.4=-
Est; ui li ul ll tt tb td v bn; 0 0.002 0.004; 0.4=400,900,0
Ag50x; sensor_1 .. sensor_12; 0 0.005 0.01 0.015; 0.11=-
Ag50x; sensor_1 sensor_2 sensor_3; 0 0.004 0.008 0.012; 2.1=12,-1,102 0.2=-
Mview; TR TB TT JAW; 0 0.01; 0.2=-20,0,4 1.0=-
Mview; TR TB TT JAW; 0 0.01; 0.2=-20,0,4 1.0=-
DeepLabCut; tongue_0 tongue_10 hyoid; 0 1; 1.0=-
AaaFan; tongue_1 .. tongue_42; 0.48 0.5 0.52; 0.8=- 0.9=10.5,20.25,0 0.12=-
Est; T1; 0 0.005 0.01; 1.0=- 2.0=0,-3.5,2.25
Est; T1; 0 0.005 0.01; 1.0=- 2.0=0,-3.5,2.25
Edgetrak; tongue_0 tongue_1 tongue_2; 0 1; 1.0=11,21,0 1.1=-
Edgetrak; tongue_0 tongue_1 tongue_2; 0 1; 1.0=11,21,0 1.1=-
Aaa; tongue_0 tongue_1; 0.01; 0.1=30.25,40,0";

#[test]
fn every_format_has_its_channels_times_and_places() {
    let all = files();
    for ((bytes, origin), expected) in all.iter().zip(EXPECTED.lines()) {
        let found = read(bytes, origin);
        assert_eq!(found.len(), 1, "{origin}");
        let Recording { format, channels, samples, .. } = &found[0];
        let named = match channels.as_slice() {
            [first, .., last] if channels.len() > 9 => format!("{first} .. {last}"),
            all => all.join(" "),
        };
        let times = samples.iter().map(|s| ((s.time_s * 1e6).round() / 1e6).to_string());
        let places = expected.rsplit_once("; ").unwrap().1.split(' ').map(|place| {
            let at = place.split_once('=').unwrap().0;
            let (frame, channel) = at.split_once('.').unwrap();
            let place = samples[frame.parse::<usize>().unwrap()].places[channel.parse::<usize>().unwrap()];
            format!("{at}={}", place.map_or("-".to_owned(), |p| p.map(|v| v.to_string()).join(",")))
        });
        let [times, places] = [times.collect::<Vec<_>>(), places.collect()].map(|all| all.join(" "));
        assert_eq!(format!("{format:?}; {named}; {times}; {places}"), expected, "{origin}");
    }
    assert_eq!(EXPECTED.lines().count(), all.len());
    assert_eq!(read(&all[5].0, "a.ema")[0].times, Times::Usual(500.0));
    assert_eq!([7, 8].map(|n| read(&all[n].0, all[n].1).remove(0).name), ["0001", "sentence_01"]);
}

#[test]
fn every_format_is_brought_into_the_axes_of_the_body() {
    let slow = "rate_hz = 100\nback = \"x\"\n[points]\nsensor_1 = { coil = 1 }\nsensor_2 = \"coil\"";
    let surface = "back = \"x\"\n[points]\nsensor_2 = { surface_mm = 10.0 }";
    let of_est = "unit_mm = 10.0\nback = \"-y\"\nup = \"z\"\n[points]\nT1 = { surface_mm = 5 }";
    for (bytes, origin, map, frame, time_s, point, at) in [
        // Here x grows to the front, so that T1 is in front of T4 without a map.
        (txy(3).into_bytes(), "a.txy", "", 1, 0.006866, 0, [0.0199, 0.0051]),
        (AG501.into(), "ag501.txt", "back = \"x\"", 0, 0.004, 0, [0.001, 0.003]),
        (mocha(4).into(), "a.ema", "", 0, 0.0, 0, [0.004, 0.009]),
        (headerless_pos(4), "1.pos", slow, 3, 0.03, 0, [0.003, 0.103]),
        (mview(true), "a.mat", "", 0, 0.0, 0, [0.020, 0.004]),
        (pos(3, 250.0, 4), "1.pos", surface, 2, 0.008, 0, [0.012, 0.102]),
        (est(false), "a.ema", of_est, 2, 0.01, 0, [0.035, 0.0225]),
        // Pixels are counted downwards.
        (DLC.into(), "a.csv", "unit_mm = 0.1\nrate_hz = 50", 0, 0.0, 1, [0.002, -0.015]),
        (DLC.into(), "a.csv", "unit_mm = 0.1\nrate_hz = 50", 1, 0.02, 1, [0.0021, -0.0151]),
        (CON.into(), "x.con", "unit_mm = 0.5\nrate_hz = 40\nback = \"x\"", 0, 0.0, 0, [0.005, -0.010]),
        (CON.into(), "x.con", "unit_mm = 0.5\nrate_hz = 40\nback = \"x\"", 1, 0.025, 0, [0.0055, -0.0105]),
    ] {
        let recording = aligned_recording(&read(&bytes, origin)[0], map);
        let found = recording.frames[frame].points().nth(point).unwrap().map(|m| m.at);
        let off = (recording.frames[frame].time_s - time_s).abs();
        assert!(near(found, at) && off < 1e-6, "{origin}: {found:?}, {off} s");
    }
    for (bytes, origin, map, expected) in [
        (DLC.as_bytes().to_vec(), "a.csv", "unit_mm = 0.1", "rate_hz"),
        (CON.into(), "x.con", "", "unit_mm"),
        (est(false), "a.ema", "[points]\nT1 = \"contour\"", "unit_mm"),
    ] {
        assert!(aligned(&read(&bytes, origin)[0], map).unwrap_err().contains(expected), "{origin}");
    }
}

#[test]
fn sensors_are_in_their_order_from_the_tip_at_usual_places_with_usual_errors() {
    let names = |recording: &AlignedRecording| {
        recording.sensors.iter().map(|(n, _)| n.clone()).collect::<Vec<_>>().join(" ")
    };
    let microbeam = aligned_recording(&read(txy(3).as_bytes(), "a.txy")[0], "");
    assert_eq!((names(&microbeam), microbeam.measured), ("T1 T2 T3 T4".to_owned(), vec![false; 4]));
    // By default the first coil is 8 mm behind the tip, and others behind it by slightly more than the distance of the coils.
    let places: Vec<f64> = microbeam.sensors.iter().map(|(_, at)| at * 1e3).collect();
    assert!((places[0] - 8.0).abs() < 1e-9 && (places[1] - 18.3).abs() < 1e-6, "{places:?}");
    assert_eq!(names(&aligned_recording(&read(mocha(4).as_bytes(), "a.ema")[0], "")), "tt tb td");
    // The tip has the larger x, so the face looks to the right.
    let mview = aligned_recording(&read(&mview(false), "a.mat")[0], "");
    assert_eq!((mview.mirrored, names(&mview), mview.ignored.len()), (true, "TT TB TR".to_owned(), 0));
    assert_eq!(mview.bones, ["mental_spine"]);
    let map = "back = \"x\"\n[points]\nsensor_2 = { surface_mm = 10.0 }";
    let carstens = aligned_recording(&read(&pos(3, 250.0, 4), "1.pos")[0], map);
    assert!((carstens.frames[2].sensors[0].unwrap().sd - 0.5e-3).abs() < 1e-12);
    // A point with a quarter of the likelihood has four times the variance, and one of 0.01 is not seen.
    let dlc = aligned_recording(&read(DLC.as_bytes(), "a.csv")[0], "unit_mm = 0.1\nrate_hz = 50");
    assert!(dlc.frames[0].contour[0].is_some() && dlc.frames[1].contour[0].is_none());
    let sd = |frame: usize| dlc.frames[frame].contour[1].unwrap().sd;
    assert!((sd(0) / sd(1) - 2.0).abs() < 1e-6);
    let rows = [fan_row("0,5", "a"), fan_row("0,52", "a")].concat();
    let fan = aligned_recording(&read(rows.as_bytes(), "old.txt")[0], "");
    assert_eq!((fan.contour.len(), fan.bones.len()), (42, 0));
}

#[test]
fn faults_are_told_with_their_place() {
    let without = |bytes: Vec<u8>, end: usize| bytes[..bytes.len() - end].to_vec();
    let mut newer = mview(true);
    newer.splice(..10, *b"MATLAB 7.3");
    let other = matlab::file(&[matlab::structures("x", &["A"], &[vec![matlab::text("b")]])], false);
    let fan = [fan_row("0,5", "a"), fan_row("0,52", "a"), fan_row("0,48", "b")].concat();
    let aaa = |row: &str| format!("{AAA}s\td\t{row}\n").into_bytes();
    let bones = |row: &str| format!("{WITH_BONES}s\td\t0.01\tpa\t{row}\n").into_bytes();
    let of_track = |lines: &str| {
        let head = "EST_File Track\nDataType ascii\nNumFrames 2\nNumChannels 2\nBreaksPresent false\nChannel_0 tt_x\nChannel_1 tt_y\n";
        format!("{head}EST_Header_End\n{lines}").into_bytes()
    };
    assert_eq!(read(&of_track("0 1 2\n0.1 1.55 2.55\n"), "a.ema")[0].samples.len(), 2);
    let tidy = |rows: &str| format!("time_s,point,x_mm,y_mm\n{rows}").into_bytes();
    let many = pos(3, 250.0, 1).iter().map(|b| if *b == b'3' { b'9' } else { *b }).collect();
    for (bytes, origin, expected) in [
        (b"0\t1\t2\n".to_vec(), "a.txy", "17"),
        ((txy(1) + &txy(1)).into(), "a.txy", "a.txy:2:1: "),
        (without(txy(2).into(), 9), "a.txy", "a.txy:2:"),
        (AG501.replace("\n8,", "\n3,").into(), "ag501.txt", "ag501.txt:3:1: "),
        (AG501.replace(",4,5,6\n8", ",4,y,6\n8").into(), "ag501.txt", "ag501.txt:2:7: "),
        (without(wave("OK").into(), 20), "wave.tsv", "cut off"),
        (b"1 2 3\n".to_vec(), "a.ema", "22"),
        (without(mocha(2).into(), 8), "a.ema", "a.ema:2:"),
        (without(headerless_pos(4), 1), "1.pos", "AG50x"),
        // These bytes are not plausible as millimetres.
        (vec![0x7f; 336], "1.pos", "AG50x"),
        (without(pos(3, 250.0, 4), 3), "1.pos", "cut off"),
        (b"AG50xDATA_V009\n00000070\n".to_vec(), "1.pos", "V001"),
        (many, "1.pos", "1.pos:"),
        (without(mview(true), 20), "a.mat", "cut off"),
        (newer, "a.mat", "-v7"),
        (other, "a.mat", "NAME, SRATE and SIGNAL"),
        // A small file whose content is too large is not decompressed.
        (matlab::file(&[vec![0; 80 << 20]], true), "a.mat", "64 MB"),
        (DLC.replace("coords,x,y,", "coords,x,x,").into(), "a.csv", "a.csv:3:2: "),
        (DLC[..DLC.len() - 4].replace(",0.9\n1", "\n1").into(), "a.csv", "a.csv:4"),
        (aaa("0,01\tpa\tx\t1.000,5\t20\t30,25\t40"), "a.tsv", "a.tsv:2:6: "),
        (without(fan.into(), 6), "old.txt", "old.txt:3:"),
        (est(false)[..150].to_vec(), "a.ema", "EST_Header_End"),
        (without(est(false), 4), "a.ema", "cut off"),
        (of_track("0 1 2\n"), "a.ema", "1 of 2 frames follow"),
        (of_track("0 1 2\n0.1 1.55 2.5"), "a.ema", "cut off"),
        (of_track("0 1 2\n0.1 1.5\n"), "a.ema", "a.ema:10:2: the line has 2 numbers where 3"),
        (of_track("0 1 2\n0.1 1 2\n0.2 1 2\n"), "a.ema", "NumFrames"),
        (b"1 2\n3\n".to_vec(), "x.con", "x.con:2:"),
        (tidy("0,a,1,2\n0,a,1,3\n"), "t.csv", "t.csv:3:2: a is given twice"),
        (tidy("0,a,inf,2\n"), "t.csv", "t.csv:2:3: "),
        (b"time_ms,point,x_mm,y_mm\n0,a,1,2\n".to_vec(), "t.csv", "\"time_ms\", but no column time_s"),
        (b" \n".to_vec(), "t.csv", "the file is empty"),
        (
            b"Time of sample in recording\tX0 T\tY0 T\tX0 T\tY0 T\n0\t1\t2\t3\t4\n".to_vec(),
            "a.tsv",
            "is given twice",
        ),
        (b"time_s,point,x_mm\n".to_vec(), "t.csv", "y_mm"),
        (bones("10\ttwenty\t30\t40\t5\t1\t60\t2\t55\t3\t60\t2"), "a.tsv", "a.tsv:2:6: a coordinate of"),
        (WITH_BONES.into(), "a.tsv", "no frame"),
        (b"Time of sample in recording\tX0 DLC_Tongue\n0\t1\n".to_vec(), "a.tsv", "Y0 DLC_Tongue"),
        // The points of the second spline are exchanged, so the mandible is elsewhere than in the first one.
        (bones("10\t20\t30\t40\t5\t1\t60\t2\t60\t2\t45\t2"), "a.tsv", "Mandible\" lies 15 mm from"),
    ] {
        let message = refused(&bytes, origin);
        assert!(
            message.starts_with(&format!("{origin}:")) && message.contains(expected),
            "{expected}: {message}"
        );
    }
}

#[test]
fn rows_of_several_labels_are_brought_into_the_order_of_time() {
    let row = |time: f64, label: &str, x: f64| format!("s\td\t{time}\tpa\t{label}\t{x}\t2\t3\t4\n");
    // The second label begins before the first one ends, so one row is repeated.
    let text = [row(0.03, "b", 3.0), row(0.04, "b", 4.0), row(0.02, "a", 2.0), row(0.03, "a", 3.0)].concat();
    let found = &read(format!("{AAA}{text}").as_bytes(), "a.tsv");
    let times: Vec<f64> = found[0].samples.iter().map(|s| s.time_s).collect();
    assert_eq!((found.len(), times), (1, vec![0.02, 0.03, 0.04]));
    let labels = |found: &[Recording]| -> Vec<(String, f64, f64)> {
        found[0].labels.iter().map(|l| (l.name.clone(), l.from_s, l.to_s)).collect()
    };
    let whole = ("pa".to_owned(), 0.02, 0.04);
    assert_eq!(labels(found), [("a".to_owned(), 0.02, 0.03), whole, ("b".to_owned(), 0.03, 0.04)]);
    // Rows that descend have the labels of rows that ascend.
    let rows: Vec<String> =
        (0..12).map(|t| row(0.01 * f64::from(t), ["a", "b", "a"][t as usize / 4], f64::from(t))).collect();
    let [ascending, descending] = [rows.concat(), rows.iter().rev().cloned().collect()]
        .map(|text: String| labels(&read(format!("{AAA}{text}").as_bytes(), "a.tsv")));
    assert_eq!((ascending.len(), &ascending), (4, &descending));
    // If all rows are given twice, there is one recording with one label.
    let whole = [row(0.01, "a", 1.0), row(0.02, "a", 2.0)].concat();
    let found = &read(format!("{AAA}{whole}{whole}").as_bytes(), "a.tsv");
    assert_eq!(
        (found.len(), found[0].samples.len(), found[0].labels.len()),
        (1, 2, 2),
        "{:?}",
        found[0].labels
    );
    assert!(found[0].notes[0].contains("line 4 on are given twice"), "{:?}", found[0].notes);
    // A copy under another name has the same frames; a recording of another speaker or with other times has not.
    let [copy, other, later] = ["s\td2\t", "t\td\t", "s\td\t1"].map(|start| {
        let rows = whole.replace("s\td\t", start);
        read(format!("{AAA}{rows}").as_bytes(), "b.tsv").remove(0)
    });
    let is_copy = [&copy, &other, &later].map(|one| found[0].has_frames_of(one));
    assert_eq!(is_copy, [true, false, false]);
    // Equal times with different coordinates show that two recordings are mixed.
    let odd = [row(0.03, "b", 3.0), row(0.03, "a", 5.0)].concat();
    let message = refused(format!("{AAA}{odd}").as_bytes(), "a.tsv");
    assert!(message.starts_with("a.tsv:3:") && message.contains("line 2"), "{message}");
    // Times within annotations start again with each annotation.
    let within = AAA.replace("in recording", "in annot");
    let text = [row(0.01, "a", 2.0), row(0.02, "a", 3.0), row(0.01, "b", 5.0)].concat();
    let found = read(format!("{within}{text}").as_bytes(), "a.tsv");
    assert_eq!(found.iter().map(|r| r.samples.len()).collect::<Vec<_>>(), [2, 1]);
}

#[test]
fn a_blank_spline_is_not_seen_and_rounded_repeats_of_a_row_are_one_frame() {
    // The second row ends before the columns of the spline.
    let text = format!("{AAA}s\td\t0.01\tpa\tx\t1\t2\t3\t4\ns\td\t0.02\tpa\tx\ns\td\t0.03\tpa\tx\t1\t2\t3\n");
    let found = &read(text.as_bytes(), "a.tsv")[0];
    let shown: Vec<usize> = found.samples.iter().map(|s| s.places.iter().flatten().count()).collect();
    assert_eq!(shown, [2, 0, 1]);
    assert!(found.notes[0].contains("2 rows of a.tsv") && found.notes[0].contains("line 3"));
    // AAA interpolates the row that two labels share again for each.
    let row = |time: f64, label: &str, x: f64| format!("s\td\t{time}\tpa\t{label}\t{x}\t2\t3\t4\n");
    for (later, moved) in [(0.0, 0.003), (3e-6, 0.0), (3e-6, 0.003)] {
        let text = row(0.01, "a", 1.0) + &row(0.02, "a", 2.0) + &row(0.02 + later, "b", 2.0 + moved);
        let found = &read(format!("{AAA}{text}{}", row(0.03, "b", 3.0)).as_bytes(), "a.tsv")[0];
        assert_eq!((found.samples.len(), found.labels.len()), (3, 3), "{:?}", found.labels);
    }
    let zero = [row(0.0, "a", 1.0), row(0.0, "a", 2.0), row(0.0, "a", 3.0)].concat();
    let message = refused(format!("{AAA}{zero}").as_bytes(), "a.tsv");
    assert!(
        message.starts_with("a.tsv:4:") && message.contains("all 3 rows of this recording have"),
        "{message}"
    );
    // An empty spline has only X0 and Y1.
    let odd = AAA.replace("\tX0 DLC_Tongue", "\tX0 Palate\tY1 Palate\tX0 DLC_Tongue");
    let text = |palate: &str| format!("{odd}s\td\t0.01\tpa\tx\t{palate}\t\t1\t2\t3\t4\n");
    assert_eq!(read(text("").as_bytes(), "a.tsv")[0].channels, ["tongue_0", "tongue_1"]);
    assert!(refused(text("5").as_bytes(), "a.tsv").starts_with("a.tsv:2:6: "), "a value is not dropped");
}

#[test]
fn the_unit_of_coils_is_found_from_their_distances() {
    let head = "EST_File Track\nDataType ascii\nNumFrames 1\nNumChannels 6\nBreaksPresent false\n";
    for (unit, mm) in [(1.4, "10 mm"), (1400.0, "0.01 mm"), (14.0, "1 mm")] {
        let channels = "Channel_0 tt_x\nChannel_1 tt_y\nChannel_2 tb_x\nChannel_3 tb_y\nChannel_4 td_x\nChannel_5 td_y\n";
        let text = format!("{head}{channels}EST_Header_End\n0 0 0 {unit} 0 {} 0\n", 2.0 * unit);
        let recording = aligned_recording(&read(text.as_bytes(), "a.ema")[0], "");
        assert!(near(recording.frames[0].sensors[2].map(|m| m.at), [0.028, 0.0]), "{mm}");
        assert!(recording.notes.iter().any(|n| n.contains(mm)), "{:?}", recording.notes);
    }
}

#[test]
fn a_map_is_written_for_every_format_and_read_again() {
    let odd = b"time_s,point,x_mm,y_mm\n0,\"odd \"\"name\"\" = [x]\",1,2\n0,tongue_0,3,4\n".to_vec();
    for (bytes, origin) in files().into_iter().chain([(odd, "t.csv")]) {
        let recording = &read(&bytes, origin)[0];
        let text = Map::template(recording);
        Map::from_toml(&text, "t.toml").unwrap_or_else(|e| panic!("{origin}: {e}\n{text}"));
        if let (Ok(with), Ok(without)) = (aligned(recording, &text), aligned(recording, "")) {
            let names = |aligned_recording: AlignedRecording| {
                (aligned_recording.contour, aligned_recording.sensors, aligned_recording.bones)
            };
            assert_eq!(names(with), names(without));
        }
        assert!(text.contains("[points]") && text.contains("half of the time within"));
    }
}

#[test]
fn faults_of_maps_are_told_with_their_line_and_the_right_word() {
    for (text, right) in [
        ("unit_cm = 1", "unit_mm"),
        ("noise = 1", "noise_mm"),
        ("[point]\nT1 = \"coil\"", "points"),
        ("[points]\nT1 = { surfce_mm = 3 }", "surface_mm"),
        ("[points]\nT1 = \"coyl\"", "coil"),
        ("[points]\nT1 = \"tip\"", "is not a role"),
        ("[points]\nT1 = 5", "\"contour\""),
        ("[points]\nT1 = { surface_mm = 1.0, bone = \"hyoid\" }", "one of"),
        ("[points]\nT1 = { coil = 0 }", "count the coils from the tip"),
        ("[points]\nT1 = { surface_mm = 300 }", "150"),
        ("scale = 3", "from 0.5 to 2"),
        ("turn_deg = 400", "from -180 to 180"),
        ("shift_mm = [1]", "shift_mm"),
        ("unit_mm = 1\nback = \"w\"", "the map m.toml:2: \"w\" is not one of the axes x, y, z"),
        ("noise_mm = 1e-4", "m.toml:1: noise_mm is 0.0001; it must be from 0.001 to 100"),
        ("back = \"x\"\nunit_mm = 1e-9", "m.toml:2: unit_mm is 0.000000001; it must be"),
        ("rate_hz = nan", "m.toml:1: rate_hz is NaN; it must be from"),
        ("[points]\nT1 = 3", "m.toml:2: "),
        ("[points]\nT1 = { surface_mm = \"x\" }", "string \"x\"; needed is a number in `surface_mm`; write"),
    ] {
        let message = Map::from_toml(text, "m.toml").unwrap_err().to_string();
        assert!(message.contains(right) && !message.contains("untagged"), "{text}: {message}");
    }
    let table = &read(b"time_s,point,x_mm,y_mm\n0,T1,1,2\n", "t.csv")[0];
    // A rate in the map contradicts the times of the file.
    for (map, expected) in
        [("[points]\nT2 = \"contour\"", "did you mean \"T1\""), ("rate_hz = 50", "own times")]
    {
        assert!(aligned(table, map).unwrap_err().contains(expected), "{map}");
    }
    // The scale, rotation and shift of a map are applied.
    let table = &read(b"time_s,point,x_mm,y_mm\n0,tongue_0,10,0\n0,tongue_1,0,10\n", "t.csv")[0];
    let recording = aligned_recording(table, "back = \"x\"\nscale = 2\nturn_deg = 90\nshift_mm = [1, 2]");
    assert!(near(recording.frames[0].contour[0].map(|m| m.at), [0.001, 0.022]), "{:?}", recording.frames);
    assert!(near(recording.frames[0].contour[1].map(|m| m.at), [-0.019, 0.002]));
}

/// A table of three coils in twenty frames; `name` is that of the coils, `time` the title of the time, and `z_up` says whether z points
/// upwards rather than y.
fn coils(name: &str, time: &str, z_up: bool) -> String {
    let titles = |n: usize| format!("\t{name}{n}_x\t{name}{n}_y\t{name}{n}_z");
    let mut text = format!("{time}{}\n", (1..4).map(titles).collect::<String>());
    for i in 0..20 {
        let place = |n: usize| {
            let phase = 0.4 * i as f64 + n as f64;
            let (side, up) = (0.3 * (7.0 * phase).sin(), 6.0 * phase.sin() + 20.0);
            let (y, z) = if z_up { (side, up) } else { (up, side) };
            format!("\t{:.4}\t{y:.4}\t{z:.4}", 15.0 * n as f64)
        };
        text += &format!("{:.3}{}\n", 0.01 * f64::from(i), (1..4).map(place).collect::<String>());
    }
    text
}

#[test]
fn the_axis_upwards_of_sensors_is_said_by_their_header_or_found_from_the_coils() {
    let aligned = |text: &str, map: &str| aligned(&read(text.as_bytes(), "coils.txt")[0], map);
    let height_mm =
        |recording: &AlignedRecording| recording.frames[0].sensors[0].map(|m| m.at.y * 1e3).unwrap();
    let up_mm = 6.0 * 1.0_f64.sin() + 20.0;
    for (z_up, axis) in [(true, "z is taken"), (false, "y is taken")] {
        let recording = aligned(&coils("T", "Time", z_up), "").unwrap();
        assert!((height_mm(&recording) - up_mm).abs() < 1e-3, "{z_up}: {}", height_mm(&recording));
        assert!(recording.notes.iter().any(|n| n.contains(axis)), "{:?}", recording.notes);
    }
    // z points upwards in Carstens's channels, y in NDI's.
    let points = "[points]\nsensor_1 = { coil = 1 }\nsensor_2 = \"coil\"\nsensor_3 = \"coil\"";
    for (name, time, z_up, map) in [("Ch", "Time", true, points), ("T", "Wav Time", false, "")] {
        let recording = aligned(&coils(name, time, z_up), map).unwrap();
        assert!(
            (height_mm(&recording) - up_mm).abs() < 1e-3 && recording.notes.is_empty(),
            "{:?}",
            recording.notes
        );
        // An upward axis along which coils hardly differ is refused unless a map states it.
        crate::fixtures::says(aligned(&coils(name, time, !z_up), map), "hardly differ; in a map");
    }
    let recording = aligned(&coils("T", "Time", true), "up = \"y\"").unwrap();
    assert!(recording.notes.iter().any(|n| n.contains("hardly differ")), "{:?}", recording.notes);
}

#[test]
fn times_that_step_back_between_others_begin_a_recording_and_descending_rows_are_read_in_order() {
    let head = "Time of sample in recording\tX0 DLC_Tongue\tY0 DLC_Tongue\n";
    let table = |times: &[f64], at: f64| -> String {
        times.iter().map(|t| format!("{t:.3}\t{:.3}\t{:.3}\n", at + 9.0 * t, at)).collect()
    };
    let times: Vec<f64> = (1..8).map(|i| 0.01 * f64::from(i)).collect();
    let frames = |text: &str| {
        let found = read(format!("{head}{text}").as_bytes(), "a.tsv");
        assert!(found.iter().all(|r| r.samples.is_sorted_by(|a, b| a.time_s < b.time_s)));
        let counts: Vec<usize> = found.iter().map(|r| r.samples.len()).collect();
        (counts, found.into_iter().flat_map(|r| r.notes).collect::<Vec<_>>().join("; "))
    };
    for lag in [0.0, 0.004, -0.003] {
        let later: Vec<f64> = times.iter().map(|t| t + lag).collect();
        let (counts, message) = frames(&(table(&times, 10.0) + &table(&later, 15.0)));
        assert_eq!(counts, [7, 7], "{lag}");
        assert!(message.contains("step back at line 9") && message.contains("date"), "{message}");
    }
    let reversed: Vec<f64> = times.iter().rev().copied().collect();
    let (counts, message) = frames(&table(&reversed, 10.0));
    assert!(counts == [7] && message.contains("descend"), "{counts:?} {message}");
    let mixed: Vec<f64> = [2, 0, 1, 4, 3, 6, 5].map(|i| times[i]).to_vec();
    assert_eq!(frames(&table(&mixed, 10.0)), (vec![7], String::new()));
    // If rows have date and time of the recording, equal times must have been rounded.
    let row = |x: f64| format!("s\t29/11/2016 15:10:52\t0.7\tpa\tx\t{x}\t2\t3\t4\n");
    let message = refused(format!("{AAA}{}{}", row(1.0), row(5.0)).as_bytes(), "a.tsv");
    assert!(message.contains("rounded or repeated"), "{message}");
}

#[test]
fn places_at_the_origin_are_not_seen_where_the_point_is_elsewhere_otherwise() {
    let row = |t: usize, x: f64, y: f64| format!("s\td\t{t}\tpa\tx\t{x}\t{y}\t0\t0\n");
    let text = [row(1, 10.0, 20.0), row(2, 0.0, 0.0), row(3, 11.0, 21.0)].concat();
    let found = &read(format!("{AAA}{text}").as_bytes(), "a.tsv")[0];
    let seen: Vec<[bool; 2]> = found.samples.iter().map(|s| [0, 1].map(|c| s.places[c].is_some())).collect();
    assert_eq!(seen, [[true, true], [false, true], [true, true]], "an origin of the frame is a place");
    assert!(found.notes[0].contains("(tongue_0)"), "{:?}", found.notes);
}

#[test]
fn many_short_recordings_and_many_frames_of_one_point_are_too_large_for_a_file() {
    let table = |rows: &mut dyn Iterator<Item = String>| {
        let text = "recording,time_s,point,x_mm,y_mm\n".to_owned() + &rows.collect::<String>();
        Recording::from_bytes(text.as_bytes(), "input.csv", Some(Format::Tidy)).map(|r| r.len())
    };
    let short = |count: usize| table(&mut (0..count).map(|n| format!("r{n},0,p,1,2\n")));
    assert_eq!(short(50_000), Ok(50_000));
    assert!(short(60_000).unwrap_err().to_string().contains("a recording counts as 40 more"));
    let long = |count: usize| table(&mut (0..count).map(|n| format!("r{},{n},p,1,2\n", n / 90_000)));
    assert!(long(900_000).unwrap_err().to_string().contains("a frame as 2"));
}

#[test]
fn a_likelihood_in_percent_is_refused_with_its_place() {
    let table = |likelihood: f64| {
        let text =
            format!("scorer,n,n,n\nbodyparts,hyoid,hyoid,hyoid\ncoords,x,y,likelihood\n0,1,2,{likelihood}\n");
        Recording::from_bytes(text.as_bytes(), "a.csv", None).map(|found| found[0].samples.len())
    };
    // A negative likelihood marks a point that was not detected.
    assert_eq!((table(1.000_001), table(-1.0)), (Ok(1), Ok(1)));
    for likelihood in [3.0, 99.0] {
        let message = table(likelihood).unwrap_err().to_string();
        assert!(
            message.starts_with("a.csv:4:4: the likelihood of hyoid is") && message.contains("not of 100"),
            "{message}"
        );
    }
}

#[test]
fn files_that_are_cut_in_their_last_number_are_doubted_and_whole_ones_are_not() {
    let rows = |row: &dyn Fn(i32) -> String| (10..40).map(row).collect::<String>();
    let tidy = rows(&|f| format!("{f},tongue_1,3{f}.1234567,2{f}.765432\n"));
    let dlc = rows(&|f| format!("{f},1{f}.25,80.5,0.987654321\n"));
    let aaa = rows(&|f| format!("1,{f}\t3{f},1234\t4{f},567\n"));
    for (name, text, cut) in [
        ("a.txy", rows(&|f| format!("{}{}\n", 6866 * f, "\t-20431\t15017".repeat(8))), 3),
        ("a.ema", rows(&|f| format!("0.{f} 1{}\n", " -2043.5 1501.25".repeat(10))), 2),
        ("a.con", rows(&|f| format!("3{f}.125\t41.500\t3{f}.250\t40.875\n")), 2),
        ("a.csv", format!("time_s,point,x_mm,y_mm\n{tidy}"), 3),
        ("a.csv", format!("scorer,n,n,n\nbodyparts,hyoid,hyoid,hyoid\ncoords,x,y,likelihood\n{dlc}"), 5),
        ("a.txt", format!("Time of sample in recording\tX0 DLC_Tongue\tY0 DLC_Tongue\n{aaa}"), 2),
    ] {
        let found = |end: usize| Recording::from_bytes(&text.as_bytes()[..end], name, None);
        for whole in [text.len(), text.len() - 1] {
            assert_eq!(found(whole).unwrap()[0].notes, [""; 0], "{name}");
        }
        let message =
            found(text.len() - cut).map_or_else(|e| e.to_string(), |found| found[0].notes[0].clone());
        assert!(message.contains("cut off"), "{name}: {message}");
    }
    let whole = format!("{AAA}{0}0.01{1}\n{0}0.02{1}", "s\td\t", "\tpa\tx\t10.55\t20.55\t30.25\t40.25");
    assert_eq!(read(whole.as_bytes(), "a.tsv")[0].samples.len(), 2);
    for cut in [1, 2, 3, 8, 14] {
        let message = refused(&whole.as_bytes()[..whole.len() - cut], "a.tsv");
        assert!(message.starts_with("a.tsv:3:") && message.contains("cut off"), "{cut}: {message}");
    }
}

/// A WAV file of two channels at 10 kHz; the second one is louder.
fn wav(bits: u16, samples: &[f32]) -> Vec<u8> {
    let (bytes, is_float) = (usize::from(bits / 8), bits == 32);
    let mut data: Vec<u8> = Vec::new();
    for sample in samples.iter().flat_map(|first| [*first, 0.9]) {
        let whole = (sample * 2f32.powi(i32::from(bits) - 1)) as i32;
        let little = if is_float { sample.to_le_bytes() } else { whole.to_le_bytes() };
        data.extend(&little[..bytes]);
    }
    let mut out = b"RIFF".to_vec();
    out.extend((36 + data.len() as u32).to_le_bytes());
    out.extend(b"WAVEfmt \x10\0\0\0");
    out.extend([if is_float { 3_u16 } else { 1 }, 2].map(u16::to_le_bytes).concat());
    out.extend([10_000, 20_000 * bytes as u32].map(u32::to_le_bytes).concat());
    out.extend([2 * bytes as u16, bits].map(u16::to_le_bytes).concat());
    out.extend(b"data");
    out.extend((data.len() as u32).to_le_bytes());
    out.extend(data);
    out
}

#[test]
fn bins_of_a_sound_have_the_ends_of_its_first_channel() {
    // A bin has 20 samples.
    let samples: Vec<f32> =
        (0..110).map(|i| 0.01 * (i / 20) as f32 * if i % 2 == 0 { 1.0 } else { -0.5 }).collect();
    for bits in [16, 24, 32] {
        let file = wav(bits, &samples);
        let found = Waveform::of_wav(&file).unwrap();
        assert_eq!(found.ends.len(), 5);
        for (k, [low, high]) in found.ends.iter().enumerate() {
            let expected = 0.01 * k as f32;
            assert!((high - expected).abs() < 1e-3 && (low + 0.5 * expected).abs() < 1e-3, "{found:?}");
        }
        assert!(Waveform::of_wav(&file[..file.len() / 2]).map_or(true, |half| half.ends.len() < 5));
    }
    assert!(Waveform::of_wav(b"RIFF").is_err());
}
