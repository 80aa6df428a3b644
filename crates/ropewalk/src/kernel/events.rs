//! Counted events of a batch.

/// What a kernel does, counted or not. The kernels are generic over this, so that a run without
/// counters pays nothing.
pub trait Events {
    /// Rays are under way.
    #[inline(always)]
    fn rays(&mut self, _n: usize) {}
    /// Rays are known to hit nothing where they are: no steps, no tests.
    #[inline(always)]
    fn skipped(&mut self, _n: u32) {}
    /// The entry search looks at a treelet.
    #[inline(always)]
    fn looked(&mut self) {}
    /// A segment's box is held against those of a block.
    #[inline(always)]
    fn boxed(&mut self) {}
    /// A ray steps through a treelet.
    #[inline(always)]
    fn step(&mut self) {}
    /// A ray visits a leaf.
    #[inline(always)]
    fn leaf(&mut self) {}
    /// A block is looked at.
    #[inline(always)]
    fn block(&mut self) {}
    /// A block is tested in full: lanes hit for sure, and open ones.
    #[inline(always)]
    fn found(&mut self, _clear: u32, _open: u32) {}
}

/// No counters.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoEvents;

impl Events for NoEvents {}

/// The events of a batch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BatchEvents {
    /// Rays that reach the scene's box, those skipped not counted.
    pub rays: u64,
    /// Rays that the entry search answered: no cell with primitives is near.
    pub skipped: u64,
    /// Treelets that the entry search looked at.
    pub looked: u64,
    /// Blocks whose boxes were held against that of a segment.
    pub boxed: u64,
    /// Steps through treelets.
    pub steps: u64,
    /// Leaves visited, the one that ends a ray's stack not counted.
    pub leaves: u64,
    /// Blocks of eight primitives tested.
    pub blocks: u64,
    /// Of these, blocks tested in full: with a triangle that the ray may hit, or all of them.
    pub met: u64,
    /// Triangles hit for sure, as `f32` sees it.
    pub clear: u64,
    /// Triangles decided in `f64`; in addition each first hit takes its parameter from there.
    pub open: u64,
}

impl Events for BatchEvents {
    fn rays(&mut self, n: usize) {
        self.rays += n as u64;
    }
    fn skipped(&mut self, n: u32) {
        self.skipped += u64::from(n);
    }
    fn looked(&mut self) {
        self.looked += 1;
    }
    fn boxed(&mut self) {
        self.boxed += 1;
    }
    fn step(&mut self) {
        self.steps += 1;
    }
    fn leaf(&mut self) {
        self.leaves += 1;
    }
    fn block(&mut self) {
        self.blocks += 1;
    }
    fn found(&mut self, clear: u32, open: u32) {
        self.met += 1;
        self.clear += u64::from(clear.count_ones());
        self.open += u64::from(open.count_ones());
    }
}
