//! Every muscle of a fit beside its measurement, as text.

use std::fmt::Write as _;

use tongue_fit::inverse::Fit;
use tongue_fit::report::fixed;

use super::published::Published;
use super::table::rows;

pub fn muscles(fit: &Fit, published: Option<&Published>) -> String {
    let target = &fit.target;
    let quantity = target.kind.name();
    let [measured, simulated] = ["measured", "simulated"].map(|what| format!("{quantity},\n{what}"));
    let shortening = ["shortening,\nmeasured", "shortening,\nsimulated"];
    let mut header = vec!["muscle", shortening[0], shortening[1], &measured, &simulated, "residual"];
    if published.is_some() {
        header.extend(["published", "table 4.8"]);
    }
    let t = rows(&header, target.muscles.iter().enumerate(), |(i, muscle)| {
        let mark = if fit.contracts(i) { "*" } else { "" };
        let doubt = if target.activation[i].uncertain { "?" } else { "" };
        let shortening = |now: f64, then: f64| fixed(100.0 * (1.0 - now / then), 1) + " %";
        let residual = fit.residuals[i];
        let mut row = vec![
            format!("{muscle}{mark}{doubt}"),
            shortening(target.measured_mm[i], target.baseline_mm[i]),
            shortening(fit.lengths[i], fit.rest_lengths[i]),
            format!("{:.3}", target.values[i]),
            format!("{:.3}", fit.simulated[i]),
            if residual.abs() < 5e-4 { "0.000".into() } else { format!("{residual:+.3}") },
        ];
        if let Some(p) = published {
            let (here, there) = p.of(target.kind);
            row.push(format!("{:.3}", here[i]));
            row.push(format!("{:.2}", there[i]));
        }
        row
    });
    let over = format!("of the length in /{}/ (measured) or at rest (simulated)", target.baseline);
    let mut text = format!("\n{t}\n* contracting: more tension than in the baseline; shortening: {over}\n");
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
            target.fitted.iter().map(|&m| (p.of(target.kind).0[m] - target.values[m]).powi(2)).sum();
        let _ = writeln!(
            text,
            "the published tensions miss the target by {:.3} here (RMS), and table 4.8 by {:.3} over {} ratios",
            (squares / target.fitted.len() as f64).sqrt(),
            p.rms,
            target.muscles.len() - 1
        );
    }
    text + "\n"
}
