//! One fit as text: the verdict, the tensions with what they miss, and what to trust; with -v also the alarms and every muscle.

use std::fmt::Write as _;
use std::path::PathBuf;

use tongue_fit::inner::report::{self, Conclusion, FitRecord, joined, range, status_in_words, with_decimals};
use tongue_fit::inner::run::{Published, SampledPosterior};
use tongue_fit::inverse::Fit;
use tongue_fit::measured::{TargetKind, Thesis, Vowel};

use super::output::is_verbose;
use super::posterior::{self, ACTIVE_BASELINE};
use super::table::{count_of, newtons, rows, wrap_sentence};

pub struct ShownFit<'a> {
    pub record: &'a FitRecord,
    pub conclusion: &'a Conclusion,
    /// The fit of the same row by stretches, beside a fit of ratios.
    pub from_stretches: Option<&'a Fit>,
    pub published: Option<&'a Published>,
    /// The posterior with the index of the posture, if it was asked for.
    pub posterior: Option<(&'a SampledPosterior<'a>, usize)>,
    pub written: &'a [PathBuf],
}

/// Smallest misfit that is printed; smaller ones are rounding errors and differ between machines.
const NO_MISFIT: f64 = 1e-9;

impl ShownFit<'_> {
    pub fn text(&self) -> String {
        let mut text = self.verdict();
        if let Some((sampled, posture)) = self.posterior {
            text += &posterior::text(sampled, posture);
        }
        text += &self.heading();
        text += &self.tensions();
        text += &self.not_measured();
        if is_verbose() {
            text += &self.search_outcome();
            text += &muscles(&self.record.fit, self.published);
        }
        if self.conclusion.trusted {
            text += &wrap_sentence(&format!("{}{}", self.conclusion.text, self.more()));
        }
        text + &in_one_line(self.written)
    }

    fn more(&self) -> &'static str {
        match (is_verbose(), self.posterior) {
            (true, _) => "",
            // The reason why there is no verdict says how many draws the body needs.
            (false, None) if self.conclusion.tensions_trusted && self.record.verdict.is_some() => {
                "; -v and --posterior 1000 say more"
            }
            (false, _) => "; -v says more",
        }
    }

    fn verdict(&self) -> String {
        let target = &self.record.fit.matched.target;
        let is_active = target.has_active_baseline() && target.vowel != Vowel::unrounded_u();
        let note = if is_active { ACTIVE_BASELINE } else { "" };
        let mut text = format!("{} /{}/ against /{}/{note}\n", target.subject, target.vowel, target.baseline);
        match &self.record.verdict {
            Some(verdict) => {
                for sentence in verdict.sentences(target.baseline.label()) {
                    text += &wrap_sentence(&sentence);
                }
                if let Some(hyoid_mm) = verdict.hyoid_mm.filter(|_| is_verbose()) {
                    let [back, up] = hyoid_mm.map(|ends| range(ends, 1));
                    text += &wrap_sentence(&format!("Hyoid, 95 %: back {back} mm, up {up} mm."));
                }
            }
            None => {
                let why = self.record.no_verdict.as_deref().unwrap_or("it was not asked for");
                text += &wrap_sentence(&format!("No verdict of which muscles pull harder: {why}."));
            }
        }
        text
    }

    fn heading(&self) -> String {
        let fit = &self.record.fit;
        let name = match fit.matched.target.kind {
            TargetKind::Ratio => "The thesis's fit",
            TargetKind::Stretch => "The fit",
        };
        let what = match (fit.answer.misfit <= fit.settings.misfit_tolerance, fit.answer.undetermined()) {
            (false, _) => "it misses",
            (true, None) => "it meets",
            (true, Some(0)) => "the only one nearby that meets",
            (true, Some(_)) => "one of many that meet",
        };
        let quantity = self.quantity();
        let others = fit.passive_rms().map(|rms| format!("; other {quantity} are off by {rms:.3} (RMS)"));
        format!("\n{name}: {what} the fitted {quantity}{}\n", others.unwrap_or_default())
    }

    fn quantity(&self) -> &'static str {
        match self.record.fit.matched.target.kind {
            TargetKind::Ratio => "ratios",
            TargetKind::Stretch => "stretches",
        }
    }

    fn tensions(&self) -> String {
        let fit = &self.record.fit;
        let (target, lengths) = (&fit.matched.target, fit.lengths());
        let mut header = vec!["tension, N/m"];
        header.extend(target.active_names());
        let own = |tensions: &[f64]| target.active.iter().map(|&m| newtons(tensions[m])).collect::<Vec<_>>();
        let mut found = vec![("found", own(&fit.tensions()))];
        found.extend(self.from_stretches.map(|f| ("found from stretches", own(&f.tensions()))));
        for curve in fit.answer.solution_curves() {
            if let (Some(first), Some(last)) = (curve.points.first(), curve.points.last()) {
                let ranges = first.x.iter().zip(&last.x).map(|(a, b)| range([*a, *b], 1));
                found.push(("fits as well", ranges.collect()));
            }
        }
        found.extend(self.published.map(|_| {
            let tensions = Thesis::reference().tensions_a().into_iter();
            ("published (Kato 2014, 4.4.1)", tensions.map(|(_, tension)| newtons(tension)).collect())
        }));
        let shortens = target.active.iter().map(|&m| {
            let measured = with_decimals(shortening_percent(target.measured_mm[m], target.baseline_mm[m]), 0);
            format!("{} ({measured})", with_decimals(shortening_percent(lengths[m], fit.rest_lengths[m]), 0))
        });
        found.push(("shortens, % (measured)", shortens.collect()));
        let t = rows(&header, found, |(name, values)| std::iter::once(name.to_owned()).chain(values));
        format!("{t}\n")
    }

    fn not_measured(&self) -> String {
        let names = self.record.fit.not_measured().join(", ");
        if names.is_empty() {
            return String::new();
        }
        wrap_sentence(&format!("not measured, so neither fitted nor compared, and given no tension: {names}"))
    }

    fn search_outcome(&self) -> String {
        let Fit { answer, matched, .. } = &self.record.fit;
        let misfit =
            if answer.misfit < NO_MISFIT { "below 1e-9".into() } else { format!("{:.1e}", answer.misfit) };
        let mut text = format!(
            "\n{}: the fitted {} are missed by {misfit} (RMS); {} equilibria; {:.0} ms in all\n",
            status_in_words(&answer.status),
            self.quantity(),
            answer.counts.evaluations,
            1e3 * self.record.wall_s.unwrap_or_default()
        );
        for alarm in &self.record.alarms {
            text += &wrap_sentence(&format!("but {alarm}"));
        }
        let open = answer.undetermined().unwrap_or(0);
        if open > 0 {
            let [equations, directions] = [(matched.target.fitted.len(), "equation"), (open, "direction")]
                .map(|(n, what)| count_of(n, what));
            let _ = writeln!(
                text,
                "NOT UNIQUE: {equations} for {} tensions leave {directions} undetermined",
                matched.target.active.len()
            );
        }
        let names = self.record.fit.active_names();
        for curve in answer.solution_curves() {
            let [before, after] = curve.ends.map(|end| end.text(&names));
            text += &wrap_sentence(&format!(
                "the curve of tensions that fit as well ends where {before}, and where {after}"
            ));
        }
        text + &wrap_sentence(&report::limit_of_plane())
    }
}

fn in_one_line(written: &[PathBuf]) -> String {
    let Some(folder) = written.first().and_then(|path| path.parent()) else { return String::new() };
    let names = written.iter().map(|path| path.strip_prefix(folder).unwrap_or(path).display());
    format!("written to {}: {}\n", folder.display(), joined(names, ", "))
}

fn shortening_percent(length: f64, than: f64) -> f64 {
    100.0 * (1.0 - length / than)
}

fn muscles(fit: &Fit, published: Option<&Published>) -> String {
    let target = &fit.matched.target;
    let (lengths, simulated, residuals) = (fit.lengths(), fit.simulated(target.kind), fit.residuals());
    let quantity = target.kind.name();
    let [of_measured, of_simulated] = ["measured", "simulated"].map(|what| format!("{quantity},\n{what}"));
    let shortening = ["shortening,\nmeasured", "shortening,\nsimulated"];
    let mut header = vec!["muscle", shortening[0], shortening[1], &of_measured, &of_simulated, "residual"];
    if published.is_some() {
        header.extend(["published", "table 4.8"]);
    }
    let t = rows(&header, target.muscles.iter().enumerate(), |(i, muscle)| {
        let mark = if fit.has_tension(muscle) { "*" } else { "" };
        let doubt = if target.activation[i].uncertain { "?" } else { "" };
        let residual = residuals[i];
        let mut row = vec![
            format!("{muscle}{mark}{doubt}"),
            with_decimals(shortening_percent(target.measured_mm[i], target.baseline_mm[i]), 1) + " %",
            with_decimals(shortening_percent(lengths[i], fit.rest_lengths[i]), 1) + " %",
            format!("{:.3}", target.values[i]),
            format!("{:.3}", simulated[i]),
            if residual.abs() < 5e-4 { "0.000".into() } else { format!("{residual:+.3}") },
        ];
        if let Some(p) = published {
            let (here, there) = p.values(target.kind);
            row.push(format!("{:.3}", here[i]));
            row.push(format!("{:.2}", there[i]));
        }
        row
    });
    let over = format!("of the length in /{}/ (measured) or at rest (simulated)", target.baseline);
    let mut text = format!("\n{t}\n* found to pull: more tension than in the baseline; shortening: {over}\n");
    if published.is_some() {
        let _ = writeln!(
            text,
            "published: {quantity} simulated here with the published tensions; table 4.8: {quantity} printed in the thesis"
        );
    }
    if target.activation.iter().any(|a| a.uncertain) {
        text +=
            "? changed by no more than the rounding of two lengths, so the sign of the change is not known\n";
    }
    if let Some(p) = published {
        let squares: f64 =
            target.fitted.iter().map(|&m| (p.values(target.kind).0[m] - target.values[m]).powi(2)).sum();
        let _ = writeln!(
            text,
            "the published tensions miss the target by {:.3} here (RMS); the {2} ratios that they give here differ from table 4.8 by {1:.3} (RMS)",
            (squares / target.fitted.len() as f64).sqrt(),
            p.rms,
            target.muscles.len() - 1
        );
    }
    text + "\n"
}
