//! Rows of numbers: one's own, or those of a file.

use crate::kernel::Memory;
use bytemuck::Pod;
use std::ops::Deref;
use std::sync::Arc;

/// Rows that never change.
#[derive(Clone)]
pub enum Rows<T> {
    Own(Vec<T>),
    /// Of a length and at an address that suit.
    Stored(Arc<Memory>),
}

impl<T: Pod> Rows<T> {
    /// `None` if the bytes are no whole number of rows, or not aligned as these are.
    pub fn stored(memory: Memory) -> Option<Self> {
        bytemuck::try_cast_slice::<u8, T>(memory.bytes()).ok()?;
        Some(Rows::Stored(Arc::new(memory)))
    }
}

impl<T: Pod> Deref for Rows<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        match self {
            Rows::Own(rows) => rows,
            Rows::Stored(memory) => bytemuck::cast_slice(memory.bytes()),
        }
    }
}
