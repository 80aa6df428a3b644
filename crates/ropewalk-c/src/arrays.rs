//! Arrays of the caller.

use crate::status::Failure;
use std::mem::size_of;

/// Fails for arrays that are null, not aligned, or larger than memory can be.
fn check<T>(data: *const T, len: usize, name: &str) -> Result<(), Failure> {
    if len > isize::MAX as usize / size_of::<T>().max(1) {
        return Err(Failure::argument(format!("{name}: {len} entries are more than memory holds")));
    }
    if data.is_null() {
        return Err(Failure::argument(format!("{name} is null, where {len} entries are expected")));
    }
    if !data.is_aligned() {
        let to = align_of::<T>();
        return Err(Failure::argument(format!("{name} is not aligned to {to} bytes")));
    }
    Ok(())
}

/// An array that is read; it may be null if it is empty.
///
/// # Safety
/// `data` must have `len` entries that nobody writes to meanwhile.
pub unsafe fn input<'a, T>(data: *const T, len: usize, name: &str) -> Result<&'a [T], Failure> {
    if len == 0 {
        return Ok(&[]);
    }
    check(data, len, name)?;
    // SAFETY: it is neither null nor too long; the rest is the caller's word.
    Ok(unsafe { std::slice::from_raw_parts(data, len) })
}

/// An array that is written, zeroed first, since it may hold nothing yet; it may be null if it is empty. Zeros must be a value of
/// `T`.
///
/// # Safety
/// `data` must have room for `len` entries that nobody else uses meanwhile.
pub unsafe fn output<'a, T: Zero>(
    data: *mut T,
    len: usize,
    name: &str,
) -> Result<&'a mut [T], Failure> {
    if len == 0 {
        return Ok(&mut []);
    }
    check(data, len, name)?;
    // SAFETY: it is neither null nor too long, zeros are a value; the rest is the caller's word.
    unsafe {
        data.write_bytes(0, len);
        Ok(std::slice::from_raw_parts_mut(data, len))
    }
}

/// Types of which zeros are a value.
///
/// # Safety
/// They are.
pub unsafe trait Zero {}

// SAFETY: numbers, `false`, and a structure of numbers.
unsafe impl Zero for f32 {}
// SAFETY: as above.
unsafe impl Zero for u32 {}
// SAFETY: as above.
unsafe impl Zero for bool {}
// SAFETY: as above.
unsafe impl Zero for crate::rays::RopewalkSurface {}
