//! The eight-byte node.

/// A node in eight bytes.
///
/// ```text
///         word 0 (32 bits)            word 1: bits 31..2         bits 1..0
/// inner   split position (f32 bits)   index of the right child   axis 0, 1, 2
/// leaf    first reference             number of references       3
/// ```
/// The left child of node `i` is node `i + 1`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node {
    word0: u32,
    word1: u32,
}

const _: () = assert!(size_of::<Node>() == 8);

/// A node, unpacked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NodeKind {
    /// A cutting plane and its two children.
    Inner {
        /// Axis of the plane's normal, 0 to 2.
        axis: usize,
        /// Position of the plane on that axis.
        split: f32,
        /// The child below the plane.
        left: u32,
        /// The child above the plane.
        right: u32,
    },
    /// A run of references.
    Leaf {
        /// Index of the first reference.
        first: u32,
        /// Number of references; 0 in an empty leaf.
        count: u32,
    },
}

impl Node {
    const LEAF: u32 = 3;
    /// Largest index or count that a node can hold.
    pub const MAX_INDEX: u32 = (1 << 30) - 1;

    /// An inner node; `right` at most [`Node::MAX_INDEX`].
    pub fn inner(axis: usize, split: f32, right: u32) -> Self {
        debug_assert!(axis < 3 && right <= Self::MAX_INDEX);
        Node { word0: split.to_bits(), word1: right << 2 | axis as u32 }
    }

    /// A leaf; `count` at most [`Node::MAX_INDEX`].
    pub fn leaf(first: u32, count: u32) -> Self {
        debug_assert!(count <= Self::MAX_INDEX);
        Node { word0: first, word1: count << 2 | Self::LEAF }
    }

    /// The same node in a tree where nodes and references come `nodes` and `refs` later.
    pub(crate) fn relocated(self, nodes: u32, refs: u32) -> Self {
        match self.word1 & 3 {
            Self::LEAF => Node { word0: self.word0 + refs, ..self },
            _ => Node { word1: self.word1 + (nodes << 2), ..self },
        }
    }

    /// Unpacks the node with index `index`.
    #[inline]
    pub fn kind(self, index: u32) -> NodeKind {
        match self.word1 & 3 {
            Self::LEAF => NodeKind::Leaf { first: self.word0, count: self.word1 >> 2 },
            axis => NodeKind::Inner {
                axis: axis as usize,
                split: f32::from_bits(self.word0),
                left: index + 1,
                right: self.word1 >> 2,
            },
        }
    }
}
