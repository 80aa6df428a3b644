//! Batches in pieces: how large these are, and how their results come together.

use crate::error;
use crate::rays::Invalid;
use pyo3::prelude::*;
use std::ops::Range;

/// The fewest rays of a task where several threads share a batch.
const MIN_BLOCK: usize = 1024;

/// Tasks a thread, so that none waits long for the slowest.
const TASKS_PER_THREAD: usize = 4;

/// All of them together.
pub fn total(parts: Vec<Invalid>) -> Invalid {
    parts.into_iter().fold(Invalid::default(), Invalid::and)
}

/// Rays of a task, `most` at most.
pub fn block(rays: usize, threads: usize, most: usize) -> usize {
    match threads {
        1 => most,
        _ => rays.div_ceil(threads.max(1) * TASKS_PER_THREAD).clamp(MIN_BLOCK, most),
    }
}

/// The ranges of some blocks of rays.
pub fn blocks(rays: usize, block: usize) -> impl Iterator<Item = Range<usize>> {
    (0..rays).step_by(block).map(move |start| start..rays.min(start + block))
}

/// Splits `n` entries off the front.
pub fn split<'a, T>(row: &mut &'a mut [T], n: usize) -> &'a mut [T] {
    row.split_off_mut(..n).expect("rows are as long as their parts together")
}

/// `len` if so many values can be had.
pub fn checked<T>(len: usize) -> PyResult<usize> {
    match Vec::<T>::new().try_reserve_exact(len) {
        Ok(()) => Ok(len),
        Err(_) => {
            let bytes = len.saturating_mul(size_of::<T>());
            Err(error::memory(format!("an array of {len} values, {bytes} bytes, cannot be had")))
        }
    }
}

/// So many zeros, if they can be had.
pub fn zeros<T: bytemuck::Zeroable + Clone>(len: usize) -> PyResult<Vec<T>> {
    Ok(vec![T::zeroed(); checked::<T>(len)?])
}
