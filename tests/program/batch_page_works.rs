//! The page of a batch in a real browser: no errors on the console, and working controls.

use std::process::Command;

#[test]
fn the_page_sorts_slides_and_turns_dark_without_errors() {
    let Some(browser) = super::browser::found() else { return };
    let folder = tempfile::tempdir().unwrap();
    super::run::run(folder.path(), "batch --subjects S2,S4 --out .");
    let page = folder.path().join("batch.html");
    let html = std::fs::read_to_string(&page).unwrap();
    // Names of XML namespaces are not addresses of resources.
    let addresses = html.replace("http://www.w3.org/", "");
    assert!(!addresses.contains("http://") && !addresses.contains("https://"), "the page needs no network");

    // With this fragment the page tests its own controls and writes the results into the document.
    let done = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--dump-dom"])
        .arg("--virtual-time-budget=10000")
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
        .arg(format!("file://{}#self-test", page.display()))
        .output()
        .unwrap();
    let (document, log) = (String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    let found = document.split("data-self-test=\"").nth(1).and_then(|rest| rest.split('"').next());
    assert_eq!(found, Some("passed"), "{log}");
    let console: Vec<&str> = log.lines().filter(|l| l.contains("CONSOLE")).collect();
    assert!(console.is_empty(), "{console:#?}");
}
