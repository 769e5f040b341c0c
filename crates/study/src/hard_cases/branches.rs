//! Case 9: two equilibria at one load, with known critical loads.

use tongue_core::body::Mesh;
use tongue_core::statics::{
    CriticalKind, SolveSettings, SolveStatus, Trace, Workspace, smallest_eigenvalue, trace,
};
use tongue_core::system::{Model, System, coefficients};
use tongue_files::report::status_name;

use super::{HardCase, bodies};
use crate::Error;
use crate::measure::timed;

/// Largest relative error of a critical load.
const AGREEMENT: f64 = 1e-6;

/// A strut that buckles and a truss that snaps through, at loads below and above the critical one.
pub(super) fn two_equilibria() -> Result<Vec<HardCase>, Error> {
    let (strut, truss) = (bodies::strut(0.02, 0.3, 11), bodies::truss(0.02, 0.01, 0.03, 40));
    let k = coefficients(&strut, &Model::default())?.tissue_stiffness;
    let buckling = buckling_load(k, 0.02, 0.3, 11);
    let snapping = snapping_load(k, 0.02, 0.01, 40);
    let mut rows = Vec::new();
    for (name, mesh, exact, kind) in [
        ("braced strut", &strut, buckling, CriticalKind::Bifurcation),
        ("von Mises truss", &truss, snapping, CriticalKind::LimitPoint),
    ] {
        for part in [0.9, 1.5] {
            let (traced, row) =
                trace_row(format!("{name} at {part} of its critical load"), mesh, part * exact)?;
            let (agrees, note) = match traced.from_rest.critical() {
                Some(c) => {
                    let error = c.load * part - 1.0;
                    let text = format!(
                        "critical load {:.9} N, exact {exact:.9} N, {}",
                        c.load * part * exact,
                        status_name(&c.kind)
                    );
                    (part > 1.0 && c.kind == kind && error.abs() < AGREEMENT, text)
                }
                None => (part < 1.0, "on the branch from rest".to_owned()),
            };
            let other =
                if traced.another { "another equilibrium exists" } else { "no other equilibrium met" };
            rows.push(HardCase { kept: row.kept && agrees, ..row }.with_note(&note).with_note(other));
        }
    }
    Ok(rows)
}

fn trace_row(variant: String, mesh: &Mesh<2>, load: f64) -> Result<(Trace, HardCase), Error> {
    let system = System::new(mesh, &Model::default(), &[0])?;
    let mut workspace = Workspace::new(&system);
    let (traced, wall_s) = timed(|| trace(&system, &mut workspace, &[load], &SolveSettings::default()));
    let smallest_eigenvalue = smallest_eigenvalue(&system, &mut workspace);
    let s = traced.solution;
    let converged = s.status == SolveStatus::Converged;
    let row = HardCase {
        converged,
        kept: converged,
        iterations: s.iterations,
        load_reached: s.load_reached,
        smallest_eigenvalue_n_per_m: smallest_eigenvalue,
        guarded: s.guarded,
        wall_s,
        ..HardCase::new(variant, "trace", status_name(&s.status))
    };
    Ok((traced, row))
}

/// The axial load at which the lateral stiffness of the braced strut vanishes.
///
/// With the head at `(x, 0)`: strut `N = k (x - l)`, muscle of `n` links `M = k/n (x - l) + F`, braces of length `s = sqrt(d² + (x - l)²)`
/// with tension `B = k (s - d)`. The axial balance `N + M + 2 B (x - l)/s = 0` gives `F(x)`; the root in `x` of the lateral stiffness `N/x
/// + M/(x + l) + 2 (k (d/s)² + B/s ((x - l)/s)²)` is found by bisection.
fn buckling_load(k: f64, l: f64, d: f64, links: usize) -> f64 {
    let at = |x: f64| {
        let e = x - l;
        let s = d.hypot(e);
        let (strut, brace) = (k * e, k * (s - d));
        let muscle = -strut - 2.0 * brace * e / s;
        let lateral =
            strut / x + muscle / (x + l) + 2.0 * (k * (d / s).powi(2) + brace / s * (e / s).powi(2));
        (lateral, muscle - k / links as f64 * e)
    };
    at(bisect(|x| at(x).0, 0.05 * l, l)).1
}

/// The load at which the apex of the truss loses stability: the first maximum of `F(y) = 2 k (L - s)/s y - k/n (y - h)`, with `s = sqrt(a²
/// + y²)` and `L = sqrt(a² + h²)`.
fn snapping_load(k: f64, a: f64, h: f64, links: usize) -> f64 {
    let rest = a.hypot(h);
    let y = bisect(|y| 2.0 * k * (rest * a * a / a.hypot(y).powi(3) - 1.0) - k / links as f64, h, 0.0);
    2.0 * k * (rest / a.hypot(y) - 1.0) * y - k / links as f64 * (y - h)
}

/// The root of `f` between two points at which its signs differ.
fn bisect(f: impl Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    let sign = f(a) > 0.0;
    for _ in 0..200 {
        let middle = 0.5 * (a + b);
        if (f(middle) > 0.0) == sign { a = middle } else { b = middle }
    }
    0.5 * (a + b)
}
