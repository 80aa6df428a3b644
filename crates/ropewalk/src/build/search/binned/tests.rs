//! Against the exact sweep, and against direct counting.

use super::*;
use crate::aabb::Aabb;
use crate::build::event::Event;
use crate::cost::LeafCost;
use proptest::prelude::*;

/// Relative difference allowed between measures in `f32` and in `f64`: some twenty roundings.
const TOLERANCE: f64 = 1e-5;

fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        (-4i8..=4).prop_map(f32::from),
        (-1.0f32..1.0, -6i32..3).prop_map(|(m, e)| m * 2f32.powi(e))
    ]
}

fn fragments(max: usize) -> impl Strategy<Value = Vec<Fragment>> {
    let corner = || prop::array::uniform3(coordinate());
    let flat = (corner(), corner(), 0usize..6).prop_map(|(a, mut b, axis)| {
        if axis < 3 {
            b[axis] = a[axis];
        }
        Aabb::from_points([a, b])
    });
    prop::collection::vec(flat, 1..max).prop_map(|boxes| {
        boxes.iter().enumerate().map(|(i, b)| Fragment::new(i as u32, b)).collect()
    })
}

fn leaf_cost() -> impl Strategy<Value = LeafCost> {
    prop_oneof![
        Just(LeafCost::Linear),
        (2u32..20).prop_map(|width| LeafCost::Blocks { width }),
        Just(LeafCost::Logarithmic { a: 2.0, b: 1.0 }),
    ]
}

fn search(leaf_cost: LeafCost, size_unit: f64, from: usize) -> Binned {
    let pricing = Pricing {
        leaf_cost,
        traversal_cost: 0.3,
        empty_factor: 0.8,
        size_unit,
        max_size_price: 0.8,
    };
    Binned {
        exact: Sweep { model: MacDonaldBooth, pricing, blockage: None },
        from,
        parallel: false,
    }
}

fn node(fragments: &[Fragment], margin: f32) -> NodeView<'_> {
    let tight = fragments.iter().fold(Aabb::EMPTY, |b, f| b.union(&f.bounds()));
    let cell = Aabb::new(tight.min.map(|x| x - margin), tight.max.map(|x| x + margin));
    NodeView { cell, depth: 0, fragments, events: [&[] as &[Event]; 3], rays: None, crowding: 1.0 }
}

proptest! {
    #[test]
    fn small_nodes_are_searched_exactly(
        fragments in fragments(100), leaf_cost in leaf_cost(), margin in prop_oneof![Just(0.0f32), Just(1.0)],
        size_unit in prop_oneof![Just(0.0), Just(0.5), Just(20.0)]
    ) {
        let (search, view) = (search(leaf_cost, size_unit, usize::MAX), node(&fragments, margin));
        let mut buffers = SearchBuffers::default();
        let swept = search.swept(&view, &mut buffers);
        let found = search.best_plane(&view, &mut buffers);
        if leaf_cost.cost(1) == leaf_cost.cost(fragments.len()) {
            // Only cutting off empty space can pay; what does not pay need not be found.
            let pays = |p: &Plane| p.cost < leaf_cost.leaf(fragments.len());
            prop_assert_eq!(found.filter(pays).map(|p| p.cost), swept.filter(pays).map(|p| p.cost));
        } else {
            prop_assert_eq!(found.is_some(), swept.is_some());
            if let (Some(found), Some(swept)) = (found, swept) {
                prop_assert!((found.cost - swept.cost).abs() <= TOLERANCE * swept.cost, "{found:?} {swept:?}");
            }
        }
    }

    #[test]
    fn planes_have_true_counts_and_make_progress(
        fragments in fragments(400), leaf_cost in leaf_cost(), margin in prop_oneof![Just(0.0f32), Just(1.0)],
        size_unit in prop_oneof![Just(0.0), Just(0.5), Just(20.0)]
    ) {
        let (search, view) = (search(leaf_cost, size_unit, 0), node(&fragments, margin));
        let Some(plane) = search.best_plane(&view, &mut SearchBuffers::default()) else {
            return Ok(());
        };
        let counts = Counts::of(&fragments, plane.axis, plane.position);
        prop_assert_eq!((plane.left, plane.right), counts.children(plane.planar_left));
        let areas = CellAreas::new(&view.cell, plane.axis).expect("an axis with extent");
        prop_assert!(areas.makes_progress(plane.position, plane.left, plane.right, fragments.len()));
        let children = (plane.left, plane.right);
        let pricing = &search.exact.pricing;
        let cost = pricing.price(&MacDonaldBooth, &areas, plane.position, fragments.len(), children, (0.0, 0.0));
        prop_assert_eq!(plane.cost, cost);
    }
}

#[test]
fn extents_beyond_f32_are_swept() {
    let boxes = (0..80).map(|i| {
        let x = if i % 2 == 0 { f32::MIN } else { f32::MAX } * (i as f32 / 80.0);
        Aabb::new([x; 3], [x; 3])
    });
    let fragments: Vec<Fragment> =
        boxes.enumerate().map(|(i, b)| Fragment::new(i as u32, &b)).collect();
    let search = search(LeafCost::Linear, 0.0, 0);
    let (view, mut buffers) = (node(&fragments, 0.0), SearchBuffers::default());
    assert_eq!(search.best_plane(&view, &mut buffers), search.swept(&view, &mut buffers));
}
