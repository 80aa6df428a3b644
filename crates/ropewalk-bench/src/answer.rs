//! What engines answer, in a form that all of them can fill.

pub use ropewalk_workload::{BenchHit, NO_PRIMITIVE};

/// A list of hits for each ray, one list after the other, as arrays that an engine writes over: it is for none of them that memory is
/// asked for anew in each call.
#[derive(Clone, Debug, PartialEq)]
pub struct HitLists {
    /// Where the list of ray `i` starts; one more entry than rays.
    pub offsets: Vec<usize>,
    /// Parameters of all hits.
    pub t: Vec<f32>,
    /// Primitives of all hits.
    pub prim: Vec<u32>,
}

impl Default for HitLists {
    fn default() -> Self {
        HitLists::new()
    }
}

impl HitLists {
    /// No lists.
    pub fn new() -> Self {
        HitLists { offsets: vec![0], t: Vec::new(), prim: Vec::new() }
    }

    /// Removes all lists and keeps their memory.
    pub fn clear(&mut self) {
        self.offsets.truncate(1);
        self.t.clear();
        self.prim.clear();
    }

    /// Appends the list of the next ray.
    pub fn push(&mut self, hits: &[BenchHit]) {
        self.t.extend(hits.iter().map(|hit| hit.t));
        self.prim.extend(hits.iter().map(|hit| hit.prim));
        self.offsets.push(self.t.len());
    }

    /// Appends the list of the next ray from unordered hits: sorts them, drops repeated
    /// primitives, and keeps at most `limit`. `found` is left empty.
    pub fn push_unordered(&mut self, found: &mut Vec<BenchHit>, limit: usize) {
        found.sort_unstable_by(BenchHit::order);
        found.dedup_by_key(|h| h.prim);
        self.push(&found[..found.len().min(limit)]);
        found.clear();
    }

    /// The hits of a ray in order.
    pub fn of(&self, ray: usize) -> Vec<BenchHit> {
        let range = self.offsets[ray]..self.offsets[ray + 1];
        range.map(|i| BenchHit { t: self.t[i], prim: self.prim[i] }).collect()
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    /// True if there are no rays.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
