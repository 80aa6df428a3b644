//! The rays of each workload, made from fixed seeds.
//!
//! All directions have unit length and all ranges start at 0, since not every peer takes another
//! start; origins on surfaces are moved off them by 1e-5 of the diagonal.

#![forbid(unsafe_code)]

mod generate;
mod hit;
mod random;
mod surface;
mod vector;
mod walk;

pub use generate::{Generator, Sizes};
pub use hit::{BenchHit, NO_PRIMITIVE};
pub use random::Random;
pub use surface::{Surface, View, triangle_normal};

use ropewalk::Ray;

/// What is asked along the rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// The nearest hit.
    Closest,
    /// Whether anything is hit.
    Occluded,
    /// All hits in order.
    AllHits,
    /// The first hits in order, at most so many.
    FirstHits(usize),
    /// The nearest hit of segments that continue each other.
    Walk,
    /// No rays: the time to build.
    Build,
}

/// A workload of the benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Kind {
    /// A square picture from the scene's view, in Morton order, so that any 16 rays in turn are a
    /// block of 4 x 4 pixels.
    Primary,
    /// One bounce off the primary hits, directions cosine-weighted, shuffled.
    Diffuse,
    /// From the primary hits to the light, in the order of the picture.
    Shadow,
    /// From the primary hits, cosine-weighted, 5 % of the diagonal long, in the picture's order.
    AmbientOcclusion,
    /// All hits along random chords of the bounding sphere.
    AllHits,
    /// The first 8 hits along the same chords.
    FirstHits,
    /// Random walks with a mean free path of 1 % of the diagonal.
    Walk1,
    /// Random walks with a mean free path of 0.2 % of the diagonal.
    Walk02,
    /// Building the tree.
    Build,
}

/// How many hits [`Kind::FirstHits`] asks for.
pub const FIRST_HITS: usize = 8;

impl Kind {
    /// All workloads in the order of the record.
    pub const ALL: [Kind; 9] = [
        Kind::Primary,
        Kind::Diffuse,
        Kind::Shadow,
        Kind::AmbientOcclusion,
        Kind::AllHits,
        Kind::FirstHits,
        Kind::Walk1,
        Kind::Walk02,
        Kind::Build,
    ];

    /// Name on the command line and in the record.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Primary => "primary",
            Kind::Diffuse => "diffuse",
            Kind::Shadow => "shadow",
            Kind::AmbientOcclusion => "ao",
            Kind::AllHits => "all-hits",
            Kind::FirstHits => "first-8",
            Kind::Walk1 => "walk-1%",
            Kind::Walk02 => "walk-0.2%",
            Kind::Build => "build",
        }
    }

    /// The workload of this name.
    pub fn named(name: &str) -> Option<Kind> {
        Kind::ALL.into_iter().find(|k| k.name() == name)
    }

    /// What is asked.
    pub fn question(self) -> Question {
        match self {
            Kind::Primary | Kind::Diffuse => Question::Closest,
            Kind::Shadow | Kind::AmbientOcclusion => Question::Occluded,
            Kind::AllHits => Question::AllHits,
            Kind::FirstHits => Question::FirstHits(FIRST_HITS),
            Kind::Walk1 | Kind::Walk02 => Question::Walk,
            Kind::Build => Question::Build,
        }
    }
}

/// The rays of a workload.
#[derive(Clone, Debug, PartialEq)]
pub struct Workload {
    /// Which one.
    pub kind: Kind,
    /// The rays in one batch.
    pub rays: Vec<Ray>,
    /// For walks: where a chain of segments begins that continue each other; the first is 0.
    /// Empty otherwise.
    pub chains: Vec<u32>,
}

/// Rays of a block that a subset takes or leaves as a whole.
const SUBSET_BLOCK: usize = 1024;

impl Workload {
    /// Every `stride`-th block of rays, for engines that would take too long over all of them.
    pub fn subset(&self, stride: usize) -> Workload {
        let mut out = Workload { kind: self.kind, rays: Vec::new(), chains: Vec::new() };
        for (block, rays) in self.rays.chunks(SUBSET_BLOCK).enumerate().step_by(stride) {
            let (from, to) = (block * SUBSET_BLOCK, block * SUBSET_BLOCK + rays.len());
            let base = out.rays.len() as u32;
            if !self.chains.is_empty() {
                out.chains.push(base);
                let inside =
                    self.chains.iter().filter(|&&c| (from + 1..to).contains(&(c as usize)));
                out.chains.extend(inside.map(|&c| c - from as u32 + base));
            }
            out.rays.extend_from_slice(rays);
        }
        out
    }

    /// Where ray `index` of the whole lies in the subset of this stride, if it is in it.
    pub fn in_subset(index: usize, stride: usize) -> Option<usize> {
        let (block, within) = (index / SUBSET_BLOCK, index % SUBSET_BLOCK);
        block.is_multiple_of(stride).then(|| block / stride * SUBSET_BLOCK + within)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subsets_keep_rays_and_chains_in_place() {
        let rays: Vec<Ray> = (0..5000).map(|i| Ray::new([i as f32, 0.0, 0.0], [1.0; 3])).collect();
        let chains: Vec<u32> = (0..5000).step_by(300).collect();
        let whole = Workload { kind: Kind::Walk1, rays, chains };
        assert_eq!(whole.subset(1).rays, whole.rays);
        let half = whole.subset(2);
        for (i, ray) in whole.rays.iter().enumerate() {
            if let Some(k) = Workload::in_subset(i, 2) {
                assert_eq!(half.rays[k], *ray);
            }
        }
        assert!(half.chains.is_sorted() && half.chains[0] == 0);
        assert!(half.chains.contains(&1024), "the block at 2048 begins a chain");
        assert!(half.chains.contains(&(2100 - 2048 + 1024)));
    }

    #[test]
    fn names_are_unique_and_parse() {
        for kind in Kind::ALL {
            assert_eq!(Kind::named(kind.name()), Some(kind));
        }
        assert_eq!(Kind::named("nonesuch"), None);
    }
}
