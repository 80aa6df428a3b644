//! Accessors of glTF: every component type, as integers and as shares, sparse and not, interleaved and not, for each
//! attribute that is read; and what is refused.

use ropewalk_scene::{MeshFormat, MeshLimits, Stage};

/// How numbers of an accessor are stored.
#[derive(Clone, Copy, Debug)]
struct Layout {
    component: u64,
    is_normalized: bool,
    sparse: Sparse,
    is_interleaved: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Sparse {
    No,
    /// Some elements of a buffer are replaced.
    Changes,
    /// Some elements are not zero.
    Alone,
}

const PLAIN: Layout =
    Layout { component: 5126, is_normalized: false, sparse: Sparse::No, is_interleaved: false };

const COMPONENTS: [u64; 6] = [5120, 5121, 5122, 5123, 5125, 5126];

impl Layout {
    fn all() -> Vec<Layout> {
        let mut all = Vec::new();
        for component in COMPONENTS {
            for is_normalized in [false, true] {
                for sparse in [Sparse::No, Sparse::Changes, Sparse::Alone] {
                    for is_interleaved in [false, true] {
                        all.push(Layout { component, is_normalized, sparse, is_interleaved });
                    }
                }
            }
        }
        all
    }

    /// Whether the layout is one of these, of which some are normalized.
    fn is_one_of(&self, allowed: &[(u64, bool)]) -> bool {
        self.component == 5126 || allowed.contains(&(self.component, self.is_normalized))
    }

    fn bytes(&self, value: f64) -> Vec<u8> {
        match self.component {
            5120 => (value as i8).to_le_bytes().into(),
            5121 => (value as u8).to_le_bytes().into(),
            5122 => (value as i16).to_le_bytes().into(),
            5123 => (value as u16).to_le_bytes().into(),
            5125 => (value as u32).to_le_bytes().into(),
            _ => (value as f32).to_le_bytes().into(),
        }
    }

    /// What a stored number means (glTF 2.0, section 3.6.2.2).
    fn meaning(&self, value: f64) -> f64 {
        match (self.component, self.is_normalized) {
            (5120, true) => f64::max(value / 127.0, -1.0),
            (5121, true) => value / 255.0,
            (5122, true) => f64::max(value / 32767.0, -1.0),
            (5123, true) => value / 65535.0,
            (5126, _) => f64::from(value as f32),
            _ => value,
        }
    }

    /// Numbers of which some are the least and the largest; none are far from each other beside their size.
    fn numbers(&self) -> [f64; 12] {
        let [least, most] = match self.component {
            5120 => [-128.0, 127.0],
            5121 => [0.0, 255.0],
            5122 => [-32768.0, 32767.0],
            5123 => [0.0, 65535.0],
            5125 => [0.0, 4294967040.0],
            _ => [-3.5, 7.25],
        };
        [0.0, 1.0, most, least, 2.0, 3.0, most, 5.0, 8.0, 13.0, least, 21.0]
    }
}

/// A file in the making.
#[derive(Default)]
struct File {
    bin: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
}

impl File {
    fn view(&mut self, bytes: &[u8], stride: Option<usize>) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0xee);
        let stride = stride.map_or(String::new(), |stride| format!(r#","byteStride":{stride}"#));
        self.views.push(format!(
            r#"{{"buffer":0,"byteOffset":{},"byteLength":{}{stride}}}"#,
            self.bin.len(),
            bytes.len()
        ));
        self.bin.extend(bytes);
        self.views.len() - 1
    }

    /// Rows in a view of their own, with other bytes between them if they are interleaved; view and offset.
    fn rows(&mut self, rows: &[Vec<f64>], layout: &Layout) -> (usize, usize) {
        let packed =
            |row: &Vec<f64>| -> Vec<u8> { row.iter().flat_map(|&x| layout.bytes(x)).collect() };
        if !layout.is_interleaved {
            let bytes: Vec<u8> = rows.iter().flat_map(packed).collect();
            return (self.view(&bytes, None), 0);
        }
        let size = packed(&rows[0]).len();
        let stride = size.next_multiple_of(4) + 8;
        let mut bytes = vec![0xcd; 4];
        for row in rows {
            let start = bytes.len();
            bytes.extend(packed(row));
            bytes.resize(start + stride, 0xcd);
        }
        (self.view(&bytes, Some(stride)), 4)
    }

    /// An accessor of these numbers, `width` a row; its index, and what the rows mean.
    fn accessor(
        &mut self,
        numbers: &[f64],
        width: usize,
        layout: &Layout,
    ) -> (usize, Vec<Vec<f64>>) {
        let rows: Vec<Vec<f64>> = numbers.chunks_exact(width).map(<[f64]>::to_vec).collect();
        let changed: Vec<usize> = match layout.sparse {
            Sparse::No => vec![],
            Sparse::Changes => vec![1, 3],
            Sparse::Alone => (1..rows.len()).collect(),
        };
        let mut text = format!(
            r#"{{"componentType":{},"normalized":{},"count":{},"type":"{}""#,
            layout.component,
            layout.is_normalized,
            rows.len(),
            ["", "SCALAR", "VEC2", "VEC3", "VEC4"][width]
        );
        if layout.sparse != Sparse::Alone {
            let mut stored = rows.clone();
            for &i in &changed {
                stored[i] = vec![1.0; width];
            }
            let (view, offset) = self.rows(&stored, layout);
            text += &format!(r#","bufferView":{view},"byteOffset":{offset}"#);
        }
        if !changed.is_empty() {
            let values: Vec<Vec<f64>> = changed.iter().map(|&i| rows[i].clone()).collect();
            // Indices of the three types in turn.
            let component = [5121, 5123, 5125][self.views.len() % 3];
            let kind = Layout { component, ..PLAIN };
            let indices: Vec<u8> = changed.iter().flat_map(|&i| kind.bytes(i as f64)).collect();
            let at = self.view(&indices, None);
            let (view, offset) = self.rows(&values, &Layout { is_interleaved: false, ..*layout });
            text += &format!(
                r#","sparse":{{"count":{},"indices":{{"bufferView":{at},"componentType":{component}}},
                "values":{{"bufferView":{view},"byteOffset":{offset}}}}}"#,
                changed.len()
            );
        }
        self.accessors.push(text + "}");
        let mut meant = rows;
        if layout.sparse == Sparse::Alone {
            meant[0] = vec![0.0; width];
        }
        meant.iter_mut().flatten().for_each(|x| *x = layout.meaning(*x));
        (self.accessors.len() - 1, meant)
    }

    /// The file, with `rest` behind its accessors.
    fn glb(&self, attributes: &str, indices: usize, rest: &str) -> Vec<u8> {
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"meshes":[{{"primitives":[{{"indices":{indices},"attributes":{{{attributes}}}}}]}}],
            "accessors":[{}],"bufferViews":[{}],"buffers":[{{"byteLength":{}}}]{rest}}}"#,
            self.accessors.join(","),
            self.views.join(","),
            self.bin.len()
        );
        glb(&json, &self.bin)
    }
}

fn glb(json: &str, bin: &[u8]) -> Vec<u8> {
    let mut out = b"glTF".to_vec();
    out.extend(2u32.to_le_bytes());
    out.extend(((28 + json.len() + bin.len()) as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json.as_bytes()), (b"BIN\0", bin)] {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
    }
    out
}

fn parse(bytes: &[u8]) -> Result<Stage, String> {
    Stage::parse(MeshFormat::Gltf, bytes, None, &MeshLimits::DEFAULT).map_err(|e| e.to_string())
}

const QUANTIZED: &str = r#","extensionsUsed":["KHR_mesh_quantization"]"#;
const CORNERS: [f64; 6] = [0.0, 1.0, 2.0, 0.0, 2.0, 3.0];
const SQUARE: [f64; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];

/// A square of which one attribute is stored in this way, and the rows that are meant.
fn square(
    key: &str,
    width: usize,
    layout: &Layout,
    rest: &str,
) -> (Result<Stage, String>, Vec<Vec<f64>>) {
    let mut file = File::default();
    let (indices, _) = file.accessor(&CORNERS, 1, &Layout { component: 5123, ..PLAIN });
    let numbers = layout.numbers();
    let numbers: Vec<f64> = (0..4 * width).map(|i| numbers[i % 12]).collect();
    let (asked, meant) = file.accessor(&numbers, width, layout);
    let mut attributes = format!(r#""{key}":{asked}"#);
    if key != "POSITION" {
        let (positions, _) = file.accessor(&SQUARE, 3, &PLAIN);
        attributes += &format!(r#","POSITION":{positions}"#);
    }
    (parse(&file.glb(&attributes, indices, rest)), meant)
}

/// Reads the attribute in all layouts: what is allowed must come to `check`, everything else is refused.
fn every_layout(
    key: &str,
    width: usize,
    [plain, quantized]: [&[(u64, bool)]; 2],
    check: impl Fn(&Stage, &[Vec<f64>]),
) {
    let mut read = 0;
    for layout in Layout::all() {
        for (rest, allowed) in [("", plain), (QUANTIZED, quantized)] {
            let (stage, meant) = square(key, width, &layout, rest);
            if layout.is_one_of(allowed) {
                check(&stage.unwrap_or_else(|error| panic!("{key} {layout:?}: {error}")), &meant);
                read += 1;
            } else {
                let error = stage.expect_err(&format!("{key} {layout:?}"));
                let place = "accessors[1].componentType: expected 5126";
                let listed = "accessors[1].componentType: expected one of [5120";
                assert!(error.contains(place) || error.contains(listed), "{error}");
                let found = format!("found {}", layout.component);
                assert!(error.contains(&found), "{error}");
            }
        }
    }
    // Floats with the word normalized and without, three ways of sparse, two of strides.
    assert_eq!(read, (2 + plain.len() + 2 + quantized.len()) * 6);
}

const SMALL: [(u64, bool); 8] = [
    (5120, false),
    (5120, true),
    (5121, false),
    (5121, true),
    (5122, false),
    (5122, true),
    (5123, false),
    (5123, true),
];
const SHARES: [(u64, bool); 2] = [(5121, true), (5123, true)];

#[test]
fn positions() {
    every_layout("POSITION", 3, [&[], &SMALL], |stage, meant| {
        let found: Vec<Vec<f64>> = stage.mesh.vertices.iter().map(|v| v.to_vec()).collect();
        assert_eq!(found, meant);
        assert_eq!(stage.mesh.faces, [[0, 1, 2], [0, 2, 3]]);
    });
}

/// What each corner of the square's faces has of a list by vertices.
fn at_corners<T: Clone>(meant: &[T]) -> Vec<[T; 3]> {
    [[0, 1, 2], [0, 2, 3]].map(|face| face.map(|i: usize| meant[i].clone())).to_vec()
}

#[test]
fn normals() {
    every_layout("NORMAL", 3, [&[], &[(5120, true), (5122, true)]], |stage, meant| {
        let unit: Vec<Vec<f64>> = meant
            .iter()
            .map(|n| {
                let length = n.iter().map(|x| x * x).sum::<f64>().sqrt();
                n.iter().map(|x| if length > 0.0 { x / length } else { 0.0 }).collect()
            })
            .collect();
        for (found, unit) in stage.normals.iter().flatten().zip(at_corners(&unit).iter().flatten())
        {
            let far = found.iter().zip(unit).map(|(a, b)| (f64::from(*a) - b).abs());
            assert!(far.fold(0.0, f64::max) < 1e-6, "{found:?} {unit:?}");
        }
    });
}

#[test]
fn texture_coordinates() {
    every_layout("TEXCOORD_0", 2, [&SHARES, &SMALL], |stage, meant| {
        let meant: Vec<[f32; 2]> = meant.iter().map(|uv| [uv[0] as f32, uv[1] as f32]).collect();
        assert_eq!(stage.uvs, at_corners(&meant));
    });
}

#[test]
fn colors() {
    for width in [3, 4] {
        every_layout("COLOR_0", width, [&SHARES, &SHARES], |stage, meant| {
            let share = |x: f64| x.clamp(0.0, 1.0) as f32;
            let meant: Vec<[f32; 3]> =
                meant.iter().map(|c| [share(c[0]), share(c[1]), share(c[2])]).collect();
            assert_eq!(stage.colors, at_corners(&meant));
        });
    }
}

#[test]
fn indices() {
    for layout in Layout::all() {
        let mut file = File::default();
        let (indices, _) = file.accessor(&CORNERS, 1, &layout);
        let (positions, _) = file.accessor(&SQUARE, 3, &PLAIN);
        let stage = parse(&file.glb(&format!(r#""POSITION":{positions}"#), indices, ""));
        // Of integers that stand for vertices the word normalized says nothing.
        if [5121, 5123, 5125].contains(&layout.component) {
            assert_eq!(stage.unwrap().mesh.faces, [[0, 1, 2], [0, 2, 3]], "{layout:?}");
        } else {
            let what = "accessors[0].componentType: expected one of [5121, 5123, 5125], found";
            let error = stage.unwrap_err();
            assert!(error.contains(what), "{error}");
        }
    }
}

/// Indices beyond 8 and 16 bits, from the end of each type's range.
#[test]
fn large_indices() {
    for (component, count) in [(5121, 256u32), (5123, 65_536), (5125, 70_000)] {
        let mut file = File::default();
        let last = f64::from(count - 1);
        let layout = Layout { component, ..PLAIN };
        let (indices, _) = file.accessor(&[last, 0.0, last - 1.0], 1, &layout);
        let numbers: Vec<f64> = (0..3 * count).map(f64::from).collect();
        let (positions, _) = file.accessor(&numbers, 3, &PLAIN);
        let mesh =
            parse(&file.glb(&format!(r#""POSITION":{positions}"#), indices, "")).unwrap().mesh;
        assert_eq!(mesh.faces, [[count - 1, 0, count - 2]]);
        assert_eq!(mesh.vertices[count as usize - 1][2], f64::from(3 * count - 1));
    }
}

/// A square with texture coordinates, sparse positions and a second buffer, of which parts are replaced by others.
fn replaced(from: &str, to: &str) -> Result<Stage, String> {
    let mut file = File::default();
    let (indices, _) = file.accessor(&CORNERS, 1, &Layout { component: 5121, ..PLAIN });
    let (positions, _) = file.accessor(&SQUARE, 3, &Layout { sparse: Sparse::Changes, ..PLAIN });
    let (uvs, _) = file.accessor(&SQUARE[..8], 2, &PLAIN);
    let attributes = format!(r#""POSITION":{positions},"TEXCOORD_0":{uvs}"#);
    let bytes = file.glb(&attributes, indices, "");
    let end = 20 + u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize;
    let json = std::str::from_utf8(&bytes[20..end]).unwrap();
    assert!(json.contains(from), "{from}\n{json}");
    parse(&glb(&json.replacen(from, to, 1), &file.bin))
}

#[test]
fn what_does_not_fit_is_refused() {
    assert!(replaced("", "").is_ok());
    let refused = |from: &str, to: &str, what: &str| {
        let error = replaced(from, to).expect_err(what);
        assert!(error.contains(what), "{error}\n{what}");
    };
    let indices =
        r#"{"componentType":5121,"normalized":false,"count":6,"type":"SCALAR","bufferView":0"#;
    let uvs = r#"{"componentType":5126,"normalized":false,"count":4,"type":"VEC2","bufferView":4"#;
    // The component type and the type.
    for code in ["5124", "5127", "0", "-1", "5126.5", "\"FLOAT\"", "null"] {
        refused(
            uvs,
            &uvs.replace("5126", code),
            "accessors[2].componentType: expected 5126, or 5121 or 5123 normalized, or integers with KHR_mesh_quantization, found",
        );
    }
    for shape in ["SCALAR", "VEC3", "VEC4", "MAT2", "vec2", ""] {
        let what = format!("accessors[2].type: expected VEC2, found \"{shape}\"");
        refused(uvs, &uvs.replace("VEC2", shape), &what);
    }
    refused(indices, &indices.replace("SCALAR", "VEC2"), "accessors[0].type: expected SCALAR");
    // Counts.
    refused(
        uvs,
        &uvs.replace("\"count\":4", "\"count\":5"),
        "accessors[2]: expected 5 elements within the 32 bytes of bufferViews[4], found 40 bytes needed",
    );
    refused(
        uvs,
        &uvs.replace("\"count\":4", "\"count\":3"),
        "TEXCOORD_0: expected 4 of them, as there are positions, found 3",
    );
    refused(
        uvs,
        &uvs.replace("\"count\":4", "\"count\":-4"),
        "accessors[2].count: expected an integer, 0 or more",
    );
    refused(
        indices,
        &indices.replace("\"count\":6", "\"count\":5"),
        "expected three vertices a triangle, found 5",
    );
    refused(
        r#""bufferView":4"#,
        r#""bufferView":5"#,
        "accessors[2].bufferView: expected one of the 5 bufferViews, found 5",
    );
    refused(
        r#""bufferView":4,"byteOffset":0"#,
        r#""bufferView":4,"byteOffset":4"#,
        "accessors[2]: expected 4 elements within the 32 bytes of bufferViews[4]",
    );
    // Zeros, more than any file of this size would tell of.
    refused(
        r#""count":6,"type":"SCALAR","bufferView":0,"byteOffset":0"#,
        r#""count":99999999,"type":"SCALAR""#,
        "accessors[0].count: expected at most 65536, found 99999999",
    );
    // Views and strides.
    refused(r#""byteLength":32}"#, r#""byteLength":36}"#, "bufferViews[4]: expected 36 bytes from");
    refused(
        r#""byteLength":32}"#,
        r#""byteLength":32,"byteStride":4}"#,
        "bufferViews[4].byteStride: expected at least 8, found 4",
    );
    refused(
        r#""byteLength":32}"#,
        r#""byteLength":32,"byteStride":12}"#,
        "accessors[2]: expected 4 elements within the 32 bytes of bufferViews[4], found 44 bytes needed",
    );
    refused(
        r#""byteLength":32}"#,
        r#""byteLength":32,"byteStride":0}"#,
        "byteStride: expected at least 8, found 0",
    );
    refused(
        r#"{"buffer":0,"byteOffset":0"#,
        r#"{"buffer":1,"byteOffset":0"#,
        "bufferViews[0].buffer: expected one of the 1 buffers, found 1",
    );
    // Sparse ones.
    let sparse = r#""sparse":{"count":2,"indices":{"bufferView":2,"componentType":5125}"#;
    for code in ["5120", "5122", "5126"] {
        refused(
            sparse,
            &sparse.replace("5125", code),
            "accessors[1].sparse.indices.componentType: expected one of [5121, 5123, 5125], found",
        );
    }
    refused(
        sparse,
        &sparse.replace("\"count\":2", "\"count\":3"),
        "accessors[1].sparse.indices: expected 3 elements within the 8 bytes of bufferViews[2]",
    );
    refused(
        r#""values":{"bufferView":3"#,
        r#""values":{"bufferView":2"#,
        "accessors[1].sparse.values: expected 2 elements within the 8 bytes",
    );
    refused(
        r#""values":{"bufferView":3"#,
        r#""values":{"n":3"#,
        "accessors[1].sparse.values.bufferView: expected one of the 5 bufferViews",
    );
    // Positions 1 and 3 are replaced; as bytes the indices are 1 and 0, then 1 and 0 again.
    refused(
        sparse,
        &sparse.replace("5125", "5121"),
        "accessors[1].sparse.indices: expected rising numbers of elements, 2 or more, found 0",
    );
    refused(
        r#""count":4,"type":"VEC3""#,
        r#""count":3,"type":"VEC3""#,
        "accessors[1].sparse.indices: expected elements below 3, found 3",
    );
}

/// Other readers and writers do not keep to the alignment of section 3.6.2.4; what is meant is certain all the same.
#[test]
fn offsets_that_are_not_aligned() {
    let mut bin = vec![9; 3];
    bin.extend(SQUARE.iter().flat_map(|&x| (x as f32).to_le_bytes()));
    let json = r#"{"asset":{"version":"2.0"},"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"componentType":5126,"count":3,"type":"VEC3","bufferView":0,"byteOffset":2}],
        "bufferViews":[{"buffer":0,"byteOffset":1,"byteLength":50}],"buffers":[{"byteLength":51}]}"#;
    let mesh = parse(&glb(json, &bin)).unwrap().mesh;
    assert_eq!(mesh.vertices, [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]);
}

/// Buffers without bytes matter to those alone who read them.
#[test]
fn buffers_without_bytes() {
    let bin: Vec<u8> = SQUARE.iter().flat_map(|&x| (x as f32).to_le_bytes()).collect();
    let json = |buffer: usize| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
            "accessors":[{{"componentType":5126,"count":3,"type":"VEC3","bufferView":1}}],
            "bufferViews":[{{"buffer":1,"byteLength":9}},{{"buffer":{buffer},"byteLength":36}}],
            "buffers":[{{"byteLength":48}},{{"byteLength":1000,"name":"a fallback"}}]}}"#
        )
    };
    assert_eq!(parse(&glb(&json(0), &bin)).unwrap().mesh.faces, [[0, 1, 2]]);
    let error = parse(&glb(&json(1), &bin)).unwrap_err();
    let what =
        "buffers[1]: expected a uri or a binary chunk, since bufferViews[1] uses it, found neither";
    assert!(error.contains(what), "{error}");
    // Nor has the first one any without a chunk.
    let error = parse(json(0).as_bytes()).unwrap_err();
    assert!(error.contains("buffers[0]: expected a uri or a binary chunk"), "{error}");
}
