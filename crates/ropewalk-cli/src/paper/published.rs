//! Published figures on the standard scenes, to hold the results against.

use serde::Serialize;

/// Tests and steps a ray that another structure needed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Published {
    /// Intersection tests a ray, N_IT.
    pub intersection_tests: f64,
    /// Traversal steps a ray, N_TS.
    pub traversal_steps: f64,
}

impl Published {
    const fn new(intersection_tests: f64, traversal_steps: f64) -> Self {
        Published { intersection_tests, traversal_steps }
    }

    /// N_IT + N_TS.
    pub fn operations(self) -> f64 {
        self.intersection_tests + self.traversal_steps
    }
}

/// The best octree and the best grid that were published for a standard scene.
#[derive(Clone, Copy, Debug)]
pub struct Efficiency {
    /// Name of the scene.
    pub scene: &'static str,
    /// Best octree.
    pub octree: Published,
    /// Best grid.
    pub grid: Published,
}

/// Where [`EFFICIENCY`] comes from.
pub const SOURCE: &str =
    "V. Havran 1999: the best octree and the best grid on the standard SPD scenes";

/// Best octree and best grid, N_IT and N_TS a ray ([`SOURCE`]).
pub const EFFICIENCY: [Efficiency; 8] = [
    row("balls", (26.4, 16.6), (14.9, 11.3)),
    row("gears", (65.4, 11.7), (17.5, 19.0)),
    row("lattice", (9.0, 17.6), (8.8, 13.7)),
    row("mount", (16.6, 12.7), (13.3, 15.0)),
    row("rings", (31.8, 18.7), (21.5, 33.7)),
    row("teapot", (47.9, 19.2), (13.3, 41.2)),
    row("tetra", (24.1, 13.9), (9.2, 18.2)),
    row("tree", (23.8, 18.5), (3.7, 9.9)),
];

const fn row(scene: &'static str, octree: (f64, f64), grid: (f64, f64)) -> Efficiency {
    Efficiency {
        scene,
        octree: Published::new(octree.0, octree.1),
        grid: Published::new(grid.0, grid.1),
    }
}

/// The published figures of a scene.
pub fn efficiency(scene: &str) -> Option<&'static Efficiency> {
    EFFICIENCY.iter().find(|e| e.scene == scene)
}

/// What the 1997 paper says its combination saves of the reference's operations.
pub const PAPER_SAVING: std::ops::RangeInclusive<f64> = 0.20..=0.38;

/// Measured over predicted in MacDonald and Booth's 529 random scenes of 10,000 rays each: inner
/// nodes, leaves, tests.
pub const MACDONALD_BOOTH_MEASURED: [f64; 3] = [0.75, 0.83, 1.03];
