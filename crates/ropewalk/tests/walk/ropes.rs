//! Ropes, rope trees and the walks along them: links are right, start leaves are only hints,
//! restarts are rare.

use crate::bench::Bench;
use crate::scenes;
use ropewalk::build::build_default;
use ropewalk::rope::{RopeTrees, Ropes};
use ropewalk::traverse::{BruteForce, Counts, LeafId, NoCounts, RayCaster};
use ropewalk::tree::{BspTree, NodeKind};
use ropewalk::{Aabb, Accelerator, Ray, Walk};
use ropewalk_testkit::rays::{Draw, generic_ray, grid_ray};
use ropewalk_testkit::trees::{TreeShape, random_tree};
use std::sync::Arc;

fn leaves(tree: &BspTree) -> Vec<(LeafId, Aabb)> {
    let mut out = Vec::new();
    tree.for_each_node(|node, kind, cell, _| {
        if let NodeKind::Leaf { .. } = kind {
            out.push((LeafId(node), *cell));
        }
    });
    out
}

fn random_trees(seed: u64, check: impl Fn(&BspTree, &mut Draw)) {
    for round in 0..30 {
        let mut draw = Draw::new(seed + round);
        let geometry = match round % 3 {
            0 => scenes::soup(&mut draw, 80, 1.0),
            1 => scenes::grid_soup(&mut draw, 40, 3),
            _ => scenes::grid_quads(&mut draw, 30, 3),
        };
        let tree = random_tree(&mut draw, &geometry, TreeShape::default()).unwrap();
        check(&tree, &mut draw);
    }
}

#[test]
fn links_of_any_tree_are_valid() {
    random_trees(100, |tree, draw| {
        Ropes::build(tree).unwrap().validate(tree).unwrap();
        let whole = RopeTrees::build(tree).unwrap();
        whole.validate(tree).unwrap();
        assert_eq!(whole.faces_over_budget(), 0);
        for budget in [0, 12 * draw.below(whole.node_count() + 1)] {
            let cut = RopeTrees::build_within(tree, budget).unwrap();
            cut.validate(tree).unwrap();
            assert!(cut.node_count() * 12 <= budget);
            assert!(cut.bytes() <= whole.bytes());
        }
    });
}

#[test]
fn validation_refuses_the_links_of_another_tree() {
    let mut draw = Draw::new(7);
    let geometry = scenes::soup(&mut draw, 50, 1.0);
    let shape = TreeShape { aligned: 0.0, ..TreeShape::default() };
    let tree = random_tree(&mut draw, &geometry, shape).unwrap();
    let other = random_tree(&mut draw, &geometry, shape).unwrap();
    assert!(Ropes::build(&tree).unwrap().validate(&other).is_err());
    assert!(RopeTrees::build(&tree).unwrap().validate(&other).is_err());
}

/// Without flat cells, the leaves that touch a face are plain to see from boxes alone.
#[test]
fn rope_trees_hold_just_the_touching_leaves() {
    let touches = |a: &Aabb, b: &Aabb, face: usize| {
        let axis = face / 2;
        let together = match face % 2 {
            0 => b.max[axis] == a.min[axis],
            _ => b.min[axis] == a.max[axis],
        };
        let common = a.intersection(b);
        together && (0..3).all(|x| x == axis || common.min[x] < common.max[x])
    };
    for seed in 0..10 {
        let mut draw = Draw::new(200 + seed);
        let geometry = scenes::soup(&mut draw, 60, 1.0);
        // Planes at coordinates of vertices make faces meet in lines; none makes a flat cell.
        let aligned = if seed % 2 == 0 { 0.0 } else { 0.4 };
        let shape = TreeShape { aligned, ..TreeShape::default() };
        let tree = random_tree(&mut draw, &geometry, shape).unwrap();
        let all = leaves(&tree);
        if all.iter().any(|(_, cell)| (0..3).any(|a| cell.extent(a) == 0.0)) {
            continue;
        }
        let links = RopeTrees::build(&tree).unwrap();
        for (leaf, cell) in &all {
            for face in 0..6 {
                let mut found = links.neighbours(&tree, *leaf, face);
                found.sort_by_key(|leaf| leaf.0);
                let wanted: Vec<LeafId> =
                    all.iter().filter(|(_, b)| touches(cell, b, face)).map(|(id, _)| *id).collect();
                assert_eq!(found, wanted);
            }
        }
    }
}

fn rope_walks(bench: &Bench) -> impl Iterator<Item = &Accelerator> {
    bench.walks.iter().filter(|a| matches!(a.walk(), Walk::Ropes | Walk::RopeTrees))
}

/// Right, wrong, stale and absurd start leaves give the same answers.
#[test]
fn a_start_leaf_is_only_a_hint() {
    for round in 0..8 {
        let mut draw = Draw::new(300 + round);
        let grid = round % 2 == 1;
        let geometry = if grid {
            scenes::grid_quads(&mut draw, 40, 4)
        } else {
            scenes::soup(&mut draw, 120, 1.0)
        };
        let bench = Bench::random(&mut draw, geometry, TreeShape::default());
        let oracle = BruteForce { geometry: bench.geometry() };
        let bounds = bench.geometry().bounds();
        let nodes = bench.tree().nodes().len();
        for _ in 0..300 {
            let mut ray =
                if grid { grid_ray(&mut draw, 4) } else { generic_ray(&mut draw, &bounds) };
            if draw.chance(0.7) {
                ray.origin = if grid { draw.grid_point(4) } else { draw.point_in(&bounds) };
            }
            if draw.chance(0.5) {
                ray.t_min = draw.uniform(-0.2, 0.5) as f32;
            }
            let closest = oracle.closest_hit(&ray, &mut NoCounts);
            for accelerator in rope_walks(&bench) {
                let starts = [
                    None,
                    accelerator.locate(ray.origin),
                    Some(LeafId(draw.below(nodes) as u32)),
                    Some(LeafId(nodes as u32)),
                    Some(LeafId(u32::MAX)),
                ];
                for start in starts {
                    let (hit, _) = accelerator.closest_hit_from(&ray, start, &mut NoCounts);
                    assert_eq!(hit, closest, "{:?} {start:?} {ray:?}", accelerator.walk());
                    let blocked = accelerator.occluded_from(&ray, start, &mut NoCounts);
                    assert_eq!(blocked, closest.is_some());
                }
            }
        }
    }
}

/// The leaf that a closest hit returns holds the hit, and spares its next ray the descent.
#[test]
fn the_leaf_of_a_hit_starts_the_next_ray() {
    let mut draw = Draw::new(400);
    let geometry = scenes::soup(&mut draw, 400, 1.0);
    let bench = Bench::random(&mut draw, geometry, TreeShape::default());
    let cells: std::collections::HashMap<_, _> = leaves(bench.tree()).into_iter().collect();
    let bounds = bench.geometry().bounds();
    let (mut known, mut spared) = (0, 0);
    for _ in 0..2000 {
        let ray = generic_ray(&mut draw, &bounds);
        for accelerator in rope_walks(&bench) {
            let (Some(hit), Some(leaf)) = accelerator.closest_hit_from(&ray, None, &mut NoCounts)
            else {
                continue;
            };
            let (point, cell) = (ray.at(hit.t), &cells[&leaf]);
            // t is rounded to f32 and moves the point by half a step of t.
            for a in 0..3 {
                let step = f64::from(hit.t * f32::EPSILON) * f64::from(ray.dir[a]).abs();
                assert!(f64::from(cell.min[a]) - step <= point[a]);
                assert!(point[a] <= f64::from(cell.max[a]) + step);
            }
            known += 1;
            let back = Ray::new(point.map(|x| x as f32), ray.dir.map(|d| -d));
            let back = back.with_range(1e-3, f32::INFINITY);
            let (mut from_leaf, mut from_root) = (Counts::default(), Counts::default());
            let start = accelerator.closest_hit_from(&back, Some(leaf), &mut from_leaf);
            let root = accelerator.closest_hit_from(&back, None, &mut from_root);
            assert_eq!(start.0, root.0);
            spared += usize::from(from_leaf.traversal_steps < from_root.traversal_steps);
        }
    }
    assert!(known > 500 && spared * 2 > known, "{spared} of {known}");
}

#[test]
fn generic_rays_hardly_ever_restart() {
    let mut draw = Draw::new(500);
    let geometry = scenes::soup(&mut draw, 2000, 1.0);
    let (tree, _) = build_default(&geometry).unwrap();
    let (geometry, tree) = (Arc::new(geometry), Arc::new(tree));
    for walk in [Walk::Ropes, Walk::RopeTrees] {
        let accelerator = Accelerator::new(geometry.clone(), tree.clone(), walk).unwrap();
        let (rays, mut counts) = (20_000, Counts::default());
        for _ in 0..rays {
            let ray = generic_ray(&mut draw, &geometry.bounds());
            accelerator.closest_hit(&ray, &mut counts);
        }
        assert!(counts.rope_crossings > rays, "{walk:?} {counts:?}");
        assert!(counts.restarts * 1000 < rays, "{walk:?} {counts:?}");
    }
}
