use std::fmt::Write as _;

use tongue_core::body::ContinuumSettings;
use tongue_core::statistics::distinct;

use super::{ContinuumStudy, NEARLY_INCOMPRESSIBLE, Spacing};
use tongue_files::report::{PrecisionCurve, ReportError, Svg, work_precision};

use crate::Error;
use crate::measure::ONE_PER_CENT;
use crate::table::{duration, markdown, number};

/// The coarsest mesh whose tensions are within 1 % of those of the finest or, if there is none, the nearest one. The finest mesh itself has
/// no error.
pub fn verdict(spacings: &[Spacing]) -> String {
    let of_continuum = spacings.iter().filter(|r| r.body == "continuum");
    let known = of_continuum.filter_map(|r| Some((r, r.error_of_tension.filter(|e| *e > 0.0)?)));
    let first = known.clone().find(|(_, error)| *error <= ONE_PER_CENT);
    let Some((r, error)) = first.or_else(|| known.min_by(|a, b| a.1.total_cmp(&b.1))) else {
        return "No mesh of this study has tensions to compare.".to_owned();
    };
    let (per_cent, note) = if error <= ONE_PER_CENT {
        ("1".to_owned(), "")
    } else {
        let note = " Errors are differences from the finest mesh; no other mesh is nearer to it.";
        (format!("{:.1}", 100.0 * error), note)
    };
    let (h, solve, fit) = (number(r.h_mm), duration(r.solve_s), duration(r.fit_s));
    format!(
        "**For {per_cent} % of a tension take --body continuum at h = {h} mm: an equilibrium costs {solve}, a fit {fit}.**{note}"
    )
}

pub fn picture(spacings: &[Spacing]) -> Result<Svg, ReportError> {
    let bodies = distinct(spacings.iter().map(|row| row.body));
    let curves = bodies.into_iter().map(|body| {
        let own = spacings.iter().filter(|row| row.body == body);
        let points = own.filter_map(|row| Some((row.fit_s, row.error_of_tension?))).collect();
        PrecisionCurve { name: body.to_owned(), points }
    });
    let curves: Vec<PrecisionCurve> = curves.collect();
    let title = "Fits of S2 /a/: difference from the finest mesh of the same body";
    work_precision(title, "time of a fit, s", "error of a tension, as a part of it", &curves)
}

pub fn page(study: &ContinuumStudy, made: &str) -> Result<String, Error> {
    let mut p = format!(
        "# The continuum: accuracy, time, and what was chosen\n\n{made}\n\n{}\n\n",
        verdict(&study.spacings)
    );
    if let Some(default) = study.sensitivity.first() {
        let _ = write!(
            p,
            "This body is stiffer than springs on connections. **The tensions published for /a/ (12.0, 11.5, 4.5 N) are {} away from \
             table 4.8 here (RMS over seven ratios); {:.2} times as much is nearest, at {}.**\n\n",
            number(default.rms_to_published_ratios),
            default.best_factor,
            number(default.rms_at_best)
        );
    }
    let _ = write!(
        p,
        "![Error of a fitted tension against time](spacings.svg)\n\n## Mesh\n\n/a/ at the published tensions on nested meshes; errors against the finest mesh of the same body; the default spacing, 4 mm, \
         is not one of them. The tension is the worst of the three that are fitted to the stretches of S2 /a/. The control is expected not to converge. Times are medians of up to 15 solves and \
         3 fits (Gauss-Newton, one start).\n\n{}",
        markdown(&study.spacings, &[])?
    );
    let _ = write!(
        p,
        "## Locking\n\nThe same ratios at other Poisson's ratios: at 4 mm, the default spacing, against 2 mm, and against those of {NEARLY_INCOMPRESSIBLE}.\n\n{}",
        markdown(&study.locking, &[])?
    );
    let _ = write!(
        p,
        "## What has no data\n\nThe width of muscles and how bones hold are chosen, not measured: {}. Tensions fitted to the stretches of S1 to \
         S3 (12 rows, 4 mm), over those with the default settings. They were not tuned on muscles that a fit does not see.\n\n{}",
        ContinuumSettings::default(),
        markdown(&study.sensitivity, &[])?
    );
    Ok(p)
}
