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

/// The room that a list of so many hits needs while it is put in order.
pub const fn room(hits: usize) -> usize {
    hits.next_multiple_of(8)
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
mod tests {
    use super::*;

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
}
