//! Which format a file has: by its content, then by its name.

use super::error::{MeshError, Place, wrong};
use std::path::Path;

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Wavefront OBJ.
    Obj,
    /// PLY, ascii or binary of either byte order.
    Ply,
    /// STL, ascii or binary.
    Stl,
    /// Object File Format, ascii.
    Off,
    /// glTF 2.0, as text or binary (GLB).
    Gltf,
}

/// What a file is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Recognised {
    /// A mesh.
    Mesh(MeshFormat),
    /// A scene in NFF.
    Nff,
    /// Neither, and what it looks like.
    Neither(&'static str),
}

/// Bytes from the beginning of a file by which its format is told.
pub const HEAD: usize = 4096;

impl MeshFormat {
    /// All formats.
    pub const ALL: [MeshFormat; 5] =
        [MeshFormat::Obj, MeshFormat::Ply, MeshFormat::Stl, MeshFormat::Off, MeshFormat::Gltf];

    /// The format that a file's name stands for, `.gz` aside.
    pub fn of_name(path: &Path) -> Option<MeshFormat> {
        Some(match extension(path)?.as_str() {
            "obj" => MeshFormat::Obj,
            "ply" => MeshFormat::Ply,
            "stl" => MeshFormat::Stl,
            "off" => MeshFormat::Off,
            "gltf" | "glb" => MeshFormat::Gltf,
            _ => return None,
        })
    }
}

/// The extension in small letters, `.gz` aside.
pub fn extension(path: &Path) -> Option<String> {
    let extension = |path: &Path| Some(path.extension()?.to_str()?.to_ascii_lowercase());
    let found = extension(path)?;
    if found == "gz" { extension(Path::new(path.file_stem()?)) } else { Some(found) }
}

/// What a file is whose unpacked bytes begin with `head` ([`HEAD`] of them or all): by the words and numbers with which
/// formats begin, then by its name, then by its first lines. `size` is that of all bytes, if it is known.
pub fn recognise(path: &Path, head: &[u8], size: Option<u64>) -> Recognised {
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
    let first = text.split(|b| b.is_ascii_whitespace()).next().unwrap_or_default();
    let is_off = matches!(
        first,
        b"OFF" | b"COFF" | b"NOFF" | b"CNOFF" | b"STOFF" | b"STCOFF" | b"STNOFF" | b"STCNOFF"
    );
    let by_content = match first {
        b"ply" => Some(MeshFormat::Ply),
        b"solid" => Some(MeshFormat::Stl),
        _ if is_off => Some(MeshFormat::Off),
        _ if head.starts_with(b"glTF") => Some(MeshFormat::Gltf),
        _ if text.starts_with(b"{") => Some(MeshFormat::Gltf),
        _ => None,
    };
    let is_nff = extension(path).as_deref() == Some("nff");
    if let Some(format) = by_content.filter(|_| !is_nff) {
        return Recognised::Mesh(format);
    }
    if let Some(format) = MeshFormat::of_name(path) {
        return Recognised::Mesh(format);
    }
    if is_nff {
        return Recognised::Nff;
    }
    if size.is_some() && size == super::stl::binary_size(head) {
        return Recognised::Mesh(MeshFormat::Stl);
    }
    by_lines(head)
}

/// Text by the first words of its lines; OBJ and NFF share some of them.
fn by_lines(head: &[u8]) -> Recognised {
    if let Some(what) = other(head) {
        return Recognised::Neither(what);
    }
    if head.contains(&0)
        || std::str::from_utf8(&head[..head.len().min(HEAD - 4)])
            .is_err_and(|e| e.error_len().is_some())
    {
        return Recognised::Neither("binary data of an unknown kind");
    }
    for line in head.split(|&b| b == b'\n') {
        let mut words = line.split(|b| b.is_ascii_whitespace()).filter(|word| !word.is_empty());
        let (first, second) = (words.next().unwrap_or_default(), words.next());
        match (first, second) {
            (b"" | b"#", _) => {}
            (b"vn" | b"vt" | b"mtllib" | b"usemtl" | b"o" | b"g", _) => {
                return Recognised::Mesh(MeshFormat::Obj);
            }
            (b"v", Some(_)) => return Recognised::Mesh(MeshFormat::Obj),
            (b"v", None) | (b"from" | b"at" | b"up" | b"angle" | b"hither" | b"resolution", _) => {
                return Recognised::Nff;
            }
            // A background colour, a light, a fill, a sphere, a cone, a polygon.
            (b"b" | b"l" | b"f" | b"s" | b"c" | b"p" | b"pp", _) => return Recognised::Nff,
            _ if first.starts_with(b"#") => {}
            _ => return Recognised::Neither("text of an unknown kind"),
        }
    }
    Recognised::Neither(if head.trim_ascii().is_empty() {
        "an empty file"
    } else {
        "text of an unknown kind"
    })
}

/// Files that people take for meshes, and others, by their first bytes.
fn other(head: &[u8]) -> Option<&'static str> {
    Some(match head {
        [0x89, b'P', b'N', b'G', ..] => "a PNG image",
        [0xff, 0xd8, 0xff, ..] => "a JPEG image",
        [b'P', b'K', 3, 4, ..] => "a ZIP archive (3MF and USDZ are ones too)",
        _ if head.starts_with(b"Kaydara FBX Binary") => "an FBX file",
        _ if head.starts_with(b"BLENDER") => "a Blender file",
        _ if head.starts_with(b"PXR-USDC") || head.starts_with(b"#usda") => "a USD file",
        _ if head.starts_with(b"#VRML") => "a VRML file",
        _ if head.starts_with(b"ISO-10303-21") => "a STEP file",
        _ if head.starts_with(b"IBSP") => "a game's map",
        _ if head.starts_with(b"ROPEWALK") => "a saved scene",
        _ if head.trim_ascii_start().starts_with(b"<") => "XML or HTML",
        [b'7', b'z', 0xbc, 0xaf, ..] => "a 7z archive",
        [0xfd, b'7', b'z', b'X', b'Z', ..] => "an xz archive",
        [0x28, 0xb5, 0x2f, 0xfd, ..] => "a zstd archive",
        _ => return None,
    })
}

/// The error for what is no mesh.
pub fn not_a_mesh(found: &str) -> MeshError {
    let what = "a mesh in OBJ, PLY, STL, OFF or glTF, told by content or by a name that ends in .obj, .ply, .stl, .off, .gltf or .glb";
    wrong(Place::Start, what, found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(name: &str, head: &[u8]) -> Recognised {
        recognise(Path::new(name), head, Some(head.len() as u64))
    }

    #[test]
    fn content_goes_before_the_name() {
        use MeshFormat::{Gltf, Obj, Off, Ply, Stl};
        let cases: [(&[u8], MeshFormat); 8] = [
            (b"ply\r\nformat", Ply),
            (b"glTF\x02\0\0\0", Gltf),
            (b"\xef\xbb\xbf {\"asset\"", Gltf),
            (b"  COFF\n3 1 0", Off),
            (b"solid a\n", Stl),
            (b"# a comment\n\nv 1 2 3\n", Obj),
            (b"mtllib a.mtl\n", Obj),
            (b"g\nv 1 2 3\n", Obj),
        ];
        for (head, format) in cases {
            for name in ["x", "x.txt", "x.gz"] {
                assert_eq!(of(name, head), Recognised::Mesh(format), "{format:?} as {name}");
            }
        }
        assert_eq!(of("a.obj", b"ply\nformat"), Recognised::Mesh(Ply), "in spite of its name");
        assert_eq!(of("a.PLY.gz", b"nothing"), Recognised::Mesh(Ply), "by its name");
        assert_eq!(of("a.nff", b"ply\n"), Recognised::Nff, "which may begin with anything");
        let mut stl = vec![0; 84 + 50];
        stl[80] = 1;
        assert_eq!(of("x", &stl), Recognised::Mesh(Stl), "by its size");
        assert_eq!(of("x.bin", &stl[..90]), Recognised::Neither("binary data of an unknown kind"));
    }

    #[test]
    fn first_lines_tell_nff_from_obj() {
        for text in ["v\nfrom 1 2 3\n", "# x\nb 0 0 1\n", "f 1 1 1 1 0 0 0 0\np 3\n", "s 0 0 0 1\n"]
        {
            assert_eq!(of("x", text.as_bytes()), Recognised::Nff, "{text}");
        }
    }

    #[test]
    fn other_files_are_named() {
        let cases: [(&[u8], &str); 6] = [
            (b"\x89PNG\r\n\x1a\n", "a PNG image"),
            (b"PK\x03\x04abc", "a ZIP archive (3MF and USDZ are ones too)"),
            (b"Kaydara FBX Binary  ", "an FBX file"),
            (b"<?xml version", "XML or HTML"),
            (b"Dear reader", "text of an unknown kind"),
            (b" \n", "an empty file"),
        ];
        for (head, what) in cases {
            assert_eq!(of("x", head), Recognised::Neither(what));
        }
        let sentence = not_a_mesh("an FBX file").to_string();
        assert!(
            sentence.contains("told by content") && sentence.ends_with("found an FBX file"),
            "{sentence}"
        );
    }
}
