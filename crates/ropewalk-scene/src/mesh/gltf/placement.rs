//! Which meshes stand where: the walk over the nodes, for those who want one mesh of all and for those who want each once.

use super::super::error::{Result, wrong};
use super::super::placed::{IDENTITY, Matrix, PlacedMeshes, Placement, moved};
use super::super::{Mesh, Place};
use super::accessor::{Accessor, Purpose};
use super::matrix::{NO_ROTATION, composed, times, transform};
use super::{Reader, array, entry, integer, part};
use serde_json::Value;
use std::collections::HashMap;
use std::sync::Arc;

/// Deepest nesting of nodes.
const MAX_DEPTH: usize = 256;

/// What becomes of placements.
pub enum Target {
    /// All meshes are moved into one.
    Flat,
    /// Each mesh is kept once.
    Kept(Kept),
}

/// Meshes and their placements so far.
#[derive(Default)]
pub struct Kept {
    placed: PlacedMeshes,
    /// What became of the file's meshes; `None` of those without triangles.
    known: HashMap<usize, Option<u32>>,
    /// The largest coordinates of each mesh.
    largest: Vec<[f64; 3]>,
    /// Vertices that were moved to see whether they stay within `f32`.
    moved: usize,
}

/// A mesh at a node.
struct Named<'n> {
    mesh: usize,
    node: Option<u32>,
    /// Of the node.
    name: &'n Arc<str>,
    /// Where the mesh is named.
    named_by: &'n str,
}

impl Reader<'_> {
    /// Places the meshes of the default scene, or of all root nodes, or all of them where there are no nodes.
    pub(super) fn visit_scene(&mut self) -> Result<()> {
        let (json, nodes) = (self.json, array(self.json, "nodes"));
        if nodes.is_empty() {
            let (node, name, named_by) = (None, &Arc::from(""), "meshes");
            for mesh in 0..array(json, "meshes").len() {
                self.place(&Named { mesh, node, name, named_by }, &IDENTITY)?;
            }
            return Ok(());
        }
        let roots: Vec<usize> = if array(json, "scenes").is_empty() {
            let mut is_child = vec![false; nodes.len()];
            let children = nodes.iter().flat_map(|node| array(node, "children"));
            for child in children.filter_map(Value::as_u64) {
                if let Some(child) = is_child.get_mut(child as usize) {
                    *child = true;
                }
            }
            (0..nodes.len()).filter(|&i| !is_child[i]).collect()
        } else {
            let scene = integer(json, "scene", "scene")?.unwrap_or(0);
            self.list(entry(json, "scenes", scene, "scene")?, "nodes", &format!("scenes[{scene}]"))?
        };
        let mut seen = vec![false; nodes.len()];
        let mut stack: Vec<(usize, Matrix, usize)> =
            roots.into_iter().rev().map(|root| (root, IDENTITY, 0)).collect();
        while let Some((index, above, depth)) = stack.pop() {
            let name = format!("nodes[{index}]");
            let node = entry(json, "nodes", index, "nodes")?;
            if std::mem::replace(&mut seen[index], true) {
                return Err(wrong(part(name), "a node with one parent", "one that is named twice"));
            }
            if depth > MAX_DEPTH {
                return Err(wrong(part(name), format!("nodes at most {MAX_DEPTH} deep"), "more"));
            }
            let matrix = times(&above, &transform(node, &name)?);
            if let Some(mesh) = integer(node, "mesh", &name)? {
                self.visit_mesh(mesh, (index, node), &matrix, &name)?;
            }
            if self.soup.looks.is_some() {
                self.read_light(node, &matrix, &name)?;
                self.read_camera(node, &matrix, &name)?;
            }
            let children = self.list(node, "children", &name)?;
            stack.extend(children.into_iter().rev().map(|child| (child, matrix, depth + 1)));
        }
        Ok(())
    }

    /// Indices under a key.
    fn list(&self, json: &Value, key: &str, name: &str) -> Result<Vec<usize>> {
        let index = |value: &Value| {
            let found = value.as_u64().map(|x| x as usize);
            found.ok_or_else(|| wrong(part(format!("{name}.{key}")), "integers, 0 or more", value))
        };
        array(json, key).iter().map(index).collect()
    }

    /// Places the mesh of a node, once or as often as EXT_mesh_gpu_instancing says.
    fn visit_mesh(
        &mut self,
        mesh: usize,
        (index, node): (usize, &Value),
        matrix: &Matrix,
        name: &str,
    ) -> Result<()> {
        let key = "EXT_mesh_gpu_instancing";
        let named = Named {
            mesh,
            node: u32::try_from(index).ok(),
            name: &Arc::from(node["name"].as_str().unwrap_or_default()),
            named_by: &format!("{name}.mesh"),
        };
        let attributes = &node["extensions"][key]["attributes"];
        if !node["extensions"][key].is_object() {
            return self.place(&named, matrix);
        }
        let name = format!("{name}.extensions.{key}");
        let mut count = None;
        let mut named_rows = |key: &str, purpose: Purpose| -> Result<Option<Accessor<'_>>> {
            let Some(accessor) = integer(attributes, key, &name)? else { return Ok(None) };
            let rows = self.accessor(accessor, purpose, &format!("{name}.{key}"))?;
            let expected = *count.get_or_insert(rows.count);
            if rows.count != expected {
                let what = format!("{expected} of them, as of the attribute before");
                return Err(wrong(part(format!("{name}.{key}")), what, rows.count));
            }
            Ok(Some(rows))
        };
        let translations = rows(named_rows("TRANSLATION", Purpose::Length)?)?;
        let rotations = rows(named_rows("ROTATION", Purpose::Rotation)?)?;
        let scales = rows(named_rows("SCALE", Purpose::Length)?)?;
        let Some(count) = count else {
            let what = "TRANSLATION, ROTATION or SCALE";
            return Err(wrong(part(format!("{name}.attributes")), what, "none"));
        };
        fn row<const N: usize>(all: &[[f64; N]], i: usize, default: [f64; N]) -> [f64; N] {
            all.get(i).copied().unwrap_or(default)
        }
        for i in 0..count {
            let (t, s) = (row(&translations, i, [0.0; 3]), row(&scales, i, [1.0; 3]));
            let own = composed(t, row(&rotations, i, NO_ROTATION), s);
            self.place(&named, &times(matrix, &own))?;
        }
        Ok(())
    }

    fn place(&mut self, named: &Named<'_>, matrix: &Matrix) -> Result<()> {
        self.limits.at(self.placements)?;
        if self.placements >= self.limits.placements {
            let what = format!("meshes placed at most {} times", self.limits.placements);
            return Err(wrong(part(named.named_by), what, "more"));
        }
        self.placements += 1;
        if let Target::Flat = self.target {
            let before = self.soup.faces();
            self.read_mesh(named.mesh, Some(matrix), named.named_by)?;
            if self.soup.faces() > before {
                self.stage.placements += 1;
                self.stage.meshes += usize::from(self.seen.insert(named.mesh));
            }
            return Ok(());
        }
        self.keep(named, matrix)
    }

    /// Notes a placement, and reads its mesh if that is the first one.
    fn keep(&mut self, named: &Named<'_>, matrix: &Matrix) -> Result<()> {
        let Target::Kept(kept) = &self.target else { return Ok(()) };
        let known = match kept.known.get(&named.mesh) {
            Some(&known) => known,
            None => {
                self.read_mesh(named.mesh, None, named.named_by)?;
                let next = self.soup.next();
                let soup = std::mem::replace(&mut self.soup, next);
                let mesh = match soup.faces() {
                    0 => None,
                    _ => Some(soup.mesh(self.limits)?),
                };
                let Target::Kept(kept) = &mut self.target else { return Ok(()) };
                kept.add(named.mesh, mesh)
            }
        };
        let (Some(mesh), Target::Kept(kept)) = (known, &mut self.target) else { return Ok(()) };
        kept.check(mesh, matrix, named, self.limits.vertices)?;
        let (transform, name, node) = (*matrix, named.name.clone(), named.node);
        kept.placed.placements.push(Placement { mesh, transform, name, node });
        Ok(())
    }

    /// The meshes and their placements.
    pub(super) fn finish_placed(self) -> Result<PlacedMeshes> {
        match self.target {
            Target::Kept(kept) if !kept.placed.placements.is_empty() => Ok(kept.placed),
            _ => Err(wrong(Place::End, "at least one face", "none")),
        }
    }
}

/// All rows, or none.
fn rows<const N: usize>(accessor: Option<Accessor<'_>>) -> Result<Vec<[f64; N]>> {
    let mut all = Vec::new();
    if let Some(accessor) = accessor {
        accessor.rows(|row| {
            all.push(row);
            Ok(())
        })?;
    }
    Ok(all)
}

impl Kept {
    /// Keeps a mesh of the file under its index there.
    fn add(&mut self, index: usize, mesh: Option<Mesh>) -> Option<u32> {
        let place = mesh.map(|mesh| {
            let mut largest = [0.0f64; 3];
            for vertex in &mesh.vertices {
                (0..3).for_each(|a| largest[a] = largest[a].max(vertex[a].abs()));
            }
            self.largest.push(largest);
            self.placed.meshes.push(mesh);
            self.largest.len() as u32 - 1
        });
        self.known.insert(index, place);
        place
    }

    /// Refuses what the reader of one mesh refuses: placed vertices that `f32` does not hold.
    fn check(
        &mut self,
        mesh: u32,
        matrix: &Matrix,
        named: &Named<'_>,
        vertices: usize,
    ) -> Result<()> {
        let largest = self.largest[mesh as usize];
        let is_within = |[x, y, z, t]: &[f64; 4]| {
            x.abs() * largest[0] + y.abs() * largest[1] + z.abs() * largest[2] + t.abs()
                <= 0.5 * f64::from(f32::MAX)
        };
        if matrix.iter().all(is_within) {
            return Ok(());
        }
        let all = &self.placed.meshes[mesh as usize].vertices;
        // One mesh of all would have too many by now.
        self.moved += all.len();
        if self.moved > vertices {
            let what = format!("at most {vertices} vertices at coordinates near the limit of f32");
            return Err(wrong(part(named.named_by), what, "more"));
        }
        for (i, vertex) in all.iter().enumerate() {
            if let Some(x) = moved(matrix, *vertex).iter().find(|&&x| !(x as f32).is_finite()) {
                let what = format!(
                    "a finite coordinate within f32 for vertex {i} of meshes[{}]",
                    named.mesh
                );
                return Err(wrong(part(named.named_by), what, x));
            }
        }
        Ok(())
    }
}
