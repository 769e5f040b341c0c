//! One fit as text: the verdict, then the tensions at which the model meets what was measured; with -v every muscle beside its measurement.

use std::fmt::Write as _;
use std::path::PathBuf;

use tongue_fit::inverse::alarms::Alarm;
use tongue_fit::inverse::valley::Valley;
use tongue_fit::inverse::{Fit, FitStatus};
use tongue_fit::measured::TargetKind;
use tongue_fit::posterior::Verdict;
use tongue_fit::report::{self, fixed};

use super::fit_muscles::muscles;
use super::posterior::Sampled;
use super::published::Published;
use super::table::{counted, newtons, rows};

pub struct Shown<'a> {
    pub fit: &'a Fit,
    /// Which muscles pull harder than in the baseline, or why that is not said.
    pub verdict: Result<&'a Verdict, &'a str>,
    pub is_verbose: bool,
    pub alarms: &'a [Alarm],
    /// For a fit of ratios, the fit of the same row by stretches.
    pub from_stretches: Option<&'a Fit>,
    pub published: Option<&'a Published>,
    /// What data and model leave open, where it was asked for.
    pub posterior: Option<(&'a Sampled<'a>, usize)>,
    pub written: &'a [PathBuf],
    pub wall_s: f64,
}

/// Advice below a verdict.
const BELIEVE: &str = "Believe the verdict before these tensions; --posterior 1000 says more";
const ALARMS: usize = 3;
const COLUMNS: usize = 100;
/// What all lines of a sentence but the first begin with.
const INDENT: &str = "  ";
/// Smallest printed misfit: below it digits are rounding and differ between machines.
const NO_MISFIT: f64 = 1e-9;

impl Shown<'_> {
    pub fn text(&self) -> String {
        let mut text = self.told_first();
        if let Some((posterior, posture)) = self.posterior {
            text += &posterior.text(posture, self.is_verbose);
        }
        text += &self.heading();
        text += &self.tensions();
        text += &self.met();
        text += &self.not_measured();
        text += &self.uniqueness();
        text += &self.advice();
        if self.is_verbose {
            text += &muscles(self.fit, self.published);
        }
        let more = if self.is_verbose { "" } else { "; -v shows every muscle" };
        let took = format!("{} equilibria in {:.0} ms{more}", self.fit.evaluations, 1e3 * self.wall_s);
        let _ = writeln!(text, "{took}\n");
        text + &in_one_line(self.written)
    }

    /// The verdict, which stands before all else.
    fn told_first(&self) -> String {
        let target = &self.fit.target;
        let mut text = format!("{} /{}/ against /{}/\n", target.subject, target.vowel, target.baseline);
        match self.verdict {
            Ok(verdict) => {
                for sentence in verdict.sentences(target.baseline.label()) {
                    text += &wrapped(&sentence);
                }
                if let Some([back, up]) = verdict.hyoid_mm.filter(|_| self.is_verbose) {
                    let range = |[low, high]: [f64; 2]| format!("{} to {} mm", fixed(low, 1), fixed(high, 1));
                    text += &wrapped(&format!("Hyoid, 95 %: back {}, up {}.", range(back), range(up)));
                }
            }
            Err(why) => text += &wrapped(&format!("No verdict of which muscles pull harder: {why}.")),
        }
        text
    }

    /// What the tensions below are.
    fn heading(&self) -> String {
        let target = &self.fit.target;
        let what = match target.kind {
            TargetKind::Ratio => format!("ratios to {}", target.muscles[target.reference]),
            TargetKind::Stretch => "stretches".to_owned(),
        };
        let curve = match self.curve_points() {
            0 => "",
            _ => ", one point of a curve of them",
        };
        format!("\nThe thesis's fit: tensions that meet the measured {what}{curve}\n\n")
    }

    /// Points of the curves of tensions that fit equally well.
    fn curve_points(&self) -> usize {
        self.valleys().map(|v| v.points.len()).sum()
    }

    fn valleys(&self) -> impl Iterator<Item = &Valley> {
        self.fit.identifiability.iter().flat_map(|i| &i.null_directions).filter_map(|n| n.valley.as_ref())
    }

    /// How many directions of tension the target leaves open.
    fn open(&self) -> usize {
        self.fit.identifiability.as_ref().map_or(0, |i| i.null_directions.len())
    }

    fn tensions(&self) -> String {
        let target = &self.fit.target;
        let mut header = vec!["tension, N/m"];
        header.extend(target.active_names());
        let own = |tensions: &[f64]| target.active.iter().map(|&m| tensions[m]).collect::<Vec<_>>();
        let mut found = vec![("found", own(&self.fit.tensions))];
        found.extend(self.from_stretches.map(|f| ("found from stretches", own(&f.tensions))));
        for valley in self.valleys() {
            if let (Some(first), Some(last)) = (valley.points.first(), valley.points.last()) {
                found.push(("fits as well, from", first.x.clone()));
                found.push(("fits as well, to", last.x.clone()));
            }
        }
        found.extend(self.published.map(|p| ("published (Kato 2014, 4.4.1)", own(&p.tensions))));
        let t = rows(&header, &found, |(name, values)| {
            std::iter::once((*name).to_owned()).chain(values.iter().map(|v| newtons(*v)))
        });
        format!("{t}\n\n")
    }

    fn not_measured(&self) -> String {
        let names = self.fit.not_measured().join(", ");
        if names.is_empty() {
            return String::new();
        }
        wrapped(&format!("not measured, so neither fitted nor compared, and given no tension: {names}"))
    }

    /// How well the answer meets the measurements, and the reasons for doubt.
    fn met(&self) -> String {
        let fit = self.fit;
        let status = match fit.status {
            FitStatus::Converged => "converged: the fitted muscles meet the target",
            FitStatus::TargetNotMet => {
                "NOT MET: the search found no tensions that meet the target; these come nearest"
            }
            FitStatus::AtUpperBound if fit.misfit <= fit.misfit_tolerance => {
                "AT THE UPPER BOUND: the fitted muscles meet the target, but a tension ended on its bound; do not trust it"
            }
            FitStatus::AtUpperBound => "AT THE UPPER BOUND: a tension ended on it; do not trust the answer",
            FitStatus::IterationLimit => "NOT CONVERGED: the search stopped at its iteration limit",
            FitStatus::ReplayDiffers => "NOT REPRODUCED: from rest these tensions lead to another shape",
            FitStatus::NoEquilibrium => "NO EQUILIBRIUM was found at the answer; do not use it",
        };
        let misfit = if fit.misfit < NO_MISFIT { "below 1e-9".into() } else { format!("{:.1e}", fit.misfit) };
        let mut text = format!("{status} (misfit {misfit})\n");
        let shown = if self.is_verbose { self.alarms.len() } else { ALARMS };
        for alarm in self.alarms.iter().take(shown) {
            text += &wrapped(&format!("but {}", alarm.text()));
        }
        if self.alarms.len() > shown {
            let _ = writeln!(text, "and {} in fit.json", counted(self.alarms.len() - shown, "more doubt"));
        }
        if let Some(rms) = fit.passive_rms() {
            let quantity = match fit.target.kind {
                TargetKind::Ratio => "ratios",
                TargetKind::Stretch => "stretches",
            };
            let _ = match self.open() > 0 {
                true => writeln!(
                    text,
                    "{quantity} of the other measured muscles, which only chose the point on the curve: off by {rms:.3} (RMS)"
                ),
                false => writeln!(
                    text,
                    "{quantity} of the passive muscles, which the fit does not see: off by {rms:.3} (RMS)"
                ),
            };
        }
        text
    }

    /// What to believe, where no draws say it.
    fn advice(&self) -> String {
        let advice = match (self.posterior, self.verdict) {
            (None, Ok(_)) => format!("{BELIEVE}\n"),
            (None, Err(_)) => "These tensions ignore errors of anatomy and model\n".to_owned(),
            (Some(_), _) => String::new(),
        };
        if self.is_verbose { advice + &wrapped(&report::limit_of_plane()) } else { advice }
    }

    fn uniqueness(&self) -> String {
        let (fit, target, open) = (self.fit, &self.fit.target, self.open());
        if fit.identifiability.is_none() {
            return "whether other tensions fit as well is not known: the stiffness is singular here\n"
                .to_owned();
        }
        if open == 0 {
            return match fit.status {
                FitStatus::Converged => {
                    "unique nearby: the target determines every direction of tension\n".to_owned()
                }
                _ => String::new(),
            };
        }
        let mut text = format!(
            "NOT UNIQUE: {} for {} tensions leave {} undetermined",
            counted(target.fitted.len(), "equation"),
            target.active.len(),
            counted(open, "direction"),
        );
        if self.curve_points() == 0 {
            return text + "\nNo answer meets the target, so there is no curve of answers.\n";
        }
        text += match fit.status {
            FitStatus::Converged => "\n",
            FitStatus::AtUpperBound => "; beyond the bounds others may come nearer\n",
            _ => "; found is one answer\n",
        };
        let names: Vec<String> = target.active_names().into_iter().map(str::to_owned).collect();
        for valley in self.valleys() {
            let [before, after] = valley.ends.map(|end| end.text(&names));
            text += &wrapped(&format!("the curve's ends: {before}; {after}"));
        }
        text
    }
}

/// A sentence in lines of the terminal's width, broken between words.
fn wrapped(sentence: &str) -> String {
    report::wrapped(sentence, COLUMNS - INDENT.len()).join(&format!("\n{INDENT}")) + "\n"
}

/// The files that were written, by their folder.
fn in_one_line(written: &[PathBuf]) -> String {
    let Some(folder) = written.first().and_then(|path| path.parent()) else { return String::new() };
    let names: Vec<String> =
        written.iter().map(|p| p.strip_prefix(folder).unwrap_or(p).display().to_string()).collect();
    wrapped(&format!("written to {}: {}", folder.display(), names.join(", ")))
}
