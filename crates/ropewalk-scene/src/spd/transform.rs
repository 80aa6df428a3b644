//! Points, vectors and affine transforms of the generators, in double precision.
//!
//! The databases are defined by their printed coordinates, and some of these are what rounding
//! left of a zero. Sums are therefore taken in one fixed order (x, y, z, translation).

/// A point, a direction or a colour.
pub(super) type Vec3 = [f64; 3];

/// `a + b`.
pub(super) fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// The cross product.
pub(super) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The Euclidean length.
pub(super) fn length(v: Vec3) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

/// `v` with unit length; the zero vector stays what it is.
pub(super) fn normalized(v: Vec3) -> Vec3 {
    let length = length(v);
    if length > 0.0 { v.map(|x| x / length) } else { v }
}

/// An axis of the coordinate system.
#[derive(Clone, Copy)]
pub(super) enum Axis {
    X,
    Y,
    Z,
}

/// An affine map of row vectors: the first three rows are the images of the axes, the last is the
/// image of the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Affine {
    rows: [Vec3; 4],
}

impl Affine {
    pub(super) const IDENTITY: Affine = Affine::scaling(1.0);

    /// Uniform scaling about the origin.
    pub(super) const fn scaling(factor: f64) -> Affine {
        Affine {
            rows: [[factor, 0.0, 0.0], [0.0, factor, 0.0], [0.0, 0.0, factor], [0.0, 0.0, 0.0]],
        }
    }

    /// Translation by `offset`.
    pub(super) const fn translation(offset: Vec3) -> Affine {
        let [x, y, z, _] = Affine::IDENTITY.rows;
        Affine { rows: [x, y, z, offset] }
    }

    /// Rotation about a coordinate axis, counter-clockwise seen from its tip, in radians.
    pub(super) fn rotation(axis: Axis, angle: f64) -> Affine {
        let (s, c) = (angle.sin(), angle.cos());
        let [x, y, z] = match axis {
            Axis::X => [[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]],
            Axis::Y => [[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]],
            Axis::Z => [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]],
        };
        Affine { rows: [x, y, z, [0.0; 3]] }
    }

    /// Rotation about the unit vector `axis`, in radians.
    pub(super) fn rotation_about(axis: Vec3, angle: f64) -> Affine {
        let (s, c) = (angle.sin(), angle.cos());
        let (d, [x, y, z]) = (1.0 - c, axis);
        Affine {
            rows: [
                [x * x + (1.0 - x * x) * c, x * y * d + z * s, x * z * d - y * s],
                [x * y * d - z * s, y * y + (1.0 - y * y) * c, y * z * d + x * s],
                [x * z * d + y * s, y * z * d - x * s, z * z + (1.0 - z * z) * c],
                [0.0; 3],
            ],
        }
    }

    /// The map that takes the z axis at the origin to the unit vector `up` at `origin`.
    pub(super) fn frame(origin: Vec3, up: Vec3) -> Affine {
        let axis =
            if up[2].abs() == 1.0 { [1.0, 0.0, 0.0] } else { normalized([-up[1], up[0], 0.0]) };
        Affine::rotation_about(axis, up[2].acos()).then(&Affine::translation(origin))
    }

    /// `self` first, `outer` after it.
    pub(super) fn then(&self, outer: &Affine) -> Affine {
        let [x, y, z, origin] = self.rows;
        Affine { rows: [outer.vector(x), outer.vector(y), outer.vector(z), outer.point(origin)] }
    }

    /// The image of a direction: translation does not matter.
    pub(super) fn vector(&self, v: Vec3) -> Vec3 {
        let [x, y, z, _] = self.rows;
        std::array::from_fn(|i| v[0] * x[i] + v[1] * y[i] + v[2] * z[i])
    }

    /// The image of a point.
    pub(super) fn point(&self, p: Vec3) -> Vec3 {
        add(self.vector(p), self.rows[3])
    }

    /// The factor by which lengths along x grow: the scale of a map without shear.
    pub(super) fn scale(&self) -> f64 {
        length(self.rows[0])
    }
}
