//! Every file written by a command contains version and command line.

use super::run::{names, run, shell};

/// Runs a command with `--out`; returns the name and the text of every file, with XML's entities resolved.
fn written(line: &str) -> Vec<(String, String)> {
    let folder = tempfile::tempdir().unwrap();
    let done = run(folder.path(), &format!("{line} --out out"));
    assert!(matches!(done.status, Some(0 | 3)), "{line}: {}", done.err);
    let out = folder.path().join("out");
    let read = |name: String| {
        let text = std::fs::read_to_string(out.join(&name)).unwrap();
        let entities = [("&quot;", "\""), ("&lt;", "<"), ("&gt;", ">"), ("&amp;", "&")];
        (name, entities.iter().fold(text, |text, (entity, is)| text.replace(entity, is)))
    };
    names(&out).into_iter().map(read).collect()
}

#[test]
fn every_file_of_every_command_has_version_and_command() {
    let commands: [(&str, &str); 10] = [
        ("--vowel a --method gauss-newton --h 8mm", "json csv svg"),
        ("simulate --tension GGa=12", "json svg vtu"),
        ("simulate --tension GGa=2 --trajectory --t-end 0.1 --frames 3", "json csv sto svg pvd vtu"),
        ("scene run vowel-a", "json svg vtu"),
        ("scene run vowel-a-trajectory", "json svg vtu csv"),
        ("scene run block-3d", "json svg vtu"),
        ("muscles --h 8mm", "svg csv"),
        ("mesh --h 8mm", "json vtu msh"),
        ("page --no-fits", "html"),
        ("batch --subjects S2 --vowels a", "json csv html"),
    ];
    for (arguments, formats) in commands {
        let files = written(arguments);
        let command = format!("tongue-fit {arguments}");
        for format in formats.split(' ') {
            let ending = format!(".{format}");
            assert!(files.iter().any(|(name, _)| name.ends_with(&ending)), "{command}: {format}");
        }
        for (name, text) in files {
            assert!(text.contains(tongue_fit::VERSION) && text.contains(&command), "{command}: {name}");
        }
    }
}

#[cfg(unix)]
#[test]
fn more_frames_are_written_than_files_can_be_open() {
    let folder = tempfile::tempdir().unwrap();
    let motion = "simulate --tension GGa=2 --trajectory --t-end 0.1 --frames 200 --out out";
    let done = shell(folder.path(), &format!("ulimit -n 64; $TONGUE_FIT {motion}"));
    assert_eq!(done.status, Some(0), "{}", done.out);
    assert_eq!(std::fs::read_dir(folder.path().join("out")).unwrap().count(), 5 + 200);
}

#[test]
fn files_of_a_simulation_say_what_the_tissue_was() {
    for body in ["springs", "continuum"] {
        let line = format!("simulate --body {body} --tension GGa=2");
        let still = written(&format!("{line} --direct"));
        for (file, text) in still.into_iter().chain(written(&format!("{line} --trajectory --t-end 0.1"))) {
            assert!(text.contains(body), "{file} of {body}");
        }
    }
    for (file, text) in written("--vowel a --method gauss-newton --h 8mm") {
        assert!(text.contains("springs"), "{file}");
    }
}
