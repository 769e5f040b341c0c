//! Walls to areas.
