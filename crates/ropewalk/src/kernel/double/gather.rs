//! What becomes of hits in `f64`: the first, any, all or the first few.

use super::decide::Note;
use crate::kernel::wave::WAVE;

/// What becomes of hits, each a parameter and a triangle.
pub trait Gather {
    /// True if the first hit ends a ray.
    const ANY: bool = false;
    /// Hits of a ray that are known exactly.
    type Known;

    /// Takes a hit of the ray in slot `k`, perhaps not for the first time; hits beyond the parameter that
    /// comes back no longer matter.
    fn take(&mut self, k: usize, hit: (f64, u32)) -> f64;

    /// Where hits behind all of these notes begin not to matter. Notes may be put in order, and repeated
    /// ones left out.
    fn limit(&mut self, notes: &mut Vec<Note>) -> f32;

    /// What slot `k` knows, which is made ready for the next ray.
    fn finish(&mut self, k: usize) -> Self::Known;

    /// Ray `index` has these hits and perhaps some that do not matter.
    fn answer(&mut self, index: usize, known: Self::Known, hits: impl Iterator<Item = (f64, u32)>);

    /// Ray `index` hits nothing.
    fn miss(&mut self, index: usize);
}

/// The nearer of two hits.
fn nearer(a: (f64, u32), b: (f64, u32)) -> (f64, u32) {
    if b.0 < a.0 || (b.0 == a.0 && b.1 < a.1) { b } else { a }
}

/// A miss.
const NO_HIT: (f64, u32) = (f64::INFINITY, u32::MAX);

/// The first hit of each ray.
pub struct Closest<'a> {
    best: [(f64, u32); WAVE],
    t: &'a mut [f64],
    prim_id: &'a mut [u32],
}

impl<'a> Closest<'a> {
    /// Hits go to `t`, infinite for a miss, and `prim_id`, `u32::MAX` for a miss.
    pub fn new(t: &'a mut [f64], prim_id: &'a mut [u32]) -> Self {
        Closest { best: [NO_HIT; WAVE], t, prim_id }
    }
}

impl Gather for Closest<'_> {
    type Known = (f64, u32);

    fn take(&mut self, k: usize, hit: (f64, u32)) -> f64 {
        self.best[k] = nearer(self.best[k], hit);
        self.best[k].0
    }

    #[inline(always)]
    fn limit(&mut self, notes: &mut Vec<Note>) -> f32 {
        notes.last().map_or(f32::INFINITY, |note| note.high)
    }

    #[inline(always)]
    fn finish(&mut self, k: usize) -> (f64, u32) {
        std::mem::replace(&mut self.best[k], NO_HIT)
    }

    #[inline(always)]
    fn answer(&mut self, index: usize, known: (f64, u32), hits: impl Iterator<Item = (f64, u32)>) {
        (self.t[index], self.prim_id[index]) = hits.fold(known, nearer);
    }

    fn miss(&mut self, index: usize) {
        (self.t[index], self.prim_id[index]) = NO_HIT;
    }
}

/// Whether each ray hits anything.
pub struct Any<'a> {
    found: [bool; WAVE],
    hit: &'a mut [bool],
}

impl<'a> Any<'a> {
    /// Answers go to `hit`.
    pub fn new(hit: &'a mut [bool]) -> Self {
        Any { found: [false; WAVE], hit }
    }
}

impl Gather for Any<'_> {
    const ANY: bool = true;
    type Known = bool;

    #[inline(always)]
    fn take(&mut self, k: usize, _hit: (f64, u32)) -> f64 {
        self.found[k] = true;
        f64::NEG_INFINITY
    }

    fn limit(&mut self, _notes: &mut Vec<Note>) -> f32 {
        f32::INFINITY
    }

    #[inline(always)]
    fn finish(&mut self, k: usize) -> bool {
        std::mem::take(&mut self.found[k])
    }

    #[inline(always)]
    fn answer(&mut self, index: usize, known: bool, _hits: impl Iterator<Item = (f64, u32)>) {
        self.hit[index] = known;
    }

    fn miss(&mut self, index: usize) {
        self.hit[index] = false;
    }
}

/// All hits, or the first few.
pub struct Every {
    first: usize,
    /// Hits of each slot that are known exactly.
    known: Vec<Vec<(f64, u32)>>,
    /// Room for upper bounds in order.
    bounds: Vec<f32>,
    row: Vec<(f64, u32)>,
    /// Hits of answered rays.
    hits: Vec<(f64, u32)>,
    /// Where those of each ray begin, and how many there are.
    range: Vec<(usize, usize)>,
}

impl Every {
    /// The first `first` hits of each of some rays.
    pub fn new(first: usize, rays: usize) -> Self {
        let known = vec![Vec::new(); WAVE];
        let (bounds, row, hits) = (Vec::new(), Vec::new(), Vec::new());
        Every { first, known, bounds, row, hits, range: vec![(0, 0); rays] }
    }

    /// The hits of a ray, in order.
    pub fn row(&self, ray: usize) -> &[(f64, u32)] {
        let (start, len) = self.range[ray];
        &self.hits[start..start + len]
    }

    /// Those of each ray.
    pub fn rows(&self) -> impl Iterator<Item = &[(f64, u32)]> {
        (0..self.range.len()).map(|ray| self.row(ray))
    }

    /// Puts hits in the place of those of a ray, no more than there were.
    pub fn shorten(&mut self, ray: usize, hits: impl ExactSizeIterator<Item = (f64, u32)>) {
        let (start, len) = &mut self.range[ray];
        debug_assert!(hits.len() <= *len);
        *len = hits.len();
        self.hits[*start..*start + *len].iter_mut().zip(hits).for_each(|(to, hit)| *to = hit);
    }

    /// Puts the hits of a ray in order, each once, and keeps the first few.
    fn sort(hits: &mut Vec<(f64, u32)>, first: usize) {
        hits.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        hits.dedup_by_key(|hit| hit.1);
        hits.truncate(first);
    }
}

impl Gather for Every {
    type Known = Vec<(f64, u32)>;

    fn take(&mut self, k: usize, hit: (f64, u32)) -> f64 {
        let known = &mut self.known[k];
        known.push(hit);
        if known.len() >= self.first.saturating_mul(2) {
            Self::sort(known, self.first);
            if let Some(last) = known.get(self.first - 1) {
                return last.0;
            }
        }
        f64::INFINITY
    }

    /// The `first`-th upper bound, looked for whenever there are half as many notes more.
    fn limit(&mut self, notes: &mut Vec<Note>) -> f32 {
        let due = self.first.saturating_add(self.first / 2).max(1);
        if notes.len() < due {
            return f32::INFINITY;
        }
        notes.sort_unstable_by_key(|note| note.prim_id);
        notes.dedup_by_key(|note| note.prim_id);
        if notes.len() < self.first {
            return f32::INFINITY;
        }
        self.bounds.clear();
        self.bounds.extend(notes.iter().map(|note| note.high));
        let (_, &mut limit, _) = self.bounds.select_nth_unstable_by(self.first - 1, f32::total_cmp);
        notes.retain(|note| note.low <= limit);
        limit
    }

    #[inline(always)]
    fn finish(&mut self, k: usize) -> Vec<(f64, u32)> {
        std::mem::take(&mut self.known[k])
    }

    fn answer(
        &mut self,
        index: usize,
        known: Vec<(f64, u32)>,
        hits: impl Iterator<Item = (f64, u32)>,
    ) {
        self.row.clear();
        self.row.extend(known.into_iter().chain(hits));
        Self::sort(&mut self.row, self.first);
        self.range[index] = (self.hits.len(), self.row.len());
        self.hits.extend_from_slice(&self.row);
    }

    fn miss(&mut self, index: usize) {
        self.range[index] = (0, 0);
    }
}
