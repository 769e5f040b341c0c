//! Posteriors.

mod diagnostics;
mod over_speakers;
mod parameters;
mod point_data;
mod quantiles;
mod score;
mod sensitivity;
mod verdict;
