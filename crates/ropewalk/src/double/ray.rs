//! Rays and hits in `f64`.

/// A ray with a closed parameter interval; a hit at `t` is accepted if `t_min <= t <= t_max`.
///
/// `t` is measured in lengths of `dir`, which need not be normalised. A ray with a NaN component, an
/// infinite origin or direction, a zero direction or `t_min > t_max` hits nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoubleRay {
    /// Start point.
    pub origin: [f64; 3],
    /// Direction, any non-zero length.
    pub dir: [f64; 3],
    /// Smallest accepted parameter.
    pub t_min: f64,
    /// Largest accepted parameter; may be infinite.
    pub t_max: f64,
}

impl DoubleRay {
    /// A ray over `0 ..= infinity`.
    pub const fn new(origin: [f64; 3], dir: [f64; 3]) -> Self {
        DoubleRay { origin, dir, t_min: 0.0, t_max: f64::INFINITY }
    }

    /// The same ray over `t_min ..= t_max`.
    pub const fn with_range(mut self, t_min: f64, t_max: f64) -> Self {
        self.t_min = t_min;
        self.t_max = t_max;
        self
    }

    /// True if the ray can hit something: finite origin, finite non-zero direction, ordered range.
    pub fn is_valid(&self) -> bool {
        let finite = self.origin.iter().chain(&self.dir).all(|x| x.is_finite());
        finite && self.dir != [0.0; 3] && self.t_min <= self.t_max
    }
}

/// A crossing of a ray and a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoubleHit {
    /// Parameter in lengths of the ray's direction.
    pub t: f64,
    /// The triangle, as numbered by [`DoubleGeometry`](super::DoubleGeometry).
    pub prim_id: u32,
    /// Barycentric weight of vertex 1.
    pub u: f64,
    /// Barycentric weight of vertex 2.
    pub v: f64,
}

impl DoubleHit {
    /// The order of hits along a ray: by `t`, and at equal `t` by the lowest primitive.
    pub fn is_before(&self, other: &DoubleHit) -> bool {
        self.t < other.t || (self.t == other.t && self.prim_id < other.prim_id)
    }

    /// Puts the hits of one ray in order, each once.
    pub(crate) fn sort(hits: &mut Vec<DoubleHit>) {
        hits.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(a.prim_id.cmp(&b.prim_id)));
        hits.dedup_by_key(|hit| hit.prim_id);
    }
}
