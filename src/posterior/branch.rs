//! Whether draws lie on the branch of equilibria that begins at rest: each is followed from there anew, in steps, in lanes.

use nalgebra::SVector;

use crate::parallel;
use crate::statics::lanes::{Group, LANES, Load};
use crate::statics::{self, Status, Workspace};

use super::density::{Density, Meaning, is_found};

/// Steps in which tensions and the displacement of the hyoid grow from nothing.
const STEPS: usize = 5;
/// Least steps of the exact way.
const TRACED: usize = 10;
/// Lengths that differ by less are those of one shape, m.
const SAME_M: f64 = 1e-7;
/// Draws of one piece of work; results do not depend on threads, because pieces do not.
const CHUNK: usize = 32 * LANES;

/// Of every draw whether both of its shapes, of the vowel and of the baseline, are those that tensions lead to from rest; `draw` gives
/// what it means, and its lengths in both, m.
pub fn on_branch<'d>(
    density: &Density<'_>,
    count: usize,
    draw: impl Fn(usize) -> (Meaning, &'d [f64], &'d [f64]) + Sync,
) -> Vec<bool> {
    let chunks: Vec<usize> = (0..count).step_by(CHUNK).collect();
    let found = parallel::map(&chunks, |&chunk| {
        let (mut posture, mut baseline) = (density.lanes().group(), density.lanes().group());
        let mut out = Vec::with_capacity(CHUNK);
        for first in (chunk..count.min(chunk + CHUNK)).step_by(LANES) {
            let draws: Vec<_> = (first..count.min(first + LANES)).map(&draw).collect();
            let meanings: Vec<&Meaning> = draws.iter().map(|(m, ..)| m).collect();
            let of_posture = follow(density, &mut posture, &meanings, |m, start| density.posture(m, start));
            let of_baseline =
                follow(density, &mut baseline, &meanings, |m, start| density.baseline(m, start));
            for (i, (_, lengths, base)) in draws.iter().enumerate() {
                let same = |found: Option<&Vec<f64>>, kept: &[f64]| {
                    let close = |(a, b): (&f64, &f64)| (a - b).abs() < SAME_M;
                    found.is_some_and(|f| f.iter().zip(kept).all(close))
                };
                // Where a few large steps lead elsewhere, the exact way decides.
                let judged = |found: &Option<Vec<f64>>, load: Load<'_, 2>, kept: &[f64]| {
                    same(found.as_ref(), kept) || same(traced(density, &load).as_ref(), kept)
                };
                let meaning = meanings[i];
                out.push(
                    judged(&of_posture[i], density.posture(meaning, None), lengths)
                        && judged(&of_baseline[i], density.baseline(meaning, None), base),
                );
            }
        }
        out
    });
    found.into_iter().flatten().collect()
}

/// Lengths at the end of the way from rest; `None` where the way ends before.
fn follow<'l>(
    density: &'l Density<'_>,
    group: &mut Group<'_, 2>,
    meanings: &[&Meaning],
    load: impl Fn(&Meaning, Option<&'l [SVector<f64, 2>]>) -> Load<'l, 2>,
) -> Vec<Option<Vec<f64>>> {
    let system = &density.ground.system;
    let mut shapes: Vec<Vec<SVector<f64, 2>>> = vec![system.rest().to_vec(); meanings.len()];
    let mut good = vec![true; meanings.len()];
    for step in 1..=STEPS {
        let part = step as f64 / STEPS as f64;
        let loads: Vec<Load<'_, 2>> = meanings
            .iter()
            .zip(&shapes)
            .map(|(m, shape)| {
                let scaled = |all: &[f64]| all.iter().map(|t| t * part).collect();
                let meaning =
                    Meaning { tensions: scaled(&m.tensions), tones: scaled(&m.tones), hyoid: m.hyoid * part };
                Load { start: Some(shape), ..load(&meaning, None) }
            })
            .collect();
        let answers = group.solve(&loads, density.settings()).to_vec();
        for ((shape, good), answer) in shapes.iter_mut().zip(&mut good).zip(answers) {
            *good &= is_found(&answer);
            *shape = answer.positions;
        }
    }
    shapes.iter().zip(good).map(|(shape, good)| good.then(|| system.lengths(shape))).collect()
}

/// Lengths where the branch of a load from rest leads, followed there and back.
fn traced(density: &Density<'_>, load: &Load<'_, 2>) -> Option<Vec<f64>> {
    let system = &density.ground.system;
    let mut w = Workspace::new(system);
    load.bones.iter().for_each(|(nodes, shift)| w.carry_bone(system, nodes, *shift));
    w.start_from_rest(system);
    let found = statics::trace(system, &mut w, &load.tensions, &statics::Settings::default(), TRACED);
    let reached = found.critical.is_none() && found.stopped.is_none();
    (reached && found.solution.status == Status::Converged).then(|| system.lengths(w.positions()))
}
