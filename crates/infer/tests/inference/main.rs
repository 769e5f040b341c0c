//! Single functions of `tongue-infer` against exact values, one module a module of the crate. Whole fits, posteriors and recordings are
//! tested in `tests/library`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test says by panicking")]

mod batch;
mod error_model;
mod posterior;
mod track;
