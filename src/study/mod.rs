//! What the program finds out about itself: what accuracy costs in time, and what becomes of hard cases.

pub mod accuracy;
pub mod hard_cases;
