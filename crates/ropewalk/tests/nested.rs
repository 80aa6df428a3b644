//! Batches that are put while another one is under way.

use ropewalk::kernel::{BatchCaster, Level};
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Hit, Ray};
use ropewalk_testkit::rays::Draw;

/// One type for all filters, so that the kernels are compiled for it once.
type Filter<'a> = &'a (dyn Fn(usize, &Hit) -> bool + Sync);

/// Filters may put batches of their own, also in which filters do so again.
#[test]
fn batches_inside_of_filters() {
    let mut draw = Draw::new(77);
    let mut point = || -> [f32; 3] { std::array::from_fn(|_| draw.uniform(-1.0, 1.0) as f32) };
    let vertices: Vec<[f32; 3]> = (0..300).map(|_| point()).collect();
    let rays: Vec<Ray> = (0..300).map(|_| Ray::new(point(), point())).collect();
    let faces: Vec<[u32; 3]> = (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let geometry = Geometry::from_triangles(&vertices, &faces).unwrap();
    let (wide, _) = WideTree::build(&geometry, &Default::default(), &()).unwrap();
    for level in Level::ALL {
        let Some(caster) = BatchCaster::new(&wide, &geometry).with_level(level) else { continue };
        for threads in [0, 1] {
            let caster = caster.with_threads(threads);
            let (whole, every) = (caster.closest_hit(&rays), caster.all_hits(&rays));
            let inner: Filter<'_> = &|_, hit| {
                let i = hit.prim_id as usize % rays.len();
                caster.closest_hit(&rays[i..=i]).t == whole.t[i..=i]
            };
            let outer: Filter<'_> = &|ray, _| {
                let part = ray..(ray + 30).min(rays.len());
                let hits = caster.with_filter(inner).closest_hit(&rays[part.clone()]);
                hits.t == whole.t[part.clone()] && hits.prim_id == whole.prim_id[part]
            };
            assert_eq!(caster.with_filter(outer).closest_hit(&rays), whole, "{}", level.name());
            assert_eq!(caster.with_filter(outer).all_hits(&rays), every, "{}", level.name());
        }
    }
}
