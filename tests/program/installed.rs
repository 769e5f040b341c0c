//! Version and completions of an installed program.

use std::path::Path;
use std::process::{Command, Stdio};

use super::run::run;

fn printed(line: &str) -> String {
    let done = run(Path::new("."), line);
    assert_eq!(done.status, Some(0), "{line}");
    done.out
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).output().ok()?;
    output.status.success().then(|| String::from_utf8(output.stdout).unwrap().trim().to_owned())
}

#[test]
fn the_version_names_a_commit_of_this_repository_and_is_that_of_the_outputs() {
    let version = printed("--version");
    assert_eq!(version, format!("tongue-fit {}\n", tongue_fit::VERSION));
    assert!(tongue_fit::VERSION.starts_with(env!("CARGO_PKG_VERSION")));
    if git(&["rev-parse", "--show-prefix"]).is_none_or(|prefix| !prefix.is_empty()) {
        assert_eq!(tongue_fit::VERSION, env!("CARGO_PKG_VERSION"), "no commit to name");
        return;
    }
    let commit = tongue_fit::VERSION.split(['(', ')']).nth(1).unwrap().trim_end_matches("-modified");
    assert!(git(&["cat-file", "-e", &format!("{commit}^{{commit}}")]).is_some(), "{version}");

    let mesh: serde_json::Value = serde_json::from_str(&printed("mesh --json")).unwrap();
    assert_eq!(mesh["version"], tongue_fit::VERSION);
}

#[test]
fn the_completions_of_each_shell_name_commands_and_options_and_bash_takes_them() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = printed(&format!("completions {shell}"));
        for word in ["hold-out", "simulate", "explain"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    if !Path::new("/bin/bash").exists() {
        eprintln!("skipped: no bash");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("tongue-fit.bash");
    std::fs::write(&script, printed("completions bash")).unwrap();
    // As the shell does when the user presses the tabulator key after the last word.
    let complete = |words: &str| {
        let line = format!(
            "source '{}'; COMP_WORDS=({words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); \
             does=($(complete -p tongue-fit)); while [ \"${{does[0]}}\" != -F ]; do does=(\"${{does[@]:1}}\"); done; \
             \"${{does[1]}}\" tongue-fit \"${{COMP_WORDS[-1]}}\" \"${{COMP_WORDS[-2]}}\"; echo \"${{COMPREPLY[*]}}\"",
            script.display()
        );
        let output = Command::new("/bin/bash").args(["-c", &line]).stderr(Stdio::inherit()).output().unwrap();
        String::from_utf8(output.stdout).unwrap().trim().to_owned()
    };
    assert_eq!(complete("tongue-fit sce"), "scene");
    assert_eq!(complete("tongue-fit scene exp"), "explain");
    assert_eq!(complete("tongue-fit simulate --trajec"), "--trajectory");
    assert_eq!(complete("tongue-fit --method g"), "gauss-newton");
}
