//! A batch cut into shards and merged is the same batch. A missing or unfinished shard is named, and nothing
//! is written.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use assert_cmd::cargo::CommandCargoExt;

const BATCH: [&str; 3] = ["batch", "--subjects", "S2,S3"];

/// Runs in `folder`; returns exit status and stderr.
fn run(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::cargo_bin("tongue-fit").unwrap();
    let done = command.args(arguments).current_dir(folder).output().unwrap();
    (done.status.code(), String::from_utf8(done.stderr).unwrap())
}

fn shard(folder: &Path, shard: &str, out: &str) {
    let line = ["--shard", shard, "--out", out, "--threads", "1"];
    let (status, told) = run(folder, &[&BATCH[..], &line].concat());
    assert_eq!(status, Some(0), "an engine takes any other status for a failure: {told}");
}

fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap())
        .map(|e| (e.file_name().into_string().unwrap(), fs::read(e.path()).unwrap()))
        .collect();
    found.sort();
    found
}

#[test]
fn shards_of_one_thread_brought_together_are_byte_for_byte_one_run_of_four() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    assert_eq!(run(folder, &[&BATCH[..], &["--out", "one", "--threads", "4"]].concat()).0, Some(3));
    // In two folders, out of order, one of them twice.
    for (number, out) in [("3/3", "a"), ("1/3", "b"), ("1/3", "a")] {
        shard(folder, number, out);
    }
    let (status, told) = run(folder, &["merge", "a", "b", "--out", "merged"]);
    assert_eq!(status, Some(1));
    assert!(told.contains("2/3 is missing") && told.contains("nothing is written"), "{told}");
    assert!(!folder.join("merged").exists());
    shard(folder, "2/3", "b");
    let before = files(&folder.join("a"));
    assert_eq!(run(folder, &["merge", "a", "b", "./a", "--out", "merged"]).0, Some(3), "as one run");
    assert!(files(&folder.join("one")) == files(&folder.join("merged")), "the files differ");
    assert!(before == files(&folder.join("a")), "shards are left as they are");
}

#[test]
fn a_shard_that_was_killed_or_damaged_is_named_and_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    shard(folder, "1/2", "out");
    let mut child = Command::cargo_bin("tongue-fit")
        .unwrap()
        .args([&BATCH[..], &["--shard", "2/2", "--out", "out", "--threads", "1"]].concat())
        .current_dir(folder)
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let journal = folder.join("out/batch-2-of-2.journal");
    while !fs::read_to_string(&journal).is_ok_and(|j| j.lines().count() > 1) {
        assert!(child.try_wait().unwrap().is_none(), "ended before it was killed");
        std::thread::sleep(Duration::from_millis(1));
    }
    let (status, told) = run(folder, &["merge", "out", "--out", "merged"]);
    let running = told.contains("another batch is writing") || told.contains("has ");
    assert!(status == Some(1) && running, "while it runs: {told}");
    child.kill().unwrap();
    child.wait().unwrap();
    let mut bytes = fs::read(&journal).unwrap();
    let entry = bytes.iter().position(|b| *b == b'\n').unwrap() + 30;
    bytes[entry] ^= 1;
    fs::write(&journal, bytes).unwrap();
    let (status, told) = run(folder, &["merge", "out", "--out", "merged"]);
    assert_eq!(status, Some(1), "{told}");
    assert!(told.contains("2/2 has ") && told.contains(" of 8 fits"), "{told}");
    assert!(!folder.join("merged").exists());
    shard(folder, "2/2", "out");
    assert_eq!(run(folder, &["merge", "out", "--out", "merged"]).0, Some(3));
}

#[test]
fn shards_of_different_batches_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    shard(folder, "1/2", "out");
    let other = ["batch", "--subjects", "S2"];
    assert_eq!(run(folder, &[&other[..], &["--shard", "2/2", "--out", "out"]].concat()).0, Some(0));
    let cases = [
        (vec!["merge", "out"], "batch-2-of-2.journal\": it is of other inputs"),
        (vec!["merge", "nowhere"], "nowhere: it must be a folder"),
        (vec!["merge", "."], "no shard of a batch in ."),
        (vec!["batch", "--shard", "1/2", "--lengths", "-"], "it must be a file"),
    ];
    for (arguments, part) in cases {
        let (status, told) = run(folder, &arguments);
        assert!(status == Some(1) && told.contains(part), "{arguments:?}: {told}");
    }
    fs::rename(folder.join("out/batch-2-of-2.journal"), folder.join("out/batch-2-of-5.journal")).unwrap();
    let (_, told) = run(folder, &["merge", "out"]);
    assert!(told.contains("shards of batches with different numbers of shards: of 2 and of 5"), "{told}");
    // A journal of another version.
    fs::remove_file(folder.join("out/batch-2-of-5.journal")).unwrap();
    let journal = folder.join("out/batch-1-of-2.journal");
    let text = fs::read_to_string(&journal).unwrap();
    fs::write(&journal, text.replacen(env!("CARGO_PKG_VERSION"), "9.9.9", 1)).unwrap();
    let (_, told) = run(folder, &["merge", "out"]);
    assert!(told.contains("written by version 9.9.9"), "{told}");
    fs::write(&journal, "nonsense\n").unwrap();
    let (_, told) = run(folder, &["merge", "out"]);
    assert!(told.contains("it is not a journal of a batch"), "{told}");
    for word in ["0/2", "3/2", "x", "1"] {
        assert_eq!(run(folder, &["batch", "--shard", word]).0, Some(2), "{word}");
    }
}
