//! Scenes in `f64`: what is opened is what was saved, altered ones harm nobody, and what they lack is said.

use crate::property::{double_rays_and_points, opens_or_refuses, repair, shared};
use crate::scenes::Ready;
use ropewalk::build::{BuildReport, BuildSettings, Preset};
use ropewalk::double::{DoubleCaster, DoubleGeometry, DoubleTree};
use ropewalk::file::{
    AnyOpened, Check, Contents, Figures, FileError, HEADER_BYTES, OpenedDouble,
    SHAPES_LAYOUT_VERSION, Section, Tag, mesh_hash, open, open_any, write,
};
use ropewalk::kernel::Level;
use ropewalk::point::PointQueries;
use ropewalk_testkit::rays::Draw;

/// A scene in `f64` ready to be saved.
pub struct ReadyDouble {
    tree: DoubleTree,
    geometry: DoubleGeometry,
    report: BuildReport,
}

impl ReadyDouble {
    /// Triangles about ten million, one of them without area.
    pub fn new(triangles: u32, seed: u64) -> Self {
        let mut draw = Draw::new(seed);
        let mut corner = || std::array::from_fn(|_| 1e7 + draw.uniform(0.0, 1.0));
        let vertices: Vec<[f64; 3]> = (0..triangles + 2).map(|_| corner()).collect();
        let mut faces: Vec<[u32; 3]> = (0..triangles).map(|i| [i, i + 1, i + 2]).collect();
        faces.push([0, 0, 1]);
        let geometry = DoubleGeometry::from_triangles(vertices, faces).unwrap();
        let settings = BuildSettings { threads: 1, ..BuildSettings::preset(Preset::Balanced) };
        let (tree, report) = geometry.build(&settings, &()).unwrap();
        ReadyDouble { tree, geometry, report }
    }

    pub fn bytes(&self) -> Vec<u8> {
        let figures = Figures::new(&self.report, Some(Preset::Balanced));
        let contents = Contents::of_double(&self.tree, &self.geometry);
        let mut bytes = Vec::new();
        write(&Contents { figures: Some(&figures), ..contents }, &mut bytes).unwrap();
        bytes
    }
}

fn opened(bytes: &[u8]) -> OpenedDouble {
    match open_any(&shared(bytes), Check::Everything).unwrap() {
        AnyOpened::Double(scene) => *scene,
        AnyOpened::Single(_) => panic!("a scene in f32"),
    }
}

fn section(bytes: &[u8], tag: Tag) -> Section {
    opened(bytes).sections.into_iter().find(|section| section.tag == tag).unwrap()
}

fn refusal(bytes: &[u8]) -> String {
    let error = open_any(&shared(bytes), Check::Structure).err().expect("it must be refused");
    assert!(!opens_or_refuses(bytes));
    error.to_string()
}

/// As text, since NaN does not equal itself.
fn answers(tree: &DoubleTree, geometry: &DoubleGeometry, scene: &OpenedDouble) -> Vec<String> {
    let (rays, points) = double_rays_and_points(scene);
    let levels = Level::ALL.into_iter();
    let casters = levels.filter_map(|level| DoubleCaster::new(tree, geometry).with_level(level));
    let rays = casters.map(|caster| {
        let (closest, all) = (caster.closest_hit(&rays), caster.all_hits(&rays));
        format!("{closest:?} {all:?} {:?}", caster.occluded(&rays))
    });
    let queries = PointQueries::new(tree, geometry).unwrap();
    let found = format!("{:?} {:?}", queries.closest_point(&points), queries.sides(&points));
    let normals =
        (0..geometry.len() as u32).map(|id| format!("{:?}", geometry.normal(id).unwrap()));
    rays.chain([found]).chain(normals).collect()
}

#[test]
fn every_answer_and_every_byte() {
    for triangles in [1, 40, 700] {
        let ready = ReadyDouble::new(triangles, 1);
        let bytes = ready.bytes();
        let scene = opened(&bytes);
        assert!(scene.geometry.is_shared() && scene.tree.wide().is_shared());
        assert_eq!(scene.bytes, bytes.len() as u64);
        assert_eq!(scene.geometry.bounds(), ready.geometry.bounds());
        assert_eq!(scene.geometry.degenerate(), [triangles]);
        let hash = mesh_hash(ready.geometry.vertices(), ready.geometry.faces(), &()).unwrap();
        assert_eq!(scene.geometry_hash, hash);
        let before = answers(&ready.tree, &ready.geometry, &scene);
        assert_eq!(answers(&scene.tree, &scene.geometry, &scene), before);
        let again = Contents::of_double(&scene.tree, &scene.geometry);
        let mut copy = Vec::new();
        write(&Contents { figures: scene.figures.as_ref(), ..again }, &mut copy).unwrap();
        assert!(copy == bytes);
    }
}

#[test]
fn one_precision_for_the_other() {
    let bytes = ReadyDouble::new(20, 2).bytes();
    let refused = open(&shared(&bytes), Check::Structure).err();
    assert_eq!(refused, Some(FileError::Double));
    assert!(FileError::Double.to_string().contains("double precision"));
    let single = Ready::new(crate::scenes::soup(20, 1, false)).bytes();
    let scene = open_any(&shared(&single), Check::Structure).unwrap();
    assert!(matches!(scene, AnyOpened::Single(_)));
}

/// The entry of a section in the table.
fn entry(bytes: &[u8], tag: Tag) -> usize {
    let at = opened(bytes).sections.iter().position(|section| section.tag == tag).unwrap();
    HEADER_BYTES + 64 * at
}

#[test]
fn what_is_missing_or_cannot_be_is_said() {
    let bytes = ReadyDouble::new(40, 3).bytes();
    let renamed = |tag: Tag, name: &[u8; 4]| {
        let (mut bytes, at) = (bytes.clone(), entry(&bytes, tag));
        bytes[at..at + 4].copy_from_slice(name);
        repair(&mut bytes);
        refusal(&bytes)
    };
    assert_eq!(renamed(Tag::FACES, b"face"), "there is no section FACE");
    assert_eq!(renamed(Tag::BOX, b"dbox"), "there is no section DBOX");
    assert_eq!(renamed(Tag::FLAT, b"flat"), "there is no section FLAT");
    for (tag, name) in [(Tag::VERTICES, b"vert"), (Tag::FLAT, b"TRIS"), (Tag::FLAT, b"SIDE")] {
        let said = renamed(tag, name);
        assert!(said.contains("expected primitives in f32, or triangles in f64"), "{said}");
    }
    let boxed = |i: usize, x: f64| {
        let (mut bytes, at) = (bytes.clone(), section(&bytes, Tag::BOX).range().start + 8 * i);
        bytes[at..at + 8].copy_from_slice(&x.to_le_bytes());
        repair(&mut bytes);
        refusal(&bytes)
    };
    for (i, x) in [(0, f64::NAN), (1, 2e7), (2, -1e101), (3, f64::INFINITY), (5, 0.0)] {
        assert!(boxed(i, x).contains("expected corners in order, at most 1e100"));
    }
    for (at, number, words) in [
        (152, 40u64, "section FACE, offset"),
        (152, 0, "at most 0"),
        (160, 2, "section FLAT, offset"),
        (148, 1, "there is no section KIND"),
    ] {
        let mut bytes = bytes.clone();
        let len = if at == 148 { 4 } else { 8 };
        bytes[at..at + len].copy_from_slice(&number.to_le_bytes()[..len]);
        if at == 148 {
            // Other primitives than triangles are of another layout.
            repair(&mut bytes);
            assert!(refusal(&bytes).contains("tree layout version 1"));
            bytes[16] = SHAPES_LAYOUT_VERSION as u8;
        }
        repair(&mut bytes);
        let said = refusal(&bytes);
        assert!(said.contains(words), "{said}");
    }
}

/// Bytes flipped anywhere behind the header, numbers of faces and vertices that name nothing, are infinite or NaN.
#[test]
fn altered_bytes_harm_nobody() {
    let bytes = ReadyDouble::new(150, 4).bytes();
    let mut passed = 0;
    for round in 0..200 {
        let (mut bytes, mut draw) = (bytes.clone(), Draw::new(round));
        for _ in 0..1 + draw.below(8) {
            let at = HEADER_BYTES + draw.below(bytes.len() - HEADER_BYTES);
            bytes[at] = draw.bits() as u8;
        }
        repair(&mut bytes);
        passed += usize::from(opens_or_refuses(&bytes));
    }
    assert!(passed > 50, "too few are opened to say anything: {passed}");
    let words = [f64::NAN, f64::INFINITY, 1e308, -1e308, 5e-324, 0.0];
    for tag in [Tag::VERTICES, Tag::FACES, Tag::FLAT] {
        for share in [0.05, 1.0] {
            for (i, word) in words.into_iter().enumerate() {
                let (mut bytes, mut draw) = (bytes.clone(), Draw::new(i as u64));
                let range = section(&bytes, tag).range();
                for row in bytes[range].chunks_exact_mut(4) {
                    if draw.chance(share) {
                        // Both halves of such numbers, as numbers of vertices and faces too.
                        row.copy_from_slice(&word.to_le_bytes()[4..]);
                    }
                }
                repair(&mut bytes);
                assert!(opens_or_refuses(&bytes), "{tag} {word}");
            }
        }
    }
}
