//! Batches of points over a wide tree.

use super::brute_force::{PointBruteForce, closest};
use super::cells::{self, Cell};
use super::order::along_curve;
use super::{ClosestPoint, Side, Triangles, WindingMoments, is_near};
use crate::aabb::Aabb;
use crate::geometry::Geometry;
use crate::kernel::point::{self, Found, Winding};
use crate::kernel::{BatchEvents, Level, NoEvents};
use crate::wide::WideTree;
use rayon::prelude::*;

/// Points that one task of a parallel batch answers.
const TASK: usize = 1024;

/// Fewer points than these are answered as they come.
const SORTED_FROM: usize = 32;

/// Points that are put in order together.
const SORTED: usize = 1 << 20;

/// Points for which all triangles are gone through that one task answers.
const FULL_TASK: usize = 4;

/// Accuracies with which it is first asked whether a winding number is above .5.
const COARSE: f64 = 0.45;
/// See [`COARSE`].
const FINE: f64 = 1e-3;

/// The nearest triangles of a batch: one entry a point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClosestPoints {
    /// Distance; infinite without a triangle, NaN for a point that is none.
    pub distance: Vec<f64>,
    /// The nearest primitive, of those equally near the lowest; `u32::MAX` without one.
    pub prim_id: Vec<u32>,
    /// The nearest point of it; NaN without one.
    pub point: Vec<[f64; 3]>,
    /// Weights of the triangle's vertices 1 and 2 at that point; NaN without one.
    pub uv: Vec<[f64; 2]>,
}

/// Why points cannot be answered.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PointError {
    /// The geometry holds spheres, cones or polygons.
    #[error("points are answered over triangles only; the geometry holds other primitives too")]
    NotTriangles,
    /// The moments are those of another tree.
    #[error("the moments were taken of another tree")]
    OtherTree,
}

/// Answers batches of points over a wide tree of triangles.
///
/// Points with a NaN or infinite coordinate or one beyond [`LARGEST`](super::LARGEST) have no answer:
/// NaN, no primitive, outside. Triangles without area are never the nearest and never crossed, and on
/// which side a triangle can be hit does not matter. Answers are those of [`PointBruteForce`] bit for
/// bit at every [`Level`], in any order, and with any number of threads. Batches are answered along a curve
/// through the tree's box, so points need no order of their own.
pub struct PointQueries<'a, G = Geometry> {
    tree: &'a WideTree,
    geometry: &'a G,
    level: Level,
    threads: usize,
}

impl<G> Clone for PointQueries<'_, G> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<G> Copy for PointQueries<'_, G> {}

impl<'a, G: Triangles> PointQueries<'a, G> {
    /// Queries at the best level of this machine, on all threads of the current rayon pool. `tree` must have been
    /// built over `geometry`.
    ///
    /// # Errors
    /// [`PointError::NotTriangles`] if a leaf of the tree holds anything else.
    pub fn new(tree: &'a G::Tree, geometry: &'a G) -> Result<Self, PointError> {
        let tree = G::wide(tree);
        if tree.has_shapes() {
            return Err(PointError::NotTriangles);
        }
        Ok(PointQueries { tree, geometry, level: Level::best(), threads: 0 })
    }

    /// The same with another level, or `None` if this machine lacks it.
    pub fn with_level(self, level: Level) -> Option<Self> {
        level.is_available().then_some(PointQueries { level, ..self })
    }

    /// The same on the calling thread only (`1`) or on the current rayon pool (`0`).
    pub fn with_threads(self, threads: usize) -> Self {
        PointQueries { threads, ..self }
    }

    /// The level in use.
    pub fn level(&self) -> Level {
        self.level
    }

    /// The nearest triangle of each point and the nearest point of it.
    pub fn closest_point(&self, points: &[[f64; 3]]) -> ClosestPoints {
        let nothing = ClosestPoint {
            distance: f64::NAN,
            prim_id: u32::MAX,
            point: [f64::NAN; 3],
            uv: [f64::NAN; 2],
        };
        let all = self.in_order(points, nothing, |points, answers| {
            let found = self.found(points);
            for ((point, found), answer) in points.iter().zip(found).zip(answers) {
                let distance = self.geometry.unscaled(found.distance2.sqrt());
                *answer = ClosestPoint { distance, ..nothing };
                if found.prim_id != u32::MAX {
                    *answer = closest(self.geometry, *point, found.distance2, found.prim_id);
                }
            }
        });
        ClosestPoints {
            distance: all.iter().map(|nearest| nearest.distance).collect(),
            prim_id: all.iter().map(|nearest| nearest.prim_id).collect(),
            point: all.iter().map(|nearest| nearest.point).collect(),
            uv: all.iter().map(|nearest| nearest.uv).collect(),
        }
    }

    /// The distance of each point from the nearest triangle.
    pub fn distance(&self, points: &[[f64; 3]]) -> Vec<f64> {
        self.in_order(points, f64::NAN, |points, distances| {
            for (found, distance) in self.found(points).iter().zip(distances) {
                *distance = self.geometry.unscaled(found.distance2.sqrt());
            }
        })
    }

    /// On which side of a closed surface each point is: the ray along +z crosses it an odd number of
    /// times from inside. Exact, also through edges and vertices; cavities and nested shells count as
    /// they lie, coincident triangles cancel, and which way triangles face does not matter. Of an open
    /// surface the answer holds for that direction only; see [`PointQueries::winding_number`].
    pub fn sides(&self, points: &[[f64; 3]]) -> Vec<Side> {
        self.in_order(points, Side::Outside, |points, sides| {
            let scene = (self.tree, self.geometry);
            point::sides(self.level, scene, points, sides, &mut NoEvents);
        })
    }

    /// True for points inside of a closed surface or on it; see [`PointQueries::sides`].
    pub fn contains(&self, points: &[[f64; 3]]) -> Vec<bool> {
        self.sides(points).into_iter().map(|side| side != Side::Outside).collect()
    }

    /// The distance of each point from a closed surface, negative inside, 0 on it.
    pub fn signed_distance(&self, points: &[[f64; 3]]) -> Vec<f64> {
        let (mut distance, sides) = (self.distance(points), self.sides(points));
        for (distance, side) in distance.iter_mut().zip(sides) {
            match side {
                Side::Outside => {}
                Side::On => *distance = 0.0,
                Side::Inside => *distance = -*distance,
            }
        }
        distance
    }

    /// The generalised winding number of each point (Jacobson, Kavan, Sorkine-Hornung 2013): 1 inside of
    /// a closed surface whose front is outside, 0 outside, in between near the holes of an open one;
    /// above .5 means inside. The sum over all triangles: its time grows with their number.
    pub fn winding_number(&self, points: &[[f64; 3]]) -> Vec<f64> {
        let oracle = PointBruteForce { geometry: self.geometry };
        let mut numbers = vec![0.0; points.len()];
        self.each(points, &mut numbers, FULL_TASK, |points, numbers| {
            for (point, number) in points.iter().zip(numbers) {
                *number = oracle.winding_number(*point);
            }
        });
        numbers
    }

    /// The moments of the tree's triangles, for [`PointQueries::winding_number_within`] and
    /// [`PointQueries::contains_by_winding`].
    pub fn winding_moments(&self) -> WindingMoments {
        WindingMoments::new(self.tree, self.geometry, self.threads != 1)
    }

    /// [`PointQueries::winding_number`] up to `accuracy`: cells far away count by their moments, as many as
    /// their error bounds allow (after Barill et al. 2018). The bound is proven (docs/numerics.md); it is mostly
    /// missed by far. Below about `1e-6` no moments are used, and only rounding differs from the sum.
    ///
    /// # Errors
    /// [`PointError::OtherTree`].
    pub fn winding_number_within(
        &self,
        moments: &WindingMoments,
        points: &[[f64; 3]],
        accuracy: f64,
    ) -> Result<Vec<f64>, PointError> {
        let found = self.windings(moments, points, accuracy)?;
        Ok(found.into_iter().map(|winding| winding.number).collect())
    }

    /// True where the winding number is above .5, for surfaces with holes. Decided as by
    /// [`PointQueries::winding_number`]: a number that may be on either side within its error is computed again,
    /// closer, and at last as the sum over all triangles.
    ///
    /// # Errors
    /// [`PointError::OtherTree`].
    pub fn contains_by_winding(
        &self,
        moments: &WindingMoments,
        points: &[[f64; 3]],
    ) -> Result<Vec<bool>, PointError> {
        let mut inside = vec![false; points.len()];
        let mut open: Vec<u32> = (0..points.len() as u32).collect();
        for accuracy in [COARSE, FINE] {
            let asked: Vec<[f64; 3]> = open.iter().map(|&i| points[i as usize]).collect();
            let found = self.windings(moments, &asked, accuracy)?;
            let mut next = Vec::new();
            for (&i, winding) in open.iter().zip(found) {
                inside[i as usize] = winding.number > 0.5;
                if (winding.number - 0.5).abs() <= winding.error {
                    next.push(i);
                }
            }
            open = next;
        }
        let asked: Vec<[f64; 3]> = open.iter().map(|&i| points[i as usize]).collect();
        for (&i, number) in open.iter().zip(self.winding_number(&asked)) {
            inside[i as usize] = number > 0.5;
        }
        Ok(inside)
    }

    fn windings(
        &self,
        moments: &WindingMoments,
        points: &[[f64; 3]],
        accuracy: f64,
    ) -> Result<Vec<Winding>, PointError> {
        if !moments.fits(self.tree) {
            return Err(PointError::OtherTree);
        }
        // NaN allows nothing.
        let accuracy = accuracy.max(0.0);
        let nothing = Winding { number: f64::NAN, error: f64::NAN };
        Ok(self.in_order(points, nothing, |points, found| {
            let scene = (self.tree, self.geometry);
            point::winding(self.level, scene, moments, points, accuracy, found);
        }))
    }

    /// The leaf whose cell holds each point; a point in a plane belongs to the upper side. `None`
    /// outside of the scene's box, and for NaN.
    pub fn locate(&self, points: &[[f64; 3]]) -> Vec<Option<Cell>> {
        let mut found = vec![None; points.len()];
        self.each(points, &mut found, TASK, |points, found| {
            for (point, cell) in points.iter().zip(found) {
                if !G::ROUNDED || self.is_within(*point) {
                    *cell = cells::locate(self.tree, self.geometry.placed(*point));
                }
            }
        });
        found
    }

    /// True in the box of all primitives; that of a tree of rounded ones is a little larger.
    fn is_within(&self, point: [f64; 3]) -> bool {
        let (p, [low, high]) = (self.geometry.scaled(point), self.geometry.extent());
        (0..3).all(|a| low[a] <= p[a] && p[a] <= high[a])
    }

    /// The box of a leaf in the numbers of the tree; `None` if the tree has no such leaf.
    pub fn cell_box(&self, cell: Cell) -> Option<Aabb> {
        cells::cell_box(self.tree, cell)
    }

    /// The lower and upper corner of a leaf, rounded where the tree has numbers of its own; `None` if it has no such
    /// leaf.
    pub fn cell_corners(&self, cell: Cell) -> Option<[[f64; 3]; 2]> {
        let bounds = self.cell_box(cell)?;
        Some([bounds.min, bounds.max].map(|p| self.geometry.unplaced(p.map(f64::from))))
    }

    /// True if a point has an answer: its coordinates are numbers up to [`LARGEST`](super::LARGEST), and in an `f64`
    /// scene also up to that many times the scene's size.
    pub fn is_near(&self, point: &[f64; 3]) -> bool {
        is_near(point) && is_near(&self.geometry.scaled(*point))
    }

    /// All leaves, empty ones included, in the order of their numbers.
    pub fn cells(&self) -> Vec<Cell> {
        cells::cells(self.tree)
    }

    /// The primitives that a leaf refers to, each once; none if the tree has no such leaf.
    pub fn cell_primitives(&self, cell: Cell) -> Vec<u32> {
        cells::cell_primitives(self.tree, cell)
    }

    /// What [`PointQueries::closest_point`] does, counted, on one thread: steps are treelets, `met` blocks
    /// tested beyond the boxes of their triangles, `clear` triangles in them near enough.
    pub fn closest_point_events(&self, points: &[[f64; 3]]) -> BatchEvents {
        let (mut found, mut events) = (vec![Found::INVALID; points.len()], BatchEvents::default());
        let scene = (self.tree, self.geometry);
        point::nearest(self.level, scene, points, &mut found, &mut events);
        events
    }

    /// What [`PointQueries::sides`] does, counted in the same way.
    pub fn sides_events(&self, points: &[[f64; 3]]) -> BatchEvents {
        let (mut sides, mut events) = (vec![Side::Outside; points.len()], BatchEvents::default());
        let scene = (self.tree, self.geometry);
        point::sides(self.level, scene, points, &mut sides, &mut events);
        events
    }

    /// The nearest triangles, one point after the other.
    fn found(&self, points: &[[f64; 3]]) -> Vec<Found> {
        let mut found = vec![Found::INVALID; points.len()];
        let scene = (self.tree, self.geometry);
        point::nearest(self.level, scene, points, &mut found, &mut NoEvents);
        found
    }

    /// Puts points to `work` along a curve, and its answers where they belong.
    fn in_order<T: Copy + Send>(
        &self,
        points: &[[f64; 3]],
        nothing: T,
        work: impl Fn(&[[f64; 3]], &mut [T]) + Sync,
    ) -> Vec<T> {
        let mut answers = vec![nothing; points.len()];
        if points.len() < SORTED_FROM {
            work(points, &mut answers);
            return answers;
        }
        let mut found = vec![nothing; points.len().min(SORTED)];
        for (points, answers) in points.chunks(SORTED).zip(answers.chunks_mut(SORTED)) {
            let parallel = !self.is_serial(points, TASK);
            let placed;
            let along = if G::ROUNDED {
                placed = points.iter().map(|&p| self.geometry.placed(p)).collect::<Vec<_>>();
                &placed
            } else {
                points
            };
            let order = along_curve(along, self.tree.bounds(), parallel);
            let sorted: Vec<[f64; 3]> = order.iter().map(|&i| points[i as usize]).collect();
            let found = &mut found[..points.len()];
            self.each(&sorted, found, TASK, &work);
            for (&i, found) in order.iter().zip(found) {
                answers[i as usize] = *found;
            }
        }
        answers
    }

    fn is_serial(&self, points: &[[f64; 3]], task: usize) -> bool {
        self.threads == 1 || points.len() <= task
    }

    /// Shares points and answers out over the threads.
    fn each<T: Send>(
        &self,
        points: &[[f64; 3]],
        answers: &mut [T],
        task: usize,
        work: impl Fn(&[[f64; 3]], &mut [T]) + Sync,
    ) {
        if self.is_serial(points, task) {
            return work(points, answers);
        }
        let chunks = points.par_chunks(task).zip(answers.par_chunks_mut(task));
        chunks.for_each(|(points, answers)| work(points, answers));
    }
}
