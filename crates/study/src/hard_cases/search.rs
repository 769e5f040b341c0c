//! Cases 6 and 7: targets that cannot be met, and difficult searches.

use tongue_core::statics;
use tongue_core::system::Model;
use tongue_files::report::status_name;
use tongue_infer::inverse::{self, Answer, Fit, FitSettings, FitStatus};
use tongue_input::measured::{Dataset, Target, TargetKind};

use super::HardCase;
use crate::Error;
use crate::measure::timed;
use crate::test_tensions::{target, tongue};

/// Whether the target can be met, if this is known. A fit must miss a target that cannot be met and meet one that can.
type Reachable = Option<bool>;

pub(super) fn targets() -> Result<Vec<HardCase>, Error> {
    let data = Dataset::reference()?;
    let eight: Vec<&str> = data.muscles.iter().map(String::as_str).collect();
    let a = target("S2", "a", TargetKind::Stretch, &[])?;
    let one = target("S2", "a", TargetKind::Stretch, &["HGa"])?;
    let of_one = |value| with_values(one.clone(), &[("HGa", value)]);
    let pair = target("S1", "o", TargetKind::Stretch, &["GGa", "SGa"])?;
    let cases = [
        ("S2 /a/, ratios", target("S2", "a", TargetKind::Ratio, &[])?, Some(true)),
        ("unreachable: HGa to a hundredth of its length", of_one(0.01), Some(false)),
        ("unreachable: HGa three times as long", of_one(3.0), Some(false)),
        ("at the bound: HGa as at rest", of_one(1.0), Some(true)),
        (
            "contradictory: GGa half, SGm double, HGa half",
            with_values(a, &[("GGa", 0.5), ("SGm", 2.0), ("HGa", 0.5)]),
            Some(false),
        ),
        ("one muscle", one.clone(), None),
        ("all eight", target("S2", "a", TargetKind::Stretch, &eight)?, None),
        ("S1 /o/ with GGa at 0.70 and SGa at 1.29", with_values(pair, &[("GGa", 0.70), ("SGa", 1.29)]), None),
    ];
    cases.into_iter().map(|(name, t, reachable)| row(name, &t, &two_starts(), reachable)).collect()
}

fn with_values(mut t: Target, values: &[(&str, f64)]) -> Target {
    for (name, value) in values {
        t.muscles.iter().position(|m| m == name).into_iter().for_each(|m| t.values[m] = *value);
    }
    t
}

/// Case 7. In a sample, the search in which every direct solve fails may take one more iteration a solve, and is three times as fast.
pub(super) fn simplices(full: bool) -> Result<Vec<HardCase>, Error> {
    let mut at_rest = target("S2", "a", TargetKind::Stretch, &[])?;
    let target = target("S2", "a", TargetKind::Ratio, &[])?;
    at_rest.values.fill(1.0);
    let usual = two_starts();
    let few = |max_iterations| statics::SolveSettings { max_iterations, load_steps: 0, ..Default::default() };
    // From rest, larger tensions need more iterations. So with a limit on iterations candidates beyond some load fail, and searches start
    // among failures or run into them.
    let in_part = |max_iterations, upper_bound| FitSettings {
        equilibrium: few(max_iterations),
        warm_start: false,
        upper_bound,
        ..usual
    };
    let least = if full { 4 } else { 5 };
    let all_fail = format!("every direct solve fails: {least} iterations a solve");
    let within = |upper_bound| FitSettings { upper_bound, ..usual };
    let in_steps = |max_iterations| FitSettings { equilibrium: few(max_iterations), ..usual };
    let cases: [(&str, &Target, FitSettings, Reachable); 10] = [
        ("degenerate simplex: a box of 1e-9 N", &target, within(1e-9), Some(false)),
        ("start on a bound: a box of 1 N", &target, within(1.0), Some(false)),
        ("plateau: nothing ever converges", &target, in_steps(0), Some(false)),
        (&all_fail, &target, in_steps(least), Some(true)),
        (
            "failures in the middle: 7 iterations a solve, loads to 300 N",
            &target,
            in_part(7, 300.0),
            Some(true),
        ),
        (
            "failures in the middle: 9 iterations a solve, loads to 1000 N",
            &target,
            in_part(9, 1e3),
            Some(true),
        ),
        ("loads to 1e6 N", &target, within(1e6), None),
        ("a target already met: the rest shape", &at_rest, usual, Some(true)),
        ("one iteration of the search", &target, FitSettings { max_iterations: 1, ..usual }, None),
        ("cost tolerance 0", &target, FitSettings { cost_tolerance: 0.0, ..usual }, Some(true)),
    ];
    cases.into_iter().map(|(name, t, settings, reachable)| row(name, t, &settings, reachable)).collect()
}

fn two_starts() -> FitSettings {
    FitSettings { starts: 2, ..FitSettings::default() }
}

fn row(
    variant: &str,
    target: &Target,
    settings: &FitSettings,
    reachable: Reachable,
) -> Result<HardCase, Error> {
    let mesh = tongue()?;
    let (fit, wall_s) = timed(|| inverse::fit(&mesh, &Model::default(), target, settings));
    let fit = fit?;
    let finite = fit.answer.tensions.iter().chain(&fit.answer.lengths).all(|v| v.is_finite());
    let kept = finite && reachable.is_none_or(|r| r == (fit.answer.status == FitStatus::Converged));
    Ok(HardCase { kept, wall_s, note: note(&fit), ..of_fit(variant, &fit) })
}

/// The row of a fit, without whether it keeps the promise.
pub(super) fn of_fit(variant: impl Into<String>, fit: &Fit) -> HardCase {
    let Answer { status, counts, replay, .. } = &fit.answer;
    HardCase {
        converged: *status == FitStatus::Converged,
        iterations: counts.evaluations,
        load_reached: replay.trace.solution.load_reached,
        min_area_ratio: Some(replay.min_area_ratio),
        guarded: replay.trace.solution.guarded,
        ..HardCase::new(variant, "fit", status_name(status))
    }
}

fn note(fit: &Fit) -> String {
    let pulls = fit.active_names().into_iter().zip(fit.active_tensions());
    let pulls: Vec<String> = pulls.map(|(name, tension)| format!("{name} {tension:.2}")).collect();
    let answer = &fit.answer;
    let mut note = format!("{} N; misfit {:.1e}", pulls.join(", "), answer.misfit);
    let failures: usize = answer.starts.iter().map(|s| s.counts.failures).sum();
    if failures > 0 {
        note += &format!("; {failures} candidates had no equilibrium");
    }
    if answer.status == FitStatus::TargetNotMet && answer.replay.trace.solution.guarded > 0 {
        note += "; the search began and ended where the barrier against inversion acts, because starts lie at up to 0.3 of the bound: \
                 there the misfit hardly changes with the tensions. The answer lies at a few newtons";
    }
    note
}
