//! The study as a page of Markdown; all numbers come from the measurements.

use std::fmt::Write as _;

use crate::Error;
use crate::table::{duration, number};
use tongue_core::dynamics;
use tongue_infer::inverse::Method;
use tongue_input::measured::TargetKind;

use super::AccuracyStudy;
use super::axes::{mesh_verdict, sections};
use super::equilibrium::NEWTON;
use super::runs::{Run, fastest};
use super::search::FitRun;

/// An error of 0.01 of a ratio.
const ONE_PER_CENT: f64 = 0.01;

pub fn page(study: &AccuracyStudy, made: &str) -> Result<String, Error> {
    let mut p = format!(
        "# What accuracy costs in time\n\n\
         {made} Every figure on this page is filled in from the measurements of that run; the tables behind it \
         are the CSV files beside it. Times are medians of repeats and hold for that machine as busy as it was; \
         steps, evaluations of the force and factorisations hold for every machine.\n\n\
         The scene, unless said otherwise: the mesh of 5.5 mm, the tensions published for /a/ (GGa 12.0, SGm 11.5, HGa 4.5 N per \
         metre of thickness), consistent constants. A ratio is a muscle's length over that of GGa.\n\n"
    );
    conclusions(&mut p, study);
    Ok(p + &sections(study)?)
}

/// A run in words: method, setting and cost.
fn told(run: &Run) -> String {
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

fn of<'a>(runs: &'a [Run], methods: &[&str]) -> impl Iterator<Item = &'a Run> + Clone {
    runs.iter().filter(|r| methods.contains(&r.method))
}

fn integrators() -> [&'static str; 2] {
    dynamics::IntegrationMethod::ALL.map(dynamics::IntegrationMethod::name)
}

fn stretch_fits(study: &AccuracyStudy, method: Method) -> impl Iterator<Item = &FitRun> {
    study.fits.iter().filter(move |r| r.method == method && r.target == TargetKind::Stretch)
}

fn conclusions(p: &mut String, study: &AccuracyStudy) {
    let _ = writeln!(p, "## In short\n");
    let of_ratio = |r: &Run| r.ratio_error;
    if let Some(r) = fastest(&study.equilibrium, of_ratio, ONE_PER_CENT) {
        let _ = writeln!(p, "- **For 1 % of a ratio at equilibrium take {}.**", told(r));
    }
    let newton = of(&study.equilibrium, &[NEWTON]);
    let seconds = |error_mm| fastest(newton.clone(), |r| r.error_mm, error_mm).and_then(|r| r.seconds);
    if let (Some(rough), Some(tight)) = (seconds(1e-2), seconds(1e-9)) {
        let (rough, tight) = (duration(rough), duration(tight));
        let _ = writeln!(
            p,
            "- More digits cost next to nothing there: Newton's method is within 1e-2 mm after {rough} and within 1e-9 mm after {tight}."
        );
    }
    let _ = match fastest(of(&study.equilibrium, &integrators()), of_ratio, ONE_PER_CENT) {
        Some(r) => {
            writeln!(p, "- For 1 % of a ratio at equilibrium by following the motion take {}.", told(r))
        }
        None => {
            writeln!(p, "- No integrator came within 1 % of a ratio at equilibrium in the time it was given.")
        }
    };
    if let Some(r) = fastest(&study.trajectory, of_ratio, ONE_PER_CENT) {
        let _ = writeln!(p, "- For 1 % of a ratio all along the motion to t = 3 s take {}.", told(r));
    }
    if let Some(s) = study.early.iter().find(|s| s.t_end_s == 3.0) {
        let _ = writeln!(
            p,
            "- Stopping at t = 3 s, as the thesis does, leaves {} mm ({:.1} % of the largest displacement) and {} of a ratio; \
             no integrator, however accurate, can mend that.",
            number(s.left_mm),
            100.0 * s.left_part,
            number(s.ratio_error)
        );
    }
    if let Some(verdict) = mesh_verdict(&study.meshes) {
        let _ = writeln!(p, "- {verdict}");
    }
    let good = |method| {
        let runs = stretch_fits(study, method).filter(|r| r.error_n <= 1e-2);
        runs.min_by(|a, b| a.seconds.total_cmp(&b.seconds))
    };
    if let (Some(gn), Some(nm)) = (good(Method::GaussNewton), good(Method::NelderMead)) {
        let _ = writeln!(
            p,
            "- For tensions within 0.01 N (stretch targets) Gauss-Newton needs {} and {} equilibria (starts: {}), \
             Nelder-Mead {} and {} (starts: {}): {:.0} times as long.",
            duration(gn.seconds),
            gn.equilibria,
            gn.starts,
            duration(nm.seconds),
            nm.equilibria,
            nm.starts,
            nm.seconds / gn.seconds
        );
    }
    p.push('\n');
}
