//! The walk of a beam: intervals of plane crossings in place of crossings.

#![allow(unsafe_code)]

use super::frame::{Frame, Packet};
#[cfg(doc)]
use super::settle;
use super::settle::{Corners, Judgement, Settled};
use super::vector::Vector;
use super::{BeamQuery, Beams};
use crate::aabb::Aabb;
use crate::kernel::exact::Exact;
use crate::kernel::level::Simd;
use crate::kernel::slot::STACK;
use crate::wide::{ORDER, Treelet};
use std::ops::Range;

/// What a level offers to the beam.
///
/// # Safety
/// The methods may only run on a machine with the level's features.
pub trait BeamSimd: Simd {
    /// One lane a triangle of a block.
    type Triangles: Vector;
    /// One lane a ray of a packet.
    type Rays: Vector;
    /// Replaces the top of the stack by the children that some ray of the shaft may reach before
    /// `limit`, nearest on top, and returns the new stack pointer.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn advance(
        shaft: &Shaft,
        stack: &mut Stack,
        treelet: &Treelet,
        sp: usize,
        limit: f32,
    ) -> usize;
    /// `Beams::walk`, compiled once for the level and query.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn walk<Q: BeamQuery>(
        beams: &mut Beams<'_, Q>,
        frame: &Frame,
        packets: Range<usize>,
    ) -> bool;
    /// [`settle::judge`], compiled once for the level.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn judge(packet: &Packet, corners: &Corners, axis: [usize; 3]) -> Judgement;
    /// [`settle::settle`], compiled once for the level.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn settle(
        packet: &Packet,
        corners: &mut Corners,
        exact: &Exact<'_>,
        axis: [usize; 3],
    ) -> Settled;
}

/// All rays of a beam as intervals: at depth `z` a ray is at `origin + z * slope` on each axis, with
/// `origin` and `1 / slope` from the intervals.
///
/// The crossing of a plane `p` is bounded by `(p - origin) / slope` with the ends of the intervals.
/// The origins' interval is wider than the rays by a multiple of the rounding errors of `p - origin`,
/// which covers all roundings of the bounds (see [`super::frame::COORDINATE_SLACK`]).
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct Shaft {
    /// The end of the origins that crosses a plane first.
    pub first: [f32; 4],
    /// The end of the origins that crosses a plane last.
    pub last: [f32; 4],
    /// The end of `1 / slope` of smaller magnitude; its sign is that of all slopes on the axis.
    pub inv: [f32; 4],
    /// The other end; may be infinite.
    pub inv_wide: [f32; 4],
}

impl Shaft {
    /// The intervals of an axis: origins (already widened) and slopes of one sign.
    pub fn set(&mut self, axis: usize, origin: [f32; 2], slope: [f32; 2]) {
        // Adding 0 turns -0 into 0.
        let [low, high] = slope.map(|s| 1.0 / (s + 0.0));
        if slope[0] + 0.0 >= 0.0 {
            (self.first[axis], self.last[axis]) = (origin[1], origin[0]);
            (self.inv[axis], self.inv_wide[axis]) = (high, low);
        } else {
            (self.first[axis], self.last[axis]) = (origin[0], origin[1]);
            // A slope of 0 among negative ones is reached from below.
            let high = if slope[1] == 0.0 { f32::NEG_INFINITY } else { high };
            (self.inv[axis], self.inv_wide[axis]) = (low, high);
        }
    }

    /// First and last crossing of a plane; NaN bounds nothing.
    #[inline(always)]
    fn crossings(&self, axis: usize, plane: f32) -> [f32; 2] {
        let (first, last) = (plane - self.first[axis], plane - self.last[axis]);
        let [a, b] = [first * self.inv_wide[axis], first * self.inv[axis]];
        let [c, d] = [last * self.inv_wide[axis], last * self.inv[axis]];
        [if a < b { a } else { b }, if c > d { c } else { d }]
    }

    /// The depths at which some ray may be in a box.
    pub fn clip(&self, bounds: &Aabb) -> [f32; 2] {
        let (mut enter, mut exit) = (f32::NEG_INFINITY, f32::INFINITY);
        for a in 0..3 {
            let negative = self.inv[a].is_sign_negative();
            let (near, far) =
                if negative { (bounds.max, bounds.min) } else { (bounds.min, bounds.max) };
            enter = enter.max(self.crossings(a, near[a])[0]);
            exit = exit.min(self.crossings(a, far[a])[1]);
        }
        [enter, exit]
    }

    /// The portable step: what the SIMD levels equal.
    pub fn step(&self, stack: &mut Stack, treelet: &Treelet, sp: usize, limit: f32) -> usize {
        let mut cross = [[0.0f32; 2]; 7];
        let mut signs = 0;
        for (h, cross) in cross.iter_mut().enumerate() {
            let a = treelet.axis(h);
            *cross = self.crossings(a, treelet.plane[h]);
            signs |= usize::from(self.inv[a].is_sign_negative()) << h;
        }
        let (z_in, z_out) = (stack.enter[sp], stack.exit[sp].min(limit));
        let mut sp = sp;
        for (j, &packed) in ORDER.0[signs].iter().enumerate() {
            let path = [0, packed as usize >> 3 & 7, packed as usize >> 6 & 7];
            let (mut enter, mut exit) = (z_in, z_out);
            for (level, h) in path.into_iter().enumerate() {
                let [first, last] = cross[h];
                if j & (4 >> level) == 0 {
                    enter = if first > enter { first } else { enter };
                } else {
                    exit = if last < exit { last } else { exit };
                }
            }
            let code = treelet.child[packed as usize & 7];
            if code != 0 && enter <= exit {
                (stack.code[sp], stack.enter[sp], stack.exit[sp]) = (code, enter, exit);
                sp += 1;
            }
        }
        sp - 1
    }
}

/// The cells that a beam has still to visit.
#[repr(C, align(64))]
#[derive(Clone)]
pub struct Stack {
    /// Codes; entry 0 is not used.
    pub code: [u32; STACK],
    /// Smallest depth at which a ray may enter.
    pub enter: [f32; STACK],
    /// Largest depth at which a ray may leave.
    pub exit: [f32; STACK],
}

impl Stack {
    /// An empty stack.
    pub const EMPTY: Stack = Stack { code: [0; STACK], enter: [0.0; STACK], exit: [0.0; STACK] };
}
