//! Plane searches: which cutting plane is best for a node. One file a strategy.

mod binned;
mod macdonald_booth_1990;
mod object_median;
mod spatial_median;
mod sweep;
mod tally;

pub(super) use binned::Binned;
pub(super) use macdonald_booth_1990::MacDonaldBooth1990;
pub(super) use object_median::ObjectMedian;
pub(super) use spatial_median::SpatialMedian;
pub(super) use sweep::Sweep;

use super::event::Event;
use super::fragment::Fragment;
use super::plane::{CellAreas, Counts, Plane, Pricing};
use super::rays::NodeRays;
use crate::aabb::Aabb;
use crate::cost::MacDonaldBooth;
use crate::primitive::AreaRamp;

/// What a search may look at.
#[derive(Clone, Copy)]
pub(crate) struct NodeView<'a> {
    pub cell: Aabb,
    pub depth: usize,
    pub fragments: &'a [Fragment],
    /// Sorted events per axis; empty unless the search uses events.
    pub events: [&'a [Event]; 3],
    /// Sample rays, where enough of them meet the node. Read by [`Binned`] alone.
    pub rays: Option<NodeRays<'a>>,
    /// How much likelier than by its surface area a ray meets the node; 1 without rays.
    pub crowding: f64,
}

/// Buffers of the searches, kept between nodes.
#[derive(Default)]
pub(crate) struct SearchBuffers {
    centroids: Vec<f32>,
    ramps: Vec<AreaRamp>,
    events: [Vec<Event>; 3],
    candidates: binned::Candidates,
}

/// A strategy.
pub(crate) trait PlaneSearch: Sync {
    /// True if [`NodeView::events`] must be filled.
    fn uses_events(&self) -> bool;
    /// The best plane that makes progress, if there is one.
    fn best_plane(&self, node: &NodeView<'_>, buffers: &mut SearchBuffers) -> Option<Plane>;
}

/// Prices one plane by direct counting under the measure of MacDonald and Booth; fragments in the
/// plane go to the cheaper side, to the left on ties. `None` if the plane makes no progress.
fn direct_plane(
    node: &NodeView<'_>,
    areas: &CellAreas,
    axis: usize,
    position: f32,
    pricing: &Pricing,
) -> Option<Plane> {
    let counts = Counts::of(node.fragments, axis, position);
    let parts = areas.parts(position);
    priced_plane(areas, parts, axis, position, counts, node.fragments.len(), pricing)
}

/// The same where the counts and the areas of the children are known.
#[inline]
fn priced_plane(
    areas: &CellAreas,
    parts: (f64, f64),
    axis: usize,
    position: f32,
    counts: Counts,
    total: usize,
    pricing: &Pricing,
) -> Option<Plane> {
    let mut best: Option<Plane> = None;
    for planar_left in [true, false] {
        if !planar_left && counts.planar == 0 {
            break;
        }
        let (left, right) = counts.children(planar_left);
        if !areas.makes_progress(position, left, right, total) {
            continue;
        }
        let children = (left, right);
        let cost = pricing.price_parts(&MacDonaldBooth, areas, parts, total, children, (0.0, 0.0));
        if best.is_none_or(|b| cost < b.cost) {
            best = Some(Plane { axis, position, planar_left, cost, left, right });
        }
    }
    best
}

/// The middle of the cell, rounded to `f32`.
fn spatial_median(cell: &Aabb, axis: usize) -> f32 {
    (0.5 * (f64::from(cell.min[axis]) + f64::from(cell.max[axis]))) as f32
}

/// The median of the centroids of the fragments' boxes (the upper one of an even number), moved
/// into the cell.
fn object_median(node: &NodeView<'_>, axis: usize, centroids: &mut Vec<f32>) -> f32 {
    centroids.clear();
    centroids.extend(node.fragments.iter().map(|f| spatial_median(&f.bounds(), axis)));
    let middle = centroids.len() / 2;
    let (_, &mut median, _) = centroids.select_nth_unstable_by(middle, f32::total_cmp);
    median.clamp(node.cell.min[axis], node.cell.max[axis])
}

/// The axis whose turn it is at this depth, then the others in order.
fn axes_in_turn(depth: usize) -> impl Iterator<Item = usize> {
    (0..3).map(move |i| (depth + i) % 3)
}
