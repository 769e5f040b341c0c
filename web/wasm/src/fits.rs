//! Tables of lengths, and fits of their rows.

use serde_json::{Value, json};
use tongue_fit::inverse::TargetOnBody;
use tongue_fit::inverse::batch::{self, Selection};
use tongue_fit::measured::{Dataset, Target, TargetKind, TargetOptions, Vowel};
use tongue_fit::posterior::{Draw, ShortRun};
use tongue_fit::report::{FitRecord, Provenance};
use tongue_fit::run::FitRun;
use tongue_fit::scene::{self, JOINT_MM, prepare};
use tongue_fit::system::TissueModel;

use crate::engine::Engine;

/// Reads a table and returns its fits. Errors are the program's, with line and column.
pub fn table(engine: &mut Engine, text: Option<&[u8]>, file: &str) -> Result<Value, String> {
    let data = match text {
        Some(text) => Dataset::from_reader(text, file),
        None => Dataset::reference(),
    };
    let data = data.map_err(|e| e.to_string())?;
    let kinds = vec![TargetKind::Ratio, TargetKind::Stretch];
    let plan = batch::plan(&data, &Selection { kinds, ..Selection::default() }).map_err(|e| e.to_string())?;
    let fits: Vec<Value> = plan
        .jobs
        .iter()
        .map(|job| {
            let t = &job.target;
            json!({"subject": t.subject, "vowel": t.vowel, "baseline": t.baseline, "target": t.kind, "substitute": job.substitute})
        })
        .collect();
    let baselines: Vec<Value> =
        plan.baselines.iter().map(|b| json!({"subject": b.subject, "vowel": b.vowel})).collect();
    let refused = plan.refusals.iter().map(|r| &r.message);
    let broken = data.left_out();
    let told: Vec<&String> = refused.chain(&broken).collect();
    let rows: Vec<Value> = (data.rows.iter())
        .map(|row| json!({"subject": row.lengths.subject, "vowel": row.lengths.vowel}))
        .collect();
    let origin = data.origin.clone();
    engine.data = data;
    Ok(json!({"origin": origin, "rows": rows, "fits": fits, "baselines": baselines, "told": told}))
}

/// The target of a row, against the speaker's usual baseline if none is given.
fn target(
    engine: &Engine,
    subject: &str,
    vowel: &str,
    baseline: Option<&str>,
    kind: TargetKind,
) -> Result<Target, String> {
    let vowel: Vowel = vowel.parse().map_err(|e| format!("{e}"))?;
    let baseline = baseline.map(str::parse::<Vowel>).transpose().map_err(|e| e.to_string())?;
    let options = TargetOptions { muscles: None, baseline };
    Target::new(&engine.data, subject, &vowel, kind, &options).map_err(|e| e.to_string())
}

/// The result of `tongue-fit --vowel .. --method gauss-newton`; with `walls`, palate and teeth stop the tongue. Errors are the program's.
pub fn fit(
    engine: &Engine,
    subject: &str,
    vowel: &str,
    baseline: Option<&str>,
    kind: TargetKind,
    walls: bool,
) -> Result<FitRecord, String> {
    let target = target(engine, subject, vowel, baseline, kind)?;
    let by = Provenance::new("tongue.html").with_tissue(TissueModel::of(&engine.body.mesh));
    FitRun { walls, ..FitRun::quick(&target) }
        .run(&engine.body, &engine.model, &by)
        .map_err(|e| e.to_string())
}

/// The vowel as `tongue-fit sound` computes it: jaw, hyoid and lips of the tract's file, and the tensions with which the tongue has its
/// measured lengths there; null if the tract's file does not have the vowel, or if the baseline is not /ɯ/, to which that file refers.
/// Errors are the program's.
pub fn spoken(
    engine: &Engine,
    subject: &str,
    vowel: &str,
    baseline: Option<&str>,
    kind: TargetKind,
) -> Result<Value, String> {
    let target = target(engine, subject, vowel, baseline, kind)?;
    let from_u = target.baseline.is_like(&Vowel::unrounded_u());
    let Some(posture) = engine.posture(&target.vowel).filter(|_| from_u) else { return Ok(Value::Null) };
    let mut spoken = engine.scene().clone().spoken(&posture, JOINT_MM);
    spoken.tensions_n = target.active_names().into_iter().map(|name| (name.to_owned(), 0.0)).collect();
    let mut prepared = prepare(&spoken, engine.body.clone()).map_err(|e| e.to_string())?;
    let target = TargetOnBody::new(&engine.body.mesh, &target).map_err(|e| e.to_string())?;
    prepared.target = Some(target);
    scene::fit(&mut prepared).map_err(|e| e.to_string())?;
    Ok(json!({"tensions_n": prepared.tensions, "posture": posture}))
}

/// The draws of one group of chains for a verdict. An error is the program's, or the reason why there is no verdict.
pub fn draws(
    engine: &Engine,
    subject: &str,
    vowel: &str,
    baseline: Option<&str>,
    group: usize,
) -> Result<Vec<Draw>, String> {
    let target = target(engine, subject, vowel, baseline, TargetKind::Stretch)?;
    ShortRun::new(&engine.body, &engine.model, &target)
        .and_then(|run| run.draws(Some(group)))
        .map_err(|e| e.to_string())
}

/// The verdict of `tongue-fit --vowel ..` from the draws of both groups, with its sentences. Errors are those of [`draws`].
pub fn verdict(
    engine: &Engine,
    subject: &str,
    vowel: &str,
    baseline: Option<&str>,
    draws: &[Draw],
) -> Result<Value, String> {
    let target = target(engine, subject, vowel, baseline, TargetKind::Stretch)?;
    let run = ShortRun::new(&engine.body, &engine.model, &target).map_err(|e| e.to_string())?;
    let verdict = run.verdict(draws).map_err(|e| e.to_string())?;
    let sentences = verdict.sentences(target.baseline.label());
    Ok(json!({"muscles": verdict.muscles, "sentences": sentences}))
}
