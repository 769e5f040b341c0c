//! Limits of numbers that a user gives, so that no run needs more than about 1 GB of memory.

/// A number that a user may give, and between what it may lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    pub name: &'static str,
    pub least: f64,
    pub most: f64,
    pub unit: &'static str,
    /// Why, or what to do.
    pub reason: &'static str,
}

/// A number beyond its limits.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{} is {value}{}; it must be from {} to {}{}: {}", .limit.name, .limit.unit, .limit.least, .limit.most, .limit.unit, .limit.reason)]
pub struct BeyondLimit {
    pub limit: &'static Limit,
    pub value: f64,
}

impl Limit {
    pub fn check(&'static self, value: f64) -> Result<(), BeyondLimit> {
        match (self.least..=self.most).contains(&value) {
            true => Ok(()),
            false => Err(BeyondLimit { limit: self, value }),
        }
    }
}

const fn limit(name: &'static str, range: [f64; 2], unit: &'static str, reason: &'static str) -> Limit {
    Limit { name, least: range[0], most: range[1], unit, reason }
}

/// Draws of lengths within their rounding.
pub static ROUNDING_DRAWS: Limit =
    limit("--draws", [0.0, 10_000.0], "", "each is a fit of its own, and more narrow no interval");
/// Draws of a posterior.
pub static POSTERIOR_DRAWS: Limit = limit(
    "--posterior",
    [100.0, 200_000.0],
    " draws",
    "fewer cannot tell whether they have mixed, more need much memory",
);
/// Elements of which a continuum is made.
pub static CONTINUUM_ELEMENTS: Limit = limit(
    "the number of elements of the continuum",
    [1.0, 25_000.0],
    "",
    "more need over 1 GB of memory; take a larger --h or a coarser mesh",
);
/// A coordinate of a table or a file, mm.
pub static COORDINATE_MM: Limit =
    limit("a coordinate", [-1000.0, 1000.0], " mm", "a tongue is smaller; is the unit right?");
/// Stiffening of a muscle's tissue by its activation.
pub static STIFFENING: Limit =
    limit("--stiffening", [0.0, 1000.0], "", "it is a multiple of the passive stiffness, 9 in ArtiSynth");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_beyond_its_limits_is_refused_with_the_reason() {
        assert_eq!(ROUNDING_DRAWS.check(200.0), Ok(()));
        let told = COORDINATE_MM.check(1e6).unwrap_err().to_string();
        assert_eq!(
            told,
            "a coordinate is 1000000 mm; it must be from -1000 to 1000 mm: a tongue is smaller; is the unit right?"
        );
        assert!(STIFFENING.check(f64::NAN).is_err());
    }
}
