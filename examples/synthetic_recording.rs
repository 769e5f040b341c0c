//! Makes a recording in AAA's export format: keypoints of a simulated tongue with the noise of DeepLabCut.
//! The true tensions are written beside it. It made the files in `targets/recordings`.
//!
//!     cargo run --example synthetic_recording [FOLDER]
#![allow(clippy::print_stdout, reason = "a program says what it found")]

use std::error::Error;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

use tongue_fit::geometry::Point;
use tongue_fit::prelude::*;
use tongue_fit::track::TongueSurface;

/// Frames per second, and number of frames of each of the two recordings.
const RATE_HZ: f64 = 80.0;
const FRAMES: usize = 45;
/// Standard deviation of every keypoint along each axis, mm.
const NOISE_MM: f64 = 0.93;
/// Origin of the speaker's frame in the image, mm; the face looks to the right in the image.
const ORIGIN_MM: [f64; 2] = [95.0, 25.0];

/// Tensions of GGa, GGm, GGp, SGp, SGm, SGa, HGa, HGp at a time, N per metre of thickness: three gestures added to a constant tone.
fn tensions(recording: usize, time_s: f64) -> [f64; 8] {
    let bump = |at: f64, width: f64| (-0.5 * ((time_s - at) / width).powi(2)).exp();
    let shift = 0.06 * recording as f64;
    let (open, front, back) = (bump(0.12 + shift, 0.05), bump(0.3 - shift, 0.06), bump(0.44 + shift, 0.05));
    let wave = 0.5 + 0.5 * (TAU * 1.7 * time_s).sin();
    [
        4.0 + 10.0 * open + 6.0 * back,
        5.0 + 14.0 * back,
        4.0 + 30.0 * front,
        5.0 + 16.0 * back,
        4.0 + 8.0 * open,
        3.0 + 6.0 * front * wave,
        4.0 + 22.0 * open,
        4.0 + 6.0 * wave,
    ]
}

/// Label of the gesture at a time, in both recordings.
fn label(time_s: f64) -> &'static str {
    if time_s < 0.21 {
        "a"
    } else if time_s < 0.37 {
        "i"
    } else {
        "u"
    }
}

/// Normal noise, mm (Box and Muller 1958).
fn noise(rng: &mut fastrand::Rng) -> Point {
    let radius = NOISE_MM * (-2.0 * (1.0 - rng.f64()).ln()).sqrt();
    let angle = TAU * rng.f64();
    Point::new(radius * angle.cos(), radius * angle.sin())
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args()
        .nth(1)
        .unwrap_or_else(|| std::env::temp_dir().join("tongue-fit").display().to_string());
    let body = Body::tongue(5.5 * MM)?;
    let names = body.mesh.muscle_names();
    let model = Assembly::new(&Model::default(), &body, &names)?;
    let surface = TongueSurface::of(&body).ok_or("the tongue has no outline")?;
    // Eleven keypoints from above the vallecula to the tip, denser towards the tip as those of DeepLabCut.
    let places: Vec<f64> = (0..11)
        .map(|i| f64::from(i) / 10.0)
        .map(|u| 10.0 * MM + (surface.tip - 12.0 * MM) * (1.45 * u - 0.45 * u * u))
        .collect();
    let mut rng = fastrand::Rng::with_seed(20261121);

    let mut header =
        "Client family name\tDate Time of recording\tTime of sample in recording\tPrompt".to_owned();
    for i in 0..11 {
        write!(header, "\tX{i} DLC_Tongue\tY{i} DLC_Tongue")?;
    }
    for spline in ["HyoidMandible", "ShorttendonMandible"] {
        write!(header, "\tX0 DLC_{spline}\tY0 DLC_{spline}\tX1 DLC_{spline}\tY1 DLC_{spline}")?;
    }
    let mut table = header + "\tAnnotation Title\n";
    let mut truth = format!("recording,time_s,{}\n", names.join(","));
    for (recording, prompt) in ["synthetic one", "synthetic two"].into_iter().enumerate() {
        let date = format!("21/11/2026 12:00:0{recording}");
        for frame in 0..FRAMES {
            let time_s = frame as f64 / RATE_HZ;
            let pull = tensions(recording, time_s);
            let given: Vec<(&str, f64)> = names.iter().map(String::as_str).zip(pull).collect();
            // The jaw opens and the hyoid follows.
            let open = 0.5 - 0.5 * (TAU * 2.2 * time_s).cos();
            let jaw = Point::new(1.2 * open, -2.5 * open) * MM;
            let hyoid = Point::new(0.6 * open, -open) * MM;
            let mut solver = model.solver();
            solver.shift_bone("mental_spine", jaw)?;
            solver.shift_bone("hyoid", hyoid)?;
            let shape = solver.equilibrium(&given)?;
            assert!(shape.is_converged(), "no equilibrium at {time_s} s");
            let at = |place: f64| -> Point {
                surface.curve.weights(place).iter().map(|(n, w)| shape.positions()[*n] * *w).sum()
            };
            let bone = |name: &str| tongue_fit::adapt::mark_of(&body, name).ok_or("no such bone");
            let (hyoid, spine) = (bone("hyoid")? + hyoid, bone("mental_spine")? + jaw);
            let mandible = spine + Point::new(-2.0, -9.0) * MM;
            let mut points: Vec<Point> = places.iter().map(|p| at(*p)).collect();
            points.extend([hyoid, mandible, spine, mandible]);
            write!(table, "synthetic\t{date}\t{time_s:.4}\t{prompt}")?;
            let mut seen: Vec<Point> = points.iter().map(|p| p / MM + noise(&mut rng)).collect();
            seen[14] = seen[12];
            for p in seen {
                write!(table, "\t{:.4}\t{:.4}", ORIGIN_MM[0] - p.x, ORIGIN_MM[1] + p.y)?;
            }
            writeln!(table, "\t{}", label(time_s))?;
            writeln!(
                truth,
                "synthetic {date} {prompt},{time_s:.4},{}",
                pull.map(|t| format!("{t:.3}")).join(",")
            )?;
        }
    }
    std::fs::create_dir_all(&folder)?;
    for (name, text) in [("synthetic.tsv", table), ("synthetic_tensions.csv", truth)] {
        let path = Path::new(&folder).join(name);
        std::fs::write(&path, text)?;
        println!("wrote {}", path.display());
    }
    Ok(())
}
