//! Tensions over time.

mod formants;
mod ornstein_uhlenbeck;
mod prediction;
mod reachability;
mod repeatability;
