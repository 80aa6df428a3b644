//! What readers fill: vertices, faces and, if asked for, looks.

use super::error::{Place, Result, wrong};
use super::skipped::Skipped;
use super::{Mesh, Watched, polygon};
use crate::stage::Stage;

/// No texture coordinates or no normal at a corner.
pub const NONE: u32 = u32::MAX;

/// Vertices and triangles as a file states them.
#[derive(Default)]
pub struct Soup {
    pub vertices: Vec<[f64; 3]>,
    /// Corners of the polygon that is open.
    pub open: Vec<u32>,
    faces: Vec<[u32; 3]>,
    /// Polygons so far.
    polygons: usize,
    /// Vertices and triangles that were read before into others and count for the limits.
    before: [usize; 2],
    /// Polygons that name vertices which had not been read yet: their first faces, and their corners.
    deferred: Vec<(usize, Vec<u32>, Vec<[u32; 2]>)>,
    /// `None` if only positions and faces are wanted.
    pub looks: Option<Looks>,
}

/// Looks as a file states them.
#[derive(Default)]
pub struct Looks {
    /// Normals, of any length, by vertices or as corners name them.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, likewise.
    pub uvs: Vec<[f32; 2]>,
    /// Colours by vertex; what is missing is white.
    pub colors: Vec<[f32; 3]>,
    /// Colours of all corners of the polygon that is open.
    pub polygon_color: Option<[f32; 3]>,
    /// Texture coordinates and normals at the corners of the polygon that is open; empty if they go by vertices.
    pub open: Vec<[u32; 2]>,
    /// True once faces bring their own texture coordinates, so that those of vertices do not count.
    pub has_corner_uvs: bool,
    /// The same of all faces.
    corners: Vec<[[u32; 2]; 3]>,
    /// Colours by face.
    face_colors: Vec<[f32; 3]>,
    /// The material of faces that follow.
    pub material: u32,
    /// The material of each face.
    materials: Vec<u32>,
    /// What was left out.
    pub skipped: Skipped,
}

impl Soup {
    /// An empty one, with looks or without.
    pub fn new(with_looks: bool) -> Soup {
        Soup { looks: with_looks.then(Looks::default), ..Soup::default() }
    }

    /// An empty one for what follows under the same limits, without looks.
    pub fn next(&self) -> Soup {
        let [vertices, faces] = self.before;
        let before = [vertices + self.vertices.len(), faces + self.faces.len()];
        Soup { before, ..Soup::default() }
    }

    /// Memory for what a file announces and its size allows.
    pub fn reserve(&mut self, vertices: usize, faces: usize, limits: &Watched<'_>) {
        // What cannot be had is asked for again, piece by piece, and then ends in an error.
        let _ = self.vertices.try_reserve_exact(vertices.min(limits.vertices));
        let _ = self.faces.try_reserve_exact(faces.min(limits.faces));
    }

    /// Memory for so many more, as exact as it can be without moving what is there again and again.
    pub fn expect(&mut self, vertices: usize, faces: usize, limits: &Watched<'_>) {
        if self.vertices.is_empty() && self.faces.is_empty() {
            return self.reserve(vertices, faces, limits);
        }
        let _ = self.vertices.try_reserve(vertices.min(limits.vertices));
        let _ = self.faces.try_reserve(faces.min(limits.faces));
    }

    /// Triangles so far.
    pub fn faces(&self) -> usize {
        self.faces.len()
    }

    /// Notes what is left out, where looks are wanted.
    pub fn skip(&mut self, what: impl Into<String>) {
        if let Some(looks) = &mut self.looks {
            looks.skipped.note(what);
        }
    }

    /// Adds a vertex, which must be finite.
    #[inline]
    pub fn vertex(
        &mut self,
        place: impl FnOnce() -> Place,
        point: [f64; 3],
        limits: &Watched<'_>,
    ) -> Result<()> {
        let count = self.vertices.len();
        limits.at(count)?;
        if let Some(x) = point.iter().find(|&&x| !(x as f32).is_finite()) {
            let what = format!("a finite coordinate within f32 for vertex {count}");
            return Err(wrong(place(), what, x));
        }
        if count >= NONE as usize || self.before[0] + count >= limits.vertices {
            return Err(wrong(place(), format!("at most {} vertices", limits.vertices), "more"));
        }
        self.vertices.push(point);
        Ok(())
    }

    /// Ends the polygon whose corners were opened since the last one.
    #[inline]
    pub fn end_polygon(
        &mut self,
        place: impl FnOnce() -> Place,
        limits: &Watched<'_>,
    ) -> Result<()> {
        limits.at(self.polygons)?;
        let count = self.open.len();
        if count < 3 {
            return Err(wrong(place(), "a face of at least 3 corners", count));
        }
        if count > limits.corners {
            let what = format!("a face of at most {} corners", limits.corners);
            return Err(wrong(place(), what, count));
        }
        if self.before[1] + self.faces.len() + count - 2 > limits.faces {
            return Err(wrong(place(), format!("at most {} triangles", limits.faces), "more"));
        }
        self.polygons += 1;
        if let [a, b, c] = self.open[..] {
            self.faces.push([a, b, c]);
            if let Some(looks) = &mut self.looks {
                looks.triangle([0, 1, 2]);
            }
        } else {
            self.cut(place)?;
        }
        self.open.clear();
        if let Some(looks) = &mut self.looks {
            looks.open.clear();
        }
        Ok(())
    }

    /// Cuts the open polygon, or makes room for its triangles until its vertices are known.
    fn cut(&mut self, place: impl FnOnce() -> Place) -> Result<()> {
        let (open, known) = (&self.open, self.vertices.len());
        let (start, mut looks) = (self.faces.len(), self.looks.as_mut());
        let mut push = |local: [usize; 3]| {
            self.faces.push(local.map(|i| open[i]));
            if let Some(looks) = &mut looks {
                looks.triangle(local);
            }
        };
        if open.iter().all(|&i| (i as usize) < known) {
            return polygon::cut(&self.vertices, open, push)
                .map_err(|most| too_long(place(), most, open.len()));
        }
        (1..open.len() - 1).for_each(|i| push([0, i, i + 1]));
        let named = looks.map_or(Vec::new(), |looks| looks.open.clone());
        self.deferred.push((start, open.clone(), named));
        Ok(())
    }

    /// Cuts what waited for its vertices. Corners must name vertices by now.
    fn finish(&mut self, limits: &Watched<'_>) -> Result<()> {
        if self.faces.is_empty() {
            return Err(wrong(Place::End, "at least one face", "none"));
        }
        for (number, (start, polygon, named)) in
            std::mem::take(&mut self.deferred).into_iter().enumerate()
        {
            limits.at(number)?;
            let mut at = start;
            let place = || Place::Part(format!("face {start}"));
            polygon::cut(&self.vertices, &polygon, |local: [usize; 3]| {
                self.faces[at] = local.map(|i| polygon[i]);
                if let Some(looks) = self.looks.as_mut().filter(|_| !named.is_empty()) {
                    looks.corners[at] = local.map(|i| named[i]);
                }
                at += 1;
            })
            .map_err(|most| too_long(place(), most, polygon.len()))?;
        }
        Ok(())
    }

    /// Positions and faces.
    pub fn mesh(mut self, limits: &Watched<'_>) -> Result<Mesh> {
        self.finish(limits)?;
        Ok(Mesh { vertices: self.vertices, faces: self.faces })
    }

    /// Everything but materials, images, lights and the view.
    pub fn stage(mut self, limits: &Watched<'_>) -> Result<Stage> {
        self.finish(limits)?;
        let mut looks = self.looks.take().unwrap_or_default();
        let faces = &self.faces;
        // Tables by vertex that end early: the vertices behind have none.
        let by_corner = !looks.corners.is_empty();
        if by_corner {
            looks.corners.resize(faces.len(), [[NONE; 2]; 3]);
        }
        let has_uvs = !looks.uvs.is_empty();
        let (mut uvs, mut normals, mut colors) = (Vec::new(), Vec::new(), Vec::new());
        let mut absent = 0usize;
        if has_uvs {
            uvs.try_reserve_exact(faces.len()).map_err(std::io::Error::from)?;
        }
        if !looks.normals.is_empty() {
            normals.try_reserve_exact(faces.len()).map_err(std::io::Error::from)?;
        }
        for (i, face) in faces.iter().enumerate() {
            limits.at(i)?;
            let named = |which: usize| -> [u32; 3] {
                if by_corner { looks.corners[i].map(|c| c[which]) } else { *face }
            };
            if has_uvs {
                uvs.push(named(0).map(|n| looks.uvs.get(n as usize).copied().unwrap_or_default()));
            }
            if !looks.normals.is_empty() {
                let normal = |n: u32| looks.normals.get(n as usize).copied().unwrap_or_default();
                normals.push(named(1).map(|n| unit(normal(n))));
            }
            if by_corner {
                for [uv, normal] in looks.corners[i] {
                    let beyond = |n: u32, len: usize| n != NONE && n as usize >= len;
                    absent += usize::from(beyond(uv, looks.uvs.len()));
                    absent += usize::from(beyond(normal, looks.normals.len()));
                }
            }
        }
        if absent > 0 {
            let what = "texture coordinates and normals that corners name but the file lacks";
            looks.skipped.note_many(what, absent);
        }
        if !looks.colors.is_empty() {
            let color = |i: u32| looks.colors.get(i as usize).copied().unwrap_or([1.0; 3]);
            colors = faces.iter().map(|face| face.map(color)).collect();
        } else if !looks.face_colors.is_empty() {
            looks.face_colors.resize(faces.len(), [1.0; 3]);
            colors = looks.face_colors.iter().map(|&color| [color; 3]).collect();
        }
        if normals.iter().flatten().all(|&normal| normal == [0.0; 3]) {
            normals = Vec::new();
        }
        if looks.materials.iter().all(|&material| material == 0) {
            looks.materials = Vec::new();
        }
        Ok(Stage {
            mesh: Mesh { vertices: self.vertices, faces: self.faces },
            normals,
            uvs,
            colors,
            material: looks.materials,
            skipped: looks.skipped.sentences(),
            ..Stage::default()
        })
    }
}

impl Looks {
    /// A face whose corners are these of the open polygon.
    fn triangle(&mut self, local: [usize; 3]) {
        if !self.open.is_empty() {
            self.corners.resize(self.materials.len(), [[NONE; 2]; 3]);
            self.corners.push(local.map(|i| self.open[i]));
        }
        self.materials.push(self.material);
        if let Some(color) = self.polygon_color {
            // Faces before the first one with a colour have none.
            self.face_colors.resize(self.materials.len() - 1, [1.0; 3]);
            self.face_colors.push(color);
        }
    }

    /// Gives the corners of the open polygon texture coordinates of their own, in pairs with v counted from below, and the normals
    /// of their vertices.
    pub fn name_corners(&mut self, open: &[u32], uvs: &[f32]) {
        if !self.has_corner_uvs {
            self.uvs.clear();
            self.has_corner_uvs = true;
        }
        let (pairs, fits) = (uvs.as_chunks::<2>().0, uvs.len() == 2 * open.len());
        for (i, &vertex) in open.iter().enumerate() {
            let uv = pairs.get(i).filter(|uv| fits && uv.iter().all(|x| x.is_finite()));
            let index = uv.map_or(NONE, |&[u, v]| {
                self.uvs.push([u, 1.0 - v]);
                self.uvs.len() as u32 - 1
            });
            self.open.push([index, if self.normals.is_empty() { NONE } else { vertex }]);
        }
    }
}

fn too_long(place: Place, most: usize, found: usize) -> super::MeshError {
    wrong(place, format!("a polygon that is convex or has at most {most} corners"), found)
}

/// The vector of length 1, or zeros where it has no direction.
pub fn unit(v: [f32; 3]) -> [f32; 3] {
    let v = v.map(f64::from);
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 && length.is_finite() { v.map(|x| (x / length) as f32) } else { [0.0; 3] }
}

/// Linear Rec. 709 of a value in the transfer function of sRGB, 0 to 1 (IEC 61966-2-1).
pub fn linear(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}
