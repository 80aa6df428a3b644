//! Choices by weight in constant time.

/// A table of weights (A. J. Walker 1977, in the way of M. Vose 1991): one number gives an entry, and what is left
/// of the number is again evenly distributed.
#[derive(Clone, Debug, Default)]
pub(crate) struct AliasTable {
    /// The share of its column that an entry keeps, and who has the rest.
    columns: Vec<(f32, u32)>,
    /// Probabilities.
    probability: Vec<f32>,
}

impl AliasTable {
    /// A table of weights that are finite and not negative; empty if all are zero.
    pub fn new(weights: &[f64]) -> Self {
        let total: f64 = weights.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return AliasTable::default();
        }
        let n = weights.len();
        let mut scaled: Vec<f64> = weights.iter().map(|w| w / total * n as f64).collect();
        let (mut small, mut large): (Vec<usize>, Vec<usize>) =
            (0..n).partition(|&i| scaled[i] < 1.0);
        let mut columns: Vec<(f32, u32)> = (0..n as u32).map(|i| (1.0, i)).collect();
        while let (Some(&few), Some(&many)) = (small.last(), large.last()) {
            small.pop();
            columns[few] = (scaled[few] as f32, many as u32);
            scaled[many] -= 1.0 - scaled[few];
            if scaled[many] < 1.0 {
                large.pop();
                small.push(many);
            }
        }
        // What rounding left in `small` misses a full column by no more than that.
        let probability = weights.iter().map(|w| (w / total) as f32).collect();
        AliasTable { columns, probability }
    }

    /// True if nothing can be chosen.
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// The entry for a number in `0..1`, and what is left of the number, in `0..1` too. Of a table that is not empty.
    pub fn sample(&self, u: f32) -> (usize, f32) {
        let n = self.columns.len();
        let at = f64::from(u) * n as f64;
        let column = (at as usize).min(n - 1);
        let rest = (at - column as f64) as f32;
        let (share, other) = self.columns[column];
        let below_one = |x: f32| x.clamp(0.0, 1.0 - f32::EPSILON / 2.0);
        if rest < share {
            (column, below_one(rest / share))
        } else {
            (other as usize, below_one((rest - share) / (1.0 - share)))
        }
    }

    /// The probability of an entry.
    pub fn probability(&self, entry: usize) -> f32 {
        self.probability[entry]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_come_by_their_weights() {
        let weights = [0.5, 0.0, 3.0, 1.5, 0.0, 5.0];
        let table = AliasTable::new(&weights);
        let n = 1 << 16;
        let mut counts = [0; 6];
        let mut left = 0.0;
        for i in 0..n {
            let (entry, rest) = table.sample((i as f32 + 0.5) / n as f32);
            assert!((0.0..1.0).contains(&rest));
            counts[entry] += 1;
            left += f64::from(rest);
        }
        for (i, weight) in weights.iter().enumerate() {
            let share = f64::from(counts[i]) / f64::from(n);
            assert!((share - weight / 10.0).abs() < 1e-4, "{i}: {share}");
            assert!((f64::from(table.probability(i)) - weight / 10.0).abs() < 1e-7);
        }
        assert!((left / f64::from(n) - 0.5).abs() < 1e-3, "{left}");
    }

    #[test]
    fn nothing_to_choose_is_empty() {
        assert!(AliasTable::new(&[]).is_empty() && AliasTable::new(&[0.0, 0.0]).is_empty());
    }
}
