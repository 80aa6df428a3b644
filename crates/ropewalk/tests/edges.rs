//! Lists of hits along rays that meet edges and vertices exactly.

use ropewalk::build::{BuildSettings, Preset};
use ropewalk::double::{DoubleBruteForce, DoubleCaster, DoubleGeometry, DoubleRay};
use ropewalk::kernel::{BatchCaster, Level};
use ropewalk::primitive::Triangle;
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Ray, Sides};
use ropewalk_testkit::rays::Draw;

type Cells = [[[bool; 4]; 4]; 4];

fn some_cells(draw: &mut Draw) -> Cells {
    std::array::from_fn(|_| std::array::from_fn(|_| std::array::from_fn(|_| draw.chance(0.5))))
}

/// The surface of some cells of a grid, `true` where there is one; fronts look outwards.
fn surface_of(cells: &Cells) -> Vec<[[f32; 3]; 3]> {
    let is = |p: [i32; 3]| {
        p.iter().all(|x| (0..4).contains(x)) && cells[p[0] as usize][p[1] as usize][p[2] as usize]
    };
    let mut faces = Vec::new();
    for index in 0..64 {
        let p = [index & 3, index >> 2 & 3, index >> 4];
        for (axis, upper) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
            let mut beside = p;
            beside[axis] += 2 * upper - 1;
            if !is(p) || is(beside) {
                continue;
            }
            let corner = |x: i32, y: i32| {
                let mut c = p;
                c[axis] += upper;
                c[(axis + 1) % 3] += x;
                c[(axis + 2) % 3] += y;
                c.map(|x| x as f32)
            };
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            faces.extend(if upper == 1 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
        }
    }
    faces
}

/// Rays from middles of cells towards and along corners, edges and faces, and whether each begins inside; all numbers are
/// exact.
fn rays_of(draw: &mut Draw, cells: &Cells) -> Vec<(Ray, bool)> {
    let ray = |_| {
        let cell: [usize; 3] = std::array::from_fn(|_| draw.below(6));
        let origin = cell.map(|x| x as f32 - 0.5);
        let target: [f32; 3] = std::array::from_fn(|_| draw.below(17) as f32 / 2.0 - 2.0);
        let inside = cell.iter().all(|&x| (1..5).contains(&x))
            && cells[cell[0] - 1][cell[1] - 1][cell[2] - 1];
        (Ray::new(origin, std::array::from_fn(|a| target[a] - origin[a])), inside)
    };
    (0..600).map(ray).filter(|(ray, _)| ray.dir != [0.0; 3]).collect()
}

fn wide(ray: &Ray) -> DoubleRay {
    DoubleRay::new(ray.origin.map(f64::from), ray.dir.map(f64::from))
}

#[test]
fn closed_surfaces_are_entered_as_often_as_they_are_left() {
    let mut draw = Draw::new(77);
    let (mut crossings, mut inside, mut left_out) = (0, 0, 0);
    for _ in 0..30 {
        let cells = some_cells(&mut draw);
        let faces = surface_of(&cells);
        let mut geometry = Geometry::new();
        for &vertices in &faces {
            geometry.push(Triangle { vertices }, Sides::Both).unwrap();
        }
        let settings = BuildSettings::preset(Preset::Balanced);
        let (tree, _) = WideTree::build(&geometry, &settings, &()).unwrap();
        let (rays, within): (Vec<Ray>, Vec<bool>) = rays_of(&mut draw, &cells).into_iter().unzip();
        let caster = BatchCaster::new(&tree, &geometry);
        let (closest, all) = (caster.closest_hit(&rays), caster.all_hits(&rays));
        for (i, ray) in rays.iter().enumerate() {
            let row = all.offsets[i]..all.offsets[i + 1];
            let leaves = |id: &u32| {
                let [n, d] =
                    [geometry.triangle(*id).unwrap().scaled_normal(), ray.dir.map(f64::from)];
                n[0] * d[0] + n[1] * d[1] + n[2] * d[2] > 0.0
            };
            let out = all.prim_id[row.clone()].iter().filter(|id| leaves(id)).count();
            let enters = row.len() - out;
            assert_eq!(enters + usize::from(within[i]), out, "{ray:?} {cells:?}");
            let first = all.t.get(row.start).filter(|_| !row.is_empty());
            assert_eq!(first.copied().unwrap_or(f32::INFINITY), closest.t[i]);
            let id = all.prim_id.get(row.start).filter(|_| !row.is_empty());
            assert_eq!(
                id.copied().unwrap_or(u32::MAX),
                closest.prim_id[i],
                "the first of its list"
            );
            let expected: Vec<_> =
                geometry.all_hits(ray).iter().map(|h| (h.t + 0.0, h.prim_id)).collect();
            let row: Vec<_> = row.map(|h| (all.t[h], all.prim_id[h])).collect();
            assert_eq!(row, expected, "{ray:?}");
            let touched = |id: &u32| {
                let prepared = ropewalk::ray::PreparedRay::new(ray).unwrap();
                geometry.intersect(*id, &prepared).is_some()
            };
            left_out += (0..faces.len() as u32).filter(touched).count() - row.len();
            crossings += enters;
            inside += usize::from(within[i]);
        }
        for level in Level::ALL {
            let Some(caster) = caster.with_level(level) else { continue };
            assert_eq!(caster.all_hits(&rays), all, "{}", level.name());
            let counts: Vec<usize> = all.offsets.windows(2).map(|o| o[1] - o[0]).collect();
            let counted = caster.count_hits(&rays);
            assert!(
                counted.iter().zip(&counts).all(|(&a, &b)| a as usize == b),
                "{}",
                level.name()
            );
            for k in [1, 2, 3, 5] {
                let first = caster.first_hits(&rays, k);
                for i in 0..rays.len() {
                    let row = all.offsets[i]..all.offsets[i + 1].min(all.offsets[i] + k);
                    let own = first.offsets[i]..first.offsets[i + 1];
                    assert_eq!(first.t[own.clone()], all.t[row.clone()], "{k} of {:?}", rays[i]);
                    assert_eq!(first.prim_id[own], all.prim_id[row], "{k} of {:?}", rays[i]);
                }
            }
        }
    }
    assert!(
        crossings > 5000 && inside > 1000 && left_out > 1000,
        "{crossings} {inside} {left_out}"
    );
}

#[test]
fn the_same_in_double_precision() {
    let mut draw = Draw::new(78);
    for offset in [0.0, 1e7] {
        let cells = some_cells(&mut draw);
        let faces = surface_of(&cells);
        let vertices: Vec<[f64; 3]> =
            faces.iter().flatten().map(|p| p.map(|x| f64::from(x) / 1024.0 + offset)).collect();
        let faces: Vec<[u32; 3]> =
            (0..vertices.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let geometry = DoubleGeometry::from_triangles(vertices, faces).unwrap();
        let settings = BuildSettings::preset(Preset::Balanced);
        let (tree, _) = geometry.build(&settings, &()).unwrap();
        let (rays, within): (Vec<DoubleRay>, Vec<bool>) = rays_of(&mut draw, &cells)
            .iter()
            .map(|(ray, within)| {
                let ray = wide(ray);
                (DoubleRay::new(ray.origin.map(|x| x / 1024.0 + offset), ray.dir), *within)
            })
            .unzip();
        let caster = DoubleCaster::new(&tree, &geometry);
        let (all, counts) = (caster.all_hits(&rays), caster.count_hits(&rays));
        let two = caster.first_hits(&rays, 2);
        for (i, ray) in rays.iter().enumerate() {
            let row = all.offsets[i]..all.offsets[i + 1];
            assert_eq!(row.len() % 2 == 1, within[i], "{ray:?}");
            assert_eq!(counts[i] as usize, row.len());
            let expected: Vec<_> = DoubleBruteForce { geometry: &geometry }
                .all_hits(ray)
                .iter()
                .map(|h| (h.t, h.prim_id))
                .collect();
            let row: Vec<_> = row.map(|h| (all.t[h], all.prim_id[h])).collect();
            assert_eq!(row, expected);
            let own = two.offsets[i]..two.offsets[i + 1];
            let own: Vec<_> = own.map(|h| (two.t[h], two.prim_id[h])).collect();
            assert_eq!(own, row[..row.len().min(2)]);
        }
    }
}

/// Two floors side by side, as one square: its rim belongs to it, and what is inside is hit once.
#[test]
fn rims_are_hit_and_seams_once() {
    let corners =
        [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0], [1.0, 1.0, 0.0]];
    let faces = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
    let geometry = Geometry::from_triangles(&corners, &faces).unwrap();
    let twice = Geometry::from_triangles(&corners, &[faces, faces].concat()).unwrap();
    for x in 0..9 {
        for y in 0..9 {
            let origin = [x as f32 / 4.0, y as f32 / 4.0, 1.0];
            for ray in [Ray::new(origin, [0.0, 0.0, -1.0]), Ray::new(origin, [0.0, 0.0, -3.0])] {
                assert_eq!(geometry.all_hits(&ray).len(), 1, "{ray:?}");
                assert_eq!(twice.all_hits(&ray).len(), 2, "coincident ones all: {ray:?}");
            }
        }
    }
}
