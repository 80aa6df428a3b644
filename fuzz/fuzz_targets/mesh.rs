//! Any bytes in any format, which the first byte chooses: the mesh readers refuse them with an error or read a
//! sound mesh. They never panic and never allocate by an announced count.
#![no_main]

#[path = "../properties/mesh.rs"]
mod property;

use ropewalk_scene::MeshFormat;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Some((&first, rest)) = bytes.split_first() {
        let format = MeshFormat::ALL[usize::from(first) % MeshFormat::ALL.len()];
        property::reads_or_refuses(format, rest, None);
    }
});
