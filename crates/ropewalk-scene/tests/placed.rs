//! Meshes of glTF files that are kept once, with where they are placed.

use ropewalk_scene::{Mesh, MeshFormat, MeshLimits, PlacedMeshes, Placement, Stage};
use std::path::Path;

const LIMITS: MeshLimits = MeshLimits::DEFAULT;

/// A corner of a box, and a triangle of its own in the same buffer: accessors 0 and 1 are positions, 2 indices.
const TRIANGLES: [[f32; 3]; 7] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [-0.0, 0.25, 0.7],
    [3.0, 0.1, 0.2],
    [0.3, 5.0, 0.4],
    [0.5, 0.6, 7.0],
];
const CORNERS: [u16; 9] = [0, 2, 1, 0, 1, 3, 0, 3, 2];

/// Translations, rotations in bytes (one is a half turn about x) and scales of three placements.
const PLACES: [[f32; 3]; 3] = [[1.0, 2.0, 3.0], [0.0, 0.5, -0.0], [-4.0, 1e3, 0.1]];
const TURNS: [[i8; 4]; 3] = [[0, 0, 0, 127], [127, 0, 0, 0], [0, 0, 90, 90]];
const SIZES: [[f32; 3]; 3] = [[1.0; 3], [2.0, 1.0, -1.0], [0.5; 3]];

/// A file of two meshes, and a third one of points alone.
fn gltf(nodes: &str) -> Vec<u8> {
    let mut bin: Vec<u8> = TRIANGLES.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    bin.extend(CORNERS.iter().flat_map(|i| i.to_le_bytes()));
    bin.extend([0; 2]);
    bin.extend(PLACES.iter().chain(&SIZES).flatten().flat_map(|x| x.to_le_bytes()));
    bin.extend(TURNS.iter().flatten().map(|&x| x as u8));
    let data: String = bin.iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(data.len(), 2 * (84 + 20 + 72 + 12));
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"extensionsUsed":["EXT_mesh_gpu_instancing"],{nodes},
        "meshes":[{{"primitives":[{{"indices":2,"attributes":{{"POSITION":0}}}},{{"attributes":{{"POSITION":1}}}}]}},
        {{"primitives":[{{"attributes":{{"POSITION":1}}}}]}},
        {{"primitives":[{{"mode":0,"attributes":{{"POSITION":1}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},
        {{"bufferView":0,"byteOffset":48,"componentType":5126,"count":3,"type":"VEC3"}},
        {{"bufferView":1,"componentType":5123,"count":9,"type":"SCALAR"}},
        {{"bufferView":2,"componentType":5126,"count":3,"type":"VEC3"}},
        {{"bufferView":2,"byteOffset":72,"componentType":5120,"normalized":true,"count":3,"type":"VEC4"}},
        {{"bufferView":2,"byteOffset":36,"componentType":5126,"count":3,"type":"VEC3"}}],
        "bufferViews":[{{"buffer":0,"byteLength":84}},{{"buffer":0,"byteOffset":84,"byteLength":18}},
        {{"buffer":0,"byteOffset":104,"byteLength":84}}],
        "buffers":[{{"byteLength":{}}}]}}"#,
        bin.len()
    );
    let mut out = b"glTF".to_vec();
    out.extend(2u32.to_le_bytes());
    out.extend(((28 + json.len() + bin.len()) as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json.as_bytes()), (b"BIN\0", &bin)] {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
    }
    out
}

fn placed(nodes: &str, limits: &MeshLimits) -> Result<PlacedMeshes, String> {
    PlacedMeshes::parse(MeshFormat::Gltf, &gltf(nodes), None, limits).map_err(|e| e.to_string())
}

/// Bit by bit, as `==` takes both zeros for one.
fn bits(mesh: &Mesh) -> (Vec<[u64; 3]>, &[[u32; 3]]) {
    (mesh.vertices.iter().map(|v| v.map(f64::to_bits)).collect(), &mesh.faces)
}

const NODES: &str = r#""scene":0,"scenes":[{"nodes":[4,0]}],"nodes":[
    {"name":"left","mesh":0,"translation":[-5,0.1,0]},
    {"name":"turned","mesh":0,"rotation":[0.1,0.2,0.3,0.927],"scale":[1,2,3]},
    {"name":"mirrored","mesh":0,"matrix":[0,1,0,0, 1,0,0,0, 0,0,1,0, 0.1,0.2,0.3,1],"children":[1]},
    {"mesh":1},
    {"children":[2,3,5,6],"scale":[0.1,0.1,0.1]},
    {"name":"points","mesh":2},
    {"name":"again","mesh":1,"scale":[0,1,1]}]"#;

#[test]
fn nodes_are_placements() {
    let found = placed(NODES, &LIMITS).unwrap();
    let faces: Vec<usize> = found.meshes.iter().map(|mesh| mesh.faces.len()).collect();
    assert_eq!(faces, [4, 1], "each once, those without triangles left out");
    assert!(found.meshes[0].vertices[3][0].is_sign_negative(), "in their own space, as they are");
    let told: Vec<(u32, &str, Option<u32>)> =
        found.placements.iter().map(|p| (p.mesh, &*p.name, p.node)).collect();
    let expected = [
        (0, "mirrored", Some(2)),
        (0, "turned", Some(1)),
        (1, "", Some(3)),
        (1, "again", Some(6)),
        (0, "left", Some(0)),
    ];
    assert_eq!(told, expected, "in the order of the scene");
    let expected = [[0.0, 1.0, 0.0, 0.1], [1.0, 0.0, 0.0, 0.2], [0.0, 0.0, 1.0, 0.3]];
    assert_eq!(found.placements[0].transform, expected.map(|row| row.map(|x| 0.1 * x)));
}

#[test]
fn they_come_to_the_mesh_of_all() {
    let instanced = r#""nodes":[{"translation":[1,1,1],"children":[1]},{"mesh":0,"scale":[1,1,-1],
        "extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":3,"ROTATION":4,"SCALE":5}}}}]"#;
    for (nodes, meshes, placements) in [
        (NODES, 2, 5),
        (r#""nodes":[]"#, 2, 2),
        (r#""nodes":[{"mesh":1}]"#, 1, 1),
        (instanced, 1, 3),
    ] {
        let found = placed(nodes, &LIMITS).unwrap();
        let flat = Mesh::parse(MeshFormat::Gltf, &gltf(nodes), None, &LIMITS).unwrap();
        assert_eq!(bits(&found.flatten(&LIMITS).unwrap()), bits(&flat), "{nodes}");
        assert_eq!(found.faces(), flat.faces.len());
        assert_eq!((found.meshes.len(), found.placements.len()), (meshes, placements), "{nodes}");
        let stage = Stage::parse(MeshFormat::Gltf, &gltf(nodes), None, &LIMITS).unwrap();
        assert_eq!((stage.meshes, stage.placements), (meshes, placements), "{nodes}");
        assert_eq!(bits(&stage.mesh), bits(&flat));
        assert!(!stage.skipped.iter().any(|what| what.contains("EXT_mesh")), "{:?}", stage.skipped);
    }
}

#[test]
fn instances_of_a_node() {
    let node = |attributes: &str| {
        format!(
            r#""nodes":[{{"name":"grass","mesh":1,"translation":[10,0,0],
            "extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{{attributes}}}}}}}}}]"#
        )
    };
    let found = placed(&node(r#""TRANSLATION":3"#), &LIMITS).unwrap();
    let moved = |at: [f64; 3]| {
        [[1.0, 0.0, 0.0, 10.0 + at[0]], [0.0, 1.0, 0.0, at[1]], [0.0, 0.0, 1.0, at[2]]]
    };
    for (placement, at) in found.placements.iter().zip(PLACES) {
        assert_eq!(placement.transform, moved(at.map(f64::from)));
        assert_eq!((placement.mesh, &*placement.name, placement.node), (0, "grass", Some(0)));
    }
    let found = placed(&node(r#""ROTATION":4,"SCALE":5,"_ID":99"#), &LIMITS).unwrap();
    let half_turn = [[2.0, 0.0, 0.0, 10.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    assert_eq!(found.placements[1].transform, half_turn);
    let refused = |attributes: &str, what: &str| {
        let error = placed(&node(attributes), &LIMITS).unwrap_err();
        assert!(error.contains(what), "{error}\n{what}");
        let flat = Mesh::parse(MeshFormat::Gltf, &gltf(&node(attributes)), None, &LIMITS);
        assert_eq!(flat.unwrap_err().to_string(), error);
    };
    refused(
        r#""TRANSLATION":3,"SCALE":0"#,
        "nodes[0].extensions.EXT_mesh_gpu_instancing.SCALE: expected 3 of them, as of the attribute before, found 4",
    );
    refused(
        r#""_ID":3"#,
        "EXT_mesh_gpu_instancing.attributes: expected TRANSLATION, ROTATION or SCALE, found none",
    );
    refused(r#""ROTATION":3"#, "accessors[3].type: expected VEC4, found \"VEC3\"");
    refused(r#""SCALE":77"#, "SCALE: expected one of the 6 accessors, found 77");
}

#[test]
fn refused_as_the_mesh_of_all_is() {
    let deep = |depth: usize| {
        let inner: String = (1..=depth).map(|i| format!(r#"{{"children":[{i}]}},"#)).collect();
        format!(r#""nodes":[{inner}{{"mesh":0}}]"#)
    };
    let refused = |nodes: &str, limits: MeshLimits, what: &str| {
        let error = placed(nodes, &limits).unwrap_err();
        assert!(error.contains(what), "{error}\n{what}");
        let flat = Mesh::parse(MeshFormat::Gltf, &gltf(nodes), None, &limits);
        assert!(flat.unwrap_err().to_string().contains(what));
    };
    assert_eq!(placed(&deep(256), &LIMITS).unwrap().faces(), 4);
    refused(&deep(257), LIMITS, "nodes[257]: expected nodes at most 256 deep, found more");
    let twice = r#""scene":0,"scenes":[{"nodes":[0,1]}],"nodes":[{"children":[1]},{"mesh":0}]"#;
    refused(
        twice,
        LIMITS,
        "nodes[1]: expected a node with one parent, found one that is named twice",
    );
    refused(
        r#""nodes":[{"mesh":3}]"#,
        LIMITS,
        "nodes[0].mesh: expected one of the 3 meshes, found 3",
    );
    refused(
        r#""nodes":[{"mesh":2}]"#,
        LIMITS,
        "end of the file: expected at least one face, found none",
    );
    let few = |placements| MeshLimits { placements, ..LIMITS };
    assert_eq!(placed(NODES, &few(6)).unwrap().placements.len(), 5, "points count");
    refused(NODES, few(5), "expected meshes placed at most 5 times, found more");
    for large in ["1e38", "1e300"] {
        refused(
            &format!(r#""nodes":[{{"mesh":0,"scale":[1,{large},1]}}]"#),
            LIMITS,
            "expected a finite coordinate within f32 for vertex",
        );
    }
    // Large and still within f32, which the bounds alone do not show.
    let large = r#""nodes":[{"mesh":0,"scale":[1,6.7e37,1]}]"#;
    assert_eq!(placed(large, &LIMITS).unwrap().faces(), 4);
    // Placements do not count for these limits, which hold for all meshes together.
    let tight = MeshLimits { vertices: 10, faces: 5, ..LIMITS };
    assert_eq!(placed(NODES, &tight).unwrap().faces(), 14);
    let error = placed(NODES, &MeshLimits { vertices: 9, ..tight }).unwrap_err();
    assert!(error.contains("at most 9 vertices"), "{error}");
    let error = placed(NODES, &MeshLimits { faces: 4, ..tight }).unwrap_err();
    assert!(error.contains("at most 4 triangles"), "{error}");
}

#[test]
fn other_formats_hold_one_mesh() {
    let text = b"v 0 0 -0\nv 1 -0 0\nv 0 1 0\nf 1 2 3\n";
    let found = PlacedMeshes::parse(MeshFormat::Obj, text, None, &LIMITS).unwrap();
    let mesh = Mesh::parse(MeshFormat::Obj, text, None, &LIMITS).unwrap();
    assert_eq!((&found.meshes[..], found.placements.len()), (&[mesh.clone()][..], 1));
    assert_eq!(
        (found.placements[0].node, bits(&found.flatten(&LIMITS).unwrap())),
        (None, bits(&mesh))
    );
    let stage = Stage::parse(MeshFormat::Obj, text, None, &LIMITS).unwrap();
    assert_eq!((stage.meshes, stage.placements), (1, 1));
    let error = PlacedMeshes::read(Path::new("absent.glb"), &LIMITS).unwrap_err().to_string();
    assert!(error.starts_with("absent.glb: "), "{error}");
}

#[test]
fn placements_that_come_to_too_much_are_refused_before_anything_is_allocated() {
    let mesh = Mesh { vertices: vec![[0.0; 3]; 1 << 16], faces: vec![[0, 1, 2]; 5] };
    let many = |count: usize| {
        let transform = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
        let placement = Placement { mesh: 0, transform, name: "".into(), node: None };
        PlacedMeshes { meshes: vec![mesh.clone()], placements: vec![placement; count] }
    };
    let limits = MeshLimits { vertices: usize::MAX, faces: 10, ..LIMITS };
    let told = |count| many(count).flatten(&limits).map(|mesh| mesh.faces.len());
    assert_eq!(told(2), Ok(10));
    assert_eq!(
        told(3).unwrap_err().to_string(),
        "expected 10 triangles at most, found 15 in 3 placements"
    );
    // One vertex more than a face can name.
    assert_eq!(
        told(1 << 16).unwrap_err().to_string(),
        "expected 4294967295 vertices at most, found 4294967296 in 65536 placements"
    );
    let limits = MeshLimits { vertices: (1 << 17) - 1, ..LIMITS };
    let told = many(2).flatten(&limits).unwrap_err().to_string();
    assert_eq!(told, "expected 131071 vertices at most, found 131072 in 2 placements");
}
