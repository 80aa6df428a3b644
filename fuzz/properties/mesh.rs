//! What must hold of the mesh readers for any bytes. Shared by the fuzz target and by the ordinary tests.

use ropewalk_scene::{Mesh, MeshFormat, MeshLimits};

/// Small, so that a short input reaches each of them.
const LIMITS: MeshLimits =
    MeshLimits { bytes: 1 << 20, vertices: 10_000, faces: 10_000, corners: 500 };

/// Reads `bytes`. A mesh must be sound and within the limits; an error must be one line. True if `bytes` are a
/// mesh.
///
/// # Panics
/// If the property does not hold.
pub fn reads_or_refuses(format: MeshFormat, bytes: &[u8]) -> bool {
    let mesh = match Mesh::parse(format, bytes, None, &LIMITS) {
        Ok(mesh) => mesh,
        Err(error) => {
            let sentence = error.to_string();
            assert!(!sentence.contains(char::is_control), "{sentence:?}");
            return false;
        }
    };
    assert!(!mesh.faces.is_empty() && mesh.faces.len() <= LIMITS.faces);
    assert!(mesh.vertices.len() <= LIMITS.vertices);
    assert!(mesh.faces.iter().flatten().all(|&i| (i as usize) < mesh.vertices.len()));
    assert!(mesh.vertices.iter().flatten().all(|&x| (x as f32).is_finite()));
    true
}
