//! What readers find of looks: materials, textures, lights and views, and which files they may open for them.

use ropewalk_scene::stage::{Alpha, Image, Light, Wrap};
use ropewalk_scene::{MeshError, MeshFormat, MeshLimits, Stage};
use std::io::Cursor;
use std::path::Path;

const LIMITS: MeshLimits = MeshLimits::DEFAULT;

fn parse(format: MeshFormat, text: impl AsRef<[u8]>) -> Stage {
    Stage::parse(format, text.as_ref(), None, &LIMITS).unwrap()
}

fn read(folder: &Path, name: &str) -> Result<Stage, MeshError> {
    Stage::read_monitored(&folder.join(name), &LIMITS, &())
}

/// A PNG of one colour.
fn png(width: u32, height: u32, color: [u8; 4]) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let image = image::RgbaImage::from_pixel(width, height, image::Rgba(color));
    image.write_to(&mut out, image::ImageFormat::Png).unwrap();
    out.into_inner()
}

fn folder(files: &[(&str, &[u8])]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    folder
}

const FLAT: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";

#[test]
fn an_obj_file_has_corners_of_its_own() {
    let text = format!(
        "{FLAT}vt 0 0\nvt 1 0.25\nvn 0 0 2\nvn 0 3 0\nf 1/1/1 2/2/1 3//2\nf 2 -1/-1 3//-1\nf 1/9 2/1 3/0\n"
    );
    let stage = parse(MeshFormat::Obj, text);
    assert_eq!(stage.uvs[0], [[0.0, 1.0], [1.0, 0.75], [0.0, 0.0]]);
    assert_eq!(stage.uvs[1][1], [1.0, 0.75]);
    assert_eq!(stage.normals[0], [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]);
    assert_eq!(stage.normals[1], [[0.0; 3], [0.0; 3], [0.0, 1.0, 0.0]]);
    let absent = "texture coordinates and normals that corners name but the file lacks (2)";
    assert_eq!(stage.skipped, [absent]);
    assert_eq!((stage.materials.len(), stage.material.len()), (1, 0));
}

#[test]
fn polygons_keep_their_corners_looks() {
    // A dart, cut from its dent, with vertices that come behind the face.
    let text = "vt 0 0\nvt 1 0\nvt 0.25 0.25\nvt 0 1\nf 1/1 2/2 3/3 4/4\nv 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\n";
    let stage = parse(MeshFormat::Obj, text);
    assert_eq!(stage.mesh.faces, [[2, 3, 0], [2, 0, 1]]);
    assert_eq!(stage.uvs[0], [[0.25, 0.75], [0.0, 0.0], [0.0, 1.0]]);
    assert_eq!(stage.uvs[1], [[0.25, 0.75], [0.0, 1.0], [1.0, 1.0]]);
}

#[test]
fn colours_of_vertices_are_made_linear() {
    let text = "v 0 0 0 1 0 0.5\nv 1 0 0\nv 0 1 0 1.0\nv 0 0 1 nan 0 0\nf 1 2 3\nf 2 3 4\n";
    let stage = parse(MeshFormat::Obj, text);
    let half = ((0.5f32 + 0.055) / 1.055).powf(2.4);
    assert_eq!(stage.colors, [[[1.0, 0.0, half], [1.0; 3], [1.0; 3]], [[1.0; 3]; 3]]);
    assert_eq!(stage.skipped, ["colours of vertices that are not numbers"]);
}

const LIBRARY: &str = "# a comment\nnewmtl red paint\nKd 1 0.25 0\nKs 0.5 0.5 0.5\nNs 30\nd 0.5\nillum 2\n\
    newmtl mirror\nKd 0 0 0\nKs 0.75 0.5 0.25\nillum 3\nnewmtl glass\nillum 7\nNi 1.25\nTf 0.5 1 1\nKd 0 0 0\n\
    newmtl lamp\nKe 5 4 3\nKa 1 1 1\nnewmtl pbr\nPr 0.25\nPm 1\nKd 0.5 0.5 0.5\nPc 1\n\
    newmtl leaf\nKd 0 0 0\nmap_Kd -s 1 1 1 -clamp on pictures\\two words.png\nmap_d mask.png\nmap_Ke glow.jpg\n\
    newmtl red paint\nKd 0 0 0\n";

#[test]
fn libraries_of_materials() {
    let mut glow = Cursor::new(Vec::new());
    image::RgbImage::from_pixel(8, 8, image::Rgb([200, 200, 200]))
        .write_to(&mut glow, image::ImageFormat::Jpeg)
        .unwrap();
    let names = ["red paint", "mirror", "glass", "lamp", "pbr", "leaf", "absent"];
    let faces: String = names.map(|name| format!("usemtl {name}\nf 1 2 3\n")).concat();
    let obj = format!("mtllib my paints.mtl\n{FLAT}f 1 2 4\n{faces}usemtl mirror\nf 1 2 3\n");
    let folder = folder(&[
        ("a.obj", obj.as_bytes()),
        ("my paints.mtl", LIBRARY.as_bytes()),
        ("pictures/two words.png", &png(4, 2, [10, 20, 30, 255])),
        ("mask.png", &png(2, 2, [0, 0, 0, 77])),
        ("glow.jpg", &glow.into_inner()),
    ]);
    let stage = read(folder.path(), "a.obj").unwrap();
    assert_eq!(stage.name, "a");
    assert_eq!(stage.material, [0, 1, 2, 3, 4, 5, 6, 7, 2]);
    let [plain, paint, mirror, glass, lamp, pbr, leaf, absent] = &stage.materials[..] else {
        panic!("{:?}", stage.materials)
    };
    assert_eq!(plain, &Default::default());
    assert_eq!((paint.base_color, paint.opacity), ([1.0, 0.25, 0.0], 0.5));
    assert_eq!(
        (paint.name.as_str(), paint.alpha, paint.metallic),
        ("red paint", Alpha::Blend, 0.0)
    );
    assert!((paint.roughness - 0.5).abs() < 1e-6, "{}", paint.roughness);
    assert_eq!((mirror.metallic, mirror.roughness), (1.0, 0.0));
    assert_eq!(mirror.base_color, [0.75, 0.5, 0.25]);
    assert_eq!((glass.transmission, glass.ior, glass.roughness), (1.0, 1.25, 0.0));
    assert_eq!((glass.base_color, glass.opacity), ([0.5, 1.0, 1.0], 1.0));
    assert_eq!(lamp.emission, [5.0, 4.0, 3.0]);
    assert_eq!((pbr.roughness, pbr.metallic), (0.25, 1.0));
    assert_eq!(absent.name, "absent");
    // White under its image, whose opacity is that of the mask.
    let texture = leaf.base_color_texture.unwrap();
    assert_eq!(
        (leaf.base_color, leaf.alpha, texture.wrap),
        ([1.0; 3], Alpha::Blend, [Wrap::Clamp; 2])
    );
    let expected = Image { width: 4, height: 2, pixels: vec![[10, 20, 30, 77]; 8] };
    assert_eq!(stage.images[texture.image as usize], expected);
    assert_eq!(leaf.emission, [1.0; 3]);
    let glow = &stage.images[leaf.emission_texture.unwrap().image as usize];
    assert!((glow.width, glow.pixels[0][3]) == (8, 255) && glow.pixels[0][0].abs_diff(200) < 4);
    let skipped = [
        "pc of MTL files",
        "options -s, -o and -t of textures",
        "materials that no library of the file has: absent",
    ];
    assert_eq!(stage.skipped, skipped);
}

/// MeshLab writes `Tr 1` of surfaces that are opaque.
#[test]
fn surfaces_are_not_made_invisible() {
    let opacity = |statements: &str| {
        let library = format!("newmtl m\nKd 1 1 1\n{statements}");
        let obj = format!("mtllib a.mtl\n{FLAT}usemtl m\nf 1 2 3\n");
        let folder = folder(&[("a.obj", obj.as_bytes()), ("a.mtl", library.as_bytes())]);
        let stage = read(folder.path(), "a.obj").unwrap();
        (stage.materials[0].opacity, stage.skipped.iter().any(|s| s.starts_with("Tr 1 of MTL")))
    };
    assert_eq!(opacity("Tr 1.000\n"), (1.0, true));
    assert_eq!(opacity("Tr 0.75\n"), (0.25, false));
    assert_eq!(opacity("d 0\n"), (0.0, false));
    assert_eq!(opacity("d 0\nTr 1\n"), (0.0, false));
}

#[test]
fn images_that_are_normals() {
    let obj =
        format!("mtllib a.mtl\n{FLAT}usemtl n\nf 1 2 3\nusemtl b\nf 1 2 3\nusemtl h\nf 1 2 3\n");
    let mtl = "newmtl n\nnorm n.png\nnewmtl b\nbump -bm 0.5 n.png\nnewmtl h\nmap_Bump h.png\n";
    let folder = folder(&[
        ("a.obj", obj.as_bytes()),
        ("a.mtl", mtl.as_bytes()),
        ("n.png", &png(2, 2, [128, 127, 250, 255])),
        ("h.png", &png(2, 2, [90, 90, 90, 255])),
    ]);
    let stage = read(folder.path(), "a.obj").unwrap();
    let has: Vec<bool> = stage.materials.iter().map(|m| m.normal_texture.is_some()).collect();
    assert_eq!((has, stage.images.len()), (vec![true, true, false], 2));
    assert_eq!(stage.skipped, ["bump maps of heights"]);
}

/// Whatever a material names is read from the scene's folder or not at all; the mesh opens anyway.
#[test]
fn textures_lie_in_the_folder_and_nowhere_else() {
    let folder = folder(&[("secret.png", &png(1, 1, [9; 4])), ("in/ok.png", &png(1, 1, [1; 4]))]);
    let inner = folder.path().join("in");
    let absolute = folder.path().join("secret.png").display().to_string();
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../secret.png", inner.join("link.png")).unwrap();
        std::os::unix::fs::symlink("..", inner.join("up")).unwrap();
        std::os::unix::fs::symlink("ok.png", inner.join("fine.png")).unwrap();
    }
    let texture = |name: &str| {
        std::fs::write(inner.join("a.mtl"), format!("newmtl m\nmap_Kd {name}\n")).unwrap();
        std::fs::write(inner.join("a.obj"), format!("mtllib a.mtl\n{FLAT}usemtl m\nf 1 2 3\n"))
            .unwrap();
        read(&inner, "a.obj").unwrap()
    };
    for name in ["ok.png", "./ok.png", ".\\ok.png", "././ok.png"] {
        assert_eq!(texture(name).images.len(), 1, "{name}");
    }
    std::fs::write(inner.join("a.obj"), format!("mtllib ./a.mtl\n{FLAT}usemtl m\nf 1 2 3\n"))
        .unwrap();
    assert_eq!(read(&inner, "a.obj").unwrap().images.len(), 1);
    assert!(texture(".").skipped[0].contains("expected a regular file"));
    let refused = [
        "../secret.png",
        "..\\secret.png",
        &absolute,
        "C:\\a.png",
        "https://a.b/c.png",
        "./../secret.png",
    ];
    for name in refused {
        let stage = texture(name);
        assert!(stage.images.is_empty() && stage.materials[0].base_color_texture.is_none());
        let [sentence] = &stage.skipped[..] else { panic!("{:?}", stage.skipped) };
        assert!(sentence.contains("expected a file in this folder or below"), "{sentence}");
    }
    #[cfg(unix)]
    {
        assert_eq!(texture("fine.png").images.len(), 1);
        for name in ["link.png", "up/secret.png"] {
            let stage = texture(name);
            assert!(stage.images.is_empty());
            assert!(stage.skipped[0].contains("a link to elsewhere"), "{:?}", stage.skipped);
        }
        assert!(texture("up").skipped[0].contains("a link to elsewhere"));
    }
    assert!(texture("absent.png").skipped[0].contains("there is no such file"));
    assert!(texture("a.mtl").skipped[0].contains("expected a PNG, JPEG or WebP image"));
    std::fs::write(inner.join("a.obj"), format!("mtllib ../a.mtl b.mtl\n{FLAT}f 1 2 3\n")).unwrap();
    let skipped = read(&inner, "a.obj").unwrap().skipped;
    assert!(skipped[0].starts_with("material libraries, expected a file in this"), "{skipped:?}");
    assert!(skipped[1] == "material libraries, there is no such file: b.mtl");
    // From memory nothing lies beside.
    let stage = parse(MeshFormat::Obj, format!("mtllib a.mtl\n{FLAT}f 1 2 3\n"));
    assert!(stage.skipped[0].contains("it has no folder"), "{:?}", stage.skipped);
}

#[test]
fn images_have_limits() {
    let obj = format!("mtllib a.mtl\n{FLAT}usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n");
    let mtl = "newmtl a\nmap_Kd a.png\nnewmtl b\nmap_Kd b.png\nmap_d b.png\n";
    // A header that announces what is not there.
    let mut bomb = png(1, 1, [0; 4]);
    bomb[16..24].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]);
    let sum = crc(&bomb[12..29]).to_be_bytes();
    bomb[29..33].copy_from_slice(&sum);
    let folder = folder(&[
        ("a.obj", obj.as_bytes()),
        ("a.mtl", mtl.as_bytes()),
        ("a.png", &bomb),
        ("b.png", &png(8, 8, [0; 4])),
    ]);
    let with = |limits: MeshLimits| {
        Stage::read_monitored(&folder.path().join("a.obj"), &limits, &()).unwrap()
    };
    let stage = with(LIMITS);
    assert_eq!(stage.images.len(), 2);
    let sentence =
        "textures, expected an image of 1 to 268435456 pixels, found 65536 x 65536: a.png";
    assert_eq!(stage.skipped, [sentence]);
    let stage = with(MeshLimits { pixels: 100, ..LIMITS });
    assert_eq!(stage.images.len(), 1);
    assert!(
        stage.skipped[1].contains("textures, expected an image of 1 to 36 pixels"),
        "{:?}",
        stage.skipped
    );
    let stage = with(MeshLimits { images: 0, ..LIMITS });
    assert!(stage.skipped[0].contains("expected at most 0 images"), "{:?}", stage.skipped);
    std::fs::write(folder.path().join("a.png"), &png(9, 9, [7; 4])[..60]).unwrap();
    assert!(with(LIMITS).skipped[0].contains("expected a sound image"));
}

/// The check sum of PNG (ISO 15948, annex D).
fn crc(bytes: &[u8]) -> u32 {
    let mut sum = u32::MAX;
    for &byte in bytes {
        sum ^= u32::from(byte);
        for _ in 0..8 {
            sum = if sum & 1 == 1 { 0xedb8_8320 ^ (sum >> 1) } else { sum >> 1 };
        }
    }
    !sum
}

#[test]
fn a_ply_file_has_colours_normals_and_an_image() {
    let head = "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty uchar red\n\
        property uchar green\nproperty uchar blue\nproperty float s\nproperty float t\nproperty float quality\n\
        element face 1\nproperty list uchar int vertex_indices\nelement edge 1\nproperty int a\nend_header\n";
    let rows = "0 0 0 0 0 2 255 0 0 0 0 9\n1 0 0 0 0 0 255 255 255 1 0.25 9\n0 1 0 1 0 0 0 0 0 nan 1 9\n3 0 1 2\n1\n";
    let folder =
        folder(&[("a.ply", format!("{head}{rows}").as_bytes()), ("a.png", &png(1, 1, [5; 4]))]);
    let stage = read(folder.path(), "a.ply").unwrap();
    assert_eq!(stage.normals, [[[0.0, 0.0, 1.0], [0.0; 3], [1.0, 0.0, 0.0]]]);
    assert_eq!(stage.colors, [[[1.0, 0.0, 0.0], [1.0; 3], [0.0; 3]]]);
    assert_eq!(stage.uvs, [[[0.0, 1.0], [1.0, 0.75], [0.0, 0.0]]]);
    assert_eq!((stage.images.len(), stage.materials[0].base_color), (1, [1.0; 3]));
    assert_eq!(stage.skipped, ["property quality of element vertex", "elements edge"]);
}

#[test]
fn faces_of_a_ply_file_have_colours_and_coordinates() {
    let head = "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
        property float z\nelement face 2\nproperty list uchar int vertex_indices\n\
        property list uchar float texcoord\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
    let mut bytes = head.as_bytes().to_vec();
    for point in [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]] {
        bytes.extend(point.iter().flat_map(|x| x.to_le_bytes()));
    }
    let mut face = |corners: &[i32], uvs: &[f32], red: u8| {
        bytes.push(corners.len() as u8);
        bytes.extend(corners.iter().flat_map(|i| i.to_le_bytes()));
        bytes.push(uvs.len() as u8);
        bytes.extend(uvs.iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([red, 0, 255]);
    };
    face(&[0, 1, 2, 3], &[0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.5], 255);
    face(&[0, 1, 2], &[], 0);
    let stage = parse(MeshFormat::Ply, bytes);
    assert_eq!(stage.mesh.faces, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
    assert_eq!(stage.uvs[1], [[0.0, 1.0], [1.0, 0.0], [0.0, 0.5]]);
    assert_eq!(stage.uvs[2], [[0.0; 2]; 3]);
    assert_eq!(stage.colors[1], [[1.0, 0.0, 1.0]; 3]);
    assert_eq!(stage.colors[2], [[0.0, 0.0, 1.0]; 3]);
}

#[test]
fn what_stl_and_off_files_say_of_colours_is_named() {
    let off = parse(
        MeshFormat::Off,
        "COFF\n3 1 0\n0 0 0 1 1 1\n1 0 0 1 1 1\n0 1 0 1 1 1\n3 0 1 2 255 0 0\n",
    );
    let expected =
        ["colours, normals and texture coordinates of OFF vertices", "colours of OFF faces"];
    assert_eq!(off.skipped, expected);
    let mut stl = b"COLOR=abcd".to_vec();
    stl.resize(80, 0);
    stl.extend(1u32.to_le_bytes());
    stl.extend([0; 12]);
    stl.extend(
        [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()),
    );
    stl.extend([1, 0x80]);
    let skipped = parse(MeshFormat::Stl, stl).skipped;
    assert!(
        skipped[0].contains("an STL header") && skipped[1].contains("attributes of STL"),
        "{skipped:?}"
    );
}

/// A glTF file whose buffer holds these numbers, each as it is.
fn gltf(json: &str, data: &[f32]) -> Vec<u8> {
    use base64::{Engine, engine::general_purpose::STANDARD};
    let bytes: Vec<u8> = data.iter().flat_map(|x| x.to_le_bytes()).collect();
    let data = STANDARD.encode(&bytes);
    let length = bytes.len();
    let views = format!(r#""bufferViews":[{{"buffer":0,"byteLength":{length}}}]"#);
    let buffer = format!(
        r#""buffers":[{{"byteLength":{length},"uri":"data:application/octet-stream;base64,{data}"}}]"#
    );
    let head = r#""asset":{"version":"2.0"}"#;
    format!("{{{head},{views},{buffer},{json}}}").into_bytes()
}

/// Positions, normals, two sets of coordinates, and colours of a triangle.
const DATA: [f32; 48] = [
    0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, // positions
    0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, // normals
    0.0, 0.0, 1.0, 0.0, 0.0, 1.0, // coordinates
    0.25, 0.5, 0.25, 0.5, 0.25, 0.5, // others
    1.0, 0.5, 0.25, 1.0, 0.0, 0.0, 0.0, 0.5, 2.0, -1.0, 0.5, 1.0, // colours
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
];

const ACCESSORS: &str = r#""accessors":[
    {"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
    {"bufferView":0,"byteOffset":36,"componentType":5126,"count":3,"type":"VEC3"},
    {"bufferView":0,"byteOffset":72,"componentType":5126,"count":3,"type":"VEC2"},
    {"bufferView":0,"byteOffset":96,"componentType":5126,"count":3,"type":"VEC2"},
    {"bufferView":0,"byteOffset":120,"componentType":5126,"count":3,"type":"VEC4"}]"#;

fn dressed(rest: &str, primitive: &str) -> Stage {
    parse(MeshFormat::Gltf, dressed_bytes(rest, primitive))
}

fn dressed_bytes(rest: &str, primitive: &str) -> Vec<u8> {
    let json = format!(
        r#"{ACCESSORS},"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2,
        "TEXCOORD_1":3,"COLOR_0":4}}{primitive}}},{{"attributes":{{"POSITION":0}}}}]}}]{rest}"#
    );
    gltf(&json, &DATA)
}

#[test]
fn a_gltf_file_has_normals_coordinates_and_colours() {
    let stage = dressed("", "");
    assert_eq!(stage.normals[0], [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]);
    assert_eq!(stage.uvs[0], [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    assert_eq!(stage.colors[0], [[1.0, 0.5, 0.25], [0.0, 0.0, 0.0], [1.0, 0.0, 0.5]]);
    assert_eq!((stage.normals[1], stage.colors[1]), ([[0.0; 3]; 3], [[1.0; 3]; 3]));
    assert_eq!(stage.materials, [Default::default()]);
    // A mirror turns faces over, a stretch turns normals.
    let nodes = r#","nodes":[{"mesh":0,"scale":[-1,1,0.5]}]"#;
    let stage = dressed(nodes, "");
    assert_eq!(stage.mesh.faces[0], [0, 2, 1]);
    assert_eq!(stage.mesh.vertices[1], [-1.0, 0.0, 0.0]);
    assert_eq!(stage.normals[0][0], [0.0, 0.0, 1.0]);
    let nodes = r#","nodes":[{"mesh":0,"matrix":[1,0,0,0, 0,1,1,0, 0,0,1,0, 0,0,0,1]}]"#;
    let normal = dressed(nodes, "").normals[0][1];
    let half = 0.5f32.sqrt();
    assert!(normal[0] == 0.0 && (normal[1] + half).abs() < 1e-6 && (normal[2] - half).abs() < 1e-6);
}

#[test]
fn materials_of_gltf() {
    let rest = r#","extensionsUsed":["KHR_materials_ior","KHR_materials_clearcoat"],"materials":[{"name":"a","doubleSided":true,
        "pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0,0.75],"metallicFactor":0.5},"emissiveFactor":[1,0.5,0],
        "alphaMode":"MASK","alphaCutoff":0.25,"occlusionTexture":{"index":0},"extensions":{"KHR_materials_ior":{"ior":1.25},
        "KHR_materials_transmission":{"transmissionFactor":0.5},"KHR_materials_emissive_strength":{"emissiveStrength":4}}}]"#;
    let stage = dressed(rest, r#","material":0"#);
    assert_eq!((stage.material.as_slice(), stage.materials.len()), ([0, 1].as_slice(), 2));
    let material = &stage.materials[0];
    assert_eq!((material.base_color, material.opacity), ([0.5, 0.25, 0.0], 0.75));
    assert_eq!((material.metallic, material.roughness), (0.5, 1.0));
    assert_eq!(material.emission, [4.0, 2.0, 0.0]);
    assert_eq!((material.alpha, material.two_sided), (Alpha::Mask(0.25), true));
    assert_eq!((material.ior, material.transmission), (1.25, 0.5));
    assert_eq!(stage.skipped[0], "occlusion textures, since light is followed instead");
    assert_eq!(stage.skipped[1], "extension KHR_materials_clearcoat");
    let sentence = |rest: &str| {
        let bytes = dressed_bytes(rest, r#","material":0"#);
        Stage::parse(MeshFormat::Gltf, &bytes, None, &LIMITS).unwrap_err().to_string()
    };
    let wrong = r#","materials":[{"pbrMetallicRoughness":{"metallicFactor":"a"}}]"#;
    assert!(sentence(wrong).contains("materials[0].metallicFactor: expected a number from 0 to 1"));
    assert!(
        sentence("").contains("primitives[0].material: expected one of the 0 materials, found 0")
    );
    assert!(
        sentence(r#","materials":[{"alphaMode":"X"}]"#)
            .contains("expected OPAQUE, MASK or BLEND, found X")
    );
}

/// Four pixels by two, (200, 100, 50) with the first one half transparent: lossy with an alpha chunk, lossless, an animation.
const WEBP: [&str; 3] = [
    "UklGRl4AAABXRUJQVlA4WAoAAAAQAAAAAwAAAQAAQUxQSAkAAAAAgP////////8AVlA4IC4AAADwAQCdASoEAAIAAUAmJaACdLoB+AAEyAAA/q4X/zYEDND6YP/SbPE2eJs+OYAA",
    "UklGRiIAAABXRUJQVlA4TBUAAAAvA0AAEA8wZIM8Mv8DjAfc4SGi/yEA",
    "UklGRr4AAABXRUJQVlA4WAoAAAASAAAAAwAAAQAAQU5JTQYAAAAAAAAAAABBTk1GWgAAAAAAAAAAAAMAAAEAAGQAAAJBTFBICQAAAACA/////////wBWUDggMAAAADABAJ0BKgQAAgABQCYloAADcAD+xO///zYH/kH/yD7/f//pNn/9Js//pNnxzAAAAEFOTUYwAAAAAAAAAAAAAwAAAQAAZAAAAFZQOCAYAAAANAEAnQEqBAACAAAAJiWkAANwAP79IFAA",
];

#[test]
fn webp_textures_of_gltf() {
    use base64::{Engine, engine::general_purpose::STANDARD};
    let with = |image: &[u8], texture: &str, limits: &MeshLimits| {
        let rest = format!(
            r#","extensionsUsed":["EXT_texture_webp"],"images":[{{"uri":"absent.png"}},{{"uri":"data:image/webp;base64,{}"}}],
            "textures":[{texture}],"materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}]"#,
            STANDARD.encode(image)
        );
        let bytes = dressed_bytes(&rest, r#","material":0"#);
        Stage::parse(MeshFormat::Gltf, &bytes, None, limits).unwrap()
    };
    let extension = r#"{"source":0,"extensions":{"EXT_texture_webp":{"source":1}}}"#;
    let [lossy, lossless, animated] = WEBP.map(|text| STANDARD.decode(text).unwrap());
    for image in [&lossy, &lossless] {
        // Instead of the source, which is for those who know no WebP, or as the source.
        for texture in [extension, r#"{"source":1}"#] {
            let stage = with(image, texture, &LIMITS);
            assert_eq!(stage.skipped, [""; 0]);
            let [Image { width: 4, height: 2, pixels }] = &stage.images[..] else {
                panic!("{:?}", stage.images)
            };
            assert_eq!((pixels[0][3], pixels[1][3]), (128, 255));
            let far = |pixel: &[u8; 4]| {
                (0..3).map(|i| pixel[i].abs_diff([200, 100, 50][i])).max().unwrap()
            };
            let most = pixels.iter().map(far).max().unwrap();
            assert!(most <= if image == &lossless { 0 } else { 12 }, "{pixels:?}");
        }
    }
    let refused = |image: &[u8], limits: &MeshLimits, what: &str| {
        let stage = with(image, extension, limits);
        assert_eq!((stage.images.len(), stage.materials[0].base_color_texture), (0, None));
        assert!(stage.skipped[0].contains(what), "{:?}\n{what}", stage.skipped);
    };
    let few = of_pixels(7);
    refused(&lossy, &few, "expected an image of 1 to 7 pixels, found 4 x 2: images[1]");
    refused(&lossless, &few, "expected an image of 1 to 7 pixels, found 4 x 2");
    refused(&lossless[..30], &LIMITS, "expected a sound image");
    refused(&animated, &LIMITS, "expected one image, found an animation");
    // A picture that is larger than its container says, for which the decoder would take memory first.
    let at = lossy.windows(3).position(|bytes| bytes == [0x9d, 0x01, 0x2a]).unwrap() + 3;
    let mut large = lossy.clone();
    large[at..at + 4].copy_from_slice(&[0xff, 0x3f, 0xff, 0x3f]);
    let what = "expected an image of 4 x 2, as its container says, found 16383 x 16383";
    refused(&large, &of_pixels(8), what);
    let mut large = lossy[..30].to_vec();
    large[16..20].copy_from_slice(&10u32.to_le_bytes());
    large.extend(&lossless[12..]);
    let at = large.windows(5).position(|bytes| bytes[0] == 0x2f && bytes[1] == 3).unwrap() + 1;
    large[at..at + 4].copy_from_slice(&[0xff, 0xff, 0xff, 0x0f]);
    refused(&large, &of_pixels(8), "as its container says, found 16384 x 16384");
}

/// So many pixels and no more.
fn of_pixels(pixels: u64) -> MeshLimits {
    MeshLimits { pixels, ..LIMITS }
}

#[test]
fn textures_of_gltf() {
    use base64::{Engine, engine::general_purpose::STANDARD};
    let data = STANDARD.encode(png(2, 1, [1, 2, 3, 4]));
    let common = format!(
        r#","images":[{{"uri":"data:image/png;base64,{data}"}},{{"uri":"a%20b.png"}},{{"uri":"../c.png"}}],
        "samplers":[{{"wrapS":33071,"wrapT":33648}}],
        "textures":[{{"source":0,"sampler":0}},{{"source":1}},{{"source":2}},{{}}]"#
    );
    let material = |json: &str| format!(r#"{common},"materials":[{{{json}}}]"#);
    let all = material(
        r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0,"texCoord":1},"metallicRoughnessTexture":{"index":0,"texCoord":1}},
        "normalTexture":{"index":0},"emissiveTexture":{"index":3,"texCoord":1}"#,
    );
    let stage = dressed(&all, r#","material":0"#);
    let texture = stage.materials[0].base_color_texture.unwrap();
    assert_eq!(texture.wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert_eq!(stage.images, [Image { width: 2, height: 1, pixels: vec![[1, 2, 3, 4]; 2] }]);
    assert!(stage.materials[0].metallic_roughness_texture.is_some());
    assert_eq!(stage.uvs[0][0], [0.25, 0.5], "of the second set");
    assert_eq!(stage.materials[0].normal_texture, None);
    let skipped = [
        "textures with other coordinates than the first of their material",
        "textures[3]: expected a PNG, JPEG or WebP source, found none",
    ];
    assert_eq!(stage.skipped, skipped);
    // A quarter turn, twice as often, moved by a half: (u, v) to (2 v + 0.5, -2 u).
    let moved = material(
        r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0,"extensions":{"KHR_texture_transform":{
        "offset":[0.5,0],"rotation":1.5707963267948966,"scale":[2,2]}}}}"#,
    );
    let uvs = dressed(&moved, r#","material":0"#).uvs[0];
    for (found, expected) in
        uvs.iter().flatten().zip([[0.5, 0.0], [0.5, -2.0], [2.5, 0.0]].as_flattened())
    {
        assert!((found - expected).abs() < 1e-6, "{uvs:?}");
    }
    let beside = |index: usize| {
        let json = material(&format!(r#""normalTexture":{{"index":{index}}}"#));
        let json = dressed_bytes(&json, r#","material":0"#);
        let folder = folder(&[("a.gltf", &json), ("a b.png", &png(1, 1, [9; 4]))]);
        read(folder.path(), "a.gltf").unwrap()
    };
    assert_eq!(beside(1).images.len(), 1);
    let refused = beside(2);
    assert!(
        refused.skipped[0].contains("textures, expected a file in this folder or below"),
        "{:?}",
        refused.skipped
    );
    let bytes = dressed_bytes(&all, r#","material":0"#);
    let small = MeshLimits { bytes: bytes.len() as u64, ..LIMITS };
    assert_eq!(Stage::parse(MeshFormat::Gltf, &bytes, None, &small).unwrap().images.len(), 1);
}

/// Zipped data in a URI: the archive is small, what it unpacks to is not.
#[test]
fn data_in_a_uri_is_limited() {
    use std::io::Write;
    let uri = format!("data:;base64,{}", "A".repeat(40_000));
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":30000,"uri":"{uri}"}}]}}"#
    );
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    gzip.write_all(json.as_bytes()).unwrap();
    let zipped = gzip.finish().unwrap();
    let sentence = |bytes: u64| {
        let limits = MeshLimits { bytes, ..LIMITS };
        Stage::parse(MeshFormat::Gltf, &zipped, None, &limits).unwrap_err().to_string()
    };
    assert!(zipped.len() < 1000);
    assert!(sentence(20_000).contains("expected at most 20000 bytes"));
    assert!(sentence(50_000).contains("expected at least one face"));
}

#[test]
fn lights_and_the_view_stand_at_nodes() {
    let rest = r#","cameras":[{"type":"perspective","perspective":{"yfov":1.5707963267948966,"aspectRatio":2,"znear":0.5}},
        {"type":"orthographic"}],"extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":3,"color":[1,0.5,0]},
        {"type":"spot","spot":{"outerConeAngle":0.5}},{"type":"directional"}]}},
        "nodes":[{"mesh":0},{"camera":0,"translation":[1,2,3],"rotation":[0,0.7071067811865476,0,0.7071067811865476],"children":[2]},
        {"translation":[0,0,-1],"extensions":{"KHR_lights_punctual":{"light":0}}},{"extensions":{"KHR_lights_punctual":{"light":1}}},
        {"camera":1,"extensions":{"KHR_lights_punctual":{"light":2}}}],"scenes":[{"nodes":[0,1,3,4]},{}]"#;
    let stage = dressed(rest, "");
    let camera = stage.camera.unwrap();
    let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
    // Turned by 90 degrees about y, from -z to -x.
    assert!(near(camera.from, [1.0, 2.0, 3.0]) && near(camera.at, [0.0, 2.0, 3.0]), "{camera:?}");
    assert!((camera.angle - 2.0 * 2f64.atan().to_degrees()).abs() < 1e-9);
    assert_eq!((camera.resolution, camera.hither), ([1440, 720], 0.5));
    let Light::Point { position, intensity } = stage.lights[0] else {
        panic!("{:?}", stage.lights)
    };
    assert!(near(position, [0.0, 2.0, 3.0]));
    assert_eq!(intensity, [3.0, 1.5, 0.0]);
    assert!(matches!(
        stage.lights[1],
        Light::Spot { cone: [0.0, 0.5], direction: [0.0, 0.0, -1.0], .. }
    ));
    assert!(matches!(stage.lights[2], Light::Directional { irradiance: [1.0, 1.0, 1.0], .. }));
    assert_eq!(stage.skipped, ["cameras besides the first one", "scenes besides the default one"]);
}

/// Integers for positions are taken where the extension is named, and nowhere else.
#[test]
fn quantized_positions() {
    let json = |used: &str| {
        let data: Vec<f32> = vec![
            f32::from_le_bytes([0, 0, 0, 0]),
            f32::from_le_bytes([127, 0, 0, 0]),
            f32::from_le_bytes([0, 64, 0, 0]),
        ];
        gltf(
            &format!(
                r#"{used}"accessors":[{{"bufferView":0,"componentType":5120,"normalized":true,"count":3,"type":"VEC3"}}],
                "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}]"#
            ),
            &data,
        )
    };
    let text = |used: &str| {
        String::from_utf8(json(used))
            .unwrap()
            .replace(r#""byteLength":12}"#, r#""byteLength":12,"byteStride":4}"#)
    };
    let stage = parse(MeshFormat::Gltf, text(r#""extensionsRequired":["KHR_mesh_quantization"],"#));
    assert_eq!(stage.mesh.vertices, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 64.0 / 127.0, 0.0]]);
    let error = Stage::parse(MeshFormat::Gltf, text("").as_bytes(), None, &LIMITS).unwrap_err();
    assert!(
        error.to_string().contains("accessors[0].componentType: expected 5126, or integers"),
        "{error}"
    );
}
