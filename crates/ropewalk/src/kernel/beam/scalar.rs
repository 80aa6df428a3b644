//! The portable level.

#![allow(unsafe_code)]

use super::frame::{Frame, Packet};
use super::settle::{self, Corners, Judgement, Settled};
use super::shaft::{BeamSimd, Shaft, Stack};
use super::vector::Lanes;
use super::{BeamQuery, Beams};
use crate::kernel::exact::Exact;
use crate::kernel::scalar::Scalar;
use crate::wide::Treelet;
use std::ops::Range;

impl BeamSimd for Scalar {
    type Triangles = Lanes<8>;
    type Rays = Lanes<16>;

    #[inline(always)]
    unsafe fn advance(
        shaft: &Shaft,
        stack: &mut Stack,
        treelet: &Treelet,
        sp: usize,
        limit: f32,
    ) -> usize {
        shaft.step(stack, treelet, sp, limit)
    }

    unsafe fn walk<Q: BeamQuery>(
        beams: &mut Beams<'_, Q>,
        frame: &Frame,
        packets: Range<usize>,
    ) -> bool {
        // SAFETY: portable code.
        unsafe { beams.walk::<Self>(frame, packets) }
    }

    unsafe fn judge(packet: &Packet, corners: &Corners, axis: [usize; 3]) -> Judgement {
        // SAFETY: portable code.
        unsafe { settle::judge::<Self>(packet, corners, axis) }
    }

    unsafe fn settle(
        packet: &Packet,
        corners: &mut Corners,
        exact: &Exact<'_>,
        axis: [usize; 3],
    ) -> Settled {
        // SAFETY: portable code.
        unsafe { settle::settle::<Self>(packet, corners, exact, axis) }
    }
}
