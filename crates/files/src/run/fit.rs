//! One fit of a target, with what there is to doubt in it and its verdict.

use nalgebra::SVector;
use tongue_core::body::Body;
use tongue_core::effect::Contact;
use tongue_core::system::{self, Additions, Model, System, SystemError};
use tongue_infer::inverse::alarms::{self, Alarm};
use tongue_infer::inverse::{self, FitError, FitSettings, Method, TargetOnBody};
use tongue_infer::posterior::{Report, Verdict};
use tongue_input::measured::Target;
use tongue_input::measured::muscles::Muscles;

use crate::report::{FitRecord, Provenance};
use crate::scene::effects::CONTACT_REACH_MM;

/// From what the verdict on a fit is taken.
#[derive(Debug, Clone, Copy)]
pub enum VerdictSource<'a> {
    None,
    ShortRun,
    /// The posterior of the row, or why there is none.
    Posterior(Result<&'a Report, &'a str>),
}

#[derive(Debug, Clone)]
pub struct FitRun<'a> {
    pub target: &'a Target,
    pub settings: FitSettings,
    /// Whether the palate and the teeth stop the tongue.
    pub walls: bool,
    pub verdict: VerdictSource<'a>,
}

impl<'a> FitRun<'a> {
    /// A fit by derivatives: what `tongue-fit --vowel` makes with `--method gauss-newton`, without its verdict.
    pub fn quick(target: &'a Target) -> Self {
        let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
        Self { target, settings, walls: false, verdict: VerdictSource::None }
    }

    pub fn run(&self, body: &Body<2>, model: &Model, made_by: &Provenance) -> Result<FitRecord, FitError> {
        let Self { target, settings, .. } = self;
        let fit = match body.palate.as_ref().filter(|_| self.walls) {
            None => inverse::fit(&body.mesh, model, target, settings)?,
            Some(palate) => {
                let matched = TargetOnBody::new(&body.mesh, target)?;
                let system = walled(body, model, palate, &matched.contracting())?;
                inverse::fit_in(&system, matched, settings)?
            }
        };
        let known = Muscles::built_in();
        let alarms = alarms::alarms(&body.mesh, &fit, &known, settings);
        let mut record = FitRecord::new(fit, alarms, made_by);
        let verdict = match self.verdict {
            VerdictSource::None => return Ok(record),
            VerdictSource::ShortRun => Verdict::of_target(body, model, target),
            VerdictSource::Posterior(posterior) => {
                record.posterior = posterior.ok().cloned();
                let verdict = posterior.map_err(str::to_owned).and_then(of_posterior);
                // Where the chains have not mixed, the posterior has no summary.
                let has_mixed = posterior.is_ok_and(|report| report.summary.is_some());
                if let Err(why) = &verdict
                    && !has_mixed
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

/// A body that its palate and teeth stop, as in a scene with `effects.contact`.
fn walled(
    body: &Body<2>,
    model: &Model,
    palate: &[SVector<f64, 2>],
    pulling: &[usize],
) -> Result<System<2>, SystemError> {
    let mut additions = Additions::default();
    let stiffness = system::coefficients(&body.mesh, model)?.tissue_stiffness;
    let nodes = body.mesh.surface_nodes();
    additions.add_contact(Contact::new(palate.to_vec(), &nodes, stiffness, CONTACT_REACH_MM * 1e-3));
    System::with(&body.mesh, model, pulling, additions)
}

/// The verdict of a posterior, or why it has none.
fn of_posterior(report: &Report) -> Result<Verdict, String> {
    let verdict = Verdict::of(report).ok_or_else(|| report.why.clone())?;
    if report.priors.baseline.off {
        return Err(
            "these priors switch off the tensions of the baseline, so every tension is a rise".to_owned()
        );
    }
    Ok(verdict)
}
