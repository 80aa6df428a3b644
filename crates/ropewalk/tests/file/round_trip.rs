//! What is opened is what was saved.

use crate::property::{points, rays, shared};
use crate::scenes::{Ready, all, coincident, soup};
use ropewalk::file::{
    Check, Contents, Extra, Opened, Tag, geometry_hash, open, triangles_hash, write,
};
use ropewalk::kernel::{AllHits, BatchCaster, BatchHit, Level, SharedBytes, Sorting};
use ropewalk::point::PointQueries;
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Ray};
use std::sync::Arc;

/// Every answer of a level.
#[derive(Debug, PartialEq)]
struct Answers {
    closest: BatchHit,
    occluded: Vec<bool>,
    all: AllHits,
    first: AllHits,
    count: Vec<u32>,
    points: String,
}

fn answers(tree: &WideTree, geometry: &Geometry, rays: &[Ray], level: Level) -> Option<Answers> {
    let caster = BatchCaster::new(tree, geometry).with_level(level)?;
    let points = PointQueries::new(tree, geometry).ok().map(|queries| {
        let (queries, points) = (queries.with_level(level).unwrap(), points(geometry));
        let closest = queries.closest_point(&points);
        let cells = queries.locate(&points);
        let boxes: Vec<_> =
            cells.iter().map(|cell| cell.map(|cell| queries.cell_box(cell))).collect();
        let number = queries.winding_number(&points);
        // As text, since NaN does not equal itself.
        format!("{closest:?} {:?} {number:?} {cells:?} {boxes:?}", queries.signed_distance(&points))
    });
    Some(Answers {
        closest: caster.closest_hit(rays),
        occluded: caster.occluded(rays),
        all: caster.all_hits(rays),
        first: caster.with_sorting(Sorting::Always).first_hits(rays, 3),
        count: caster.count_hits(rays),
        points: points.unwrap_or_default(),
    })
}

fn opened(bytes: &[u8]) -> Opened {
    let bytes = shared(bytes);
    let scene = open(&bytes, Check::Everything).unwrap();
    assert_eq!(scene.bytes, (*bytes).as_ref().len() as u64);
    scene
}

#[test]
fn every_answer_at_every_level() {
    for (name, ready) in all() {
        let scene = opened(&ready.bytes());
        assert!(scene.tree.is_shared(), "{name}");
        assert_eq!(scene.geometry.is_shared(), !matches!(name, "ball" | "mixed"), "{name}");
        assert_eq!(scene.figures.as_ref(), Some(&ready.figures), "{name}");
        assert_eq!(scene.geometry_hash, geometry_hash(&ready.geometry).unwrap(), "{name}");
        assert_eq!(scene.geometry.len(), ready.geometry.len(), "{name}");
        assert_eq!(scene.geometry.bounds(), ready.geometry.bounds(), "{name}");
        assert_eq!(scene.tree.treelets(), ready.tree.treelets(), "{name}");
        assert_eq!(scene.tree.blocks(), ready.tree.blocks(), "{name}");
        let rays = rays(&ready.geometry);
        for level in Level::ALL {
            let before = answers(&ready.tree, &ready.geometry, &rays, level);
            assert_eq!(answers(&scene.tree, &scene.geometry, &rays, level), before, "{name}");
        }
        for prim in 0..ready.geometry.len() as u32 {
            assert_eq!(scene.geometry.sides(prim), ready.geometry.sides(prim), "{name} {prim}");
            assert_eq!(
                scene.geometry.triangle(prim),
                ready.geometry.triangle(prim),
                "{name} {prim}"
            );
        }
    }
}

#[test]
fn what_was_opened_is_saved_with_the_same_bytes() {
    for (name, ready) in all() {
        let bytes = ready.bytes();
        let scene = opened(&bytes);
        let contents = Contents {
            figures: scene.figures.as_ref(),
            ..Contents::new(&scene.tree, &scene.geometry)
        };
        let mut again = Vec::new();
        write(&contents, &mut again).unwrap();
        assert!(again == bytes, "{name}");
    }
}

#[test]
fn threads_do_not_change_a_byte() {
    for geometry in [soup(20_000, 7, true), coincident(5_000)] {
        let bytes = Ready::with_threads(geometry.clone(), 1).bytes();
        for threads in [2, 3, 7] {
            assert!(Ready::with_threads(geometry.clone(), threads).bytes() == bytes, "{threads}");
        }
    }
}

#[test]
fn the_owner_lives_as_long_as_what_reads_it() {
    let ready = Ready::new(soup(200, 4, false));
    let owner = shared(&ready.bytes());
    let Opened { tree, geometry, .. } = open(&owner, Check::Structure).unwrap();
    assert!(Arc::strong_count(&owner) > 1);
    let copy = geometry.clone();
    drop(owner);
    drop(geometry);
    let rays = rays(&copy);
    let expected = BatchCaster::new(&ready.tree, &ready.geometry).closest_hit(&rays);
    assert_eq!(BatchCaster::new(&tree, &copy).closest_hit(&rays), expected);
}

#[test]
fn an_opened_geometry_can_be_built_over_and_grow() {
    let ready = Ready::new(soup(300, 8, true));
    let scene = opened(&ready.bytes());
    assert!(Ready::new(scene.geometry.clone()).bytes() == ready.bytes());
    let (mut before, mut after) = (ready.geometry.clone(), scene.geometry.clone());
    for geometry in [&mut before, &mut after] {
        let triangle = soup(1, 9, false).triangle(0).unwrap();
        assert_eq!(geometry.push(triangle, ropewalk::Sides::Both), Ok(300));
    }
    assert!(!after.is_shared() && scene.geometry.is_shared());
    assert_eq!(geometry_hash(&before).unwrap(), geometry_hash(&after).unwrap());
}

#[test]
fn hashes_tell_geometries_apart() {
    let soup = |n, seed, sided| geometry_hash(&crate::scenes::soup(n, seed, sided)).unwrap();
    let hashes = [soup(9, 1, false), soup(9, 1, true), soup(9, 2, false), soup(8, 1, false)];
    let empty = geometry_hash(&Geometry::new()).unwrap();
    for (i, hash) in hashes.iter().enumerate() {
        assert!(!hashes[..i].contains(hash) && *hash != empty, "{i}");
    }
    assert_eq!(triangles_hash([]), empty);
    // More triangles than are hashed at once.
    let many = crate::scenes::soup(10_000, 3, false);
    let triangles = (0..10_000).map(|i| many.triangle(i).unwrap().vertices);
    assert_eq!(triangles_hash(triangles), geometry_hash(&many).unwrap());
}

#[test]
fn sections_of_others_are_kept() {
    let ready = Ready::new(soup(50, 6, false));
    let extra = [
        Extra { tag: Tag(*b"mesh"), bytes: vec![1, 2, 3] },
        Extra { tag: Tag(*b"note"), bytes: Vec::new() },
    ];
    let contents = Contents { extra: &extra, ..ready.contents() };
    let mut bytes = Vec::new();
    write(&contents, &mut bytes).unwrap();
    assert_eq!(opened(&bytes).extra, extra);
}

#[test]
fn users_primitives_cannot_be_saved() {
    let mut geometry = soup(3, 1, false);
    let sphere = ropewalk::primitive::Sphere::new([0.0; 3], 1.0).unwrap();
    geometry.push(ropewalk::Shape::custom(sphere), ropewalk::Sides::Both).unwrap();
    let ready = Ready::new(geometry);
    let error = write(&ready.contents(), &mut Vec::new()).unwrap_err();
    assert_eq!(error.to_string(), "primitive 3 is of a kind that cannot be saved");
}

#[test]
fn writers_that_fail_are_heard() {
    struct Full(usize);
    impl std::io::Write for Full {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            let n = bytes.len().min(self.0);
            self.0 -= n;
            if n == 0 { Err(std::io::ErrorKind::StorageFull.into()) } else { Ok(n) }
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let ready = Ready::new(soup(100, 2, false));
    let whole = ready.bytes().len();
    for room in (0..whole).step_by(997) {
        assert!(write(&ready.contents(), &mut Full(room)).is_err(), "{room}");
    }
    write(&ready.contents(), &mut Full(whole)).unwrap();
}

#[test]
fn addresses_that_do_not_suit_are_refused() {
    struct Off(SharedBytes);
    impl AsRef<[u8]> for Off {
        fn as_ref(&self) -> &[u8] {
            &(*self.0).as_ref()[1..]
        }
    }
    let mut bytes = vec![0];
    bytes.extend(Ready::new(soup(10, 1, false)).bytes());
    let off: SharedBytes = Arc::new(Off(shared(&bytes)));
    let error = open(&off, Check::Structure).err().unwrap();
    assert!(error.to_string().contains("no multiple of 64"), "{error}");
}
