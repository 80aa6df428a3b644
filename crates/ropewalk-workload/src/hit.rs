//! What engines answer, in a form that all of them can fill.

/// The primitive of a miss.
pub const NO_PRIMITIVE: u32 = u32::MAX;

/// A hit or a miss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BenchHit {
    /// Parameter along the ray, whose direction has unit length; infinite for a miss.
    pub t: f32,
    /// The face that was hit; [`NO_PRIMITIVE`] for a miss.
    pub prim: u32,
}

impl BenchHit {
    /// Nothing was hit.
    pub const MISS: BenchHit = BenchHit { t: f32::INFINITY, prim: NO_PRIMITIVE };

    /// True unless it is a miss.
    pub fn is_hit(&self) -> bool {
        self.prim != NO_PRIMITIVE
    }

    /// Order along a ray: by `t`, then by primitive.
    pub fn order(&self, other: &BenchHit) -> std::cmp::Ordering {
        self.t.total_cmp(&other.t).then(self.prim.cmp(&other.prim))
    }
}
