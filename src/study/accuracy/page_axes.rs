//! The sections of the page: an axis each, with its tables and the sentence that they come to.

use std::fmt::Write as _;

use crate::inverse::Method;

use super::Study;
use super::ladder::Run;
use super::march::duration;
use super::mesh::{MeshRun, order};
use super::page::number;
use super::search::FitRun;
use super::tissue::{SCENES, TISSUES};

fn run_table(p: &mut String, runs: &[Run]) {
    let _ = writeln!(p, "<details><summary>All {} runs</summary>\n", runs.len());
    let _ = writeln!(
        p,
        "| method | setting | position error, mm | ratio error | time | steps | force evaluations | factorisations | ended |\n\
         |---|---|--:|--:|--:|--:|--:|--:|---|"
    );
    for r in runs {
        let say = |v: Option<f64>| v.map_or_else(|| "–".to_owned(), number);
        let counted = |n: u64| if r.seconds.is_some() { n.to_string() } else { "–".into() };
        let _ = writeln!(
            p,
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            r.method,
            r.setting,
            say(r.error_mm),
            say(r.ratio_error),
            r.seconds.map_or_else(|| "–".to_owned(), duration),
            counted(r.steps),
            counted(r.force_evaluations),
            counted(r.factorisations),
            r.ended.words()
        );
    }
    p.push_str("\n</details>\n\n");
}

pub(super) fn to_equilibrium(p: &mut String, study: &Study) {
    let _ = writeln!(p, "## 1. To equilibrium\n\n![position error against time](1-equilibrium.svg)\n");
    let _ = writeln!(
        p,
        "Error against Newton's method carried on until rounding stops it (largest force left {} N). Integrators start at rest with \
         the tensions applied at once, and are asked at several times how far they are; the figure shows for each method the \
         runs that no other of its runs beats. An explicit step beyond the stability limit is refused, and so is a run that would take \
         longer than the study allows.\n",
        number(study.reference_residual_n)
    );
    run_table(p, &study.equilibrium);
}

pub(super) fn along(p: &mut String, study: &Study) {
    let _ = writeln!(p, "## 2. Along the trajectory\n\n![position error against time](2-trajectory.svg)\n");
    let _ = writeln!(
        p,
        "Largest error at t = 0.03, 0.1, 0.3, 0.6, 1, 2 and 3 s, where steps are made to end, against TR-BDF2 at a tolerance of 1e-9 \
         mm a step, a thousand times tighter than the tightest rung; from one ten times looser that differs by {} mm. Errors below \
         this ({} runs) are the reference's own.\n",
        number(study.reference_doubt_mm),
        study.trajectory.iter().filter(|r| r.error_mm.is_some_and(|e| e < study.reference_doubt_mm)).count()
    );
    run_table(p, &study.trajectory);
}

pub(super) fn stopping(p: &mut String, study: &Study) {
    let _ = writeln!(p, "## 3. Stopping early\n");
    let _ = writeln!(p, "What is left from equilibrium, of a trajectory whose own error is far smaller:\n");
    let _ = writeln!(
        p,
        "| t_end | left, mm | of the largest displacement | ratio error | time | steps | factorisations |\n\
         |--:|--:|--:|--:|--:|--:|--:|"
    );
    for s in &study.early {
        let _ = writeln!(
            p,
            "| {} s | {} | {} % | {} | {} | {} | {} |",
            s.t_end_s,
            number(s.left_mm),
            number(100.0 * s.left_part),
            number(s.ratio_error),
            duration(s.seconds),
            s.steps,
            s.factorisations
        );
    }
    p.push('\n');
}

fn on<'a>(
    runs: &'a [MeshRun],
    scene: &'a str,
    tissue: &'a str,
) -> impl DoubleEndedIterator<Item = &'a MeshRun> {
    runs.iter().filter(move |r| r.scene == scene && r.tissue == tissue)
}

pub(super) fn mesh_verdict(runs: &[MeshRun]) -> Option<String> {
    let scene = SCENES[0].0;
    let last = on(runs, scene, TISSUES[0]).next_back()?;
    let change = last.change?;
    let p = order(runs, scene, TISSUES[0])?;
    let common = format!(
        "between the two finest meshes (down to {} mm) a ratio still changes by {} (observed order {p:.1})",
        number(last.h * 1e3),
        number(change)
    );
    Some(if p > 0.8 {
        format!("Finer meshes settle: {common}.")
    } else {
        format!(
            "**Finer meshes do not settle at a useful rate**: {common}. Muscles are lines and bones are points, and in a plane \
             the displacement under a point load grows with the logarithm of 1/h, so the spacing of 5.5 mm is a part of the \
             model, not an accuracy setting; 1 % of a ratio cannot be bought by refining."
        )
    })
}

pub(super) fn meshes(p: &mut String, study: &Study) {
    let runs = &study.meshes;
    let _ = writeln!(p, "## 4. Mesh\n\n![change of a ratio against time](4-mesh.svg)\n");
    if let Some(text) = mesh_verdict(runs) {
        let _ = writeln!(p, "{text}\n");
    }
    let _ = writeln!(
        p,
        "Changes are the largest of the eight ratios from the next coarser mesh; there is no limit to compare with. Memory is that of the \
         stiffness matrix and its factor.\n"
    );
    let _ = writeln!(
        p,
        "| tissue | h, mm | nodes solved for | SGp ratio | change | mesh built in | system made in | equilibrium in | iterations | \
         factorisations | memory, MB | ended |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|---|"
    );
    for tissue in TISSUES {
        for r in on(runs, SCENES[0].0, tissue) {
            let _ = writeln!(
                p,
                "| {tissue} | {} | {} | {:.3} | {} | {} | {} | {} | {} | {} | {} | {} |",
                number(r.h * 1e3),
                r.unknowns,
                r.muscles.iter().position(|m| m == "SGp").map_or(f64::NAN, |m| r.ratios[m]),
                r.change.map_or_else(|| "–".into(), number),
                duration(r.mesh_s),
                duration(r.setup_s),
                duration(r.solve_s),
                r.iterations,
                r.factorisations,
                number(r.matrix_bytes as f64 * 1e-6),
                r.ended.words()
            );
        }
    }
    let _ = writeln!(p, "\nObserved order in h of the changes, by scene:\n");
    let _ =
        writeln!(p, "| tissue | {} |\n|---|{}", SCENES.map(|s| s.0).join(" | "), "--:|".repeat(SCENES.len()));
    for tissue in TISSUES {
        let orders = SCENES.map(|(scene, _)| {
            order(runs, scene, tissue).map_or_else(|| "–".to_owned(), |o| format!("{o:.2}"))
        });
        let _ = writeln!(p, "| {tissue} | {} |", orders.join(" | "));
    }
    p.push('\n');
}

pub(super) fn tissue_verdict(study: &Study) -> Option<String> {
    let scene = SCENES[0].0;
    let h = study.meshes.iter().map(|r| r.h).find(|h| *h <= 5.5e-3).or(study.meshes.last().map(|r| r.h))?;
    let at = |tissue| on(&study.meshes, scene, tissue).find(|r| r.h == h);
    let (springs, elements) = (at(TISSUES[0])?, at(TISSUES[2])?);
    let patch = |tissue: &str| {
        study.patches.iter().find(|r| r.tissue == tissue && r.h_mm == h * 1e3).map(|r| r.error_mm)
    };
    let (ps, pf) = (patch(TISSUES[0])?, patch(TISSUES[2])?);
    Some(format!(
        "Finite elements at {} mm are {} slower ({} against {} for an equilibrium) and {}: a homogeneous deformation, whose exact solution is \
         known, comes out {} mm wrong with springs and {} mm with finite elements. The tissues differ by up to {} of a ratio, far more than \
         any solver's error: a spring on every connection once makes a softer body than E and ν do.",
        number(h * 1e3),
        if elements.solve_s > springs.solve_s {
            format!("{:.1} times", elements.solve_s / springs.solve_s)
        } else {
            "not".into()
        },
        duration(elements.solve_s),
        duration(springs.solve_s),
        if pf < ps { "more accurate" } else { "not more accurate" },
        number(ps),
        number(pf),
        number(super::scene::largest_difference(&springs.ratios, &elements.ratios)),
    ))
}

pub(super) fn tissues(p: &mut String, study: &Study) {
    let _ = writeln!(p, "## 5. Springs or finite elements\n");
    if let Some(text) = tissue_verdict(study) {
        let _ = writeln!(p, "{text}\n");
    }
    let _ = writeln!(
        p,
        "The finite elements are linear triangles of a neo-Hookean solid in plane strain with the same E and ν; at small strain they are what \
         the springs are matched to. Last column: largest difference of a ratio from finite elements on the finest mesh, which is \
         itself no limit (see 4).\n"
    );
    let _ = writeln!(
        p,
        "| scene | h, mm | tissue | equilibrium in | iterations | energy and force in | stiffness and factor in | from finest |\n\
         |---|--:|---|--:|--:|--:|--:|--:|"
    );
    for r in &study.meshes {
        let _ = writeln!(
            p,
            "| {} | {} | {} | {} | {} | {} | {} | {} |",
            r.scene,
            number(r.h * 1e3),
            r.tissue,
            duration(r.solve_s),
            r.iterations,
            duration(r.force_s),
            duration(r.factor_s),
            number(r.from_finest)
        );
    }
    let _ = writeln!(
        p,
        "\nPatch test: the outline is moved by a homogeneous deformation (10 % longer, 5 % flatter, 5 % sheared), which the \
         inside of any uniform body follows exactly.\n\n| tissue | h, mm | largest error, mm |\n|---|--:|--:|"
    );
    for tissue in TISSUES {
        for r in study.patches.iter().filter(|r| r.tissue == tissue) {
            let _ = writeln!(p, "| {} | {} | {} |", r.tissue, number(r.h_mm), number(r.error_mm));
        }
    }
    p.push('\n');
}

pub(super) fn fits(p: &mut String, study: &Study) {
    let _ = writeln!(p, "## 6. Fit\n\n![tension error against time](6-fit.svg)\n");
    let _ = writeln!(
        p,
        "/a/ of S2. Error against Gauss-Newton with a force tolerance of 1e-11 N, steps below 1e-8 N and eight starts. Three \
         stretches determine three tensions; two ratios leave a direction open, in which the smallest total tension is sought. \
         One setting is changed at a time. The time is that of the whole fit, with identifiability and replay.\n"
    );
    let _ = writeln!(
        p,
        "| target | method | starts | tolerance, N | solves from | tension error, N | misfit | time | equilibria | factorisations | \
         iterations | ended |\n|---|---|--:|--:|---|--:|--:|--:|--:|--:|--:|---|"
    );
    for r in &study.fits {
        let FitRun { starts, misfit, equilibria, factorisations, iterations, .. } = r;
        let _ = writeln!(
            p,
            "| {} | {} | {starts} | {} | {} | {} | {} | {} | {equilibria} | {factorisations} | {iterations} | {} |",
            r.target.name(),
            match r.method {
                Method::NelderMead => "Nelder-Mead",
                Method::GaussNewton => "Gauss-Newton",
            },
            number(r.tolerance_n),
            if r.warm { "neighbour" } else { "rest" },
            number(r.error_n),
            number(*misfit),
            duration(r.seconds),
            r.ended.words()
        );
    }
}
