//! What would take very long or very much memory is said before the work, and numbers that cannot be meant are refused.
#![cfg(unix)]

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use assert_cmd::cargo::cargo_bin;

/// Status and everything that a line of the shell prints.
fn run(folder: &Path, line: &str) -> (Option<i32>, String) {
    let mut command = Command::new("sh");
    command.args(["-c", &format!("{line} 2>&1")]).current_dir(folder);
    let output = command.env("TONGUE_FIT", cargo_bin("tongue-fit")).output().unwrap();
    (output.status.code(), String::from_utf8(output.stdout).unwrap())
}

#[test]
fn a_fine_mesh_and_a_high_poisson_ratio_are_noted_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let (status, printed) =
        run(folder.path(), "\"$TONGUE_FIT\" simulate --direct --h 0.5mm --poisson-ratio 0.49995");
    assert_eq!(status, Some(0), "{printed}");
    let lines: Vec<&str> = printed.lines().collect();
    assert!(
        lines[0].starts_with("the mesh has ") && lines[0].contains("a larger --h is faster"),
        "{printed}"
    );
    assert!(lines[1].starts_with("--poisson-ratio 0.49995: the bulk modulus is 1e4 times"), "{printed}");
    assert!(lines[2].starts_with("| muscle"), "{printed}");
    let (_, printed) = run(folder.path(), "\"$TONGUE_FIT\" simulate --direct --poisson-ratio 0.499");
    assert!(printed.starts_with("| muscle"), "{printed}");
}

/// Every row has a time and a point of its own, so that a table of all points at all times has a hundred million places.
#[test]
fn a_small_recording_of_many_places_needs_little_memory() {
    let folder = tempfile::tempdir().unwrap();
    let row = |n: usize| format!("{},p{n},{},{}\n", n as f64 / 100.0, n % 40, n % 30);
    let table: String = (0..10_000).map(row).collect();
    fs::write(folder.path().join("sparse.csv"), format!("time_s,point,x_mm,y_mm\n{table}")).unwrap();
    let clock = Instant::now();
    // Kilobytes of address space, the program and the stacks of its threads among them.
    let (status, printed) =
        run(folder.path(), "ulimit -v 1000000; \"$TONGUE_FIT\" track sparse.csv --threads 1 --out track");
    assert_eq!(status, Some(1), "{printed}");
    assert!(printed.starts_with("error: sparse.csv") && printed.contains("places"), "{printed}");
    assert!(clock.elapsed().as_secs() < 60);
}

#[test]
fn a_map_of_numbers_that_cannot_be_meant_is_refused_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("coils.csv"), "time_s,point,x_mm,y_mm\n0,T1,-5.6,37.5\n").unwrap();
    for (map, said) in [
        ("noise_mm = 1e-300", "m.toml:1: noise_mm is 1e-300; it must be from 0.001 to 100"),
        ("back = \"x\"\nunit_mm = 1e-300", "m.toml:2: unit_mm is 1e-300; it must be"),
        ("rate_hz = nan", "m.toml:1: rate_hz is NaN; it must be from"),
        ("[points]\nT1 = 3", "m.toml:2: "),
        ("[points]\nT1 = { surface_mm = \"x\" }", "m.toml:2: T1: surface_mm is \"x\"; give a number"),
    ] {
        fs::write(folder.path().join("m.toml"), map).unwrap();
        let (status, printed) =
            run(folder.path(), "\"$TONGUE_FIT\" track coils.csv --map m.toml --out track");
        assert!(status == Some(1) && printed.contains(said), "{map}: {printed}");
        assert!(!printed.contains("untagged") && printed.lines().count() == 1, "{map}: {printed}");
    }
}
