//! Static equilibrium: the minimum of the potential energy, found by Newton's method.
//!
//! `minimise E(x) = sum 1/2 k (l - l0)² + sum F (l - l0) + sum 1/2 kappa ((S - S0)/S0)²` over the free nodes. Masses, dampers, the spring
//! Q2 and the contractile dampers do not affect the equilibrium, so they are not computed.
//!
//! These conditions of an equilibrium are checked:
//!
//! - Forces cancel to the tolerance, or to a rounding that is negligible beside the load; always.
//! - No cell is inverted: every step prevents it; a body of springs alone is checked at the end.
//! - All eigenvalues of the stiffness are positive: [`solve`] checks this at the last factorisation, a step or two before the solution,
//!   and at the solution if that factorisation was not exact, or with [`SolveSettings::certify`]; [`trace()`] checks it at every step.
//! - A branch of stable equilibria connects it to rest: [`trace()`] follows the branch there and back; other solves do not check it
//!   ([`Solution::connection`]).
//!
//! # From rest to a shape
//! At the same loads a body can have several equilibria. There are four questions about each:
//!
//! - Does one branch of stable equilibria lead to it from rest, without a jump? Then it is a [`FromRest::Branch`] of [`trace()`], and
//!   its solution has [`Connection::Traced`]. `simulate` (unless `--direct`), scenes without a wall, and fits raise an alarm where it does
//!   not. A scene with a wall is not checked unless its direct solve descended from an unstable state.
//! - Does the body reach it as all loads grow together, perhaps with jumps? [`FromRest::leads_here`] of a trace tells, which candidates
//!   of a search on the load path require (`on_load_path`). [`lanes::LaneGroup::solve_from_rest`] takes less time: a few load steps, in
//!   which bones are displaced in proportion to the tensions. Draws of a posterior have the shapes to which it leads. The mode is
//!   tested by its lengths (`is_reached_from_rest`), and frames of a recording are tested by this question first.
//! - Does Newton's method find it from rest at the whole loads? [`Trace::same_by_newton`] tells; a search compares costs
//!   (`same_cost_by_newton`) and misfits along a curve. Fits use this; a scene with a wall keeps the shape of Newton's method.
//! - Does another path lead to it: from a neighbour's shape, or with one muscle before the others? `leads_from_neighbour` and
//!   `reached_in_turn` in `track` answer this for frames of a recording.
//!
//! A trace displaces bones before the tensions grow. `tests/library/from_rest.rs` compares all answers with a trace, for bones in their
//! places; behind a jump the shape can depend on the load steps. Shapes are the same if they differ by less than [`SAME_SHAPE_M`].
//!
//! # How it is solved
//! Mass-spring bodies in the plane (springs, muscles, incompressible triangles) are solved on flat lists of their elements, one load or,
//! in [`lanes`], several at once. Solves that need a safeguard, and all other bodies, go effect by effect.
//!
//! The study of hard cases measures over all subsets of the muscles how often a trace agrees with a direct solve (`results/stability`).

pub mod lanes;
mod mass_spring;
mod newton;
mod response;
mod safeguards;
mod solution;
mod solve;
mod solve_and_trace;
mod stability;
mod state;
mod trace;
mod workspace;

pub use response::{Response, position_rates};
pub use solution::{Connection, Solution, SolveSettings, SolveStatus, Stability};
pub use solve::solve;
pub use solve_and_trace::{SAME_SHAPE_M, solve_and_trace, trace_beside};
pub use stability::smallest_eigenvalue;
pub use trace::{Critical, CriticalKind, FromRest, Trace, trace};
pub use workspace::Workspace;
