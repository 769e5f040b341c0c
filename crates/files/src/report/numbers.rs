//! Numbers in texts.

/// A probability with two decimals, rounded towards one half, so that it does not seem to reach a limit that it stays below.
pub fn probability(p: f64) -> String {
    let percent = if p < 0.5 { (100.0 * p - 1e-9).ceil() } else { (100.0 * p + 1e-9).floor() };
    with_decimals(percent / 100.0, 2)
}

/// A number with this many decimals, and no minus sign if they are all zero.
pub fn with_decimals(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = text.trim_start_matches('-').chars().all(|c| matches!(c, '0' | '.'));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

/// An interval such as `1.5 to 2.0`.
pub fn range([low, high]: [f64; 2], decimals: usize) -> String {
    format!("{} to {}", with_decimals(low, decimals), with_decimals(high, decimals))
}
