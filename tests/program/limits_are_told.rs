//! What would take very long or very much memory is said before the work, and numbers that cannot be meant are refused.
#![cfg(unix)]

use std::fs;
use std::time::Instant;

use super::run::{json, refused, run, shell};

#[test]
fn a_fine_mesh_and_a_high_poisson_ratio_are_noted_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let printed = shell(folder.path(), "$TONGUE_FIT simulate --direct --h 0.5mm --poisson-ratio 0.49995").out;
    let lines: Vec<&str> = printed.lines().collect();
    assert!(
        lines[0].starts_with("the mesh has ") && lines[0].contains("a larger --h is faster"),
        "{printed}"
    );
    assert!(lines[1].starts_with("--poisson-ratio 0.49995: the bulk modulus is 1e4 times"), "{printed}");
    assert!(lines[2].starts_with("| muscle"), "{printed}");
    assert_eq!(run(folder.path(), "simulate --direct --poisson-ratio 0.499").err, "");
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
    let done =
        shell(folder.path(), "ulimit -v 1000000; $TONGUE_FIT track sparse.csv --threads 1 --out track");
    assert!(done.status == Some(1) && done.out.starts_with("error: sparse.csv"), "{}", done.out);
    assert!(done.out.contains("places"), "{}", done.out);
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
        let told = refused(folder.path(), "track coils.csv --map m.toml");
        assert!(told.contains(said) && !told.contains("untagged"), "{map}: {told}");
    }
}

#[test]
fn numbers_that_would_need_too_much_memory_are_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let tract = include_str!("../../targets/tract.toml");
    fs::write(
        folder.path().join("tract.toml"),
        tract.replacen("root_mm = [47.02", "root_mm = [4294967296.0", 1),
    )
    .unwrap();
    fs::write(folder.path().join("coil.csv"), "surface_mm,x_mm,z_mm\n10,1000000,0\n").unwrap();
    for (line, said) in [
        ("batch --draws 18446744073709551615", "--draws is 18446744073709552000; it must be from 0 to 10000"),
        ("batch --draws 99999999", "--draws is 99999999; it must be from 0 to 10000"),
        ("--vowel a --posterior 1000000", "--posterior is 1000000 draws; it must be from 100 to 200000"),
        ("simulate --h 0.4mm --body continuum", "the number of elements of the continuum is 35"),
        ("sound --vowel a --tract tract.toml", "a coordinate is 4294967296"),
        ("track coil.csv --body space", "x_mm: a coordinate is 1000000 mm"),
    ] {
        let done = shell(folder.path(), &format!("ulimit -v 1000000; $TONGUE_FIT {line} --threads 1"));
        assert!(done.status == Some(1) && done.out.contains(said), "{line}: {}", done.out);
    }
    json(folder.path(), "simulate --tension GGa=1 --poisson-ratio -0.5 --body continuum --json");
}

#[test]
fn a_body_in_space_that_is_strained_too_far_is_an_alarm() {
    let folder = tempfile::tempdir().unwrap();
    let done = run(folder.path(), "simulate --body space --activation GGP=1 --direct --json");
    let record = done.record();
    let alarm = record["alarms"].as_array().unwrap().iter().find(|a| a["kind"] == "overstrained").unwrap();
    assert!(done.status == Some(3) && alarm["text"].as_str().unwrap().contains("volume at rest"), "{alarm}");
}
