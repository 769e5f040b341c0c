use super::*;

const JOBS: usize = 4;

fn open(folder: &Path, key: &str) -> Journal {
    Journal::open(folder.join(NAME), key, &[], JOBS).unwrap()
}

fn entry(job: usize) -> JournalEntry<f64> {
    let result = if job == 2 { Err("reason".into()) } else { Ok(1.0 / (3.0 + job as f64)) };
    JournalEntry { job, wall_s: 0.1 + job as f64, result }
}

#[test]
fn a_line_cut_by_a_kill_is_dropped_and_the_rest_kept() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = open(folder.path(), "abc");
    for job in [2, 0] {
        journal.append(&entry(job)).unwrap();
    }
    let whole = journal.end;
    journal.append(&entry(1)).unwrap();
    drop(journal);
    let path = folder.path().join(NAME);
    let bytes = std::fs::read(&path).unwrap();
    for cut in whole..bytes.len() as u64 {
        std::fs::write(&path, &bytes[..cut as usize]).unwrap();
        let mut journal = open(folder.path(), "abc");
        assert_eq!((journal.len(), journal.has(1), journal.notes().len()), (2, false, 0));
        assert_eq!(journal.read(2).unwrap(), Some(entry(2)));
        journal.append(&entry(1)).unwrap();
        assert_eq!(journal.read(1).unwrap(), Some(entry(1)));
    }
    assert_eq!(std::fs::read(&path).unwrap(), bytes);
}

#[test]
fn after_a_change_of_any_byte_only_unchanged_entries_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = open(folder.path(), "abc");
    (0..3).for_each(|job| journal.append(&entry(job)).unwrap());
    drop(journal);
    let path = folder.path().join(NAME);
    let bytes = std::fs::read(&path).unwrap();
    for at in 0..bytes.len() {
        for other in [bytes[at] ^ 1, bytes[at] ^ 0x80, b'\n', b' ', 0] {
            let mut damaged = bytes.clone();
            damaged[at] = other;
            std::fs::write(&path, &damaged).unwrap();
            let mut journal = open(folder.path(), "abc");
            assert!(!journal.is_empty() || at < 200, "a line that is whole is kept: {at}");
            for job in (0..JOBS).filter(|job| journal.has(*job)).collect::<Vec<_>>() {
                assert_eq!(journal.read(job).unwrap(), Some(entry(job)), "byte {at} as {other}");
            }
            let is_noted = !journal.notes().is_empty() || damaged == bytes || journal.len() == 2;
            assert!(is_noted, "byte {at} as {other}");
            for job in 0..JOBS {
                if !journal.has(job) {
                    journal.append(&entry(job)).unwrap();
                }
            }
            drop(journal);
            let journal = open(folder.path(), "abc");
            assert_eq!(journal.len(), JOBS, "and goes on: byte {at} as {other}");
            (0..JOBS).for_each(|job| assert_eq!(journal.read(job).unwrap(), Some(entry(job))));
        }
    }
}

#[test]
fn lines_of_other_batches_and_jobs_out_of_the_plan_are_dropped_with_a_note() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(NAME);
    let mut other = open(folder.path(), "other");
    other.append(&entry(1)).unwrap();
    drop(other);
    let foreign = std::fs::read_to_string(&path).unwrap().lines().nth(1).unwrap().to_owned();
    let mut journal = Journal::open(folder.path().join(NAME), "abc", &[], 10).unwrap();
    assert!(journal.is_empty() && journal.notes()[0].contains("of other inputs: it was replaced"));
    [0, 7].iter().for_each(|job| journal.append(&entry(*job)).unwrap());
    drop(journal);
    let text = std::fs::read_to_string(&path).unwrap() + &foreign + "\nnonsense\n";
    std::fs::write(&path, &text).unwrap();
    let journal = open(folder.path(), "abc");
    assert_eq!((journal.len(), journal.has(0)), (1, true));
    assert!(journal.notes()[0].contains("not of this batch, left out: 3"), "{:?}", journal.notes());
    drop(journal);
    std::fs::write(&path, text.replace(crate::VERSION, "0.0.1 (f00)")).unwrap();
    let journal = open(folder.path(), "abc");
    assert!(journal.is_empty() && journal.notes()[0].contains("of 0.0.1 (f00): it was replaced"));
}

#[test]
fn two_runs_exclude_each_other_and_other_files_are_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let journal = open(folder.path(), "abc");
    let refused = Journal::open(folder.path().join(NAME), "abc", &[], JOBS).unwrap_err().to_string();
    assert!(refused.contains("another batch"), "{refused}");
    journal.remove().unwrap();
    #[cfg(unix)]
    {
        let precious = folder.path().join("precious");
        std::fs::write(&precious, "mine").unwrap();
        std::os::unix::fs::symlink(&precious, folder.path().join(NAME)).unwrap();
        let refused = Journal::open(folder.path().join(NAME), "abc", &[], JOBS).unwrap_err().to_string();
        assert!(refused.contains("it is a link"), "{refused}");
        assert_eq!(std::fs::read_to_string(&precious).unwrap(), "mine");
    }
}
