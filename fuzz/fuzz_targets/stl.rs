//! Any bytes as STL: the reader refuses them with an error or reads a sound mesh and its looks. It never panics and never
//! allocates by an announced count.
#![no_main]

#[path = "../properties/mesh.rs"]
mod property;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    property::reads_or_refuses(ropewalk_scene::MeshFormat::Stl, bytes, None);
});
