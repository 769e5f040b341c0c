//! The posterior of rows of one speaker that are sampled together.

use std::time::Instant;

use tongue_infer::inverse::TargetOnBody;
use tongue_infer::posterior::{
    self, AuxiliaryData, Contrast, Measurements, Posterior, PosteriorModel, Report, Sampling,
};
use tongue_input::measured::Target;

use crate::report::{self, Draws, Files, Svg};
use crate::simulation::SimulationError;

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
        let posterior = posterior::sample(model, seen, &sampling)?;
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
        format!("{} /{}/", self.subject, self.posterior.density.measurements.labels[posture])
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
