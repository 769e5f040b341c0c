//! A batch cut into shards and merged is the same batch. A missing or unfinished shard is named, and nothing is written.

use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use crate::program::{names, program, run};

const BATCH: &str = "batch --subjects S2,S3 --threads 1";

fn shard(folder: &Path, shard: &str, out: &str) {
    let done = run(folder, &format!("{BATCH} --shard {shard} --out {out}"));
    assert_eq!(done.status, Some(0), "an engine takes any other status for a failure: {}", done.err);
}

/// Checks that a merge fails with all of these words, prints nothing and writes nothing.
fn is_refused(folder: &Path, merge: &str, words: &[&str]) {
    let done = run(folder, merge);
    assert!(
        done.status == Some(1) && words.iter().all(|word| done.err.contains(word)),
        "{merge}: {}",
        done.err
    );
    assert!(done.out.is_empty() && !folder.join("merged").exists());
}

fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    names(folder).into_iter().map(|name| (name.clone(), fs::read(folder.join(name)).unwrap())).collect()
}

#[test]
fn shards_of_one_thread_brought_together_are_byte_for_byte_one_run_of_four() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    assert_eq!(run(folder, "batch --subjects S2,S3 --out one --threads 4").status, Some(3));
    // The shards are in two folders, out of order, one of them twice.
    for (number, out) in [("3/3", "a"), ("1/3", "b"), ("1/3", "a")] {
        shard(folder, number, out);
    }
    is_refused(folder, "merge a b --out merged", &["2/3 is missing", "nothing is written"]);
    shard(folder, "2/3", "b");
    let before = files(&folder.join("a"));
    assert_eq!(run(folder, "merge a b ./a --out merged").status, Some(3), "as one run");
    assert!(files(&folder.join("one")) == files(&folder.join("merged")), "the files differ");
    assert!(before == files(&folder.join("a")), "shards are left as they are");
}

#[test]
fn a_shard_that_was_killed_is_named_and_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    shard(folder, "1/2", "out");
    let mut child = program(folder, &format!("{BATCH} --shard 2/2 --out out"));
    let mut child = child.stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
    let journal = folder.join("out/batch-2-of-2.journal");
    while !fs::read_to_string(&journal).is_ok_and(|j| j.lines().count() > 1) {
        assert!(child.try_wait().unwrap().is_none(), "ended before it was killed");
        std::thread::sleep(Duration::from_millis(1));
    }
    let done = run(folder, "merge out --out merged");
    let running = done.err.contains("another batch is writing") || done.err.contains("has ");
    assert!(done.status == Some(1) && running, "while it runs: {}", done.err);
    child.kill().unwrap();
    child.wait().unwrap();
    // The last line is cut, as by a kill while it was written.
    let bytes = fs::read(&journal).unwrap();
    fs::write(&journal, &bytes[..bytes.len() - 10]).unwrap();
    is_refused(folder, "merge out --out merged", &["2/2 has ", " of 8 fits"]);
    shard(folder, "2/2", "out");
    assert_eq!(run(folder, "merge out --out merged").status, Some(3));
}

#[test]
fn shards_of_different_batches_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    shard(folder, "1/2", "out");
    assert_eq!(run(folder, "batch --subjects S2 --shard 2/2 --out out").status, Some(0));
    is_refused(folder, "merge out", &["batch-2-of-2.journal\": it is of other inputs"]);
    is_refused(folder, "merge nowhere", &["nowhere: it must be a folder"]);
    is_refused(folder, "merge .", &["no shard of a batch in ."]);
    is_refused(folder, "batch --shard 1/2 --lengths -", &["it must be a file"]);
    fs::rename(folder.join("out/batch-2-of-2.journal"), folder.join("out/batch-2-of-5.journal")).unwrap();
    is_refused(folder, "merge out", &["shards of batches with different numbers of shards: of 2 and of 5"]);
    // The journal is of another version, and then no journal.
    fs::remove_file(folder.join("out/batch-2-of-5.journal")).unwrap();
    let journal = folder.join("out/batch-1-of-2.journal");
    let text = fs::read_to_string(&journal).unwrap();
    fs::write(&journal, text.replacen(env!("CARGO_PKG_VERSION"), "9.9.9", 1)).unwrap();
    is_refused(folder, "merge out", &["written by version 9.9.9"]);
    fs::write(&journal, text + "nonsense\n").unwrap();
    is_refused(folder, "merge out", &["batch-1-of-2.journal\": line 10 is damaged; delete this line"]);
    fs::write(&journal, "nonsense\n").unwrap();
    is_refused(folder, "merge out", &["it is no journal"]);
    for word in ["0/2", "3/2", "x", "1", "a/b", "1/0", "-1/3", "1/3/5", "1/1000000"] {
        assert_eq!(run(folder, &format!("batch --shard {word}")).status, Some(2), "{word}");
    }
}
