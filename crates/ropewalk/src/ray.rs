//! Rays and hits, and the double-precision form in which every reference kernel computes.
//!
//! Geometry and rays are `f32`. The reference kernels evaluate in `f64` from these inputs and round
//! the resulting `t` once to `f32`, so that hits are compared as `(t, prim_id)` in `f32` and
//! coincident faces tie exactly. See docs/numerics.md.

/// A ray with a closed parameter interval; a hit at `t` is accepted if `t_min <= t <= t_max`.
///
/// `t` is measured in lengths of `dir`, which need not be normalised. A ray with a NaN component,
/// an infinite origin or direction, a zero direction or `t_min > t_max` hits nothing.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start point.
    pub origin: [f32; 3],
    /// Direction, any non-zero length.
    pub dir: [f32; 3],
    /// Smallest accepted parameter.
    pub t_min: f32,
    /// Largest accepted parameter; may be infinite.
    pub t_max: f32,
}

impl Ray {
    /// A ray over `0 ..= infinity`.
    pub const fn new(origin: [f32; 3], dir: [f32; 3]) -> Self {
        Ray { origin, dir, t_min: 0.0, t_max: f32::INFINITY }
    }

    /// The same ray over `t_min ..= t_max`.
    pub const fn with_range(mut self, t_min: f32, t_max: f32) -> Self {
        self.t_min = t_min;
        self.t_max = t_max;
        self
    }

    /// True if the ray can hit something: finite origin, finite non-zero direction, ordered range.
    pub fn is_valid(&self) -> bool {
        let finite = self.origin.iter().chain(&self.dir).all(|x| x.is_finite());
        finite && self.dir != [0.0; 3] && self.t_min <= self.t_max
    }

    /// The point `origin + t * dir`, evaluated in `f64`.
    pub fn at(&self, t: f32) -> [f64; 3] {
        std::array::from_fn(|a| f64::from(self.origin[a]) + f64::from(t) * f64::from(self.dir[a]))
    }
}

/// The nearest accepted crossing of a ray and a primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Parameter in lengths of the ray's direction.
    pub t: f32,
    /// The primitive, as numbered by [`Geometry`](crate::Geometry).
    pub prim_id: u32,
    /// First surface coordinate: barycentric weight of vertex 1 on triangles, else 0.
    pub u: f32,
    /// Second surface coordinate: barycentric weight of vertex 2 on triangles, else 0.
    pub v: f32,
}

impl Hit {
    /// The order of hits along a ray: by `t`, and at equal `t` by the lowest primitive.
    pub fn is_before(&self, other: &Hit) -> bool {
        self.t < other.t || (self.t == other.t && self.prim_id < other.prim_id)
    }
}

/// The frame in which triangles are tested: the ray becomes the third axis (Woop, Benthin, Wald
/// 2013, section 3).
#[derive(Clone, Copy, Debug)]
pub struct Shear {
    /// Axis order; the last is the axis of the largest direction component.
    pub k: [usize; 3],
    /// Origin of the ray in the order of `k`.
    pub origin: [f64; 3],
    /// Shear constants `(dx/dz, dy/dz, 1/dz)`.
    pub shear: [f64; 3],
}

impl Shear {
    /// The frame of a valid ray.
    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        Self::along(&ray.origin, &ray.dir)
    }

    /// The frame of a line with a direction other than zero, `f32` or `f64`.
    #[inline(always)]
    pub fn along<T: Copy + Into<f64>>(origin: &[T; 3], dir: &[T; 3]) -> Self {
        let d = |a: usize| -> f64 { dir[a].into() };
        let kz = usize::from(d(1).abs() > d(0).abs());
        let kz = if d(2).abs() > d(kz).abs() { 2 } else { kz };
        // Swapped where the ray looks down, which keeps the winding.
        let down = usize::from(d(kz) < 0.0);
        let kx = (kz + 1 + down) % 3;
        let ky = (kz + 2 - down) % 3;
        let (dx, dy, dz) = (d(kx), d(ky), d(kz));
        let origin = |a: usize| -> f64 { origin[a].into() };
        Shear {
            k: [kx, ky, kz],
            origin: [origin(kx), origin(ky), origin(kz)],
            shear: [dx / dz, dy / dz, 1.0 / dz],
        }
    }
}

/// A ray made ready for the reference kernels: everything in `f64`.
#[derive(Clone, Copy, Debug)]
pub struct PreparedRay {
    /// Origin.
    pub origin: [f64; 3],
    /// Direction.
    pub dir: [f64; 3],
    /// `1 / dir` per axis; infinite, with the sign of the zero, where `dir` is zero.
    pub inv: [f64; 3],
    /// Smallest accepted parameter.
    pub t_min: f32,
    /// Largest accepted parameter.
    pub t_max: f32,
    /// The frame of the triangle test.
    pub frame: Shear,
}

impl PreparedRay {
    /// Prepares `ray`, or returns `None` where it can hit nothing (see [`Ray::is_valid`]).
    pub fn new(ray: &Ray) -> Option<Self> {
        if !ray.is_valid() {
            return None;
        }
        let origin = ray.origin.map(f64::from);
        let dir = ray.dir.map(f64::from);
        Some(PreparedRay {
            origin,
            dir,
            inv: dir.map(|d| 1.0 / d),
            t_min: ray.t_min,
            t_max: ray.t_max,
            frame: Shear::new(ray),
        })
    }

    /// True if `t`, already rounded to `f32`, lies in the accepted range.
    pub fn accepts(&self, t: f32) -> bool {
        self.t_min <= t && t <= self.t_max
    }
}
