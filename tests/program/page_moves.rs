//! The page with the moving tongue in a real browser: its numbers are the program's, its controls work, and invalid input does not break
//! it.
#![cfg(unix)]

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::browser::{Browser, Page};
use super::run::{self, Done};

/// A link without a vowel, so that the page neither fits nor samples.
const NO_VOWEL: &str = "#k=stretch";
/// Names a newly built page that is tested in place of the committed one (`.ci/page`).
const BUILT: &str = "TONGUE_FIT_PAGE";
const MUSCLES: [&str; 8] = ["GGa", "GGm", "GGp", "SGp", "SGm", "SGa", "HGa", "HGp"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

pub(super) fn kept() -> PathBuf {
    std::env::var_os(BUILT).map_or_else(|| root().join("web/tongue.html"), PathBuf::from)
}

/// The JSON and the errors that the program prints.
pub(super) fn program(arguments: &[&str]) -> (Value, String) {
    let folder = tempfile::tempdir().unwrap();
    let done: Done = run::program(folder.path(), "--json").args(arguments).output().unwrap().into();
    (serde_json::from_str(&done.out).unwrap_or_default(), done.err)
}

/// Sends a request to the library in the page.
fn ask(browser: &mut Browser, page: &Page, request: &Value) -> Value {
    browser.run(page, &format!("live.ask({request})"))
}

fn scene(effects: Value) -> Value {
    let mut all = json!({"incompressibility": true});
    all.as_object_mut().unwrap().extend(effects.as_object().unwrap().clone());
    json!({"title": "t", "want": "shape", "body": {"tongue": {}}, "effects": all})
}

fn open(browser: &mut Browser, page: &Page, h_mm: f64, continuum: bool) {
    let body = json!({"h_mm": h_mm, "continuum": continuum});
    let made = ask(browser, page, &json!({"ask": "open", "body": body, "scene": scene(json!({}))}));
    assert!(made["error"].is_null(), "{made}");
}

/// Tolerance of numbers, relative to the larger one and 1.
pub(super) const CLOSE: f64 = 1e-9;
/// Tolerance of a fit of a continuum, whose search ends at steps below 1e-4 N, where the last digits of its equilibria matter.
const CLOSE_IN_A_SEARCH: f64 = 1e-6;
/// Tolerance of numbers from draws: the exponential function in the page rounds differently, and chains part as they go on.
const CLOSE_IN_DRAWS: f64 = 0.01;

/// Compares two records: all numbers in `paths` must exist and agree.
pub(super) fn agree(page: &Value, program: &Value, paths: &[&str], close: f64, what: &str) {
    for path in paths {
        let [a, b] =
            [page, program].map(|v| v.pointer(path).unwrap_or_else(|| panic!("{what}: {path} in {v}")));
        same(a, b, close, &format!("{what} {path}"));
    }
}

pub(super) fn same(a: &Value, b: &Value, close: f64, what: &str) {
    match (a, b) {
        (Value::Number(x), Value::Number(y)) => {
            let [x, y] = [x, y].map(|n| n.as_f64().unwrap());
            assert!((x - y).abs() <= close * x.abs().max(y.abs()).max(1.0), "{what}: {x} {y}");
        }
        (Value::Array(x), Value::Array(y)) => {
            assert_eq!(x.len(), y.len(), "{what}");
            x.iter().zip(y).for_each(|(x, y)| same(x, y, close, what));
        }
        (Value::Object(x), Value::Object(y)) => {
            assert_eq!(x.keys().collect::<Vec<_>>(), y.keys().collect::<Vec<_>>(), "{what}");
            x.iter().for_each(|(key, x)| same(x, &y[key], close, &format!("{what} {key}")));
        }
        _ => assert_eq!(a, b, "{what}"),
    }
}

#[test]
fn the_numbers_of_the_page_are_those_of_the_program() {
    let Some(mut browser) = Browser::start() else { return };
    let page = browser.open(&kept(), NO_VOWEL);
    let simulated =
        ["/status", "/lengths_mm", "/ratios", "/stretches", "/positions_m", "/tensions_n", "/energy_j"];
    let fitted = ["/status", "/active", "/tensions_n", "/lengths_mm", "/ratios", "/stretches", "/residuals"];
    for (h_mm, continuum) in [(5.5, false), (2.75, false), (8.0, true)] {
        open(&mut browser, &page, h_mm, continuum);
        let h = format!("{h_mm}mm");
        let mut body = vec!["--h", &h];
        body.extend(continuum.then_some(["--body", "continuum"]).into_iter().flatten());
        for tensions in [vec!["GGa=12", "SGm=11.5", "HGa=4.5"], vec!["GGp=45", "SGa=4", "HGp=80"], vec![]] {
            let given = tensions.iter().flat_map(|t| ["--tension", t]);
            let arguments: Vec<&str> = ["simulate"].into_iter().chain(given).chain(body.clone()).collect();
            let request = json!({"ask": "simulate", "tensions": tensions, "scene": scene(json!({}))});
            let found = ask(&mut browser, &page, &request);
            agree(&found, &program(&arguments).0, &simulated, CLOSE, &format!("{arguments:?}"));
        }
        if h_mm == 2.75 {
            continue;
        }
        for (subject, vowel, target) in [("S2", "a", "stretch"), ("S1", "o", "stretch"), ("S2", "a", "ratio")]
        {
            let row =
                ["--subject", subject, "--vowel", vowel, "--target", target, "--method", "gauss-newton"];
            let arguments: Vec<&str> = row.into_iter().chain(body.clone()).collect();
            let request = json!({"ask": "fit", "subject": subject, "vowel": vowel, "target": target});
            let found = ask(&mut browser, &page, &request);
            let close = if continuum { CLOSE_IN_A_SEARCH } else { CLOSE };
            agree(&found, &program(&arguments).0, &fitted, close, &format!("{arguments:?}"));
            if continuum {
                break;
            }
        }
    }
    // Weight, palate, jaw and hyoid of built-in scenes.
    open(&mut browser, &page, 5.5, false);
    for (name, tensions, effects) in [
        ("supine", vec![], json!({"gravity": {"posture": "supine"}})),
        ("vowel-i-palate", vec!["GGp=60", "SGa=40"], json!({"contact": {}})),
        ("vowel-a-jaw", vec!["GGa=12", "SGm=11.5", "HGa=4.5"], json!({"jaw": {"opening_deg": 4.0}})),
    ] {
        let request = json!({"ask": "simulate", "tensions": tensions, "scene": scene(effects)});
        let found = ask(&mut browser, &page, &request);
        agree(&found, &program(&["scene", "run", name]).0, &["/positions_m"], CLOSE, name);
    }
    // A fit with palate and teeth is the equilibrium of its tensions against these walls.
    for (target, vowel) in [("stretch", "i"), ("stretch", "a"), ("ratio", "i")] {
        let fit = json!({"ask": "fit", "subject": "S2", "vowel": vowel, "target": target, "walls": true});
        let fit = ask(&mut browser, &page, &fit);
        assert!(fit["misfit"].as_f64().unwrap() < 0.01, "{vowel} {target}: {fit}");
        let tensions = fit["tensions_n"].as_object().unwrap().iter();
        let tensions: Vec<String> = tensions.map(|(name, n)| format!("{name}={n}")).collect();
        let effects = json!({"contact": {}});
        let request = json!({"ask": "simulate", "tensions": tensions, "scene": scene(effects)});
        let found = ask(&mut browser, &page, &request);
        assert_eq!(found["status"], "converged");
        let close = 1e-6;
        same(&found["lengths_mm"], &fit["lengths_mm"], close, &format!("{vowel} {target} with walls"));
    }
}

#[test]
fn a_vowel_of_the_page_has_the_formants_of_the_command_sound() {
    let Some(mut browser) = Browser::start() else { return };
    let page = browser.open(&kept(), "#s=S2&v=a&k=stretch");
    for vowel in ["a", "i", "e", "o", "ɯ"] {
        browser.run(&page, &format!("choose('{vowel}')"));
        let fitted = format!(
            "settled() && state.vowel === '{vowel}' && (state.vowel === 'ɯ' || fit?.vowel === '{vowel}')"
        );
        browser.wait(&page, &fitted);
        let said = program(&["sound", "--vowel", vowel]).0;
        let ours = browser.run(&page, "Array.from(shape.formants).slice(0, 4)");
        for (page, program) in ours.as_array().unwrap().iter().zip(said["formants_hz"].as_array().unwrap()) {
            let off = page.as_f64().unwrap() - program.as_f64().unwrap();
            assert!(off.abs() < 1.0, "/{vowel}/: {ours} and {}", said["formants_hz"]);
        }
        let words = browser.run(&page, "byId('formants').textContent");
        let nearest = format!("Nearest to /{}/: ", said["nearest_vowel"].as_str().unwrap());
        assert!(words.as_str().unwrap().starts_with(&nearest), "{words}");
    }
    // Against another baseline than /ɯ/ rest is another vowel than the one from which the tract's file counts jaw and hyoid.
    browser.run(&page, "state.subject = 'S4'; makeVowels(); choose('a')");
    browser.wait(&page, "settled() && fit?.subject === 'S4'");
    assert_eq!(browser.run(&page, "[state.baseline, spoken, state.bones]"), json!(["e", null, [0, 0, 0]]));
    let said = browser.run(&page, "byId('verdict').textContent");
    assert!(
        said.as_str().unwrap().contains("known from /ɯ/ only")
            && !said.as_str().unwrap().contains("Shown as spoken")
    );
    // Labels in upper case are the same vowels.
    let lips = "[body.tract.posture.a.lip_opening_mm, body.tract.posture.a.lip_protrusion_mm]";
    let rows = "subject,vowel,GGa_mm,GGm_mm,GGp_mm,SGp_mm,SGm_mm,SGa_mm,HGa_mm,HGp_mm\n\
                X,U,46,56,46,56,25,40,36,31\nX,A,38,57,50,54,21,47,33,33\n";
    browser.run(&page, &format!("readTable({{ text: {}, file: 'mine.csv' }})", json!(rows)));
    browser.run(&page, "state.target = 'stretch'; choose('A')");
    browser.wait(&page, "settled() && fit?.vowel === 'A'");
    assert_eq!(browser.run(&page, "spoken?.posture"), browser.run(&page, "body.tract.posture.a"));
    assert_eq!(browser.run(&page, "state.lips"), browser.run(&page, lips));
}

#[test]
fn the_controls_move_the_tongue_and_the_link_holds_all_of_it() {
    let Some(mut browser) = Browser::start() else { return };
    let page = browser.open(&kept(), "");
    let drawn = "document.querySelector('#mouth .tissue').getAttribute('d')";
    assert_eq!(browser.run(&page, "state.vowel"), "a");

    // A slider is moved by keyboard: the tension grows by a step, and the tongue moves.
    browser.wait(&page, "!asked && !checking && byId('found').textContent.startsWith('Equilibrium')");
    let (before, tension) =
        (browser.run(&page, drawn), browser.run(&page, "state.tensions[0]").as_f64().unwrap());
    browser.run(&page, "byId('pull-0').focus()");
    for _ in 0..5 {
        browser.press(&page, "ArrowRight", 39);
    }
    browser.wait(&page, &format!("state.tensions[0] > {tension} + 0.4 && !asked && {drawn} !== {before}"));
    browser.press(&page, "Home", 36);
    browser.wait(&page, "state.tensions[0] === 0 && !asked");
    // The page says that the verdict is of other tensions, and offers to restore them.
    let changed = browser.run(&page, "byId('changed').hidden ? '' : byId('changed').innerText");
    assert!(changed.as_str().unwrap().starts_with("Changed by hand since: GGa "), "{changed}");
    browser.run(&page, "byId('changed').querySelector('button').click()");
    browser.wait(&page, "!asked && byId('changed').hidden && state.tensions[0] === fitted().tensions[0]");

    // A decimal comma is a decimal point.
    browser.set(&page, "n-0", "change", "12,5");
    browser.wait(&page, "state.tensions[0] === 12.5 && !asked");

    // Along the solution curve the fitted ratios keep their measured values.
    browser.run(&page, "state.target = 'ratio'; choose('a')");
    browser.wait(&page, "fit?.valley && !byId('valley').hidden && !asked");
    browser.run(&page, "byId('along').focus()");
    browser.press(&page, "End", 35);
    browser.wait(&page, "state.along === fit.valley.points.length - 1 && !asked");
    let pulled = browser.run(&page, "state.tensions[0]").as_f64().unwrap();
    assert!(pulled > 80.0, "{pulled}");
    for muscle in ["SGm", "HGa"] {
        let at = MUSCLES.iter().position(|m| *m == muscle).unwrap();
        let off = browser.run(&page, &format!("simulated()[{at}] - measured('{muscle}')")).as_f64().unwrap();
        assert!(off.abs() < 2e-3, "{muscle} {off}");
    }

    browser.run(&page, "byId('slack').click()");
    browser.wait(&page, "!asked && state.vowel === '' && state.tensions.every((t) => t === 0)");
    browser.run(&page, "pull(0, 20)");
    browser.wait(&page, "!asked");

    // Jaw, weight, palate and the other body each move the tongue, and each can be undone.
    for (control, event, there, back) in [
        ("jaw", "input", "6", "0"),
        ("gravity", "change", "supine", ""),
        ("body", "change", "continuum", "springs"),
    ] {
        let before = browser.run(&page, drawn);
        browser.set(&page, control, event, there);
        browser.wait(&page, &format!("!asked && shape && {drawn} !== {before}"));
        browser.set(&page, control, event, back);
        browser.wait(&page, "!asked && shape && state.continuum === false && body.continuum === false");
    }
    // The link opens the same posture on another page.
    browser.run(&page, "byId('palate').click(); state.bones = [3, 2, -1.5]; state.tensions[2] = 30");
    browser.run(&page, "showControls(); move()");
    browser.wait(&page, "!asked && !checking && location.hash.includes('bones=3,2,-1.5')");
    let link = browser.run(&page, "link()");
    let positions = browser.run(&page, "Array.from(shape.at)");
    let other = browser.open(&kept(), link.as_str().unwrap());
    browser
        .wait(&other, "settled() && shape !== null && byId('found').textContent.startsWith('Equilibrium')");
    let again = browser.run(&other, "Array.from(shape.at)");
    same(&again, &positions, CLOSE, "the link");
    assert_eq!(browser.run(&other, "link()"), link);

    // Pictures can be saved, the page has a dark and a light mode, and controls have names for screen readers.
    let svg = browser.run(&other, "pictureText(byId('mouth'), made(), caption())");
    let text = svg.as_str().unwrap();
    let document = roxmltree::Document::parse(text).unwrap();
    assert!(document.descendants().filter(|n| n.has_tag_name("text")).count() >= 8);
    for part in ["N per metre of thickness: GGa 20.0", "Jaw 3.0° open", "10 mm", "muscles pull as given"] {
        assert!(text.contains(part), "{part} is not in {text}");
    }
    let version = tongue_fit::VERSION.split(' ').next().unwrap();
    assert!(text.contains(version) && !text.contains("light-dark"), "{text}");
    let png = browser.run(&other, "png().then((b) => b.arrayBuffer()).then((b) => Array.from(new Uint8Array(b).slice(0, 4)).concat(b.byteLength))");
    assert_eq!(png.as_array().unwrap()[..4], [137, 80, 78, 71].map(Value::from));
    assert!(png[4].as_u64().unwrap() > 20_000);
    let background = "getComputedStyle(document.body).backgroundColor";
    let light = browser.run(&other, background);
    browser.run(&other, "byId('theme').click()");
    assert_ne!(browser.run(&other, background), light);
    let (nameless, controls) = browser.nameless_controls(&other);
    assert!(nameless.is_empty() && controls > 35, "{nameless:?} of {controls}");

    assert_eq!(browser.run(&page, "errors.length"), 0);
}

#[test]
fn the_page_says_of_every_muscle_how_probably_it_pulls_harder_and_the_sliders_go_on() {
    let Some(mut browser) = Browser::start() else { return };
    let page = browser.open(&kept(), "#s=S2&v=e&k=stretch");
    // The sentences are the program's, with its numbers.
    let (told, _) = program(&["--vowel", "e", "--target", "stretch"]);
    browser.wait(&page, "rises !== null");
    let found = browser.run(&page, "rises");
    same(&found["muscles"], &told["verdict"], CLOSE_IN_DRAWS, "the verdict");
    let said = browser.run(&page, "byId('rises').textContent");
    let said = said.as_str().unwrap();
    let harder = found["sentences"][0].as_str().unwrap();
    assert!(said.starts_with(harder) && harder.contains("in /ɯ/"), "{said}");
    let shown = browser.run(&page, "rows.map((r) => r.rise.textContent + ' ' + r.rise.title)");
    for (shown, muscle) in shown.as_array().unwrap().iter().zip(found["muscles"].as_array().unwrap()) {
        let p = muscle["p_rises"].as_f64().unwrap().clamp(0.01, 0.99);
        assert!(
            shown.as_str().unwrap().contains(&format!("{p:.2} {}, ", muscle["muscle"].as_str().unwrap())),
            "{shown}"
        );
    }
    // After a change by hand the probabilities are marked as those of the fit.
    assert_eq!(browser.run(&page, "byId('rises').classList.contains('old')"), false);
    browser.run(&page, "pull(0, 33)");
    browser.wait(&page, "settled() && byId('rises').classList.contains('old') && !byId('changed').hidden");
    // While a verdict is made the sliders move the tongue; a verdict that is no longer wanted is not shown.
    let frames = "(async () => { choose('a'); await new Promise((done) => setTimeout(done, 20)); const count = []; \
        while (rises === null && count.length < 40) { pull(1, 2 + count.length); await new Promise(requestAnimationFrame); \
        await new Promise(requestAnimationFrame); count.push(shape.lengths[1]); } return [new Set(count).size, count.length, rises === null]; })()";
    let moved = browser.run(&page, frames);
    assert!(moved[0].as_u64().unwrap() >= 5 && moved[0] == moved[1], "{moved}");
    browser.run(&page, "(choose('o'), choose('i'))");
    browser.wait(&page, "rises !== null && fit?.vowel === 'i'");
    let told = program(&["--vowel", "i", "--target", "stretch"]).0;
    // A probability from 240 draws is known to about 0.05; here chains have parted.
    let probabilities = |verdict: &Value| -> Vec<f64> {
        verdict.as_array().unwrap().iter().map(|m| m["p_rises"].as_f64().unwrap()).collect()
    };
    let of_page = probabilities(&browser.run(&page, "rises.muscles"));
    let apart = of_page.iter().zip(probabilities(&told["verdict"])).map(|(a, b)| (a - b).abs());
    assert!(of_page.len() == 8 && apart.fold(0.0, f64::max) < 0.1, "{of_page:?}, {told}");
    // The baseline has no verdict, and a body for which it takes too long has a note.
    browser.run(&page, "choose('ɯ')");
    let words = "byId('rises').textContent + rows.map((r) => r.rise.textContent).join('')";
    assert_eq!(browser.run(&page, words), "");
    browser.set(&page, "body", "change", "continuum");
    browser.run(&page, "choose('a')");
    browser.wait(&page, "byId('rises').textContent.includes('--posterior 2000')");
}

#[test]
fn a_shape_beyond_palate_or_teeth_is_told() {
    let Some(mut browser) = Browser::start() else { return };
    let told = "byId('beyond').hidden ? '' : byId('beyond').textContent";
    for (palate, goes_through) in [(0, true), (1, false)] {
        let page = browser.open(&kept(), &format!("#s=S2&v=i&k=stretch&palate={palate}"));
        browser.wait(&page, "settled() && fit?.vowel === 'i'");
        // The tensions are those of the built-in scene of /i/ against the palate.
        browser.run(&page, "state.tensions = [0, 0, 45, 0, 0, 4, 0, 0]; showControls(); move()");
        browser.wait(&page, "settled() && state.tensions[2] === 45");
        let said = browser.run(&page, told);
        let words = " mm through palate or teeth, which are set not to stop it.";
        let expected = said.as_str().unwrap().ends_with(words);
        assert_eq!((expected, said == ""), (goes_through, !goes_through), "palate={palate}: {said}");
        // Where the shape from rest replaces the one on the screen, the text describes the new one.
        let other = "(shape = { ...shape, at: shape.at.map((x) => x + 1e-3), beyond: 2e-3 - shape.beyond }, check(), 0)";
        browser.run(&page, other);
        browser.wait(&page, "settled()");
        assert_eq!(browser.run(&page, told), said, "palate={palate}");
    }
}

#[test]
fn a_page_holds_a_table_of_ones_own_whatever_its_labels() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let (table, out) = (folder.path().join("my.csv"), folder.path().join("mine.html"));
    let label = "</script><script>document.title='broken'</script><!--<b>&amp;\"'";
    let columns = "GGa_mm,GGm_mm,GGp_mm,SGp_mm,SGm_mm,SGa_mm,HGa_mm,HGp_mm";
    let quoted = label.replace('"', "\"\"");
    let [u, a] = ["ɯ,46,56,46,56,25,40,36,31", "a,38,57,50,54,21,47,33,33"];
    let rows = format!("subject,vowel,{columns}\n\"{quoted}\",{u}\n\"{quoted}\",{a}\nY,{a}\n");
    std::fs::write(&table, rows).unwrap();
    let [table, out_text] = [&table, &out].map(|p| p.to_str().unwrap());
    let (made, told) = program(&["page", "--lengths", table, "--out", out_text]);
    assert_eq!(made["fits"], 2, "{told}");
    let text = std::fs::read_to_string(&out).unwrap();
    assert!(text.contains(tongue_fit::VERSION) && text.contains("page --lengths"));
    assert!(text.len() < 3_000_000 && !text.contains(label));

    let page = browser.open(&out, "");
    assert_eq!(browser.run(&page, "state.subject"), label);
    assert_eq!(browser.run(&page, "byId('subject').selectedOptions[0].textContent"), label);
    assert_ne!(browser.run(&page, "document.title"), "broken");
    browser.run(&page, "state.target = 'stretch'; choose('a')");
    browser.wait(&page, "fit?.target_kind === 'stretch'");
    let said = browser.run(&page, "byId('verdict').textContent");
    assert!(said.as_str().unwrap().contains("as the file has it"), "{said}");
    // The fit that the page makes is the one that was put into it.
    let request = json!({"ask": "fit", "subject": label, "vowel": "a", "target": "stretch", "walls": true});
    let found = ask(&mut browser, &page, &request);
    let embedded = browser.run(&page, "fit");
    agree(&found, &embedded, &["/tensions_n", "/lengths_mm"], CLOSE, "own table");

    // The page contains the user's own body.
    let mesh = root().join("targets/anatomy.toml");
    program(&["page", "--anatomy", mesh.to_str().unwrap(), "--h", "6.5mm", "--out", out_text]);
    let page = browser.open(&out, "");
    assert_eq!(browser.run(&page, "body.what"), "a tongue at 6.5 mm");
    assert_eq!(browser.run(&page, "own.fits.length"), 30);
    // The page has the body's spacing, and for a continuum the program's default.
    program(&["page", "--no-fits", "--body", "continuum", "--out", out_text]);
    let own = std::fs::read_to_string(&out).unwrap();
    for field in [r#""continuum":true"#, r#""continuum_h_mm":4.0"#, r#""springs_h_mm":null"#] {
        assert!(own.contains(field), "{field}");
    }
}

#[test]
fn the_page_refuses_with_the_messages_of_the_program() {
    let Some(mut browser) = Browser::start() else { return };
    let page = browser.open(&kept(), NO_VOWEL);
    for word in ["GGa=-3", "GGa=x", "GGb=3", "GGa", "GGa=1e400"] {
        let said = ask(&mut browser, &page, &json!({"ask": "tensions", "tensions": [word]}));
        let (_, told) = program(&["simulate", "--tension", word]);
        assert_eq!(format!("error: --tension {}\n", said["error"].as_str().unwrap()), told);
    }
    let folder = tempfile::tempdir().unwrap();
    for table in ["", "a,b\n1,2\n", "subject,vowel,GGa_mm,SGm_mm\nX,a,40,20\n"] {
        let path = folder.path().join("my.csv");
        std::fs::write(&path, table).unwrap();
        let path = path.to_str().unwrap();
        let said = ask(&mut browser, &page, &json!({"ask": "table", "text": table, "file": path}));
        let fit = json!({"ask": "fit", "subject": "X", "vowel": "a", "target": "ratio"});
        let said = if said["error"].is_null() { ask(&mut browser, &page, &fit) } else { said };
        let (_, told) = program(&["--lengths", path, "--subject", "X", "--vowel", "a"]);
        assert_eq!(format!("error: {}\n", said["error"].as_str().unwrap()), told);
    }
    // The library in the page survives numbers far out of range and invalid requests.
    ask(&mut browser, &page, &json!({"ask": "table", "text": null, "file": ""}));
    let answers = browser.run(&page, include_str!("invalid_requests.js"));
    assert_eq!(answers.as_array().unwrap().len(), 17);
    for answer in answers.as_array().unwrap() {
        let said = answer[1].as_str().unwrap();
        let is_answer = said.contains("error") || said.contains("status");
        assert!(is_answer && !said.contains("itself failed"), "{answer}");
    }
    // A link with invalid parts gets a message that stays until it is closed.
    let page = browser.open(&kept(), "#t=GGa=-3&s=S9&v=q&k=width&bones=a,b&along=-7&gravity=up&body=jelly");
    browser.run(&page, "pull(1, 5)");
    browser.wait(&page, "!asked && !checking && byId('found').textContent.startsWith('Equilibrium')");
    std::thread::sleep(std::time::Duration::from_millis(500));
    let said = browser.run(&page, "byId('trouble').textContent");
    let said = said.as_str().unwrap();
    assert!(said.starts_with("GGa=-3: the tension of GGa is -3;"), "{said}");
    for wrong in ["s=S9", "v=q", "k=width", "bones=a,b", "gravity=up", "body=jelly"] {
        assert!(said.contains(&format!("{wrong} is no")), "{wrong} is not in {said}");
    }
    browser.run(&page, "byId('trouble').querySelector('button').click()");
    assert_eq!(browser.run(&page, "byId('trouble').hidden"), true);
}

/// Delays what the page sends to its workers, as on a slow machine: a link must not be overwritten before it has been used.
const SLOW_WORKERS: &str = "window.Worker = class extends Worker { postMessage(sent) { setTimeout(() => super.postMessage(sent), 600); } }";

#[test]
fn a_table_of_ones_own_goes_with_the_link_or_is_asked_for() {
    let Some(mut browser) = Browser::start() else { return };
    let page = browser.open(&kept(), "");
    // Without /ɯ/ in the table another baseline is chosen.
    let table = "subject,vowel,GGa_mm,SGm_mm,HGa_mm\nX,e,46,25,36\nX,a,38,21,33\nX,o,40,23,34\n";
    browser.run(&page, &format!("readTable({{ text: {}, file: 'mine.csv' }})", json!(table)));
    assert_eq!(browser.run(&page, "state.subject + state.baseline"), "Xe");
    browser.set(&page, "baseline", "change", "o");
    browser.run(&page, "choose('a')");
    browser.wait(&page, "fit?.baseline === 'o' && fit.subject === 'X' && settled()");
    let positions = browser.run(&page, "Array.from(shape.at)");
    let link = browser.run(&page, "link()");
    let other = browser.open_after(SLOW_WORKERS, &kept(), link.as_str().unwrap());
    browser.wait(&other, "settled() && fit?.subject === 'X' && fit.baseline === 'o'");
    same(&browser.run(&other, "Array.from(shape.at)"), &positions, CLOSE, "the link's table");
    // A table that is too large for a link is named in it, and the page asks for it and does not fit another table's row.
    browser.run(&page, "table.text = table.text.padEnd(7000)");
    assert_eq!(browser.run(&page, "unheld()"), "mine.csv");
    let link = browser.run(&page, "link()");
    let other = browser.open(&kept(), link.as_str().unwrap());
    browser.wait(&other, "settled() && byId('verdict').textContent.includes('open that table')");
    assert_eq!(browser.run(&other, "fit"), Value::Null);
    same(&browser.run(&other, "Array.from(shape.at)"), &positions, CLOSE, "the link without its table");
}

/// Controls that are lower or narrower than 24 px, and those that something covers while they have the focus.
const OUT_OF_REACH: &str = include_str!("out_of_reach.js");

/// Every control of a page is within reach on a large screen, a small one and a phone, which stays set; there are more than `least`.
pub(super) fn all_are_within_reach(browser: &mut Browser, page: &Page, least: u64) {
    for (width, height, phone) in [(1280, 900, false), (640, 400, false), (390, 800, true)] {
        browser.size(page, width, height, phone);
        let found = browser.run(page, OUT_OF_REACH);
        assert!(found["count"].as_u64().unwrap() > least, "{found}");
        for wrong in ["small", "covered"] {
            assert_eq!(found[wrong], json!([]), "{width} x {height}: {found}");
        }
        assert_eq!(found["wide"], false, "{width} x {height}");
    }
}

#[test]
fn every_control_is_within_reach_on_any_screen_and_a_scroll_pulls_no_muscle() {
    let Some(mut browser) = Browser::start() else { return };
    let page = browser.open(&kept(), "");
    // The sentences of the verdict would move what stands below them.
    browser.wait(&page, "settled() && rises !== null");
    all_are_within_reach(&mut browser, &page, 40);
    // The room that is kept for the sentences is large enough, so that sliders do not move under a finger.
    let more = "byId('rises').offsetHeight - parseFloat(getComputedStyle(byId('rises')).minHeight)";
    let more = browser.run(&page, more);
    assert!(more.as_f64().unwrap() < 1.0, "{more} px");
    // On a phone: swipes up and down that begin on sliders, and then one along a slider.
    let place = "(() => { const b = byId('pull-3').getBoundingClientRect(); return [b.x, b.y + b.height / 2, b.width]; })()";
    let before =
        browser.run(&page, "byId('pull-3').scrollIntoView({ block: 'end' }); state.tensions.slice()");
    for part in [0.1, 0.3, 0.5, 0.7, 0.9] {
        browser.run(&page, "byId('pull-3').scrollIntoView({ block: 'end' })");
        let top = browser.run(&page, "scrollY");
        let at = browser.run(&page, place);
        let [x, y, wide] = [0, 1, 2].map(|i| at[i].as_f64().unwrap());
        browser.swipe(&page, [x + part * wide, y], [x + part * wide + 6.0, y - 250.0]);
        browser.wait(&page, &format!("!asked && scrollY > {top} + 100"));
        assert_eq!(browser.run(&page, "state.tensions.slice()"), before, "{part}");
        assert_eq!(browser.run(&page, "Number(byId('pull-3').value)"), before[3], "{part}");
    }
    // A page goes on scrolling after a swipe; the slider is located once the page stands still.
    let still = "(() => { const still = window.stood === scrollY; window.stood = scrollY; return still; })()";
    browser.wait(&page, still);
    std::thread::sleep(std::time::Duration::from_millis(500));
    browser.run(&page, "byId('pull-3').scrollIntoView({ block: 'end' })");
    let at = browser.run(&page, place);
    let [x, y, wide] = [0, 1, 2].map(|i| at[i].as_f64().unwrap());
    browser.swipe(&page, [x + 0.2 * wide, y], [x + 0.8 * wide, y + 4.0]);
    browser.wait(&page, "!asked && state.tensions[3] > 60 && state.tensions[3] < 95");
}

/// A voice of four seconds while jaw, lips and all tensions change 30 times a second, played from 0 to 3.5 s: the largest step between
/// samples within 4 ms of a change and elsewhere, and the peaks of the first 5 ms, of all, and after the end.
const VOICE: &str = include_str!("voice.js");

#[test]
fn the_voice_is_off_at_first_and_changes_without_clicks() {
    let Some(mut browser) = Browser::start() else { return };
    let page = browser.open(&kept(), NO_VOWEL);
    let heard = browser.run(&page, VOICE);
    let of = |name: &str| heard[name].as_f64().unwrap();
    assert_eq!(heard["silent"], true);
    assert!(of("near") < 1.2 * of("between"), "{heard}");
    assert!(of("first") < 0.5 * of("all") && of("last") < 1e-3 * of("all"), "{heard}");
    assert!(of("all") > 0.01 && of("all") < 0.2, "{heard}");
}

#[test]
fn the_page_that_is_kept_is_made_of_its_sources_and_needs_nothing_else() {
    let read = |name: &str| std::fs::read_to_string(root().join(name)).unwrap();
    let page = std::fs::read_to_string(kept()).unwrap();
    assert!(page.len() < 3_000_000, "{}", page.len());
    let wasm = page.split_once("id=\"wasm\">").unwrap().1.split_once("</script>").unwrap().0;
    let script = ["engine.js", "mouth.js", "space.js", "sound.js", "page.js"]
        .map(|name| read(&format!("web/page/{name}")))
        .join("\n");
    let made = read("web/page/page.html")
        .replace("{{style}}", &(read("crates/files/src/report/page.css") + &read("web/page/page.css")))
        .replace("{{script}}", &script)
        .replace("{{wasm}}", wasm);
    assert!(made == page, "web/tongue.html is not of its sources; run web/build.py");
    let addresses = page.replace("http://www.w3.org/", "");
    assert!(!addresses.contains("http://") && !addresses.contains("https://"), "the page needs no network");
}
