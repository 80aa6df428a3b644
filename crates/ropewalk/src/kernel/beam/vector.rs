//! Vectors of `f32` lanes, so that the beam is written once for all levels.
//!
//! A value of a level's type exists only where the level's features are enabled: the only ways to
//! get one are the `unsafe` constructors, and everything else is computed from values.

#![allow(unsafe_code)]

use std::ops::{Add, Mul, Sub};

/// A vector of [`Vector::LANES`] numbers. Masks hold lane `i` in bit `i`; comparisons with NaN are
/// false, and `min` and `max` return `other` where either is NaN.
pub trait Vector: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// Number of lanes.
    const LANES: usize;
    /// The same number in all lanes.
    ///
    /// # Safety
    /// The machine must have the level's features, and the caller must enable them.
    unsafe fn splat(x: f32) -> Self;
    /// The first numbers of a row.
    ///
    /// # Safety
    /// As for [`Vector::splat`]; the row must have [`Vector::LANES`] numbers at least.
    unsafe fn load(row: &[f32]) -> Self;
    /// The first numbers of two rows, half of the lanes from each.
    ///
    /// # Safety
    /// As for [`Vector::splat`]; the rows must have half as many numbers as there are lanes at least.
    unsafe fn load_two(low: &[f32], high: &[f32]) -> Self;
    /// Writes the lanes to the beginning of a row; panics if it is too short.
    fn store(self, row: &mut [f32]);
    /// Quotient.
    fn div(self, by: Self) -> Self;
    /// `self * factor + term`, rounded once or twice.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// `term - self * factor`, rounded once or twice.
    fn neg_mul_add(self, factor: Self, term: Self) -> Self;
    /// Smaller number.
    fn min(self, other: Self) -> Self;
    /// Larger number.
    fn max(self, other: Self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// The larger absolute value; one that is not NaN may be returned where the other is.
    #[inline(always)]
    fn larger_size(self, other: Self) -> Self {
        self.abs().max(other.abs())
    }
    /// The bits of `self` with the sign flipped where `of` is negative.
    fn flip(self, of: Self) -> Self;
    /// Where `self < other`.
    fn lt(self, other: Self) -> u32;
    /// Where `self <= other`.
    fn le(self, other: Self) -> u32;
    /// Where the bits of `self` are these.
    fn equals(self, bits: u32) -> u32;
    /// `self` in the lanes of the mask, else `other`; bits are kept.
    fn select(self, mask: u32, other: Self) -> Self;
    /// Smallest lane; no lane may be NaN.
    fn lowest(self) -> f32;
    /// Largest lane; no lane may be NaN.
    fn highest(self) -> f32;
    /// Sum of the lanes, in any order.
    fn sum(self) -> f32;
}

/// Portable lanes.
#[derive(Clone, Copy)]
pub struct Lanes<const N: usize>([f32; N]);

impl<const N: usize> Lanes<N> {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Lanes(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }

    #[inline(always)]
    fn mask(self, other: Self, f: impl Fn(f32, f32) -> bool) -> u32 {
        (0..N).fold(0, |mask, i| mask | u32::from(f(self.0[i], other.0[i])) << i)
    }
}

macro_rules! portable_operator {
    ($trait:ident, $method:ident, $op:tt) => {
        impl<const N: usize> $trait for Lanes<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |x, y| x $op y)
            }
        }
    };
}
portable_operator!(Add, add, +);
portable_operator!(Sub, sub, -);
portable_operator!(Mul, mul, *);

impl<const N: usize> Vector for Lanes<N> {
    const LANES: usize = N;
    #[inline(always)]
    unsafe fn splat(x: f32) -> Self {
        Lanes([x; N])
    }
    #[inline(always)]
    unsafe fn load(row: &[f32]) -> Self {
        Lanes(std::array::from_fn(|i| row[i]))
    }
    #[inline(always)]
    unsafe fn load_two(low: &[f32], high: &[f32]) -> Self {
        Lanes(std::array::from_fn(|i| if i < N / 2 { low[i] } else { high[i - N / 2] }))
    }
    #[inline(always)]
    fn store(self, row: &mut [f32]) {
        row[..N].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn div(self, by: Self) -> Self {
        self.zip(by, |x, y| x / y)
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self * factor + term
    }
    #[inline(always)]
    fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        term - self * factor
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |x, y| if x < y { x } else { y })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |x, y| if x > y { x } else { y })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Lanes(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn flip(self, of: Self) -> Self {
        self.zip(of, |x, y| if y.is_sign_negative() { -x } else { x })
    }
    #[inline(always)]
    fn lt(self, other: Self) -> u32 {
        self.mask(other, |x, y| x < y)
    }
    #[inline(always)]
    fn le(self, other: Self) -> u32 {
        self.mask(other, |x, y| x <= y)
    }
    #[inline(always)]
    fn equals(self, bits: u32) -> u32 {
        self.mask(self, |x, _| x.to_bits() == bits)
    }
    #[inline(always)]
    fn select(self, mask: u32, other: Self) -> Self {
        let lane = |i: usize| if mask >> i & 1 == 1 { self.0[i] } else { other.0[i] };
        Lanes(std::array::from_fn(lane))
    }
    #[inline(always)]
    fn lowest(self) -> f32 {
        self.0.into_iter().fold(f32::INFINITY, f32::min)
    }
    #[inline(always)]
    fn highest(self) -> f32 {
        self.0.into_iter().fold(f32::NEG_INFINITY, f32::max)
    }
    #[inline(always)]
    fn sum(self) -> f32 {
        self.0.into_iter().sum()
    }
}

/// Two vectors as one of twice the lanes.
#[derive(Clone, Copy)]
pub struct Pair<V>(V, V);

macro_rules! pair_operator {
    ($trait:ident, $method:ident, $op:tt) => {
        impl<V: Vector> $trait for Pair<V> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Pair(self.0 $op other.0, self.1 $op other.1)
            }
        }
    };
}
pair_operator!(Add, add, +);
pair_operator!(Sub, sub, -);
pair_operator!(Mul, mul, *);

impl<V: Vector> Vector for Pair<V> {
    const LANES: usize = 2 * V::LANES;
    #[inline(always)]
    unsafe fn splat(x: f32) -> Self {
        // SAFETY: passed on to the caller.
        unsafe { Pair(V::splat(x), V::splat(x)) }
    }
    #[inline(always)]
    unsafe fn load(row: &[f32]) -> Self {
        // SAFETY: passed on to the caller.
        unsafe { Pair(V::load(row), V::load(&row[V::LANES..])) }
    }
    #[inline(always)]
    unsafe fn load_two(low: &[f32], high: &[f32]) -> Self {
        // SAFETY: passed on to the caller.
        unsafe { Pair(V::load(low), V::load(high)) }
    }
    #[inline(always)]
    fn store(self, row: &mut [f32]) {
        self.0.store(row);
        self.1.store(&mut row[V::LANES..]);
    }
    #[inline(always)]
    fn div(self, by: Self) -> Self {
        Pair(self.0.div(by.0), self.1.div(by.1))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        Pair(self.0.mul_add(factor.0, term.0), self.1.mul_add(factor.1, term.1))
    }
    #[inline(always)]
    fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        Pair(self.0.neg_mul_add(factor.0, term.0), self.1.neg_mul_add(factor.1, term.1))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Pair(self.0.min(other.0), self.1.min(other.1))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Pair(self.0.max(other.0), self.1.max(other.1))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Pair(self.0.abs(), self.1.abs())
    }
    #[inline(always)]
    fn larger_size(self, other: Self) -> Self {
        Pair(self.0.larger_size(other.0), self.1.larger_size(other.1))
    }
    #[inline(always)]
    fn flip(self, of: Self) -> Self {
        Pair(self.0.flip(of.0), self.1.flip(of.1))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> u32 {
        self.0.lt(other.0) | self.1.lt(other.1) << V::LANES
    }
    #[inline(always)]
    fn le(self, other: Self) -> u32 {
        self.0.le(other.0) | self.1.le(other.1) << V::LANES
    }
    #[inline(always)]
    fn equals(self, bits: u32) -> u32 {
        self.0.equals(bits) | self.1.equals(bits) << V::LANES
    }
    #[inline(always)]
    fn select(self, mask: u32, other: Self) -> Self {
        Pair(self.0.select(mask, other.0), self.1.select(mask >> V::LANES, other.1))
    }
    #[inline(always)]
    fn lowest(self) -> f32 {
        self.0.min(self.1).lowest()
    }
    #[inline(always)]
    fn highest(self) -> f32 {
        self.0.max(self.1).highest()
    }
    #[inline(always)]
    fn sum(self) -> f32 {
        (self.0 + self.1).sum()
    }
}

/// The same in `f64`, for the tests of [`super::settle`]: nothing here is fused.
pub trait Doubles: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// Number of lanes.
    const LANES: usize;
    /// The same number in all lanes.
    ///
    /// # Safety
    /// As for [`Vector::splat`].
    unsafe fn splat(x: f64) -> Self;
    /// The first numbers of a row.
    ///
    /// # Safety
    /// As for [`Vector::load`].
    unsafe fn widen(row: &[f32]) -> Self;
    /// The first numbers of a row.
    ///
    /// # Safety
    /// As for [`Vector::load`].
    unsafe fn load(row: &[f64]) -> Self;
    /// Rounds the lanes to the beginning of a row; panics if it is too short.
    fn narrow(self, row: &mut [f32]);
    /// Writes the lanes to the beginning of a row; panics if it is too short.
    fn store(self, row: &mut [f64]);
    /// Quotient.
    fn div(self, by: Self) -> Self;
    /// Smaller number.
    fn min(self, other: Self) -> Self;
    /// Larger number.
    fn max(self, other: Self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Where `self < other`.
    fn lt(self, other: Self) -> u32;
    /// Where `self <= other`.
    fn le(self, other: Self) -> u32;
}

impl Doubles for f64 {
    const LANES: usize = 1;
    #[inline(always)]
    unsafe fn splat(x: f64) -> Self {
        x
    }
    #[inline(always)]
    unsafe fn widen(row: &[f32]) -> Self {
        f64::from(row[0])
    }
    #[inline(always)]
    unsafe fn load(row: &[f64]) -> Self {
        row[0]
    }
    #[inline(always)]
    fn narrow(self, row: &mut [f32]) {
        row[0] = self as f32;
    }
    #[inline(always)]
    fn store(self, row: &mut [f64]) {
        row[0] = self;
    }
    #[inline(always)]
    fn div(self, by: Self) -> Self {
        self / by
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> u32 {
        u32::from(self < other)
    }
    #[inline(always)]
    fn le(self, other: Self) -> u32 {
        u32::from(self <= other)
    }
}
