//! Segments of particles that pass through everything, so that all of them are known: in any slot and in any order.
//!
//! ```text
//! a packet of sixteen segments in turn is looked at at once (entry_packet), or one by itself where that does not pay
//! those that may meet something go into slots as these become free
//! ```
//! Other than rays of a batch they are made as they are needed: where one begins follows from the one before.

#![allow(unsafe_code)]

use super::entry_packet::{PACKET, Packets};
use super::events::Events;
use super::lanes::{Trial, WalkReport};
use super::level::Simd;
use super::query::BatchQuery;
use super::source::Source;
use super::wave::WAVE;
use crate::ray::Ray;
use crate::wide::WideTree;

/// Where the segments come from.
pub trait Supply<Q: BatchQuery> {
    /// Makes the next segments, which are to be known by their numbers until others are made; how many, less than
    /// there is room for if there are no more.
    fn make(&mut self, rays: &mut [Ray; PACKET]) -> usize;

    /// The segment with this number goes into slot `k`.
    fn begin(&mut self, number: usize, k: usize, query: &mut Q);

    /// The query has its answer for the segment in slot `k`.
    fn end(&mut self, k: usize, query: &mut Q);
}

/// The segments of a supply.
pub struct Known<S> {
    supply: S,
    rays: [Ray; WAVE],
    /// Slots whose answers have not been passed on.
    occupied: u32,
    /// The last segments made: many at a time, since each waits for the one before.
    made: [Ray; PACKET],
    /// The number of these.
    count: usize,
    /// The first of them that has not been looked at.
    next: usize,
    /// Those of them that may meet something and are not yet in slots.
    left: u32,
    entries: [u32; PACKET],
    /// None where the tree is a leaf.
    packets: Option<Box<Packets>>,
    trial: Trial,
}

const _: () = assert!(WAVE <= u32::BITS as usize);

impl<S> Known<S> {
    /// Those of a supply, over a tree.
    pub fn new(tree: &WideTree, supply: S) -> Self {
        let none = Ray::new([0.0; 3], [1.0, 0.0, 0.0]);
        let packets = Packets::new(tree).map(Box::new);
        Known {
            supply,
            rays: [none; WAVE],
            occupied: 0,
            made: [none; PACKET],
            count: 0,
            next: 0,
            left: 0,
            entries: [0; PACKET],
            trial: Trial::new(packets.is_some()),
            packets,
        }
    }

    /// The supply, and how its segments went.
    pub fn into_parts(self) -> (S, WalkReport) {
        (self.supply, self.trial.report())
    }
}

impl<Q: BatchQuery, S: Supply<Q>> Source<Q> for Known<S> {
    // Answers are taken when a slot is free again.
    const WAITS: bool = true;

    #[inline(always)]
    fn rays(&self) -> &[Ray] {
        &self.rays
    }

    #[inline(always)]
    unsafe fn next<L: Simd, E: Events>(
        &mut self,
        k: usize,
        tree: &WideTree,
        query: &mut Q,
        events: &mut E,
    ) -> Option<(usize, u32)> {
        if self.occupied >> k & 1 == 1 {
            self.occupied &= !(1 << k);
            self.supply.end(k, query);
        }
        while self.left == 0 {
            if self.next == self.count {
                (self.next, self.count) = (0, self.supply.make(&mut self.made).min(PACKET));
                if self.count == 0 {
                    return None;
                }
            }
            let i = self.next % PACKET;
            let rest = &self.made[i..self.count];
            let Some(packets) = self.packets.as_mut().filter(|_| self.trial.searching()) else {
                self.left = (u32::MAX >> (32 - rest.len())) << i;
                self.entries[i..self.count].fill(tree.root());
                self.trial.note(rest.len() as u32, 0);
                self.next = self.count;
                break;
            };
            // SAFETY: passed on to the caller; the search is that of the tree.
            unsafe {
                let mut n = 1;
                if packets.is_due() && i == 0 {
                    let entries = &mut self.entries;
                    self.left = packets.enter_packet::<L, E>(tree, rest, entries, events);
                    n = rest.len() as u32;
                } else if let Some(code) = packets.enter_one::<L, E>(tree, &rest[0], events) {
                    (self.left, self.entries[i]) = (1 << i, code);
                }
                self.next += n as usize;
                self.trial.note(n, n - self.left.count_ones());
            }
        }
        let i = self.left.trailing_zeros() as usize % PACKET;
        self.left &= self.left - 1;
        self.supply.begin(i, k, query);
        self.occupied |= 1 << k;
        // SAFETY: passed on to the caller.
        unsafe { L::put(&mut self.rays[k], &self.made[i]) };
        Some((k, self.entries[i]))
    }
}
