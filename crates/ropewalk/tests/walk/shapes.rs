//! Primitives that are no triangles lie in blocks of their own and are tested only where a ray meets their bounds:
//! answers at every level are those of brute force, bit for bit.

use crate::wave::check;
use ropewalk::build::{BuildSettings, Preset, build};
use ropewalk::ray::PreparedRay;
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Ray, Sides};
use ropewalk_testkit::primitives::{Kind, Sample, Space, sample};
use ropewalk_testkit::rays::{Draw, generic_ray};
use ropewalk_testkit::trees::{TreeShape, random_tree};

/// Rays at points of surfaces: from near and far, along surfaces, and with ranges that end at hits or beside them.
fn rays_at(draw: &mut Draw, geometry: &Geometry, samples: &[Sample]) -> Vec<Ray> {
    let mut rays = Vec::new();
    let size = geometry.bounds().diagonal();
    for _ in 0..250 {
        rays.push(generic_ray(draw, &geometry.bounds()));
        let of = draw.below(samples.len());
        let (on, id) = (samples[of].point(draw), of as u32);
        let away = draw.direction().map(f64::from);
        let distance = size * draw.uniform(-20.0, 6.0).exp2();
        let origin: [f32; 3] = std::array::from_fn(|a| (on[a] + distance * away[a]) as f32);
        let mut dir: [f32; 3] = std::array::from_fn(|a| (on[a] - f64::from(origin[a])) as f32);
        if draw.chance(0.2) {
            dir = samples[draw.below(samples.len())].point(draw).map(|x| x as f32);
            dir = std::array::from_fn(|a| dir[a] - on[a] as f32);
        }
        if draw.chance(0.2) {
            dir[draw.below(3)] = 0.0;
        }
        if dir == [0.0; 3] {
            dir[draw.below(3)] = 1.0;
        }
        let scale = draw.uniform(-8.0, 8.0).exp2() as f32;
        let ray = Ray::new(origin, dir.map(|x| x * scale));
        let line = ray.with_range(f32::NEG_INFINITY, f32::INFINITY);
        rays.extend([ray, line]);
        let hit = PreparedRay::new(&line).and_then(|line| geometry.intersect(id, &line));
        if let Some(hit) = hit {
            let (below, above) = (hit.t.next_down(), hit.t.next_up());
            rays.push(line.with_range(hit.t, hit.t));
            rays.push(line.with_range(above, f32::INFINITY));
            rays.push(line.with_range(f32::NEG_INFINITY, below));
            rays.push(line.with_range(below, above));
        }
    }
    rays
}

#[test]
fn every_kind_and_level_equals_brute_force() {
    let curved = [Kind::Sphere, Kind::Cone, Kind::Polygon, Kind::Patch];
    for (i, kinds) in [&curved[..1], &curved[1..2], &curved[2..3], &curved[3..], &Kind::ALL[..]]
        .iter()
        .enumerate()
    {
        for (j, space) in Space::ALL.into_iter().enumerate() {
            let mut draw = Draw::new(700 + 10 * i as u64 + j as u64);
            let (mut geometry, mut samples) = (Geometry::new(), Vec::new());
            for _ in 0..120 {
                let kind = kinds[draw.below(kinds.len())];
                let made = sample(&mut draw, kind, space);
                let sides = [Sides::Both, Sides::Both, Sides::Front, Sides::Back][draw.below(4)];
                geometry.push(made.shape.clone(), sides).unwrap();
                samples.push(made);
            }
            let rays = rays_at(&mut draw, &geometry, &samples);
            let shape = TreeShape { max_depth: 4 + draw.below(10), ..TreeShape::default() };
            check(&geometry, &random_tree(&mut draw, &geometry, shape).unwrap(), &rays);
            let settings = BuildSettings::preset(Preset::Balanced);
            check(&geometry, &build(&geometry, &settings, &()).unwrap().0, &rays);
        }
    }
}

/// Triangles come first in a leaf, and others begin a block.
#[test]
fn blocks_hold_one_sort() {
    let mut draw = Draw::new(77);
    let mut geometry = Geometry::new();
    for i in 0..40 {
        let kind = if i % 3 == 0 { Kind::Triangle } else { Kind::Sphere };
        geometry.push(sample(&mut draw, kind, Space::Unit).shape, Sides::Both).unwrap();
    }
    let shape = TreeShape { max_depth: 0, ..TreeShape::default() };
    let tree = random_tree(&mut draw, &geometry, shape).unwrap();
    let wide = WideTree::compile(&tree, &geometry).unwrap();
    assert_eq!(wide.validate(&tree, &geometry), Ok(()));
    // 14 triangles and 26 spheres.
    assert_eq!(wide.blocks(), 2 + 4);
    let mut other = Geometry::new();
    for id in 0..40 {
        other.push(geometry.shape(39 - id).clone(), Sides::Both).unwrap();
    }
    assert!(wide.validate(&tree, &other).is_err());
}
