//! Ropes (neighbour links) and rope trees over the leaves of a tree.
