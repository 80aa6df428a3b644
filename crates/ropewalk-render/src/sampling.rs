//! Where in a pixel eye rays go.

/// Place of sample `i` of `n` in pixel `(x, y)`, in the unit square.
///
/// One sample lies at the centre. More form a Hammersley set (one in each of `n` columns, rows by
/// the bit-reversed index), shifted around the pixel by a hash of its position, so that neighbours
/// do not share a pattern. The same pixel always has the same samples.
pub(crate) fn sample_in_pixel(x: u32, y: u32, i: u32, n: u32) -> [f64; 2] {
    if n == 1 {
        return [0.5, 0.5];
    }
    let unit = |bits: u32| f64::from(bits) / 2f64.powi(32);
    let shift = hash(u64::from(y) << 32 | u64::from(x));
    let u = (f64::from(i) + 0.5) / f64::from(n) + unit(shift as u32);
    let v = unit(i.reverse_bits()) + unit((shift >> 32) as u32);
    [u.fract(), v.fract()]
}

/// The finaliser of SplitMix64 (Steele, Lea, Flood 2014).
fn hash(key: u64) -> u64 {
    let mut z = key.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_stratified_in_columns_and_rows() {
        for (x, y, n) in [(0, 0, 16), (511, 3, 4), (7, 1023, 64), (5, 5, 2)] {
            let points: Vec<_> = (0..n).map(|i| sample_in_pixel(x, y, i, n)).collect();
            for axis in 0..2 {
                let mut at: Vec<f64> = points.iter().map(|p| p[axis]).collect();
                at.sort_by(f64::total_cmp);
                assert!(at[0] >= 0.0 && at[n as usize - 1] < 1.0);
                // A shifted lattice: equal steps of 1/n.
                for pair in at.windows(2) {
                    assert!((pair[1] - pair[0] - 1.0 / f64::from(n)).abs() < 1e-9);
                }
            }
        }
    }
}
