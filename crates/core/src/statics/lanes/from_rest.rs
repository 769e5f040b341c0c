//! The equilibria to which loads lead from rest, for several loads at once.

use super::{LANES, LaneEquilibrium, LaneGroup, Load};
use crate::statics::{Connection, Solution, SolveSettings, SolveStatus};

/// Numbers of load steps, tried in this order. With a single step 1 of 200 draws of S1 /i/ ended at another equilibrium.
const STEPS: [usize; 2] = [5, 25];
/// Residual force of the shapes before the last one, N. With 0.1 N a fifth of the factors would be saved, but of 14,000 tried draws of S1
/// /i/ and S2 /a/ 10 end elsewhere than in 25 steps (5 with this force), and one of 100 draws of a coarse body off the branch.
const ON_THE_WAY_N: f64 = 1e-4;

impl<const D: usize> Load<'_, D> {
    /// This part of the tensions and of the displacements of bones.
    pub fn scaled(&self, part: f64) -> Self {
        let tensions = self.tensions.iter().map(|f| f * part).collect();
        let bones = self.bones.iter().map(|(nodes, shift)| (*nodes, shift * part)).collect();
        Self { tensions, bones, ..*self }
    }
}

impl<const D: usize> LaneGroup<'_, D> {
    /// The equilibria to which up to [`LANES`] loads lead from rest as they grow, jumps included; `None` where a load leads to no
    /// equilibrium, or through one in which the barrier acts. `load(i, part)` is the part, 0 to 1, of load number `i` below `count`; its
    /// start is ignored. Loads grow in 5 steps, each solved from the shape of the step before; where this fails, in 25. Whether the body
    /// jumps is not determined, so this takes less time than [`trace()`](crate::statics::trace()).
    #[inline(never)]
    pub fn solve_from_rest<'l>(
        &mut self,
        count: usize,
        settings: &SolveSettings,
        load: &dyn Fn(usize, f64) -> Load<'l, D>,
    ) -> Vec<Option<LaneEquilibrium<D>>> {
        let mut found = vec![None; count.min(LANES)];
        for steps in STEPS {
            let left: Vec<usize> = (0..found.len()).filter(|&i| found[i].is_none()).collect();
            for (i, end) in left.iter().zip(self.follow(&left, steps, settings, load)) {
                found[*i] = end;
            }
        }
        found
    }

    /// The equilibria at these whole loads after some steps; `None` where a step has no equilibrium.
    fn follow<'l>(
        &mut self,
        loads: &[usize],
        steps: usize,
        settings: &SolveSettings,
        load: &dyn Fn(usize, f64) -> Load<'l, D>,
    ) -> Vec<Option<LaneEquilibrium<D>>> {
        let is_of_springs = self.work.is_some();
        let mut ends: Vec<Option<LaneEquilibrium<D>>> = vec![None; loads.len()];
        let mut is_good = vec![true; loads.len()];
        for step in 1..=steps {
            if !is_good.contains(&true) {
                break;
            }
            let part = step as f64 / steps as f64;
            let parts = Vec::from_iter(loads.iter().zip(&ends).map(|(&i, before)| Load {
                start: before.as_ref().map(|before| before.positions.as_slice()),
                ..load(i, part)
            }));
            let tolerance = if step < steps { ON_THE_WAY_N } else { settings.tolerance };
            let equilibria = self.solve(&parts, &SolveSettings { tolerance, ..*settings }).to_vec();
            for ((end, is_good), answer) in ends.iter_mut().zip(&mut is_good).zip(equilibria) {
                let Solution { status, connection, guarded, .. } = answer.solution;
                // In a body of springs a descent from a saddle of the energy is allowed, as a jump is; in other bodies it fails, so that
                // the loads grow again in more steps.
                let is_direct = is_of_springs || connection != Connection::Downhill;
                *is_good &= status == SolveStatus::Converged && guarded == 0 && is_direct;
                *end = Some(answer);
            }
        }
        ends.into_iter().zip(is_good).map(|(end, is_good)| end.filter(|_| is_good)).collect()
    }
}
