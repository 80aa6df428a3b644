//! Planes from min-max bins (Shevtsov, Soupikov and Kapustin 2007), settled at exact positions.

use super::tally::{AxisMeasure, Best, LANES, Lanes, Tally, block_width, mixed_parts};
use super::{NodeView, PlaneSearch, SearchBuffers, Sweep, priced_plane};
use crate::build::fragment::Fragment;
use crate::build::plane::{CellAreas, Counts, Plane, Pricing};
use crate::build::rays::NodeRays;
use crate::cost::MacDonaldBooth;
use glam::Vec4;
use rayon::prelude::*;

/// Extents within which positions can be spread in `f32`.
const SPREADABLE: std::ops::Range<f32> = 1e-30..1e30;

/// Positions of an axis that are tried one by one.
const MAX_CANDIDATES: usize = 128;

/// Times that the interval around the best sample is sampled again.
const ZOOMS: usize = 3;

/// The measure of MacDonald and Booth, minimised without sorting. In a large node starts and ends of
/// fragments are counted in [`BINS`] bins an axis; beside the cheapest boundary of bins all starts and
/// ends are then tried, the interval being sampled again until they are few. In a small node all
/// starts and ends are tried at once, which is the exact minimum.
///
/// Where sample rays meet the node, its children weigh by them too ([`NodeRays`]).
///
/// What is returned has true counts and lies at a start or end of a fragment; what may be missed in
/// a large node is a cheaper plane in a bin whose boundaries look dear.
///
/// Deviation: the paper cuts at boundaries of bins.
pub(crate) struct Binned {
    pub exact: Sweep<'static, MacDonaldBooth>,
    /// Nodes with fewer fragments are searched exactly.
    pub from: usize,
    /// True if large nodes may be counted by several threads.
    pub parallel: bool,
}

/// Fragments counted at a time: by one thread, and few enough for exact sums in `f32`.
const PIECE: usize = 1 << 16;

/// The fragments of a node, counted in pieces, and its rays.
#[derive(Clone, Copy)]
struct Pieces<'a> {
    all: &'a [Fragment],
    parallel: bool,
    rays: Option<NodeRays<'a>>,
}

impl Pieces<'_> {
    /// Adds up what `count` says of each piece. The result does not depend on the threads.
    #[inline]
    fn sum<T: Send>(&self, count: impl Fn(&[Fragment]) -> T + Sync, add: impl Fn(&mut T, T)) -> T {
        if self.all.len() <= PIECE {
            return count(self.all);
        }
        let pieces: Vec<T> = if self.parallel {
            self.all.par_chunks(PIECE).map(&count).collect()
        } else {
            self.all.chunks(PIECE).map(&count).collect()
        };
        let mut pieces = pieces.into_iter();
        // More than PIECE fragments make at least one piece.
        let mut sum = pieces.next().unwrap_or_else(|| count(&[]));
        pieces.for_each(|piece| add(&mut sum, piece));
        sum
    }

    /// Counts what lies beside some positions and offers them.
    #[inline]
    fn offer(&self, positions: &Lanes, measure: &AxisMeasure, any_planar: bool, best: &mut Best) {
        let axis = measure.axis();
        let tally = self.sum(|piece| Tally::of(piece, axis, positions, any_planar), Tally::add);
        match &self.rays {
            None => best.offer(measure, positions, &tally),
            Some(rays) => {
                let shares = measure.shares(positions).with_rays(rays, axis, positions);
                best.offer_shared(measure, positions, &tally, &shares);
            }
        }
    }
}

impl PlaneSearch for Binned {
    fn uses_events(&self) -> bool {
        false
    }

    fn best_plane(&self, node: &NodeView<'_>, buffers: &mut SearchBuffers) -> Option<Plane> {
        let pricing = &self.exact.pricing.where_crowded(node.crowding);
        let count = node.fragments.len();
        let fragments = Pieces { all: node.fragments, parallel: self.parallel, rays: node.rays };
        let tight = fragments.sum(Tight::of, Tight::add);
        let areas = std::array::from_fn(|axis| CellAreas::new(&node.cell, axis));
        let face = tight.best_face(fragments, &areas, pricing);
        // Where no set is cheaper than the whole, only cutting off empty space can pay.
        if pricing.leaf_cost.cost(1) == pricing.leaf_cost.cost(count) {
            return face;
        }
        let width = block_width(pricing.leaf_cost).filter(|_| tight.is_spreadable());
        let Some(width) = width else { return self.swept(node, buffers) };
        let measures = std::array::from_fn(|axis| {
            let areas = areas[axis].as_ref().filter(|_| tight.min[axis] < tight.max[axis]);
            areas.map(|a| AxisMeasure::new(a, axis, count, width, pricing))
        });
        let candidates = &mut buffers.candidates;
        let inner = if count >= self.from {
            tight.best_of_bins(fragments, &measures, candidates)
        } else if 2 * count <= MAX_CANDIDATES {
            tight.best_of_all(fragments, &measures, candidates)
        } else {
            return self.swept(node, buffers);
        };
        match (face, inner.plane(&areas, count, pricing, node.rays.as_ref())) {
            (Some(face), Some(inner)) => Some(if inner.cost < face.cost { inner } else { face }),
            (face, inner) => face.or(inner),
        }
    }
}

impl Binned {
    /// The exact sweep over events that are made and sorted for this node alone.
    fn swept(&self, node: &NodeView<'_>, buffers: &mut SearchBuffers) -> Option<Plane> {
        let mut events = std::mem::take(&mut buffers.events);
        for (axis, events) in events.iter_mut().enumerate() {
            events.clear();
            for (id, fragment) in node.fragments.iter().enumerate() {
                fragment.push_events(id as u32, axis, events);
            }
            events.sort_unstable();
        }
        let view = NodeView { events: [&events[0], &events[1], &events[2]], ..*node };
        let pricing = self.exact.pricing.where_crowded(node.crowding);
        let plane = Sweep { pricing, ..self.exact }.best_plane(&view, buffers);
        buffers.events = events;
        plane
    }
}

/// Measures of the three axes, where something can be cut.
type Measures = [Option<AxisMeasure>; 3];

/// Positions to be tried, in full tallies.
pub(crate) struct Candidates {
    positions: [f32; MAX_CANDIDATES + LANES],
    len: usize,
    /// False if no fragment is flat on the axis.
    any_planar: bool,
}

impl Default for Candidates {
    fn default() -> Self {
        Candidates { positions: [0.0; MAX_CANDIDATES + LANES], len: 0, any_planar: false }
    }
}

impl Candidates {
    /// Collects all starts and ends above `min` and up to `max`; false if there are too many.
    #[inline]
    fn collect(&mut self, fragments: &[Fragment], axis: usize, (min, max): (f32, f32)) -> bool {
        let (mut len, mut any_planar) = (0, false);
        for f in fragments {
            if len + 2 > MAX_CANDIDATES {
                return false;
            }
            let (lo, hi) = (f.min(axis), f.max(axis));
            any_planar |= lo == hi;
            // Written always, kept only inside: cheaper than a branch.
            self.positions[len] = lo;
            len += usize::from((min < lo) & (lo <= max));
            self.positions[len] = hi;
            len += usize::from((min < hi) & (hi <= max));
        }
        self.any_planar = any_planar;
        self.len = len.next_multiple_of(LANES);
        if len > 0 {
            let last = self.positions[len - 1];
            self.positions[len..self.len].fill(last);
        }
        true
    }

    /// These few alone.
    fn set(&mut self, positions: &[f32]) {
        self.any_planar = true;
        self.len = if positions.is_empty() { 0 } else { LANES };
        for (place, &position) in
            self.positions[..self.len].iter_mut().zip(positions.iter().cycle())
        {
            *place = position;
        }
    }

    /// Counts and offers all of them.
    #[inline]
    fn offer(&self, fragments: Pieces<'_>, measure: &AxisMeasure, best: &mut Best) {
        for positions in self.positions[..self.len].as_chunks::<LANES>().0 {
            fragments.offer(positions, measure, self.any_planar, best);
        }
    }
}

/// The box around all fragments of a node.
struct Tight {
    min: [f32; 3],
    max: [f32; 3],
    /// False if no fragment is flat.
    any_planar: bool,
}

impl Tight {
    fn of(fragments: &[Fragment]) -> Self {
        let (mut min, mut max, mut flat) = (Vec4::INFINITY, Vec4::NEG_INFINITY, 0);
        for f in fragments {
            let (lower, upper) = (f.lower(), f.upper());
            min = min.min(lower);
            max = max.max(upper);
            flat |= lower.cmpeq(upper).bitmask();
        }
        let ([x0, y0, z0, _], [x1, y1, z1, _]) = (min.to_array(), max.to_array());
        Tight { min: [x0, y0, z0], max: [x1, y1, z1], any_planar: flat & 0b111 != 0 }
    }

    fn add(&mut self, other: Tight) {
        for a in 0..3 {
            self.min[a] = self.min[a].min(other.min[a]);
            self.max[a] = self.max[a].max(other.max[a]);
        }
        self.any_planar |= other.any_planar;
    }

    /// The range of positions strictly inside the box: above the first and up to the second.
    fn inside(&self, axis: usize) -> (f32, f32) {
        (self.min[axis], self.max[axis].next_down())
    }

    /// True if positions can be spread over the box in `f32`.
    fn is_spreadable(&self) -> bool {
        (0..3).all(|a| {
            let extent = self.max[a] - self.min[a];
            extent == 0.0 || SPREADABLE.contains(&extent)
        })
    }

    /// The cheapest plane through a face of the box: it leaves one side empty, or filled by what
    /// lies in the face.
    fn best_face(
        &self,
        fragments: Pieces<'_>,
        areas: &[Option<CellAreas>; 3],
        pricing: &Pricing,
    ) -> Option<Plane> {
        let count = fragments.all.len();
        let [in_min, in_max] = if self.any_planar {
            fragments.sum(
                |piece| self.in_faces(piece),
                |sum, piece| {
                    for (sum, piece) in sum.iter_mut().flatten().zip(piece.iter().flatten()) {
                        *sum += piece;
                    }
                },
            )
        } else {
            [[0.0; 4]; 2]
        };
        let mut best: Option<Plane> = None;
        for axis in 0..3 {
            let Some(areas) = &areas[axis] else { continue };
            let mut offer = |position, counts| {
                let parts = mixed_parts(areas, axis, position, fragments.rays.as_ref());
                let plane = priced_plane(areas, parts, axis, position, counts, count, pricing);
                if plane.is_some_and(|p| best.is_none_or(|b| p.cost < b.cost)) {
                    best = plane;
                }
            };
            let planar = in_min[axis] as usize;
            offer(self.min[axis], Counts { left: 0, planar, right: count - planar });
            if self.max[axis] > self.min[axis] {
                let planar = in_max[axis] as usize;
                offer(self.max[axis], Counts { left: count - planar, planar, right: 0 });
            }
        }
        best
    }

    /// How many fragments lie in the lower and in the upper face of each axis.
    fn in_faces(&self, fragments: &[Fragment]) -> [[f32; 4]; 2] {
        let (mut in_min, mut in_max) = ([0.0f32; 4], [0.0f32; 4]);
        let [x0, y0, z0] = self.min;
        let [x1, y1, z1] = self.max;
        let (min, max) = ([x0, y0, z0, 0.0], [x1, y1, z1, 0.0]);
        for f in fragments {
            for i in 0..4 {
                in_min[i] += if f.lanes[4 + i] <= min[i] { 1.0 } else { 0.0 };
                in_max[i] += if f.lanes[i] >= max[i] { 1.0 } else { 0.0 };
            }
        }
        [in_min, in_max]
    }

    /// The cheapest of all starts and ends strictly inside the box.
    fn best_of_all(
        &self,
        fragments: Pieces<'_>,
        measures: &Measures,
        candidates: &mut Candidates,
    ) -> Best {
        let mut best = Best::NONE;
        for (axis, measure) in measures.iter().enumerate() {
            let Some(measure) = measure else { continue };
            candidates.collect(fragments.all, axis, self.inside(axis));
            candidates.offer(fragments, measure, &mut best);
        }
        best
    }

    /// The cheapest start or end beside the cheapest boundaries of bins.
    fn best_of_bins(
        &self,
        fragments: Pieces<'_>,
        measures: &Measures,
        candidates: &mut Candidates,
    ) -> Best {
        let grid = Grid::over(self);
        let bins = fragments.sum(|piece| Bins::of(piece, &grid, |bin| bin), Bins::add);
        let rays = fragments.rays.map(|rays| {
            let clamped = |bin: Vec4| bin.max(Vec4::ZERO).min(Vec4::splat((BINS - 1) as f32));
            (rays, Bins::of(rays.parts, &grid, clamped))
        });
        let mut boundaries: [Option<Boundary>; 3] = std::array::from_fn(|axis| {
            measures[axis].as_ref().and_then(|m| bins.best_boundary(m, &grid, rays.as_ref()))
        });
        boundaries.sort_by(|a, b| match (a, b) {
            (Some(a), Some(b)) => a.measure.total_cmp(&b.measure),
            (a, b) => b.is_some().cmp(&a.is_some()),
        });
        let mut best = Best::NONE;
        for Boundary { axis, bin, measure: sampled } in boundaries.into_iter().flatten() {
            let Some(measure) = &measures[axis] else { continue };
            if sampled >= best.lowest() {
                break;
            }
            let edges = (grid.edge(axis, bin - 1), grid.edge(axis, bin + 1));
            let ranges = (edges, self.inside(axis));
            search_interval(fragments, axis, ranges, measure, candidates, &mut best);
        }
        best
    }
}

/// Bins on each axis.
const BINS: usize = 32;

/// Where the bins lie: bin `b` holds what rounds to `b`, so that the outermost ones are half as wide.
struct Grid {
    origin: Vec4,
    /// Bins per unit; 0 on an axis without extent.
    scale: Vec4,
}

/// How many fragments start and end in each bin of each axis.
struct Bins {
    starts: [[u32; BINS]; 3],
    ends: [[u32; BINS]; 3],
}

/// The lower edge of a bin, and what a plane there costs.
struct Boundary {
    axis: usize,
    bin: usize,
    measure: f32,
}

/// Adding it rounds a number of `0 ..= 2^22` to an integer that stands in the low bits.
const ROUNDING: f32 = (1u32 << 23) as f32;

impl Grid {
    fn over(tight: &Tight) -> Self {
        let (mut origin, mut scale) = (Vec4::ZERO, Vec4::ZERO);
        for axis in 0..3 {
            let extent = tight.max[axis] - tight.min[axis];
            origin[axis] = tight.min[axis];
            scale[axis] = if extent > 0.0 { (BINS - 1) as f32 / extent } else { 0.0 };
        }
        Grid { origin, scale }
    }

    /// Where bin `b` begins, up to rounding.
    fn edge(&self, axis: usize, b: usize) -> f32 {
        self.origin[axis] + (b as f32 - 0.5) / self.scale[axis]
    }
}

impl Bins {
    /// `inside` moves positions outside of the grid, in bins, into it.
    #[inline]
    fn of(fragments: &[Fragment], grid: &Grid, inside: impl Fn(Vec4) -> Vec4) -> Self {
        let mut bins = Bins { starts: [[0; BINS]; 3], ends: [[0; BINS]; 3] };
        for f in fragments {
            let bin = |corner: Vec4| {
                (inside((corner - grid.origin) * grid.scale) + Vec4::splat(ROUNDING))
                    .to_array()
                    .map(|x| x.to_bits() as usize & (BINS - 1))
            };
            let (start, end) = (bin(f.lower()), bin(f.upper()));
            for axis in 0..3 {
                bins.starts[axis][start[axis]] += 1;
                bins.ends[axis][end[axis]] += 1;
            }
        }
        bins
    }

    fn add(&mut self, other: Bins) {
        let add = |sums: &mut [[u32; BINS]; 3], counts: &[[u32; BINS]; 3]| {
            sums.iter_mut().flatten().zip(counts.iter().flatten()).for_each(|(s, c)| *s += c);
        };
        add(&mut self.starts, &other.starts);
        add(&mut self.ends, &other.ends);
    }

    /// How many lie below and above each boundary of bins on an axis.
    fn beside(&self, axis: usize) -> [[f32; BINS]; 2] {
        let mut beside = [[0.0; BINS]; 2];
        let (mut left, mut right) = (0, self.ends[axis].iter().sum::<u32>());
        for bin in 0..BINS {
            (beside[0][bin], beside[1][bin]) = (left as f32, right as f32);
            left += self.starts[axis][bin];
            right -= self.ends[axis][bin];
        }
        beside
    }

    /// The cheapest boundary between two bins.
    fn best_boundary(
        &self,
        measure: &AxisMeasure,
        grid: &Grid,
        rays: Option<&(NodeRays<'_>, Bins)>,
    ) -> Option<Boundary> {
        let axis = measure.axis();
        let mut samples = Best::NONE;
        let [left, right] = self.beside(axis);
        let rays = rays.map(|(rays, bins)| (rays, bins.beside(axis)));
        let (origin, step) = (grid.edge(axis, 0), 1.0 / grid.scale[axis]);
        for half in 0..BINS / LANES {
            let at = |counts: &[f32; BINS]| -> Lanes {
                std::array::from_fn(|c| counts[half * LANES + c])
            };
            let tally = Tally { left: at(&left), right: at(&right), ..Tally::ZERO };
            let positions = std::array::from_fn(|c| origin + (half * LANES + c) as f32 * step);
            let mut shares = measure.shares(&positions);
            if let Some((rays, [left, right])) = &rays {
                shares = shares.mixed(rays, &at(left), &at(right));
            }
            samples.offer_shared(measure, &positions, &tally, &shares);
        }
        let (position, measure) = samples.cheapest()?;
        let bin = ((position - origin) * grid.scale[axis]).round() as usize;
        Some(Boundary { axis, bin: bin.clamp(1, BINS - 1), measure })
    }
}

/// Offers the starts and ends in an interval; where they are many, those around its cheapest part.
fn search_interval(
    fragments: Pieces<'_>,
    axis: usize,
    (mut interval, inside): ((f32, f32), (f32, f32)),
    measure: &AxisMeasure,
    candidates: &mut Candidates,
    best: &mut Best,
) {
    interval = (interval.0.max(inside.0), interval.1.min(inside.1));
    let mut found = candidates.collect(fragments.all, axis, interval);
    for _ in 0..ZOOMS {
        if found {
            break;
        }
        let positions = spread(interval);
        let mut samples = Best::NONE;
        fragments.offer(&positions, measure, true, &mut samples);
        let Some((position, _)) = samples.cheapest() else { break };
        let step = (interval.1 - interval.0) / LANES as f32;
        interval = ((position - step).max(interval.0), (position + step).min(interval.1));
        found = candidates.collect(fragments.all, axis, interval);
    }
    if !found || candidates.len == 0 {
        let middle = 0.5 * (interval.0 + interval.1);
        candidates.set(&beside(fragments.all, axis, (middle, middle), inside));
    }
    candidates.offer(fragments, measure, best);
}

/// Evenly spaced positions in a range; the last one is its end.
fn spread((min, max): (f32, f32)) -> Lanes {
    let step = (max - min) / LANES as f32;
    std::array::from_fn(|c| if c == LANES - 1 { max } else { min + (c + 1) as f32 * step })
}

/// The last start or end at or below an interval and the first one above it, where they lie inside
/// the box.
fn beside(
    fragments: &[Fragment],
    axis: usize,
    interval: (f32, f32),
    inside: (f32, f32),
) -> Vec<f32> {
    let (mut below, mut above) = (f32::NEG_INFINITY, f32::INFINITY);
    for f in fragments {
        for x in [f.min(axis), f.max(axis)] {
            below = if x <= interval.0 && x > below { x } else { below };
            above = if x > interval.1 && x < above { x } else { above };
        }
    }
    [below, above].into_iter().filter(|&x| inside.0 < x && x <= inside.1).collect()
}

#[cfg(test)]
mod tests;
