//! What engines answer, in a form that all of them can fill.

pub use ropewalk_workload::{BenchHit, NO_PRIMITIVE};

/// A list of hits for each ray, one list after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct HitLists {
    /// Where the list of ray `i` starts; one more entry than rays.
    pub offsets: Vec<u32>,
    /// All hits.
    pub hits: Vec<BenchHit>,
}

impl HitLists {
    /// No lists yet, with room for those of `rays` rays.
    pub fn with_capacity(rays: usize) -> Self {
        let mut offsets = Vec::with_capacity(rays + 1);
        offsets.push(0);
        HitLists { offsets, hits: Vec::with_capacity(4 * rays) }
    }

    /// Appends the list of the next ray.
    pub fn push(&mut self, hits: &[BenchHit]) {
        self.hits.extend_from_slice(hits);
        self.offsets.push(self.hits.len() as u32);
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
    pub fn of(&self, ray: usize) -> &[BenchHit] {
        &self.hits[self.offsets[ray] as usize..self.offsets[ray + 1] as usize]
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
