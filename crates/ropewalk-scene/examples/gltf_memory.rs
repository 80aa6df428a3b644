//! Time and memory of reading glTF, on files that it makes itself (docs/formats.md):
//!
//! ```text
//! gltf_memory make FILE            2,000,000 triangles in one mesh
//! gltf_memory make-placed FILE     5,000 triangles, placed 10,000 times by nodes
//! gltf_memory read FILE            reads positions and faces, moved by nodes
//! gltf_memory place FILE           reads meshes and placements
//! gltf_memory dress FILE           reads looks too
//! ```
//!
//! Prints seconds, and the largest resident memory of the process where the system tells it (Linux).

use ropewalk_scene::{Mesh, MeshLimits, MeshOutput, PlacedMeshes, Stage};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [task, path] = &arguments[..] else { return Err("expected a task and a file".into()) };
    let (path, limits) = (Path::new(path), MeshLimits::DEFAULT);
    let start = Instant::now();
    match task.as_str() {
        "make" => sheet(1000).write(MeshOutput::Glb, &mut BufWriter::new(File::create(path)?))?,
        "make-placed" => make_placed(path)?,
        "place" => {
            let placed = PlacedMeshes::read(path, &limits)?;
            println!("{} placements of {} meshes", placed.placements.len(), placed.meshes.len());
            placed.meshes.iter().for_each(said);
        }
        "read" => said(&Mesh::read(path, &limits)?),
        "dress" => said(&Stage::read_monitored(path, &limits, &())?.mesh),
        other => {
            return Err(
                format!("expected make, make-placed, read, place or dress, found {other}").into()
            );
        }
    }
    println!("{:.2} s, at most {}", start.elapsed().as_secs_f64(), resident());
    Ok(())
}

fn said(mesh: &Mesh) {
    let bytes = size_of_val(&mesh.vertices[..]) + size_of_val(&mesh.faces[..]);
    println!(
        "{} triangles, {} vertices: {:.1} MB",
        mesh.faces.len(),
        mesh.vertices.len(),
        bytes as f64 / 1e6
    );
}

/// A wavy sheet of `n` times `n` squares, two triangles each.
fn sheet(n: u32) -> Mesh {
    let side = n + 1;
    let height = |i: u32| (f64::from(i) * 0.05).sin();
    let vertices = (0..side * side).map(|i| (i % side, i / side));
    let vertices = vertices.map(|(x, y)| [f64::from(x), f64::from(y), height(x) * height(y)]);
    let corner = |i: u32| i / n * side + i % n;
    let faces = (0..n * n).map(corner).flat_map(|a| {
        let (b, c, d) = (a + 1, a + side, a + side + 1);
        [[a, b, d], [a, d, c]]
    });
    Mesh { vertices: vertices.collect(), faces: faces.collect() }
}

/// The sheet of 50 times 50 squares on a grid of 100 times 100 nodes, each turned and scaled.
fn make_placed(path: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let mesh = sheet(50);
    let floats = mesh.vertices.iter().flatten().flat_map(|&x| (x as f32).to_le_bytes());
    let mut bin: Vec<u8> = floats.collect();
    let split = bin.len();
    bin.extend(mesh.faces.iter().flatten().flat_map(|i| i.to_le_bytes()));
    let node = |i: u32| {
        let (x, y, half) = (60 * (i % 100), 60 * (i / 100), 0.5 * f64::from(i % 628) * 0.01);
        let (sin, cos) = half.sin_cos();
        let scale = 0.5 + f64::from(i % 7) * 0.1;
        format!(
            r#"{{"mesh":0,"translation":[{x},{y},0],"rotation":[0,0,{sin},{cos}],"scale":[{scale},{scale},1]}}"#
        )
    };
    let nodes: Vec<String> = (0..10_000).map(node).collect();
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{}],
        "meshes":[{{"primitives":[{{"indices":1,"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{},"type":"VEC3"}},
        {{"bufferView":1,"componentType":5125,"count":{},"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":{split}}},
        {{"buffer":0,"byteOffset":{split},"byteLength":{}}}],
        "buffers":[{{"byteLength":{}}}]}}"#,
        nodes.join(","),
        mesh.vertices.len(),
        3 * mesh.faces.len(),
        bin.len() - split,
        bin.len()
    );
    json += &" ".repeat(json.len().next_multiple_of(4) - json.len());
    let mut out = BufWriter::new(File::create(path)?);
    out.write_all(b"glTF")?;
    for word in [2, 28 + json.len() + bin.len(), json.len()] {
        out.write_all(&(word as u32).to_le_bytes())?;
    }
    out.write_all(b"JSON")?;
    out.write_all(json.as_bytes())?;
    out.write_all(&(bin.len() as u32).to_le_bytes())?;
    out.write_all(b"BIN\0")?;
    out.write_all(&bin)?;
    Ok(out.flush()?)
}

/// The largest resident memory so far.
fn resident() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.trim().strip_suffix(" kB")?.trim().parse().ok());
    kilobytes.map_or("memory unknown".into(), |kb: f64| format!("{:.0} MB", kb * 1024.0 / 1e6))
}
