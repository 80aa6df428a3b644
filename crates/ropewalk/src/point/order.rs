//! The order in which points are answered: along a Morton curve, so that those in turn lie close
//! together, need the same parts of the tree, and the nearest triangle of one bounds that of the next.

use crate::aabb::Aabb;
use rayon::prelude::*;

/// Cells of the curve along each axis.
const SIDE: f64 = 1024.0;

/// The indices of points, at most `2^32`, along the curve through a box; points outside count as on it.
pub fn along_curve(points: &[[f64; 3]], bounds: &Aabb, parallel: bool) -> Vec<u32> {
    let low = bounds.min.map(f64::from);
    let scale: [f64; 3] = std::array::from_fn(|a| SIDE / bounds.extent(a));
    let key = |(i, p): (usize, &[f64; 3])| {
        // NaN, and what lies below, becomes 0.
        let cell = |a: usize| ((p[a] - low[a]) * scale[a]).min(SIDE - 1.0) as u32;
        let code = spread(cell(0)) | spread(cell(1)) << 1 | spread(cell(2)) << 2;
        u64::from(code) << 32 | i as u64
    };
    let mut keys: Vec<u64>;
    if parallel {
        keys = points.par_iter().enumerate().map(key).collect();
        keys.par_sort_unstable();
    } else {
        keys = points.iter().enumerate().map(key).collect();
        keys.sort_unstable();
    }
    keys.into_iter().map(|key| key as u32).collect()
}

/// Ten bits, each two apart from the next.
fn spread(x: u32) -> u32 {
    let x = (x | x << 16) & 0x0300_00FF;
    let x = (x | x << 8) & 0x0300_F00F;
    let x = (x | x << 4) & 0x030C_30C3;
    (x | x << 2) & 0x0924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread() {
        for bit in 0..10 {
            assert_eq!(spread(1 << bit), 1 << (3 * bit));
        }
    }

    #[test]
    fn every_point_once_whatever_it_is() {
        let bounds = Aabb::new([0.0, 0.0, 1.0], [1.0, 2.0, 1.0]);
        let bad = [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e300, 0.5];
        let points: Vec<[f64; 3]> =
            (0..125).map(|i| [bad[i % 5], bad[i / 5 % 5], bad[i / 25]]).collect();
        for parallel in [false, true] {
            let mut order = along_curve(&points, &bounds, parallel);
            order.sort_unstable();
            assert!(order.into_iter().eq(0..125));
        }
    }
}
