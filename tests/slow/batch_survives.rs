//! `tongue-fit batch` as a user runs it: killed and restarted, on any number of threads, on broken and on large tables.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use assert_cmd::cargo::CommandCargoExt;

use crate::program::names;

const FILES: [&str; 5] = ["batch.html", "batch.json", "fits.csv", "muscles.csv", "tensions.svg"];
const REFERENCE: &str = include_str!("../../targets/takano2007_lengths.csv");

fn batch(out: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("tongue-fit").unwrap();
    command.arg("batch").args(arguments).arg("--out").arg(out);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Exit status, stdout and stderr.
fn run(out: &Path, arguments: &[&str]) -> (i32, String, String) {
    let done = batch(out, arguments).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (done.status.code().unwrap(), text(done.stdout), text(done.stderr))
}

fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    assert_eq!(names(folder), FILES, "nothing but the outputs");
    FILES.iter().map(|name| ((*name).to_owned(), fs::read(folder.join(name)).unwrap())).collect()
}

fn rows(csv: &[u8]) -> Vec<std::collections::BTreeMap<String, String>> {
    csv::Reader::from_reader(csv).deserialize().collect::<Result<_, _>>().unwrap()
}

#[cfg(unix)]
#[test]
fn killed_again_and_again_it_ends_with_the_files_of_an_undisturbed_run() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--threads", "2"];
    let undisturbed = folder.path().join("undisturbed");
    assert_eq!(run(&undisturbed, &arguments).0, 3, "some ratio fits end at a bound");
    the_tables_are_tidy_and_residuals_are_correct(&files(&undisturbed));

    let killed = folder.path().join("killed");
    let journal = killed.join("batch.journal");
    let (mut kills, mut before) = (0, 0);
    while kills < 5 {
        let mut child = batch(&killed, &arguments).spawn().unwrap();
        // The run is killed when its journal is longer than that of the last run, or after a while, so that the cut is anywhere in the new
        // part.
        let clock = Instant::now();
        let length = || fs::metadata(&journal).map_or(0, |m| m.len());
        let in_a_while = || clock.elapsed() > Duration::from_millis(300) && length() > before;
        while length() <= before + 20_000 && !in_a_while() && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        if child.try_wait().unwrap().is_some() {
            break;
        }
        child.kill().unwrap();
        child.wait().unwrap();
        kills += 1;
        before = length();
        assert!(FILES.iter().all(|f| !killed.join(f).exists()), "no output before all fits are done");
    }
    assert!(kills >= 2, "killed only {kills} times");
    let (status, _, message) = run(&killed, &arguments);
    assert_eq!(status, 3);
    assert!(message.contains("resuming after"), "{message}");
    // A kill while outputs are written leaves a hidden file without effect.
    assert!(files(&killed) == files(&undisturbed), "the files differ");
}

fn the_tables_are_tidy_and_residuals_are_correct(outputs: &[(String, Vec<u8>)]) {
    let json: serde_json::Value = serde_json::from_slice(&outputs[1].1).unwrap();
    let hash = json["inputs_sha256"].as_str().unwrap();
    let has = |(_, bytes): &(String, Vec<u8>)| String::from_utf8_lossy(bytes).contains(hash);
    assert!(hash.len() == 64 && outputs.iter().all(has));
    let is_published = |fit: &&serde_json::Value| fit["passive"]["thesis_rms_ratio"].is_number();
    let published = json["fits"].as_array().unwrap().iter().find(is_published).unwrap();
    let thesis = published["passive"]["thesis_rms_ratio"].as_f64().unwrap();
    assert!((thesis - 0.071).abs() < 0.01, "table 4.8 against table 4.4: {thesis}");
    assert_eq!(json["baselines"][0]["vowel"], "ɯ");
    let fits = rows(&outputs[2].1);
    let count = |key: &str, value: &str| fits.iter().filter(|r| r[key] == value).count();
    assert_eq!((fits.len(), count("status", "baseline"), count("substitute_baseline", "true")), (34, 4, 7));
    let muscles = rows(&outputs[3].1);
    assert_eq!(muscles.len(), 30 * 8);
    // Both tables have the same tensions, and only muscles that contract pull.
    for (fit, own) in fits.iter().filter(|fit| !fit["misfit"].is_empty()).zip(muscles.chunks(8)) {
        for row in own {
            let muscle = &row["muscle"];
            assert_eq!(row["tension_n_per_m"], fit[&format!("tension_{muscle}_n_per_m")], "{fit:?}");
            let contracts = fit["active"].split('+').any(|active| active == muscle);
            assert!(contracts || row["tension_n_per_m"].parse::<f64>().unwrap() == 0.0, "{fit:?}");
        }
    }
    for row in &muscles {
        let number = |key: &str| row[key].parse::<f64>().unwrap();
        for quantity in ["ratio", "stretch"] {
            let of = |what: &str| number(&format!("{what}_{quantity}"));
            assert!((of("simulated") - of("target") - of("residual")).abs() < 1e-12);
        }
        let residual_mm = number("simulated_length_mm") - number("target_length_mm");
        assert!((residual_mm - number("residual_mm")).abs() < 1e-9);
        if row["target_kind"] == "stretch" && row["fitted"] == "true" && row["status"] == "converged" {
            assert!(number("residual_mm").abs() < 0.05, "{row:?}");
        }
    }
}

/// The real rows repeated under new names, with every length changed by up to 1 mm.
fn many_rows(count: usize) -> String {
    let mut lines = REFERENCE.lines();
    let mut text = lines.next().unwrap().to_owned() + "\n";
    let real: Vec<&str> = lines.collect();
    for n in 0..count {
        let mut fields = real[n % real.len()].split(',');
        let (subject, vowel) = (fields.next().unwrap(), fields.next().unwrap());
        let _ = write!(text, "{subject}-{},{vowel}", n / real.len());
        for (i, field) in fields.enumerate() {
            let moved = ((n / real.len()) * 7 + i * 3) % 5;
            let _ = write!(text, ",{}", field.parse::<f64>().unwrap() + 0.5 * moved as f64 - 1.0);
        }
        text += "\n";
    }
    text
}

/// Peak memory of a batch of this many rows, kB, and size of its page, bytes.
#[cfg(target_os = "linux")]
fn peak_kb_and_page(count: usize) -> [f64; 2] {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("many.csv");
    fs::write(&data, many_rows(count)).unwrap();
    let out = folder.path().join("out");
    // A coarse mesh takes less than half the time and does not change how memory grows with the rows.
    let options = ["--target", "stretch", "--h", "12mm"];
    let mut arguments = vec!["--lengths", data.to_str().unwrap()];
    arguments.extend(options);
    let mut child = batch(&out, &arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak_kb: u32 = 0;
    let code = loop {
        // Peak so far, from the kernel.
        let now = fs::read_to_string(&status).unwrap_or_default();
        let line = now.lines().find_map(|l| l.strip_prefix("VmHWM:"));
        peak_kb = peak_kb.max(line.and_then(|l| l.trim().trim_end_matches(" kB").parse().ok()).unwrap_or(0));
        if let Some(done) = child.try_wait().unwrap() {
            break done.code().unwrap();
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    let fits = rows(&fs::read(out.join("fits.csv")).unwrap());
    assert_eq!(fits.len(), count);
    let refused = fits.iter().filter(|r| r["status"] == "not_fitted").count();
    assert!(code == if refused > 0 { 1 } else { 3 }, "{code}, {refused} refused");
    assert!(fits.iter().filter(|r| r["status"] == "converged").count() > count / 2);
    [f64::from(peak_kb), fs::metadata(out.join("batch.html")).unwrap().len() as f64]
}

/// A line through tables of 500 and 2,500 rows separates what grows with the rows from what does not.
#[cfg(target_os = "linux")]
#[test]
fn memory_and_page_grow_with_the_rows_to_less_than_200_and_8_megabytes_at_ten_thousand() {
    let (few, many) = (peak_kb_and_page(500), peak_kb_and_page(2_500));
    let [peak_kb, page] = [0, 1].map(|i| many[i] + (many[i] - few[i]) / 2_000.0 * 7_500.0);
    assert!(few[0] > 1_000.0 && peak_kb < 200_000.0, "{few:?}, {many:?}: {peak_kb} kB");
    assert!(page < 8e6, "{few:?}, {many:?}: {page} bytes");
}
