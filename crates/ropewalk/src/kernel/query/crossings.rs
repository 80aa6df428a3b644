//! The triangles that a particle's segment crosses, decided without rounding.

#![allow(unsafe_code)]

use super::{BatchQuery, Clear};
use crate::kernel::exact::{At, Exact, place};
use crate::kernel::level::Simd;
use crate::kernel::slot::Slot;
use crate::kernel::wave::WAVE;
use crate::ray::Hit;
use crate::walker::{Crossed, WalkerGeometry, crossing};
use crate::wide::{Block, ID_MASK, LEAF, Treelet, WIDTH, WideTree, code_line};

/// All crossings of the segments under way, in order.
pub struct Crossings<'a, G: WalkerGeometry> {
    geometry: &'a G,
    lanes: Vec<Lane<G::Float>>,
}

/// A segment under way.
#[derive(Clone, Default)]
struct Lane<T> {
    from: [T; 3],
    to: [T; 3],
    /// Where triangles lie that it may cross.
    found: Vec<At>,
    crossed: Vec<Crossed>,
}

impl<'a, G: WalkerGeometry> Crossings<'a, G> {
    /// No segments.
    pub fn new(geometry: &'a G) -> Self {
        Crossings { geometry, lanes: vec![Lane::default(); WAVE] }
    }

    /// The next segment of a lane.
    #[inline(always)]
    pub fn set(&mut self, k: usize, from: [G::Float; 3], to: [G::Float; 3]) {
        (self.lanes[k].from, self.lanes[k].to) = (from, to);
    }

    /// The crossings of a lane's last segment.
    pub fn of(&self, k: usize) -> &[Crossed] {
        &self.lanes[k].crossed
    }
}

/// The corners of a triangle in a block.
#[inline(always)]
fn corners(block: &Block, lane: usize) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|vertex| [0, 1, 2].map(|axis| f64::from(block.vertex[vertex][axis][lane])))
}

impl<G: WalkerGeometry> BatchQuery for Crossings<'_, G> {
    const ANY: bool = false;
    const ROUNDED: bool = G::ROUNDED;
    const CANDIDATES: bool = true;
    const TRIANGLES: bool = true;

    #[inline(always)]
    unsafe fn take_clear<L: Simd>(
        &mut self,
        k: usize,
        _slot: &mut Slot,
        hits: &Clear<'_>,
        _exact: &Exact<'_>,
    ) -> u32 {
        let mut lanes = hits.lanes;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize & 7;
            self.lanes[k].found.push(place(hits.line, lane));
            lanes &= lanes - 1;
        }
        0
    }

    fn take(&mut self, _k: usize, _slot: &mut Slot, _hit: &Hit, _exact: &Exact<'_>) {}

    #[inline(always)]
    fn finish(&mut self, k: usize, _slot: &mut Slot, exact: &Exact<'_>) {
        let Lane { from, to, found, crossed } = &mut self.lanes[k];
        crossed.clear();
        if found.is_empty() {
            return;
        }
        let from = self.geometry.scaled(from.map(Into::into));
        let to = self.geometry.scaled(to.map(Into::into));
        for at in found.drain(..) {
            let (block, lane) = (exact.lines.block(at as usize / WIDTH), at as usize % WIDTH);
            let prim_id = block.id[lane] & ID_MASK;
            let corners = if G::ROUNDED {
                self.geometry.corners(prim_id)
            } else {
                Some(corners(block, lane))
            };
            let met = corners.and_then(|corners| crossing(from, to, &corners));
            if let Some((share, entering)) = met {
                crossed.push(Crossed { share, prim_id, entering });
            }
        }
        if crossed.len() > 1 {
            let order = |a: &Crossed, b: &Crossed| {
                a.share.total_cmp(&b.share).then(a.prim_id.cmp(&b.prim_id))
            };
            crossed.sort_unstable_by(order);
            crossed.dedup_by_key(|hit| hit.prim_id);
        }
    }

    fn miss(&mut self, index: usize) {
        self.lanes[index].crossed.clear();
    }

    #[cold]
    fn gather(&mut self, tree: &WideTree, k: usize) {
        let Lane { from, to, found, .. } = &mut self.lanes[k];
        let from = self.geometry.placed(from.map(Into::into));
        let to = self.geometry.placed(to.map(Into::into));
        let low: [f64; 3] = std::array::from_fn(|a| from[a].min(to[a]));
        let high: [f64; 3] = std::array::from_fn(|a| from[a].max(to[a]));
        let outer = tree.outer_box();
        let apart = |a: usize| high[a] < outer.min[a].into() || low[a] > outer.max[a].into();
        if (0..3).any(apart) {
            return;
        }
        let mut stack = vec![tree.root()];
        while let Some(code) = stack.pop() {
            if code == 0 {
                continue;
            }
            if code & LEAF == 0 {
                let treelet = tree.lines().treelet(code_line(code));
                stack.extend(
                    (0..8).filter(|&c| reaches(treelet, c, &low, &high)).map(|c| treelet.child[c]),
                );
                continue;
            }
            for line in tree.block_lines(code) {
                let block = tree.lines().block(line);
                let holds = |lane: &usize| !block.vertex[0][0][*lane].is_nan();
                found.extend((0..WIDTH).filter(holds).map(|lane| place(line, lane)));
            }
        }
    }
}

/// True if a box touches the closed cell of a child of a treelet.
fn reaches(treelet: &Treelet, child: usize, low: &[f64; 3], high: &[f64; 3]) -> bool {
    let mut heap = 0;
    for level in 0..3 {
        let upper = child >> (2 - level) & 1;
        let (axis, plane) = (treelet.axis(heap), f64::from(treelet.plane[heap]));
        if if upper == 1 { high[axis] < plane } else { low[axis] > plane } {
            return false;
        }
        heap = 2 * heap + 1 + upper;
    }
    true
}
