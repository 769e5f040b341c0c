//! What a plane misses of the motion in space.

/// Part of the way of the midsagittal contour that a plane misses after the best scaling: the median over the
/// muscles of the built-in body in space (`results/plane`). A test of the studies compares it with theirs.
pub const MISSED_BY_PLANE: f64 = 0.20;

pub fn limit_of_plane() -> String {
    let percent = 100.0 * MISSED_BY_PLANE;
    format!(
        "A plane misses {percent:.0} % of the motion of a tongue in space (the median muscle; results/plane)."
    )
}
