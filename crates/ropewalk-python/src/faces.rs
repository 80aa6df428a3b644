//! How Python numbers what is hit: mesh by mesh, a quad as one face of two triangles.

use std::collections::HashSet;
use std::ops::Range;

/// The faces of all meshes, one after another, and the primitives of the engine that they are.
///
/// A quad `(a, b, c, d)` is the triangles `(a, b, c)` and `(a, c, d)`, which follow each other; every other
/// face is one primitive. Primitives that are not there, as an altered file may name them, have the face of
/// their number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Faces {
    /// The first face of each mesh, and the number of faces.
    starts: Vec<u32>,
    /// The face of each primitive, ascending; empty if each primitive is a face.
    of: Vec<u32>,
}

/// Which part of its face a primitive is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// All of it.
    Whole,
    /// The triangle `(a, b, c)` of a quad.
    First,
    /// The triangle `(a, c, d)`.
    Second,
}

impl Part {
    /// Coordinates on the face. Those of a quad are 0 at `a`, `(1, 0)` at `b`, `(1, 1)` at `c`, `(0, 1)` at `d`, and
    /// linear on each of its triangles.
    pub fn coordinates<T: Copy + PartialOrd + std::ops::Add<Output = T> + From<u8>>(
        self,
        [u, v]: [T; 2],
    ) -> [T; 2] {
        let one = T::from(1);
        let sum = if u + v > one { one } else { u + v };
        match self {
            Part::Whole => [u, v],
            Part::First => [sum, v],
            Part::Second => [u, sum],
        }
    }
}

impl Faces {
    /// Faces of one primitive each; `starts` are the first of each mesh and the number of faces.
    pub fn new(starts: Vec<u32>) -> Faces {
        Faces { starts, of: Vec::new() }
    }

    /// The faces of meshes. A table is made only if there are quads.
    pub fn of_meshes(meshes: &[MeshFaces<'_>]) -> Faces {
        let mut starts = vec![0];
        starts.extend(meshes.iter().scan(0, |faces, mesh| {
            *faces += mesh.len() as u32;
            Some(*faces)
        }));
        let has_quads = meshes.iter().any(|mesh| mesh.primitive_count() != mesh.len());
        if !has_quads {
            return Faces::new(starts);
        }
        let mut of = Vec::with_capacity(meshes.iter().map(|mesh| mesh.primitive_count()).sum());
        for (mesh, &first) in meshes.iter().zip(&starts) {
            match mesh {
                MeshFaces::Rows(rows) => {
                    of.extend(rows.triangles().map(|(face, _)| first + face as u32));
                }
                MeshFaces::Single(count) => of.extend((0..*count as u32).map(|face| first + face)),
            }
        }
        Faces { starts, of }
    }

    /// The same faces in other meshes: the first face of each, and the number of faces.
    pub fn with_starts(self, starts: Vec<u32>) -> Faces {
        Faces { starts, ..self }
    }

    /// What [`Faces::primitive_starts`] and [`Faces::seconds`] say; `None` if they say nothing that can be.
    pub fn with_seconds(starts: &[u32], seconds: &[u8]) -> Option<Faces> {
        let count = *starts.last()?;
        if seconds.len() != (count as usize).div_ceil(8) {
            return None;
        }
        let mut of = Vec::with_capacity(count as usize);
        let (mut next, mut after_first) = (0u32, false);
        for prim in 0..count {
            let is_second = seconds[prim as usize / 8] >> (prim % 8) & 1 == 1;
            if is_second && !after_first {
                return None;
            }
            next += u32::from(!is_second);
            of.push(next - 1);
            after_first = !is_second;
        }
        let mut faces = Vec::with_capacity(starts.len());
        for &start in starts {
            let is_second = |i: usize| i > 0 && of[i - 1] == of[i];
            if (start as usize) < of.len() && is_second(start as usize) {
                return None;
            }
            faces.push(of.get(start as usize).copied().unwrap_or(next));
        }
        Some(Faces { starts: faces, of })
    }

    /// The first primitive of each mesh, and the number of primitives.
    pub fn primitive_starts(&self) -> Vec<u32> {
        self.starts.iter().map(|&face| self.primitives(face).start).collect()
    }

    /// A bit a primitive, set for the second triangles of quads; `None` without quads.
    pub fn seconds(&self) -> Option<Vec<u8>> {
        self.has_quads().then(|| {
            let mut bits = vec![0; self.of.len().div_ceil(8)];
            for prim in 1..self.of.len() {
                bits[prim / 8] |= u8::from(self.of[prim] == self.of[prim - 1]) << (prim % 8);
            }
            bits
        })
    }

    /// The first face of each mesh, and the number of faces.
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// Number of faces.
    pub fn len(&self) -> usize {
        self.starts.last().map_or(0, |&n| n as usize)
    }

    /// True if any face is more than one primitive.
    pub fn has_quads(&self) -> bool {
        !self.of.is_empty()
    }

    /// Bytes of the table of quads.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.of[..])
    }

    /// The face of a primitive.
    #[inline]
    pub fn of(&self, prim: u32) -> u32 {
        self.of.get(prim as usize).copied().unwrap_or(prim)
    }

    /// Which part of its face a primitive is.
    pub fn part(&self, prim: u32) -> Part {
        let face = |prim: Option<u32>| prim.and_then(|prim| self.of.get(prim as usize));
        match face(Some(prim)) {
            None => Part::Whole,
            Some(own) if face(prim.checked_sub(1)) == Some(own) => Part::Second,
            Some(own) if face(prim.checked_add(1)) == Some(own) => Part::First,
            Some(_) => Part::Whole,
        }
    }

    /// The primitives of a face, all behind the last for one that is not there.
    pub fn primitives(&self, face: u32) -> Range<u32> {
        if self.of.is_empty() {
            return face..face.saturating_add(1);
        }
        let first = self.of.partition_point(|&of| of < face);
        let count = self.of[first..].iter().take_while(|&&of| of == face).count();
        first as u32..(first + count) as u32
    }

    /// The mesh of a primitive.
    #[inline]
    pub fn mesh(&self, prim: u32) -> usize {
        if self.starts.len() == 2 {
            return 0;
        }
        let face = self.of(prim);
        self.starts.partition_point(|&start| start <= face) - 1
    }

    /// Replaces primitives by faces within their meshes; misses become -1.
    pub fn number(&self, prim: &mut [u32], geom: &mut [i32]) {
        if self.has_quads() {
            prim.iter_mut().for_each(|prim| *prim = self.of(*prim));
        }
        if self.starts.len() == 2 {
            for (prim, geom) in prim.iter().zip(geom) {
                *geom = -i32::from(*prim == u32::MAX);
            }
            return;
        }
        for (prim, geom) in prim.iter_mut().zip(geom) {
            if *prim == u32::MAX {
                *geom = -1;
                continue;
            }
            let mesh = self.starts.partition_point(|&start| start <= *prim) - 1;
            *prim -= self.starts[mesh];
            *geom = mesh as i32;
        }
    }

    /// The face of a mesh, numbered through all meshes; `None` for a miss and for what is not there.
    pub fn face(&self, prim: i32, geom: i32) -> Option<u32> {
        let (prim, geom) = (u32::try_from(prim).ok()?, usize::try_from(geom).ok()?);
        let (start, end) = (*self.starts.get(geom)?, *self.starts.get(geom + 1)?);
        let face = start.checked_add(prim)?;
        (face < end).then_some(face)
    }
}

/// The faces of a mesh.
#[derive(Clone, Copy, Debug)]
pub enum MeshFaces<'a> {
    /// Triangles and quads.
    Rows(Rows<'a>),
    /// So many of one primitive each.
    Single(usize),
}

impl MeshFaces<'_> {
    /// Number of faces.
    pub fn len(&self) -> usize {
        match self {
            MeshFaces::Rows(rows) => rows.len(),
            MeshFaces::Single(count) => *count,
        }
    }

    /// Number of primitives.
    pub fn primitive_count(&self) -> usize {
        match self {
            MeshFaces::Rows(rows) => rows.triangle_count(),
            MeshFaces::Single(count) => *count,
        }
    }
}

/// Faces of three or four corners, a row each; a row of four whose last two are equal is a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Rows<'a> {
    corners: &'a [u32],
    width: usize,
}

impl<'a> Rows<'a> {
    /// Rows of `width` corners; `None` if these are not three or four.
    pub fn new(corners: &'a [u32], width: usize) -> Option<Rows<'a>> {
        matches!(width, 3 | 4).then_some(Rows { corners, width })
    }

    /// Number of faces.
    pub fn len(&self) -> usize {
        self.corners.len() / self.width
    }

    /// The faces if all are rows of three.
    pub fn triangles_alone(&self) -> Option<&'a [[u32; 3]]> {
        (self.width == 3).then_some(self.corners.as_chunks::<3>().0)
    }

    /// The corners of each face, of triangles the last one twice.
    fn corners(self) -> impl Iterator<Item = [u32; 4]> + 'a {
        self.corners
            .chunks_exact(self.width)
            .map(|row| [row[0], row[1], row[2], row[row.len() - 1]])
    }

    /// The triangles of all faces, each with its face.
    pub fn triangles(self) -> impl Iterator<Item = (usize, [u32; 3])> + 'a {
        self.corners().enumerate().flat_map(|(face, [a, b, c, d])| {
            let second = (c != d).then_some((face, [a, c, d]));
            std::iter::once((face, [a, b, c])).chain(second)
        })
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        match self.width {
            3 => self.len(),
            _ => self.corners().map(|[_, _, c, d]| 1 + usize::from(c != d)).sum(),
        }
    }
}

/// So many faces of a ray are compared one by one.
const FEW: usize = 32;

/// Leaves of each row the first `k` hits of different faces, the first hit of each, and says how many are left in
/// all. `face` has the face of a hit, `put` is told to put the second hit in the place of the first.
pub fn once(
    offsets: &mut [usize],
    k: usize,
    face: impl Fn(usize) -> u64,
    mut put: impl FnMut(usize, usize),
) -> usize {
    let (mut kept, mut seen) = (Vec::new(), HashSet::new());
    let (mut from, mut to) = (0, 0);
    for end in offsets.iter_mut().skip(1) {
        kept.clear();
        seen.clear();
        for i in from..*end {
            if kept.len() == k {
                break;
            }
            let face = face(i);
            let is_new = if kept.len() < FEW {
                !kept.contains(&face)
            } else {
                if seen.is_empty() {
                    seen.extend(kept.iter().copied());
                }
                seen.insert(face)
            };
            if is_new {
                kept.push(face);
                put(to, i);
                to += 1;
            }
        }
        from = std::mem::replace(end, to);
    }
    to
}
