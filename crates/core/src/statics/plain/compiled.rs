//! Entry points of the hot loops. They are not generic, so that they are compiled in this package, with its
//! optimisation, and not in the crate of a generic caller.

use crate::sparse::wide::{LANES, Pair, Wide};
use crate::statics::SolveSettings;
use crate::system::elements::Elements;

use super::{Neighbour, Work};

/// [`Work::solve`] of one load.
pub(in crate::statics) fn solve_one(work: &mut Work<1>, elements: &Elements, settings: &SolveSettings) {
    work.solve(elements, settings);
}

/// [`Work::solve`] of a group.
pub(in crate::statics) fn solve_group(work: &mut Work<LANES>, elements: &Elements, settings: &SolveSettings) {
    work.solve(elements, settings);
}

/// [`Work::factorise_exactly`] of a group.
pub(in crate::statics) fn factorise_group(work: &mut Work<LANES>, elements: &Elements) -> [bool; LANES] {
    work.factorise_exactly(elements)
}

/// [`Work::motion_by_tension`] of a group.
pub(in crate::statics) fn tension_of_group(
    work: &Work<LANES>,
    elements: &Elements,
    muscle: usize,
) -> Vec<Pair<LANES>> {
    work.motion_by_tension(elements, muscle)
}

/// [`Work::motion_by_bone`] of a group.
pub(in crate::statics) fn bone_of_group(
    work: &Work<LANES>,
    elements: &Elements,
    nodes: &[usize],
    axis: usize,
) -> Vec<Pair<LANES>> {
    work.motion_by_bone(elements, nodes, axis)
}

/// [`Work::motion_by_rest`] of a group.
pub(in crate::statics) fn neighbour_of_group(
    work: &mut Work<LANES>,
    elements: &Elements,
    neighbour: &Neighbour,
) -> Vec<Pair<LANES>> {
    work.motion_by_rest(elements, neighbour)
}

/// [`Work::adjoint`] of a group.
pub(in crate::statics) fn adjoint_of_group(
    work: &Work<LANES>,
    elements: &Elements,
    gradient: &mut [Pair<LANES>],
) -> Vec<Wide<LANES>> {
    work.adjoint(elements, gradient)
}
