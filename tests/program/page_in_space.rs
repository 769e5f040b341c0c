//! The tongue in space on the page in a real browser: its numbers are the program's, it can be turned by hand, and a link restores it.
#![cfg(unix)]

use serde_json::json;

use super::browser::Browser;
use super::page_moves::{CLOSE, agree, all_are_within_reach, kept, program, same};

const REST: &str = "state.space && settled() && byId('found').textContent.startsWith('Equilibrium')";
const PICTURE: &str = "new Promise((done) => requestAnimationFrame(() => done(byId('solid').toDataURL())))";

#[test]
fn the_tongue_in_space_has_the_numbers_of_the_program_and_is_turned_by_hand() {
    let Some(mut browser) = Browser::start() else { return };
    let page = browser.open(&kept(), "#body=space&a=GGP=0.1,TRANS=0.05&view=20,10,0");
    browser.wait(&page, REST);
    let given = ["simulate", "--body", "space", "--activation", "GGP=0.1", "--activation", "TRANS=0.05"];
    let (told, _) = program(&given);
    let settle = "thinkers[0]({ ask: 'settle_in_space', activations: state.activations })";
    let found = browser.run(&page, settle);
    let paths = ["/status", "/activations", "/lengths_mm", "/positions_m", "/foremost_moved_mm", "/alarms"];
    agree(&found, &told, &paths, CLOSE, "in space");
    // The positions that are drawn are these, in micrometres.
    let flat = |positions: &serde_json::Value, by: f64| -> Vec<f64> {
        let points = positions.as_array().unwrap().iter().flat_map(|p| p.as_array().unwrap());
        points.map(|x| x.as_f64().unwrap() * by).collect()
    };
    let drawn = browser.run(&page, "solid.positions_um()");
    same(&drawn, &json!(flat(&told["positions_m"], 1e6)), 1e-6, "the picture");
    // A slider is moved by keyboard; a few iterations at a time lead to the solution from rest.
    let before = browser.run(&page, PICTURE);
    browser.run(&page, "byId('act-2').focus()");
    for _ in 0..4 {
        browser.press(&page, "ArrowRight", 39);
    }
    browser.wait(&page, &format!("state.activations[2] > 0.035 && {REST}"));
    let moved = "worker({ ask: 'move_in_space', activations: state.activations, iterations: 30 })";
    let moved = browser.run(&page, moved);
    assert_eq!(moved["status"], "converged");
    let settled = flat(&browser.run(&page, settle)["positions_m"], 1e6);
    let micrometres: Vec<f64> =
        moved["positions_um"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    assert_eq!(micrometres.len(), settled.len());
    assert!(micrometres.iter().zip(&settled).all(|(a, b)| (a - b).abs() < 1.0));
    let pulled = browser.run(&page, PICTURE);
    assert_ne!(pulled, before);

    // The view is turned by keyboard and by buttons, and cut.
    browser.run(&page, "byId('turn').focus()");
    browser.press(&page, "ArrowRight", 39);
    browser.wait(&page, "state.view[0] === 21 && settled()");
    let turned = browser.run(&page, PICTURE);
    assert_ne!(turned, pulled);
    browser.run(&page, "byId('cut').click()");
    assert_ne!(browser.run(&page, PICTURE), turned);
    browser.wait(&page, "location.hash.includes('view=21,10,1')");
    // The link opens the same view on another page, and a saved picture names the active muscles.
    let link = browser.run(&page, "link()");
    let other = browser.open(&kept(), link.as_str().unwrap());
    browser.wait(&other, REST);
    assert_eq!(browser.run(&other, "link()"), link);
    same(&browser.run(&other, "solid.positions_um()"), &json!(settled), 1e-6, "the link");
    let svg = browser.run(&other, "picture()");
    let document = roxmltree::Document::parse(svg.as_str().unwrap()).unwrap();
    assert!(document.descendants().filter(|n| n.has_tag_name("path")).count() > 100);
    assert!(svg.as_str().unwrap().contains("GGP=0.1, "), "{svg}");
    // The page returns to the plane.
    browser.set(&other, "body", "change", "springs");
    browser.wait(&other, "!state.space && settled() && shape !== null && byId('mouth').clientWidth > 0");
    assert!(!browser.run(&other, "link()").as_str().unwrap().contains("space"));

    let wrong = browser.open(&kept(), "#body=space&a=GGX=0.1,GGP=2&view=500,0,0");
    browser.wait(&wrong, "state.space && settled()");
    let said = browser.run(&wrong, "byId('trouble').textContent");
    for part in ["a=GGX=0.1 is no activation", "a=GGP=2 is no activation", "view=500,0,0 is not 3 numbers"] {
        assert!(said.as_str().unwrap().contains(part), "{said}");
    }
}

#[test]
fn in_space_every_control_is_within_reach_and_a_scroll_neither_turns_nor_pulls() {
    let Some(mut browser) = Browser::start() else { return };
    let page = browser.open(&kept(), "#body=space&a=GGP=0.1");
    browser.wait(&page, REST);
    all_are_within_reach(&mut browser, &page, 20);
    let (nameless, controls) = browser.nameless_controls(&page);
    assert!(nameless.is_empty() && controls > 20, "{nameless:?} of {controls}");
    // On a phone a finger scrolls if it moves up the picture, and turns the view if it moves along it.
    browser.run(&page, "scrollTo(0, 0)");
    let place = "(() => { const b = byId('solid').getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()";
    let at = browser.run(&page, place);
    let [x, y] = [0, 1].map(|i| at[i].as_f64().unwrap());
    let view = browser.run(&page, "state.view.slice()");
    browser.swipe(&page, [x, y], [x + 3.0, y - 150.0]);
    browser.wait(&page, "scrollY > 60");
    let turned = "Math.abs(state.view[0] - 40)";
    assert!(browser.run(&page, turned).as_f64().unwrap() < 4.0, "{view}");
    std::thread::sleep(std::time::Duration::from_millis(600));
    browser.run(&page, "scrollTo(0, 0)");
    browser.swipe(&page, [x, y], [x + 80.0, y + 2.0]);
    browser.wait(&page, &format!("{turned} > 20"));
}
