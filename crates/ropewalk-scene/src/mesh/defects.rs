//! What may be wrong with a mesh.

use super::{ASKED_EVERY, Mesh};
use crate::watched::Cancelled;
use ropewalk::build::Monitor;
use std::collections::HashMap;

/// Defects of a mesh. Vertices at the same place count as one here, since STL knows no others and glTF splits vertices
/// where looks change; the mesh itself stays as it is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Defects {
    /// Vertices at the place of an earlier one.
    pub equal_vertices: usize,
    /// Vertices of no face.
    pub isolated_vertices: usize,
    /// Faces without area: with two corners at one place, or three in a line.
    pub degenerate_faces: usize,
    /// Faces with the same three corners as an earlier one, however turned.
    pub duplicate_faces: usize,
    /// Edges of one face.
    pub boundary_edges: usize,
    /// Connected pieces of these: holes and rims.
    pub boundary_loops: usize,
    /// Edges of more than two faces.
    pub non_manifold_edges: usize,
    /// Edges of two faces that go along them in the same direction: one of the two is turned.
    pub turned_edges: usize,
}

impl Defects {
    /// True if every edge has two faces, turned alike: the surface has an inside.
    pub fn is_closed(&self) -> bool {
        self.boundary_edges == 0 && self.non_manifold_edges == 0 && self.turned_edges == 0
    }
}

impl Mesh {
    /// Looks for defects, in the order of n log n steps, until the monitor cancels it. Takes some 60 bytes a triangle.
    ///
    /// # Errors
    /// `None` if the monitor cancelled it.
    pub fn defects(&self, monitor: &dyn Monitor) -> Option<Defects> {
        self.find_defects(monitor).ok()
    }

    fn find_defects(&self, monitor: &dyn Monitor) -> Result<Defects, Cancelled> {
        let ask = || if monitor.is_cancelled() { Err(Cancelled) } else { Ok(()) };
        let mut found = Defects::default();
        let place = self.places();
        ask()?;
        let names_itself = |(i, &first): (usize, &u32)| first != i as u32;
        found.equal_vertices = place.iter().enumerate().filter(|&x| names_itself(x)).count();
        let mut is_used = vec![false; self.vertices.len()];
        self.faces.iter().flatten().for_each(|&i| is_used[i as usize] = true);
        found.isolated_vertices = is_used.into_iter().filter(|used| !used).count();
        let (mut edges, mut corners) = (Vec::new(), Vec::new());
        for (number, face) in self.faces.iter().enumerate() {
            if number.is_multiple_of(ASKED_EVERY) {
                ask()?;
            }
            let [a, b, c] = face.map(|i| place[i as usize]);
            let is_line = a == b || b == c || c == a;
            found.degenerate_faces += usize::from(is_line || self.is_flat([a, b, c]));
            let mut sorted = [a, b, c];
            sorted.sort_unstable();
            corners.push(sorted);
            // What has only two corners has no edges of a surface.
            if !is_line {
                edges.extend([[a, b], [b, c], [c, a]].map(Edge::new));
            }
        }
        corners.sort_unstable();
        found.duplicate_faces = corners.windows(2).filter(|pair| pair[0] == pair[1]).count();
        drop(corners);
        ask()?;
        edges.sort_unstable();
        let mut rims = Rims::default();
        for same in edges.chunk_by(|x, y| x.ends == y.ends) {
            match same {
                [rim] => {
                    found.boundary_edges += 1;
                    rims.join(rim.ends);
                }
                [first, second] => {
                    found.turned_edges += usize::from(first.is_backward == second.is_backward);
                }
                _ => found.non_manifold_edges += 1,
            }
        }
        found.boundary_loops = rims.pieces();
        Ok(found)
    }

    /// For each vertex the first one at its place.
    pub(super) fn places(&self) -> Vec<u32> {
        // 0.0 and -0.0 are one place.
        let key = |i: u32| self.vertices[i as usize].map(|x| (x + 0.0).to_bits());
        let mut order: Vec<u32> = (0..self.vertices.len() as u32).collect();
        order.sort_unstable_by_key(|&i| (key(i), i));
        let mut place = vec![0; order.len()];
        for same in order.chunk_by(|&i, &j| key(i) == key(j)) {
            same.iter().for_each(|&i| place[i as usize] = same[0]);
        }
        place
    }

    /// True of a triangle without area in double precision. Edges are scaled first, so that no product overflows or underflows.
    fn is_flat(&self, face: [u32; 3]) -> bool {
        let [a, b, c] = face.map(|i| self.vertices[i as usize]);
        let edge = |p: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| p[i] - a[i]) };
        let (e, f) = (edge(b), edge(c));
        let most = e.iter().chain(&f).fold(0.0, |most: f64, x| most.max(x.abs()));
        let (e, f) = (e.map(|x| x / most), f.map(|x| x / most));
        most == 0.0
            || (0..3).all(|i| e[(i + 1) % 3] * f[(i + 2) % 3] == e[(i + 2) % 3] * f[(i + 1) % 3])
    }
}

/// An edge by its ends in order.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    ends: [u32; 2],
    is_backward: bool,
}

impl Edge {
    fn new([a, b]: [u32; 2]) -> Edge {
        Edge { ends: [a.min(b), a.max(b)], is_backward: a > b }
    }
}

/// Connected pieces of boundary edges (Tarjan's union by halving of paths).
#[derive(Default)]
struct Rims {
    above: HashMap<u32, u32>,
}

impl Rims {
    fn root(&mut self, mut i: u32) -> u32 {
        loop {
            let above = *self.above.entry(i).or_insert(i);
            if above == i {
                return i;
            }
            let next = self.above[&above];
            self.above.insert(i, next);
            i = next;
        }
    }

    fn join(&mut self, [a, b]: [u32; 2]) {
        let (a, b) = (self.root(a), self.root(b));
        self.above.insert(a.max(b), a.min(b));
    }

    fn pieces(&self) -> usize {
        self.above.iter().filter(|(i, above)| i == above).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of twelve triangles.
    fn cube() -> Mesh {
        let vertices = (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(f64::from)).collect();
        let quads =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Mesh { vertices, faces }
    }

    fn of(mesh: &Mesh) -> Defects {
        mesh.defects(&()).unwrap()
    }

    #[test]
    fn a_cube_has_none() {
        assert_eq!(of(&cube()), Defects::default());
        assert!(of(&cube()).is_closed());
    }

    #[test]
    fn a_soup_is_closed_where_its_corners_meet() {
        let Mesh { vertices, faces } = cube();
        let corners: Vec<[f64; 3]> =
            faces.iter().flatten().map(|&i| vertices[i as usize]).collect();
        let faces = (0..12).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = Mesh { vertices: corners, faces };
        assert_eq!(of(&mesh), Defects { equal_vertices: 28, ..Defects::default() });
    }

    #[test]
    fn each_defect_is_counted() {
        // Without two opposite sides: two rims of four edges.
        let mut tube = cube();
        tube.faces.drain(..4);
        let expected = Defects { boundary_edges: 8, boundary_loops: 2, ..Defects::default() };
        assert_eq!(of(&tube), expected);
        assert!(!of(&tube).is_closed());
        let mut turned = cube();
        turned.faces[0].swap(0, 1);
        assert_eq!(of(&turned), Defects { turned_edges: 3, ..Defects::default() });
        // A fin on an edge of the cube, a line, a point, a double and a vertex of its own.
        let mut fin = cube();
        fin.vertices.extend([[9.0; 3], [0.5, 0.0, 0.0], [7.0; 3]]);
        fin.faces.extend([[0, 1, 8], [0, 9, 1], [3, 3, 3]]);
        let expected = Defects {
            isolated_vertices: 1,
            degenerate_faces: 2,
            boundary_edges: 4,
            boundary_loops: 1,
            non_manifold_edges: 1,
            ..Defects::default()
        };
        assert_eq!(of(&fin), expected);
        let mut double = cube();
        double.faces.push([2, 0, 3]);
        let expected = Defects { duplicate_faces: 1, non_manifold_edges: 3, ..Defects::default() };
        assert_eq!(of(&double), expected);
    }

    #[test]
    fn small_triangles_have_area() {
        let tiny = |scale: f64| {
            let vertices = [[0.0; 3], [scale, 0.0, 0.0], [0.0, scale, 0.0]].to_vec();
            of(&Mesh { vertices, faces: vec![[0, 1, 2]] }).degenerate_faces
        };
        assert_eq!((tiny(1e-200), tiny(1e37)), (0, 0));
    }
}
