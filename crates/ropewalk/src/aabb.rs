//! Axis-aligned boxes in `f32`, with areas in `f64`.

/// A closed axis-aligned box. Flat boxes (zero extent on some axes) are valid boxes; a box with
/// `min > max` on any axis is empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lower corner.
    pub min: [f32; 3],
    /// Upper corner.
    pub max: [f32; 3],
}

impl Aabb {
    /// The empty box: neutral for [`Aabb::union`].
    pub const EMPTY: Aabb = Aabb { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

    /// A box from its two corners; `min` must not exceed `max` unless an empty box is meant.
    pub const fn new(min: [f32; 3], max: [f32; 3]) -> Self {
        Aabb { min, max }
    }

    /// The smallest box around `points`.
    pub fn from_points(points: impl IntoIterator<Item = [f32; 3]>) -> Self {
        points.into_iter().fold(Aabb::EMPTY, Aabb::extended)
    }

    /// True if the box holds no point at all.
    pub fn is_empty(&self) -> bool {
        (0..3).any(|a| self.min[a] > self.max[a])
    }

    /// The smallest box around this one and `point`.
    pub fn extended(mut self, point: [f32; 3]) -> Self {
        for a in 0..3 {
            self.min[a] = self.min[a].min(point[a]);
            self.max[a] = self.max[a].max(point[a]);
        }
        self
    }

    /// The smallest box around both.
    pub fn union(&self, other: &Aabb) -> Self {
        self.extended(other.min).extended(other.max)
    }

    /// The common part, or an empty box.
    pub fn intersection(&self, other: &Aabb) -> Self {
        let mut out = *self;
        for a in 0..3 {
            out.min[a] = out.min[a].max(other.min[a]);
            out.max[a] = out.max[a].min(other.max[a]);
        }
        out
    }

    /// The box with each side moved outwards by `margin`; an empty box stays empty.
    pub fn grown(mut self, margin: f32) -> Self {
        if self.is_empty() {
            return self;
        }
        for a in 0..3 {
            self.min[a] -= margin;
            self.max[a] += margin;
        }
        self
    }

    /// True if `point` lies in the closed box.
    pub fn contains_point(&self, point: [f32; 3]) -> bool {
        (0..3).all(|a| self.min[a] <= point[a] && point[a] <= self.max[a])
    }

    /// True if `other` lies wholly in this box; every box contains the empty box.
    pub fn contains(&self, other: &Aabb) -> bool {
        other.is_empty()
            || (0..3).all(|a| self.min[a] <= other.min[a] && other.max[a] <= self.max[a])
    }

    /// Length of the box along `axis`, exact for finite corners.
    pub fn extent(&self, axis: usize) -> f64 {
        f64::from(self.max[axis]) - f64::from(self.min[axis])
    }

    /// Surface area of all six faces (0 for an empty box; twice the face for a flat one).
    pub fn area(&self) -> f64 {
        if self.is_empty() {
            return 0.0;
        }
        let [x, y, z] = [self.extent(0), self.extent(1), self.extent(2)];
        2.0 * (x * y + y * z + z * x)
    }

    /// Area of one face perpendicular to `axis`: `a_c`, the one-sided area of a cut.
    pub fn face_area(&self, axis: usize) -> f64 {
        self.extent((axis + 1) % 3) * self.extent((axis + 2) % 3)
    }

    /// The two parts below and above the plane `axis = pos`; both contain the plane.
    pub fn split(&self, axis: usize, pos: f32) -> (Aabb, Aabb) {
        let (mut lo, mut hi) = (*self, *self);
        lo.max[axis] = pos;
        hi.min[axis] = pos;
        (lo, hi)
    }

    /// Length of the diagonal.
    pub fn diagonal(&self) -> f64 {
        (0..3).map(|a| self.extent(a).powi(2)).sum::<f64>().sqrt()
    }
}
