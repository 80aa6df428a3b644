//! Vertices at one place, or nearly so, made one.

use super::{ASKED_EVERY, Mesh};
use crate::watched::Cancelled;
use ropewalk::build::Monitor;
use std::collections::HashMap;

/// Why vertices were not merged; the mesh is as it was.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MergeError {
    /// The distance is none.
    #[error("expected a distance that is finite and 0 or more, found {0}")]
    Distance(f64),
    /// The monitor cancelled it.
    #[error("merging was cancelled")]
    Cancelled,
}

impl From<Cancelled> for MergeError {
    fn from(_: Cancelled) -> Self {
        MergeError::Cancelled
    }
}

/// Sides of the grid's cells in distances, so that rounding never leads to a cell that is not looked at.
const CELL: f64 = 4.0;

impl Mesh {
    /// Makes one of vertices within a distance of each other, and says how many are gone. Vertices are taken in their order: each
    /// becomes the first one that was kept and lies no farther than `distance` (Euclidean, in the mesh's unit), or else is
    /// kept as it is. So no vertex moves by more than the distance, chains of near ones do not run together, and 0 merges
    /// those at exactly the same place (0.0 and -0.0 are one). Faces stay in their number and order, those that lose their area too.
    ///
    /// # Errors
    /// [`MergeError`] for a distance that is negative or not finite, or if the monitor cancels it.
    pub fn merge_vertices(
        &mut self,
        distance: f64,
        monitor: &dyn Monitor,
    ) -> Result<usize, MergeError> {
        if !(distance >= 0.0 && distance.is_finite()) {
            return Err(MergeError::Distance(distance));
        }
        let kept = if distance == 0.0 { self.places() } else { self.near(distance, monitor)? };
        if monitor.is_cancelled() {
            return Err(MergeError::Cancelled);
        }
        let mut number = vec![0u32; kept.len()];
        let mut count = 0;
        for (i, &first) in kept.iter().enumerate() {
            if first as usize == i {
                self.vertices[count] = self.vertices[i];
                number[i] = count as u32;
                count += 1;
            } else {
                number[i] = number[first as usize];
            }
        }
        self.vertices.truncate(count);
        self.vertices.shrink_to_fit();
        self.faces.iter_mut().flatten().for_each(|corner| *corner = number[*corner as usize]);
        Ok(kept.len() - count)
    }

    /// For each vertex the first kept one within a distance, which may be itself.
    fn near(&self, distance: f64, monitor: &dyn Monitor) -> Result<Vec<u32>, Cancelled> {
        const END: u32 = u32::MAX;
        // Kept vertices by the cell of a grid in which they lie, each with the one before in its cell.
        let mut cells: HashMap<[u64; 3], u32> = HashMap::new();
        let mut before = vec![END; self.vertices.len()];
        let mut kept = Vec::with_capacity(self.vertices.len());
        // Where cells have no numbers, only equal coordinates are near.
        let cell = |x: f64| match (x / (CELL * distance)).floor() {
            number if number.is_finite() => number + 0.0,
            _ => x + 0.0,
        };
        for (i, vertex) in self.vertices.iter().enumerate() {
            if i.is_multiple_of(ASKED_EVERY) && monitor.is_cancelled() {
                return Err(Cancelled);
            }
            // Rounding keeps the order, so that a number in between never lies in a cell outside.
            let around =
                vertex.map(|x| [cell(x - distance), cell(x), cell(x + distance)].map(f64::to_bits));
            let is_near = |other: u32| {
                let other = self.vertices[other as usize];
                let square = |a: usize| ((other[a] - vertex[a]) / distance).powi(2);
                square(0) + square(1) + square(2) <= 1.0
            };
            let mut first = i as u32;
            for [x, y, z] in combinations(&around) {
                let mut other = cells.get(&[x, y, z]).copied().unwrap_or(END);
                while other != END {
                    if other < first && is_near(other) {
                        first = other;
                    }
                    other = before[other as usize];
                }
            }
            if first == i as u32 {
                let own = around.map(|[_, own, _]| own);
                before[i] = cells.insert(own, first).unwrap_or(END);
            }
            kept.push(first);
        }
        Ok(kept)
    }
}

/// One of each three in all ways, equal neighbours once.
fn combinations(all: &[[u64; 3]; 3]) -> impl Iterator<Item = [u64; 3]> + '_ {
    (0..27).map(|i| [i % 3, i / 3 % 3, i / 9]).filter_map(|which| {
        let is_new = |a: usize| which[a] == 0 || all[a][which[a]] != all[a][which[a] - 1];
        (0..3).all(is_new).then(|| std::array::from_fn(|a| all[a][which[a]]))
    })
}
