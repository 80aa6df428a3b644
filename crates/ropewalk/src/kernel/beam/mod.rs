//! The beam: rays that keep together walk the tree together.
//!
//! ```text
//! group    128, 64 or 16 rays in turn that have like directions and either meet in one point (an eye, a
//!          light) or are parallel: two numbers tell them apart. Of 64 rays, those that are unlike the
//!          first are a beam of their own, as behind a silhouette
//! walk     intervals of these numbers bound where the rays cross a plane, so one step serves all
//! test     in a leaf, 8 triangles at a time are projected into the group's frame, where edge functions
//!          are linear in the two numbers; pairs of a triangle and a packet of 16 rays that have nothing
//!          to do with each other are dropped, two packets at a time, then one by one without a branch;
//!          each of the others is tested with 16 rays at once
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
pub use vector::{Doubles, Pair, Vector};
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
use facets::{Couple, Facets};
use frame::{ALL, Frame, NONE, Packet, RAYS};
use settle::Corners;
use shaft::Stack;
use std::ops::Range;

/// Packets of a beam.
const PACKETS: usize = 8;

/// Packets of a beam of medium size.
const HALF: usize = 4;

/// Sizes of beams: one packet, up to [`HALF`], up to [`PACKETS`].
const SMALL: usize = 0;
const MEDIUM: usize = 1;
const LARGE: usize = 2;

/// Most packets of a beam of the next smaller size.
const FEWER: [usize; 3] = [0, 1, HALF];

/// What a ray of a beam of each size may cost, in units of [`Beams::spent`].
const BUDGET: [u32; 3] = [20, 20, 10];

/// The size of a beam of so many packets.
#[inline(always)]
fn size(packets: usize) -> usize {
    usize::from(packets > FEWER[MEDIUM]) + usize::from(packets > FEWER[LARGE])
}

/// Most beams of a size that are skipped in a row.
const LONGEST: u32 = 64;

/// Most groups of [`PACKETS`] packets in a row at which nothing looks at all.
const LONGEST_GROUPS: u32 = 16;

/// Cells behind the next that are asked for after a step.
const AHEAD: usize = 2;

/// Fewest rays of a packet that are worth a beam.
const FEWEST: u32 = 4;

/// Fewest rays of several packets that are worth a beam.
const FEWEST_MIXED: u32 = 10;

/// Most beams that rays of the same packets are divided into.
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
        let seen = self.packets[at] & u8::from(self.id[at] == prim_id).wrapping_neg();
        (self.id[at], self.packets[at]) = (prim_id, seen | 1 << k);
        seen >> k & 1 == 0
    }
}

/// A query that beams can answer: each ray has one answer.
pub trait BeamQuery: BatchQuery {
    /// Takes the answers of some lanes, which stand at `first` and behind: parameters and primitives, infinite and [`NONE`]
    /// for misses. Any-hit queries look at the primitives only.
    fn answer(&mut self, first: u32, lanes: u32, t: &[f32; RAYS], prim_id: &[u32; RAYS]);

    /// Lets `walk` put the same question to rays that have been moved, and answers them where they
    /// stood.
    fn ask_moved(&mut self, stood: &[u32], answers: &mut Answers, walk: impl Walk);
}

/// A walk that any query may be put to.
pub trait Walk {
    /// Answers all rays.
    fn walk<Q: BeamQuery>(self, query: &mut Q);
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
    fn answer(&mut self, first: u32, lanes: u32, t: &[f32; RAYS], prim_id: &[u32; RAYS]) {
        let first = first as usize;
        if lanes == ALL {
            self.t[first..first + RAYS].copy_from_slice(t);
            self.prim[first..first + RAYS].copy_from_slice(prim_id);
            return;
        }
        for lane in (0..RAYS).filter(|lane| lanes >> lane & 1 == 1) {
            self.t[first + lane] = t[lane];
            self.prim[first + lane] = prim_id[lane];
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
    fn answer(&mut self, first: u32, lanes: u32, _t: &[f32; RAYS], prim_id: &[u32; RAYS]) {
        let first = first as usize;
        if lanes == ALL {
            let hit = &mut self.hit[first..first + RAYS];
            for (hit, &prim_id) in hit.iter_mut().zip(prim_id) {
                *hit = prim_id != NONE;
            }
            return;
        }
        for lane in (0..RAYS).filter(|lane| lanes >> lane & 1 == 1) {
            self.hit[first + lane] = prim_id[lane] != NONE;
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
    /// Rays of a picture in rows that were moved into tiles first, whichever way they went then.
    pub tiled_rays: u64,
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
            tiled_rays: self.tiled_rays + other.tiled_rays,
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
    couples: [Couple; PACKETS / 2],
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
            couples: [Couple::EMPTY; PACKETS / 2],
            facets: Facets::EMPTY,
            corners: Corners::EMPTY,
            tested: Mailboxes::EMPTY,
        }
    }
}

/// Whether beams of a size are tried: after each that was too wide, twice as many are skipped.
#[derive(Clone, Copy)]
struct Patience {
    skip: u32,
    next: u32,
    longest: u32,
}

impl Patience {
    const NEW: Patience = Patience { skip: 0, next: 1, longest: LONGEST };

    fn tries(&mut self) -> bool {
        let tries = self.skip == 0;
        self.skip = self.skip.saturating_sub(1);
        tries
    }

    fn learn(&mut self, done: bool) {
        if done {
            self.next = (self.next / 2).max(1);
        } else {
            (self.skip, self.next) = (self.next, (2 * self.next).min(self.longest));
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
    /// By size.
    patience: [Patience; 3],
    /// Where the rays of a beam have met of late, and the share of the reach by which they missed it.
    met: Option<([f32; 3], f32)>,
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
    let patience = [Patience::NEW; 3];
    let mut beams = Beams { tree, exact, query, room, left, report, patience, met: None };
    let mut groups = Patience { longest: LONGEST_GROUPS, ..Patience::NEW };
    for first in (0..rays.len()).step_by(PACKETS * RAYS) {
        let range = first..rays.len().min(first + PACKETS * RAYS);
        if !groups.tries() {
            beams.left.extend(range.start as u32..range.end as u32);
            continue;
        }
        let answered = beams.report.beam_rays;
        // SAFETY: passed on to the caller.
        unsafe { beams.group::<L>(range) };
        groups.learn(beams.report.beam_rays > answered);
    }
    beams.report
}

impl<Q: BeamQuery> Beams<'_, Q> {
    /// Tries up to 128 rays as one beam, else each 64 of them, else each sixteen.
    #[inline(always)]
    unsafe fn group<L: BeamSimd>(&mut self, range: Range<usize>) {
        let end = range.end;
        // SAFETY: passed on to the caller.
        unsafe {
            if self.packets::<L>(range.clone()) {
                return;
            }
            for first in range.step_by(HALF * RAYS) {
                let end = end.min(first + HALF * RAYS);
                if self.mixed::<L>(first..end) {
                    continue;
                }
                for first in (first..end).step_by(RAYS) {
                    let end = end.min(first + RAYS);
                    self.packet::<L>(&self.exact.rays[first..end], first);
                }
            }
        }
    }

    /// Answers many packets of rays as one beam if all of them are alike.
    ///
    /// A few rays are looked at before any are put side by side, so that incoherent batches lose
    /// next to nothing here.
    #[inline(always)]
    unsafe fn packets<L: BeamSimd>(&mut self, range: Range<usize>) -> bool {
        let rays = &self.exact.rays[range.clone()];
        if rays.len() <= FEWER[LARGE] * RAYS {
            return false;
        }
        let Some(frame) = Frame::of(&rays[0]) else { return false };
        sample(rays).iter().all(|ray| frame.fits(ray))
            && self.patience[LARGE].tries()
            // SAFETY: passed on to the caller.
            && unsafe { self.load::<L>(frame, rays, range.start) }
    }

    /// Answers some packets of rays as one beam, or several that share packets, as where a silhouette passes between them;
    /// false if they are not worth it.
    #[inline(always)]
    unsafe fn mixed<L: BeamSimd>(&mut self, range: Range<usize>) -> bool {
        let rays = &self.exact.rays[range.clone()];
        if rays.len() <= FEWER[MEDIUM] * RAYS {
            return false;
        }
        let Some(frame) = Frame::of(&rays[0]) else { return false };
        if !sample(rays).iter().any(|ray| frame.fits(ray)) || !self.patience[MEDIUM].tries() {
            return false;
        }
        let (mut rest, mut left) = ([0; HALF], [0; HALF]);
        let (count, mut any) = (rays.len().div_ceil(RAYS), false);
        for (i, rays) in rays.chunks(RAYS).enumerate() {
            self.room.packets[i].load(rays, (range.start + i * RAYS) as u32);
            rest[i] = self.room.packets[i].lanes;
        }
        for _ in 0..LEADERS {
            let Some(k) = rest.iter().position(|&rest| rest != 0) else { break };
            let lane = rest[k].trailing_zeros();
            let Some(frame) = Frame::of(&rays[k * RAYS + lane as usize]) else { break };
            let (mut lanes, mut alike) = ([0; HALF], 0);
            for (i, packet) in self.room.packets[..count].iter_mut().enumerate() {
                packet.lanes = rest[i];
                // SAFETY: passed on to the caller.
                lanes[i] = unsafe { packet.like::<L::Rays>(&frame) };
                packet.lanes = lanes[i];
                alike += lanes[i].count_ones();
            }
            // SAFETY: passed on to the caller.
            let cast = alike >= FEWEST_MIXED && unsafe { self.cast::<L>(frame, count) };
            any |= cast;
            lanes[k] |= 1 << lane;
            for i in 0..count {
                rest[i] &= !lanes[i];
                if !cast {
                    left[i] |= lanes[i];
                }
            }
        }
        for i in 0..count {
            self.leave(range.start + i * RAYS, rest[i] | left[i]);
        }
        if !any {
            self.patience[MEDIUM].learn(false);
        }
        true
    }

    /// Answers the rays of some packets if they are alike.
    #[inline(always)]
    unsafe fn load<L: BeamSimd>(&mut self, frame: Frame, rays: &[Ray], first: usize) -> bool {
        // All are put side by side before any are looked at: vectors are not read while they are written number by number.
        for (i, rays) in rays.chunks(RAYS).enumerate() {
            self.room.packets[i].load(rays, (first + i * RAYS) as u32);
        }
        for packet in &mut self.room.packets[..rays.len().div_ceil(RAYS)] {
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
        if Frame::of(&rays[0]).is_none_or(|frame| !alike(frame)) || !self.patience[SMALL].tries() {
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
            let fitted = frame.fit::<L::Rays>(packets, self.tree.bounds(), &mut self.met);
            let Some(mut frame) = fitted else { return false };
            frame.place::<L::Rays>(packets);
            self.room.tested = Mailboxes::EMPTY;
            let done = self.divide::<L>(&frame, 0..count);
            for k in 0..count {
                self.finish::<L>(&frame, k, done >> k & 1 == 1);
            }
            true
        }
    }

    /// Walks the tree with some packets together, or where they are too wide with parts of them; returns the packets that
    /// got to their end. What packets have found and tested together stands.
    #[inline(always)]
    unsafe fn divide<L: BeamSimd>(&mut self, frame: &Frame, range: Range<usize>) -> u32 {
        let size = size(range.len());
        // SAFETY: passed on to the caller.
        let all = unsafe { L::walk(self, frame, range.clone()) };
        self.patience[size].learn(all);
        if all {
            return ((1 << range.len()) - 1) << range.start;
        }
        let mut done = 0;
        for start in range.clone().step_by(FEWER[size].max(1)) {
            let part = start..range.end.min(start + FEWER[size]);
            if part.len() > 1 && self.patience[MEDIUM].tries() {
                // SAFETY: passed on to the caller.
                let all = unsafe { L::walk(self, frame, part.clone()) };
                self.patience[MEDIUM].learn(all);
                if all {
                    done |= ((1 << part.len()) - 1) << part.start;
                    continue;
                }
            }
            for k in part {
                if self.patience[SMALL].tries() {
                    // SAFETY: passed on to the caller.
                    let all = unsafe { L::walk(self, frame, k..k + 1) };
                    self.patience[SMALL].learn(all);
                    done |= u32::from(all) << k;
                }
            }
        }
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
            for (k, p) in range.clone().zip(packets) {
                for i in 0..2 {
                    radius[i] = radius[i].max(p.middle[i].abs() + p.radius[i]);
                }
                nearest = nearest.min(p.nearest);
                p.farthest = farthest::<L::Rays>(p);
                self.room.couples[k / 2].set(k % 2, p);
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
            let end = self.spent() + u64::from(BUDGET[size(range.len())] * rays);
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

    /// Tests a leaf; true if a ray may have found something.
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
                let (mut clear, mut edge_on) = (0u64, 0u64);
                for couple in range.start / 2..range.end.div_ceil(2) {
                    let facing =
                        self.room.facets.facing::<L::Rays>(&self.room.couples[couple], enter);
                    clear |= u64::from(facing.clear) << (2 * WIDTH * couple);
                    edge_on |= u64::from(facing.edge_on) << (2 * WIDTH * couple);
                }
                let of = !0u64 << (WIDTH * range.start) & !0u64 >> (64 - WIDTH * range.end);
                let mut changed = self.test::<L>(frame, block, line, clear & of);
                if edge_on & of != 0 {
                    changed |= self.test_edge_on::<L>(frame, block, line, edge_on & of);
                }
                found |= changed != 0;
                while changed != 0 {
                    let k = changed.trailing_zeros() as usize;
                    changed &= changed - 1;
                    let packet = &mut self.room.packets[k];
                    packet.farthest = farthest::<L::Rays>(packet);
                    self.room.couples[k / 2].set_farthest(k % 2, packet);
                }
            }
            found
        }
    }

    /// Tests triangles of the block that is projected with packets, [`WIDTH`] bits a packet; returns the packets that may have
    /// found something.
    ///
    /// Most pairs of triangle and packet have nothing to do with each other. They are sorted out without a branch, which would
    /// be guessed wrong every other time.
    #[inline(always)]
    unsafe fn test<L: BeamSimd>(
        &mut self,
        frame: &Frame,
        block: &Block,
        line: usize,
        mut pairs: u64,
    ) -> u32 {
        // SAFETY: passed on to the caller.
        unsafe {
            let (mut touched, mut count) = ([0u8; PACKETS * WIDTH], 0);
            while pairs != 0 {
                let pair = pairs.trailing_zeros() as usize;
                pairs &= pairs - 1;
                let (k, i) = (pair / WIDTH, pair % WIDTH);
                let is_new = self.room.tested.is_new(block.id[i] & ID_MASK, k);
                let lanes = self.room.facets.touched::<L::Rays>(i, &self.room.packets[k]);
                self.report.tests += u64::from(is_new);
                touched[count] = pair as u8;
                count += usize::from(is_new & (lanes != 0));
            }
            let mut changed = 0;
            for &pair in &touched[..count] {
                let (k, i) = (usize::from(pair) / WIDTH, usize::from(pair) % WIDTH);
                let (facets, packet) = (&self.room.facets, &mut self.room.packets[k]);
                let at = place(line, i);
                let verdict = facets.test::<L::Rays, Q>(i, at, block.id[i] & ID_MASK, packet);
                changed |= u32::from(verdict.hit | verdict.open != 0) << k;
                if verdict.open != 0 {
                    self.decide::<L>(frame, k, verdict.open, at);
                }
            }
            changed
        }
    }

    /// The same for triangles that may be seen edge-on.
    #[inline(always)]
    unsafe fn test_edge_on<L: BeamSimd>(
        &mut self,
        frame: &Frame,
        block: &Block,
        line: usize,
        mut pairs: u64,
    ) -> u32 {
        // SAFETY: passed on to the caller.
        unsafe {
            let mut changed = 0;
            while pairs != 0 {
                let pair = pairs.trailing_zeros() as usize;
                pairs &= pairs - 1;
                let (k, i) = (pair / WIDTH, pair % WIDTH);
                if !self.room.tested.is_new(block.id[i] & ID_MASK, k) {
                    continue;
                }
                self.report.tests += 1;
                let verdict = self.room.facets.test_edge_on::<L::Rays>(i, &self.room.packets[k]);
                changed |= u32::from(verdict.open != 0) << k;
                if verdict.open != 0 {
                    self.decide::<L>(frame, k, verdict.open, place(line, i));
                }
            }
            changed
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
                if let Some(found) = self.exact.hit(packet.first + lane as u32, at) {
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
                        self.exact.hit(packet.first + lane as u32, old).map(|hit| hit.t)
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
        let first = packet.first;
        let denied;
        if Q::ANY {
            let state = |lane: usize| if packet.active >> lane & 1 == 1 { NONE } else { 0 };
            let found = std::array::from_fn(state);
            denied = if done { 0 } else { packet.active };
            self.query.answer(first, packet.lanes & !denied, &[0.0; RAYS], &found);
        } else if done {
            let corners = &mut self.room.corners;
            // SAFETY: passed on to the caller.
            let (t, prim_id, wrong) =
                unsafe { L::settle(packet, corners, &self.exact, frame.axis) };
            let altered = wrong != 0 && self.exact.lines.is_shared();
            debug_assert!(wrong == 0 || altered, "f32 was certain of a hit that is none");
            denied = wrong;
            self.query.answer(first, packet.lanes & !denied, &t, &prim_id);
        } else {
            denied = packet.lanes;
        }
        self.report.beam_rays += u64::from((packet.lanes & !denied).count_ones());
        self.leave(first as usize, denied);
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
