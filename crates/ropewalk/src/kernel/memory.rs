//! Bytes that stay where they are: of an anonymous map, or of somebody else, kept alive.

#![allow(unsafe_code)]

use memmap2::MmapMut;
use std::ops::Range;
use std::ptr::NonNull;
use std::sync::Arc;

/// Bytes that others own: a mapped file, a vector. Opening a saved tree keeps them and copies nothing.
pub type SharedBytes = Arc<dyn AsRef<[u8]> + Send + Sync>;

/// Bytes that stay where they are, with what keeps them alive. Reading them costs the same whoever owns
/// them.
pub struct Memory {
    start: NonNull<u8>,
    len: usize,
    owner: Owner,
}

/// Never looked at again, only kept: all access is by `start`, which another borrow of a map's bytes would end.
enum Owner {
    Map(#[allow(dead_code)] MmapMut),
    Shared(#[allow(dead_code)] SharedBytes),
}

// SAFETY: both owners may be sent to other threads and shared with them, and `start` leads to bytes that
// change only through `&mut self`.
unsafe impl Send for Memory {}
// SAFETY: as above.
unsafe impl Sync for Memory {}

impl Memory {
    /// All bytes of a map.
    pub fn of_map(mut map: MmapMut) -> Memory {
        let (start, len) = (NonNull::from(&mut map[..]).cast(), map.len());
        Memory { start, len, owner: Owner::Map(map) }
    }

    /// Some of the bytes of an owner; `None` if it has no such range.
    pub fn of_shared(owner: &SharedBytes, range: Range<usize>) -> Option<Memory> {
        // The owner is asked once: nothing says that it would give the same bytes again.
        let bytes = (**owner).as_ref().get(range)?;
        let (start, len) = (NonNull::from(bytes).cast(), bytes.len());
        Some(Memory { start, len, owner: Owner::Shared(Arc::clone(owner)) })
    }

    /// All bytes.
    #[inline(always)]
    pub fn bytes(&self) -> &[u8] {
        // SAFETY: `start` and `len` are those of a slice that the owner lent: a map's bytes stay where
        // they are as long as the map is not dropped. A shared owner lent them for as long as it is
        // borrowed, and the clone of its `Arc` that is kept here borrows it: nobody can get at it to
        // change, move or drop it before this value is dropped.
        unsafe { std::slice::from_raw_parts(self.start.as_ptr(), self.len) }
    }

    /// All bytes, to be written; none of shared ones.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        match self.owner {
            // SAFETY: `start` was made of a `&mut` of all bytes of the map, which is not borrowed again before it is dropped;
            // `self` is, as long as the slice lives.
            Owner::Map(_) => unsafe {
                std::slice::from_raw_parts_mut(self.start.as_ptr(), self.len)
            },
            Owner::Shared(_) => &mut [],
        }
    }

    /// The first byte.
    #[inline(always)]
    pub fn as_ptr(&self) -> *const u8 {
        self.start.as_ptr()
    }

    /// True if others own the bytes.
    pub fn is_shared(&self) -> bool {
        matches!(self.owner, Owner::Shared(_))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn owners_are_kept_as_long_as_needed() {
        let owner: SharedBytes = Arc::new(vec![1u8, 2, 3, 4]);
        let memory = Memory::of_shared(&owner, 1..3).unwrap();
        assert!(Memory::of_shared(&owner, 3..5).is_none());
        let address = (*owner).as_ref().as_ptr();
        drop(owner);
        assert_eq!(memory.bytes(), [2, 3]);
        assert_eq!(memory.as_ptr(), address.wrapping_add(1));
        assert!(memory.is_shared());
    }

    #[test]
    fn maps_can_be_written() {
        let mut memory = Memory::of_map(MmapMut::map_anon(64).unwrap());
        memory.bytes_mut()[5] = 7;
        assert_eq!((memory.bytes().len(), memory.bytes()[5]), (64, 7));
        assert!(!memory.is_shared());
    }
}
