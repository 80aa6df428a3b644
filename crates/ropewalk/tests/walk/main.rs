//! The walks: each answers exactly as brute force does, over any valid tree.

mod beam;
mod bench;
mod builders;
mod cells;
mod entry;
mod exact;
mod parts;
mod ropes;
mod scenes;
mod shapes;
mod vicinity;
mod walker;
mod walker_double;
mod wave;
