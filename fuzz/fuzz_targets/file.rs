//! Any bytes: they are refused as a saved scene with an error, or opened and asked every query. Once as they
//! are, once with the checksums of the header made right, so that what is altered meets the checks behind them.
#![no_main]

#[path = "../properties/file.rs"]
mod property;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    property::opens_or_refuses(bytes);
    let mut bytes = bytes.to_vec();
    property::repair(&mut bytes);
    property::opens_or_refuses(&bytes);
});
