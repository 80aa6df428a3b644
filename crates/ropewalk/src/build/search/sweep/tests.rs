//! The sweep against an O(N^2) evaluation of all candidate planes by direct counting.

use super::*;
use crate::build::TerminationEstimator;
use crate::build::arena::Arena;
use crate::build::fragment::Fragment;
use crate::cost::{HavranPrinted, HavranPrintedCrossed, LeafCost, MacDonaldBooth, Termination};
use crate::geometry::Geometry;
use crate::primitive::{Primitive, Sides, Triangle};
use proptest::prelude::*;

/// Relative difference allowed between the two ways to add up areas: some hundred roundings.
const TOLERANCE: f64 = 1e-9;

fn fragments(geometry: &Geometry) -> Vec<Fragment> {
    (0..geometry.len() as u32)
        .map(|prim| Fragment::new(prim, &geometry.shape(prim).bounds()))
        .collect()
}

/// The area below a plane by summing each ramp's definition.
fn direct_area(blockage: &Blockage<'_>, node: &NodeView<'_>, axis: usize, x: f64) -> (f64, f64) {
    let mut ramps = Vec::new();
    blockage.collect_ramps(node.fragments.iter().map(|f| f.prim()), &node.cell, axis, &mut ramps);
    let (mut below, mut in_plane) = (0.0, 0.0);
    for r in &ramps {
        let d = x - r.x;
        if d > 0.0 {
            below += r.step + r.width * d + 0.5 * r.slope * d * d;
        } else if d == 0.0 {
            in_plane += r.step;
        }
    }
    (below, in_plane)
}

/// The lowest cost over all coordinates of all fragments, each counted and summed directly.
fn brute_force<M: CostModel>(search: &Sweep<'_, M>, node: &NodeView<'_>) -> Option<f64> {
    let mut best: Option<f64> = None;
    let count = node.fragments.len();
    for axis in 0..3 {
        let Some(areas) = CellAreas::new(&node.cell, axis) else { continue };
        for position in node.fragments.iter().flat_map(|f| [f.min(axis), f.max(axis)]) {
            let counts = Counts::of(node.fragments, axis, position);
            for planar_left in [true, false] {
                let (left, right) = counts.children(planar_left);
                if !areas.makes_progress(position, left, right, count) {
                    continue;
                }
                let ends = search.blockage.map_or((0.0, 0.0), |blockage| {
                    let (below, in_plane) =
                        direct_area(blockage, node, axis, areas.local(position));
                    let (all, rest) = direct_area(blockage, node, axis, node.cell.extent(axis));
                    let in_plane = if counts.planar > 0 { in_plane } else { 0.0 };
                    let area_left = if planar_left { below + in_plane } else { below };
                    ends_of_sides(blockage, &areas, position, area_left, all + rest - area_left)
                });
                let cost = search.pricing.price(
                    &search.model,
                    &areas,
                    position,
                    count,
                    (left, right),
                    ends,
                );
                best = Some(best.map_or(cost, |b: f64| b.min(cost)));
            }
        }
    }
    best
}

fn check<M: CostModel>(model: M, geometry: &Geometry, estimator: TerminationEstimator) {
    let blockage = Blockage::new(geometry, estimator, None);
    let pricing = Pricing {
        leaf_cost: LeafCost::Linear,
        traversal_cost: 1.0,
        empty_factor: 0.8,
        size_unit: 0.0,
        max_size_price: 0.8,
    };
    let blockage = M::USES_TERMINATION.then_some(&blockage);
    let search = Sweep { model, pricing, blockage };
    let (arena, size) = Arena::new(fragments(geometry), true, false);
    let node = NodeView {
        cell: geometry.bounds(),
        depth: 0,
        fragments: arena.fragments(&size),
        events: arena.events(&size),
        rays: None,
        crowding: 1.0,
    };
    let found = search.best_plane(&node, &mut SearchBuffers::default());
    let expected = brute_force(&search, &node);
    match (found, expected) {
        (None, None) => {}
        (Some(plane), Some(cost)) => {
            assert!((plane.cost - cost).abs() <= TOLERANCE * cost, "{plane:?} costs {cost}");
            let counts = Counts::of(node.fragments, plane.axis, plane.position);
            assert_eq!(counts.children(plane.planar_left), (plane.left, plane.right));
        }
        other => panic!("{}: {other:?}", M::NAME),
    }
}

fn coordinate(grid: bool) -> BoxedStrategy<f32> {
    if grid {
        (-2i8..=2).prop_map(f32::from).boxed()
    } else {
        (-1.0f32..1.0, -6i32..4).prop_map(|(m, e)| m * 2f32.powi(e)).boxed()
    }
}

proptest! {
    #[test]
    fn the_optimum_is_the_brute_force_optimum(
        triangles in any::<bool>().prop_flat_map(|grid| {
            prop::collection::vec(
                prop::array::uniform3(prop::array::uniform3(coordinate(grid))), 1..24)
        }),
        flat in prop::option::of(0usize..3),
    ) {
        let mut geometry = Geometry::new();
        for mut vertices in triangles {
            if let Some(axis) = flat {
                vertices.iter_mut().for_each(|v| v[axis] = -1.0);
            }
            geometry.push(Triangle { vertices }, Sides::Both).expect("finite triangle");
        }
        let surface = TerminationEstimator::SurfaceArea { beta: Some(0.7) };
        for estimator in [surface, TerminationEstimator::Projection] {
            check(MacDonaldBooth, &geometry, estimator);
            check(HavranPrinted, &geometry, estimator);
            check(HavranPrintedCrossed, &geometry, estimator);
            check(Termination, &geometry, estimator);
        }
    }
}

#[test]
fn a_shortlist_keeps_the_cheapest_in_order() {
    let plane =
        |cost: f64, axis| Plane { axis, position: 0.0, planar_left: true, cost, left: 1, right: 1 };
    let mut list = Shortlist::new(3);
    for (axis, cost) in [5.0, 3.0, 4.0, 3.0, 9.0, 1.0].into_iter().enumerate() {
        list.offer(plane(cost, axis));
    }
    let kept: Vec<_> = list.planes.iter().map(|p| (p.cost, p.axis)).collect();
    assert_eq!(kept, [(1.0, 5), (3.0, 1), (3.0, 3)]);
}
