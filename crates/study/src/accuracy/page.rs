//! The files of the study, with its page in Markdown: a section for each axis, with its tables and its conclusion in one sentence.

use std::fmt::Write as _;

use super::AccuracyStudy;
use super::mesh::{MeshRun, SCENES, order};
use super::methods::{NEWTON, Run, fastest};
use super::search::TimedFit;
use crate::Error;
use crate::measure::ONE_PER_CENT;
use crate::table::{curves, duration, markdown, number};
use tongue_core::statistics::least_by;
use tongue_files::report::column::{self, Column};
use tongue_files::report::{Files, Markdown, PrecisionCurve, Rows, work_precision};
use tongue_infer::inverse::{FitSettings, Method};
use tongue_input::measured::TargetKind;

/// `made` says how and where the study was made.
pub fn files<'a>(study: &'a AccuracyStudy, made: &str) -> Result<Files<'a>, Error> {
    let time = "time, s (median)";
    let error = "largest position error, mm";
    let equilibrium = work_precision("To equilibrium", time, error, &best_curves(&study.equilibrium))?;
    let along_the_way = best_curves(&study.trajectory);
    let trajectory = work_precision("Along the trajectory to t = 3 s", time, error, &along_the_way)?;
    let meshes = work_precision(
        "Change of a ratio from one mesh spacing to the next finer one",
        "time of one equilibrium, s",
        "largest change of a ratio",
        &curves(&study.meshes, |r| r.scene, |r| Some((r.solve_s, r.change_from_next_coarser?))),
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
    let mut all = curves(runs, |run| run.method, |run| run.seconds.zip(run.error_mm));
    for PrecisionCurve { points, .. } in &mut all {
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut least = f64::INFINITY;
        points.retain(|(_, error)| {
            let is_better = *error < least;
            least = least.min(*error);
            is_better
        });
    }
    all
}

fn fit_curves(runs: &[TimedFit]) -> Vec<PrecisionCurve> {
    let mut curves = Vec::new();
    for kind in [TargetKind::Stretch, TargetKind::Ratio] {
        for (method, warm, name) in [
            (Method::NelderMead, true, "simplex, warm"),
            (Method::NelderMead, false, "simplex, cold"),
            (Method::GaussNewton, true, "Gauss-Newton"),
        ] {
            let own = (kind, method, warm, FitSettings::default().starts);
            let of_curve = runs.iter().filter(|r| (r.target, r.method, r.warm, r.starts) == own);
            let mut points: Vec<(f64, f64)> = of_curve.map(|r| (r.seconds, r.error_n)).collect();
            points.sort_by(|a, b| b.1.total_cmp(&a.1));
            curves.push(PrecisionCurve { name: format!("{name}, {}", kind.name()), points });
        }
    }
    curves
}

fn all_runs(runs: &[Run]) -> Result<String, Error> {
    let table = markdown(runs, &["repeats"])?;
    Ok(format!("<details><summary>All {} runs</summary>\n\n{table}</details>\n\n", runs.len()))
}

pub fn sections(study: &AccuracyStudy) -> Result<String, Error> {
    let mut p = String::new();
    let _ = write!(
        p,
        "## 1. To equilibrium\n\n![position error against time](1-equilibrium.svg)\n\n\
         Error against Newton's method carried on until rounding stops it (largest force left {} N). Integrators start at rest with \
         the tensions applied at once, and are compared at several times; the figure shows for each method the \
         runs that no other of its runs beats. An explicit step beyond the stability limit is refused, and so is a run that would take \
         longer than the study allows.\n\n{}",
        number(study.reference_residual_n),
        all_runs(&study.equilibrium)?
    );
    let below = study.trajectory.iter().filter(|r| r.error_mm.is_some_and(|e| e < study.reference_doubt_mm));
    let _ = write!(
        p,
        "## 2. Along the trajectory\n\n![position error against time](2-trajectory.svg)\n\n\
         Largest error at t = 0.03, 0.1, 0.3, 0.6, 1, 2 and 3 s, where steps are made to end, against TR-BDF2 at a tolerance of 1e-9 \
         mm a step, a thousand times tighter than the tightest rung; from one ten times looser that differs by {} mm. Errors below \
         this ({} runs) are the reference's own.\n\n{}",
        number(study.reference_doubt_mm),
        below.count(),
        all_runs(&study.trajectory)?
    );
    let _ = write!(
        p,
        "## 3. Stopping early\n\n\
         What is left from equilibrium, also as a part of the largest displacement, of a trajectory whose own error is far smaller:\n\n{}",
        markdown(&study.early, &[])?
    );
    meshes(&mut p, study)?;
    let _ = write!(
        p,
        "## 5. Fit\n\n![tension error against time](5-fit.svg)\n\n\
         /a/ of S2. Error against Gauss-Newton with a force tolerance of 1e-11 N, steps below 1e-8 N and eight starts. Three \
         stretches determine three tensions; two ratios leave a direction open, in which the smallest total tension is sought. \
         One setting is changed at a time. Warm: candidates are solved from the nearest solved one, not from rest. The time is that \
         of the whole fit, with identifiability and replay.\n\n{}",
        markdown(&study.fits, &["repeats"])?
    );
    Ok(p)
}

pub fn mesh_verdict(runs: &[MeshRun]) -> Option<String> {
    let scene = SCENES[0].0;
    let last = runs.iter().rfind(|r| r.scene == scene)?;
    let p = order(runs, scene)?;
    let common = format!(
        "between the two finest meshes (down to {} mm) a ratio still changes by {} (observed order {p:.1})",
        number(last.h_mm),
        number(last.change_from_next_coarser?)
    );
    Some(if p > 0.8 {
        format!("Finer meshes settle: {common}.")
    } else {
        format!(
            "**Finer meshes do not settle at a useful rate**: {common}. Muscles are lines and bones are points, and in a plane \
             the displacement under a point load grows with the logarithm of 1/h, so the spacing of 5.5 mm is a part of the \
             model, not an accuracy setting; no refinement gives 1 % of a ratio."
        )
    })
}

fn meshes(p: &mut String, study: &AccuracyStudy) -> Result<(), Error> {
    let runs = &study.meshes;
    let _ = write!(
        p,
        "## 4. Mesh\n\n![change of a ratio against time](4-mesh.svg)\n\n{}\n\n\
         Changes are the largest of the ratios from the next coarser mesh; there is no limit to compare with. Memory \
         is that of the stiffness matrix and its factor.\n\n",
        mesh_verdict(runs).unwrap_or_default()
    );
    let of_scene = runs.iter().filter(|r| r.scene == SCENES[0].0);
    *p += &markdown(of_scene, &["scene", "triangles", "force_s", "factor_s"])?;
    let columns = [
        Column::of_page("scene", |scene: &&str| (*scene).into()),
        Column::of_page("observed order in h of the changes", |scene: &&str| order(runs, scene).into())
            .decimals(2),
    ];
    let _ = writeln!(p, "{}", column::markdown(&columns, &SCENES.map(|(scene, _)| scene)));
    Ok(())
}

pub fn page(study: &AccuracyStudy, made: &str) -> Result<String, Error> {
    let p = format!(
        "# What accuracy costs in time\n\n\
         {made} Every figure on this page is filled in from the measurements of that run; the tables behind it \
         are the CSV files beside it. Times are medians of repeats and hold for that machine under its load at the time; \
         steps, evaluations of the force and factorisations hold for every machine.\n\n\
         The scene, unless said otherwise: the mesh of 5.5 mm, the tensions published for /a/ (GGa 12.0, SGm 11.5, HGa 4.5 N per \
         metre of thickness), consistent constants. A ratio is a muscle's length over that of GGa.\n\n"
    );
    let said: String = conclusions(study).iter().map(|sentence| format!("- {sentence}\n")).collect();
    Ok(p + "## In short\n\n" + &said + "\n" + &sections(study)?)
}

/// Method, setting and cost of a run, in words.
fn description(run: &Run) -> String {
    format!(
        "{} ({}): {}, {} steps, {} force evaluations, {} factorisations",
        run.method,
        run.setting,
        duration(run.seconds.unwrap_or(f64::NAN)),
        run.steps,
        run.force_evaluations,
        run.factorisations
    )
}

fn conclusions(study: &AccuracyStudy) -> Vec<String> {
    let of_ratio = |r: &Run| r.ratio_error;
    let mut said = Vec::new();
    let best = fastest(&study.equilibrium, of_ratio, ONE_PER_CENT);
    said.extend(best.map(|r| format!("**For 1 % of a ratio at equilibrium take {}.**", description(r))));
    let (newton, integrators): (Vec<&Run>, Vec<&Run>) =
        study.equilibrium.iter().partition(|r| r.method == NEWTON);
    let seconds = [1e-2, 1e-9]
        .map(|error_mm| fastest(newton.iter().copied(), |r| r.error_mm, error_mm).and_then(|r| r.seconds));
    if let [Some(rough), Some(tight)] = seconds.map(|s| s.map(duration)) {
        said.push(format!(
            "More digits cost next to nothing there: Newton's method is within 1e-2 mm after {rough} and within 1e-9 mm after {tight}."
        ));
    }
    said.push(match fastest(integrators, of_ratio, ONE_PER_CENT) {
        Some(r) => {
            format!("For 1 % of a ratio at equilibrium by following the motion take {}.", description(r))
        }
        None => {
            "No integrator came within 1 % of a ratio at equilibrium in the time it was given.".to_owned()
        }
    });
    let best = fastest(&study.trajectory, of_ratio, ONE_PER_CENT);
    said.extend(
        best.map(|r| format!("For 1 % of a ratio all along the motion to t = 3 s take {}.", description(r))),
    );
    said.extend(study.early.iter().find(|s| s.t_end_s == 3.0).map(|s| {
        format!(
            "Stopping at t = 3 s, as the thesis does, leaves {} mm ({:.1} % of the largest displacement) and {} of a ratio; \
             a more accurate integrator does not change that.",
            number(s.left_mm),
            100.0 * s.left_part,
            number(s.ratio_error)
        )
    }));
    said.extend(mesh_verdict(&study.meshes));
    let good = [Method::GaussNewton, Method::NelderMead].map(|method| {
        let runs = study.fits.iter().filter(|r| r.method == method && r.target == TargetKind::Stretch);
        least_by(runs.filter(|r| r.error_n <= 1e-2), |r| r.seconds)
    });
    if let [Some(gn), Some(nm)] = good {
        said.push(format!(
            "For tensions within 0.01 N (stretch targets) Gauss-Newton needs {} and {} equilibria (starts: {}), \
             Nelder-Mead {} and {} (starts: {}): {:.0} times as long.",
            duration(gn.seconds),
            gn.equilibria,
            gn.starts,
            duration(nm.seconds),
            nm.equilibria,
            nm.starts,
            nm.seconds / gn.seconds
        ));
    }
    said
}
