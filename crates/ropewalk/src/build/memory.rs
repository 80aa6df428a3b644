//! How much memory a build may take.

use super::error::BuildError;

/// Bytes a primitive while the largest node is split: its fragment of 32 bytes, where it goes, and a
/// copy of the part that goes left.
const PRIMITIVE: f64 = 56.0;

/// Bytes a reference at the end of a build for the wide tree: 55 of treelets and blocks on the benchmark's
/// scenes, the reference itself, and its share of the binary nodes.
const REFERENCE: f64 = 64.0;

/// Bytes that any build takes.
const BASE: f64 = 65_536.0;

/// What a build for the wide tree takes at its peak beyond the geometry, if it ends with so many references
/// a primitive. An estimate, meant to be above: builds of the benchmark's scenes stay below it.
pub fn estimated_bytes(primitives: usize, duplication: f64) -> u64 {
    (BASE + primitives as f64 * (PRIMITIVE + REFERENCE * duplication)) as u64
}

/// The largest duplication up to `max` with which a build is estimated to stay within a limit.
///
/// # Errors
/// [`BuildError::Memory`] if it would not even without any duplication.
pub(crate) fn duplication_within(
    limit: u64,
    primitives: usize,
    max: f64,
) -> Result<f64, BuildError> {
    let least = estimated_bytes(primitives, 1.0);
    if least > limit {
        return Err(BuildError::Memory { needed: least, limit });
    }
    let rest = limit as f64 - BASE - primitives as f64 * PRIMITIVE;
    Ok((rest / (primitives.max(1) as f64 * REFERENCE)).clamp(1.0, max))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_bound_the_duplication() {
        let needed = |d| estimated_bytes(1000, d);
        assert_eq!(duplication_within(u64::MAX, 1000, 16.0), Ok(16.0));
        assert_eq!(duplication_within(needed(1.0), 1000, 16.0), Ok(1.0));
        let found = duplication_within(needed(3.0), 1000, 16.0).unwrap();
        assert!((found - 3.0).abs() < 1e-3);
        let limit = needed(1.0) - 1;
        let refused = BuildError::Memory { needed: needed(1.0), limit };
        assert_eq!(duplication_within(limit, 1000, 16.0), Err(refused));
        assert_eq!(duplication_within(1 << 20, 0, 16.0), Ok(16.0));
    }
}
