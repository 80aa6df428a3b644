//! What must hold of the mesh readers for any bytes. Shared by the fuzz target and by the ordinary tests.

use ropewalk_scene::{Mesh, MeshFormat, MeshLimits, MeshOutput, PlacedMeshes, Stage, stage};
use std::path::Path;

/// Small, so that a short input reaches each of them.
const LIMITS: MeshLimits = MeshLimits {
    bytes: 1 << 20,
    vertices: 10_000,
    faces: 10_000,
    corners: 500,
    placements: 1_000,
    images: 10,
    pixels: 10_000,
};

/// Reads `bytes`, without looks and with them, the latter with the files of this folder beside them. Meshes and stages must be sound
/// and within the limits, the mesh the same both times; an error must be one line. True if `bytes` are a mesh.
///
/// # Panics
/// If the property does not hold.
pub fn reads_or_refuses(format: MeshFormat, bytes: &[u8], folder: Option<&Path>) -> bool {
    let dressed = Stage::parse(format, bytes, folder, &LIMITS);
    if let Err(error) = &dressed {
        let sentence = error.to_string();
        assert!(!sentence.contains(char::is_control), "{sentence:?}");
    }
    let mesh = match Mesh::parse(format, bytes, folder, &LIMITS) {
        Ok(mesh) => mesh,
        Err(error) => {
            let sentence = error.to_string();
            assert!(!sentence.contains(char::is_control), "{sentence:?}");
            assert!(dressed.is_err(), "only the mesh is refused: {sentence}");
            check_placed(format, bytes, folder, Err(sentence));
            return false;
        }
    };
    assert!(!mesh.faces.is_empty() && mesh.faces.len() <= LIMITS.faces);
    assert!(mesh.vertices.len() <= LIMITS.vertices);
    assert!(mesh.faces.iter().flatten().all(|&i| (i as usize) < mesh.vertices.len()));
    assert!(mesh.vertices.iter().flatten().all(|&x| (x as f32).is_finite()));
    check_placed(format, bytes, folder, Ok(&mesh));
    check_writers(&mesh);
    assert!(mesh.defects(&()).is_some());
    match dressed {
        Ok(stage) => {
            assert_eq!(stage.mesh, mesh);
            check_stage(&stage);
        }
        // Materials of glTF may be wrong; nothing else is stricter than the mesh.
        Err(error) => assert_eq!(format, MeshFormat::Gltf, "{error}"),
    }
    true
}

/// The same of an OBJ file up to the first zero byte, with `a.mtl` and `a.png` beside it: what stands up to the next one, and the rest.
///
/// # Panics
/// If the property does not hold, or nothing can be written to the folder.
#[allow(dead_code)]
pub fn reads_or_refuses_with_library(bytes: &[u8], folder: &Path) -> bool {
    let mut parts = bytes.splitn(3, |&b| b == 0);
    let obj = parts.next().unwrap_or_default();
    for name in ["a.mtl", "a.png"] {
        let bytes = parts.next().unwrap_or_default();
        std::fs::write(folder.join(name), bytes).expect("the folder is written to");
    }
    reads_or_refuses(MeshFormat::Obj, obj, Some(folder))
}

/// Meshes that are kept apart are sound and come to the mesh of all. Only for what all come to may the file be refused and they
/// not be.
fn check_placed(
    format: MeshFormat,
    bytes: &[u8],
    folder: Option<&Path>,
    flat: Result<&Mesh, String>,
) {
    let placed = match (PlacedMeshes::parse(format, bytes, folder, &LIMITS), &flat) {
        (Ok(placed), _) => placed,
        (Err(_), Err(_)) => return,
        (Err(error), Ok(_)) => panic!("only the placed meshes are refused: {error}"),
    };
    assert!(!placed.placements.is_empty() && placed.placements.len() <= LIMITS.placements);
    let (mut vertices, mut faces) = (0, 0);
    for mesh in &placed.meshes {
        assert!(!mesh.faces.is_empty());
        assert!(mesh.faces.iter().flatten().all(|&i| (i as usize) < mesh.vertices.len()));
        assert!(mesh.vertices.iter().flatten().all(|&x| (x as f32).is_finite()));
        (vertices, faces) = (vertices + mesh.vertices.len(), faces + mesh.faces.len());
    }
    assert!(vertices <= LIMITS.vertices && faces <= LIMITS.faces);
    match flat {
        Err(sentence) => assert!(sentence.contains("at most"), "only all of them: {sentence}"),
        Ok(mesh) => {
            let corners = |mesh: &Mesh| -> Vec<[[u64; 3]; 3]> {
                let corner = |&i: &u32| mesh.vertices[i as usize].map(f64::to_bits);
                mesh.faces.iter().map(|face| face.each_ref().map(corner)).collect()
            };
            assert_eq!(placed.faces(), mesh.faces.len());
            let flat = placed.flatten(&LIMITS).expect("the file was read within the limits");
            assert!(corners(&flat) == corners(mesh), "they come to another mesh");
        }
    }
}

/// What is written of a mesh is read back.
fn check_writers(mesh: &Mesh) {
    let corners = |mesh: &Mesh| -> Vec<[[f64; 3]; 3]> {
        mesh.faces.iter().map(|face| face.map(|i| mesh.vertices[i as usize])).collect()
    };
    for (output, format) in [
        (MeshOutput::Obj, MeshFormat::Obj),
        (MeshOutput::Ply, MeshFormat::Ply),
        (MeshOutput::Stl, MeshFormat::Stl),
        (MeshOutput::Off, MeshFormat::Off),
        (MeshOutput::Glb, MeshFormat::Gltf),
    ] {
        let mut bytes = Vec::new();
        mesh.write(output, &mut bytes).expect("memory is written to");
        let read = Mesh::parse(format, &bytes, None, &MeshLimits::DEFAULT).expect("our own file");
        assert_eq!(read.faces.len(), mesh.faces.len());
        assert!(output.rounds() || corners(&read) == corners(mesh), "{output:?}");
    }
}

/// What every stage must be.
fn check_stage(stage: &Stage) {
    let faces = stage.mesh.faces.len();
    let fits = |len: usize| len == 0 || len == faces;
    assert!(fits(stage.normals.len()) && fits(stage.uvs.len()));
    assert!(fits(stage.colors.len()) && fits(stage.material.len()));
    assert!(!stage.materials.is_empty());
    assert!(stage.material.iter().all(|&m| (m as usize) < stage.materials.len()));
    for normal in stage.normals.iter().flatten() {
        let square: f32 = normal.iter().map(|x| x * x).sum();
        assert!(square == 0.0 || (square - 1.0).abs() < 1e-5, "{normal:?}");
    }
    assert!(stage.uvs.iter().flatten().flatten().all(|x| x.is_finite()));
    assert!(stage.colors.iter().flatten().flatten().all(|x| (0.0..=1.0).contains(x)));
    for material in &stage.materials {
        let shares =
            [material.opacity, material.metallic, material.roughness, material.transmission];
        assert!(shares.iter().chain(&material.base_color).all(|x| (0.0..=1.0).contains(x)));
        assert!(material.emission.iter().all(|x| x.is_finite() && *x >= 0.0));
        assert!(material.ior >= 1.0 && material.ior.is_finite());
        let textures = [
            &material.base_color_texture,
            &material.metallic_roughness_texture,
            &material.emission_texture,
            &material.normal_texture,
        ];
        for texture in textures.into_iter().flatten() {
            assert!((texture.image as usize) < stage.images.len());
        }
    }
    assert!(stage.images.len() <= LIMITS.images);
    let pixels = |image: &stage::Image| image.pixels.len() as u64;
    assert!(stage.images.iter().map(pixels).sum::<u64>() <= LIMITS.pixels);
    for image in &stage.images {
        assert!(image.width > 0 && image.height > 0);
        assert_eq!(pixels(image), u64::from(image.width) * u64::from(image.height));
    }
    if let Some(camera) = &stage.camera {
        let numbers = camera.from.iter().chain(&camera.at).chain(&camera.up);
        assert!(numbers.chain([&camera.angle, &camera.hither]).all(|x| x.is_finite()));
    }
    assert!(stage.skipped.iter().all(|sentence| !sentence.contains(char::is_control)));
}
