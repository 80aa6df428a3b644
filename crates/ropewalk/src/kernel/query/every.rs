//! All hits of each ray in order, or the first few.

#![allow(unsafe_code)]

use super::{BatchQuery, Clear};
use crate::kernel::exact::{At, Exact, Pairs, Sheared, place};
use crate::kernel::level::Simd;
use crate::kernel::order::{hit_of, key, room};
use crate::kernel::slot::Slot;
use crate::ray::{Hit, Ray};
use crate::wide::WIDTH;

/// All hits in order, or the first `k`: by parameter, and at equal parameters by primitive.
///
/// A primitive that several cells reference is found in each; it has the same hit in all of them and
/// is kept once. A ray only takes note of what it hits for sure; exact parameters are worked out for
/// many finished rays at once, eight hits at a time, and then each ray's hits are put in order.
#[derive(Default)]
pub struct Every {
    first: usize,
    /// What each slot has found.
    found: Vec<Found>,
    finished: Finished,
    /// Parameters of hits, ray after ray as they were answered; the first `len` are in use.
    t: Vec<f32>,
    /// Primitives of the same hits.
    prim: Vec<u32>,
    len: usize,
    /// Where each ray's hits stand in `t` and `prim`, and how many there are.
    range: Vec<(usize, u32)>,
    /// Room for upper bounds put in order.
    bounds: (Vec<u64>, Vec<f32>, Vec<u32>),
}

/// The hits of a ray under way.
#[derive(Clone, Default)]
struct Found {
    /// Primitives that are hit for sure; the first `len` are in use.
    id: Vec<u32>,
    /// Where their triangles lie.
    at: Vec<At>,
    /// Upper bounds of their parameters, as bits; only kept for the first `k`.
    high: Vec<u32>,
    len: usize,
    /// Once there are so many, the ray's limit is looked at.
    due: usize,
    /// Keys of the hits whose parameters are known.
    keys: Vec<u64>,
}

/// Rays whose hits are known but not their parameters.
#[derive(Default)]
struct Finished {
    /// The rays, where their hits begin, and how many there are; the first `count` are in use.
    rays: Vec<(Sheared, usize, usize)>,
    count: usize,
    /// Primitives of the hits; the first `len` are in use.
    id: Vec<u32>,
    /// Where their triangles lie.
    at: Vec<At>,
    /// Which of the rays they are hits of.
    owner: Vec<u32>,
    len: usize,
    pairs: Vec<Pairs>,
    keys: Vec<u64>,
}

/// So many hits at least are settled at once: these do not wait for each other.
const PENDING: usize = 64;

/// How many hits a ray has when its limit is first looked at: that is not worth its time if few more
/// are to come.
#[inline(always)]
fn due(first: usize) -> usize {
    first.saturating_add(first / 2)
}

impl Found {
    #[cold]
    fn grow(&mut self) {
        let len = (2 * self.id.len()).max(64);
        self.id.resize(len, 0);
        self.at.resize(len, 0);
        self.high.resize(len, 0);
    }

    fn clear(&mut self, first: usize) {
        if self.id.is_empty() {
            self.grow();
        }
        (self.len, self.due) = (0, due(first));
        self.keys.clear();
    }
}

/// Eight entries of a row.
#[inline(always)]
fn eight(row: &mut [u32], from: usize) -> &mut [u32; WIDTH] {
    (&mut row[from..from + WIDTH]).try_into().expect("eight entries")
}

impl Finished {
    /// Adds the hits of a ray; without a branch, since whether it has any cannot be predicted.
    #[inline(always)]
    fn push(&mut self, slot: &Slot, rays: &[Ray], found: &Found) {
        let (start, owner) = (self.len, self.count);
        if start + room(found.len) + WIDTH > self.id.len() || owner == self.rays.len() {
            self.grow(start + room(found.len) + WIDTH);
        }
        let (ray, from, count) = &mut self.rays[owner];
        ray.set(slot, rays);
        (*from, *count) = (start, found.len);
        // Eight at least, if only to write over them.
        let mut i = 0;
        loop {
            eight(&mut self.id, start + i).copy_from_slice(&found.id[i..i + WIDTH]);
            eight(&mut self.at, start + i).copy_from_slice(&found.at[i..i + WIDTH]);
            eight(&mut self.owner, start + i).fill(owner as u32);
            i += WIDTH;
            if i >= found.len {
                break;
            }
        }
        self.len += found.len;
        self.count += usize::from(found.len > 0);
    }

    #[cold]
    fn grow(&mut self, least: usize) {
        let len = (2 * least).next_multiple_of(WIDTH);
        self.rays.resize(len, (Sheared::default(), 0, 0));
        self.id.resize(len, 0);
        self.at.resize(len, 0);
        self.owner.resize(len, 0);
        self.keys.resize(len, 0);
        self.pairs.resize(len / WIDTH, Pairs::EMPTY);
    }

    /// Works out the keys of all hits.
    ///
    /// # Safety
    /// As for [`BatchQuery::take_clear`].
    #[inline(always)]
    unsafe fn settle<L: Simd>(&mut self, exact: &Exact<'_>) {
        let Some(last) = self.len.checked_sub(1) else { return };
        let groups = self.len.div_ceil(WIDTH);
        let end = groups * WIDTH;
        let (at, owner) = (self.at[last], self.owner[last]);
        self.at[last..end].fill(at);
        self.owner[last..end].fill(owner);
        let (at, owner) = (&self.at[..end], &self.owner[..end]);
        for (i, pairs) in self.pairs[..groups].iter_mut().enumerate() {
            for lane in 0..WIDTH {
                let (at, owner) = (at[i * WIDTH + lane], owner[i * WIDTH + lane]);
                pairs.set(lane, &self.rays[owner as usize].0, exact.lines, at);
            }
        }
        let rows = self.keys[..end].chunks_exact_mut(WIDTH).zip(self.id[..end].chunks_exact(WIDTH));
        for (i, (keys, id)) in rows.enumerate() {
            let mut t = [0.0; WIDTH];
            // SAFETY: passed on to the caller.
            let mut open = unsafe { self.pairs[i].meet::<L::Doubles>(&mut t) };
            while open != 0 {
                let lane = open.trailing_zeros() as usize;
                open &= open - 1;
                let (at, owner) = (at[i * WIDTH + lane], owner[i * WIDTH + lane]);
                let hit = exact.hit(self.rays[owner as usize].0.ray, at);
                debug_assert!(hit.is_some() || exact.lines.is_shared(), "a clear hit is a hit");
                t[lane % WIDTH] = hit.map_or(f32::INFINITY, |hit| hit.t);
            }
            for lane in 0..WIDTH {
                keys[lane] = key(t[lane], id[lane]);
            }
        }
    }
}

impl Every {
    /// Makes ready for the first `first` hits of `rays` rays, at least one, through `slots` slots.
    pub fn start(&mut self, first: usize, rays: usize, slots: usize) {
        self.first = first;
        self.len = 0;
        (self.finished.len, self.finished.count) = (0, 0);
        self.found.resize(slots, Found::default());
        self.found.iter_mut().for_each(|found| found.clear(first));
        self.range.resize(rays, (0, 0));
    }

    /// How many rays there are.
    pub fn rays(&self) -> usize {
        self.range.len()
    }

    /// For how many hits there is room.
    pub fn room(&self) -> usize {
        self.t.len()
    }

    /// How many hits there are in all.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Writes the hits of ray after ray to arrays of [`Every::len`] entries, and where each ray's end,
    /// counted from `offset`.
    pub fn copy(&self, offset: usize, ends: &mut [usize], t: &mut [f32], prim: &mut [u32]) {
        let mut to = 0;
        for (&(from, count), end) in self.range.iter().zip(ends) {
            let count = count as usize;
            if count <= WIDTH && to + WIDTH <= t.len() {
                // Eight at a time whatever their number: the next ones write over the rest.
                t[to..to + WIDTH].copy_from_slice(&self.t[from..from + WIDTH]);
                prim[to..to + WIDTH].copy_from_slice(&self.prim[from..from + WIDTH]);
            } else {
                t[to..to + count].copy_from_slice(&self.t[from..from + count]);
                prim[to..to + count].copy_from_slice(&self.prim[from..from + count]);
            }
            to += count;
            *end = offset + to;
        }
    }

    /// Makes room for `more` hits in order.
    #[inline(always)]
    fn reserve(&mut self, more: usize) {
        let least = self.len + room(more) + WIDTH;
        if least > self.t.len() {
            self.t.resize(2 * least, 0.0);
            self.prim.resize(2 * least, 0);
        }
    }

    /// Answers the rays that have finished.
    ///
    /// # Safety
    /// As for [`BatchQuery::take_clear`].
    #[inline(always)]
    unsafe fn answer<L: Simd>(&mut self, exact: &Exact<'_>) {
        // SAFETY: passed on to the caller.
        unsafe { self.finished.settle::<L>(exact) };
        self.reserve(self.finished.len);
        let Finished { rays, count, keys, .. } = &mut self.finished;
        for &(ray, start, count) in &rays[..std::mem::take(count)] {
            let keys = &mut keys[start..start + count];
            let (t, prim) = (&mut self.t[self.len..], &mut self.prim[self.len..]);
            // SAFETY: passed on to the caller.
            let count = unsafe { L::order(keys, t, prim) }.min(self.first);
            self.range[ray.ray as usize] = (self.len, count as u32);
            self.len += count;
        }
        self.finished.len = 0;
    }

    /// Answers a ray with hits whose parameters are known: all its hits are worked out one by one.
    #[cold]
    fn answer_known(&mut self, k: usize, ray: u32, exact: &Exact<'_>) {
        let Found { at, keys, len, .. } = &mut self.found[k];
        for &at in &at[..*len] {
            let hit = exact.hit(ray, at);
            debug_assert!(hit.is_some() || exact.lines.is_shared(), "a clear hit is a hit");
            keys.extend(hit.map(|hit| key(hit.t, hit.prim_id)));
        }
        keys.sort_unstable();
        keys.dedup();
        keys.truncate(self.first);
        let count = keys.len();
        self.reserve(count);
        self.range[ray as usize] = (self.len, count as u32);
        for &key in &self.found[k].keys {
            (self.t[self.len], self.prim[self.len]) = hit_of(key);
            self.len += 1;
        }
        self.found[k].clear(self.first);
    }

    /// Lowers the limit to the `first`-th upper bound of those that are hit for sure.
    ///
    /// # Safety
    /// As for [`BatchQuery::take_clear`].
    #[inline(always)]
    unsafe fn limit<L: Simd>(&mut self, k: usize, slot: &mut Slot) {
        let found = &mut self.found[k];
        let (keys, t, prim) = &mut self.bounds;
        let n = found.len;
        if keys.len() < room(n) {
            keys.resize(room(n), 0);
            t.resize(room(n), 0.0);
            prim.resize(room(n), 0);
        }
        // The bounds follow from ray and triangle alone: those of a repeated one are equal.
        for ((key_of, &high), &id) in keys.iter_mut().zip(&found.high[..n]).zip(&found.id) {
            *key_of = key(f32::from_bits(high), id);
        }
        // SAFETY: passed on to the caller.
        let distinct = unsafe { L::order(&mut keys[..n], t, prim) };
        if distinct < self.first {
            found.due = n + self.first - distinct;
            return;
        }
        slot.limit = slot.limit.min(t[self.first - 1]);
        found.due = n + (self.first / 4).max(1);
    }
}

impl BatchQuery for Every {
    const ANY: bool = false;
    const MANY: bool = true;

    #[inline(always)]
    unsafe fn take_clear<L: Simd>(
        &mut self,
        k: usize,
        slot: &mut Slot,
        hits: &Clear<'_>,
        _exact: &Exact<'_>,
    ) -> u32 {
        let found = &mut self.found[k];
        let n = found.len;
        if n + WIDTH > found.id.len() {
            found.grow();
        }
        let places = std::array::from_fn(|lane| place(hits.line, lane));
        // Both sides of a clear lane can be hit, so that its id has no other bits.
        // SAFETY: passed on to the caller.
        unsafe {
            L::keep(hits.lanes, &hits.block.id, eight(&mut found.id, n));
            L::keep(hits.lanes, &places, eight(&mut found.at, n));
            if self.first != usize::MAX {
                let high = hits.range.high.map(f32::to_bits);
                L::keep(hits.lanes, &high, eight(&mut found.high, n));
            }
            found.len += hits.lanes.count_ones() as usize;
            if found.len >= found.due {
                self.limit::<L>(k, slot);
            }
        }
        0
    }

    fn take(&mut self, k: usize, slot: &mut Slot, hit: &Hit, _exact: &Exact<'_>) {
        let keys = &mut self.found[k].keys;
        keys.push(key(hit.t, hit.prim_id));
        if keys.len() >= self.first.saturating_mul(2) {
            keys.sort_unstable();
            keys.dedup();
            keys.truncate(self.first);
            if let Some(&last) = keys.get(self.first - 1) {
                slot.limit = slot.limit.min(hit_of(last).0);
            }
        }
    }

    #[inline(always)]
    fn finish(&mut self, k: usize, slot: &mut Slot, exact: &Exact<'_>) {
        let found = &mut self.found[k];
        if !found.keys.is_empty() {
            return self.answer_known(k, slot.ray, exact);
        }
        self.range[slot.ray as usize] = (0, 0);
        self.finished.push(slot, exact.rays, found);
        (found.len, found.due) = (0, due(self.first));
    }

    fn miss(&mut self, index: usize) {
        self.range[index] = (0, 0);
    }

    #[inline(always)]
    unsafe fn settle<L: Simd>(&mut self, exact: &Exact<'_>, all: bool) {
        if self.finished.len >= PENDING || all {
            // SAFETY: passed on to the caller.
            unsafe { self.answer::<L>(exact) };
        }
    }
}
