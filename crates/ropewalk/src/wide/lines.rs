//! The memory of a wide tree: cache lines, on huge pages where the system has them.
//!
//! Rays that do not follow each other visit the tree at random, so with pages of 4 KiB nearly every
//! visit misses the address translation buffers as well as the caches.

use super::{Block, Treelet};
use crate::kernel::Memory;
use memmap2::MmapMut;

/// Bytes of a cache line.
pub const LINE: usize = 64;

/// Lines of a block.
pub const BLOCK_LINES: usize = size_of::<Block>() / LINE;

/// From here on huge pages are asked for.
const HUGE_FROM: usize = 1 << 21;

/// A fixed number of cache lines that hold treelets and blocks: its own, zero at first, or those of a
/// saved tree.
pub struct Lines {
    memory: Memory,
    len: usize,
}

impl Lines {
    /// `len` lines.
    ///
    /// # Errors
    /// What the system says, mostly that there is not enough memory.
    pub fn new(len: usize) -> std::io::Result<Lines> {
        let map = MmapMut::map_anon((len * LINE).max(LINE))?;
        #[cfg(target_os = "linux")]
        if len * LINE >= HUGE_FROM {
            // Without huge pages the tree is slower, not wrong.
            let _ = map.advise(memmap2::Advice::HugePage);
        }
        Ok(Lines { memory: Memory::of_map(map), len })
    }

    /// The lines of a saved tree, whose links have been checked; `None` if the bytes are no lines.
    pub(crate) fn shared(memory: Memory) -> Option<Lines> {
        let (len, address) = (memory.bytes().len(), memory.as_ptr().addr());
        let fits = len.is_multiple_of(LINE) && address.is_multiple_of(LINE);
        fits.then_some(Lines { memory, len: len / LINE })
    }

    /// True if they are those of a saved tree: links are right, but what the blocks hold may have been
    /// altered, even to what is no number.
    pub fn is_shared(&self) -> bool {
        self.memory.is_shared()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Number of lines.
    pub fn len(&self) -> usize {
        self.len
    }

    /// The first line; lines are contiguous and aligned.
    #[inline(always)]
    pub fn as_ptr(&self) -> *const u8 {
        self.memory.as_ptr()
    }

    /// The treelet at a line.
    ///
    /// # Panics
    /// If there is no such line.
    #[inline(always)]
    pub fn treelet(&self, line: usize) -> &Treelet {
        bytemuck::from_bytes(&self.memory.bytes()[line * LINE..][..size_of::<Treelet>()])
    }

    /// The block that begins at a line.
    ///
    /// # Panics
    /// If it does not lie inside.
    #[inline(always)]
    pub fn block(&self, line: usize) -> &Block {
        bytemuck::from_bytes(&self.memory.bytes()[line * LINE..][..size_of::<Block>()])
    }

    /// Writes a treelet.
    pub fn set_treelet(&mut self, line: usize, treelet: &Treelet) {
        self.memory.bytes_mut()[line * LINE..][..size_of::<Treelet>()]
            .copy_from_slice(bytemuck::bytes_of(treelet));
    }

    /// All bytes; those of an empty tree's one line if there are none.
    pub fn bytes(&self) -> &[u8] {
        self.memory.bytes()
    }

    /// All bytes, to be written; none of a saved tree.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        self.memory.bytes_mut()
    }
}

impl std::fmt::Debug for Lines {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Lines").field("len", &self.len).finish()
    }
}
