//! One equilibrium of a plain body, as [`crate::statics::solve`] begins.

use std::sync::Arc;

use crate::statics::{Solution, SolveSettings, Workspace};
use crate::system::System;
use crate::system::elements::Elements;

use super::{SimdNewton, at_rest};

#[derive(Debug)]
pub(in crate::statics) struct Single {
    elements: Arc<Elements>,
    work: SimdNewton<1>,
    /// Number of the system whose numbers it holds.
    system: Option<u64>,
}

impl Single {
    /// `None` where the system is not a plain one.
    pub fn new<const D: usize>(system: &System<D>) -> Option<Self> {
        let elements = system.elements()?;
        Some(Self { elements: elements.clone(), work: SimdNewton::new(elements), system: None })
    }

    /// Has the next solve begin with a factor of its own.
    pub fn forget_factor(&mut self) {
        self.work.forget_factor();
    }
}

/// Solves as [`crate::statics::solve`] does, and leaves the result in the workspace. An error holds the work
/// done before it was clear that the body is not plain or needs a safeguard; the workspace is then unchanged.
pub(in crate::statics) fn solve_single<const D: usize>(
    system: &System<D>,
    w: &mut Workspace<D>,
    tensions: &[f64],
    settings: &SolveSettings,
) -> Result<Solution, Solution> {
    let Some(single) = &mut w.single else { return Err(Solution::NONE) };
    let (elements, work) = (&*single.elements, &mut single.work);
    if single.system != Some(system.number()) {
        single.system = work.set_body(elements, 0, system).then(|| system.number());
    }
    let is_sound = tensions.len() == w.tensions.len() && tensions.iter().all(|t| t.is_finite());
    if !is_sound || single.system.is_none() {
        return Err(Solution::NONE);
    }
    work.set_load(elements, 0, tensions, &w.positions, |node| {
        w.carried.iter().find(|(n, _)| *n == node).map_or(w.positions[node], |(_, to)| *to)
    });
    if w.carried.is_empty()
        && w.positions == system.rest()
        && let Some(at_rest) = at_rest(system, elements)
    {
        work.begin_linearly(0, at_rest, tensions);
    }
    work.solve(elements, settings);
    let solution = work.solution(0).ok_or_else(|| work.spent(0))?;
    let before = (!system.keeps_cells_upright()).then(|| w.positions.clone());
    work.positions(elements, 0, &mut w.positions);
    if let Some(before) = before.filter(|_| system.cell_ratios(&w.positions).0 <= 0.0) {
        w.positions = before;
        return Err(solution);
    }
    work.forces(elements, 0, &mut w.force);
    system.place_path_nodes(&mut w.positions);
    w.tensions.copy_from_slice(tensions);
    // That of the solver for any body belongs to another shape.
    w.factor_ready = false;
    w.factor_is_exact = false;
    Ok(solution)
}
