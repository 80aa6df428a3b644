//! Lists of slots and of the cells that their rays visit next.

/// Entries of a list: more than there are slots, by the eight lanes of a store at its end.
const ENTRIES: usize = 40;

/// Slots with codes of cells.
#[repr(C, align(64))]
pub struct List {
    /// Numbers of slots.
    pub slot: [u32; ENTRIES],
    /// Codes; 0 for a ray that has ended.
    pub code: [u32; ENTRIES],
    /// Entries in use.
    pub len: usize,
}

impl List {
    /// A list without entries.
    pub const EMPTY: List = List { slot: [0; ENTRIES], code: [0; ENTRIES], len: 0 };

    /// Writes entry `i`, in use or not.
    #[inline(always)]
    pub fn set(&mut self, i: usize, k: u32, code: u32) {
        self.slot[i & 31] = k;
        self.code[i & 31] = code;
    }

    /// Adds an entry.
    #[inline(always)]
    pub fn push(&mut self, k: u32, code: u32) {
        self.set(self.len, k, code);
        self.len += 1;
    }

    /// Slot and code of entry `i`.
    #[inline(always)]
    pub fn get(&self, i: usize) -> (u32, u32) {
        (self.slot[i & 31], self.code[i & 31])
    }
}

/// Where the rays of a wave are.
pub struct Lists {
    /// Rays that step next.
    pub stepping: List,
    /// Rays that wait at a leaf.
    pub waiting: List,
    /// Slots without a ray.
    pub free: List,
}

impl Lists {
    /// Puts the first `n` entries of `moved` on the lists of their kinds: no branch but the loop's.
    #[inline(always)]
    pub fn add(&mut self, moved: &List, n: usize) {
        for i in 0..n {
            let (k, code) = moved.get(i);
            let (leaf, ended) = ((code >> 31) as usize, usize::from(code == 0));
            self.waiting.set(self.waiting.len, k, code);
            self.stepping.set(self.stepping.len, k, code);
            self.free.set(self.free.len, k, code);
            self.waiting.len += leaf;
            self.free.len += ended;
            self.stepping.len += 1 - leaf - ended;
        }
    }
}
