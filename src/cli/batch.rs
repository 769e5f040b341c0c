//! `tongue-fit batch`: every subject and vowel of a table.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use miette::{IntoDiagnostic, miette};
use rayon::prelude::*;
use tongue_fit::body::Mesh;
use tongue_fit::inverse::alarms::DEFAULT_THICKNESS_M;
use tongue_fit::inverse::batch::{self, Job, Known, Plan, Selection, Thoroughness};
use tongue_fit::inverse::{Method, Settings, Setup};
use tongue_fit::measured::lengths::rest_distance;
use tongue_fit::measured::thesis::Thesis;
use tongue_fit::measured::{Dataset, Target, TargetKind, Vowel, reference_muscle};
use tongue_fit::report::batch::journal::{Entry, NAME};
use tongue_fit::report::batch::{self as outputs, Batch, Fitted, Journal, Provenance, Summary};
use tongue_fit::report::{OutputDir, ReportError};
use tongue_fit::system::{Model, System};

use super::fit::MethodName;
use super::{Global, Outcome, body, interrupt, output, premises, table};

/// The folder for outputs where none is named.
const DEFAULT_OUT: &str = "results/batch";
/// Broken rows that are told one by one.
const MOST_NOTES: usize = 10;

/// Options of `tongue-fit batch`.
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(after_help = "Examples:\n  \
    tongue-fit batch\n  \
    tongue-fit batch --target stretch --draws 0 --subsets 0\n  \
    tongue-fit batch --lengths mine.csv --baseline e --baseline P7=i\n\n\
    A run that was stopped goes on where it was when it is started again with the same options and folder.")]
pub struct Arguments {
    /// Measured lengths (CSV) in place of the built-in ones
    #[arg(long, value_name = "FILE")]
    lengths: Option<PathBuf>,
    /// Only these subjects, such as S1,S2
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    subjects: Option<Vec<String>>,
    /// Only these vowels, such as a,i
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    vowels: Option<Vec<String>>,
    /// Quantities to hit: ratio, stretch or both
    #[arg(long, value_name = "KIND", default_value = "both")]
    target: String,
    /// Vowel taken as rest, of all subjects (e) or of one (S4=i); may be given several times [default: ɯ, and e for who has
    /// no ɯ]
    #[arg(long, value_name = "V|SUBJECT=V")]
    baseline: Vec<String>,
    /// Draws of every length within its rounding, for 95 % intervals; 0 for none
    #[arg(long, value_name = "N", default_value_t = Thoroughness::default().draws)]
    draws: usize,
    /// Seed of the draws
    #[arg(long, value_name = "N", default_value_t = Thoroughness::default().seed)]
    seed: u64,
    /// Try other subsets of contracting muscles that differ in up to N muscles; 0 tries none, 8 all
    #[arg(long, value_name = "N", default_value_t = Thoroughness::default().subset_changes)]
    subsets: u32,
    /// Thickness over which tensions act, mm, to compare them with published forces
    #[arg(long, value_name = "MM", default_value_t = 1e3 * DEFAULT_THICKNESS_M)]
    thickness: f64,
    /// What searches: the derivatives of the equilibrium, or the simplex of the thesis, which finds the same tensions ten times
    /// slower (and is what the fit of one vowel takes, to do as the thesis did)
    #[arg(long, value_enum, default_value = "gauss-newton")]
    method: MethodName,
    /// Number of starting points of each search
    #[arg(long, value_name = "N", default_value_t = 8)]
    starts: usize,
    /// Upper bound of every tension, N per metre of thickness
    #[arg(long, value_name = "N", default_value_t = Settings::default().upper_bound, allow_hyphen_values = true)]
    upper_bound: f64,
    /// Half width of the rounding of every length, mm [default: as the table says or its digits show, 0.5 for whole millimetres]
    #[arg(long, value_name = "MM")]
    error_mm: Option<f64>,
    #[command(flatten)]
    premises: premises::Arguments,
    #[command(flatten)]
    body: body::Arguments,
}

impl Arguments {
    fn selection(&self) -> miette::Result<Selection> {
        let kinds = match self.target.as_str() {
            "both" => TargetKind::ALL.to_vec(),
            name => {
                let kind = name.parse::<TargetKind>();
                vec![kind.map_err(|e| miette!("--target: {e}, or both of them: both"))?]
            }
        };
        let vowels = self.vowels.as_ref().map(|v| v.iter().map(|v| v.parse()).collect::<Result<_, _>>());
        let mut selection = Selection {
            subjects: self.subjects.clone(),
            vowels: vowels.transpose().into_diagnostic()?,
            kinds,
            baseline: None,
            baseline_of: BTreeMap::new(),
        };
        for word in &self.baseline {
            let twice = || miette!("--baseline {word}: this baseline is given twice; give it once");
            match word.split_once('=') {
                Some((subject, vowel)) => {
                    let vowel: Vowel = vowel.parse().into_diagnostic()?;
                    if selection.baseline_of.insert(subject.to_owned(), vowel).is_some() {
                        return Err(twice());
                    }
                }
                None => {
                    if selection.baseline.replace(word.parse().into_diagnostic()?).is_some() {
                        return Err(twice());
                    }
                }
            }
        }
        Ok(selection)
    }

    fn thoroughness(&self) -> miette::Result<Thoroughness> {
        if !(self.thickness.is_finite() && self.thickness > 0.0) {
            return Err(miette!("--thickness is {} mm; it must be positive and finite", self.thickness));
        }
        let settings = Settings {
            method: Method::from(self.method),
            starts: self.starts,
            upper_bound: self.upper_bound,
            ..Settings::default()
        };
        settings.check().into_diagnostic()?;
        Ok(Thoroughness {
            settings,
            draws: self.draws,
            seed: self.seed,
            subset_changes: self.subsets,
            thickness_m: 1e-3 * self.thickness,
        })
    }
}

/// All that a job needs, shared between threads.
struct Run<'a> {
    mesh: &'a Mesh<2>,
    /// Names of the mesh's muscles in the order of columns: those of the table first.
    muscles: &'a [String],
    model: &'a Model,
    /// The body under the premises of each kind of target; none where these are the thesis's.
    setups: Vec<(TargetKind, Option<Setup>)>,
    how: &'a Thoroughness,
    known: Known,
    thesis: Thesis,
    provenance: Provenance,
}

/// Runs it.
pub fn run(arguments: &Arguments, global: &Global) -> miette::Result<Outcome> {
    let clock = Instant::now();
    let (selection, how) = (arguments.selection()?, arguments.thoroughness()?);
    let data = match &arguments.lengths {
        Some(path) => Dataset::from_path(path),
        None => Dataset::reference(),
    };
    let mut data = data.into_diagnostic()?;
    if let Some(mm) = arguments.error_mm {
        data = data.with_half_width_mm(mm).into_diagnostic()?;
    }
    let unreadable: Vec<String> = data.broken().iter().map(|b| b.fault.to_string()).collect();
    let plan = batch::plan(&data, &selection).into_diagnostic()?;
    let (tongue, model) = (arguments.body.body()?, arguments.body.model());
    let mesh = &tongue.mesh;
    // What no fit could be made with is refused once, before anything is written.
    System::new(mesh, &model, &[]).into_diagnostic()?;
    let thesis = arguments.body.is_thesis();
    let setup = |&kind: &TargetKind| Ok((kind, arguments.premises.setup(kind, &tongue, &model, thesis)?));
    let setups: Vec<(TargetKind, Option<Setup>)> =
        selection.kinds.iter().map(setup).collect::<miette::Result<_>>()?;
    let out =
        OutputDir::prepare(global.out.clone().unwrap_or_else(|| DEFAULT_OUT.into())).into_diagnostic()?;

    let command = super::command_line_of_the_result();
    let rows =
        data.rows().iter().map(|r| format!("{} {:?}", r.line, r.lengths)).collect::<Vec<_>>().join("\n");
    let inputs_sha256 = outputs::sha256(&[
        tongue_fit::VERSION,
        &rows,
        &format!("{unreadable:?}"),
        &format!("{selection:?}"),
        &format!("{mesh:?}"),
        &format!("{model:?}"),
        &format!("{how:?}"),
        &format!(
            "{:?}",
            setups.iter().map(|(kind, s)| (kind, s.as_ref().map(|s| &s.premises))).collect::<Vec<_>>()
        ),
    ]);
    let key = outputs::sha256(&[&inputs_sha256, &command]);
    let version = tongue_fit::VERSION.to_owned();
    let provenance = Provenance { version, command, seed: how.seed, inputs_sha256 };
    let muscles = columns(&data, mesh);
    let run = Run {
        mesh,
        muscles: &muscles,
        model: &model,
        setups,
        how: &how,
        known: Known::reference().into_diagnostic()?,
        thesis: Thesis::reference().into_diagnostic()?,
        provenance,
    };

    tell_what_is_left_out(&plan, &unreadable);
    let journal = Journal::open(out.path(), &key, plan.jobs.len()).into_diagnostic()?;
    journal.notes().iter().for_each(|note| output::note(note));
    if !journal.is_empty() {
        output::note(&format!("going on after {} of {} fits", journal.len(), plan.jobs.len()));
    }
    output::step(|| {
        format!(
            "{} fits; {} from {} starts, {} draws with seed {}, inputs {}",
            plan.jobs.len(),
            arguments.method,
            how.settings.starts,
            how.draws,
            how.seed,
            run.provenance.inputs_sha256
        )
    });
    interrupt::set_last_words(Some(format!(
        "stopped; the finished fits are kept in \"{}\": the same command goes on after them",
        out.path().join(NAME).display()
    )));
    let journal = fit_all(&run, &plan.jobs, journal)?;
    output::step(|| "all fitted; writing".to_owned());
    let summary = summary(&run, &data, &plan, &unreadable, &journal)?;
    let batch = Batch {
        provenance: &run.provenance,
        jobs: &plan.jobs,
        baselines: &plan.baselines,
        refusals: &plan.refusals,
        unreadable: &unreadable,
        summary: &summary,
        mesh,
        muscles: &muscles,
    };
    let written = outputs::write_files(&out, &batch, &journal).into_diagnostic()?;
    if global.json {
        output::stream(|stdout| outputs::write_json(stdout, &batch, &journal, true))?;
    } else {
        let text = table::batch(&batch, &journal, &written, clock.elapsed().as_secs_f64())?;
        output::summary(&text, &written)?;
    }
    journal.remove().into_diagnostic()?;
    interrupt::set_last_words(None);
    Ok(if summary.not_fitted + summary.unreadable_rows > 0 {
        Outcome::SomeRowsRefused
    } else if summary.statuses.keys().any(|s| s != "converged") {
        Outcome::Untrustworthy
    } else {
        Outcome::Good
    })
}

/// Makes the fits that the journal does not have, as many at a time as there are threads, and keeps each when it is done.
fn fit_all(run: &Run<'_>, jobs: &[Job], journal: Journal) -> miette::Result<Journal> {
    let todo: Vec<usize> = (0..jobs.len()).filter(|&n| !journal.has(n)).collect();
    let bar = output::bar(jobs.len() as u64, "{wide_bar} {pos} of {len} fits, {eta} left")?;
    bar.set_position((jobs.len() - todo.len()) as u64);
    bar.reset_eta();
    let journal = Mutex::new(journal);
    todo.par_iter()
        .map(|&number| -> Result<(), ReportError> {
            let entry = one(run, number, &jobs[number])?;
            output::step(|| told(&jobs[number], &entry));
            journal.lock().unwrap_or_else(PoisonError::into_inner).append(&entry)?;
            bar.inc(1);
            Ok(())
        })
        .collect::<Result<(), _>>()
        .into_diagnostic()?;
    bar.finish_and_clear();
    Ok(journal.into_inner().unwrap_or_else(PoisonError::into_inner))
}

fn one(run: &Run<'_>, number: usize, job: &Job) -> Result<Entry<Fitted>, ReportError> {
    let clock = Instant::now();
    let setup = run.setups.iter().find(|(kind, _)| *kind == job.target.kind).and_then(|(_, s)| s.as_ref());
    let result = match batch::assess(run.mesh, run.model, setup, &job.target, &run.known, run.how) {
        Ok(a) => {
            let (muscles, thesis) = (run.muscles, Some(&run.thesis));
            Ok(outputs::fitted(number, job, &a, run.mesh, muscles, thesis, &run.provenance)?)
        }
        Err(e) => Err(e.to_string()),
    };
    Ok(Entry { job: number, wall_s: clock.elapsed().as_secs_f64(), result })
}

/// A finished job in a line.
fn told(job: &Job, entry: &Entry<Fitted>) -> String {
    let Target { subject, vowel, kind, .. } = &job.target;
    let came = match &entry.result {
        Ok(fit) => fit.digest.status.replace('_', " "),
        Err(why) => format!("not fitted: {why}"),
    };
    format!("{subject} /{vowel}/ {kind}: {came} in {:.3} s", entry.wall_s)
}

fn summary(
    run: &Run<'_>,
    data: &Dataset,
    plan: &Plan,
    unreadable: &[String],
    journal: &Journal,
) -> miette::Result<Summary> {
    let length = |name: &String| {
        let chain = run.mesh.muscles.iter().find(|m| m.name.eq_ignore_ascii_case(name));
        chain.map_or(f64::NAN, |chain| run.mesh.distance(chain.ends()))
    };
    let rest: Vec<f64> = run.muscles.iter().map(length).collect();
    let reference = &data.muscles()[reference_muscle(data.muscles())];
    let ratios = run.muscles.iter().filter(|m| *m != reference && data.muscles().contains(m)).count();
    let mut statuses = BTreeMap::new();
    for digest in journal.digests() {
        *statuses.entry(digest.status.clone()).or_insert(0) += 1;
    }
    let fits = journal.digests().count();
    let mut substitutes: Vec<String> = Vec::new();
    for job in plan.jobs.iter().filter(|j| j.substitute) {
        if substitutes.last() != Some(&job.target.subject) {
            substitutes.push(job.target.subject.clone());
        }
    }
    substitutes.sort_unstable();
    substitutes.dedup();
    Ok(Summary {
        rows: data.rows().len(),
        fits,
        statuses,
        baselines: plan.baselines.len(),
        not_fitted: plan.refusals.len() + plan.jobs.len() - fits,
        unreadable_rows: unreadable.len(),
        substitute_baselines: substitutes,
        rest_shape_measure: rest_distance::measure(ratios, reference),
        nearest_row_to_rest: rest_distance::nearest(run.muscles, &rest, data, reference),
        passive: outputs::passive_groups(journal.digests()),
        draws: run.how.draws,
        subset_changes: run.how.subset_changes,
        thickness_m: run.how.thickness_m,
    })
}

/// Names of the mesh's muscles: those that the table has, in its order, then the others.
fn columns(data: &Dataset, mesh: &Mesh<2>) -> Vec<String> {
    let has = |name: &&String| mesh.muscles.iter().any(|m| m.name.eq_ignore_ascii_case(name));
    let mut names: Vec<String> = data.muscles().iter().filter(has).cloned().collect();
    for chain in &mesh.muscles {
        if !names.iter().any(|n| n.eq_ignore_ascii_case(&chain.name)) {
            names.push(chain.name.clone());
        }
    }
    names
}

/// On stderr, before the work begins.
fn tell_what_is_left_out(plan: &Plan, unreadable: &[String]) {
    for message in unreadable.iter().take(MOST_NOTES) {
        output::complain(&format!("{message} (this row is left out)"));
    }
    for r in plan.refusals.iter().take(MOST_NOTES) {
        output::complain(&format!("line {}, {} /{}/: {}", r.line, r.subject, r.vowel, r.message));
    }
    let more = unreadable.len().saturating_sub(MOST_NOTES) + plan.refusals.len().saturating_sub(MOST_NOTES);
    if more > 0 {
        output::complain(&format!(
            "{more} more rows cannot be fitted; fits.csv and batch.json name them all"
        ));
    }
    let mut subjects: Vec<&str> =
        plan.baselines.iter().filter(|b| b.substitute).map(|b| b.subject.as_str()).collect();
    let more = subjects.len().saturating_sub(MOST_NOTES);
    subjects.truncate(MOST_NOTES);
    if !subjects.is_empty() {
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        output::note(&format!(
            "no /ɯ/ for {}{more}: fitted against /{}/ and marked so; --baseline chooses another",
            subjects.join(", "),
            batch::SUBSTITUTE_BASELINE
        ));
    }
}
