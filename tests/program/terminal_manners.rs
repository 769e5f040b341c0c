//! Behaviour in a Unix terminal: a closed pipe, a full disk, colours, progress, -q, -v, Ctrl-C.
#![cfg(unix)]

use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use assert_cmd::cargo::cargo_bin;

use super::run::{Done, names, program, record};

/// Every command in a short form, with its exit status.
const COMMANDS: [(&str, i32); 16] = [
    ("--vowel a --h 10", 0),
    ("--vowel a --h 10 --json", 0),
    ("batch --vowels a,u --subjects S2", 0),
    ("batch --vowels a,u --subjects S2 --json", 0),
    ("simulate --tension GGa=12", 0),
    ("simulate --tension GGa=12 --trajectory --t-end 0.01 --frames 2", 0),
    ("scene list", 0),
    ("scene explain vowel-a", 0),
    ("scene run vowel-a", 0),
    ("scene schema", 0),
    ("mesh --h 1mm --json", 0),
    ("completions bash", 0),
    ("--help", 0),
    ("-h", 0),
    ("--version", 0),
    ("help scene run", 0),
];

fn tongue_fit(folder: &Path, arguments: &str) -> Command {
    let mut command = program(folder, arguments);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Status, output and messages of a run.
fn run(folder: &Path, arguments: &str) -> (i32, String, String) {
    parts(super::run::run(folder, arguments))
}

fn parts(done: Done) -> (i32, String, String) {
    (done.status.unwrap_or(-1), done.out, done.err)
}

#[test]
fn every_command_survives_a_closed_pipe_with_its_usual_status() {
    for (arguments, expected) in COMMANDS {
        let folder = tempfile::tempdir().unwrap();
        let mut child = tongue_fit(folder.path(), arguments).spawn().unwrap();
        drop(child.stdout.take());
        let (status, _, told) = parts(child.wait_with_output().unwrap().into());
        assert_eq!(status, expected, "{arguments}: {told}");

        let mut child = tongue_fit(folder.path(), &format!("-v {arguments}")).spawn().unwrap();
        drop((child.stdout.take(), child.stderr.take()));
        assert_eq!(child.wait().unwrap().code(), Some(expected), "{arguments} without a reader of its notes");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_result_that_cannot_be_printed_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, _) in
        COMMANDS.iter().filter(|(a, _)| !a.contains("help") && !["-h", "--version"].contains(a))
    {
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        let output = tongue_fit(folder.path(), arguments).stdout(full).output().unwrap();
        let (status, _, told) = parts(output.into());
        assert!(status == 1 && told.contains("error: cannot write to stdout"), "{arguments}: {told}");
    }
}

/// Runs on a terminal of its own, by util-linux's `script`, and returns the terminal's content; `None` without that tool.
fn on_a_terminal(folder: &Path, arguments: &str, no_color: Option<&str>) -> Option<String> {
    if !cfg!(target_os = "linux") || Command::new("script").arg("--version").output().is_err() {
        eprintln!("skipped: util-linux's script is not there to make a terminal");
        return None;
    }
    let line = format!("'{}' {arguments}", cargo_bin("tongue-fit").display());
    let mut command = Command::new("script");
    command.args(["-qec", &line, "/dev/null"]).current_dir(folder).env("TERM", "xterm-256color");
    command.env_remove("NO_COLOR").env_remove("CLICOLOR").env_remove("CLICOLOR_FORCE");
    if let Some(value) = no_color {
        command.env("NO_COLOR", value);
    }
    let output = command.stdin(Stdio::null()).output().unwrap();
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Whether a text sets colours or weights; moving the cursor does not count.
fn is_coloured(text: &str) -> bool {
    text.split("\u{1b}[").skip(1).any(|rest| {
        let end = rest.find(|c: char| !c.is_ascii_digit() && c != ';');
        end.is_some_and(|i| rest[i..].starts_with('m'))
    })
}

#[test]
fn colours_are_for_terminals_without_no_color() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in ["--help", "--vowl a", "scene run --help", "scene list", "batch --vowels a"] {
        let (_, out, told) = run(folder.path(), arguments);
        assert!(!out.contains('\u{1b}') && !told.contains('\u{1b}'), "{arguments}: {out}{told}");
        if let Some(seen) = on_a_terminal(folder.path(), arguments, Some("1")) {
            assert!(!seen.is_empty() && !is_coloured(&seen), "{arguments} with NO_COLOR: {seen}");
        }
    }
    if let Some(seen) = on_a_terminal(folder.path(), "--help", None) {
        assert!(is_coloured(&seen), "the test above could not fail: {seen}");
    }
}

#[test]
fn progress_is_for_terminals_and_not_with_q() {
    let folder = tempfile::tempdir().unwrap();
    let batch = "batch --vowels a";
    let sign = "of 8 fits";
    let (_, out, told) = run(folder.path(), batch);
    assert!(!out.contains(sign) && !told.contains(sign), "{out}{told}");
    let Some(seen) = on_a_terminal(folder.path(), batch, None) else { return };
    assert!(seen.contains(sign), "{seen}");
    let seen = on_a_terminal(folder.path(), &format!("{batch} -q"), None).unwrap();
    assert!(!seen.contains(sign), "{seen}");
}

#[test]
fn with_q_only_errors_are_printed_and_files_have_everything() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, first) in [
        ("--vowel a --h 10 --out fit -q", "fit/fit.json"),
        ("batch --vowels a,u --subjects S2 --out batch --quiet", "batch/fits.csv"),
        ("simulate --tension GGa=12 --out one -q", "one/simulation.json"),
        ("scene run vowel-a --out scene -q", "scene/vowel-a.json"),
        ("mesh --out mesh -q", "mesh/mesh.json"),
    ] {
        assert_eq!(run(folder.path(), arguments), (0, String::new(), String::new()), "{arguments}");
        assert!(folder.path().join(first).exists(), "{first}");
    }
    // Results that are in no file, and output that was asked for by name, are printed even with -q.
    for arguments in
        ["simulate --tension GGa=12 -q", "mesh -q", "scene list -q", "--vowel a --h 10 --json -q"]
    {
        let (status, out, told) = run(folder.path(), arguments);
        assert_eq!((status, out.is_empty(), told.as_str()), (0, false, ""), "{arguments}");
    }
    // Only some of many missing shards are named.
    run(folder.path(), "batch --vowels a --subjects S2 --shard 1/1000 --out shards");
    let (status, _, told) = run(folder.path(), "merge shards");
    assert!(
        status == 1 && told.contains("2/1000 is missing; ") && told.contains("; and 994 more."),
        "{told}"
    );
    let (status, out, told) = run(folder.path(), "--vowel a --subject S3 --body continuum --h 10 -q");
    assert_eq!((status, out.as_str(), told.lines().count()), (3, "", 1), "{told}");
    assert!(told.starts_with("error: the fit cannot be trusted: the target is missed by"), "{told}");
    for (quiet, is_told) in [("", true), ("-q", false)] {
        let (_, _, told) = run(folder.path(), &format!("batch --subjects S4 --out s4 {quiet}"));
        assert_eq!(told.contains("no /ɯ/ for S4"), is_told, "{told}");
    }
    assert_eq!(run(folder.path(), "mesh -q -v").0, 2);
}

#[test]
fn with_v_each_step_is_on_stderr_and_results_are_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let fit = "--vowel a --threads 2";
    let ((_, plain, silence), (_, out, told)) =
        (run(folder.path(), fit), run(folder.path(), &format!("{fit} -v")));
    assert_eq!(silence, "");
    let lines = |text: &str| -> Vec<String> {
        text.lines().map(|l| l.split("; -v ").next().unwrap().to_owned()).collect()
    };
    // -v adds tables; no line is lost but the one that mentions -v.
    for line in lines(&plain) {
        assert!(lines(&out).contains(&line), "{line}\nis not in\n{out}");
    }
    assert!(out.contains("| muscle |") && !plain.contains("| muscle |"), "{out}");
    assert!(told.lines().all(|l| l.starts_with('[') && l.contains(" s] ")), "{told}");
    let (_, _, of_batch) = run(folder.path(), "batch -v --vowels a,u --subjects S2");
    for (told, signs) in [
        (
            told,
            "2 threads; reference tongue at 5.5 mm: 123 nodes; nelder-mead from 4 starts for S2 /a/; 2053 equilibria",
        ),
        (of_batch, "gauss-newton from 8 starts; S2 /a/ ratio: converged; S2 /a/ stretch: converged"),
    ] {
        assert!(signs.split("; ").all(|sign| told.contains(sign)), "{signs}\nare not in\n{told}");
    }
}

#[test]
fn the_recorded_command_has_only_options_that_change_results() {
    let folder = tempfile::tempdir().unwrap();
    let batch = "batch --vowels a,u --subjects S2";
    for (options, out) in [("-v --threads 1", "out"), ("--quiet --json", "my results")] {
        run(folder.path(), &format!("{batch} {options} --out '{out}'"));
        let record = record(folder.path(), &format!("{out}/batch.json"));
        assert_eq!(record["command"], format!("tongue-fit {batch}"));
    }
}

/// Starts a program with this handling of Ctrl-C, whatever that of the test is.
fn start(folder: &Path, ctrl_c: &str, arguments: &str) -> Child {
    let mut command = Command::new("env");
    command.arg(format!("--{ctrl_c}-signal=INT")).arg(cargo_bin("tongue-fit"));
    command.args(arguments.split_whitespace()).current_dir(folder);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().unwrap()
}

/// Sends a signal as soon as `now` returns true; `None` if the program ended before.
fn interrupted(mut child: Child, signal: &str, now: impl Fn() -> bool) -> Option<ExitStatus> {
    while !now() {
        if child.try_wait().unwrap().is_some() {
            return None;
        }
        std::thread::sleep(Duration::from_micros(200));
    }
    // The shell has a `kill` of its own on every system.
    Command::new("sh").args(["-c", &format!("kill -{signal} {}", child.id())]).status().unwrap();
    Some(child.wait().unwrap())
}

const FRAMES: usize = 1500;

#[cfg(target_os = "linux")]
#[test]
fn an_interruption_while_files_are_written_leaves_all_of_them_or_none() {
    let (mut stopped, mut before_the_names) = (0, 0);
    for attempt in 0..30 {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let arguments = format!(
            "simulate --tension GGa=12 --trajectory --t-end 0.01 --h 10mm --frames {FRAMES} --out out --threads 1"
        );
        let signal = ["INT", "TERM"][attempt % 2];
        // The signal comes while the first files are written, or some more.
        let files = 2 + 60 * (attempt % 5);
        let child = start(folder.path(), "default", &arguments);
        let Some(status) = interrupted(child, signal, || names(&out).len() > files) else { continue };
        let left = names(&out);
        assert!(left.iter().all(|n| !n.starts_with('.')), "{:?}", left.first());
        // The files are JSON, CSV, STO, SVG and PVD, and one for each frame.
        assert!([0, FRAMES + 5].contains(&left.len()), "{} of {} files", left.len(), FRAMES + 5);
        if let Some(by) = status.signal() {
            assert_eq!(by, if signal == "INT" { 2 } else { 15 }, "as a shell expects");
            stopped += 1;
            before_the_names += usize::from(left.is_empty());
        }
        if stopped >= 4 && before_the_names >= 2 {
            return;
        }
    }
    panic!("of 30 runs {stopped} were interrupted, {before_the_names} of them while they wrote");
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_batch_leaves_its_journal_and_goes_on_unless_it_was_told_to_ignore_it() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let batch = "batch --vowels a,o --subjects S1,S2,S3 --out out";
    let fitted = || fs::read_to_string(out.join("batch.journal")).is_ok_and(|j| j.lines().count() > 3);
    let status = interrupted(start(folder.path(), "default", batch), "INT", fitted).unwrap();
    assert_eq!((status.signal(), names(&out)), (Some(2), vec!["batch.journal".to_owned()]));

    let (_, _, told) = run(folder.path(), &batch.replace("--out", "--threads 1 --out"));
    assert!(told.contains("resuming after") && told.contains("of 12 fits"), "{told}");
    assert_eq!(names(&out), ["batch.html", "batch.json", "fits.csv", "muscles.csv", "tensions.svg"]);

    // The same signal is ignored in a background job of a script.
    fs::remove_dir_all(&out).unwrap();
    let status = interrupted(start(folder.path(), "ignore", batch), "INT", fitted).unwrap();
    assert!(status.code().is_some(), "{status}");
    assert_eq!(names(&out).len(), 5);
}

#[test]
fn the_short_help_is_short_and_the_long_one_complete() {
    let folder = tempfile::tempdir().unwrap();
    let printed = |arguments: &str| run(folder.path(), arguments).1;
    let (short, long) = (printed("-h"), printed("--help"));
    assert!(short.contains("--vowel") && !short.contains("      --poisson-ratio"), "{short}");
    assert!(long.contains("--poisson-ratio") && long.contains("Body:"), "{long}");
    assert!(short.lines().count() < 60, "{short}");
    let has = |arguments: &str| printed(arguments).contains("      --error-mm");
    assert!(has("batch --help") && !has("batch -h"));
    // Options that the short help does not show still work.
    assert_eq!(run(folder.path(), "mesh --poisson-ratio 0.4 -q").0, 0);
}
