//! The C interface of ropewalk; `include/ropewalk.h` is made from it.
//!
//! One scene of triangles behind an opaque pointer, the batch queries of rays, saved scenes. Every function that can
//! fail returns a [`RopewalkStatus`] and leaves a sentence for [`ropewalk_last_error`]; none of them panics or aborts the
//! process on bad input that a function can see. Pointers that lead nowhere it cannot see.

// A C interface is made of raw pointers: each function says what it expects of them.
#![allow(unsafe_code)]

mod arrays;
mod hits;
mod rays;
mod scene;
mod status;
mod threads;

pub use hits::*;
pub use rays::*;
pub use scene::*;
pub use status::*;
