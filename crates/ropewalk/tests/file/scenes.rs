//! Small scenes of all kinds, and their bytes.

use ropewalk::build::{BuildSettings, Preset};
use ropewalk::file::{Contents, Figures, write};
use ropewalk::primitive::{Sphere, Triangle};
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Sides};
use ropewalk_testkit::primitives::random_geometry;
use ropewalk_testkit::rays::Draw;

/// A scene ready to be saved.
pub struct Ready {
    pub tree: WideTree,
    pub geometry: Geometry,
    pub figures: Figures,
}

impl Ready {
    pub fn new(geometry: Geometry) -> Ready {
        Self::with_threads(geometry, 1)
    }

    pub fn with_threads(geometry: Geometry, threads: usize) -> Ready {
        let settings = BuildSettings { threads, ..BuildSettings::preset(Preset::Balanced) };
        let (tree, report) = WideTree::build(&geometry, &settings, &()).unwrap();
        let figures = Figures::new(&report, Some(Preset::Balanced));
        Ready { tree, geometry, figures }
    }

    pub fn contents(&self) -> Contents<'_> {
        let Ready { tree, geometry, figures } = self;
        Contents { figures: Some(figures), ..Contents::new(tree, geometry) }
    }

    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let written = write(&self.contents(), &mut bytes).unwrap();
        assert_eq!(written.bytes, bytes.len() as u64);
        bytes
    }
}

/// Small triangles all over the unit cube, hit on both sides or not.
pub fn soup(triangles: usize, seed: u64, sided: bool) -> Geometry {
    let (mut draw, mut geometry) = (Draw::new(seed), Geometry::new());
    for i in 0..triangles {
        let at: [f64; 3] = std::array::from_fn(|_| draw.uniform(0.0, 1.0));
        let mut corner = || std::array::from_fn(|a| (at[a] + draw.uniform(-0.1, 0.1)) as f32);
        let vertices = [corner(), corner(), corner()];
        let sides = [Sides::Both, Sides::Front, Sides::Back][if sided { i % 3 } else { 0 }];
        geometry.push(Triangle { vertices }, sides).unwrap();
    }
    geometry
}

/// Triangles that all lie in one place, so that a leaf has very many blocks, beside some that do not.
pub fn coincident(triangles: usize) -> Geometry {
    let mut geometry = soup(40, 5, false);
    for _ in 0..triangles {
        let vertices = [[0.2, 0.2, 0.5], [0.8, 0.2, 0.5], [0.2, 0.8, 0.5]];
        geometry.push(Triangle { vertices }, Sides::Both).unwrap();
    }
    geometry
}

/// Everything that can be saved.
pub fn all() -> Vec<(&'static str, Ready)> {
    let mut one = Geometry::new();
    one.push(Triangle { vertices: [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] }, Sides::Both)
        .unwrap();
    let mut ball = Geometry::new();
    ball.push(Sphere::new([0.0; 3], 1.0).unwrap(), Sides::Front).unwrap();
    [
        ("empty", Geometry::new()),
        ("one", one),
        ("soup", soup(400, 1, false)),
        ("sided", soup(300, 2, true)),
        ("coincident", coincident(300)),
        ("ball", ball),
        ("mixed", random_geometry(None, 120, 3)),
    ]
    .map(|(name, geometry)| (name, Ready::new(geometry)))
    .into()
}
