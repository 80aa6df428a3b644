//! From `f64` to the numbers of the search, and back.
//!
//! The search computes with `p' = (p - centre) * scale`, rounded to `f32`, where the scene reaches from -1
//! to 1 and `scale` is a power of two. A ray is turned into one from a point within 2 of the centre on each
//! axis, with a direction whose largest component is at least 1 and below 2. So, with `u = 2^-24`,
//! coordinates of triangles are off by `u / 2`, those of the origin by `u` and those of a point on the ray
//! within the scene, 3 directions away at most, by another `3 u`: [`MARGIN`] is `8 u`.

use super::DoubleRay;
use crate::ray::Ray;

/// By how much cells are widened to hold what has been rounded.
pub const MARGIN: f32 = 1.0 / (1u32 << 21) as f32;

/// A ray that starts farther away, in halves of the scene's size, is decided triangle by triangle: the
/// rounding of `f64` itself would show beside [`MARGIN`].
const FAR: f64 = (1u64 << 26) as f64;

/// Exponents of two beyond this are out of the reach of [`power`].
const LARGE: i32 = 900;

/// Below this share of the largest, a component of a direction counts as none.
const VANISHING: f64 = 1.0 / (1u64 << 60) as f64;

/// Parameters are widened by this share of their terms, where `2^-24` is the rounding to `f32`.
const SLACK: f64 = 1.0 / (1u64 << 20) as f64;

/// Where the numbers of the search lie.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    centre: [f64; 3],
    /// Exponent of the scale.
    exponent: i32,
}

/// A ray made ready for the search.
pub enum Narrowed {
    /// The ray, and how its parameters correspond.
    Ray(Ray, Place),
    /// It can hit nothing.
    Misses,
    /// Its numbers are beyond the search.
    Beyond,
}

/// Parameters of the search are `unit * t - shift`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Place {
    unit: f64,
    shift: f64,
    /// What lies between these does so in the ray's range for sure.
    pub inner: [f32; 2],
}

impl Place {
    /// A bound of the search that lies above all parameters up to `t`.
    pub fn after(self, t: f64) -> f32 {
        let (scaled, slack) = self.scaled(t);
        (scaled + slack) as f32
    }

    /// A bound of the search that lies below all parameters from `t` on.
    fn before(self, t: f64) -> f32 {
        let (scaled, slack) = self.scaled(t);
        (scaled - slack) as f32
    }

    fn scaled(self, t: f64) -> (f64, f64) {
        let scaled = t * self.unit;
        if scaled.is_infinite() {
            return (scaled, 0.0);
        }
        let slack = SLACK * (scaled.abs() + self.shift.abs() + 1.0);
        (scaled - self.shift, if slack.is_finite() { slack } else { 0.0 })
    }
}

/// Two to the power of an exponent of at most [`LARGE`] in size.
fn power(exponent: i32) -> f64 {
    f64::from_bits(((1023 + i64::from(exponent)) as u64) << 52)
}

/// The exponent of the largest power of two that is not above `x`, which is finite and positive.
fn exponent(x: f64) -> i32 {
    let biased = |x: f64| (x.to_bits() >> 52) as i32;
    if biased(x) == 0 { biased(x * power(100)) - 1023 - 100 } else { biased(x) - 1023 }
}

impl Frame {
    /// The frame of a scene within a box.
    pub fn new(min: [f64; 3], max: [f64; 3]) -> Self {
        let centre: [f64; 3] = std::array::from_fn(|a| 0.5 * min[a] + 0.5 * max[a]);
        let half = (0..3).fold(0.0f64, |h, a| h.max(max[a] - centre[a]).max(centre[a] - min[a]));
        let exponent = if half > 0.0 { -(exponent(half) + 1) } else { 0 };
        Frame { centre, exponent: exponent.clamp(-LARGE, LARGE) }
    }

    /// A point of the scene in the numbers of the search, rounded.
    pub fn point(&self, p: [f64; 3]) -> [f32; 3] {
        self.scaled(p).map(|x| x as f32)
    }

    /// The same without rounding to `f32`.
    #[inline(always)]
    pub fn scaled(&self, p: [f64; 3]) -> [f64; 3] {
        let scale = self.scale();
        std::array::from_fn(|a| (p[a] - self.centre[a]) * scale)
    }

    /// A point of the search as it would have been given, rounded.
    pub fn unscaled(&self, p: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|a| p[a] * self.unit() + self.centre[a])
    }

    /// The power of two by which the scene is scaled.
    #[inline(always)]
    pub fn scale(&self) -> f64 {
        power(self.exponent)
    }

    /// One over that.
    #[inline(always)]
    pub fn unit(&self) -> f64 {
        power(-self.exponent)
    }

    /// A ray in the numbers of the search.
    pub fn ray(&self, ray: &DoubleRay) -> Narrowed {
        if !ray.is_valid() {
            return Narrowed::Misses;
        }
        let longest = ray.dir.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let length = exponent(longest);
        if length.abs() > LARGE || (length + self.exponent).abs() > LARGE {
            return Narrowed::Beyond;
        }
        let (dir, mut origin) = (ray.dir.map(|x| x * power(-length)), self.scaled(ray.origin));
        let mut shift = 0.0;
        let far = origin.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        if far > FAR {
            return Narrowed::Beyond;
        }
        if far > 2.0 {
            // To the point nearest to the centre; where that is outside of the scene, so is the ray.
            let dot = |p: [f64; 3]| p[0] * dir[0] + p[1] * dir[1] + p[2] * dir[2];
            shift = -dot(origin) / dot(dir);
            origin = std::array::from_fn(|a| origin[a] + shift * dir[a]);
            if origin.iter().any(|x| x.abs() > 2.0) {
                return Narrowed::Misses;
            }
        }
        let place = Place { unit: power(length + self.exponent), shift, inner: [0.0; 2] };
        let place = Place { inner: [place.after(ray.t_min), place.before(ray.t_max)], ..place };
        let dir = dir.map(|x| if x.abs() < VANISHING { 0.0 } else { x as f32 });
        let (t_min, t_max) = (place.before(ray.t_min), place.after(ray.t_max));
        let origin = origin.map(|x| x as f32);
        Narrowed::Ray(Ray { origin, dir, t_min, t_max }, place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_are_those_of_the_number() {
        for e in [-1074, -1023, -1022, -100, -1, 0, 1, 1023] {
            assert_eq!(exponent(2f64.powi(e)), e, "2^{e}");
        }
        assert_eq!(exponent(1.999), 0);
        assert_eq!(power(-LARGE), 2f64.powi(-LARGE));
        assert_eq!(power(LARGE), 2f64.powi(LARGE));
    }

    #[test]
    fn a_scene_reaches_from_minus_one_to_one() {
        for (min, max) in [(1e7, 1e7 + 1e-3), (-1e99, 1e99), (0.0, 1e-90), (-3.0, 5.0), (2.0, 2.0)]
        {
            let frame = Frame::new([min; 3], [max; 3]);
            let (low, high) = (frame.point([min; 3])[0], frame.point([max; 3])[0]);
            assert!((-1.0..=0.0).contains(&low) && (0.0..=1.0).contains(&high), "{min} {max}");
            assert!(min == max || high - low >= 0.5, "{min} {max}: {low} to {high}");
        }
    }
}
