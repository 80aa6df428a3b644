//! Mesh files of text: read piece by piece, and in the shapes that real programs gave them.

use flate2::{Compression, write::GzEncoder};
use ropewalk_scene::{Mesh, MeshFormat, MeshLimits, Stage};
use std::fmt::Write as _;
use std::io::Write as _;

fn parse(format: MeshFormat, bytes: &[u8]) -> Result<Mesh, String> {
    Mesh::parse(format, bytes, None, &MeshLimits::DEFAULT).map_err(|e| e.to_string())
}

fn skipped(format: MeshFormat, bytes: &[u8]) -> Vec<String> {
    Stage::parse(format, bytes, None, &MeshLimits::DEFAULT).unwrap().skipped
}

/// Triangles of the long meshes below, one behind the other.
const LONG: usize = 40_000;

fn corner(face: usize, corner: usize) -> [f64; 3] {
    [face as f64, [0.0, 1.0, 0.5][corner], [0.0, 0.25, -2.5e-3][corner]]
}

/// The same triangles in each format, with vertices of their own, some MiB of text.
fn long(format: MeshFormat) -> String {
    let mut out = String::new();
    let vertices = (0..3 * LONG).map(|i| corner(i / 3, i % 3).map(|x| x.to_string()).join(" "));
    match format {
        MeshFormat::Obj => {
            for row in vertices {
                // Whatever line end is the last of a piece, it is most probably not that of a statement.
                writeln!(out, "v \\\n{} \\\n", row.replace(' ', " \\\n")).unwrap();
            }
            for i in 0..LONG {
                writeln!(out, "f {} {} \\\r\n{}", 3 * i + 1, 3 * i + 2, 3 * i + 3).unwrap();
            }
        }
        MeshFormat::Stl => {
            out += "solid long\n";
            for i in 0..LONG {
                out += "facet normal 0 0 1\nouter loop\n";
                for c in 0..3 {
                    writeln!(out, " vertex {}", corner(i, c).map(|x| x.to_string()).join(" "))
                        .unwrap();
                }
                out += "endloop\nendfacet\n";
            }
            out += "endsolid long\n";
        }
        MeshFormat::Off | MeshFormat::Ply => {
            let (vertex_count, faces) = (3 * LONG, LONG);
            if format == MeshFormat::Off {
                writeln!(out, "OFF\n{vertex_count} {faces} 0").unwrap();
            } else {
                writeln!(
                    out,
                    "ply\nformat ascii 1.0\nelement vertex {vertex_count}\nproperty float x\nproperty float y\n\
                     property double z\nelement face {faces}\nproperty list uchar int vertex_index\nend_header"
                )
                .unwrap();
            }
            vertices.for_each(|row| writeln!(out, "{row}").unwrap());
            (0..LONG).for_each(|i| {
                writeln!(out, "3 {} {} {}", 3 * i, 3 * i + 1, 3 * i + 2).unwrap();
            });
        }
        MeshFormat::Gltf => unreachable!("no text of lines"),
    }
    out
}

const TEXTS: [MeshFormat; 4] = [MeshFormat::Obj, MeshFormat::Ply, MeshFormat::Stl, MeshFormat::Off];

fn gzipped(bytes: &[u8]) -> Vec<u8> {
    let mut gz = GzEncoder::new(Vec::new(), Compression::fast());
    gz.write_all(bytes).unwrap();
    gz.finish().unwrap()
}

#[test]
fn long_texts_are_read_whole() {
    for format in TEXTS {
        let text = long(format);
        assert!(text.len() > 2 << 20, "several pieces");
        for bytes in [text.clone().into_bytes(), gzipped(text.as_bytes())] {
            let mesh = parse(format, &bytes).unwrap();
            assert_eq!((mesh.vertices.len(), mesh.faces.len()), (3 * LONG, LONG), "{format:?}");
            for i in 0..LONG {
                let face = mesh.faces[i].map(|v| mesh.vertices[v as usize]);
                assert_eq!(face, [0, 1, 2].map(|c| corner(i, c)), "{format:?}, face {i}");
            }
        }
    }
}

#[test]
fn lines_are_counted_through_all_pieces() {
    for (format, end, expected) in [
        (MeshFormat::Obj, "f 1 2 x\n", "a vertex, found \"x\""),
        (MeshFormat::Stl, "bolid\n", "endfacet or endsolid, found \"bolid\""),
    ] {
        let text = long(format);
        let line = text.lines().count() + 1;
        let error = parse(format, format!("{text}{end}").as_bytes()).unwrap_err();
        assert!(error.contains(&format!("line {line}: ")) && error.ends_with(expected), "{error}");
    }
    for format in [MeshFormat::Ply, MeshFormat::Off] {
        let text = long(format);
        let (line, rest) = (text.lines().count(), text.trim_end().rfind(' ').unwrap());
        let error = parse(format, format!("{} 120000\n", &text[..rest]).as_bytes()).unwrap_err();
        let expected = format!("line {line}: expected a vertex from 0 to 119999, found 120000");
        assert!(error.contains(&expected), "{error}");
    }
}

#[test]
fn words_longer_than_a_piece() {
    let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n#{}\n", "x".repeat(3 << 20));
    assert_eq!(parse(MeshFormat::Obj, text.as_bytes()).unwrap().faces.len(), 1);
    for head in [
        "OFF\n3 1 0\n0 0 ",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n\
        property float y\nproperty float z\nelement face 1\nproperty list int int vertex_indices\nend_header\n0 0 ",
    ] {
        let format = if head.starts_with("OFF") { MeshFormat::Off } else { MeshFormat::Ply };
        let error =
            parse(format, format!("{head}{}\n", "9".repeat(3 << 20)).as_bytes()).unwrap_err();
        assert!(error.contains("expected a finite coordinate"), "{error}");
        let error =
            parse(format, format!("{head}{}\n", "z".repeat(3 << 20)).as_bytes()).unwrap_err();
        assert!(error.contains(", found \"zzz") && error.len() < 200, "{error}");
    }
}

/// What keeps a file from being read is said, and not what it looks like from within.
#[test]
fn damaged_archives_are_said_to_be_damaged() {
    for format in TEXTS {
        let mut bytes = gzipped(long(format).as_bytes());
        bytes.truncate(bytes.len() / 2);
        let error = parse(format, &bytes).unwrap_err();
        assert!(!error.contains("expected"), "{format:?}: {error}");
    }
}

#[test]
fn limits_hold_in_the_midst() {
    for format in TEXTS {
        let bytes = gzipped(long(format).as_bytes());
        let limits = MeshLimits { bytes: 2 << 20, ..MeshLimits::DEFAULT };
        let error = Mesh::parse(format, &bytes, None, &limits).unwrap_err().to_string();
        assert!(error.contains("expected at most 2097152 bytes"), "{format:?}: {error}");
    }
}

#[test]
fn utf_16_is_named() {
    let text: Vec<u8> = "\u{feff}v 0 0 0\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let error = parse(MeshFormat::Obj, &text).unwrap_err();
    assert!(error.ends_with("expected text in ASCII or UTF-8, found text in UTF-16"), "{error}");
}

const PLY_VERTICES: &str =
    "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
const CORNERS: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];

/// Cyberware's and Stanford's scanners wrote strips, with -1 between them.
#[test]
fn strips_of_ply_are_triangles() {
    let strips = "element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
    let list = [0, 1, 2, 3, -1, 3, 1, 0, -1, 2, 1];
    let expected = [[0, 1, 2], [2, 1, 3], [3, 1, 0]];
    let mut ascii = format!("ply\nformat ascii 1.0\n{PLY_VERTICES}{strips}");
    CORNERS.iter().for_each(|[x, y, z]| writeln!(ascii, "{x} {y} {z}").unwrap());
    writeln!(ascii, "{} {}", list.len(), list.map(|i| i.to_string()).join(" ")).unwrap();
    let mut binary =
        format!("ply\nformat binary_big_endian 1.0\n{PLY_VERTICES}{strips}").into_bytes();
    binary.extend(CORNERS.iter().flatten().flat_map(|x| x.to_be_bytes()));
    binary.extend([list.len() as i32].iter().chain(&list).flat_map(|x| x.to_be_bytes()));
    for bytes in [ascii.as_bytes(), &binary] {
        assert_eq!(parse(MeshFormat::Ply, bytes).unwrap().faces, expected);
        assert!(skipped(MeshFormat::Ply, bytes).is_empty());
    }
    for (wrong, found) in [("-2", "-2"), ("4", "4")] {
        let error = parse(MeshFormat::Ply, ascii.replace("-1", wrong).as_bytes()).unwrap_err();
        assert!(error.contains(&format!("a vertex from 0 to 3, found {found}")), "{error}");
    }
}

/// Rhinoceros ends the lines of a header as old Macintoshes did, text or not.
#[test]
fn headers_of_carriage_returns() {
    let head = format!(
        "ply\nformat FORM 1.0\n{PLY_VERTICES}element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    );
    let expected = [[0, 1, 2], [0, 2, 3]];
    let mut text = head.replace("FORM", "ascii");
    CORNERS.iter().for_each(|[x, y, z]| writeln!(text, "{x} {y} {z}").unwrap());
    text += "4 0 1 2 3";
    assert_eq!(
        parse(MeshFormat::Ply, text.replace('\n', "\r").as_bytes()).unwrap().faces,
        expected
    );
    let error = parse(
        MeshFormat::Ply,
        text.replace("4 0 1 2 3", "4 0 1 2 9").replace('\n', "\r").as_bytes(),
    );
    assert!(error.clone().unwrap_err().contains("line 14: "), "{error:?}");
    // Data that begin with what ends a line elsewhere are data.
    let mut binary = head.replace("FORM", "binary_little_endian").replace('\n', "\r").into_bytes();
    let first = f32::from_le_bytes([b'\n', 0, 0, 0]);
    let corners = CORNERS.iter().flatten().enumerate();
    binary.extend(corners.flat_map(|(i, &x)| if i == 0 { first } else { x }.to_le_bytes()));
    binary.push(4);
    binary.extend([0, 1, 2, 3].iter().flat_map(|i: &i32| i.to_le_bytes()));
    let mesh = parse(MeshFormat::Ply, &binary).unwrap();
    assert_eq!((mesh.vertices[0][0], &mesh.faces[..]), (f64::from(first), &expected[..]));
}

/// An old exporter of Blender wrote its name into the header, MeshLab colours that the header does not name.
#[test]
fn ply_with_more_than_it_says() {
    let head = format!(
        "ply\nformat ascii 1.0\nCreated by a program\n{PLY_VERTICES}element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    );
    let text = head + "0 0 0\n1 0 0 0.5\n0 1 0\n1 1 0\n3 0 1 2 9 1 1 1\n3 1 2\n 3\n";
    assert_eq!(parse(MeshFormat::Ply, text.as_bytes()).unwrap().faces, [[0, 1, 2], [1, 2, 3]]);
    let said = skipped(MeshFormat::Ply, text.as_bytes());
    assert!(said.iter().any(|s| s.contains("lines of a PLY header")), "{said:?}");
    assert!(said.iter().any(|s| s.contains("numbers on lines of PLY elements")), "{said:?}");
    // A misspelt property is not passed over.
    let error =
        parse(MeshFormat::Ply, text.replace("property float z", "propery float z").as_bytes())
            .unwrap_err();
    assert!(error.contains("line 7: expected element, property"), "{error}");
}
