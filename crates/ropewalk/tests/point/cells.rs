//! Cells: found by point, and their boxes.

use crate::meshes::{self, points, trees};
use ropewalk::point::{Cell, PointQueries};
use ropewalk_testkit::rays::Draw;
use std::collections::HashMap;

#[test]
fn a_cell_holds_what_is_found_in_it() {
    let mut draw = Draw::new(6000);
    let single = vec![[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0]]];
    for triangles in [meshes::torus(16, 9), meshes::rough(&mut draw), single] {
        let geometry = meshes::geometry(&triangles, (1.0, 0.0));
        let points = points(&mut draw, &geometry, 200);
        for tree in trees(&mut draw, &geometry) {
            let queries = PointQueries::new(&tree, &geometry).unwrap();
            let cells = queries.locate(&points);
            let mut boxes = HashMap::new();
            for (point, cell) in points.iter().zip(cells) {
                let within = |b: ropewalk::Aabb| {
                    (0..3)
                        .all(|a| f64::from(b.min[a]) <= point[a] && point[a] <= f64::from(b.max[a]))
                };
                assert_eq!(cell.is_some(), within(*tree.bounds()), "{point:?}");
                let Some(cell) = cell else { continue };
                let found = queries.cell_box(cell).unwrap();
                assert!(within(found) && tree.bounds().contains(&found), "{point:?} {found:?}");
                assert_eq!(Cell::from_bits(cell.to_bits()), cell);
                boxes.insert(cell, found);
            }
            // Boxes of different leaves share no inside.
            let boxes: Vec<_> = boxes.into_values().collect();
            for (i, a) in boxes.iter().enumerate() {
                for b in &boxes[..i] {
                    let common = a.intersection(b);
                    assert!((0..3).any(|x| common.extent(x) <= 0.0), "{a:?} {b:?}");
                }
            }
            assert_eq!(queries.locate(&[[f64::NAN, 0.0, 0.0], [1e9; 3]]), [None, None]);
        }
    }
}

/// Any number may be asked about: it is a leaf of the tree, or none.
#[test]
fn numbers_that_are_no_cells() {
    let mut draw = Draw::new(7000);
    let geometry = meshes::geometry(&meshes::torus(8, 6), (1.0, 0.0));
    for tree in trees(&mut draw, &geometry) {
        let queries = PointQueries::new(&tree, &geometry).unwrap();
        let lines = tree.lines().len() as u32;
        let any =
            (0..8 * lines + 64).chain((0..1000).map(|_| draw.bits() as u32)).chain([u32::MAX]);
        let boxes: Vec<_> =
            any.filter_map(|bits| queries.cell_box(Cell::from_bits(bits))).collect();
        assert!(!boxes.is_empty());
        assert!(boxes.iter().all(|b| tree.bounds().contains(b)));
        let volume = |b: &ropewalk::Aabb| (0..3).map(|a| b.extent(a)).product::<f64>();
        // Each leaf once: together they fill the tree's box.
        let all: f64 = boxes.iter().map(volume).sum();
        assert_eq!(queries.cells().len(), boxes.len());
        let whole = volume(tree.bounds());
        assert!((all - whole).abs() < 1e-9 * whole, "{all} of {whole}");
    }
}

/// Every triangle is in the leaves that hold its vertices, and nothing is in what is no leaf.
#[test]
fn leaves_know_their_primitives() {
    let mut draw = Draw::new(8000);
    let geometry = meshes::geometry(&meshes::torus(12, 7), (1.0, 0.0));
    for tree in trees(&mut draw, &geometry) {
        let queries = PointQueries::new(&tree, &geometry).unwrap();
        let cells = queries.cells();
        assert!(cells.is_sorted() && cells.iter().all(|&c| queries.cell_box(c).is_some()));
        for &cell in &cells {
            let found = queries.cell_primitives(cell);
            assert!(found.is_sorted_by(|a, b| a < b), "{found:?}");
            for id in 0..geometry.len() as u32 {
                let ropewalk::Shape::Triangle(t) = geometry.shape(id) else { unreachable!() };
                let centre: [f64; 3] = std::array::from_fn(|a| {
                    t.vertices.iter().map(|v| f64::from(v[a])).sum::<f64>() / 3.0
                });
                if queries.locate(&[centre]) == [Some(cell)] {
                    assert!(found.contains(&id));
                }
            }
        }
        assert!(queries.cell_primitives(Cell::from_bits(u32::MAX)).is_empty());
    }
}
