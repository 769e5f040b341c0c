//! Sections of the page: one for each axis, with its tables and its conclusion in one sentence.

use std::fmt::Write as _;

use tongue_files::report::column::{self, Column};

use crate::Error;
use crate::table::{markdown, number};

use super::AccuracyStudy;
use super::mesh::{MeshRun, SCENES, order};
use super::runs::Run;

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

/// The conclusion of the mesh study in one sentence.
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
             model, not an accuracy setting; 1 % of a ratio cannot be bought by refining."
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
