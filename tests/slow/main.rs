//! Tests that take tens of seconds: killed runs and calibrations.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test says by panicking")]
#![allow(clippy::print_stderr, reason = "tests say what they measured")]

mod activations_cover_the_truth;
mod batch_in_shards;
mod batch_survives;
mod changed_speakers;
mod coils_place_the_body;
mod contrasts_cover_the_truth;
mod hidden_coils_are_predicted;
mod left_out_muscles;
mod mutated_inputs;
mod posterior_covers_the_truth;
mod posterior_is_calibrated;
mod rows_of_other_baselines;
mod synthetic_speakers;
mod tracked_intervals_cover_the_truth;
mod validation_of_takano;

#[path = "../fixtures/inputs.rs"]
#[allow(clippy::duplicate_mod, reason = "fuzz targets take this file without the other fixtures")]
mod inputs;

#[path = "../fixtures/mod.rs"]
mod fixtures;

#[path = "../fixtures/recordings.rs"]
mod recordings;

#[path = "../fixtures/program.rs"]
mod program;

#[path = "../fixtures/speakers.rs"]
mod speakers;

#[path = "../fixtures/synthetic.rs"]
mod synthetic;

/// Number of synthetic cases of a coverage: `usual`, or that of the environment variable `TONGUE_FIT_CASES`.
fn cases(usual: usize) -> usize {
    std::env::var("TONGUE_FIT_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(usual)
}
