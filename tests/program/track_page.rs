//! The page of `track` in a real browser: its figures have the numbers of `track.json`.
#![cfg(unix)]

use serde_json::Value;

use super::browser::Browser;
use super::run::run;

/// The numbers beside the animation of a recording, in the order of the muscles.
const DRAWN: &str = "[...document.querySelectorAll('details.recording')[R].querySelectorAll('svg')[1].querySelectorAll('text')]\
    .map(e => e.textContent).filter(t => t.endsWith(' N/m')).map(t => +t.split(' ')[1])";

#[test]
fn figures_and_animation_have_the_tensions_of_the_recording() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let recording = concat!(env!("CARGO_MANIFEST_DIR"), "/targets/recordings/synthetic.tsv");
    let found = run(folder.path(), &format!("track '{recording}' --json --frames 10 --out .")).record();
    let page = browser.open(&folder.path().join("track.html"), "");
    let text = |recording: usize, what: &str| what.replace('R', &recording.to_string());
    for recording in [0, 1] {
        let name = &found["recordings"][recording];
        let frames = found["frames"].as_array().unwrap().iter().filter(|f| f["recording"] == *name);
        let frames: Vec<&Value> = frames.collect();
        browser.run(&page, &text(recording, "document.querySelectorAll('details.recording')[R].open = true"));
        browser.wait(
            &page,
            &text(recording, "document.querySelectorAll('details.recording')[R].dataset.drawn === 'yes'"),
        );
        // The last frame that the animation shows: its time, and its tensions to the packed precision.
        let last = "{ const box = document.querySelectorAll('details.recording')[R], bar = box.querySelector('input'); \
            bar.value = bar.max; bar.dispatchEvent(new Event('input')); \
            [...box.querySelectorAll('svg')[1].querySelectorAll('text')].map(e => e.textContent).find(t => t.endsWith(' s')) }";
        let time = browser.run(&page, &text(recording, last));
        let time: f64 = time.as_str().unwrap().trim_end_matches(" s").parse().unwrap();
        let shown = frames.iter().find(|f| (f["time_s"].as_f64().unwrap() - time).abs() < 6e-3).unwrap();
        let told: Vec<f64> =
            shown["tensions_n"].as_object().unwrap().values().map(|t| t.as_f64().unwrap()).collect();
        let drawn = browser.run(&page, &text(recording, DRAWN));
        let drawn: Vec<f64> = drawn.as_array().unwrap().iter().map(|t| t.as_f64().unwrap()).collect();
        assert_eq!(drawn.len(), told.len());
        assert!(drawn.iter().zip(&told).all(|(a, b)| (a - b).abs() < 0.1), "{drawn:?} {told:?}");
        // Courses and tensions are different curves.
        let curves = "[...document.querySelectorAll('details.recording')[R].querySelectorAll('svg')[0].querySelectorAll('path')]\
            .map(e => e.getAttribute('d')).join()";
        let courses = browser.run(&page, &text(recording, curves));
        let choose = "{ const choice = document.querySelectorAll('details.recording')[R].querySelector('select'); \
            choice.value = 'tensions'; choice.dispatchEvent(new Event('change')) }";
        browser.run(&page, &text(recording, choose));
        let tensions = browser.run(&page, &text(recording, curves));
        assert!(courses != tensions && !tensions.as_str().unwrap().contains("NaN"));
    }
}
