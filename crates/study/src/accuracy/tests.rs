//! The study measures all axes, lists refused runs, and has only measured numbers on its page.

use std::collections::BTreeSet;
use std::sync::OnceLock;

use tongue_files::VERSION;
use tongue_files::report::Provenance;

use super::axes::page as made;
use super::runs::Ended;
use super::trajectory::{PARTS_OF_LIMIT, STEP_TOLERANCES};
use super::{AccuracyStudy, Effort, files, run};
use crate::measure::observed_order;

fn tiny() -> &'static AccuracyStudy {
    static STUDY: OnceLock<AccuracyStudy> = OnceLock::new();
    STUDY.get_or_init(|| run(&Effort::TINY).unwrap())
}

fn page(study: &AccuracyStudy) -> String {
    made(study, "Made by a test.").unwrap()
}

#[test]
fn every_file_is_made_and_every_run_is_a_row() {
    let study = tiny();
    let by = Provenance::new("a test");
    let files = files(study, "Made by a test.").unwrap();
    let files: Vec<(&str, String)> = files.iter().map(|(n, f)| (*n, f.text(&by).unwrap())).collect();
    let names: BTreeSet<&str> = files.iter().map(|(n, _)| *n).collect();
    let page = page(study);
    for (name, text) in &files {
        assert!(text.contains("a test") && text.contains(VERSION), "{name}");
        if name.ends_with(".svg") {
            assert!(page.contains(&format!("({name})")), "the page shows {name}");
            roxmltree::Document::parse(text).unwrap();
        }
    }
    let rows = |name: &str| {
        let (_, text) = files.iter().find(|(n, _)| *n == name).unwrap();
        csv::Reader::from_reader(text.as_bytes()).into_records().count()
    };
    assert_eq!(rows("1-equilibrium.csv"), study.equilibrium.len());
    assert_eq!(rows("2-trajectory.csv"), study.trajectory.len());
    assert_eq!(rows("4-mesh.csv"), study.meshes.len());
    assert_eq!(rows("5-fit.csv"), study.fits.len());
    assert!(names.contains("3-early.csv"));
}

#[test]
fn refused_runs_are_listed_with_the_reason_and_what_to_do() {
    let study = tiny();
    for runs in [&study.equilibrium, &study.trajectory] {
        let refused: Vec<_> = runs.iter().filter(|r| matches!(r.ended, Ended::Refused(_))).collect();
        let words: Vec<String> =
            refused.iter().filter(|r| r.method == "verlet").map(|r| r.ended.words()).collect();
        assert!(words.iter().any(|w| w.contains("beyond the stability limit")), "{words:?}");
        assert!(words.iter().any(|w| w.contains("steps to t = ") && w.contains("take tr-bdf2")), "{words:?}");
        for run in refused {
            assert!(page(study).contains(&run.setting) && run.error_mm.is_none());
        }
    }
}

#[test]
fn tighter_settings_give_smaller_errors_with_the_known_orders() {
    let study = tiny();
    let adaptive: Vec<f64> =
        study.trajectory.iter().filter(|r| r.method == "tr-bdf2").filter_map(|r| r.error_mm).collect();
    let points: Vec<(f64, f64)> = STEP_TOLERANCES.into_iter().zip(adaptive.clone()).collect();
    let order = observed_order(&points).unwrap();
    assert!((order - 2.0 / 3.0).abs() < 0.1, "TR-BDF2: power {order} of the tolerance");
    // The tolerances of the two references differ by a factor of ten, and the error grows with the power 2/3 of the tolerance. So the error
    // of the looser one is 10^(2/3) = 4.6 times that of the tighter one, and their difference is mainly that error. The tighter one must be
    // 50 times more accurate than the most accurate run.
    let doubt = study.reference_doubt_mm;
    assert!(doubt / 4.6 * 50.0 < adaptive[adaptive.len() - 1], "the reference is not tight enough: {doubt}");
    let verlet = study.trajectory.iter().filter(|r| r.method == "verlet").count();
    assert_eq!(verlet, PARTS_OF_LIMIT.len(), "refused runs are rows too");
    let newton = study.equilibrium.iter().filter(|r| r.method == "Newton");
    let errors: Vec<f64> = newton.filter_map(|r| r.error_mm).collect();
    assert!(errors.windows(2).all(|w| w[1] <= w[0]), "{errors:?}");
    assert!(errors[errors.len() - 1] < 1e-5, "{errors:?}");
    let left: Vec<f64> = study.early.iter().map(|s| s.left_mm).collect();
    assert!(left.windows(2).all(|w| w[1] < 0.5 * w[0]), "{left:?}");
    assert!(study.fits.iter().all(|f| f.tolerance_n > 1e-4 || f.error_n < 1e-3));
}

#[test]
fn the_page_follows_the_data() {
    let study = tiny();
    assert_eq!(page(study), page(&study.clone()), "the same data give the same page");
    let mut other = study.clone();
    let newton = other.equilibrium.iter_mut().filter(|r| r.method == "Newton");
    newton.for_each(|r| r.seconds = Some(1234.0));
    other.early.iter_mut().for_each(|s| s.left_mm = 7.77);
    let (before, after) = (page(study), page(&other));
    assert!(after.contains("leaves 7.77 mm") && !before.contains("leaves 7.77 mm"));
    assert!(!after.contains("For 1 % of a ratio at equilibrium take Newton"));
}
