//! Case 10: the answer does not depend on the numbering of nodes, the position of the body or the number of threads.

use nalgebra::SVector;

use crate::test_tensions::{PUBLISHED_A, TestTensions, target, tongue};
use tongue_core::body::{Mesh, largest_distance};
use tongue_core::parallel;
use tongue_core::system::Model;
use tongue_infer::inverse::{self, Answer, FitSettings};
use tongue_input::measured::TargetKind;

use super::search::of_fit;
use super::{HardCase, bodies, equilibrium_row};
use crate::Error;
use crate::measure::timed;

/// Largest difference of equal shapes, m.
const SAME: f64 = 1e-9;

pub(super) fn same_answers() -> Result<Vec<HardCase>, Error> {
    let mesh = tongue()?;
    let (_, reference) = solve_published("as it is".to_owned(), &mesh)?;
    let mut rows = Vec::new();
    let zero = SVector::zeros();
    for seed in 0..5 {
        let name = bodies::shuffled(mesh.nodes.len(), seed);
        let (row, shape) =
            solve_published(format!("renumbered at random, {seed}"), &bodies::renumbered(&mesh, &name))?;
        let back: Vec<_> = name.iter().map(|&n| shape[n]).collect();
        rows.push(with_difference(row, &back, &reference));
    }
    let motions = [
        ("mirrored", 0.0, true, zero),
        ("turned by 1 rad", 1.0, false, zero),
        ("turned by 3 rad and mirrored", 3.0, true, zero),
        ("moved by a kilometre", 0.0, false, SVector::from([1000.0, -300.0])),
        ("turned, mirrored and moved by a kilometre", 2.0, true, SVector::from([-700.0, 700.0])),
    ];
    for (variant, angle, mirrored, shift) in motions {
        let (row, shape) =
            solve_published(variant.to_owned(), &bodies::moved(&mesh, angle, mirrored, shift))?;
        let expected: Vec<_> = reference.iter().map(|p| bodies::place(p, angle, mirrored, shift)).collect();
        rows.push(with_difference(row, &shape, &expected));
    }
    rows.extend(threads(&mesh)?);
    Ok(rows)
}

fn solve_published(variant: String, mesh: &Mesh<2>) -> Result<(HardCase, Vec<SVector<f64, 2>>), Error> {
    let TestTensions { system, tensions, .. } = TestTensions::new(mesh, &Model::default(), &PUBLISHED_A)?;
    let (row, workspace) = equilibrium_row(variant, &system, &tensions);
    Ok((row, workspace.positions().to_vec()))
}

fn with_difference(row: HardCase, shape: &[SVector<f64, 2>], expected: &[SVector<f64, 2>]) -> HardCase {
    let apart = largest_distance(shape, expected);
    HardCase { kept: row.kept && row.converged && apart <= SAME, ..row }
        .with_note(&format!("differs by {apart:.1e} m"))
}

fn threads(mesh: &Mesh<2>) -> Result<Vec<HardCase>, Error> {
    let target = target("S2", "a", TargetKind::Ratio, &[])?;
    let settings = FitSettings { starts: 4, ..FitSettings::default() };
    let mut first: Option<Vec<u64>> = None;
    let mut rows = Vec::new();
    for count in [1, 2, 4] {
        let (fit, wall_s) = timed(|| {
            parallel::with_threads(count, || inverse::fit(mesh, &Model::default(), &target, &settings))
        });
        let fit = fit??;
        let Answer { tensions, lengths, positions, .. } = &fit.answer;
        let all = tensions.iter().chain(lengths).chain(positions.iter().flatten());
        let bits: Vec<u64> = all.map(|v| v.to_bits()).collect();
        let same = *first.get_or_insert_with(|| bits.clone()) == bits;
        let variant = format!("fit of S2 /a/ on {count} threads");
        let note = if same { "same bits" } else { "other bits than with 1 thread" }.to_owned();
        rows.push(HardCase { kept: same, wall_s, note, ..of_fit(variant, &fit) });
    }
    Ok(rows)
}
