//! What a walk counts (Havran's minimum testing output).

/// Events of a walk. All methods are empty for [`NoCounts`], which costs nothing.
pub trait Counters {
    /// A ray is tested against a primitive (N_IT).
    fn intersection_test(&mut self) {}
    /// An inner node is visited (N_TS).
    fn traversal_step(&mut self) {}
    /// A leaf is visited (N_ETS), empty or not (N_EETS).
    fn leaf_visit(&mut self, _empty: bool) {}
    /// A face is crossed by a link.
    fn rope_crossing(&mut self) {}
    /// An inner node of a rope tree is visited.
    fn rope_tree_step(&mut self) {}
    /// A rope walk met a degenerate crossing (an edge, a corner, a ray in a cutting plane) and
    /// finished from the root.
    fn restart(&mut self) {}
}

/// Counts nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoCounts;

impl Counters for NoCounts {}

/// Counts everything.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Intersection tests, N_IT.
    pub intersection_tests: u64,
    /// Inner nodes visited, N_TS.
    pub traversal_steps: u64,
    /// Leaves visited, N_ETS.
    pub leaf_visits: u64,
    /// Empty leaves visited, N_EETS.
    pub empty_leaf_visits: u64,
    /// Faces crossed by a link.
    pub rope_crossings: u64,
    /// Inner nodes of rope trees visited.
    pub rope_tree_steps: u64,
    /// Walks finished from the root after a degenerate crossing.
    pub restarts: u64,
}

impl Counters for Counts {
    #[inline]
    fn intersection_test(&mut self) {
        self.intersection_tests += 1;
    }
    #[inline]
    fn traversal_step(&mut self) {
        self.traversal_steps += 1;
    }
    #[inline]
    fn leaf_visit(&mut self, empty: bool) {
        self.leaf_visits += 1;
        self.empty_leaf_visits += u64::from(empty);
    }
    #[inline]
    fn rope_crossing(&mut self) {
        self.rope_crossings += 1;
    }
    #[inline]
    fn rope_tree_step(&mut self) {
        self.rope_tree_steps += 1;
    }
    #[inline]
    fn restart(&mut self) {
        self.restarts += 1;
    }
}

impl std::ops::AddAssign for Counts {
    fn add_assign(&mut self, o: Self) {
        self.intersection_tests += o.intersection_tests;
        self.traversal_steps += o.traversal_steps;
        self.leaf_visits += o.leaf_visits;
        self.empty_leaf_visits += o.empty_leaf_visits;
        self.rope_crossings += o.rope_crossings;
        self.rope_tree_steps += o.rope_tree_steps;
        self.restarts += o.restarts;
    }
}
