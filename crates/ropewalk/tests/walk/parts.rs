//! Trees and accelerators from foreign parts: what no walk could stand is refused.

use ropewalk::primitive::Triangle;
use ropewalk::tree::{BspTree, MAX_DEPTH, Node, TreeError};
use ropewalk::{Aabb, Accelerator, AcceleratorError, Geometry, Sides, Walk};
use std::sync::Arc;

const UNIT: Aabb = Aabb::new([0.0; 3], [1.0; 3]);

fn tree(nodes: &[Node], refs: &[u32]) -> Result<BspTree, TreeError> {
    BspTree::from_nodes(UNIT, nodes.to_vec(), refs.to_vec())
}

#[test]
fn trees_that_no_walk_could_stand_are_refused() {
    let leaf = Node::leaf(0, 0);
    assert!(tree(&[Node::inner(0, 0.5, 2), leaf, Node::leaf(0, 2)], &[7, 9]).is_ok());
    let layout = |nodes: &[Node]| matches!(tree(nodes, &[]), Err(TreeError::Layout { .. }));
    assert!(layout(&[]), "no root");
    assert!(layout(&[leaf, leaf]), "a node that nothing leads to");
    assert!(layout(&[Node::inner(0, 0.5, 2), leaf]), "no right child");
    assert!(layout(&[Node::inner(0, 0.5, 0), leaf, leaf]), "a cycle");
    assert!(layout(&[Node::inner(0, 0.5, 1), leaf, leaf]), "one node as both children");
    for split in [1.5, -0.1, f32::NAN, f32::INFINITY] {
        let found = tree(&[Node::inner(1, split, 2), leaf, leaf], &[]);
        assert!(matches!(found, Err(TreeError::SplitOutside { node: 0, .. })), "{split}");
    }
    let found = tree(&[Node::leaf(1, 2)], &[0, 0]);
    assert_eq!(found, Err(TreeError::References { node: 0, first: 1, end: 3, len: 2 }));
    let endless = Aabb::new([0.0; 3], [f32::INFINITY; 3]);
    assert_eq!(BspTree::from_nodes(endless, vec![leaf], vec![]), Err(TreeError::Bounds));
}

#[test]
fn depth_is_limited_to_the_stack_of_the_walks() {
    // A chain of right children: inner, leaf, inner, leaf, ..., leaf.
    let chain = |depth: usize| {
        let mut nodes = Vec::new();
        for level in 0..depth as u32 {
            nodes.extend([Node::inner(0, 1.0, 2 * level + 2), Node::leaf(0, 0)]);
        }
        nodes.push(Node::leaf(0, 0));
        tree(&nodes, &[])
    };
    assert!(chain(MAX_DEPTH).is_ok());
    assert!(matches!(chain(MAX_DEPTH + 1), Err(TreeError::TooDeep { .. })));
}

#[test]
fn a_tree_of_another_geometry_is_refused() {
    let mut geometry = Geometry::new();
    let vertices = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0]];
    geometry.push(Triangle { vertices }, Sides::Both).unwrap();
    let tree = Arc::new(tree(&[Node::leaf(0, 1)], &[1]).unwrap());
    for walk in Walk::ALL {
        let found = Accelerator::new(Arc::new(geometry.clone()), tree.clone(), walk).err();
        assert_eq!(found, Some(AcceleratorError::ForeignTree { prim_id: 1, len: 1 }));
    }
}
