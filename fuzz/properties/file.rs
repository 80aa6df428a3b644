//! What must hold of saved scenes for any bytes. Shared by the fuzz target and by ordinary tests.

use ropewalk::double::{DoubleCaster, DoubleRay};
use ropewalk::file::{
    AnyOpened, Check, HEADER_BYTES, MAX_SECTIONS, Opened, OpenedDouble, open_any,
};
use ropewalk::kernel::{BatchCaster, Level, Masks, SharedBytes, Sorting, Start};
use ropewalk::point::{Cell, PointBruteForce, PointQueries};
use ropewalk::wide::Treelet;
use ropewalk::{Geometry, Hit, Ray};
use std::sync::Arc;

/// Bytes at an address that suits, with nothing behind them.
pub struct Aligned {
    lines: Vec<Treelet>,
    len: usize,
}

impl AsRef<[u8]> for Aligned {
    fn as_ref(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.lines)[..self.len]
    }
}

/// A copy of some bytes that can be opened.
pub fn shared(bytes: &[u8]) -> SharedBytes {
    let mut lines = vec![Treelet::EMPTY; bytes.len().div_ceil(64)];
    bytemuck::cast_slice_mut(&mut lines)[..bytes.len()].copy_from_slice(bytes);
    Arc::new(Aligned { lines, len: bytes.len() })
}

/// The sections whose checksums make the geometry's hash.
const GEOMETRY: [&[u8; 4]; 7] = [b"TRIS", b"SIDE", b"KIND", b"ENDS", b"NUMS", b"VERT", b"FACE"];

/// Makes length, geometry hash and checksum of the header what they would be if somebody had saved these
/// bytes, so that an altered byte meets the checks behind them.
pub fn repair(bytes: &mut [u8]) {
    if bytes.len() < HEADER_BYTES {
        return;
    }
    let len = bytes.len() as u64;
    bytes[24..32].copy_from_slice(&len.to_le_bytes());
    let count = u32::from_le_bytes([bytes[20], bytes[21], bytes[22], bytes[23]]) as usize;
    let prefix = HEADER_BYTES + 64 * count.min(MAX_SECTIONS);
    let Some(prefix) = bytes.get_mut(..prefix) else { return };
    let mut hasher = blake3::Hasher::new();
    hasher.update(b"ropewalk geometry 1");
    for entry in prefix[HEADER_BYTES..].chunks_exact(64) {
        if GEOMETRY.iter().any(|tag| entry.starts_with(*tag)) {
            hasher.update(&entry[..4]).update(&entry[16..24]).update(&entry[32..]);
        }
    }
    prefix[64..96].copy_from_slice(hasher.finalize().as_bytes());
    prefix[32..64].fill(0);
    let checksum = blake3::hash(prefix);
    prefix[32..64].copy_from_slice(checksum.as_bytes());
}

/// Opens `bytes`; a scene must answer every query, an error must be one line. True if they are a scene.
///
/// # Panics
/// If the property does not hold.
pub fn opens_or_refuses(bytes: &[u8]) -> bool {
    let bytes = shared(bytes);
    let whole = open_any(&bytes, Check::Everything);
    match open_any(&bytes, Check::Structure) {
        Ok(AnyOpened::Single(scene)) => {
            ask(&scene);
            true
        }
        Ok(AnyOpened::Double(scene)) => {
            ask_double(&scene);
            true
        }
        Err(error) => {
            assert!(whole.is_err(), "what is refused is refused by the full check too");
            let sentence = error.to_string();
            assert!(!sentence.contains(char::is_control), "{sentence:?}");
            false
        }
    }
}

/// Rays at a box: along its diagonals, in its planes, through a grid, side by side and far apart, and such
/// as no ray should be.
pub fn rays(geometry: &Geometry) -> Vec<Ray> {
    let bounds = geometry.bounds();
    let (low, high) =
        if bounds.is_empty() { ([0.0; 3], [1.0; 3]) } else { (bounds.min, bounds.max) };
    let at = |x: f32, y: f32, z: f32| {
        let share = [x, y, z];
        std::array::from_fn::<f32, 3, _>(|a| low[a] + (high[a] - low[a]) * share[a])
    };
    let towards =
        |from: [f32; 3], to: [f32; 3]| Ray::new(from, std::array::from_fn(|a| to[a] - from[a]));
    let mut rays = Vec::new();
    let eye = at(0.4, 0.6, 3.0);
    // A beam: all from one point, next to each other.
    for i in 0..128 {
        let (x, y) = ((i % 16) as f32 / 16.0, (i / 16) as f32 / 16.0);
        rays.push(towards(eye, at(x, y, 0.5)));
    }
    for i in 0..48 {
        let f = |k: usize| (i * k % 17) as f32 / 16.0;
        let (from, to) = (at(f(3), f(5), f(7)), at(f(11), f(13), f(2)));
        rays.push(towards(from, to));
        rays.push(towards(from, to).with_range(0.0, 0.25));
        rays.push(towards(to, at(f(3), f(13), f(2))));
    }
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let mut dir = [0.0; 3];
            dir[axis] = sign;
            rays.extend([at(0.0, 0.0, 0.0), at(0.5, 0.5, 0.5)].map(|from| Ray::new(from, dir)));
            rays.push(Ray::new(from_afar(at(0.5, 0.5, 0.5), axis, sign), dir.map(|d| -d)));
        }
    }
    // Too large or too small for the filters, and no rays at all.
    rays.push(Ray::new([1e20, 1e20, 1e20], [-1e20, -1e20, -1e20]));
    rays.push(towards(eye, at(0.5, 0.5, 0.5)).with_range(0.0, f32::MAX));
    rays.push(Ray { dir: towards(eye, at(0.5, 0.5, 0.5)).dir.map(|d| d * 1e-20), ..rays[0] });
    rays.push(Ray::new(at(0.5, 0.5, 0.5), [1e-40, 1.0, 0.0]));
    rays.push(Ray::new([f32::NAN, 0.0, 0.0], [0.0, 0.0, 1.0]));
    rays.push(Ray::new([0.0; 3], [0.0; 3]));
    rays
}

fn from_afar(mut from: [f32; 3], axis: usize, sign: f32) -> [f32; 3] {
    from[axis] += sign * 1e3;
    from
}

/// Points in and around a box, and such as no point should be.
pub fn points(geometry: &Geometry) -> Vec<[f64; 3]> {
    let bounds = geometry.bounds();
    let (low, high) =
        if bounds.is_empty() { ([0.0; 3], [1.0; 3]) } else { (bounds.min, bounds.max) };
    let mut points = vec![[f64::NAN, 0.0, 0.0], [1e300, 0.0, 0.0], [f64::INFINITY; 3]];
    for i in 0..60 {
        let share = [(i % 5) as f64 / 4.0, (i / 5 % 4) as f64 / 3.0, (i / 20) as f64];
        points.push(std::array::from_fn(|a| {
            f64::from(low[a]) + (f64::from(high[a]) - f64::from(low[a])) * share[a]
        }));
    }
    points
}

/// Rays of `f64` and points in and around the box of a scene in `f64`, and such as none should be.
pub fn double_rays_and_points(scene: &OpenedDouble) -> (Vec<DoubleRay>, Vec<[f64; 3]>) {
    let mut unit = Geometry::new();
    let triangle = ropewalk::primitive::Triangle { vertices: [[0.0; 3], [1.0; 3], [1.0; 3]] };
    // It is finite.
    let _ = unit.push(triangle, ropewalk::Sides::Both);
    let (low, high) = scene.geometry.bounds().unwrap_or(([0.0; 3], [1.0; 3]));
    let place = |p: [f64; 3]| std::array::from_fn(|a| low[a] + (high[a] - low[a]) * p[a]);
    let along = |d: [f64; 3]| std::array::from_fn(|a| (high[a] - low[a]) * d[a]);
    let moved = |ray: &Ray| DoubleRay {
        origin: place(ray.origin.map(f64::from)),
        dir: along(ray.dir.map(f64::from)),
        t_min: f64::from(ray.t_min),
        t_max: f64::from(ray.t_max),
    };
    let rays = rays(&unit).iter().map(moved).collect();
    (rays, points(&unit).into_iter().map(place).collect())
}

/// The same as [`ask`] in `f64`.
pub fn ask_double(scene: &OpenedDouble) {
    let Opened { tree, geometry, .. } = scene;
    let (rays, points) = double_rays_and_points(scene);
    for level in Level::ALL {
        let Some(caster) = DoubleCaster::new(tree, geometry).with_level(level) else { continue };
        let caster = caster.with_threads(1);
        for id in caster.closest_hit(&rays).prim_id {
            if (id as usize) < geometry.len() {
                geometry.normal(id);
            }
        }
        caster.occluded(&rays);
        caster.all_hits(&rays);
        caster.first_hits(&rays, 2);
        caster.count_hits(&rays);
        let odd = |_: usize, hit: &ropewalk::double::DoubleHit| hit.prim_id % 2 == 1;
        caster.with_filter(odd).closest_hit(&rays);
        if let Ok(queries) = PointQueries::new(tree, geometry)
            && let Some(queries) = queries.with_level(level)
        {
            let queries = queries.with_threads(1);
            queries.closest_point(&points);
            queries.signed_distance(&points);
            if level == Level::Scalar {
                queries.winding_number(&points);
                let moments = queries.winding_moments();
                let _ = queries.contains_by_winding(&moments, &points);
                for cell in queries.locate(&points).into_iter().flatten() {
                    queries.cell_corners(cell);
                    queries.cell_primitives(cell);
                }
            }
        }
    }
    let oracle = PointBruteForce { geometry };
    for point in points {
        oracle.closest_point(point);
        oracle.side(point);
    }
}

/// Puts every query to a scene, at every level, and looks only whether it comes back.
pub fn ask(scene: &Opened) {
    let Opened { tree, geometry, .. } = scene;
    let rays = rays(geometry);
    for level in Level::ALL {
        let Some(caster) = BatchCaster::new(tree, geometry).with_level(level) else { continue };
        let caster = caster.with_threads(1);
        let hits = caster.closest_hit(&rays);
        for (ray, (&t, &prim_id)) in rays.iter().zip(hits.t.iter().zip(&hits.prim_id)) {
            if (prim_id as usize) < geometry.len() {
                geometry.normals(ray, &Hit { t, prim_id, u: 0.0, v: 0.0 });
            }
        }
        for start in [Start::Root, Start::Entry] {
            let caster = caster.with_beams(false).with_start(start);
            caster.closest_hit(&rays);
            caster.occluded(&rays);
            caster.with_sorting(Sorting::Always).closest_hit(&rays);
        }
        caster.with_sorting(Sorting::Always).closest_hit(&rays);
        caster.occluded(&rays);
        caster.all_hits(&rays);
        caster.first_hits(&rays, 2);
        caster.count_hits(&rays);
        for ray in rays.iter().step_by(3) {
            caster.closest_hit_one(ray);
            caster.occluded_one(ray);
        }
        let filtered = caster.with_filter(Masks { primitive: &[1, 2], ray: &[3] });
        filtered.closest_hit(&rays);
        filtered.all_hits(&rays);
        if let Ok(queries) = PointQueries::new(tree, geometry)
            && let Some(queries) = queries.with_level(level)
        {
            let (queries, points) = (queries.with_threads(1), points(geometry));
            queries.closest_point(&points);
            queries.signed_distance(&points);
            if level == Level::Scalar {
                queries.winding_number(&points);
                for cell in queries.locate(&points).into_iter().flatten() {
                    queries.cell_box(cell);
                }
                for bits in (0..tree.lines().len() as u32 * 8 + 9).step_by(7).chain([u32::MAX]) {
                    queries.cell_box(Cell::from_bits(bits));
                }
            }
        }
    }
    let oracle = PointBruteForce { geometry };
    for point in points(geometry) {
        oracle.closest_point(point);
    }
}
