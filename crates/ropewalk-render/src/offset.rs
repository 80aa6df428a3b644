//! Where rays start that leave a surface.

use crate::vec3::{Vec3, add_scaled, length};

/// Half a unit in the last place of `f32`, relative: the error of one rounding.
const UNIT_ROUNDOFF: f64 = 1.0 / (1u64 << 24) as f64;

/// Multiple of the error bound by which an origin is lifted off its surface. One bound undoes the
/// errors, the second keeps the origin clear of the surface by as much again, so that a crossing
/// that the next ray computes at its own origin, with errors of the same kind, is behind it.
const SAFETY: f64 = 2.0;

/// The origin of a ray that leaves the surface at `point` on the side of `normal` (unit length,
/// geometric), where the arriving ray had travelled `distance`.
///
/// Two roundings separate a hit from its surface: that of `t` moves the point by at most
/// `u * distance` along the ray, that of the new origin by at most `u * |coordinate|` an axis, with
/// `u = 2^-24`. Across the surface they add to at most `u * (distance + |point|)`; kernels compute
/// in `f64`, whose errors do not show beside it. The lift is twice that bound along the normal, so
/// it holds for grazing rays too, and needs no `t_min`.
pub(crate) fn lifted_origin(point: Vec3, normal: Vec3, distance: f64) -> [f32; 3] {
    let lift = SAFETY * UNIT_ROUNDOFF * (distance + length(point));
    add_scaled(point, lift, normal).map(|x| x as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vec3::{dot, scale, sub, unit};

    /// After both roundings the origin is on the side of the normal, over six decades of scale.
    #[test]
    fn origin_lies_on_the_normals_side() {
        for k in 0..600u32 {
            let f = |s: u32| f64::from((k * 7919 + s * 104_729) % 2003) / 1001.5 - 1.0;
            let size = 10f64.powi((k % 7) as i32 - 3);
            let normal = unit([f(1), f(2), f(3) + 0.001]).expect("not zero");
            let point = scale([f(4), f(5), f(6)], size);
            let distance = size * (1.0 + f(7));
            // The hit point that an error of t along the worst direction makes of `point`.
            let off = add_scaled(point, -distance * UNIT_ROUNDOFF, normal);
            let start = lifted_origin(off, normal, distance).map(f64::from);
            assert!(dot(sub(start, point), normal) >= 0.0, "{point:?} {normal:?} {distance}");
        }
    }
}
