//! One fit as text: tensions, then every muscle with its measurement, then the verdict and the alarms.

use std::fmt::Write as _;
use std::path::PathBuf;

use comfy_table::Cell;
use tongue_fit::inverse::alarms::Alarm;
use tongue_fit::inverse::{Among, Fit, FitStatus, Tone};
use tongue_fit::measured::TargetKind;

use super::posterior::Sampled;
use super::published::Published;
use super::table::{LARGE, counted, files, newtons, table};

/// Content of the table.
pub struct Shown<'a> {
    pub fit: &'a Fit,
    /// Selection among answers that fit equally well.
    pub among: Among,
    /// Reasons for doubt.
    pub alarms: &'a [Alarm],
    /// For a fit of ratios, the fit of the same row by stretches.
    pub from_stretches: Option<&'a Fit>,
    /// The published answer, if there is one for the row.
    pub published: Option<&'a Published>,
    /// Thickness over which tensions act, m, if newtons are asked for.
    pub thickness_m: Option<f64>,
    /// What data and model leave open, where it was asked for.
    pub posterior: Option<(&'a Sampled<'a>, usize)>,
    /// The files that were written.
    pub written: &'a [PathBuf],
    /// Duration of the whole run, s.
    pub wall_s: f64,
}

/// Note if no posterior was asked for although it is possible.
const POINT: &str =
    "A POINT: rounding is under one per cent of what is not known of it; --posterior 1000 has the rest\n";
/// Smallest printed misfit: below it digits are rounding and differ between machines.
const NO_MISFIT: f64 = 1e-9;

impl Shown<'_> {
    pub fn text(&self) -> String {
        let target = &self.fit.target;
        let mut text = format!(
            "{} /{}/ against /{}/, {} fitted\n\n",
            target.subject,
            target.vowel,
            target.baseline,
            match target.kind {
                TargetKind::Ratio => format!("ratios to {}", target.muscles[target.reference]),
                TargetKind::Stretch => "stretches".to_owned(),
            }
        );
        text += &self.premises();
        text += &self.tensions();
        text += &self.muscles();
        text += &self.verdict();
        text += &match self.posterior {
            Some((posterior, posture)) => posterior.text(posture),
            None => POINT.to_owned(),
        };
        let _ = writeln!(text, "{} equilibria in {:.0} ms\n", self.fit.evaluations, 1e3 * self.wall_s);
        text + &files(self.written)
    }

    /// Premises that differ from the thesis's, if there are any.
    fn premises(&self) -> String {
        let fit = self.fit;
        if fit.tone.is_none() && fit.bones.is_empty() {
            return String::new();
        }
        let names: Vec<&str> = fit.bones.iter().map(|b| b.name.as_str()).collect();
        let bones = match names[..] {
            [] => "every bone stays where it is".to_owned(),
            _ => format!("{} may move (prior 5 mm)", names.join(" and ")),
        };
        format!("changes are counted from the tongue {}\n{bones}\n\n", fit.tone.posture())
    }

    /// Displacements of the free bones.
    fn bones(&self) -> String {
        let mut text = String::new();
        for b in &self.fit.bones {
            let [x, y] = [0, 1].map(|axis| 1e3 * b.shift[axis]);
            let [half_x, half_y] = [0, 1].map(|axis| 1e3 * b.half_width[axis]);
            let way = |value: f64, half: f64, names: [&str; 2]| {
                let name = names[usize::from(value < 0.0)];
                let (value, [low, high]) = (value.abs(), [value.abs() - half, value.abs() + half]);
                format!("{value:.1} mm {name} ({low:.1} to {high:.1})")
            };
            let mut ways = vec![way(x, half_x, ["back", "forward"])];
            if half_y != 0.0 {
                ways.push(way(y, half_y, ["up", "down"]));
            }
            let _ = writeln!(text, "{} moves {}: 95 % intervals", b.name, ways.join(", "));
        }
        text
    }

    fn tensions(&self) -> String {
        let target = &self.fit.target;
        let mut header = vec!["tension, N per metre of thickness"];
        header.extend(target.active_names());
        let mut t = table(&header);
        let row = |name: &str, values: &[f64], unit: f64| {
            let mut row = vec![Cell::new(name)];
            row.extend(target.active.iter().map(|&m| Cell::new(newtons(unit * values[m]))));
            row
        };
        let tone: Vec<f64> = self.fit.muscles.iter().map(|m| self.fit.tone.of(m)).collect();
        let mut rows = vec![("found", self.fit.tensions.as_slice())];
        rows.extend((!self.fit.tone.is_none()).then_some(("in the baseline (tone)", tone.as_slice())));
        let other = self.from_stretches.map(|f| match &f.tone {
            Tone::Uniform(tone) if *tone > 0.0 => (format!("found from stretches, tone {tone}"), f),
            _ => ("found from stretches".to_owned(), f),
        });
        rows.extend(other.as_ref().map(|(name, f)| (name.as_str(), f.tensions.as_slice())));
        rows.extend(self.published.map(|p| ("published (Kato 2014, 4.4.1)", p.tensions.as_slice())));
        for (name, values) in &rows {
            t.add_row(row(name, values, 1.0));
        }
        if let Some(thickness) = self.thickness_m {
            for (name, values) in &rows {
                t.add_row(row(&format!("{name}, N over {} mm", 1e3 * thickness), values, thickness));
            }
        }
        format!("{t}\n\n")
    }

    fn muscles(&self) -> String {
        let (fit, target) = (self.fit, &self.fit.target);
        let quantity = target.kind.name();
        let [measured, simulated] = ["measured", "simulated"].map(|what| format!("{quantity},\n{what}"));
        let shortening = ["shortening,\nmeasured", "shortening,\nsimulated"];
        let mut header = vec!["muscle", shortening[0], shortening[1], &measured, &simulated, "residual"];
        if self.published.is_some() {
            header.extend(["published", "table 4.8"]);
        }
        let mut t = table(&header);
        for (i, muscle) in target.muscles.iter().enumerate() {
            let mark = if fit.contracts(i) { "*" } else { "" };
            let doubt = if target.activation[i].uncertain { "?" } else { "" };
            let shortening = |now: f64, then: f64| percent(1.0 - now / then);
            let mut row = vec![
                format!("{muscle}{mark}{doubt}"),
                shortening(target.measured_mm[i], target.baseline_mm[i]),
                shortening(fit.lengths[i], fit.baseline_lengths[i]),
                format!("{:.3}", target.values[i]),
                format!("{:.3}", fit.simulated[i]),
                residual(fit.residuals[i]),
            ];
            if let Some(p) = self.published {
                let (here, there) = p.of(target.kind);
                row.push(format!("{:.3}", here[i]));
                row.push(format!("{:.2}", there[i]));
            }
            t.add_row(row);
        }
        let over = match fit.tone.is_none() {
            true => format!("of the length in /{}/ (measured) or at rest (simulated)", target.baseline),
            false => format!("of the length in /{}/, measured and simulated", target.baseline),
        };
        let mut text = format!("{t}\n* contracting: has a tension; shortening: {over}\n");
        if self.published.is_some() {
            let _ = writeln!(
                text,
                "published: {quantity} simulated here with the published tensions; table 4.8: there"
            );
        }
        if target.activation.iter().any(|a| a.uncertain) {
            text += "? changed by no more than the rounding of two lengths: may be the other way\n";
        }
        let names = fit.not_measured().join(", ");
        if !names.is_empty() {
            let with =
                if fit.tone.is_none() { "without tension" } else { "with the tension of the baseline" };
            let _ = writeln!(
                text,
                "not measured, so neither fitted nor compared, and {with}, though nobody knows: {names}"
            );
        }
        text
    }

    fn verdict(&self) -> String {
        let (fit, target) = (self.fit, &self.fit.target);
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
        let mut text = format!("\n{status} (misfit {misfit})\n");
        for alarm in self.alarms {
            let _ = writeln!(text, "but {}", alarm.text());
        }
        let open = fit.identifiability.as_ref().map_or(0, |i| i.null_directions.len());
        let chosen = open > 0 && self.among == Among::Others;
        if let Some(rms) = fit.passive_rms() {
            let what = match chosen {
                true => "other measured muscles, of which the fit sees one combination",
                false => "passive muscles, which the fit does not see",
            };
            let _ = writeln!(text, "{what}: {rms:.3} RMS residual");
        }
        text += &self.bones();
        text += &self.uniqueness(open, chosen);
        if let Some(p) = self.published {
            let misfit: f64 =
                target.fitted.iter().map(|&m| (p.of(target.kind).0[m] - target.values[m]).powi(2)).sum();
            let _ = writeln!(
                text,
                "the published tensions miss the target by {:.3} here (RMS), and table 4.8 by {:.3} over {} ratios",
                (misfit / target.fitted.len() as f64).sqrt(),
                p.rms,
                target.muscles.len() - 1
            );
        }
        text
    }

    /// The number of answers, in words.
    fn uniqueness(&self, open: usize, chosen: bool) -> String {
        let (fit, target) = (self.fit, &self.fit.target);
        let Some(i) = &fit.identifiability else {
            return "uniqueness: not known, for want of a regular equilibrium\n".to_owned();
        };
        if open == 0 {
            return match fit.status {
                FitStatus::Converged if !fit.bones.is_empty() => format!(
                    "unique nearby: {} and the priors determine every tension and displacement\n",
                    counted(target.fitted.len(), "equation")
                ),
                FitStatus::Converged => {
                    "unique nearby: the target determines every direction of tension\n".to_owned()
                }
                _ => String::new(),
            };
        }
        let names: Vec<String> = target.active_names().into_iter().map(str::to_owned).collect();
        let named = |values: &[f64]| {
            let pairs = names
                .iter()
                .zip(values)
                .map(|(m, v)| if *v < LARGE { format!("{m} {v:.1}") } else { format!("{m} {v:.1e}") });
            pairs.collect::<Vec<_>>().join(", ")
        };
        let mut text = format!(
            "NOT UNIQUE: {} for {} tensions leave {} undetermined.\n",
            counted(target.fitted.len(), "equation"),
            target.active.len(),
            counted(open, "direction"),
        );
        let found = match (fit.status, chosen) {
            (FitStatus::Converged, true) => "what comes nearest to the other measured muscles",
            (FitStatus::Converged, false) => "the smallest total tension",
            (FitStatus::AtUpperBound, true) => {
                "what comes nearest to the other measured muscles within the bounds: beyond them others may come nearer"
            }
            _ => "one answer",
        };
        let valleys: Vec<_> = i.null_directions.iter().filter_map(|n| n.valley.as_ref()).collect();
        let points = valleys.iter().map(|v| v.points.len()).sum();
        if points == 0 {
            text += "No answer meets the target, so there is no curve of answers.\n";
            return text;
        }
        let _ = writeln!(
            text,
            "Found is {found}.\nAs good is a curve of tensions ({} in fit.json):",
            counted(points, "point")
        );
        for valley in valleys {
            if let (Some(first), Some(last)) = (valley.points.first(), valley.points.last()) {
                let [before, after] = valley.ends.map(|end| end.text(&names));
                let _ = writeln!(text, "  from  {} N: {before}", named(&first.x));
                let _ = writeln!(text, "  to    {} N: {after}", named(&last.x));
            }
        }
        text
    }
}

/// Three digits with a sign, but none for a zero.
fn residual(value: f64) -> String {
    if value.abs() < 5e-4 { "0.000".into() } else { format!("{value:+.3}") }
}

fn percent(part: f64) -> String {
    let text = format!("{:.1} %", 100.0 * part);
    if text.starts_with("-0.0 ") { "0.0 %".into() } else { text }
}
