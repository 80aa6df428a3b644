//! The memory of a wide tree: cache lines, on huge pages where the system has them.
//!
//! Rays that do not follow each other visit the tree at random, so with pages of 4 KiB nearly every
//! visit misses the address translation buffers as well as the caches.

use super::{Block, Treelet};
use memmap2::MmapMut;

/// Bytes of a cache line.
pub const LINE: usize = 64;

/// Lines of a block.
pub const BLOCK_LINES: usize = size_of::<Block>() / LINE;

/// From here on huge pages are asked for.
const HUGE_FROM: usize = 1 << 21;

/// A fixed number of cache lines, zero at first, that hold treelets and blocks.
pub struct Lines {
    map: MmapMut,
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
        Ok(Lines { map, len })
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
        self.map.as_ptr()
    }

    /// The treelet at a line.
    ///
    /// # Panics
    /// If there is no such line.
    #[inline(always)]
    pub fn treelet(&self, line: usize) -> &Treelet {
        bytemuck::from_bytes(&self.map[line * LINE..][..size_of::<Treelet>()])
    }

    /// The block that begins at a line.
    ///
    /// # Panics
    /// If it does not lie inside.
    #[inline(always)]
    pub fn block(&self, line: usize) -> &Block {
        bytemuck::from_bytes(&self.map[line * LINE..][..size_of::<Block>()])
    }

    /// Writes a treelet.
    pub fn set_treelet(&mut self, line: usize, treelet: &Treelet) {
        self.map[line * LINE..][..size_of::<Treelet>()]
            .copy_from_slice(bytemuck::bytes_of(treelet));
    }

    /// All bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.map
    }

    /// All bytes, to be written.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        &mut self.map
    }
}

impl std::fmt::Debug for Lines {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Lines").field("len", &self.len).finish()
    }
}
