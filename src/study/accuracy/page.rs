//! The study as a page of Markdown, every figure of which comes from the measurements.

use std::fmt::Write as _;

use crate::inverse::Method;
use crate::measured::TargetKind;

use super::Study;
use super::equilibrium::NEWTON;
use super::ladder::{Run, fastest_within};
use super::march::duration;
use super::page_axes::{
    along, fits, mesh_verdict, meshes, stopping, tissue_verdict, tissues, to_equilibrium,
};

/// Where and how a study was made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Circumstances {
    /// The command line.
    pub command: String,
    /// Processor, number of threads, operating system.
    pub machine: String,
}

const ADAPTIVE: [&str; 1] = ["tr-bdf2"];
/// One per cent of a ratio of one.
const ONE_PER_CENT: f64 = 0.01;

/// Writes the page.
pub fn page(study: &Study, made: &Circumstances) -> String {
    let mut p = String::new();
    let _ = writeln!(p, "# What accuracy costs in time\n");
    let _ = writeln!(
        p,
        "Made by `{}` on {}. Every figure on this page is filled in from the measurements of that run; the tables behind it \
         are the CSV files beside it. Times are medians of repeats and hold for that machine as busy as it was; \
         steps, evaluations of the force and factorisations hold for every machine.\n",
        made.command, made.machine
    );
    let _ = writeln!(
        p,
        "The scene, unless said otherwise: the mesh of 5.5 mm, the tensions published for /a/ (GGa 12.0, SGm 11.5, HGa 4.5 N per \
         metre of thickness), consistent constants. A ratio is a muscle's length over that of GGa.\n"
    );
    conclusions(&mut p, study);
    goals(&mut p, study);
    to_equilibrium(&mut p, study);
    along(&mut p, study);
    stopping(&mut p, study);
    meshes(&mut p, study);
    tissues(&mut p, study);
    fits(&mut p, study);
    p
}

/// `1.2e-7`, or plain where that is short.
pub(super) fn number(v: f64) -> String {
    if v == 0.0 || (1e-3..1e4).contains(&v.abs()) {
        let digits = (2 - v.abs().max(1e-9).log10().floor() as i32).clamp(0, 6) as usize;
        format!("{:.*}", if v == 0.0 { 0 } else { digits }, v)
    } else {
        format!("{v:.1e}")
    }
}

fn time(run: Option<&Run>) -> Option<f64> {
    run.and_then(|r| r.seconds)
}

/// A run in words: how, how long, what it needs.
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

fn of<'a>(runs: &'a [Run], methods: &'a [&str]) -> Vec<Run> {
    runs.iter().filter(|r| methods.contains(&r.method.as_str())).cloned().collect()
}

fn integrators(study: &Study) -> Vec<Run> {
    let names = crate::dynamics::Method::ALL.map(crate::dynamics::Method::name);
    of(&study.equilibrium, &names)
}

/// The fastest run whose ratios are right to one per cent.
fn within_one_per_cent(runs: &[Run]) -> Option<&Run> {
    runs.iter()
        .filter(|r| r.ratio_error.is_some_and(|e| e <= ONE_PER_CENT) && r.seconds.is_some())
        .min_by(|a, b| a.seconds.unwrap_or(f64::MAX).total_cmp(&b.seconds.unwrap_or(f64::MAX)))
}

fn conclusions(p: &mut String, study: &Study) {
    let _ = writeln!(p, "## In short\n");
    if let Some(r) = within_one_per_cent(&study.equilibrium) {
        let _ = writeln!(p, "- **For 1 % of a ratio at equilibrium take {}.**", told(r));
    }
    let newton = of(&study.equilibrium, &[NEWTON]);
    if let (Some(rough), Some(tight)) = (fastest_within(&newton, 1e-2), fastest_within(&newton, 1e-9)) {
        let (a, b) = (rough.seconds.unwrap_or(f64::NAN), tight.seconds.unwrap_or(f64::NAN));
        let _ = writeln!(
            p,
            "- More digits cost next to nothing there: Newton's method is within 1e-2 mm after {} and within 1e-9 mm after {}.",
            duration(a),
            duration(b)
        );
    }
    match within_one_per_cent(&integrators(study)) {
        Some(r) => {
            let _ =
                writeln!(p, "- For 1 % of a ratio at equilibrium by following the motion take {}.", told(r));
        }
        None => {
            let _ = writeln!(
                p,
                "- No integrator came within 1 % of a ratio at equilibrium in the time it was given."
            );
        }
    }
    if let Some(r) = within_one_per_cent(&study.trajectory) {
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
    if let Some(text) = mesh_verdict(&study.meshes) {
        let _ = writeln!(p, "- {text}");
    }
    if let Some(text) = tissue_verdict(study) {
        let _ = writeln!(p, "- {text}");
    }
    let good = |m: Method| {
        let runs = study.fits.iter().filter(move |r| r.method == m && r.target == TargetKind::Stretch);
        runs.filter(|r| r.error_n <= 1e-2).min_by(|a, b| a.seconds.total_cmp(&b.seconds))
    };
    if let (Some(gn), Some(nm)) = (good(Method::GaussNewton), good(Method::NelderMead)) {
        let _ = writeln!(
            p,
            "- For tensions within 0.01 N (stretch targets) Gauss-Newton needs {} and {} equilibria (--starts {}), \
             Nelder-Mead {} and {} (--starts {}): {:.0} times as long.",
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

fn goals(p: &mut String, study: &Study) {
    let _ = writeln!(p, "## The goals, and what was measured\n");
    let _ = writeln!(p, "| goal | measured | met |\n|---|---|---|");
    let mut goal = |what: &str, measured: String, met: Option<bool>| {
        let met = met.map_or("not measured", |met| if met { "yes" } else { "**no**" });
        let _ = writeln!(p, "| {what} | {measured} | {met} |");
    };
    let newton = time(fastest_within(&of(&study.equilibrium, &[NEWTON]), 1e-9));
    let say = |t: Option<f64>| t.map_or_else(|| "not reached".to_owned(), duration);
    let all = integrators(study);
    let best = fastest_within(&all, 1e-2);
    goal(
        "Newton to 1e-9 mm in less time than the best integrator to 1e-2 mm",
        format!(
            "{} against {}{}",
            say(newton),
            say(time(best)),
            best.map_or_else(String::new, |r| format!(" ({})", r.method))
        ),
        newton.zip(time(best)).map(|(n, b)| n < b),
    );
    let verlet = of(&study.equilibrium, &["verlet"]);
    let fastest = time(fastest_within(&verlet, 1e-2));
    let factor = newton.zip(fastest).map(|(n, v)| v / n);
    goal(
        "by at least 1000 times against Velocity Verlet",
        match (factor, verlet.iter().find(|r| r.ended.words().contains("steps to"))) {
            (Some(factor), _) => format!("{} for 1e-2 mm: {factor:.0} times", say(fastest)),
            (None, Some(r)) => format!("Verlet: {}", r.ended.words()),
            (None, None) => "Verlet did not get there".into(),
        },
        factor.map(|f| f >= 1000.0),
    );
    let adaptive = of(&study.trajectory, &ADAPTIVE);
    let run = fastest_within(&adaptive, 1e-4);
    goal(
        "adaptive implicit trajectory to t = 3 s, 1e-4 mm, under 0.2 s",
        run.map_or_else(|| "not reached".into(), told),
        Some(time(run).is_some_and(|t| t < 0.2)),
    );
    let stretch =
        |m: Method| study.fits.iter().filter(move |r| r.method == m && r.target == TargetKind::Stretch);
    let standard = crate::inverse::Settings::default();
    let gn = stretch(Method::GaussNewton)
        .find(|r| r.starts == standard.starts && r.tolerance_n == standard.tension_tolerance && r.warm);
    let nm = stretch(Method::NelderMead).min_by(|a, b| a.tolerance_n.total_cmp(&b.tolerance_n));
    if let (Some(gn), Some(nm)) = (gn, nm) {
        goal(
            "Gauss-Newton fit of /a/ with stretch targets under 20 ms",
            format!("{} with {} starts", duration(gn.seconds), gn.starts),
            Some(gn.seconds < 0.02),
        );
        goal(
            "agreeing with Nelder-Mead to 1e-3 N",
            format!("at most {} N apart", number(gn.error_n + nm.error_n)),
            Some(gn.error_n + nm.error_n < 1e-3),
        );
    }
    p.push('\n');
}
