//! Accuracy and its cost in time, for every method of solution.
//!
//! | axis | file | error against |
//! |---|---|---|
//! | 1 to equilibrium | [`methods`] | Newton's method stopped by rounding alone |
//! | 2 along the trajectory to 3 s | [`methods`] | TR-BDF2 at a tolerance a thousand times tighter |
//! | 3 stopping early | [`methods`] | the equilibrium |
//! | 4 the mesh | [`mesh`] | the next coarser mesh: there is no limit to compare with |
//! | 5 the fit | [`search`] | Gauss-Newton at the tightest tolerances |
//!
//! Times are medians and hold for one machine; steps, evaluations of the force and factorisations hold for all. Failed and refused runs are
//! rows, too.

mod mesh;
mod methods;
mod page;
mod search;

use crate::measure::Effort;
use crate::{Error, PUBLISHED_A, TestTensions, tell};
use tongue_core::body::{Body, DEFAULT_SPACING_M};
use tongue_core::system::Model;

pub use page::files;

#[derive(Debug, Clone)]
pub(crate) struct AccuracyStudy {
    pub equilibrium: Vec<methods::Run>,
    /// Residual force at the reference of axis 1, N.
    pub reference_residual_n: f64,
    pub trajectory: Vec<methods::Run>,
    /// Largest distance, mm, between the reference of axis 2 and a run with ten times its tolerance.
    pub reference_doubt_mm: f64,
    pub early: Vec<methods::Stopped>,
    pub meshes: Vec<mesh::MeshRun>,
    pub fits: Vec<search::TimedFit>,
}

/// A failed run is a row of the table, not an error of the study.
pub fn run(effort: &Effort) -> Result<AccuracyStudy, Error> {
    let spacing = if effort.repeats > 1 { DEFAULT_SPACING_M } else { effort.spacings[0] };
    let body = Body::tongue(spacing)?.mesh;
    let scene = TestTensions::new(&body, &Model::default(), &PUBLISHED_A)?;
    tell("axis 5, the fit");
    let fits = search::work_precision(&body, effort)?;
    tell("axis 3, stopping early");
    let early = methods::stopped_early(&scene, effort)?;
    tell("axis 4, meshes");
    let meshes = mesh::work_precision(effort)?;
    tell("axis 2, along the trajectory");
    let (trajectory, reference_doubt_mm) = methods::along_the_trajectory(&scene, effort)?;
    tell("axis 1, to equilibrium");
    let (equilibrium, reference_residual_n) = methods::to_equilibrium(&scene, effort)?;
    Ok(AccuracyStudy {
        equilibrium,
        reference_residual_n,
        trajectory,
        reference_doubt_mm,
        early,
        meshes,
        fits,
    })
}

#[cfg(test)]
mod tests {
    //! The study measures all axes, lists refused runs, and has only measured numbers on its page.

    use std::sync::OnceLock;

    use tongue_files::VERSION;
    use tongue_files::report::Provenance;

    use super::methods::{PARTS_ON_THE_WAY, TOLERANCES_ON_THE_WAY};
    use super::page::page as made;
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
        assert_eq!(rows("3-early.csv"), study.early.len());
        assert_eq!(rows("4-mesh.csv"), study.meshes.len());
        assert_eq!(rows("5-fit.csv"), study.fits.len());
    }

    #[test]
    fn refused_runs_are_listed_with_the_reason_and_what_to_do() {
        let study = tiny();
        for runs in [&study.equilibrium, &study.trajectory] {
            let refused: Vec<_> = runs.iter().filter(|r| r.ended.starts_with("refused: ")).collect();
            let words: Vec<&str> =
                refused.iter().filter(|r| r.method == "verlet").map(|r| r.ended.as_str()).collect();
            assert!(words.iter().any(|w| w.contains("beyond the stability limit")), "{words:?}");
            assert!(
                words.iter().any(|w| w.contains("steps to t = ") && w.contains("take tr-bdf2")),
                "{words:?}"
            );
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
        let points: Vec<(f64, f64)> = TOLERANCES_ON_THE_WAY.into_iter().zip(adaptive.clone()).collect();
        let order = observed_order(&points).unwrap();
        assert!((order - 2.0 / 3.0).abs() < 0.1, "TR-BDF2: power {order} of the tolerance");
        // The tolerances of the two references differ by a factor of ten, and the error grows with the power 2/3 of the tolerance. So the error
        // of the looser one is 10^(2/3) = 4.6 times that of the tighter one, and their difference is mainly that error. The tighter one must be
        // 50 times more accurate than the most accurate run.
        let doubt = study.reference_doubt_mm;
        assert!(
            doubt / 4.6 * 50.0 < adaptive[adaptive.len() - 1],
            "the reference is not tight enough: {doubt}"
        );
        let verlet = study.trajectory.iter().filter(|r| r.method == "verlet").count();
        assert_eq!(verlet, PARTS_ON_THE_WAY.len(), "refused runs are rows too");
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
        let mut other = study.clone();
        let newton = other.equilibrium.iter_mut().filter(|r| r.method == "Newton");
        newton.for_each(|r| r.seconds = Some(1234.0));
        other.early.iter_mut().for_each(|s| s.left_mm = 7.77);
        let (before, after) = (page(study), page(&other));
        assert!(after.contains("leaves 7.77 mm") && !before.contains("leaves 7.77 mm"));
        assert!(!after.contains("For 1 % of a ratio at equilibrium take Newton"));
    }
}
