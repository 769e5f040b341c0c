//! Fits of measured rows: one, and all rows of a table.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tongue_fit::inverse::FitSettings;
use tongue_fit::inverse::batch::{self, Selection};
use tongue_fit::measured::{TargetKind, Vowel};
use tongue_fit::report::batch::Shard;
use tongue_fit::report::{Export, Provenance};
use tongue_fit::run::{BatchRun, FitRun, VerdictSource};
use tongue_fit::system::TissueModel;
use tongue_fit::{body, parallel};

use super::answer::loads;
use super::assembly::Model;
use super::body::Body;
use super::errors::{chosen, refused, wrong};
use super::given;
use super::measured::{Dataset, target};
use super::work::{aside_on, defect, give_up, next, pool};

/// The reference body and model if none are given.
fn body_and_model(
    body: Option<Body>,
    model: Option<Model>,
) -> PyResult<(Arc<body::Body<2>>, tongue_fit::system::Model)> {
    let body = body.map_or_else(Body::reference, Ok)?.body;
    let model = model.map_or_else(Default::default, |model| model.0);
    Ok((body, model))
}

/// Fits one row: the implementation of `tongue_fit.fit`, with the picture of the fitted shape (SVG).
#[pyfunction]
#[pyo3(signature = (data, subject, vowel, *, target = "ratio", muscles = None, baseline = None, body = None, model = None,
    method = "gauss-newton", verdict = true, threads = None))]
#[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn fit_row<'py>(
    py: Python<'py>,
    data: &Dataset,
    subject: &str,
    vowel: &str,
    target: &str,
    muscles: Option<&Bound<'py, PyAny>>,
    baseline: Option<&str>,
    body: Option<Body>,
    model: Option<Model>,
    method: &str,
    verdict: bool,
    threads: Option<usize>,
) -> PyResult<(Bound<'py, PyDict>, String)> {
    let clock = std::time::Instant::now();
    let method = chosen("method", method)?;
    let settings = FitSettings { method, ..FitSettings::default() };
    let kind: TargetKind = target.parse().map_err(refused)?;
    let target = self::target(data, subject, vowel, kind, muscles, baseline)?.target;
    let (body, model) = body_and_model(body, model)?;
    let verdict = if verdict { VerdictSource::ShortRun } else { VerdictSource::None };
    let (text, picture) = aside_on(py, &pool(py, threads)?, move || {
        let by = Provenance::new("python").with_tissue(TissueModel::of(&body.mesh));
        let asked = FitRun { target: &target, settings, walls: false, verdict };
        let mut record = asked.run(&body, &model, &by).map_err(refused)?;
        record.wall_s = Some(clock.elapsed().as_secs_f64());
        record.conclude();
        let text = record.to_json().map_err(refused)?;
        let picture = record.picture(&body).map_err(refused)?;
        Ok::<_, PyErr>((text, picture.text(&by).map_err(refused)?))
    })??;
    Ok((loads(py, &text)?, picture))
}

/// The implementation of `tongue_fit.batch`: every `of`th fit of a table, beginning with the `number`th. Calls `report(done, all)` after
/// each. Returns the number of all fits, a list of (number, JSON of the fit or None, lines of muscles.csv or the reason of the failure),
/// and the rows that cannot be fitted.
#[pyfunction]
#[allow(clippy::too_many_arguments, clippy::type_complexity, reason = "keyword arguments of Python")]
pub fn fit_rows<'py>(
    py: Python<'py>,
    data: &Dataset,
    subjects: Option<Bound<'py, PyAny>>,
    vowels: Option<Bound<'py, PyAny>>,
    target: &str,
    baseline: Option<&str>,
    baselines: BTreeMap<String, String>,
    body: Option<Body>,
    model: Option<Model>,
    method: &str,
    shard: &str,
    threads: Option<usize>,
    command: String,
    report: Bound<'py, PyAny>,
) -> PyResult<(usize, Vec<(usize, Option<String>, String)>, Vec<String>)> {
    let kinds = match target {
        "both" => TargetKind::ALL.to_vec(),
        name => vec![name.parse().map_err(|e| wrong(format!("{e}, or both of them: both")))?],
    };
    let parse = |word: &String| word.parse::<Vowel>().map_err(refused);
    let baseline_of = baselines.iter().map(|(subject, v)| Ok((subject.clone(), parse(v)?)));
    let some = |what: &str, all: Bound<'py, PyAny>| match given::names(what, &all)? {
        none if none.is_empty() => Err(wrong(format!("{what} names none; leave it out for all"))),
        names => Ok(names),
    };
    let subjects = subjects.map(|all| some("subjects", all)).transpose()?;
    let vowels = vowels.map(|all| some("vowels", all)).transpose()?;
    let selection = Selection {
        subjects,
        vowels: vowels.map(|all| all.iter().map(parse).collect::<PyResult<_>>()).transpose()?,
        kinds,
        baseline: baseline.map(|v| parse(&v.to_owned())).transpose()?,
        baseline_of: baseline_of.collect::<PyResult<_>>()?,
    };
    let settings = batch::settings(chosen("method", method)?);
    let shard: Shard = shard.parse().map_err(wrong)?;
    let threads = pool(py, threads)?;
    let (body, model) = body_and_model(body, model)?;
    let data = Arc::clone(&data.data);
    let table = Arc::clone(&data);
    let run = aside_on(py, &threads, move || {
        let plan = batch::plan(&table, &selection).map_err(refused)?;
        BatchRun::new((&table, plan), settings, (&body, &model), None).map_err(refused)
    })??;
    let (all, refusals) = (run.plan.jobs.len(), run.plan.refusals.clone());
    let not_fitted = data
        .left_out()
        .into_iter()
        .chain(
            refusals.iter().map(|r| format!("line {}, {} /{}/: {}", r.line, r.subject, r.vowel, r.message)),
        )
        .collect();

    let mine: Vec<usize> = (0..all).filter(|&number| shard.has(number)).collect();
    let wanted = mine.len();
    let stopped = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&stopped);
    let (sender, mut receiver) = channel();
    let workers = Arc::clone(&threads);
    let provenance = Provenance::new(command);
    std::thread::spawn(move || {
        let work = |&number: &usize| {
            if seen.load(Ordering::Relaxed) {
                return;
            }
            let made = run.fit(number, false, &provenance, &|_| ());
            // A closed receiver means that the call was interrupted.
            let _ = sender.send((number, made));
        };
        workers.install(|| parallel::map(&mine, work));
    });
    let mut found = Vec::with_capacity(wanted);
    let mut listen = || -> PyResult<()> {
        while found.len() < wanted {
            let (number, made) = next(py, &mut receiver)?.ok_or_else(defect)?;
            found.push(match made.map_err(refused)? {
                Ok(fit) => {
                    let [_, muscles, _] = fit.tables;
                    let rows = muscles.csv()?;
                    (number, Some(fit.record.to_string()), rows)
                }
                Err(why) => (number, None, why),
            });
            report.call1((found.len(), wanted))?;
        }
        Ok(())
    };
    let heard = listen();
    stopped.store(true, Ordering::Relaxed);
    if heard.is_err() {
        give_up(&threads);
    }
    heard?;
    found.sort_by_key(|(number, ..)| *number);
    Ok((all, found, not_fitted))
}
