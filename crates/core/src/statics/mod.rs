//! Static equilibrium: the minimum of the potential energy, found by Newton's method.
//!
//! `minimise E(x) = sum 1/2 k (l - l0)² + sum F (l - l0) + sum 1/2 kappa ((S - S0)/S0)²` over the free nodes.
//! Masses, dampers, Q2 and the contractile dampers do not affect the equilibrium, so they are not computed.
//!
//! What is checked of an equilibrium:
//!
//! - Forces cancel to the tolerance, or to a rounding that is negligible beside the load: always.
//! - No cell is inverted: every step prevents it; for springs alone it is reported.
//! - All eigenvalues of the stiffness are positive. [`solve`] checks it at the last factorisation, a step or two before the solution, and at
//!   the solution if that factorisation was not exact; with [`SolveSettings::certify`] at the solution; [`trace()`] at every step.
//! - A branch of stable equilibria connects it to rest: [`trace()`] follows the branch there and back; other solves do not check it
//!   ([`Solution::connection`]).
//!
//! # From rest to a shape
//! At the same loads a body can have several equilibria. Four questions are asked of one:
//!
//! - Does one branch of stable equilibria lead there from rest, without a jump? [`FromRest::Branch`], from [`trace()`], or of a given shape
//!   from [`leads_from_rest`]; a solution is then [`Connection::Traced`]. Asked by `simulate`, scenes and fits.
//! - Is it where the body goes as all loads grow together, jumps allowed? [`FromRest::Branch`] or [`FromRest::Fell`]. Asked of draws of a
//!   posterior and of frames of a recording (`reached_with_jumps`), and of candidates of a search on the load path (`on_load_path`).
//! - Is it what Newton's method gives from rest, at the whole loads at once? [`Trace::same_by_newton`]; a search compares costs
//!   (`same_cost_by_newton`) and misfits along a curve. Asked by fits; a scene at a wall keeps the shape of Newton's method.
//! - Is there another way there: from a neighbour's shape, or with one muscle before the others? `leads_from_neighbour` and
//!   `pulled_in_turn` in `track`. Asked of frames of a recording.
//!
//! Posterior and `track` solve at a few growing loads, which is faster than a trace; `track` follows the tensions with [`leads_from_rest`] where
//! these end elsewhere, and the posterior takes more loads. A posterior displaces bones in proportion to the loads; all other questions are
//! asked with bones displaced before the tensions grow. `tests/library/from_rest.rs` compares all of them with [`leads_from_rest`]. Shapes
//! are the same if they differ by less than [`SAME_SHAPE_M`].
//!
//! # How it is solved
//! Mass-spring bodies in the plane (springs, muscles, incompressible triangles) are solved on flat lists of their
//! elements, one load or, in [`lanes`], several at once. Solves that need a safeguard, and all other bodies,
//! go effect by effect.
//!
//! A direct solve costs one equilibrium, and a trace about two for each of its steps.
//! The study of hard cases measures over all subsets of the muscles how often both agree
//! (`results/stability`).

mod from_rest;
pub mod lanes;
mod mass_spring;
mod newton;
mod response;
mod safeguards;
mod solution;
mod solve;
mod stability;
mod state;
mod trace;
mod workspace;

pub use from_rest::{SAME_SHAPE_M, leads_from_rest, solve_and_trace, trace_beside};
pub use response::{Response, position_rates};
pub use solution::{Connection, Solution, SolveSettings, SolveStatus, Stability};
pub use solve::solve;
pub use stability::smallest_eigenvalue;
pub use trace::{Critical, CriticalKind, FromRest, Trace, trace};
pub use workspace::Workspace;
