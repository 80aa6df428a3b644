//! Mesh files: what is read, what is refused, and that nothing panics.

use flate2::{Compression, write::GzEncoder};
use ropewalk_scene::{Mesh, MeshFormat, MeshLimits};
use std::io::Write;
use std::path::Path;

#[path = "../../../fuzz/properties/mesh.rs"]
mod property;

fn parse(format: MeshFormat, bytes: &[u8]) -> Result<Mesh, String> {
    Mesh::parse(format, bytes, None, &MeshLimits::DEFAULT).map_err(|e| e.to_string())
}

const TETRA: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.5]];
const SIDES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

fn tetra() -> Mesh {
    Mesh { vertices: TETRA.to_vec(), faces: SIDES.to_vec() }
}

const OBJ: &str = "# comment\nmtllib a.mtl\no x\nv 0 0 0 # origin\nv 1 0 0 0.5 0.5 0.5\nv 0 1. 0\nv 0 0 .5e0\n\
    vn 0 0 1\nvt 0 0\ns off\nf 1//1 3//1 2//1\nf 1/1 2/1 4/1\nf -4 -1 -2\nf 2/1/1 \\\n 3/1/1 4/1/1\n";

const OFF: &str = "OFF # four\n4 4 6\n0 0 0\n1 0 0\n0 1 0 0.1 0.2 0.3\n# comment\n0 0 0.5\n\
    3 0 2 1\n3 0 1 3 1.0 0.5 0.5\n3 0 3 2\n3 1 2 3";

fn ply_header(format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment element vertex 9\nelement vertex 4\nproperty float x\n\
         property float y\nproperty double z\nproperty uchar red\nelement face 4\n\
         property list uchar int vertex_indices\nproperty list ushort float texcoord\nend_header\n"
    )
}

fn ply(form: &str) -> Vec<u8> {
    let mut out = ply_header(form).into_bytes();
    if form == "ascii" {
        for [x, y, z] in TETRA {
            writeln!(out, "{x} {y} {z} 200").unwrap();
        }
        for [a, b, c] in SIDES {
            writeln!(out, "3 {a} {b} {c} 2 0.5 0.5").unwrap();
        }
        return out;
    }
    let is_big = form == "binary_big_endian";
    let mut put = |bytes: &[u8]| {
        let mut bytes = bytes.to_vec();
        if is_big {
            bytes.reverse();
        }
        out.extend(bytes);
    };
    for [x, y, z] in TETRA {
        put(&(x as f32).to_le_bytes());
        put(&(y as f32).to_le_bytes());
        put(&z.to_le_bytes());
        put(&[200]);
    }
    for side in SIDES {
        put(&[3]);
        side.iter().for_each(|&i| put(&(i as i32).to_le_bytes()));
        put(&1u16.to_le_bytes());
        put(&0.5f32.to_le_bytes());
    }
    out
}

fn stl_binary(head: &[u8]) -> Vec<u8> {
    let mut out = head.to_vec();
    out.resize(80, b' ');
    out.extend(4u32.to_le_bytes());
    for side in SIDES {
        out.extend([0; 12]);
        for corner in side {
            out.extend(TETRA[corner as usize].iter().flat_map(|&x| (x as f32).to_le_bytes()));
        }
        out.extend([0; 2]);
    }
    out
}

fn stl_ascii() -> String {
    let mut out = "solid of vertex facets\n".to_owned();
    for side in SIDES {
        out += "facet normal 0 0 0\n outer loop\n";
        for [x, y, z] in side.map(|i| TETRA[i as usize]) {
            out += &format!("  vertex {x} {y} {z}\n");
        }
        out += " endloop\nendfacet\n";
    }
    out + "endsolid of vertex facets\n"
}

/// The tetrahedron in a GLB file, under a node that moves it by `node`.
fn glb(node: &str) -> Vec<u8> {
    let mut bin: Vec<u8> = TETRA.iter().flatten().flat_map(|&x| (x as f32).to_le_bytes()).collect();
    bin.extend(SIDES.iter().flatten().flat_map(|&i| (i as u16).to_le_bytes()));
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[1]}}],
        "nodes":[{{"mesh":0}},{{"children":[0]{node}}}],
        "meshes":[{{"primitives":[{{"indices":1,"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},
        {{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":24}}],
        "buffers":[{{"byteLength":72}}]}}"#
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

fn all() -> Vec<(MeshFormat, Vec<u8>)> {
    vec![
        (MeshFormat::Obj, OBJ.into()),
        (MeshFormat::Off, OFF.into()),
        (MeshFormat::Ply, ply("ascii")),
        (MeshFormat::Ply, ply("binary_little_endian")),
        (MeshFormat::Ply, ply("binary_big_endian")),
        (MeshFormat::Stl, stl_binary(b"solid, but binary")),
        (MeshFormat::Stl, stl_ascii().into()),
        (MeshFormat::Gltf, glb("")),
    ]
}

#[test]
fn all_formats_hold_the_same_mesh() {
    let corners = |mesh: &Mesh| -> Vec<[[f64; 3]; 3]> {
        mesh.faces.iter().map(|f| f.map(|i| mesh.vertices[i as usize])).collect()
    };
    for (format, bytes) in all() {
        let mesh = parse(format, &bytes).unwrap();
        assert_eq!(corners(&mesh), corners(&tetra()), "{format:?}");
        if format != MeshFormat::Stl {
            assert_eq!(mesh, tetra(), "{format:?}");
        }
        let mut gzip = GzEncoder::new(Vec::new(), Compression::fast());
        gzip.write_all(&bytes).unwrap();
        assert_eq!(parse(format, &gzip.finish().unwrap()).unwrap(), mesh);
        if !bytes.starts_with(b"glTF") && !bytes.starts_with(b"solid,") && bytes.is_ascii() {
            let windows = String::from_utf8(bytes).unwrap().replace('\n', "\r\n");
            assert_eq!(parse(format, windows.as_bytes()).unwrap(), mesh, "{format:?}");
        }
    }
}

#[test]
fn nodes_move_what_they_hold() {
    let moved = |node: &str| parse(MeshFormat::Gltf, &glb(node)).unwrap().vertices;
    let expected = |f: fn([f64; 3]) -> [f64; 3]| TETRA.map(f).to_vec();
    let translated = moved(r#","translation":[1,2,3],"scale":[2,2,2]"#);
    assert_eq!(translated, expected(|[x, y, z]| [2.0 * x + 1.0, 2.0 * y + 2.0, 2.0 * z + 3.0]));
    let matrix = moved(r#","matrix":[0,1,0,0,-1,0,0,0,0,0,1,0,5,6,7,1]"#);
    assert_eq!(matrix, expected(|[x, y, z]| [5.0 - y, x + 6.0, z + 7.0]));
    // A half turn about x.
    assert_eq!(moved(r#","rotation":[1,0,0,0]"#), expected(|[x, y, z]| [x, -y, -z]));
}

#[test]
fn polygons_are_cut() {
    let text = "v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nv 9 9 9\nf 1 2 3 4\nf 1 2 5\n";
    let mesh = parse(MeshFormat::Obj, text.as_bytes()).unwrap();
    assert_eq!(mesh.faces, [[2, 3, 0], [2, 0, 1], [0, 1, 4]], "from the dent");
}

#[test]
fn strips_and_fans() {
    let with_mode = |mode: &str| {
        let bytes = glb("");
        let start = bytes.windows(9).position(|w| w == br#"{"indices"#).unwrap();
        // Replaced in place by what is as long.
        let text = format!(r#"{{"mode":{mode},"attributes":{{"POSITION":0}}}}"#);
        let old = r#"{"indices":1,"attributes":{"POSITION":0}}"#;
        let mut out = bytes.clone();
        let padded = format!("{text:width$}", width = old.len());
        out[start..start + old.len()].copy_from_slice(padded.as_bytes());
        parse(MeshFormat::Gltf, &out)
    };
    assert_eq!(with_mode("5").unwrap().faces, [[0, 1, 2], [2, 1, 3]]);
    assert_eq!(with_mode("6").unwrap().faces, [[0, 1, 2], [0, 2, 3]]);
    assert!(with_mode("1").unwrap_err().contains("at least one face"));
    assert!(with_mode("4").unwrap_err().contains("three vertices a triangle"));
    assert!(with_mode("9").unwrap_err().contains("a mode from 0 to 6"));
}

#[test]
fn errors_say_where_and_what() {
    use MeshFormat::{Gltf, Obj, Off, Ply, Stl};
    let ascii = String::from_utf8(ply("ascii")).unwrap();
    let (off, obj, stl) = (OFF.to_owned(), OBJ.to_owned(), stl_ascii());
    let cases: Vec<(MeshFormat, String, &str)> = vec![
        (Obj, obj.replace("v 1 0 0", "v 1 x 0"), "line 5: expected y of a vertex, found \"x\""),
        (
            Obj,
            obj.replace("v 1 0 0 0.5 0.5 0.5", "v 1 0"),
            "line 5: expected z of a vertex, found the end",
        ),
        (
            Obj,
            obj.replace("v 1 0", "v nan 0"),
            "line 5: expected a finite coordinate within f32 for vertex 1, found NaN",
        ),
        (Obj, obj.replace("v 1 0", "v 1e39 0"), "line 5: expected a finite coordinate"),
        (Obj, obj.replace("f -4", "f -5"), "line 13: expected a vertex from -4 on, found -5"),
        (
            Obj,
            obj.replace("f -4", "f 0"),
            "line 13: expected a vertex from 1 on, or from -1 down, found 0",
        ),
        (Obj, obj.replace("f 1/1", "f 5/1"), "line 12: expected a vertex from 1 to 4, found 5"),
        (Obj, obj.replace("f 1/1", "f 99999999999999999999"), "line 12: expected a vertex"),
        (
            Obj,
            obj.replace("f 1/1 2/1 4/1", "f 1 2"),
            "line 12: expected a face of at least 3 corners, found 2",
        ),
        (Obj, "v 0 0 0\n".into(), "end of the file: expected at least one face, found none"),
        (Off, off.replace("OFF", "OOF"), "line 1: expected OFF"),
        (
            Off,
            off.replace("4 4 6", "4000000000000 4 6"),
            "line 2: expected 4000000000000 vertices and 4 faces",
        ),
        (
            Off,
            off.replace("4 4 6", "18446744073709551615 18446744073709551615 6"),
            "line 2: expected",
        ),
        (Off, off.replace("3 1 2 3", "3 1 2 4"), "line 11: expected a vertex from 0 to 3, found 4"),
        (Off, off.replace("3 1 2 3", "3 1 2"), "line 11: expected a vertex, found the end"),
        (Off, off.replace("3 1 2 3", "2 1 2"), "line 11: expected a face of at least 3 corners"),
        (
            Ply,
            ascii.replace("ply\n", "plx\n"),
            "line 1: expected ply on the first line, found \"plx\"",
        ),
        (
            Ply,
            ascii.replace("format ascii", "format utf8"),
            "line 2: expected ascii, binary_little_endian",
        ),
        (
            Ply,
            ascii.replace("property float x", "property half x"),
            "line 5: expected a property type",
        ),
        (
            Ply,
            ascii.replace("property float x", "property float w"),
            "line 4: expected one property x of vertices, found 0",
        ),
        (
            Ply,
            ascii.replace("end_header", ""),
            "expected element, property, comment or end_header, found \"0\"",
        ),
        (
            Ply,
            ascii.replace("vertex 4", "vertex 4000000000000000"),
            "line 4: expected 4000000000000000 of element vertex",
        ),
        (
            Ply,
            ascii.replace("vertex 4", "vertex -4"),
            "line 4: expected the number of elements, found \"-4\"",
        ),
        (
            Ply,
            ascii.replace("0 1 0 200", "0 nan 0 200"),
            "line 15: expected a finite coordinate within f32 for vertex 2",
        ),
        (
            Ply,
            ascii.replace("3 0 3 2", "3 0 4 2"),
            "line 19: expected a vertex from 0 to 3, found 4",
        ),
        (
            Ply,
            ascii.replace("3 0 3 2", "3 0 -1 2"),
            "line 19: expected a vertex from 0 to 3, found -1",
        ),
        (
            Ply,
            ascii.replace("3 0 3 2", "9e9 0 3 2"),
            "line 19: expected the length of a list, within the file",
        ),
        (
            Ply,
            ascii.replace("vertex 4", "ver\u{0}tex 400000"),
            "line 4: expected 400000 of element ver\\u{0}tex, found",
        ),
        (Stl, stl.replace("vertex 1 0 0", "vertex 1 0 z"), "expected z, found \"z\""),
        (
            Stl,
            stl.replace("endloop", "vertex 1 1 1\nendloop"),
            "line 8: expected a loop of 3 vertices, found 4",
        ),
        (
            Stl,
            stl.replace("endsolid of vertex facets", "facet\nouter loop\n"),
            "expected vertex or endloop, found the end",
        ),
        (Stl, "no".into(), "expected an STL file of at least 84 bytes"),
        (Gltf, "{".into(), "line 1: expected a glTF file"),
        (Gltf, "{}".into(), "asset.version: expected version 2, found none"),
    ];
    for (format, text, expected) in cases {
        let error = parse(format, text.as_bytes()).expect_err(expected);
        assert!(error.starts_with("input: ") && error.contains(expected), "{error}\n{expected}");
    }
    let mut binary = ply("binary_big_endian");
    binary.pop();
    assert!(
        parse(Ply, &binary).unwrap_err().contains(": expected a number of a list, found the end")
    );
    let mut binary = stl_binary(b"x");
    binary[80] = 9;
    let error = parse(Stl, &binary).unwrap_err();
    assert!(
        error.contains(
            "byte 80: expected 534 bytes, since the header announces 9 triangles, found 284"
        ),
        "{error}"
    );
}

/// Faults of glTF files, each by a part of the text that is replaced by another one.
#[test]
fn gltf_parts_that_do_not_fit() {
    let bytes = glb("");
    let json_end = 20 + u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize;
    let json = std::str::from_utf8(&bytes[20..json_end]).unwrap();
    let refused = |from: &str, to: &str, expected: &str| {
        assert!(json.contains(from), "{from}");
        let json = json.replace(from, to);
        let mut out = bytes[..12].to_vec();
        out.extend((json.len() as u32).to_le_bytes());
        out.extend(b"JSON");
        out.extend(json.as_bytes());
        out.extend(&bytes[json_end..]);
        let error = parse(MeshFormat::Gltf, &out).expect_err(expected);
        assert!(error.contains(expected), "{error}\n{expected}");
    };
    refused(
        r#""count":12"#,
        r#""count":13"#,
        "accessors[1]: expected 13 elements within the 24 bytes of bufferViews[1]",
    );
    refused(
        r#""count":12"#,
        r#""count":18446744073709551615"#,
        "accessors[1].count: expected an integer",
    );
    refused(
        r#""count":12"#,
        r#""count":281474976710655"#,
        "accessors[1]: expected 281474976710655 elements",
    );
    refused(
        r#""count":4"#,
        r#""count":3"#,
        "meshes[0].primitives[0].indices: expected a vertex from 0 to 2, found 3",
    );
    refused(
        r#""byteOffset":48"#,
        r#""byteOffset":-1"#,
        "bufferViews[1].byteOffset: expected an integer",
    );
    refused(
        r#""byteOffset":48"#,
        r#""byteOffset":60"#,
        "bufferViews[1]: expected 24 bytes from 60 on",
    );
    refused(
        r#""byteLength":72"#,
        r#""byteLength":7200"#,
        "buffers[0]: expected 7200 bytes, as byteLength says, found 72",
    );
    refused(
        r#""componentType":5123"#,
        r#""componentType":5122"#,
        "accessors[1].componentType: expected one of [5121, 5123, 5125]",
    );
    refused(r#""type":"VEC3""#, r#""type":"VEC2""#, "accessors[0].type: expected VEC3");
    refused(r#""mesh":0"#, r#""mesh":7"#, "nodes[0].mesh: expected one of the 1 meshes, found 7");
    refused(r#""children":[0]"#, r#""children":[1]"#, "nodes[1]: expected a node with one parent");
    refused(r#""children":[0]"#, r#""children":["0"]"#, "nodes[1].children: expected integers");
    refused(
        r#""children":[0]"#,
        r#""children":[0],"matrix":[1]"#,
        "nodes[1].matrix: expected 16 numbers",
    );
    refused(r#""scene":0"#, r#""scene":5"#, "scene: expected one of the 1 scenes, found 5");
    refused(
        r#""version":"2.0""#,
        r#""version":"1.0""#,
        "asset.version: expected version 2, found 1.0",
    );
    refused(
        r#""scene":0"#,
        r#""extensionsRequired":["KHR_draco_mesh_compression"]"#,
        "without compressed meshes",
    );
}

#[test]
fn buffers_beside_the_file_and_nowhere_else() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("in ner");
    std::fs::create_dir(&inner).unwrap();
    let data: Vec<u8> =
        TETRA[..3].iter().flatten().flat_map(|&x| (x as f32).to_le_bytes()).collect();
    std::fs::write(inner.join("a b.bin"), &data).unwrap();
    std::fs::write(folder.path().join("secret.bin"), &data).unwrap();
    let json = |uri: &str| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
            "bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"byteLength":36,"uri":"{uri}"}}]}}"#
        )
    };
    let read = |uri: &str| {
        let path = inner.join("scene.gltf");
        std::fs::write(&path, json(uri)).unwrap();
        Mesh::read(&path, &MeshLimits::DEFAULT).map_err(|e| e.to_string())
    };
    assert_eq!(read("a%20b.bin").unwrap().faces, [[0, 1, 2]]);
    let base64 = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    assert_eq!(
        read(&format!("data:application/octet-stream;base64,{base64}")).unwrap().vertices,
        TETRA[..3]
    );
    for uri in [
        "../secret.bin",
        "%2e%2e/secret.bin",
        "/etc/passwd",
        "file:///etc/passwd",
        "..\\\\secret.bin",
        "",
        "https://a.b/c",
    ] {
        let error = read(uri).unwrap_err();
        assert!(
            error.contains("buffers[0].uri: expected a file in this folder or below"),
            "{error}"
        );
    }
    assert!(read("absent.bin").unwrap_err().contains("expected to read absent.bin"));
    assert!(read("data:;base64,????").unwrap_err().contains("base64"));
    let alone = parse(MeshFormat::Gltf, json("a%20b.bin").as_bytes()).unwrap_err();
    assert!(alone.contains("since it has no folder"), "{alone}");
}

#[test]
fn limits_hold() {
    let small = MeshLimits {
        bytes: 10_000,
        vertices: 3,
        faces: 3,
        corners: 4,
        placements: 2,
        images: 2,
        pixels: 100,
    };
    let refused = |text: &str, limits: MeshLimits| {
        Mesh::parse(MeshFormat::Obj, text.as_bytes(), None, &limits).unwrap_err().to_string()
    };
    assert!(refused(OBJ, small).contains("at most 3 vertices"));
    assert!(refused(OBJ, MeshLimits { vertices: 4, ..small }).contains("at most 3 triangles"));
    assert!(refused(OBJ, MeshLimits { bytes: 50, ..small }).contains("at most 50 bytes"));
    let five = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 1 2\n";
    assert!(refused(five, small).contains("a face of at most 4 corners"));
    // An archive that grows without end.
    let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
    gzip.write_all(&vec![b'#'; 1 << 22]).unwrap();
    let error = Mesh::parse(MeshFormat::Obj, &gzip.finish().unwrap(), None, &small).unwrap_err();
    assert!(error.to_string().contains("at most 10000 bytes"), "{error}");
}

/// Cut off anywhere, and with any byte changed, a file is read or refused.
#[test]
fn damaged_files_are_read_or_refused() {
    let mut state = 1u64;
    for (format, bytes) in all() {
        for end in 0..bytes.len() {
            property::reads_or_refuses(format, &bytes[..end], None);
        }
        for at in 0..bytes.len() {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            for byte in [0, 0xff, b'-', b'9', b'\n', (state >> 56) as u8] {
                let mut damaged = bytes.clone();
                damaged[at] = byte;
                property::reads_or_refuses(format, &damaged, None);
            }
        }
        // As every other format.
        for other in MeshFormat::ALL {
            property::reads_or_refuses(other, &bytes, None);
        }
    }
}

#[test]
fn names_tell_formats() {
    let of = |name: &str| MeshFormat::of_name(Path::new(name));
    assert_eq!(of("a/b.PLY"), Some(MeshFormat::Ply));
    assert_eq!(of("b.obj.gz"), Some(MeshFormat::Obj));
    assert_eq!((of("b.nff"), of("b"), of("b.gz"), of(".ply")), (None, None, None, None));
}

#[test]
fn meshes_are_scenes_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("four.obj");
    std::fs::write(&path, OBJ).unwrap();
    let scene = ropewalk_scene::load_scene(path.to_str().unwrap(), &Default::default()).unwrap();
    assert_eq!((scene.name.as_str(), scene.objects.len()), ("four", 4));
    std::fs::write(&path, "v 0 0").unwrap();
    let error =
        ropewalk_scene::load_scene(path.to_str().unwrap(), &Default::default()).unwrap_err();
    assert!(error.to_string().contains("four.obj: line 1: expected z of a vertex"), "{error}");
    assert_eq!(error.fault(), ropewalk_scene::Fault::Input);
}

/// The fuzzer's seeds, whole and cut off.
#[test]
fn the_fuzz_corpus_holds() {
    use MeshFormat::{Gltf, Obj, Off, Ply, Stl};
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus-seed");
    let folder = tempfile::tempdir().unwrap();
    for (name, format, least) in
        [("obj", Obj, 2), ("ply", Ply, 4), ("stl", Stl, 2), ("off", Off, 2), ("gltf", Gltf, 3)]
    {
        let mut count = 0;
        for entry in std::fs::read_dir(seeds.join(name)).unwrap() {
            let path = entry.unwrap().path();
            let bytes = std::fs::read(&path).unwrap();
            let holds = |bytes: &[u8]| match format {
                Obj => property::reads_or_refuses_with_library(bytes, folder.path()),
                _ => property::reads_or_refuses(format, bytes, None),
            };
            assert!(holds(&bytes), "{}", path.display());
            for end in 0..bytes.len() {
                holds(&bytes[..end]);
            }
            count += 1;
        }
        assert!(count >= least, "{name}");
    }
}
