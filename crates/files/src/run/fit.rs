//! One fit of a target with its alarms and its verdict, the posterior of rows of one speaker, and the published answer.

use std::time::Instant;

use tongue_core::body::{Body, Mesh};
use tongue_core::effect::Contact;
use tongue_core::geometry::Point;
use tongue_core::statics::SolveStatus;
use tongue_core::system::{self, Additions, Model, System, SystemError};
use tongue_infer::inverse::alarms::{self, Alarm};
use tongue_infer::inverse::{self, FitError, FitSettings, Method, TargetOnBody};
use tongue_infer::posterior::{
    AuxiliaryData, Contrast, Measurements, Posterior, PosteriorError, PosteriorModel, Report, Sampling,
    Summary, Verdict,
};
use tongue_input::measured::thesis::Thesis;
use tongue_input::measured::{Dataset, ReadError, Target, TargetKind, TargetOptions};

use super::equilibrium::Solved;
use crate::report::{self, Draws, Files, FitRecord, Provenance, Svg};
use crate::scene::effects::CONTACT_REACH_MM;
use crate::simulation::SimulationError;

/// Where the verdict on a fit comes from.
#[derive(Debug, Clone, Copy)]
pub enum VerdictSource<'a> {
    None,
    ShortRun,
    /// The posterior of the row, or why it has none.
    Posterior(Result<&'a Report, &'a str>),
}

#[derive(Debug, Clone)]
pub struct FitRun<'a> {
    pub target: &'a Target,
    pub settings: FitSettings,
    /// Whether the palate and the teeth stop the tongue, as on the web page.
    pub walls: bool,
    pub verdict: VerdictSource<'a>,
}

impl<'a> FitRun<'a> {
    /// A fit by derivatives: the one that `tongue-fit --vowel` makes with `--method gauss-newton`, without its verdict.
    pub fn quick(target: &'a Target) -> Self {
        let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
        Self { target, settings, walls: false, verdict: VerdictSource::None }
    }

    pub fn run(&self, body: &Body<2>, model: &Model, made_by: &Provenance) -> Result<FitRecord, FitError> {
        let Self { target, settings, .. } = self;
        let matched = TargetOnBody::new(&body.mesh, target)?;
        let mut additions = Additions::default();
        if let Some(palate) = body.palate.as_ref().filter(|_| self.walls) {
            additions.add_contact(wall(&body.mesh, model, palate)?);
        }
        let system = System::with_additions(&body.mesh, model, &matched.contracting(), additions)?;
        let fit = inverse::fit_in(&system, matched, settings)?;
        let alarms = alarms::alarms(&body.mesh, &fit);
        let mut record = FitRecord {
            made_by: made_by.clone(),
            verdict: None,
            no_verdict: None,
            conclusion: None,
            fit,
            alarms,
            posterior: None,
            contrasts: Vec::new(),
            wall_s: None,
        };
        let verdict = match self.verdict {
            VerdictSource::None => return Ok(record),
            VerdictSource::ShortRun => {
                let verdict = Verdict::of_target(body, model, target);
                if let Err(why @ PosteriorError::Contradicted { .. }) = &verdict {
                    record.alarms.push(Alarm::NoVerdict { reason: why.to_string() });
                }
                verdict.map_err(|why| why.to_string())
            }
            VerdictSource::Posterior(posterior) => {
                record.posterior = posterior.ok().cloned();
                let summary = posterior.ok().and_then(|report| report.summary.as_ref());
                record.alarms.extend(summary.and_then(Summary::contradiction));
                let improbable = posterior.ok().and_then(|report| report.improbable.clone());
                record.alarms.extend(improbable.map(|reason| Alarm::NoVerdict { reason }));
                let verdict = posterior.map_err(str::to_owned).and_then(of_posterior);
                // A posterior whose chains have not mixed has no summary.
                if let Err(why) = &verdict
                    && summary.is_none()
                {
                    record.alarms.push(Alarm::NoPosterior { reason: why.clone() });
                }
                verdict
            }
        };
        match verdict {
            Ok(verdict) => record.verdict = Some(verdict),
            Err(why) => record.no_verdict = Some(why),
        }
        Ok(record)
    }
}

/// The targets of all vowels of a speaker against the baseline of one of them, which is among them; `tell` gets why others are left out.
pub fn sampled_together(
    data: &Dataset,
    target: &Target,
    tell: &mut dyn FnMut(String),
) -> Result<Vec<Target>, ReadError> {
    let options = TargetOptions { baseline: Some(target.baseline.clone()), ..TargetOptions::default() };
    let mut all = Vec::new();
    for vowel in data.vowels(&target.subject)? {
        if vowel == target.vowel {
            all.push(target.clone());
        } else if vowel != target.baseline {
            match Target::new(data, &target.subject, &vowel, TargetKind::Stretch, &options) {
                Ok(other) => all.push(other),
                Err(e) => tell(format!("--joint leaves out /{vowel}/: {e}")),
            }
        }
    }
    Ok(all)
}

/// The palate and the teeth as a wall for the surface of a body, as a scene has it with `effects.contact`.
pub(super) fn wall(mesh: &Mesh<2>, model: &Model, palate: &[Point]) -> Result<Contact, SystemError> {
    let stiffness = system::coefficients(mesh, model)?.tissue_stiffness;
    Ok(Contact::new(palate.to_vec(), &mesh.surface_nodes(), stiffness, CONTACT_REACH_MM * 1e-3))
}

/// A baseline tension that is fixed below this counts as zero, N per metre of thickness.
const SLACK_N_PER_M: f64 = 1.0;

fn of_posterior(report: &Report) -> Result<Verdict, String> {
    let verdict = Verdict::of(report).ok_or_else(|| report.diagnostics.why.clone())?;
    let mut tones = verdict.muscles.iter().map(|m| report.priors.fixed_tone(&m.muscle));
    if tones.all(|tone| tone.is_some_and(|tone| tone < SLACK_N_PER_M)) {
        return Err(
            "these priors switch off the tensions of the baseline, so every tension is a rise".to_owned()
        );
    }
    Ok(verdict)
}

#[derive(Debug)]
pub struct PosteriorRun<'a> {
    pub model: &'a PosteriorModel,
    /// Rows of one speaker with the same baseline.
    pub targets: &'a [&'a Target],
    /// Activity, contours and points measured in the same postures.
    pub auxiliary: AuxiliaryData,
    pub sampling: Sampling,
}

/// A sampled posterior, with a report for each row.
#[derive(Debug)]
pub struct SampledPosterior<'a> {
    pub posterior: Posterior<'a>,
    pub reports: Vec<Report>,
    pub contrasts: Vec<Contrast>,
    pub subject: String,
    pub baseline: String,
    pub wall_s: f64,
}

impl<'a> PosteriorRun<'a> {
    /// Samples the posterior; `tell` gets a line that says what is sampled. Refused are a number of draws out of range, no rows, muscles
    /// that the body does not have, and data from which no chain can begin.
    pub fn run(self, tell: &dyn Fn(&str)) -> Result<SampledPosterior<'a>, SimulationError> {
        let clock = Instant::now();
        let Self { model, targets, auxiliary, sampling } = self;
        sampling.check()?;
        let matched = targets.iter().map(|target| TargetOnBody::new(&model.body.mesh, target));
        let matched = matched.collect::<Result<Vec<_>, _>>()?;
        let [first, ..] = targets else {
            return Err(SimulationError::Refused("there is nothing measured".to_owned()));
        };
        let seen = Measurements { auxiliary, ..Measurements::of_vowels(&matched.iter().collect::<Vec<_>>()) };
        let (Sampling { draws, seed }, vowels) = (sampling, seen.labels.join(", "));
        tell(&format!("{draws} draws of the posterior of {} {vowels}, seed {seed}", first.subject));
        let posterior = model.posterior(seen, &sampling)?;
        Ok(SampledPosterior {
            reports: Report::of_each(&posterior, true, seed),
            contrasts: Contrast::all(&posterior),
            posterior,
            subject: first.subject.clone(),
            baseline: first.baseline.to_string(),
            wall_s: clock.elapsed().as_secs_f64(),
        })
    }
}

impl SampledPosterior<'_> {
    /// A title such as `S2 /a/`.
    pub fn what(&self, posture: usize) -> String {
        format!("{} /{}/", self.subject, self.posterior.problem.measurements.labels[posture])
    }

    /// A figure of the change of every tension in a posture; `None` if the chains have not mixed.
    pub fn ridges(&self, posture: usize) -> Option<Svg> {
        let title = format!("{}: change of every tension from the baseline", self.what(posture));
        let is_told = self.reports[posture].summary.is_some();
        is_told.then(|| report::ridges(&self.posterior, posture, &title))
    }

    /// The draws of a posture as a table, and its ridges if the chains have mixed.
    pub fn files(&self, posture: usize) -> Files<'_> {
        let mut files: Files<'_> = vec![("posterior.csv", Box::new(Draws(&self.posterior, posture)))];
        files.extend(self.ridges(posture).map(|ridges| ("ridges.svg", Box::new(ridges) as _)));
        files
    }
}

/// The published answer for /a/ of S2, simulated in this body, to compare a fit with.
#[derive(Debug, Clone)]
pub struct Published {
    pub ratios: Vec<f64>,
    pub stretches: Vec<f64>,
    /// Table 4.8: lengths over that of GGa in the thesis's own simulation.
    pub thesis_ratios: Vec<f64>,
    /// `thesis_ratios` as stretches of the thesis's rest lengths, with the stretch of GGa of this simulation.
    pub thesis_stretches: Vec<f64>,
    /// Root mean square difference of `ratios` from `thesis_ratios`.
    pub rms: f64,
}

impl Published {
    pub fn values(&self, kind: TargetKind) -> (&[f64], &[f64]) {
        match kind {
            TargetKind::Ratio => (&self.ratios, &self.thesis_ratios),
            TargetKind::Stretch => (&self.stretches, &self.thesis_stretches),
        }
    }

    /// The published tensions in this body; `None` if the target is not theirs or they lead to no equilibrium.
    pub fn of(body: &Body<2>, model: &Model, target: &Target) -> Result<Option<Self>, SimulationError> {
        let thesis = Thesis::reference();
        let published = thesis.tensions_a();
        let names: Vec<&str> = published.iter().map(|(muscle, _)| *muscle).collect();
        if !thesis.simulated(target) || target.active_names() != names {
            return Ok(None);
        }
        let matched = TargetOnBody::new(&body.mesh, target)?;
        let tensions = published.iter().map(|(_, tension)| *tension);
        let given: Vec<(usize, f64)> = matched.contracting().into_iter().zip(tensions).collect();
        let Solved { equilibrium, positions, system, .. } = Solved::in_plane(body, model, &given, true)?;
        if equilibrium.solution.status != SolveStatus::Converged {
            return Ok(None);
        }
        let [lengths, rest] = [&positions[..], system.rest()]
            .map(|x| matched.pick(&system.lengths(x))[..target.muscles.len()].to_vec());
        let [ratios, stretches] = [TargetKind::Ratio, TargetKind::Stretch]
            .map(|kind| kind.values(&lengths, &rest, target.reference));
        let of_thesis = thesis.ratios_a(&target.muscles);
        let of_thesis = of_thesis.zip(thesis.stretches_a(&target.muscles, stretches[target.reference]));
        let Some((thesis_ratios, thesis_stretches)) = of_thesis else { return Ok(None) };
        let others: Vec<usize> = target.comparable(TargetKind::Ratio).collect();
        let squares: f64 = others.iter().map(|&m| (ratios[m] - thesis_ratios[m]).powi(2)).sum();
        let rms = (squares / others.len() as f64).sqrt();
        Ok(Some(Self { ratios, stretches, thesis_ratios, thesis_stretches, rms }))
    }
}
