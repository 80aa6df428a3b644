//! Where a face leads.

/// A link in four bytes.
///
/// ```text
/// bits 31..29   kind: 0, 1, 2 a rope-tree node that splits this axis; 3 a leaf; 4 a tree node;
///               7 outside of the scene
/// bits 28..0    index: rope-tree node, leaf by number, or node of the tree; 0 outside
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Link(u32);

/// A link, unpacked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// An inner node of a rope tree.
    Split { axis: usize, node: u32 },
    /// A leaf, numbered in depth-first order.
    Leaf(u32),
    /// A node of the tree, to be descended.
    Node(u32),
    /// Nothing lies behind the face.
    Outside,
}

impl Link {
    const SHIFT: u32 = 29;
    const INDEX: u32 = (1 << Self::SHIFT) - 1;
    /// Largest number of things that a link can tell apart.
    pub const MAX: usize = Self::INDEX as usize;
    pub const OUTSIDE: Link = Link(7 << Self::SHIFT);

    pub fn split(axis: usize, node: u32) -> Link {
        debug_assert!(axis < 3 && node <= Self::INDEX);
        Link((axis as u32) << Self::SHIFT | node)
    }

    pub fn leaf(number: u32) -> Link {
        debug_assert!(number <= Self::INDEX);
        Link(3 << Self::SHIFT | number)
    }

    pub fn node(index: u32) -> Link {
        debug_assert!(index <= Self::INDEX);
        Link(4 << Self::SHIFT | index)
    }

    #[inline]
    pub fn target(self) -> Target {
        let index = self.0 & Self::INDEX;
        match self.0 >> Self::SHIFT {
            axis @ 0..=2 => Target::Split { axis: axis as usize, node: index },
            3 => Target::Leaf(index),
            4 => Target::Node(index),
            _ => Target::Outside,
        }
    }
}

impl std::fmt::Debug for Link {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.target().fmt(f)
    }
}
