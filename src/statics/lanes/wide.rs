//! Four numbers that are worked on at once: one of each lane.

use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// Number of lanes: an AVX2 register of double precision, two of SSE2.
pub const LANES: usize = 4;

/// One number of each lane. Products are rounded before they are added (no fused multiply-add), so every processor gives the same bits.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(32))]
pub(super) struct Wide(pub [f64; LANES]);

impl Wide {
    pub const ZERO: Self = Self([0.0; LANES]);
    pub const ONE: Self = Self([1.0; LANES]);

    #[inline(always)]
    pub fn all(value: f64) -> Self {
        Self([value; LANES])
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let (a, b) = (self.0, other.0);
        Self([f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2]), f(a[3], b[3])])
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }

    #[inline(always)]
    pub fn inverse(self) -> Self {
        Self(self.0.map(|x| 1.0 / x))
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        Self(self.0.map(f64::abs))
    }

    /// Where this is above `floor` and finite.
    #[inline(always)]
    pub fn above(self, floor: Self) -> [bool; LANES] {
        std::array::from_fn(|lane| self.0[lane] > floor.0[lane] && self.0[lane] < f64::INFINITY)
    }

    /// The larger one; `other` where this is not a number.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    /// The smaller one; `other` where this is not a number.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
}

impl Add for Wide {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl Sub for Wide {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl Mul for Wide {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl Neg for Wide {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|x| -x))
    }
}

impl AddAssign for Wide {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Wide {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

/// A vector of the plane in each lane.
pub(super) type Pair = [Wide; 2];

pub(super) const NO_PAIR: Pair = [Wide::ZERO; 2];

/// `q - p`.
#[inline(always)]
pub(super) fn way(p: Pair, q: Pair) -> Pair {
    [q[0] - p[0], q[1] - p[1]]
}
