//! Sets `TONGUE_FIT_VERSION`: the version in Cargo.toml, with the commit if it is built in a git checkout.

use std::path::Path;
use std::process::Command;

/// The version says `modified` if one of these paths is.
const SOURCES: [&str; 5] = ["src", "crates", "targets", "Cargo.toml", "Cargo.lock"];
const ROOT: &str = "../..";

fn main() {
    for path in SOURCES {
        println!("cargo:rerun-if-changed={ROOT}/{path}");
    }
    // A release build follows HEAD. A test build keeps the commit that it was built from, so that a commit does not rebuild everything.
    if std::env::var("PROFILE").is_ok_and(|p| p == "release") {
        let moved = ["HEAD", "logs/HEAD"]
            .map(|name| git(&["rev-parse", "--path-format=absolute", "--git-path", name]));
        for path in moved.into_iter().flatten().filter(|p| Path::new(p).exists()) {
            println!("cargo:rerun-if-changed={path}");
        }
    }
    let version = std::env::var("CARGO_PKG_VERSION").unwrap_or_default();
    let version = commit().map_or_else(|| version.clone(), |commit| format!("{version} ({commit})"));
    println!("cargo:rustc-env=TONGUE_FIT_VERSION={version}");
}

/// The commit, if this folder is the top of a git checkout (not a package unpacked inside another project's).
fn commit() -> Option<String> {
    if !git(&["rev-parse", "--show-prefix"])?.is_empty() {
        return None;
    }
    let commit = git(&["rev-parse", "--short=10", "HEAD"])?;
    let changes = git(&[&["status", "--porcelain", "--"][..], &SOURCES].concat())?;
    Some(if changes.is_empty() { commit } else { format!("{commit}-modified") })
}

/// The output of git; `None` if it fails or is empty.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git")
        .args(["-C", ROOT, "--no-optional-locks"])
        .args(arguments)
        .output()
        .ok()
        .filter(|o| o.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}
