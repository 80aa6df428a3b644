//! Choices of a point of the unit square by a table of weights.

/// A density that is even within each cell of a grid: rows are chosen by their sums, then columns within the row. In
/// contrast to an alias table this keeps well-distributed numbers well distributed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Distribution {
    width: usize,
    /// Sums of weights up to the end of each row, over the whole.
    rows: Vec<f32>,
    /// Sums up to the end of each cell of a row, over the row; row by row.
    cells: Vec<f32>,
}

impl Distribution {
    /// A density of weights, row by row, that are finite and not negative; empty if all are zero.
    pub fn new(width: usize, weights: &[f64]) -> Self {
        let total: f64 = weights.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return Distribution::default();
        }
        let (mut rows, mut cells, mut below) = (Vec::new(), Vec::with_capacity(weights.len()), 0.0);
        for row in weights.chunks_exact(width) {
            let sum: f64 = row.iter().sum();
            let mut before = 0.0;
            for weight in row {
                before += weight;
                cells.push(if sum > 0.0 { (before / sum) as f32 } else { 0.0 });
            }
            below += sum;
            rows.push((below / total) as f32);
        }
        Distribution { width, rows, cells }
    }

    /// True if nothing can be chosen.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// A point of the unit square, across and down, and its density.
    pub fn sample(&self, u: [f32; 2]) -> ([f32; 2], f32) {
        let (row, down) = find(&self.rows, u[1]);
        let cells = self.row(row);
        let (column, across) = find(cells, u[0]);
        let place =
            |cell: usize, part: f32, n: usize| ((cell as f32 + part) / n as f32).min(BELOW_ONE);
        let point = [place(column, across, self.width), place(row, down, self.rows.len())];
        (point, self.cell_density(row, column))
    }

    /// The density of [`Distribution::sample`] at a point.
    pub fn density(&self, [x, y]: [f32; 2]) -> f32 {
        let cell = |x: f32, n: usize| ((x * n as f32) as usize).min(n - 1);
        self.cell_density(cell(y, self.rows.len()), cell(x, self.width))
    }

    fn row(&self, row: usize) -> &[f32] {
        &self.cells[row * self.width..(row + 1) * self.width]
    }

    fn cell_density(&self, row: usize, column: usize) -> f32 {
        let share = |sums: &[f32], i: usize| sums[i] - if i > 0 { sums[i - 1] } else { 0.0 };
        let cells = self.row(row);
        share(&self.rows, row) * share(cells, column) * (self.rows.len() * self.width) as f32
    }
}

/// The largest `f32` below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// The entry of sums that a number in `0..1` falls in, and its place in the entry.
fn find(sums: &[f32], u: f32) -> (usize, f32) {
    let u = u * sums[sums.len() - 1];
    // Entries without weight end where they begin, so that none of them is the first to end behind `u`.
    let at = sums.partition_point(|&sum| sum <= u).min(sums.len() - 1);
    let before = if at > 0 { sums[at - 1] } else { 0.0 };
    let part = (u - before) / (sums[at] - before);
    (at, if part.is_finite() { part.clamp(0.0, BELOW_ONE) } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_come_by_their_weights() {
        let weights = [0.0, 0.0, 0.0, 1.0, 0.0, 3.0, 2.0, 2.0, 0.0];
        let table = Distribution::new(3, &weights);
        let n = 512;
        let mut counts = [0; 9];
        for i in 0..n * n {
            let at = |k: u32| (k as f32 + 0.5) / n as f32;
            let (point, density) = table.sample([at(i % n), at(i / n)]);
            let cell = (point[1] * 3.0) as usize * 3 + (point[0] * 3.0) as usize;
            counts[cell] += 1;
            assert!((f64::from(density) - weights[cell] / 8.0 * 9.0).abs() < 1e-5);
            assert_eq!(density, table.density(point));
        }
        for (count, weight) in counts.iter().zip(weights) {
            let share = f64::from(*count) / f64::from(n * n);
            assert!((share - weight / 8.0).abs() < 5e-3, "{counts:?}");
        }
        assert!(Distribution::new(2, &[0.0; 4]).is_empty());
    }
}
