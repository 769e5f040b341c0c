//! Cases 2, 4, 9 and 11: loads far above those of muscles, chains that fold, and two equilibria at one load.

use crate::test_tensions::{TestTensions, tongue};
use tongue_core::body::{Body, ContinuumSettings, Mesh, largest_distance};
use tongue_core::statics::{
    CriticalKind, SolveSettings, SolveStatus, Trace, Workspace, smallest_eigenvalue, trace,
};
use tongue_core::system::{Model, System, coefficients};
use tongue_files::report::status_name;

use super::{HardCase, bodies, equilibrium_row, row_of};
use crate::Error;
use crate::measure::timed;

/// Largest load to which the branch of a continuum is followed, N: at ten times this load its end takes hours to find.
pub(super) const FOLLOWED_N: f64 = 100.0;
/// Largest relative error of a critical load.
const AGREEMENT: f64 = 1e-6;

/// The continuum of cases 3 and 11.
pub(super) fn continuum() -> Result<Mesh<2>, Error> {
    Ok(Body::continuum(8e-3, &ContinuumSettings::default())?.mesh)
}

/// Cases 2 and 11: subsets of the muscles at 1, 10, 100 and 1000 N. Each is solved directly and, up to `followed_n`, along the branch from
/// rest.
pub(super) fn subsets(mesh: &Mesh<2>, followed_n: f64, full: bool) -> Result<Vec<HardCase>, Error> {
    let all: Vec<&str> = mesh.muscles.iter().map(|m| m.name.as_str()).collect();
    let stride = if full { 1 } else { 16 };
    let mut rows = Vec::new();
    // The first set in this order has all muscles.
    for set in (1..1u32 << all.len()).rev().step_by(stride) {
        let active: Vec<&str> = (0..all.len()).filter(|m| set >> m & 1 == 1).map(|m| all[m]).collect();
        for load in [1.0, 10.0, 100.0, 1000.0] {
            let variant = format!("{} at {load} N", active.join(" "));
            let body = all_at(mesh, &active, load)?;
            let (row, mut workspace) = equilibrium_row(variant, &body.system, &body.tensions);
            rows.push(if load <= followed_n { beside_branch(row, &body, &mut workspace) } else { row });
        }
    }
    Ok(rows)
}

fn all_at(mesh: &Mesh<2>, muscles: &[&str], load: f64) -> Result<TestTensions, Error> {
    TestTensions::new(mesh, &Model::default(), &muscles.iter().map(|m| (*m, load)).collect::<Vec<_>>())
}

/// Follows the branch from rest to the load of a row, whose answer is in the workspace, and compares the two.
fn beside_branch(row: HardCase, body: &TestTensions, workspace: &mut Workspace<2>) -> HardCase {
    let direct = workspace.positions().to_vec();
    let traced = trace(&body.system, workspace, &body.tensions, &SolveSettings::default());
    let (critical, stopped) = (traced.from_rest.critical(), traced.from_rest.stopped());
    let ends_at = critical.map(|c| c.load).or(stopped).unwrap_or(1.0);
    let apart = largest_distance(&direct, workspace.positions());
    let row = HardCase { branch_ends_at: Some(ends_at), apart_from_branch_m: Some(apart), ..row };
    if row.is_on_branch() {
        return row;
    }
    let text = match critical {
        Some(c) => {
            format!("the branch from rest ends at {:.4} of the load ({})", c.load, status_name(&c.kind))
        }
        None => "the branch from rest leads to another equilibrium".to_owned(),
    };
    row.with_note(&text).with_note(&format!("{apart:.1e} m from there"))
}

/// Case 4: SGp and HGp, whose chains are straight outside the tissue, active or passive, alone and with others.
pub(super) fn folding_chains() -> Result<Vec<HardCase>, Error> {
    let mesh = tongue()?;
    let all: Vec<&str> = mesh.muscles.iter().map(|m| m.name.as_str()).collect();
    let others: Vec<&str> = all.iter().copied().filter(|m| !["SGp", "HGp"].contains(m)).collect();
    let sets: [(&str, &[&str]); 6] = [
        ("SGp", &["SGp"]),
        ("HGp", &["HGp"]),
        ("SGp HGp", &["SGp", "HGp"]),
        ("passive beside GGa SGm HGa", &["GGa", "SGm", "HGa"]),
        ("passive, pushed by all others", &others),
        ("with all the rest", &all),
    ];
    let mut rows = Vec::new();
    for (name, set) in sets {
        for load in [5.0, 50.0, 500.0] {
            let variant = format!("{name} at {load} N, straight");
            rows.push(row_of(variant, &all_at(&mesh, set, load)?));
        }
    }
    Ok(rows)
}

/// Case 9: a strut that buckles and a truss that snaps through, at loads below and above the critical one, which is known.
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
