//! Medians and means of a few measurements.

/// The median; the mean of the middle two of an even number, NaN of none.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    match n {
        0 => f64::NAN,
        _ if n % 2 == 1 => sorted[n / 2],
        _ => 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]),
    }
}

/// The arithmetic mean, NaN of none.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The geometric mean of positive values, NaN of none.
pub fn geometric_mean(values: &[f64]) -> f64 {
    mean(&values.iter().map(|v| v.ln()).collect::<Vec<_>>()).exp()
}

/// `(largest - smallest) / median`: how far the rounds of one timing lie apart; 0 of none.
pub fn relative_spread(values: &[f64]) -> f64 {
    let (lo, hi) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &v| (lo.min(v), hi.max(v)));
    let middle = median(values);
    if hi > lo && middle > 0.0 { (hi - lo) / middle } else { 0.0 }
}

/// `count` of `items` at even distances, the first included; all of them where there are fewer.
pub fn evenly<T: Copy>(items: &[T], count: usize) -> Vec<T> {
    if count >= items.len() {
        return items.to_vec();
    }
    let place = |i: usize| (i as u128 * items.len() as u128 / count as u128) as usize;
    (0..count).map(|i| items[place(i)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_ignore_order_and_outliers() {
        assert_eq!(median(&[9.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 1000.0, 2.0]), 3.0);
        assert_eq!(median(&[7.0]), 7.0);
        assert!(median(&[]).is_nan());
    }

    #[test]
    fn a_halving_and_a_doubling_cancel_in_the_geometric_mean_only() {
        assert_eq!(mean(&[0.5, 2.0]), 1.25);
        assert!((geometric_mean(&[0.5, 2.0]) - 1.0).abs() < 1e-15);
        assert!((geometric_mean(&[1.0, 10.0, 100.0]) - 10.0).abs() < 1e-12);
    }

    #[test]
    fn spread_is_relative_to_the_median() {
        assert_eq!(relative_spread(&[2.0, 1.0, 3.0]), 1.0);
        assert_eq!(relative_spread(&[5.0]), 0.0);
        assert_eq!(relative_spread(&[]), 0.0);
    }

    #[test]
    fn even_subsamples_span_the_whole_list() {
        let items: Vec<usize> = (0..1000).collect();
        assert_eq!(evenly(&items, 4), [0, 250, 500, 750]);
        let seven = evenly(&items, 7);
        assert_eq!(seven.len(), 7);
        assert!(seven.windows(2).all(|w| (142..=143).contains(&(w[1] - w[0]))));
        assert_eq!(evenly(&items, 1000), items);
        assert_eq!(evenly(&items, 5000), items);
        assert!(evenly(&items, 0).is_empty());
    }
}
