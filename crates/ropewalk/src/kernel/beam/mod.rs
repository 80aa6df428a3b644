//! The beam: rays that keep together walk the tree together.
//!
//! ```text
//! group    64 rays in turn, or 16, that have like directions and either meet in one point (an eye, a
//!          light) or are parallel: two numbers tell them apart
//! walk     intervals of these numbers bound where the rays cross a plane, so one step serves all
//! test     in a leaf, 8 triangles at a time are projected into the group's frame, where edge functions
//!          are linear in the two numbers; those that no ray of a packet of 16 can hit are dropped, each
//!          of the others is tested with 16 rays at once
//! settle   f32 decides where it is certain, within a derived bound; what it cannot tell is decided
//!          by the reference test, and the parameters of the winners are computed in f64
//! ```
//! After Reshetov, Soupikov and Hurley, "Multi-Level Ray Tracing Algorithm" (2005), and Wald et al.,
//! "Ray Tracing Animated Scenes using Coherent Grid Traversal" (2006). Deviation: depth along an axis
//! in place of the rays' parameters, which makes the intervals of all planes across that axis exact.
//!
//! Answers are those of the wave, bit for bit. Rays that do not fit are left to it.

#![allow(unsafe_code)]

mod facets;
mod frame;
mod scalar;
mod settle;
mod shaft;
mod vector;
mod x86;

pub use shaft::BeamSimd;
pub use vector::Lanes as PortableLanes;
pub use vector::{Doubles, Vector};
#[cfg(target_arch = "x86_64")]
pub use x86::{
    Eight, Eight512, EightDoubles, FourDoubles, Sixteen, larger_size_avx2, larger_size_avx512,
};

use super::exact::{At, Exact, place};
use super::query::{Any, BatchQuery, Closest};
use crate::ray::Ray;
use crate::wide::{
    BLOCK_LINES, Block, ID_MASK, LEAF, LINE, WIDTH, WideTree, code_line, code_offset,
};
use facets::Facets;
use frame::{Frame, NONE, Packet, RAYS};
use settle::Corners;
use shaft::Stack;
use std::ops::Range;

/// Packets of a beam.
const PACKETS: usize = 4;

/// What a ray of a beam may cost, in units of [`Beams::spent`].
const BUDGET: u32 = 20;

/// Most beams that are skipped in a row.
const LONGEST: u32 = 64;

/// Cells behind the next that are asked for after a step.
const AHEAD: usize = 2;

/// Fewest rays of a packet that are worth a beam.
const FEWEST: u32 = 4;

/// Most beams that sixteen rays are divided into.
const LEADERS: usize = 3;

/// Primitives that a beam remembers.
const MAILBOXES: usize = 128;

/// The triangles that a beam has tested of late, so that those in several leaves are tested once.
struct Mailboxes {
    /// Ids by their lowest bits.
    id: [u32; MAILBOXES],
    /// Packets that have tested them.
    packets: [u8; MAILBOXES],
}

impl Mailboxes {
    const EMPTY: Mailboxes = Mailboxes { id: [NONE; MAILBOXES], packets: [0; MAILBOXES] };

    /// True if packet `k` has not tested a primitive, which it does now.
    #[inline(always)]
    fn is_new(&mut self, prim_id: u32, k: usize) -> bool {
        let at = prim_id as usize % MAILBOXES;
        let seen = if self.id[at] == prim_id { self.packets[at] } else { 0 };
        (self.id[at], self.packets[at]) = (prim_id, seen | 1 << k);
        seen >> k & 1 == 0
    }
}

/// A query that beams can answer: each ray has one answer.
pub trait BeamQuery: BatchQuery {
    /// Takes the answers of some lanes: parameters and primitives, infinite and [`NONE`] for misses.
    /// Any-hit queries look at the primitives only.
    fn answer(&mut self, rays: &[u32; RAYS], lanes: u32, t: &[f32; RAYS], prim_id: &[u32; RAYS]);

    /// Lets `walk` put the same question to rays that have been moved, and answers them where they
    /// stood.
    fn ask_moved(&mut self, stood: &[u32], answers: &mut Answers, walk: impl Walk);
}

/// A walk that any query may be put to.
pub trait Walk {
    /// Answers all rays.
    fn walk<Q: BatchQuery>(self, query: &mut Q);
}

/// Answers of rays that have been moved.
#[derive(Default)]
pub struct Answers {
    t: Vec<f32>,
    prim: Vec<u32>,
    hit: Vec<bool>,
}

impl BeamQuery for Closest<'_> {
    #[inline(always)]
    fn answer(&mut self, rays: &[u32; RAYS], lanes: u32, t: &[f32; RAYS], prim_id: &[u32; RAYS]) {
        for lane in (0..RAYS).filter(|lane| lanes >> lane & 1 == 1) {
            self.t[rays[lane] as usize] = t[lane];
            self.prim[rays[lane] as usize] = prim_id[lane];
        }
    }

    fn ask_moved(&mut self, stood: &[u32], answers: &mut Answers, walk: impl Walk) {
        let Answers { t, prim, .. } = answers;
        t.resize(stood.len(), 0.0);
        prim.resize(stood.len(), 0);
        walk.walk(&mut Closest::new(t, prim));
        for (&ray, (&t, &prim)) in stood.iter().zip(t.iter().zip(&*prim)) {
            self.t[ray as usize] = t;
            self.prim[ray as usize] = prim;
        }
    }
}

impl BeamQuery for Any<'_> {
    #[inline(always)]
    fn answer(&mut self, rays: &[u32; RAYS], lanes: u32, _t: &[f32; RAYS], prim_id: &[u32; RAYS]) {
        for lane in (0..RAYS).filter(|lane| lanes >> lane & 1 == 1) {
            self.hit[rays[lane] as usize] = prim_id[lane] != NONE;
        }
    }

    fn ask_moved(&mut self, stood: &[u32], answers: &mut Answers, walk: impl Walk) {
        let hit = &mut answers.hit;
        hit.resize(stood.len(), false);
        walk.walk(&mut Any { hit });
        for (&ray, &hit) in stood.iter().zip(&*hit) {
            self.hit[ray as usize] = hit;
        }
    }
}

/// Which way the rays of a batch went, and what it cost the beams.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BatchReport {
    /// Rays answered in beams.
    pub beam_rays: u64,
    /// Rays answered by the wave.
    pub wave_rays: u64,
    /// Of these, rays whose entries were searched for; see [`Start`](super::Start).
    pub entry_rays: u64,
    /// Of these, rays that started from the cell that was given for them or from a treelet above it; see
    /// [`BatchCaster::with_cells`](super::BatchCaster::with_cells).
    pub cell_rays: u64,
    /// Rays whose cell led up to the root: of another tree, or far from where the ray goes.
    pub climbed_rays: u64,
    /// Of these, short occlusion rays that started from a few cells near them, found for many at once.
    pub near_rays: u64,
    /// Of these, rays that were sorted; see [`Sorting`](super::Sorting).
    pub sorted_rays: u64,
    /// Beams tried.
    pub beams: u64,
    /// Beams that turned out too wide for the tree; their rays were tried again or left to the wave.
    pub given_up: u64,
    /// Treelets visited by beams.
    pub steps: u64,
    /// Blocks projected.
    pub blocks: u64,
    /// Triangles tested with a packet.
    pub tests: u64,
    /// Decisions left to the reference test.
    pub exact: u64,
}

impl std::ops::Add for BatchReport {
    type Output = BatchReport;

    fn add(self, other: BatchReport) -> BatchReport {
        BatchReport {
            beam_rays: self.beam_rays + other.beam_rays,
            wave_rays: self.wave_rays + other.wave_rays,
            entry_rays: self.entry_rays + other.entry_rays,
            cell_rays: self.cell_rays + other.cell_rays,
            climbed_rays: self.climbed_rays + other.climbed_rays,
            near_rays: self.near_rays + other.near_rays,
            sorted_rays: self.sorted_rays + other.sorted_rays,
            beams: self.beams + other.beams,
            given_up: self.given_up + other.given_up,
            steps: self.steps + other.steps,
            blocks: self.blocks + other.blocks,
            tests: self.tests + other.tests,
            exact: self.exact + other.exact,
        }
    }
}

/// The room that beams work in, kept by each thread.
pub struct Room {
    stack: Stack,
    packets: [Packet; PACKETS],
    facets: Facets,
    corners: Corners,
    tested: Mailboxes,
}

impl Room {
    /// New room.
    pub fn new() -> Self {
        Room {
            stack: Stack::EMPTY,
            packets: [Packet::EMPTY; PACKETS],
            facets: Facets::EMPTY,
            corners: Corners::EMPTY,
            tested: Mailboxes::EMPTY,
        }
    }
}

/// Whether beams of a size are tried: after each that was too wide, twice as many are skipped.
struct Patience {
    skip: u32,
    next: u32,
}

impl Patience {
    const NEW: Patience = Patience { skip: 0, next: 1 };

    fn tries(&mut self) -> bool {
        let tries = self.skip == 0;
        self.skip = self.skip.saturating_sub(1);
        tries
    }

    fn learn(&mut self, done: bool) {
        if done {
            self.next = (self.next / 2).max(1);
        } else {
            (self.skip, self.next) = (self.next, (2 * self.next).min(LONGEST));
        }
    }
}

/// A batch on its way.
pub struct Beams<'a, Q> {
    tree: &'a WideTree,
    exact: Exact<'a>,
    query: &'a mut Q,
    room: &'a mut Room,
    left: &'a mut Vec<u32>,
    report: BatchReport,
    large: Patience,
    small: Patience,
}

/// Answers the coherent rays of a batch and puts the others on the list `left`.
///
/// # Safety
/// The machine must have the features of `L`, and the caller must enable them: everything here is
/// inlined into it.
#[inline(always)]
pub unsafe fn beams<L: BeamSimd, Q: BeamQuery>(
    tree: &WideTree,
    rays: &[Ray],
    query: &mut Q,
    room: &mut Room,
    left: &mut Vec<u32>,
) -> BatchReport {
    let exact = Exact { lines: tree.lines(), rays };
    let report = BatchReport::default();
    let (large, small) = (Patience::NEW, Patience::NEW);
    let mut beams = Beams { tree, exact, query, room, left, report, large, small };
    for first in (0..rays.len()).step_by(PACKETS * RAYS) {
        // SAFETY: passed on to the caller.
        unsafe { beams.group::<L>(first) };
    }
    beams.report
}

impl<Q: BeamQuery> Beams<'_, Q> {
    /// Tries up to 64 rays as one beam, else each sixteen of them.
    ///
    /// A few rays are looked at before any are put side by side, so that incoherent batches lose
    /// next to nothing here.
    #[inline(always)]
    unsafe fn group<L: BeamSimd>(&mut self, first: usize) {
        let end = self.exact.rays.len().min(first + PACKETS * RAYS);
        let rays = &self.exact.rays[first..end];
        let leader = Frame::of(&rays[0]);
        // SAFETY: passed on to the caller.
        unsafe {
            if rays.len() > RAYS
                && let Some(frame) = leader
                && sample(rays).iter().all(|ray| frame.fits(ray))
                && self.large.tries()
                && self.load::<L>(frame, rays, first)
            {
                return;
            }
            for (i, rays) in rays.chunks(RAYS).enumerate() {
                self.packet::<L>(rays, first + i * RAYS);
            }
        }
    }

    /// Answers up to 64 rays if they are alike.
    #[inline(always)]
    unsafe fn load<L: BeamSimd>(&mut self, frame: Frame, rays: &[Ray], first: usize) -> bool {
        for (i, rays) in rays.chunks(RAYS).enumerate() {
            let packet = &mut self.room.packets[i];
            packet.load(rays, (first + i * RAYS) as u32);
            // SAFETY: passed on to the caller.
            if unsafe { packet.like::<L::Rays>(&frame) } != packet.lanes {
                return false;
            }
        }
        // SAFETY: passed on to the caller.
        unsafe { self.cast::<L>(frame, rays.len().div_ceil(RAYS)) }
    }

    /// Tries sixteen rays as a beam; those unlike the first, as where a silhouette passes between
    /// them, as another, and so on.
    #[inline(always)]
    unsafe fn packet<L: BeamSimd>(&mut self, rays: &[Ray], first: usize) {
        let mut rest = (1u32 << rays.len()) - 1;
        let alike = |frame: Frame| sample(rays).iter().filter(|ray| frame.fits(ray)).count() > 1;
        if Frame::of(&rays[0]).is_none_or(|frame| !alike(frame)) || !self.small.tries() {
            return self.left.extend(first as u32..(first + rays.len()) as u32);
        }
        self.room.packets[0].load(rays, first as u32);
        let mut left = 0;
        for _ in 0..LEADERS {
            let leader = rest.trailing_zeros() as usize;
            let Some(frame) = rays.get(leader).and_then(Frame::of) else { break };
            let packet = &mut self.room.packets[0];
            packet.lanes = rest;
            // SAFETY: passed on to the caller.
            let lanes = unsafe { packet.like::<L::Rays>(&frame) };
            packet.lanes = lanes;
            // SAFETY: passed on to the caller.
            if lanes.count_ones() < FEWEST || !unsafe { self.cast::<L>(frame, 1) } {
                left |= lanes;
            }
            rest &= !lanes & !(1 << leader);
            left |= !lanes & 1 << leader;
        }
        self.leave(first, rest | left);
    }

    /// Leaves some of the rays from `first` on to the wave.
    #[inline(always)]
    fn leave(&mut self, first: usize, mut lanes: u32) {
        while lanes != 0 {
            self.left.push(first as u32 + lanes.trailing_zeros());
            lanes &= lanes - 1;
        }
    }

    /// Answers or leaves the lanes of the first packets; false if they are not a family.
    #[inline(always)]
    unsafe fn cast<L: BeamSimd>(&mut self, frame: Frame, count: usize) -> bool {
        // SAFETY: passed on to the caller.
        unsafe {
            let packets = &mut self.room.packets[..count];
            let Some(mut frame) = frame.fit::<L::Rays>(packets, self.tree.bounds()) else {
                return false;
            };
            frame.place::<L::Rays>(packets);
            self.room.tested = Mailboxes::EMPTY;
            let done = L::walk(self, &frame, 0..count);
            let patience = if count > 1 { &mut self.large } else { &mut self.small };
            patience.learn(done);
            for k in 0..count {
                // What the packets have found and tested together stands.
                let done = done || (count > 1 && self.alone::<L>(&frame, k));
                self.finish::<L>(&frame, k, done);
            }
            true
        }
    }

    /// Goes on with a packet of a beam that was too wide.
    #[inline(always)]
    unsafe fn alone<L: BeamSimd>(&mut self, frame: &Frame, k: usize) -> bool {
        if !self.small.tries() {
            return false;
        }
        // SAFETY: passed on to the caller.
        let done = unsafe { L::walk(self, frame, k..k + 1) };
        self.small.learn(done);
        done
    }

    /// Visits the cells of the shaft from front to back until no ray is active; false if that costs
    /// too much.
    #[inline(always)]
    unsafe fn walk<L: BeamSimd>(&mut self, frame: &Frame, range: Range<usize>) -> bool {
        // SAFETY: passed on to the caller.
        unsafe {
            let packets = &mut self.room.packets[range.clone()];
            let shaft = frame.shaft::<L::Rays>(packets);
            let mut radius = [0.0f32; 2];
            let (mut nearest, mut limit) = (f32::INFINITY, f32::NEG_INFINITY);
            let mut rays = 0;
            for p in packets.iter_mut() {
                for i in 0..2 {
                    radius[i] = radius[i].max(p.middle[i].abs() + p.radius[i]);
                }
                nearest = nearest.min(p.nearest);
                p.farthest = farthest::<L::Rays>(p);
                limit = limit.max(p.farthest);
                rays += p.lanes.count_ones();
            }
            self.report.beams += 1;
            if self.tree.root() == 0 {
                return true;
            }
            let [enter, exit] = shaft.clip(self.tree.bounds());
            let (enter, exit) = (enter.max(nearest), exit.min(limit));
            if enter > exit {
                return true;
            }
            let end = self.spent() + u64::from(BUDGET * rays);
            let stack = &mut self.room.stack;
            (stack.code[1], stack.enter[1], stack.exit[1]) = (self.tree.root(), enter, exit);
            let mut sp = 1;
            while sp > 0 {
                let stack = &mut self.room.stack;
                let (code, enter) = (stack.code[sp], stack.enter[sp]);
                if enter > limit {
                    sp -= 1;
                } else if code & LEAF == 0 {
                    let treelet = self.tree.lines().treelet(code_line(code));
                    sp = L::advance(&shaft, stack, treelet, sp, limit);
                    self.report.steps += 1;
                    for ahead in 0..=AHEAD {
                        self.prefetch::<L>(self.room.stack.code[sp.saturating_sub(ahead)]);
                    }
                } else {
                    sp -= 1;
                    if self.spent() > end {
                        self.report.given_up += 1;
                        return false;
                    }
                    if self.leaf::<L>(frame, radius, code, enter, range.clone()) {
                        let packets = &self.room.packets[range.clone()];
                        limit = packets.iter().fold(f32::NEG_INFINITY, |l, p| l.max(p.farthest));
                    }
                }
            }
            true
        }
    }

    /// Asks for a cell that comes after the next.
    #[inline(always)]
    unsafe fn prefetch<L: BeamSimd>(&self, code: u32) {
        let cell = self.tree.lines().as_ptr().wrapping_add(code_offset(code));
        let lines = if code & LEAF == 0 { 1 } else { BLOCK_LINES };
        for line in 0..lines {
            // SAFETY: passed on to the caller.
            unsafe { L::prefetch(cell.wrapping_add(line * LINE)) };
        }
    }

    /// What the beams have cost so far, in units of about 6 ns.
    #[inline(always)]
    fn spent(&self) -> u64 {
        2 * self.report.steps + 4 * self.report.blocks + self.report.tests
    }

    /// Tests a leaf; true if a ray has found something.
    #[inline(always)]
    unsafe fn leaf<L: BeamSimd>(
        &mut self,
        frame: &Frame,
        radius: [f32; 2],
        code: u32,
        enter: f32,
        range: Range<usize>,
    ) -> bool {
        // SAFETY: passed on to the caller.
        unsafe {
            let mut found = false;
            for line in self.tree.block_lines(code) {
                let block = self.tree.lines().block(line);
                self.room.facets.project::<L::Triangles>(frame, radius, block);
                self.report.blocks += 1;
                for k in range.clone() {
                    if enter <= self.room.packets[k].farthest {
                        found |= self.test::<L>(frame, block, line, k);
                    }
                }
            }
            found
        }
    }

    /// Tests the block that is projected with packet `k`; true if a ray may have found something.
    #[inline(always)]
    unsafe fn test<L: BeamSimd>(
        &mut self,
        frame: &Frame,
        block: &Block,
        line: usize,
        k: usize,
    ) -> bool {
        // SAFETY: passed on to the caller.
        unsafe {
            let facing = self.room.facets.facing::<L::Triangles>(&self.room.packets[k]);
            let (mut triangles, mut changed) = (facing.clear | facing.edge_on, 0);
            while triangles != 0 {
                let i = triangles.trailing_zeros() as usize;
                triangles &= triangles - 1;
                let prim_id = block.id[i] & ID_MASK;
                if !self.room.tested.is_new(prim_id, k) {
                    continue;
                }
                self.report.tests += 1;
                let (facets, packet) = (&self.room.facets, &mut self.room.packets[k]);
                let verdict = if facing.edge_on >> i & 1 == 0 {
                    facets.test::<L::Rays, Q>(i, place(line, i), prim_id, packet)
                } else {
                    facets.test_edge_on::<L::Rays>(i, packet)
                };
                changed |= verdict.hit | verdict.open;
                if verdict.open != 0 {
                    self.decide::<L>(frame, k, verdict.open, place(line, i));
                }
            }
            if changed != 0 {
                let packet = &mut self.room.packets[k];
                packet.farthest = farthest::<L::Rays>(packet);
            }
            changed != 0
        }
    }

    /// Lets the reference test decide about a triangle for some lanes of packet `k`.
    #[inline(always)]
    unsafe fn decide<L: BeamSimd>(&mut self, frame: &Frame, k: usize, lanes: u32, at: At) {
        // SAFETY: passed on to the caller.
        unsafe {
            let (lines, axis) = (self.exact.lines, frame.axis);
            let (packet, corners) = (&mut self.room.packets[k], &mut self.room.corners);
            let block = lines.block(at as usize / WIDTH);
            let prim_id = block.id[at as usize % WIDTH] & ID_MASK;
            // The same triangle in another leaf.
            let lanes = lanes & !L::Rays::load(&packet.prim).equals(prim_id);
            // Rays that start on a surface leave the triangles around their start behind them.
            let lanes = lanes & !settle::behind::<L::Rays>(packet, lines, at);
            if lanes == 0 {
                return;
            }
            self.report.exact += u64::from(lanes.count_ones());
            corners.fill(lines, at, axis);
            let mut new = L::judge(packet, corners, axis);
            let accepted = settle::accepted(lines, at, new.front);
            let mut hit = lanes & new.hit & accepted;
            let mut open = lanes & !new.hit & !new.miss;
            while open != 0 {
                let lane = open.trailing_zeros() as usize;
                open &= open - 1;
                if let Some(found) = self.exact.hit(packet.index[lane], at) {
                    hit |= 1 << lane;
                    new.t[lane] = found.t;
                }
            }
            if hit == 0 {
                return;
            }
            if Q::ANY {
                packet.active &= !hit;
                return;
            }
            let known = settle::gather::<L>(packet, hit, corners, lines, axis);
            let best = L::judge(packet, corners, axis);
            while hit != 0 {
                let lane = hit.trailing_zeros() as usize;
                hit &= hit - 1;
                let t = new.t[lane];
                if known >> lane & 1 == 1 {
                    let t_old = if best.hit >> lane & 1 == 1 {
                        Some(best.t[lane])
                    } else {
                        let old = packet.found[lane].to_bits();
                        self.exact.hit(packet.index[lane], old).map(|hit| hit.t)
                    };
                    let old = packet.prim[lane].to_bits();
                    if t_old.is_some_and(|t_old| t_old < t || (t_old == t && old <= prim_id)) {
                        continue;
                    }
                }
                let z = t * packet.scale[lane] + packet.start[lane];
                let slack = frame::DEPTH_SLACK * (z.abs() + packet.start[lane].abs());
                packet.best[0][lane] = z - slack;
                packet.best[1][lane] = z + slack;
                packet.found[lane] = f32::from_bits(at);
                packet.prim[lane] = f32::from_bits(prim_id);
            }
        }
    }

    /// Reports the answers of packet `k`; what is not answered is left to the wave.
    #[inline(always)]
    unsafe fn finish<L: BeamSimd>(&mut self, frame: &Frame, k: usize, done: bool) {
        let packet = &self.room.packets[k];
        let index = packet.index;
        let mut denied;
        if Q::ANY {
            let state = |lane: usize| if packet.active >> lane & 1 == 1 { NONE } else { 0 };
            let found = std::array::from_fn(state);
            denied = if done { 0 } else { packet.active };
            self.query.answer(&index, packet.lanes & !denied, &[0.0; RAYS], &found);
        } else if done {
            let corners = &mut self.room.corners;
            // SAFETY: passed on to the caller.
            let (t, prim_id, wrong) =
                unsafe { L::settle(packet, corners, &self.exact, frame.axis) };
            let altered = wrong != 0 && self.exact.lines.is_shared();
            debug_assert!(wrong == 0 || altered, "f32 was certain of a hit that is none");
            denied = wrong;
            self.query.answer(&index, packet.lanes & !denied, &t, &prim_id);
        } else {
            denied = packet.lanes;
        }
        self.report.beam_rays += u64::from((packet.lanes & !denied).count_ones());
        while denied != 0 {
            self.left.push(index[denied.trailing_zeros() as usize]);
            denied &= denied - 1;
        }
    }
}

/// A few rays of a group.
#[inline(always)]
fn sample(rays: &[Ray]) -> [&Ray; 3] {
    let last = rays.len() - 1;
    [&rays[last / 3], &rays[2 * last / 3], &rays[last]]
}

/// Largest depth that matters to an active lane.
#[inline(always)]
unsafe fn farthest<V: Vector>(packet: &Packet) -> f32 {
    // SAFETY: passed on to the caller.
    unsafe {
        let high = V::load(&packet.best[1]);
        high.select(packet.active, V::splat(f32::NEG_INFINITY)).highest()
    }
}
