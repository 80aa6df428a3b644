//! Checks of links against the tree itself.

use crate::aabb::Aabb;
use crate::rope::cells::{Cell, Cells};
use crate::rope::link::{Link, Target};
use crate::rope::thread::{Neighbour, Side, side_of_face};
use crate::rope::{RopeError, Threads};
use crate::tree::{BspTree, NodeKind};

/// The leaves and their boxes are those of `tree`, and behind every face the link leads to just
/// the leaves that a fresh search from the nearest separating plane finds, in the same order.
pub(super) fn check(threads: &Threads, tree: &BspTree) -> Result<(), RopeError> {
    let fresh = Cells::new(tree);
    if fresh.number != threads.cells.number || fresh.cells.len() != threads.cells.cells.len() {
        return Err(RopeError::invalid(0, 0, "the leaves are numbered for another tree"));
    }
    let mut leaf = 0;
    let mut stack = vec![(BspTree::ROOT, [None; 6])];
    while let Some((node, behind)) = stack.pop() {
        match tree.kind(node) {
            NodeKind::Leaf { .. } => {
                let (old, new) = (&threads.cells.cells[leaf], &fresh.cells[leaf]);
                if (Cell { links: new.links, ..*old }) != *new {
                    return Err(RopeError::invalid(leaf, 0, "the leaf is not the tree's"));
                }
                for (face, &neighbour) in behind.iter().enumerate() {
                    check_face(threads, tree, leaf, face, neighbour)
                        .map_err(|what| RopeError::invalid(leaf, face, what))?;
                }
                leaf += 1;
            }
            NodeKind::Inner { axis, left, right, .. } => {
                let (mut lower, mut upper) = (behind, behind);
                lower[2 * axis + 1] = Some(right);
                upper[2 * axis] = Some(left);
                stack.push((right, upper));
                stack.push((left, lower));
            }
        }
    }
    Ok(())
}

fn check_face(
    threads: &Threads,
    tree: &BspTree,
    leaf: usize,
    face: usize,
    behind: Neighbour,
) -> Result<(), &'static str> {
    let cell = &threads.cells.cells[leaf];
    let link = cell.links[face];
    if let Target::Node(node) = link.target() {
        match tree.kind(node) {
            NodeKind::Inner { axis, split, .. } => {
                if !matches!(side_of_face(&cell.bounds, face, axis, split), Side::Both) {
                    return Err("the link could lead to a smaller node");
                }
            }
            NodeKind::Leaf { .. } => return Err("the link leads to a leaf by its node"),
        }
    }
    let mut wanted = Vec::new();
    if let Some(node) = behind {
        touching(tree, &threads.cells, node, &cell.bounds, face, &mut wanted);
    }
    let found = behind_link(threads, tree, &cell.bounds, face, link)?;
    if cell.bounds.face_area(face / 2) == 0.0 {
        // A face without area may lie along a plane: leaves on either side touch it equally.
        let touches = |&leaf: &u32| {
            !threads.cells.cells[leaf as usize].bounds.intersection(&cell.bounds).is_empty()
        };
        let good = found.is_empty() == wanted.is_empty() && found.iter().all(touches);
        return if good { Ok(()) } else { Err("the link of a flat face leads elsewhere") };
    }
    match found == wanted {
        true => Ok(()),
        false => Err("the link misses a leaf that touches the face, or leads to one that does not"),
    }
}

/// The leaves below `node` that touch the part `cell` of a face, lower ones first.
fn touching(
    tree: &BspTree,
    cells: &Cells,
    node: u32,
    cell: &Aabb,
    face: usize,
    out: &mut Vec<u32>,
) {
    match tree.kind(node) {
        NodeKind::Leaf { .. } => out.push(cells.number[node as usize]),
        NodeKind::Inner { axis, split, left, right } => {
            match side_of_face(cell, face, axis, split) {
                Side::Lower => touching(tree, cells, left, cell, face, out),
                Side::Upper => touching(tree, cells, right, cell, face, out),
                Side::Both => {
                    let (below, above) = cell.split(axis, split);
                    touching(tree, cells, left, &below, face, out);
                    touching(tree, cells, right, &above, face, out);
                }
            }
        }
    }
}

/// The leaves that a link leads to for the part `cell` of a face, lower ones first.
pub(super) fn behind_link(
    threads: &Threads,
    tree: &BspTree,
    cell: &Aabb,
    face: usize,
    link: Link,
) -> Result<Vec<u32>, &'static str> {
    let mut out = Vec::new();
    let mut stack = vec![(link, *cell)];
    while let Some((link, cell)) = stack.pop() {
        match link.target() {
            Target::Outside => {}
            Target::Leaf(number) => out.push(number),
            Target::Node(node) => touching(tree, &threads.cells, node, &cell, face, &mut out),
            Target::Split { axis, node } => {
                let node = threads.nodes.get(node as usize).ok_or("a rope-tree node is missing")?;
                if !matches!(side_of_face(&cell, face, axis, node.split), Side::Both) {
                    return Err("a rope-tree node does not cut the face");
                }
                let (below, above) = cell.split(axis, node.split);
                stack.push((node.above, above));
                stack.push((node.below, below));
            }
        }
    }
    Ok(out)
}
