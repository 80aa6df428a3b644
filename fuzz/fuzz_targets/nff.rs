//! Any bytes: the NFF reader refuses them with an error or reads a scene that survives a round
//! trip. It never panics and never allocates by an announced count.
#![no_main]

#[path = "../properties/nff.rs"]
mod property;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    property::reads_or_refuses(bytes);
});
