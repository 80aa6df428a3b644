//! The mesh readers on real files, and on files that are wrong in ways that were met before.

use libtest_mimic::{Arguments, Failed};
use ropewalk_scene::{Mesh, MeshLimits};
use ropewalk_testkit::data::trial;
use std::path::Path;

fn main() {
    let mut trials = Vec::new();
    for (path, vertices, faces) in READ {
        let test = move |path: &Path| read(path, vertices, faces);
        trials.push(trial(format!("mesh::{path}"), path, test));
    }
    for (path, sentence) in REFUSED {
        let path_of = format!("ugly/{path}");
        trials.push(trial(format!("mesh::refused::{path}"), &path_of, |path| {
            refused(path, sentence)
        }));
    }
    libtest_mimic::run(&Arguments::from_args(), trials).exit()
}

/// Files with their vertices and triangles.
const READ: [(&str, usize, usize); 27] = [
    ("mesh/bunny.ply.gz", 35_947, 69_451),
    ("mesh/dragon.obj.gz", 46_798, 93_600),
    ("mesh/scallop.glb.gz", 60_002, 120_000),
    ("mesh/teapot_newell.obj", 3_644, 6_320),
    ("scene/sponza.obj.gz", 60_848, 66_450),
    ("scene/sponza.ply.gz", 60_848, 66_450),
    ("scene/stadium.obj.gz", 6_190, 11_978),
    ("scene/van_gogh_room/scene.gltf", 12_405, 11_272),
    ("scene/vianney_house/scene.gltf", 42_706, 56_674),
    ("scene/vianney_house.ply.gz", 42_706, 56_674),
    ("ugly/assimp/Mesh_PrimitiveMode_04.gltf", 4, 2),
    ("ugly/assimp/box_longline.obj", 8, 944),
    ("ugly/assimp/concave_polygon.obj", 64, 64),
    ("ugly/assimp/cube_binary_header_with_RN_newline.ply", 8, 12),
    ("ugly/assimp/sphereWithHole.stl", 855, 285),
    ("ugly/assimp/triangle_with_two_solids.stl", 6, 2),
    ("ugly/draco/SimpleSparseAccessor.gltf", 14, 12),
    ("ugly/draco/ZeroLengthBufferView.gltf", 4, 2),
    ("ugly/draco/test_extra_whitespace.ply", 3, 1),
    ("ugly/synthetic/teapot_dup4.ply", 3_644, 25_280),
    ("ugly/tinyobj/leading-decimal-dot-issue-201.obj", 3, 1),
    ("ugly/trimesh/busted.STL", 11_634, 3_878),
    ("ugly/trimesh/comments.off", 8, 12),
    ("ugly/trimesh/negative_indices.obj", 8, 12),
    ("ugly/trimesh/no_indices_3storybuilding.glb", 216, 72),
    ("ugly/trimesh/polygonfaces.obj", 5, 3),
    ("ugly/trimesh/soup.stl", 300, 100),
];

/// Files that are refused, and what is said.
const REFUSED: [(&str, &str); 16] = [
    ("assimp/BoxWithInfinites.glb", "accessors[2]: expected a finite coordinate"),
    ("assimp/IndexOutOfRange.gltf", "expected a vertex from 0 to 23, found 255"),
    ("assimp/RecursiveNodes.gltf", "nodes[0]: expected a node with one parent"),
    ("assimp/invalid.off", "line 2: expected 3 vertices and 4 faces, found 45 bytes of text"),
    ("assimp/invalid_OutOfMemory.off", "line 2: expected 353535235358 vertices"),
    ("assimp/invalid_malformed.obj", "line 28: expected a vertex from 1 on"),
    ("assimp/issue623.ply", "line 15: expected the length of a list"),
    ("assimp/number_formats.obj", "line 11: expected z of a vertex, found \"3.1+e2\""),
    ("assimp/point_cloud.obj", "end of the file: expected at least one face, found none"),
    ("draco/inf_nan.obj", "line 1: expected a finite coordinate"),
    ("synthetic/teapot_nan.ply", "byte 403: expected a finite coordinate within f32 for vertex 19"),
    ("tinygltf/integer-out-of-bounds.gltf", "bufferViews[0].byteLength: expected an integer"),
    ("tinygltf/invalid-buffer-view-index.gltf", "expected POSITION, found none"),
    ("tinyobj/test-nan.obj", "line 12: expected a finite coordinate"),
    ("tinyobj/issue-140-zero-face-idx.obj", "line 16: expected a vertex from 1 on"),
    ("trimesh/notenoughindices.obj", "line 9: expected a face of at least 3 corners, found 2"),
];

fn read(path: &Path, vertices: usize, faces: usize) -> Result<(), Failed> {
    let mesh = Mesh::read(path, &MeshLimits::DEFAULT)?;
    if (mesh.vertices.len(), mesh.faces.len()) == (vertices, faces) {
        return Ok(());
    }
    Err(format!("{} vertices, {} faces", mesh.vertices.len(), mesh.faces.len()).into())
}

fn refused(path: &Path, sentence: &str) -> Result<(), Failed> {
    match Mesh::read(path, &MeshLimits::DEFAULT) {
        Ok(_) => Err("it was read".into()),
        Err(error) if error.to_string().contains(sentence) => Ok(()),
        Err(error) => Err(error.to_string().into()),
    }
}
