//! A bench that holds every walk over one tree, and the comparison with brute force.

use ropewalk::traverse::{BruteForce, Counts, NoCounts, RayCaster};
use ropewalk::tree::{BspTree, NodeKind};
use ropewalk::{Accelerator, Geometry, Ray, Walk};
use ropewalk_testkit::rays::Draw;
use ropewalk_testkit::trees::{TreeShape, random_tree};
use std::sync::Arc;

/// Every walk over one tree.
pub struct Bench {
    pub walks: Vec<Accelerator>,
}

impl Bench {
    pub fn new(geometry: Arc<Geometry>, tree: Arc<BspTree>) -> Self {
        let make = |&walk: &Walk| Accelerator::new(geometry.clone(), tree.clone(), walk).unwrap();
        Bench { walks: Walk::ALL.iter().map(make).collect() }
    }

    pub fn random(draw: &mut Draw, geometry: Geometry, shape: TreeShape) -> Self {
        let tree = random_tree(draw, &geometry, shape).unwrap();
        Bench::new(Arc::new(geometry), Arc::new(tree))
    }

    pub fn geometry(&self) -> &Geometry {
        self.walks[0].geometry()
    }

    pub fn tree(&self) -> &BspTree {
        self.walks[0].tree()
    }

    /// Both queries, every walk, against brute force; and a bound on the steps.
    pub fn check(&self, ray: &Ray) {
        let oracle = BruteForce { geometry: self.geometry() };
        let closest = oracle.closest_hit(ray, &mut NoCounts);
        let blocked = oracle.occluded(ray, &mut NoCounts);
        assert_eq!(closest.is_some(), blocked);
        for walk in &self.walks {
            let mut counts = Counts::default();
            let answer = walk.closest_hit(ray, &mut counts);
            assert_eq!(answer, closest, "{:?} {ray:?}", walk.walk());
            let answer = walk.occluded(ray, &mut counts);
            assert_eq!(answer, blocked, "{:?} {ray:?}", walk.walk());
            self.check_steps(walk.walk(), &counts);
        }
    }

    /// The whole ray, then ranges that begin or end exactly at its first hit, beside it, and
    /// somewhere.
    pub fn check_with_ranges(&self, ray: &Ray, draw: &mut Draw) {
        self.check(ray);
        let oracle = BruteForce { geometry: self.geometry() };
        let Some(hit) = oracle.closest_hit(ray, &mut NoCounts) else { return };
        let t = hit.t;
        let other = (f64::from(t) * draw.uniform(0.0, 3.0)) as f32;
        let (low, high) = if other < t { (other, t) } else { (t, other) };
        let ranges = [
            (t, f32::INFINITY),
            (t.next_up(), f32::INFINITY),
            (0.0, t),
            (0.0, t.next_down()),
            (t, t),
            (low, high),
            (f32::NEG_INFINITY, f32::INFINITY),
            (f32::NEG_INFINITY, t.next_down()),
        ];
        let (low, high) = ranges[draw.below(ranges.len())];
        self.check(&ray.with_range(low, high));
    }

    fn check_steps(&self, walk: Walk, counts: &Counts) {
        // Two queries; a restart may visit each node once more.
        let nodes = self.tree().nodes().len() as u64;
        assert!(counts.traversal_steps <= 4 * nodes, "{walk:?} {counts:?}");
        assert!(counts.leaf_visits <= 4 * nodes, "{walk:?} {counts:?}");
    }
}

/// All positions of planes, faces and vertices of boxes, by axis.
pub fn coordinates(bench: &Bench) -> [Vec<f32>; 3] {
    let mut values: [Vec<f32>; 3] = Default::default();
    bench.tree().for_each_node(|_, kind, cell, _| {
        if let NodeKind::Inner { axis, split, .. } = kind {
            values[axis].push(split);
        }
        for a in 0..3 {
            values[a].extend([cell.min[a], cell.max[a]]);
        }
    });
    values
}
