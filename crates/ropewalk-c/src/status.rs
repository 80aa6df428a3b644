//! What functions return, and the sentence behind it.

use std::cell::RefCell;
use std::ffi::{CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What a function returns.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RopewalkStatus {
    /// All went well.
    Ok = 0,
    /// An argument is null or out of its range; the sentence names it, and the index in an array.
    InvalidArgument = 1,
    /// The system has not enough memory.
    OutOfMemory = 2,
    /// A file cannot be read or written.
    Io = 3,
    /// A file holds no sound scene.
    BadFile = 4,
    /// The progress function asked to stop.
    Cancelled = 5,
    /// A mistake of this library: please report it.
    Internal = 6,
}

/// Why a function failed.
pub struct Failure {
    /// What it returns.
    pub status: RopewalkStatus,
    /// The sentence.
    pub message: String,
}

impl Failure {
    /// A bad argument.
    pub fn argument(message: impl Into<String>) -> Failure {
        Failure { status: RopewalkStatus::InvalidArgument, message: message.into() }
    }
}

thread_local! {
    static LAST: RefCell<CString> = RefCell::default();
}

/// The sentence of the last function that failed on the calling thread; empty if none has. It stays valid until the
/// next one fails on this thread, and need not be freed.
#[unsafe(no_mangle)]
pub extern "C" fn ropewalk_last_error() -> *const c_char {
    LAST.with_borrow(|last| last.as_ptr())
}

/// Runs the body of a function: notes its failure, and turns a panic into one.
pub fn guard(body: impl FnOnce() -> Result<(), Failure>) -> RopewalkStatus {
    let failure = match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(())) => return RopewalkStatus::Ok,
        Ok(Err(failure)) => failure,
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
            let message = format!("a mistake in ropewalk: {}", text.unwrap_or("no more is known"));
            Failure { status: RopewalkStatus::Internal, message }
        }
    };
    // A sentence may quote a path, which has no zero byte.
    let message = CString::new(failure.message.replace('\0', " ")).unwrap_or_default();
    LAST.with_borrow_mut(|last| *last = message);
    failure.status
}
