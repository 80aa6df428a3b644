//! Hits of a ray in order: by parameter, and at equal parameters by primitive.

/// A number that orders hits as they are to be ordered.
#[inline(always)]
pub fn key(t: f32, prim_id: u32) -> u64 {
    // -0.0 and 0.0 are one parameter; bits of negative numbers run backwards.
    let bits = (t + 0.0).to_bits();
    let ordered = bits ^ ((bits as i32 >> 31) as u32 | 1 << 31);
    u64::from(ordered) << 32 | u64::from(prim_id)
}

/// The hit that a key stands for.
#[inline(always)]
pub fn hit_of(key: u64) -> (f32, u32) {
    let ordered = (key >> 32) as u32;
    let bits = ordered ^ (!(ordered as i32 >> 31) as u32 | 1 << 31);
    (f32::from_bits(bits), key as u32)
}

/// The room that a list of so many hits needs while it is put in order: whole stores, one at least.
pub const fn room(hits: usize) -> usize {
    if hits == 0 { 8 } else { hits.next_multiple_of(8) }
}

/// [`Simd::order`](super::level::Simd::order).
#[inline(always)]
pub fn order(keys: &mut [u64], t: &mut [f32], prim: &mut [u32]) -> usize {
    assert!(t.len().min(prim.len()) >= room(keys.len()), "no room");
    keys.sort_unstable();
    let (mut n, mut last) = (0, None);
    for &key in &*keys {
        (t[n], prim[n]) = hit_of(key);
        // What a repeated key has written is written over.
        n += usize::from(last != Some(key));
        last = Some(key);
    }
    n
}

#[cfg(test)]
#[allow(unsafe_code)]
mod tests {
    use super::*;
    use crate::kernel::level::{Level, Simd};

    #[test]
    fn keys_order_hits() {
        let ordered =
            [f32::NEG_INFINITY, -2.5, -1e-40, 0.0, 1e-40, 1.0, 1.0000001, 3e38, f32::INFINITY];
        for (i, &a) in ordered.iter().enumerate() {
            assert_eq!(hit_of(key(a, 7)), (a, 7));
            for &b in &ordered[i + 1..] {
                assert!(key(a, u32::MAX) < key(b, 0), "{a} {b}");
            }
        }
        assert_eq!(key(-0.0, 1), key(0.0, 1));
        assert!(key(1.0, 1) < key(1.0, 2));
    }

    /// Orders lists of every length with `L`, and keeps every set of lanes.
    ///
    /// # Safety
    /// The machine must have the features of `L`.
    unsafe fn check<L: Simd>() {
        let mut draw = 1u32;
        let mut next = move |n: u32| {
            draw = draw.wrapping_mul(0x915F_77F5).wrapping_add(1);
            (draw >> 16) % n
        };
        for n in 0..40 {
            for choices in [1, 3, 1000] {
                let hit = |_| (next(choices) as f32 - 1.0, next(choices));
                let mut hits: Vec<(f32, u32)> = (0..n).map(hit).collect();
                let mut keys: Vec<u64> = hits.iter().map(|&(t, prim)| key(t, prim)).collect();
                let (mut t, mut prim) = (vec![0.0; room(n)], vec![0; room(n)]);
                // SAFETY: passed on to the caller.
                let count = unsafe { L::order(&mut keys, &mut t, &mut prim) };
                hits.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                hits.dedup();
                let found: Vec<_> = t.into_iter().zip(prim).take(count).collect();
                assert_eq!(found, hits);
            }
        }
        let row = [7, 6, 5, 4, 3, 2, 1, 9];
        for lanes in 0..256 {
            let mut kept = [0; 8];
            // SAFETY: passed on to the caller.
            unsafe { L::keep(lanes, &row, &mut kept) };
            let expected: Vec<u32> =
                (0..8).filter(|lane| lanes >> lane & 1 == 1).map(|lane| row[lane]).collect();
            assert_eq!(kept[..expected.len()], expected);
        }
    }

    #[test]
    fn every_level_orders_and_keeps() {
        for level in Level::ALL.into_iter().filter(|level| level.is_available()) {
            // SAFETY: the level is available.
            unsafe {
                match level {
                    Level::Scalar => check::<crate::kernel::scalar::Scalar>(),
                    #[cfg(target_arch = "x86_64")]
                    Level::Avx2 => check::<crate::kernel::avx2::Avx2>(),
                    #[cfg(target_arch = "x86_64")]
                    Level::Avx512 => check::<crate::kernel::avx512::Avx512>(),
                    #[cfg(not(target_arch = "x86_64"))]
                    _ => {}
                }
            }
        }
    }
}
