//! What a build did, as it is kept with the tree.

use crate::build::{BuildReport, Preset};
use crate::tree::{LEAF_SIZE_BINS, TreeStats};

/// Figures of a build that are saved with the tree; times are not, so that the same input and settings
/// give the same bytes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figures {
    /// The preset that was built with, if it was one.
    pub preset: Option<Preset>,
    /// References per primitive.
    pub duplication: f64,
    /// Figures of the binary tree.
    pub tree: TreeStats,
}

/// Bytes of a preset's name.
const NAME_BYTES: usize = 16;

impl Figures {
    /// Those of a report.
    pub fn new(report: &BuildReport, preset: Option<Preset>) -> Self {
        Figures { preset, duplication: report.duplication, tree: report.tree.clone() }
    }

    /// The section `stat`.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let tree = &self.tree;
        let mut name = [0; NAME_BYTES];
        if let Some(preset) = self.preset {
            name[..preset.name().len()].copy_from_slice(preset.name().as_bytes());
        }
        let mut bytes = name.to_vec();
        let counts = [
            tree.inner_nodes,
            tree.leaves,
            tree.empty_leaves,
            tree.references,
            tree.max_depth,
            tree.bytes,
        ];
        counts.iter().for_each(|&x| bytes.extend((x as u64).to_le_bytes()));
        let numbers = [
            tree.mean_depth,
            tree.predicted_inner_visits,
            tree.predicted_leaf_visits,
            tree.predicted_empty_leaf_visits,
            tree.predicted_intersection_tests,
            self.duplication,
        ];
        numbers.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        tree.leaf_sizes.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes
    }

    /// From such a section; `None` if it is none.
    pub(super) fn parse(bytes: &[u8]) -> Option<Figures> {
        let (name, rest) = bytes.split_at_checked(NAME_BYTES)?;
        let (words, []) = rest.as_chunks::<8>() else { return None };
        let (counts, words) = words.split_at_checked(6)?;
        let (numbers, bins) = words.split_at_checked(6)?;
        if bins.len() > LEAF_SIZE_BINS {
            return None;
        }
        let name = std::str::from_utf8(name).ok()?.trim_end_matches('\0');
        let preset = Preset::ALL.into_iter().find(|preset| preset.name() == name);
        if preset.is_none() && !name.is_empty() {
            return None;
        }
        let count = |i: usize| usize::try_from(u64::from_le_bytes(counts[i])).ok();
        let number = |i: usize| f64::from_le_bytes(numbers[i]);
        let tree = TreeStats {
            inner_nodes: count(0)?,
            leaves: count(1)?,
            empty_leaves: count(2)?,
            references: count(3)?,
            max_depth: count(4)?,
            bytes: count(5)?,
            mean_depth: number(0),
            predicted_inner_visits: number(1),
            predicted_leaf_visits: number(2),
            predicted_empty_leaf_visits: number(3),
            predicted_intersection_tests: number(4),
            leaf_sizes: bins.iter().map(|&bin| u64::from_le_bytes(bin)).collect(),
        };
        Some(Figures { preset, duplication: number(5), tree })
    }
}
