//! The files of the study.

use crate::Error;
use tongue_core::statistics::distinct;
use tongue_files::report::{Files, Markdown, PrecisionCurve, Rows, work_precision};
use tongue_infer::inverse::{FitSettings, Method};
use tongue_input::measured::TargetKind;

use super::AccuracyStudy;
use super::axes::page;
use super::mesh::{MeshRun, SCENES};
use super::runs::Run;
use super::search::TimedFit;

/// `made` says how and where the study was made.
pub fn files<'a>(study: &'a AccuracyStudy, made: &str) -> Result<Files<'a>, Error> {
    let time = "time, s (median)";
    let error = "largest position error, mm";
    let equilibrium = work_precision("To equilibrium", time, error, &best_curves(&study.equilibrium))?;
    let curves = best_curves(&study.trajectory);
    let trajectory = work_precision("Along the trajectory to t = 3 s", time, error, &curves)?;
    let meshes = work_precision(
        "Change of a ratio from one mesh spacing to the next finer one",
        "time of one equilibrium, s",
        "largest change of a ratio",
        &mesh_curves(&study.meshes),
    )?;
    let title = "Fit of /a/: Nelder-Mead's simplex from the nearest solved candidate (warm) or from rest (cold), and Gauss-Newton";
    let fits =
        work_precision(title, "time of a fit, s", "largest tension error, N", &fit_curves(&study.fits))?;
    Ok(vec![
        ("README.md", Box::new(Markdown(page(study, made)?))),
        ("1-equilibrium.csv", Box::new(Rows(&study.equilibrium))),
        ("2-trajectory.csv", Box::new(Rows(&study.trajectory))),
        ("3-early.csv", Box::new(Rows(&study.early))),
        ("4-mesh.csv", Box::new(Rows(&study.meshes))),
        ("5-fit.csv", Box::new(Rows(&study.fits))),
        ("1-equilibrium.svg", Box::new(equilibrium)),
        ("2-trajectory.svg", Box::new(trajectory)),
        ("4-mesh.svg", Box::new(meshes)),
        ("5-fit.svg", Box::new(fits)),
    ])
}

/// For every method the runs that no other run of the method beats in both time and error.
fn best_curves(runs: &[Run]) -> Vec<PrecisionCurve> {
    let curves = distinct(runs.iter().map(|run| run.method)).into_iter().map(|method| {
        let own = runs.iter().filter(|run| run.method == method);
        let mut points: Vec<(f64, f64)> = own.filter_map(|run| run.seconds.zip(run.error_mm)).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut least = f64::INFINITY;
        points.retain(|(_, error)| {
            let is_better = *error < least;
            least = least.min(*error);
            is_better
        });
        PrecisionCurve { name: method.into(), points }
    });
    curves.collect()
}

fn mesh_curves(runs: &[MeshRun]) -> Vec<PrecisionCurve> {
    let curves = SCENES.map(|(scene, _)| {
        let of_scene = runs.iter().filter(|r| r.scene == scene);
        let points = of_scene.filter_map(|r| Some((r.solve_s, r.change_from_next_coarser?))).collect();
        PrecisionCurve { name: scene.into(), points }
    });
    curves.into()
}

fn fit_curves(runs: &[TimedFit]) -> Vec<PrecisionCurve> {
    let mut curves = Vec::new();
    for kind in [TargetKind::Stretch, TargetKind::Ratio] {
        for (method, warm, name) in [
            (Method::NelderMead, true, "simplex, warm"),
            (Method::NelderMead, false, "simplex, cold"),
            (Method::GaussNewton, true, "Gauss-Newton"),
        ] {
            let starts = FitSettings::default().starts;
            let of_curve = runs
                .iter()
                .filter(|r| (r.target, r.method, r.warm, r.starts) == (kind, method, warm, starts));
            let mut points: Vec<(f64, f64)> = of_curve.map(|r| (r.seconds, r.error_n)).collect();
            points.sort_by(|a, b| b.1.total_cmp(&a.1));
            curves.push(PrecisionCurve { name: format!("{name}, {}", kind.name()), points });
        }
    }
    curves
}
