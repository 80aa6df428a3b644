//! Bounds on what a file may ask for.

/// What the reader accepts before it gives up. Nothing is ever allocated from an announced count:
/// memory grows with the text that was really read, by at most about nine bytes for each byte of
/// text (an `s 0 0 0 0` becomes one 80-byte object).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NffLimits {
    /// Bytes of text, after decompression.
    pub bytes: u64,
    /// Objects: spheres, cones, polygons and patches together.
    pub objects: u64,
    /// Vertices of one polygon or patch; checked on the announced count.
    pub vertices_per_polygon: u64,
    /// Materials (`f`).
    pub materials: u32,
    /// Lights (`l`).
    pub lights: u32,
    /// Bytes of one word; real numbers and keywords need fewer than 40.
    pub token_bytes: usize,
}

impl NffLimits {
    /// Generous for real scenes: 4 GiB of text, 20 million objects and as many materials,
    /// 1 million vertices per polygon, 65,536 lights, 1,024 bytes per word.
    pub const DEFAULT: NffLimits = NffLimits {
        bytes: 4 << 30,
        objects: 20_000_000,
        vertices_per_polygon: 1_000_000,
        materials: 20_000_000,
        lights: 65_536,
        token_bytes: 1_024,
    };
}

impl Default for NffLimits {
    fn default() -> Self {
        Self::DEFAULT
    }
}
