//! The parts of `tongue-core` against exact values, one module for each module of the crate. Whole bodies are tested in `tests/library`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test says by panicking")]

mod body;
mod choice;
mod dynamics;
mod effect;
mod geometry;
mod limits;
mod material;
mod sparse;
mod statistics;
mod toml_text;
