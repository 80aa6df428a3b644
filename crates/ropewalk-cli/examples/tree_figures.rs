//! Trees, links and counts behind the pictures of docs/how-the-tree-works.md, as one JSON object on standard output:
//! `cargo run --release -p ropewalk-cli --example tree_figures`; `scripts/pictures tree` draws them.
//!
//! The small scene is a plan: walls seen from above, so tall that areas behave as lengths of the plan and no plane cuts across z.

use anyhow::{Context, Result};
use ropewalk::build::{BuildSettings, Measure, Preset, Termination, build};
use ropewalk::cost::{CostModel, Cut, LeafCost, MacDonaldBooth};
use ropewalk::kernel::{BatchCaster, BatchEvents};
use ropewalk::method::Method;
use ropewalk::rope::{RopeTrees, Ropes};
use ropewalk::traverse::{Counts, LeafId, RayCaster};
use ropewalk::tree::{BspTree, NodeKind, TreeStats};
use ropewalk::wide::{LEAF, WideTree, code_line};
use ropewalk::{Aabb, Accelerator, Geometry, Ray, Shape, Sides, Walk};
use ropewalk_render::{Monitor, RenderSettings};
use ropewalk_scene::{FacetPolicy, NffLimits, load_scene};
use serde_json::{Value, json};
use std::sync::Arc;

/// Half of the height of walls, in units of the plan.
const HALF_HEIGHT: f32 = 500.0;

/// Random rays over which counts of the plan are averaged.
const RAYS: usize = 20_000;

/// Size of the pictures of counts, in pixels.
const PICTURE: [u32; 2] = [320, 240];

type Wall = [[f32; 2]; 2];

fn main() -> Result<()> {
    let teapot = load_scene("spd:teapot", &NffLimits::default())?;
    println!("{}", json!({ "plan": plan()?, "slice": slice(&teapot)?, "heat": heat(&teapot)? }));
    Ok(())
}

/// The small scene: a long wall askew, a round hedge, a room, and pillars, most of them in one corner.
fn walls() -> Vec<Wall> {
    let arc = |[x, y]: [f32; 2], radius: f32, pieces: u32, from: f32, to: f32| {
        let corner = move |i: u32| {
            let angle = (from + (to - from) * i as f32 / pieces as f32).to_radians();
            [x + radius * angle.cos(), y + radius * angle.sin()]
        };
        (0..pieces).map(move |i| [corner(i), corner(i + 1)])
    };
    let mut walls = vec![
        [[1.2, 1.2], [10.8, 5.4]],
        [[8.5, 6.0], [14.5, 6.0]],
        [[14.5, 6.0], [14.5, 9.2]],
        [[14.5, 9.2], [8.5, 9.2]],
        [[8.5, 9.2], [8.5, 7.4]],
        [[11.2, 7.2], [11.2, 9.2]],
    ];
    walls.extend(arc([4.0, 7.4], 1.6, 9, 20.0, 300.0));
    for center in [[12.2, 2.0], [13.5, 1.8], [12.4, 3.2], [13.7, 3.0]] {
        walls.extend(arc(center, 0.42, 8, 0.0, 360.0));
    }
    for center in [[3.0, 4.5], [7.4, 3.1], [9.8, 3.6]] {
        walls.extend(arc(center, 0.35, 4, 0.0, 360.0));
    }
    walls
}

fn raised(walls: &[Wall]) -> Result<Geometry> {
    let mut geometry = Geometry::new();
    for [[ax, ay], [bx, by]] in walls {
        let (low, high) = (-HALF_HEIGHT, HALF_HEIGHT);
        let corners = vec![[*ax, *ay, low], [*bx, *by, low], [*bx, *by, high], [*ax, *ay, high]];
        geometry.push(Shape::polygon(corners)?, Sides::Both)?;
    }
    Ok(geometry)
}

fn level_ray(from: [f32; 2], towards: [f32; 2]) -> Ray {
    Ray::new([from[0], from[1], 0.0], [towards[0] - from[0], towards[1] - from[1], 0.0])
}

fn plan() -> Result<Value> {
    let walls = walls();
    let geometry = Arc::new(raised(&walls)?);
    let plain = BuildSettings {
        leaf_cost: LeafCost::Linear,
        termination: Termination::Cost { max_depth: None },
        empty_factor: 1.0,
        late_cutting: false,
        clipping: false,
        ..BuildSettings::default()
    };
    let clipped = BuildSettings { clipping: true, ..plain.clone() };
    let cut = BuildSettings { empty_factor: 0.8, late_cutting: true, ..clipped.clone() };
    let rays = random_rays(&geometry.bounds());
    let mut trees = serde_json::Map::new();
    let mut made = Vec::new();
    for (name, settings) in [("boxes", &plain), ("clipped", &clipped), ("cut", &cut)] {
        let tree = Arc::new(build(&geometry, settings, &())?.0);
        let accelerator = Accelerator::new(geometry.clone(), tree.clone(), Walk::TaB)?;
        let (nodes, figures) = (nodes(&tree), figures(&tree));
        trees.insert(
            name.into(),
            json!({ "nodes": nodes, "figures": figures, "mean": mean(&accelerator, &rays) }),
        );
        made.push(tree);
    }
    let tree = &made[2];
    let wide = WideTree::compile(tree, &geometry)?;
    let ray = level_ray([2.6, 1.4], [12.3, 3.15]);
    let along = level_ray([1.4, 2.6], [8.5, 3.5]);
    Ok(json!({
        "walls": walls,
        "bounds": flat(&geometry.bounds()),
        "cost": cost_of_cuts(&geometry, &walls),
        "trees": trees,
        "ray": walked(&ray, &geometry, tree, &wide)?,
        "along": walked(&along, &geometry, tree, &wide)?,
        "ropes": links(tree)?,
        "wide": {
            "treelets": wide.treelets(),
            "bytes": wide.bytes(),
            "cells": treelet_cells(&wide),
        },
    }))
}

/// A box in the plan: low x, low y, high x, high y.
fn flat(bounds: &Aabb) -> [f32; 4] {
    [bounds.min[0], bounds.min[1], bounds.max[0], bounds.max[1]]
}

/// What the root costs if it is cut at each of many places: the product's measure of the boxes on either side.
fn cost_of_cuts(geometry: &Geometry, walls: &[Wall]) -> Value {
    let bounds = geometry.bounds();
    let along = |axis: usize| {
        let (low, high) = (bounds.min[axis], bounds.max[axis]);
        let at = |i: u32| low + (high - low) * i as f32 / 1000.0;
        let ends = walls.iter().flat_map(|wall| wall.map(|end| end[axis]));
        let mut places: Vec<f32> =
            (1..1000).map(at).chain(ends).filter(|&x| x > low && x < high).collect();
        places.sort_by(f32::total_cmp);
        places.dedup();
        let costs = places.iter().map(|&place| {
            let (below, above) = bounds.split(axis, place);
            let reach = |wall: &Wall| {
                let [a, b] = wall.map(|end| end[axis]);
                (a.min(b), a.max(b))
            };
            let count = |holds: &dyn Fn(f32, f32) -> bool| {
                walls.iter().map(reach).filter(|&(from, to)| holds(from, to)).count()
            };
            let left = count(&|from, _| from < place);
            let right = count(&|_, to| to > place);
            // Walls in the plane go to the side where they cost less.
            let within = count(&|from, to| from == place && to == place);
            let cost = |left: usize, right: usize| {
                MacDonaldBooth.cost(&Cut {
                    area: bounds.area(),
                    area_left: below.area(),
                    area_right: above.area(),
                    cost_left: LeafCost::Linear.cost(left),
                    cost_right: LeafCost::Linear.cost(right),
                    ..Cut::default()
                })
            };
            cost(left + within, right).min(cost(left, right + within))
        });
        let costs: Vec<f64> = costs.collect();
        json!({ "places": places, "costs": costs })
    };
    json!({ "x": along(0), "y": along(1), "leaf": LeafCost::Linear.leaf(walls.len()) })
}

/// Nodes in depth-first order, the box of each in the plan.
fn nodes(tree: &BspTree) -> Vec<Value> {
    let mut out = Vec::new();
    tree.for_each_node(|_, kind, bounds, depth| {
        out.push(match kind {
            NodeKind::Inner { axis, split, left, right } => json!({
                "box": flat(bounds), "depth": depth, "axis": axis, "split": split, "children": [left, right],
            }),
            NodeKind::Leaf { first, count } => json!({
                "box": flat(bounds), "depth": depth, "walls": tree.leaf_refs(first, count),
            }),
        });
    });
    out
}

/// The children of all treelets that are leaves: the treelet, the depth of treelets, and the box in the plan.
fn treelet_cells(tree: &WideTree) -> Vec<(usize, usize, [f32; 4])> {
    let mut out = Vec::new();
    let mut open = vec![(tree.root(), *tree.bounds(), 0)];
    while let Some((code, bounds, depth)) = open.pop() {
        let line = code_line(code);
        let treelet = tree.lines().treelet(line);
        // Planes in heap order; an absent one is infinite, and all of its cell is on the lower side.
        let mut cells = vec![(0, bounds)];
        while let Some((heap, bounds)) = cells.pop() {
            match (heap < 7).then(|| (treelet.axis(heap), treelet.plane[heap])) {
                Some((axis, place)) if place.is_finite() => {
                    let (below, above) = bounds.split(axis, place);
                    cells.extend([(2 * heap + 1, below), (2 * heap + 2, above)]);
                }
                Some(_) => cells.push((2 * heap + 1, bounds)),
                None => match treelet.child[heap - 7] {
                    code if code != 0 && code & LEAF == 0 => open.push((code, bounds, depth + 1)),
                    _ => out.push((line, depth, flat(&bounds))),
                },
            }
        }
    }
    out
}

fn figures(tree: &BspTree) -> Value {
    let stats = TreeStats::of(tree);
    json!({
        "inner": stats.inner_nodes, "leaves": stats.leaves, "empty": stats.empty_leaves,
        "references": stats.references, "depth": stats.max_depth, "bytes": stats.bytes,
    })
}

/// Rays from random places of a box in random directions, level: always the same ones.
fn random_rays(bounds: &Aabb) -> Vec<Ray> {
    let mut state = 1_u64;
    let mut uniform = move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1_u64 << 24) as f32
    };
    let mut place =
        |axis: usize| bounds.min[axis] + (bounds.max[axis] - bounds.min[axis]) * uniform();
    let origins: Vec<[f32; 2]> = (0..RAYS).map(|_| [place(0), place(1)]).collect();
    let angles = (0..RAYS).map(|_| uniform() * std::f32::consts::TAU);
    origins
        .into_iter()
        .zip(angles)
        .map(|([x, y], a)| level_ray([x, y], [x + a.cos(), y + a.sin()]))
        .collect()
}

fn counted(counts: &Counts) -> Value {
    json!({
        "tests": counts.intersection_tests, "steps": counts.traversal_steps, "leaves": counts.leaf_visits,
        "empty": counts.empty_leaf_visits, "crossings": counts.rope_crossings,
        "rope_tree_steps": counts.rope_tree_steps, "restarts": counts.restarts,
    })
}

/// Means over closest hits of rays.
fn mean(accelerator: &Accelerator, rays: &[Ray]) -> Value {
    let mut counts = Counts::default();
    for ray in rays {
        accelerator.closest_hit(ray, &mut counts);
    }
    let mean = |sum: u64| sum as f64 / rays.len() as f64;
    json!({
        "tests": mean(counts.intersection_tests), "steps": mean(counts.traversal_steps),
        "leaves": mean(counts.leaf_visits), "empty": mean(counts.empty_leaf_visits),
    })
}

/// A ray with its answers and counts by every walk, and the leaves along it with the parameters between which it is inside.
fn walked(
    ray: &Ray,
    geometry: &Arc<Geometry>,
    tree: &Arc<BspTree>,
    wide: &WideTree,
) -> Result<Value> {
    let mut walks = serde_json::Map::new();
    let mut answer = None;
    let start = Accelerator::new(geometry.clone(), tree.clone(), Walk::TaB)?.locate(ray.origin);
    for walk in Walk::ALL {
        let accelerator = Accelerator::new(geometry.clone(), tree.clone(), walk)?;
        let mut counts = Counts::default();
        let hit = accelerator.closest_hit(ray, &mut counts).context("the ray hits nothing")?;
        anyhow::ensure!(
            answer.is_none_or(|answer| answer == (hit.t, hit.prim_id)),
            "walks disagree"
        );
        answer = Some((hit.t, hit.prim_id));
        walks.insert(walk.name().into(), counted(&counts));
        if matches!(walk, Walk::Ropes | Walk::RopeTrees) {
            let mut counts = Counts::default();
            accelerator.closest_hit_from(ray, start, &mut counts);
            walks.insert(format!("{} from its leaf", walk.name()), counted(&counts));
        }
    }
    let BatchEvents { steps, leaves, blocks, .. } =
        BatchCaster::new(wide, geometry).closest_hit_one_events(ray);
    let mut inside = Vec::new();
    tree.for_each_node(|node, kind, bounds, _| {
        if let (NodeKind::Leaf { .. }, Some((enter, exit))) = (kind, within(ray, bounds)) {
            inside.push((enter, exit, node));
        }
    });
    inside.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(json!({
        "origin": ray.origin, "direction": ray.dir, "hit": answer, "walks": walks,
        "wide": { "steps": steps, "leaves": leaves, "blocks": blocks }, "leaves": inside,
    }))
}

/// The parameters between which a level ray is inside of a box, if it is for longer than rounding.
fn within(ray: &Ray, bounds: &Aabb) -> Option<(f64, f64)> {
    let (mut enter, mut exit) = (0.0_f64, f64::INFINITY);
    for axis in 0..2 {
        let at = |plane: f32| {
            (f64::from(plane) - f64::from(ray.origin[axis])) / f64::from(ray.dir[axis])
        };
        let (a, b) = (at(bounds.min[axis]), at(bounds.max[axis]));
        (enter, exit) = (enter.max(a.min(b)), exit.min(a.max(b)));
    }
    (exit > enter + 1e-9).then_some((enter, exit))
}

/// What lies behind each side of each leaf in the plan: the neighbours there, and the lowest node above them all.
fn links(tree: &BspTree) -> Result<Value> {
    let (ropes, trees) = (Ropes::build(tree)?, RopeTrees::build(tree)?);
    ropes.validate(tree)?;
    trees.validate(tree)?;
    let mut ends = vec![0; tree.nodes().len()];
    for node in (0..tree.nodes().len()).rev() {
        ends[node] = match tree.kind(node as u32) {
            NodeKind::Inner { right, .. } => ends[right as usize],
            NodeKind::Leaf { .. } => node as u32 + 1,
        };
    }
    let above = |of: &[u32]| {
        let mut node = BspTree::ROOT;
        while let NodeKind::Inner { left, right, .. } = tree.kind(node) {
            let holds = |child: u32| of.iter().all(|n| (child..ends[child as usize]).contains(n));
            match [left, right].into_iter().find(|&child| holds(child)) {
                Some(child) => node = child,
                None => break,
            }
        }
        node
    };
    let mut leaves = serde_json::Map::new();
    tree.for_each_node(|node, kind, _, _| {
        if let NodeKind::Leaf { .. } = kind {
            let sides = (0..4).map(|face| {
                let found = trees.neighbours(tree, LeafId(node), face);
                let found: Vec<u32> = found.into_iter().map(|leaf| leaf.0).collect();
                json!({ "rope": (!found.is_empty()).then(|| above(&found)), "neighbours": found })
            });
            leaves.insert(node.to_string(), sides.collect());
        }
    });
    Ok(json!({
        "leaves": leaves,
        "bytes_per_leaf": [ropes.bytes_per_leaf(), trees.bytes_per_leaf()],
        "rope_tree_nodes": trees.node_count(),
    }))
}

/// A slice through the tree of the teapot that the batch kernels walk, and through its surface.
fn slice(scene: &ropewalk_scene::Scene) -> Result<Value> {
    let geometry = scene.geometry(FacetPolicy::default())?;
    let (tree, report) = build(&geometry, &BuildSettings::preset(Preset::Balanced), &())?;
    let wide = WideTree::compile(&tree, &geometry)?;
    let bounds = tree.bounds();
    // Off the plane of symmetry, in which cuts like to lie.
    let y = bounds.min[1] + 0.47 * (bounds.max[1] - bounds.min[1]);
    let mut boxes = Vec::new();
    tree.for_each_node(|_, kind, bounds, _| {
        if let NodeKind::Leaf { count, .. } = kind
            && bounds.min[1] <= y
            && y < bounds.max[1]
        {
            boxes.push(json!([bounds.min[0], bounds.min[2], bounds.max[0], bounds.max[2], count]));
        }
    });
    let mut outline = Vec::new();
    for id in 0..geometry.len() as u32 {
        let corners: Vec<[f32; 3]> = match geometry.shape(id) {
            Shape::Triangle(triangle) => triangle.vertices.to_vec(),
            Shape::Patch(patch) => patch.vertices().to_vec(),
            Shape::Polygon(polygon) => polygon.vertices().to_vec(),
            _ => continue,
        };
        let mut ends = Vec::new();
        for (i, a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            if (a[1] < y) != (b[1] < y) {
                let share = (y - a[1]) / (b[1] - a[1]);
                ends.push([a[0] + share * (b[0] - a[0]), a[2] + share * (b[2] - a[2])]);
            }
        }
        outline.push(ends);
    }
    outline.retain(|ends| ends.len() == 2);
    Ok(json!({
        "y": y, "boxes": boxes, "outline": outline, "primitives": geometry.len(),
        "leaves": report.tree.leaves, "empty": report.tree.empty_leaves,
        "references": report.tree.references, "bytes": report.tree.bytes, "treelets": wide.treelets(), "wide_bytes": wide.bytes(), "inner": report.tree.inner_nodes,
    }))
}

/// Counts a pixel of one picture with the trees of several methods.
fn heat(scene: &ropewalk_scene::Scene) -> Result<Value> {
    let geometry = Arc::new(scene.geometry(FacetPolicy::default())?);
    let settings = RenderSettings { size: Some(PICTURE), aov: true, ..RenderSettings::default() };
    let fixed = Termination::Fixed { leaf_size: 2, max_depth: None };
    let exact =
        Method::by_name(Method::EXACT).and_then(|method| method.build).context("no such method")?;
    let best = Method::by_name(Method::DEFAULT)
        .and_then(|method| method.build)
        .context("no such method")?;
    let median =
        BuildSettings { measure: Measure::SpatialMedian, termination: fixed, ..exact.clone() };
    let mut out = serde_json::Map::new();
    for (name, build_settings, walk) in [
        ("median", &median, Walk::TaB),
        ("area", &exact, Walk::TaB),
        ("best", &best, Walk::TaB),
        ("best, rope trees", &best, Walk::RopeTrees),
    ] {
        let (tree, report) = build(&geometry, build_settings, &())?;
        let accelerator = Accelerator::new(geometry.clone(), Arc::new(tree), walk)?;
        let render =
            ropewalk_render::render(scene, &geometry, &accelerator, &settings, Monitor::default())?;
        let aov = render.aov.context("no auxiliary pictures")?;
        let tree = &report.tree;
        out.insert(name.into(), json!({
            "steps": aov.steps, "tests": aov.tests, "leaves": tree.leaves, "references": tree.references,
        }));
    }
    Ok(json!({ "size": PICTURE, "primitives": geometry.len(), "methods": out }))
}
