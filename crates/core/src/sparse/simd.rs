//! `L` numbers at once, one in each lane of a vector register.

use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

use pulp::{Arch, NullaryFnOnce};

/// Number of lanes: four double-precision numbers fill one AVX2 register, or two of SSE2.
pub const LANES: usize = 4;

/// One number in each lane. Products are rounded before they are added (no fused multiply-add), so that every processor gives the same
/// bits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Simd<const L: usize>(pub [f64; L]);

impl<const L: usize> Simd<L> {
    pub const ZERO: Self = Self([0.0; L]);
    pub const ONE: Self = Self([1.0; L]);

    #[inline(always)]
    pub fn splat(value: f64) -> Self {
        Self([value; L])
    }

    #[inline(always)]
    fn zip(mut self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        for lane in 0..L {
            self.0[lane] = f(self.0[lane], other.0[lane]);
        }
        self
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

    /// Whether each lane is above `floor` and finite.
    #[inline(always)]
    pub fn above(self, floor: Self) -> [bool; L] {
        std::array::from_fn(|lane| self.0[lane] > floor.0[lane] && self.0[lane] < f64::INFINITY)
    }

    /// The larger number in each lane; that of `other` if this one is NaN.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    /// The smaller number in each lane; that of `other` if this one is NaN.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
}

impl<const L: usize> Add for Simd<L> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl<const L: usize> Sub for Simd<L> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl<const L: usize> Mul for Simd<L> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl<const L: usize> Neg for Simd<L> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|x| -x))
    }
}

impl<const L: usize> AddAssign for Simd<L> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const L: usize> SubAssign for Simd<L> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

struct Inlined<F>(F);

impl<R, F: FnMut() -> R> NullaryFnOnce for Inlined<F> {
    type Output = R;

    #[inline(always)]
    fn call(mut self) -> R {
        (self.0)()
    }
}

/// Does work with instructions for the widest registers of the processor. The closure and all that it calls must be `#[inline(always)]`,
/// and it must not be called as `FnOnce`, which is never inlined.
#[inline(always)]
pub(crate) fn vectorised<R>(work: impl FnMut() -> R) -> R {
    Arch::new().dispatch(Inlined(work))
}

/// A vector of the plane in each lane.
pub(crate) type SimdPair<const L: usize> = [Simd<L>; 2];

/// `q - p`.
#[inline(always)]
pub(crate) fn difference<const L: usize>(p: SimdPair<L>, q: SimdPair<L>) -> SimdPair<L> {
    [q[0] - p[0], q[1] - p[1]]
}
