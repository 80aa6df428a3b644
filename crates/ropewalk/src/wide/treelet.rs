//! The 64-byte treelet: three levels of the binary tree in one cache line.

/// Up to seven cutting planes and up to eight children.
///
/// ```text
/// bytes  0..28   plane[h]: split positions in heap order (0; 1, 2; 3, 4, 5, 6), +inf where absent
/// bytes 28..32   axes: plane h in bits 2h and 2h+1; bit 14+h: across y, bit 21+h: across z; bits
///                28..32 are 0
/// bytes 32..64   child[c]: c is the path from the root, first level in bit 2; upper side is 1
///
/// child code     0                 an empty cell
///                bit 31 clear      treelet: bits 30..4 its line (line 0 is a dummy), bits 3..0 are 0
///                bit 31 set        leaf: bits 30..4 line of the first block, bits 3..0 number of
///                                  blocks; 15 mean that the number stands in the overflow list
/// ```
/// A subtree of fewer levels fills the lowest child of its absent planes; +inf keeps rays on that
/// side of them, and the other side is an empty cell.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Treelet {
    /// Split positions in heap order.
    pub plane: [f32; 7],
    /// Axes; see [`Treelet::axis`] and [`Flips`].
    pub axes: u32,
    /// Child codes.
    pub child: [u32; 8],
}

const _: () = assert!(size_of::<Treelet>() == 64);

/// Bit that marks a leaf.
pub const LEAF: u32 = 1 << 31;
/// Bits that hold the number of blocks.
pub const COUNT_BITS: u32 = 4;
/// The count that refers to the overflow list.
pub const COUNT_OVERFLOW: u32 = (1 << COUNT_BITS) - 1;
/// Binary levels of a treelet.
pub const LEVELS: usize = 3;
/// Largest number of cache lines of a tree.
pub const MAX_LINES: usize = 1 << (31 - COUNT_BITS);

impl Treelet {
    /// A treelet without planes and children.
    pub const EMPTY: Treelet = Treelet { plane: [f32::INFINITY; 7], axes: 0, child: [0; 8] };

    /// The axis of plane `h`.
    pub fn axis(&self, h: usize) -> usize {
        (self.axes >> (2 * h) & 3) as usize
    }

    /// Sets the axis of plane `h`, which was 0.
    pub fn set_axis(&mut self, h: usize, axis: usize) {
        self.axes |= (axis as u32) << (2 * h);
        self.axes |= [0, 1 << 14, 1 << 21][axis] << h;
    }

    /// The row of [`ORDER`] for a ray, in bytes.
    #[inline(always)]
    pub fn order_offset(&self, flips: Flips) -> usize {
        let flipped = self.axes & flips.others;
        ((flipped >> 10 ^ flipped >> 17 ^ flips.all) & 0x7F0) as usize
    }
}

/// Where the bits of plane `h`'s axis begin, by lane; the last lane holds no plane.
pub const AXIS_SHIFTS: [u32; 8] = [0, 2, 4, 6, 8, 10, 12, 14];

/// The signs of a ray's direction, spread over the planes of a treelet so that those of all seven are
/// found in a few steps: the sign along x, turned over where a plane's axis has another one.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Flips {
    /// Bits of [`Treelet::axes`] where the axis is y or z and its sign not that of x.
    others: u32,
    /// The sign along x for each row of [`ORDER`] of 16 bytes.
    all: u32,
}

impl Flips {
    /// For directions with these signs, the axis' bit set if it is negative.
    #[inline(always)]
    pub const fn new(signs: u32) -> Flips {
        FLIPS[signs as usize & 7]
    }
}

static FLIPS: [Flips; 8] = {
    let mut flips = [Flips { others: 0, all: 0 }; 8];
    let mut signs = 0;
    while signs < 8 {
        let [x, y, z] = [signs as u32 & 1, signs as u32 >> 1 & 1, signs as u32 >> 2];
        let others = ((x ^ y) * 0x7F) << 14 | ((x ^ z) * 0x7F) << 21;
        flips[signs] = Flips { others, all: (x * 0x7F) << 4 };
        signs += 1;
    }
    flips
};

/// The code of a treelet.
pub fn treelet_code(line: u32) -> u32 {
    line << COUNT_BITS
}

/// The code of a leaf of `count` blocks from `line` on.
pub fn leaf_code(line: u32, count: u32) -> u32 {
    LEAF | line << COUNT_BITS | count.min(COUNT_OVERFLOW)
}

/// The line of a cell: of its treelet or its first block.
#[inline(always)]
pub fn code_line(code: u32) -> usize {
    ((code & !LEAF) >> COUNT_BITS) as usize
}

/// Offset in bytes of a cell's line.
#[inline(always)]
pub fn code_offset(code: u32) -> usize {
    const SHIFT: u32 = super::lines::LINE.trailing_zeros() - COUNT_BITS;
    ((code & !LEAF & !COUNT_OVERFLOW) as usize) << SHIFT
}

/// For each combination of direction signs on the seven planes: the children from far to near.
///
/// Entry `[signs][j]` packs, from bit 0, the child (3 bits), the plane crossed at level 1 (3 bits)
/// and at level 2 (3 bits) on the way to it. `j = 7` is the nearest child, so that pushing the
/// entries in order leaves the nearest on top of a stack.
#[repr(C, align(64))]
pub struct OrderTable(pub [[u16; 8]; 128]);

impl OrderTable {
    /// The table; bit `h` of the index is set if the direction component on plane `h`'s axis is
    /// negative.
    pub const fn new() -> Self {
        let mut table = [[0u16; 8]; 128];
        let mut signs = 0;
        while signs < 128 {
            let mut j = 0;
            while j < 8 {
                let rank = 7 - j; // 0 is nearest; bit 2: far side of the root plane
                let side0 = (rank >> 2 & 1) ^ (signs & 1);
                let h1 = 1 + side0;
                let side1 = (rank >> 1 & 1) ^ (signs >> h1 & 1);
                let h2 = 3 + 2 * side0 + side1;
                let side2 = (rank & 1) ^ (signs >> h2 & 1);
                let child = side0 * 4 + side1 * 2 + side2;
                table[signs][j] = (child | h1 << 3 | h2 << 6) as u16;
                j += 1;
            }
            signs += 1;
        }
        OrderTable(table)
    }
}

impl Default for OrderTable {
    fn default() -> Self {
        Self::new()
    }
}

/// The one table of the crate.
pub static ORDER: OrderTable = OrderTable::new();

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_are_those_of_the_axes() {
        for numbers in 0..3usize.pow(7) {
            let axis = |h: usize| numbers / 3usize.pow(h as u32) % 3;
            let mut treelet = Treelet::EMPTY;
            (0..7).for_each(|h| treelet.set_axis(h, axis(h)));
            assert!((0..7).all(|h| treelet.axis(h) == axis(h)));
            for signs in 0..8 {
                let expected: usize = (0..7).map(|h| (signs as usize >> axis(h) & 1) << h).sum();
                assert_eq!(
                    treelet.order_offset(Flips::new(signs)),
                    expected * size_of::<[u16; 8]>()
                );
            }
        }
    }
}
