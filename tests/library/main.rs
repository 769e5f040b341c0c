//! Results of the library against exact solutions, published numbers and other programs. The name of each module is what it tests; bodies
//! for several modules are in [`fixtures`].
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test says by panicking")]
#![allow(clippy::print_stderr, reason = "a test that is skipped says why")]

mod activations_in_space;
mod bodies_are_adapted;
mod bodies_are_placed;
mod bodies_in_space;
mod built_in_tongue_in_space;
mod continuum;
mod data_beside_lengths;
mod dynamics_meet_exact_solutions;
mod dynamics_of_the_tongue;
mod effects_are_derivatives_of_their_energy;
mod equilibrium_is_where_forces_cancel;
mod figures;
mod fit_finds_the_tensions;
mod formats_of_laboratories;
mod from_rest;
mod gmsh_files;
mod gmsh_hexahedra;
mod lanes_agree_with_one_at_a_time;
mod lengths_are_read;
mod lengths_are_refused;
mod marks_in_space;
mod mesh_meets_the_published_numbers;
mod observables_are_derivatives_of_their_value;
mod other_tables_are_read;
mod patch_tests;
mod posterior;
mod properties_of_random_bodies;
mod recordings_are_aligned;
mod recordings_are_plausible;
mod recordings_are_read;
mod scenes_in_space;
mod scenes_simulate_only_what_they_call_for;
mod scikit_fem;
mod simulation_by_name;
mod sparse_cholesky_agrees_with_faer;
mod surgery_in_space;
mod targets_of_fits;
mod tensions_are_tracked;
mod tongue_in_space;
mod unknowns_are_recovered;
mod vowels_are_heard;
mod walls_are_traced;
mod weight_walls_and_displaced_bones;

#[path = "../fixtures/mod.rs"]
mod fixtures;

#[path = "../fixtures/recordings.rs"]
mod recordings;

#[path = "../fixtures/synthetic.rs"]
mod synthetic;
