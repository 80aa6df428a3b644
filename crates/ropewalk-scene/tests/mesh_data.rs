//! The mesh readers on real files, and on files that are wrong in ways that were met before.

use libtest_mimic::{Arguments, Failed};
use ropewalk_scene::{Mesh, MeshFormat, MeshLimits, Stage};
use ropewalk_testkit::data::trial;
use std::path::Path;

fn main() {
    let mut trials = Vec::new();
    for (path, vertices, faces) in READ {
        let test = move |path: &Path| read(path, vertices, faces);
        trials.push(trial(format!("mesh::{path}"), path, test));
    }
    for (path, sentence) in REFUSED {
        trials.push(trial(format!("mesh::refused::{path}"), path, |path| refused(path, sentence)));
    }
    trials.push(trial("mesh::every_file_is_in_a_table", ".", every_file));
    // Of no file: they compare tables.
    trials.push(libtest_mimic::Trial::test("mesh::trimesh_counts_the_same", || {
        counts_are_those_of(TRIMESH, &[])
    }));
    trials.push(libtest_mimic::Trial::test("mesh::assimp_counts_the_same", || {
        counts_are_those_of(ASSIMP, &NOT_AS_ASSIMP)
    }));
    libtest_mimic::run(&Arguments::from_args(), trials).exit()
}

/// Files with their vertices and triangles.
const READ: [(&str, usize, usize); 60] = [
    ("mesh/bunny.ply.gz", 35_947, 69_451),
    ("mesh/dragon.obj.gz", 46_798, 93_600),
    ("mesh/dragon.ply.gz", 46_798, 93_600),
    ("mesh/scallop.glb.gz", 60_002, 120_000),
    ("mesh/spot.obj.gz", 2_930, 5_856),
    ("mesh/teapot_newell.obj", 3_644, 6_320),
    ("mesh/teapot_newell.ply.gz", 3_644, 6_320),
    ("scene/kitchen_country.ply.gz", 556_286, 1_021_815),
    ("scene/munich.ply.gz", 34_044, 38_936),
    ("scene/oa_am_underworks2.ply.gz", 53_052, 51_269),
    ("scene/sponza.obj.gz", 60_848, 66_450),
    ("scene/sponza.ply.gz", 60_848, 66_450),
    ("scene/stadium.obj.gz", 6_190, 11_978),
    ("scene/teapot_in_munich.ply.gz", 37_688, 45_256),
    ("scene/van_gogh_room/scene.gltf", 12_405, 11_272),
    ("scene/vianney_house.ply.gz", 42_706, 56_674),
    ("scene/vianney_house/scene.gltf", 42_706, 56_674),
    ("ugly/assimp/Mesh_PrimitiveMode_04.gltf", 4, 2),
    ("ugly/assimp/badNumber.gltf", 24, 12),
    ("ugly/assimp/box_longline.obj", 8, 944),
    ("ugly/assimp/box_without_lineending.obj", 8, 12),
    ("ugly/assimp/concave_polygon.obj", 64, 64),
    ("ugly/assimp/cube_binary_header_with_RN_newline.ply", 8, 12),
    ("ugly/assimp/multiple_spaces.obj", 4, 1),
    ("ugly/assimp/regr01.obj", 2_108, 2_710),
    ("ugly/assimp/sphereWithHole.stl", 855, 285),
    ("ugly/assimp/triangle_with_two_solids.stl", 6, 2),
    ("ugly/draco/SimpleSparseAccessor.gltf", 14, 12),
    ("ugly/draco/ZeroLengthBufferView.gltf", 4, 2),
    ("ugly/draco/deg_faces.obj", 6, 4),
    ("ugly/draco/eof_test.obj", 3, 1),
    ("ugly/draco/non_manifold_wrap.obj", 10, 12),
    ("ugly/draco/test_extra_whitespace.ply", 3, 1),
    ("ugly/manifold/Havocglass8_left.obj", 84, 164),
    ("ugly/manifold/boxNotManifold.obj", 9, 12),
    ("ugly/manifold/openscad-nonmanifold-crash.obj", 717, 1_442),
    ("ugly/manifold/self_intersectA.obj", 8_582, 17_160),
    ("ugly/synthetic/all_one_point.ply", 3_000, 1_000),
    ("ugly/synthetic/giant_soup.ply", 6_000, 2_000),
    ("ugly/synthetic/needles_5k.ply", 15_000, 5_000),
    ("ugly/synthetic/teapot_1e-30.ply", 3_644, 6_320),
    ("ugly/synthetic/teapot_1e19.ply", 3_644, 6_320),
    ("ugly/synthetic/teapot_dup4.ply", 3_644, 25_280),
    ("ugly/synthetic/teapot_offset_1e6.ply", 3_644, 6_320),
    ("ugly/tinyobj/issue-161-inconsistent-f.obj", 8, 12),
    ("ugly/tinyobj/issue-295-trianguation-failure.obj", 16, 28),
    ("ugly/tinyobj/leading-decimal-dot-issue-201.obj", 3, 1),
    ("ugly/trimesh/busted.STL", 11_634, 3_878),
    ("ugly/trimesh/comments.off", 8, 12),
    ("ugly/trimesh/cycloidal.ply", 21_384, 43_368),
    ("ugly/trimesh/featuretype.STL", 10_428, 3_476),
    ("ugly/trimesh/fixed_top.ply", 2_374, 4_772),
    ("ugly/trimesh/multibody.stl", 96, 32),
    ("ugly/trimesh/nancolor.obj", 8, 12),
    ("ugly/trimesh/negative_indices.obj", 8, 12),
    ("ugly/trimesh/no_indices_3storybuilding.glb", 216, 72),
    ("ugly/trimesh/not_convex.obj", 288, 96),
    ("ugly/trimesh/polygonfaces.obj", 5, 3),
    ("ugly/trimesh/soup.stl", 300, 100),
    ("ugly/trimesh/wallhole.obj", 92, 66),
];

/// Files that are refused, and what is said.
const REFUSED: [(&str, &str); 25] = [
    ("ugly/assimp/BoxWithInfinites.glb", "accessors[2]: expected a finite coordinate"),
    ("ugly/assimp/IndexOutOfRange.gltf", "expected a vertex from 0 to 23, found 255"),
    ("ugly/assimp/RecursiveNodes.gltf", "nodes[0]: expected a node with one parent"),
    ("ugly/assimp/invalid.off", "line 2: expected 3 vertices and 4 faces, found 45 bytes of text"),
    ("ugly/assimp/invalid_OutOfMemory.off", "line 2: expected 353535235358 vertices"),
    ("ugly/assimp/invalid_malformed.obj", "line 28: expected a vertex from 1 on"),
    ("ugly/assimp/issue623.ply", "line 15: expected the length of a list"),
    ("ugly/assimp/number_formats.obj", "line 11: expected z of a vertex, found \"3.1+e2\""),
    ("ugly/assimp/point_cloud.obj", "end of the file: expected at least one face, found none"),
    ("ugly/draco/inf_nan.obj", "line 1: expected a finite coordinate"),
    (
        "ugly/synthetic/teapot_nan.ply",
        "byte 403: expected a finite coordinate within f32 for vertex 19",
    ),
    ("ugly/tinygltf/integer-out-of-bounds.gltf", "bufferViews[0].byteLength: expected an integer"),
    ("ugly/tinygltf/invalid-buffer-view-index.gltf", "expected POSITION, found none"),
    ("ugly/tinyobj/test-nan.obj", "line 12: expected a finite coordinate"),
    ("ugly/tinyobj/issue-140-zero-face-idx.obj", "line 16: expected a vertex from 1 on"),
    ("ugly/trimesh/notenoughindices.obj", "line 9: expected a face of at least 3 corners, found 2"),
    (
        "ugly/draco/float_inf_point_cloud.ply",
        "line 8: expected a finite coordinate within f32 for vertex 0",
    ),
    ("ugly/tinygltf/issue-492.glb", "end of the file: expected at least one face, found none"),
    (
        "ugly/tinyobj/invalid-face-definition.obj",
        "line 15: expected a face of at least 3 corners, found 1",
    ),
    ("ugly/trimesh/emptyIO_obj_points.obj", "expected at least one face, found none"),
    ("ugly/trimesh/emptyIO_ply_empty_bin.ply", "expected at least one face, found none"),
    ("ugly/trimesh/empty_nodes.glb", "expected at least one face, found none"),
    ("ugly/trimesh/points_emptyface.ply", "expected at least one face, found none"),
    ("scene/oa_am_underworks2.bsp.gz", "found a game's map"),
    ("spd/balls_3.nff.gz", "found a scene in NFF"),
];

/// What trimesh counts; its first line names the version.
const TRIMESH: &str = include_str!("trimesh_counts.txt");

/// What Assimp counts, likewise.
const ASSIMP: &str = include_str!("assimp_counts.txt");

/// Files that we read and of which Assimp has another count or none, and why.
const NOT_AS_ASSIMP: [(&str, &str); 6] = [
    ("ugly/assimp/badNumber.gltf", "refused for a texture's scale that is no number"),
    (
        "ugly/assimp/box_longline.obj",
        "634 of 944: of a polygon that meets itself it leaves out triangles",
    ),
    (
        "ugly/assimp/concave_polygon.obj",
        "58 of 64: its cutting of concave polygons leaves out triangles",
    ),
    ("ugly/assimp/regr01.obj", "names that are not UTF-8 stop its Python package"),
    ("ugly/draco/test_extra_whitespace.ply", "blanks before a statement of the header are refused"),
    ("ugly/tinyobj/leading-decimal-dot-issue-201.obj", "numbers such as .5 are refused"),
];

fn read(path: &Path, vertices: usize, faces: usize) -> Result<(), Failed> {
    let mesh = Mesh::read(path, &MeshLimits::DEFAULT)?;
    if (mesh.vertices.len(), mesh.faces.len()) != (vertices, faces) {
        return Err(format!("{} vertices, {} faces", mesh.vertices.len(), mesh.faces.len()).into());
    }
    let stage = Stage::read_monitored(path, &MeshLimits::DEFAULT, &())?;
    if stage.mesh == mesh { Ok(()) } else { Err("the stage has another mesh".into()) }
}

fn refused(path: &Path, sentence: &str) -> Result<(), Failed> {
    let with_looks = Stage::read_monitored(path, &MeshLimits::DEFAULT, &()).map(|stage| stage.mesh);
    for result in [Mesh::read(path, &MeshLimits::DEFAULT), with_looks] {
        match result {
            Ok(_) => return Err("it was read".into()),
            Err(error) if error.to_string().contains(sentence) => {}
            Err(error) => return Err(error.to_string().into()),
        }
    }
    Ok(())
}

/// Meshes below the folder that no table names.
fn every_file(data: &Path) -> Result<(), Failed> {
    let (mut folders, mut unknown) = (vec![data.to_owned()], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder)? {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let name = path.strip_prefix(data)?.to_string_lossy().replace('\\', "/");
            let is_known =
                READ.iter().any(|row| row.0 == name) || REFUSED.iter().any(|row| row.0 == name);
            // NFF files have tests of their own.
            if MeshFormat::of_name(&path).is_some() && !is_known {
                unknown.push(name);
            }
        }
    }
    if unknown.is_empty() { Ok(()) } else { Err(format!("in no table: {unknown:?}").into()) }
}

/// Compares a list of counts with ours; `others` have none there, or another one, for a reason.
fn counts_are_those_of(list: &str, others: &[(&str, &str)]) -> Result<(), Failed> {
    let is_other = |path: &str| others.iter().any(|row| row.0 == path);
    let mut compared = 0;
    for line in list.lines().filter(|line| !line.starts_with('#')) {
        let (path, count) = line.rsplit_once(' ').ok_or("a line without a count")?;
        let count: usize = count.parse()?;
        match READ.iter().find(|row| row.0 == path) {
            Some(&(_, _, faces)) if faces == count && !is_other(path) => compared += 1,
            Some(&(_, _, faces)) if faces != count && is_other(path) => {}
            Some(&(_, _, faces)) => return Err(format!("{path}: {faces}, not {count}").into()),
            // What it reads and we refuse has a reason.
            None if REFUSED.iter().any(|row| row.0 == path) => {}
            None => return Err(format!("{path} is in no table").into()),
        }
    }
    if compared + others.len() == READ.len() {
        Ok(())
    } else {
        Err(format!("{compared} of {}", READ.len() - others.len()).into())
    }
}
