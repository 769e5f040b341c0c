//! Colours of muscles: those of the eight portions by name, of any other muscle by its number.

/// The palette of Okabe and Ito (2008), which colour-blind readers can tell apart.
const PALETTE: [&str; 8] =
    ["#d55e00", "#e69f00", "#f0e442", "#56b4e9", "#0072b2", "#cc79a7", "#009e73", "#000000"];

/// Warm colours for the genioglossus, cool ones for the styloglossus, green and black for the hyoglossus.
const NAMED: [&str; 8] = ["GGa", "GGm", "GGp", "SGp", "SGm", "SGa", "HGa", "HGp"];

/// The colour of a muscle: its own where the name has one, else that of its number in the body.
pub(super) fn colour(name: &str, number: usize) -> &'static str {
    let number = NAMED.iter().position(|n| *n == name).unwrap_or(number);
    PALETTE[number % PALETTE.len()]
}
