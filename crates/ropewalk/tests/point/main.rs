//! Points: every answer is that of brute force, bit for bit, and that of geometry.

mod cells;
mod closest;
mod double;
mod meshes;
mod sides;
mod winding;
