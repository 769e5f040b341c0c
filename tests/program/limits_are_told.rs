//! What would take very long or very much memory is announced or refused before the work, and so are numbers that are out of range.
#![cfg(unix)]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Stdio;
use std::time::Instant;

use super::run::{json, program, refused, run, shell};

/// Runs a command until it has printed all these parts on stderr, and stops it there.
fn stopped_when_told(folder: &Path, line: &str, parts: &[&str]) {
    let mut child = program(folder, line).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let mut told = String::new();
    let is_told = BufReader::new(child.stderr.take().unwrap()).lines().any(|next| {
        told += &next.unwrap();
        parts.iter().all(|part| told.contains(part))
    });
    let _ = child.kill();
    child.wait().unwrap();
    assert!(is_told, "{line}: {told}");
}

#[test]
fn a_high_poisson_ratio_is_noted_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let printed = shell(folder.path(), "$TONGUE_FIT simulate --direct --poisson-ratio 0.49995").out;
    let lines: Vec<&str> = printed.lines().collect();
    assert!(lines[0].starts_with("--poisson-ratio 0.49995: the bulk modulus is 1e4 times"), "{printed}");
    assert!(lines[1].starts_with("| muscle"), "{printed}");
    assert_eq!(run(folder.path(), "simulate --direct --poisson-ratio 0.499").err, "");
}

/// Every row has its own time and point, so that a table of all points at all times would have a hundred million places.
#[test]
fn a_small_recording_of_many_places_needs_little_memory() {
    let folder = tempfile::tempdir().unwrap();
    let row = |n: usize| format!("{},p{n},{},{}\n", n as f64 / 100.0, n % 40, n % 30);
    let table: String = (0..10_000).map(row).collect();
    fs::write(folder.path().join("sparse.csv"), format!("time_s,point,x_mm,y_mm\n{table}")).unwrap();
    let clock = Instant::now();
    // Kilobytes of address space, which include the program and the stacks of its threads.
    let done =
        shell(folder.path(), "ulimit -v 1000000; $TONGUE_FIT track sparse.csv --threads 1 --out track");
    assert!(done.status == Some(1) && done.out.starts_with("error: sparse.csv"), "{}", done.out);
    assert!(done.out.contains("places"), "{}", done.out);
    assert!(clock.elapsed().as_secs() < 60);
}

#[test]
fn numbers_that_would_need_too_much_memory_are_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let tract = include_str!("../../targets/tract.toml");
    let tract = tract.replacen("root_mm = [47.02", "root_mm = [4294967296.0", 1);
    fs::write(folder.path().join("tract.toml"), tract).unwrap();
    let wide = include_str!("../../targets/tract.toml").replacen("alpha = [2.52", "alpha = [4294967296.0", 1);
    fs::write(folder.path().join("wide.toml"), wide).unwrap();
    fs::write(folder.path().join("coil.csv"), "surface_mm,x_mm,z_mm\n10,1000000,0\n").unwrap();
    for (line, said) in [
        ("simulate --h 0.4mm --body continuum", "the number of elements of the continuum is 35"),
        ("sound --vowel a --tract tract.toml", "a coordinate is 4294967296"),
        ("sound --vowel a --tract wide.toml", "alpha of wall `larynx` is 4294967296; it is at most 20"),
        ("track coil.csv --body space", "x_mm: a coordinate is 1000000 mm"),
    ] {
        let done = shell(folder.path(), &format!("ulimit -v 1000000; $TONGUE_FIT {line} --threads 1"));
        assert!(done.status == Some(1) && done.out.contains(said), "{line}: {}", done.out);
    }
    json(folder.path(), "simulate --tension GGa=1 --poisson-ratio -0.5 --body continuum --json");
}

#[test]
fn what_takes_longer_than_a_minute_is_told_before_and_what_needs_too_much_memory_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let message = refused(folder.path(), "simulate --tension GGa=1 --h 0.21mm --threads 1");
    assert!(
        message.contains("give 0.22 to 15.0 mm (is it in millimetres? finer meshes need over 1 GB"),
        "{message}"
    );
    let block = |want: &str, size_mm: [f64; 3], h_mm: f64| {
        format!("title = \"t\"\nwant = \"{want}\"\n[body.block]\nsize_mm = {size_mm:?}\nh_mm = {h_mm}\n")
    };
    let thin = block("trajectory", [7.0, 51.0, 41.0], 1.5);
    fs::write(folder.path().join("thin.toml"), thin + "[trajectory]\nduration_s = 0.5\n").unwrap();
    fs::write(folder.path().join("cube.toml"), block("shape", [42.0; 3], 2.0)).unwrap();
    let message = refused(folder.path(), "scene run cube.toml");
    assert!(message.contains("over 1 GB of memory"), "{message}");
    for (line, said) in [
        ("--vowel a --h 1mm", "a fit with its verdict on a body of"),
        ("--vowel a --method gauss-newton --posterior 100000", "--posterior 100000: about"),
        ("batch --h 1mm", "fits on a body of"),
        ("scene run thin.toml", "nodes: about"),
    ] {
        stopped_when_told(folder.path(), &format!("{line} --threads 1"), &[said, "minutes on one core"]);
    }
    // The stated time of one core does not depend on the number of threads.
    let fits = "fits on a body of 2998 nodes: about 3 minutes on one core";
    stopped_when_told(folder.path(), "batch --h 1mm --threads 3", &[fits]);
    let load = "minutes or more if the load is too large";
    stopped_when_told(folder.path(), "simulate --h 0.6mm --tension SGp=1", &[load]);
}
