//! The stack of the walks from the root.

use crate::tree::MAX_DEPTH;

/// A subtree still to be visited, and the ray's part in it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pending {
    pub node: u32,
    pub from: f64,
    pub to: f64,
}

/// A stack that can neither overflow nor allocate: a walk holds at most one pending sibling per
/// level of the tree.
pub(crate) struct Stack {
    items: [Pending; MAX_DEPTH],
    len: usize,
}

impl Stack {
    #[inline]
    pub fn new() -> Self {
        Stack { items: [Pending::default(); MAX_DEPTH], len: 0 }
    }

    #[inline]
    pub fn push(&mut self, pending: Pending) {
        self.items[self.len] = pending;
        self.len += 1;
    }

    #[inline]
    pub fn pop(&mut self) -> Option<Pending> {
        self.len = self.len.checked_sub(1)?;
        Some(self.items[self.len])
    }
}
