//! Well-distributed numbers: Owen-scrambled Sobol points, four dimensions at a time.

/// Most samples that one scrambled sequence holds; later ones begin another.
const SEQUENCE: u32 = 1 << 16;

/// What a set of four numbers is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// Place in the pixel, place on the lens.
    Camera,
    /// Choice of a light, place on it, survival of the path.
    Light,
    /// Choice of a lobe, direction in it.
    Bsdf,
}

/// The random numbers of one path.
///
/// Points of the first four Sobol dimensions, scrambled and shuffled anew for every pixel, vertex and purpose
/// (B. Burley, "Practical Hash-based Owen Scrambling", JCGT 2020): sets of four are stratified in themselves and
/// independent of each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sampler {
    seed: u32,
    index: u32,
}

impl Sampler {
    /// The numbers of a sample of a pixel. The same three give the same numbers.
    pub fn new(seed: u32, pixel: u32, sample: u32) -> Self {
        let sequence = sample / SEQUENCE;
        Sampler { seed: hash(pixel ^ hash(seed ^ hash(sequence))), index: sample % SEQUENCE }
    }

    /// Four numbers in `0..1` for a vertex of the path, the eye being vertex 0.
    pub fn four(&self, vertex: u32, purpose: Purpose) -> [f32; 4] {
        let set = vertex * 4 + purpose as u32;
        sobol_burley::sample_4d(self.index, 0, self.seed ^ hash(set + 1))
    }

    /// A number that tells this sample from all others.
    pub fn key(&self) -> u32 {
        hash(self.seed ^ hash(self.index))
    }
}

/// A permutation of 32-bit numbers (C. Wellons, hash prospector, "lowbias32").
pub(crate) fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// A number in `0..1` from the upper bits of a hash.
pub(crate) fn unit_float(bits: u32) -> f32 {
    (bits >> 8) as f32 / (1 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of any aligned 2^k samples, one lies in each of 2^k columns.
    #[test]
    fn samples_of_a_pixel_are_stratified() {
        for (vertex, purpose) in [(0, Purpose::Camera), (3, Purpose::Light), (9, Purpose::Bsdf)] {
            for (first, n) in [(0, 16), (16, 16), (64, 64), (SEQUENCE, 8)] {
                for axis in 0..4 {
                    let mut seen = vec![false; n as usize];
                    for i in first..first + n {
                        let x = Sampler::new(7, 1234, i).four(vertex, purpose)[axis];
                        seen[(x * n as f32) as usize] = true;
                    }
                    assert!(seen.iter().all(|&s| s), "{vertex} {purpose:?} {first} {axis}");
                }
            }
        }
    }

    #[test]
    fn pixels_and_seeds_differ() {
        let at = |seed, pixel| Sampler::new(seed, pixel, 0).four(1, Purpose::Bsdf);
        assert_ne!(at(0, 0), at(0, 1));
        assert_ne!(at(0, 0), at(1, 0));
        assert_eq!(at(5, 9), at(5, 9));
    }
}
