//! The closest point by `rtcPointQuery`, as Open3D asks it: Embree walks its tree, and a callback
//! measures triangles in `f32` (Ericson, "Real-Time Collision Detection", 5.1.5).

use super::{EmbreeScene, Handle};
use crate::scene::Mesh;
use std::ffi::{c_uint, c_void};

/// `RTCPointQuery`.
#[repr(C, align(16))]
struct Query {
    point: [f32; 3],
    time: f32,
    radius: f32,
}

/// `RTCPointQueryContext`, with room to spare.
#[repr(C, align(16))]
struct Context([u32; 64]);

/// `RTCPointQueryFunctionArguments`.
#[repr(C, align(16))]
pub(super) struct Arguments {
    query: *mut Query,
    user: *mut c_void,
    prim: c_uint,
    geom: c_uint,
    context: *mut Context,
    similarity_scale: f32,
}

pub(super) type Callback = unsafe extern "C" fn(*mut Arguments) -> bool;
pub(super) type PointQuery =
    unsafe extern "C" fn(Handle, *mut c_void, *mut c_void, Option<Callback>, *mut c_void) -> bool;

struct Nearest<'a> {
    mesh: &'a Mesh,
    distance2: f32,
    prim: u32,
}

impl EmbreeScene {
    /// Distance and triangle nearest to each point of the mesh that the scene was built from.
    pub fn closest_point(&self, mesh: &Mesh, points: &[[f32; 3]], out: &mut [(f32, u32)]) {
        for (point, out) in points.iter().zip(out) {
            let mut nearest = Nearest { mesh, distance2: f32::INFINITY, prim: u32::MAX };
            let mut query = Query { point: *point, time: 0.0, radius: f32::INFINITY };
            let mut context = Context([0; 64]);
            // SAFETY: the structures are laid out as the function expects and outlive the call; the
            // callback gets the pointer to `nearest` that it casts back.
            unsafe {
                (self.embree.api.rtcPointQuery)(
                    self.scene,
                    (&raw mut query).cast(),
                    (&raw mut context).cast(),
                    Some(measure),
                    (&raw mut nearest).cast(),
                );
            }
            *out = (nearest.distance2.sqrt(), nearest.prim);
        }
    }
}

unsafe extern "C" fn measure(arguments: *mut Arguments) -> bool {
    // SAFETY: Embree passes on what `closest_point` gave it, which nobody else holds now.
    let (arguments, query, nearest) = unsafe {
        let arguments = &*arguments;
        (arguments, &mut *arguments.query, &mut *arguments.user.cast::<Nearest<'_>>())
    };
    let distance2 = distance2(query.point, nearest.mesh.triangle(arguments.prim));
    if distance2 >= nearest.distance2 {
        return false;
    }
    (nearest.distance2, nearest.prim) = (distance2, arguments.prim);
    query.radius = distance2.sqrt();
    true
}

fn distance2(p: [f32; 3], [a, b, c]: [[f32; 3]; 3]) -> f32 {
    let minus = |p: [f32; 3], q: [f32; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    let dot = |p: [f32; 3], q: [f32; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let along = |o: [f32; 3], e: [f32; 3], t: f32| {
        let d = minus(p, [o[0] + t * e[0], o[1] + t * e[1], o[2] + t * e[2]]);
        dot(d, d)
    };
    let (ab, ac, ap) = (minus(b, a), minus(c, a), minus(p, a));
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return dot(ap, ap);
    }
    let bp = minus(p, b);
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return dot(bp, bp);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return along(a, ab, d1 / (d1 - d3));
    }
    let cp = minus(p, c);
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return dot(cp, cp);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return along(a, ac, d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return along(b, minus(c, b), (d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let scale = 1.0 / (va + vb + vc);
    let (v, w) = (vb * scale, vc * scale);
    let foot = std::array::from_fn(|i| a[i] + v * ab[i] + w * ac[i]);
    let d = minus(p, foot);
    dot(d, d)
}
