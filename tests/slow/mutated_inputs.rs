//! Valid inputs of every kind with some changed bytes or numbers end in a value or an error, without panic or hang. About 1300 are tested;
//! `TONGUE_FIT_MUTATIONS=15000` tests 25 times as many, and `TONGUE_FIT_MUTATED=recording` only kinds whose name contains this word.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use fastrand::Rng;
use tongue_fit::body::Body;
use tongue_fit::body::json::MeshRecord;
use tongue_fit::system::Model;

use crate::fixtures::lattice;
use crate::inputs::{KINDS, NEXT_FILE};

/// Time after which an input counts as hanging; the slowest takes a second.
const HANGS: Duration = Duration::from_secs(300);
const NUMBERS: &str = "0 -0.0 -1 1 1e-320 4.9e-324 1e-12 1e308 1e400 nan inf 99999999999 1.5 0x7f";

fn seeds(kind: &str) -> Vec<Vec<u8>> {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/");
    let files = |folder: &str, ends: &str| -> Vec<Vec<u8>> {
        let mut paths: Vec<_> =
            std::fs::read_dir(format!("{root}{folder}")).unwrap().map(|e| e.unwrap().path()).collect();
        paths.retain(|p| p.to_str().unwrap().ends_with(ends));
        paths.sort();
        paths.iter().map(|p| std::fs::read(p).unwrap()).collect()
    };
    match kind {
        // Tables are spelt as several spreadsheets write them.
        "lengths_csv" => {
            let table = include_str!("../../targets/takano2007_lengths.csv");
            let german = table.replace(',', ";").replace("47;", "47,5;").replace('\n', "\r\n");
            let utf16 = format!("\u{feff}{}", german.replace(';', "\t"));
            let half_widths = table.replace("vowel,", "vowel,half_width_mm,").replace("a,", "a,0.5,");
            let utf16 = utf16.encode_utf16().flat_map(u16::to_le_bytes).collect();
            vec![table.into(), format!("\u{feff}{german}").into(), utf16, half_widths.into()]
        }
        "anatomy_toml" => files("targets", "anatomy.toml"),
        "tension_curves" => vec![b"time_s,row\n0,0\n0.01,5\n0.02,1.5e0\n0.04,0\n".to_vec()],
        "scene_toml" => files("targets/scenes", ".toml"),
        "mesh_json" => {
            let body = Body::new("a lattice", lattice(5, 4, 5e-3));
            let record = MeshRecord::of(&body, &Model::default()).unwrap();
            vec![serde_json::to_vec(&record).unwrap()]
        }
        "gmsh_msh" => [files("tests/gmsh", ".msh"), files("tests/gmsh/broken", ".msh")].concat(),
        "recording" => {
            let aaa = files("targets/recordings", "synthetic.tsv").into_iter().map(|text| lines(&text, 6));
            let more: [&[u8]; 3] = [
                b"recording,time_s,point,x_mm,y_mm,sigma_mm\na,0,tongue_0,1,2,0.5\na,0,tongue_1,5,6,\na,0.1,tongue_0,*,2,\n",
                b"10\t20\t11\t21\n12 22 13 23\n15\t25\t0\t0\n18\t27\tNaN\t28\n",
                b"version: 1\nn_points: 3\n{\n250.5 300\n210 190.5\n130 160\n}\n",
            ];
            let every = crate::recordings::files().map(|(bytes, _)| bytes);
            every.into_iter().chain(aaa).chain(more.map(<[u8]>::to_vec)).collect()
        }
        "recording_map" => vec![
            b"unit_mm = 10.0\nrate_hz = 60\nback = \"-x\"\nup = \"y\"\nnoise_mm = 0.5\n[points]\nT1 = { surface_mm = 8.0, noise_mm = 1 }\nT2 = \"contour\"\nhyoid = { bone = \"hyoid\" }\n".to_vec(),
        ],
        "landmarks" => vec![
            b"point,x_mm,y_mm\nmental_spine,0,0\nhyoid,37.6,-3.1\ntongue_0,46,10\n".to_vec(),
            br#"{"markups":[{"type":"Fiducial","coordinateSystem":"LPS","coordinateUnits":"mm","controlPoints":[{"label":"hyoid","position":[0.0,37.6,-3.1],"positionStatus":"defined"}]},{"type":"Curve","coordinateSystem":"RAS","controlPoints":[{"label":"","position":[0,-46,10]}]}]}"#.to_vec(),
            br#"{"adaptation":{"rest":"joint","marks_m":{"hyoid":[0.03,0.0]},"scale_n":20,"muscles":["GGa"],"mean":[0.1],"covariance":[[0.5]]}}"#.to_vec(),
        ],
        "space_marks" => vec![
            b"node,x_mm,y_mm,z_mm\n1,0,1,2\n2,3.5,4,5e0\n".to_vec(),
            b"muscle,ratio,over,sd_mm\nGGP,1.2,GGA,1\n".to_vec(),
            b"surface_mm,x_mm,z_mm\n8,-3,30\n".to_vec(),
            b"# two frames\ntime_s,node,x_mm,y_mm,z_mm,sd_mm\n0,1,1,2,3,0.5\n0,7,1,2,3,0.5\n0.1,1,1,2,3,1\n".to_vec(),
        ],
        "artisynth" => {
            let f = crate::fixtures::artisynth::files();
            let all = [f.nodes, f.elements, f.muscles, f.fibres, f.strengths, f.jaw, f.hyoid];
            vec![all.map(|text| text.text).join(NEXT_FILE).into_bytes()]
        }
        other => panic!("no input of kind {other}"),
    }
}

fn lines(text: &[u8], count: usize) -> Vec<u8> {
    text.split_inclusive(|b| *b == b'\n').take(count).flatten().copied().collect()
}

/// A few changes: bytes flipped, replaced, inserted or removed, pieces doubled, numbers replaced by unusual ones.
fn mutate(input: &[u8], rng: &mut Rng) -> Vec<u8> {
    let mut bytes = input.to_vec();
    for _ in 0..rng.usize(1..=4) {
        let at = rng.usize(0..bytes.len().max(1)).min(bytes.len().saturating_sub(1));
        let end = (at + rng.usize(1..40)).min(bytes.len());
        match rng.u8(0..8) {
            _ if bytes.is_empty() => bytes.push(rng.u8(..)),
            0 => bytes[at] ^= 1 << rng.u8(0..8),
            1 => bytes[at] = *rng.choice(b"\0\n\r\t ,;\"'=[]{}-+.eE#9\xff").unwrap(),
            2 => bytes.insert(at, rng.u8(..)),
            3 => drop(bytes.drain(at..end)),
            4 => drop(bytes.splice(at..at, bytes[at..end].to_vec())),
            5 => bytes.truncate(at),
            // A number is replaced.
            _ => {
                let is_part = |b: &u8| b.is_ascii_digit() || b".eE+-".contains(b);
                let Some(start) = bytes[at..].iter().position(u8::is_ascii_digit).map(|n| at + n) else {
                    continue;
                };
                let length = bytes[start..].iter().position(|b| !is_part(b)).unwrap_or(bytes.len() - start);
                let other = rng.choice(NUMBERS.split(' ').collect::<Vec<_>>()).unwrap().bytes();
                bytes.splice(start..start + length, other);
            }
        }
    }
    bytes
}

#[test]
fn mutated_inputs_end_in_a_value_or_an_error() {
    let all: usize = std::env::var("TONGUE_FIT_MUTATIONS").map_or(600, |n| n.parse().unwrap());
    let word = std::env::var("TONGUE_FIT_MUTATED").unwrap_or_default();
    let kinds: Vec<_> = KINDS.into_iter().filter(|(kind, _)| kind.contains(&word)).collect();
    // Tables of lengths and Gmsh meshes are tried ten times as often as other inputs, because users write most of these, and recordings
    // five times as often, because they have many formats.
    let each = move |kind: &str| {
        let times = match kind {
            "lengths_csv" | "gmsh_msh" => 10,
            "recording" => 5,
            _ => 1,
        };
        all / 15 * times
    };
    let expected: usize = kinds.iter().map(|(kind, _)| each(kind)).sum();
    let (report, reports) = channel();
    let worker = std::thread::spawn(move || {
        for (number, (kind, hold)) in kinds.into_iter().enumerate() {
            let seeds = seeds(kind);
            assert!(!seeds.is_empty(), "{kind}");
            seeds.iter().for_each(|seed| hold(seed));
            for n in 0..each(kind) {
                let mut rng = Rng::with_seed((n * KINDS.len() + number) as u64);
                let input = mutate(&seeds[n % seeds.len()], &mut rng);
                report.send(format!("{kind} {n}: {:?}", String::from_utf8_lossy(&input))).unwrap();
                hold(&input);
            }
        }
    });
    let (mut count, mut last) = (0, String::new());
    loop {
        match reports.recv_timeout(HANGS) {
            Ok(input) => (count, last) = (count + 1, input),
            Err(RecvTimeoutError::Timeout) => panic!("this input hangs: {last}"),
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    assert!(worker.join().is_ok(), "{last}");
    assert_eq!(count, expected);
}
