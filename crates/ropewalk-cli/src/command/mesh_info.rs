//! `ropewalk info FILE` of scenes and meshes that are not saved ones.

use crate::interrupt::{self, Cancel};
use crate::output::{print_json, print_text, thousands};
use anyhow::Context;
use ropewalk_scene::room::room;
use ropewalk_scene::stage::Light;
use ropewalk_scene::{
    Builtin, Camera, Defects, FacetPolicy, Loaded, MeshFormat, MeshLimits, NffLimits, Recognised,
    Scene, Stage, Surface, load_monitored, parse_builtin, recognise,
};
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

#[derive(Serialize)]
struct MeshOutput {
    file: String,
    kind: &'static str,
    format: &'static str,
    vertices: usize,
    triangles: usize,
    meshes: usize,
    placements: usize,
    bounds: Option<[[f64; 3]; 2]>,
    normals: bool,
    texture_coordinates: bool,
    colors: bool,
    materials: Vec<MaterialOutput>,
    textures: Vec<[u32; 2]>,
    lights: LightCounts,
    camera: Option<CameraOutput>,
    skipped: Vec<String>,
    closed: bool,
    defects: DefectCounts,
    seconds: Seconds,
}

#[derive(Serialize)]
struct MaterialOutput {
    name: String,
    triangles: usize,
}

#[derive(Default, Serialize)]
struct LightCounts {
    point: usize,
    spot: usize,
    directional: usize,
}

#[derive(Serialize)]
struct CameraOutput {
    from: [f64; 3],
    at: [f64; 3],
    up: [f64; 3],
    angle: f64,
}

#[derive(Serialize)]
struct DefectCounts {
    equal_vertices: usize,
    isolated_vertices: usize,
    degenerate_triangles: usize,
    duplicate_triangles: usize,
    boundary_edges: usize,
    boundary_loops: usize,
    non_manifold_edges: usize,
    turned_edges: usize,
}

#[derive(Serialize)]
struct Seconds {
    read: f64,
    check: f64,
}

#[derive(Serialize)]
struct SceneOutput {
    file: String,
    kind: &'static str,
    format: &'static str,
    objects: usize,
    spheres: usize,
    cones: usize,
    polygons: usize,
    patches: usize,
    bounds: Option<[[f32; 3]; 2]>,
    materials: usize,
    lights: usize,
    camera: Option<CameraOutput>,
}

impl From<&Camera> for CameraOutput {
    fn from(&Camera { from, at, up, angle, .. }: &Camera) -> Self {
        CameraOutput { from, at, up, angle }
    }
}

impl From<&Defects> for DefectCounts {
    fn from(defects: &Defects) -> Self {
        DefectCounts {
            equal_vertices: defects.equal_vertices,
            isolated_vertices: defects.isolated_vertices,
            degenerate_triangles: defects.degenerate_faces,
            duplicate_triangles: defects.duplicate_faces,
            boundary_edges: defects.boundary_edges,
            boundary_loops: defects.boundary_loops,
            non_manifold_edges: defects.non_manifold_edges,
            turned_edges: defects.turned_edges,
        }
    }
}

/// Reads and prints a scene or a mesh.
pub fn run(file: &str, json: bool) -> anyhow::Result<()> {
    let cancel = Cancel::new();
    let builtin = parse_builtin(file)?;
    let mesh = if let Some(Builtin::Room(size)) = builtin {
        let made = || room(size).with_context(|| format!("{file}: there is no room of that size"));
        Some(read_mesh(file, "generated", &cancel, made)?)
    } else if builtin.is_none()
        && let Recognised::Mesh(format) = recognise(file)?
    {
        let read = || Ok(Stage::read_monitored(Path::new(file), &MeshLimits::DEFAULT, &cancel)?);
        Some(read_mesh(file, name(format), &cancel, read)?)
    } else {
        None
    };
    if let Some(output) = mesh {
        return if json { print_json(&output) } else { output.print() };
    }
    let loaded = load_monitored(file, &NffLimits::default(), &cancel);
    if cancel.is_set() {
        return Err(interrupt::interrupted());
    }
    let scene = match loaded? {
        Loaded::Scene(scene) => scene,
        mesh => mesh.into_scene(),
    };
    let output = SceneOutput::new(file, &scene);
    if json { print_json(&output) } else { output.print() }
}

fn read_mesh(
    file: &str,
    format: &'static str,
    cancel: &Cancel,
    read: impl FnOnce() -> anyhow::Result<Stage>,
) -> anyhow::Result<MeshOutput> {
    let bar = interrupt::spinner("reading");
    let start = Instant::now();
    let stage = read();
    let read = start.elapsed().as_secs_f64();
    bar.set_message("checking");
    if cancel.is_set() {
        return Err(interrupt::interrupted());
    }
    let stage = stage?;
    let defects = stage.mesh.defects(cancel).ok_or_else(interrupt::interrupted)?;
    bar.finish_and_clear();
    let seconds = Seconds { read, check: start.elapsed().as_secs_f64() - read };
    Ok(MeshOutput::new(file, format, &stage, &defects, seconds))
}

fn name(format: MeshFormat) -> &'static str {
    match format {
        MeshFormat::Obj => "OBJ",
        MeshFormat::Ply => "PLY",
        MeshFormat::Stl => "STL",
        MeshFormat::Off => "OFF",
        MeshFormat::Gltf => "glTF",
    }
}

impl MeshOutput {
    fn new(
        file: &str,
        format: &'static str,
        stage: &Stage,
        defects: &Defects,
        seconds: Seconds,
    ) -> Self {
        let mut counts = vec![0; stage.materials.len()];
        match &stage.material[..] {
            [] => counts[0] = stage.mesh.faces.len(),
            all => all.iter().for_each(|&material| counts[material as usize] += 1),
        }
        let material = |(material, &triangles): (&ropewalk_scene::stage::Material, &usize)| {
            MaterialOutput { name: material.name.clone(), triangles }
        };
        let mut lights = LightCounts::default();
        for light in &stage.lights {
            match light {
                Light::Point { .. } => lights.point += 1,
                Light::Spot { .. } => lights.spot += 1,
                Light::Directional { .. } => lights.directional += 1,
            }
        }
        MeshOutput {
            file: file.to_owned(),
            kind: "mesh",
            format,
            vertices: stage.mesh.vertices.len(),
            triangles: stage.mesh.faces.len(),
            meshes: stage.meshes,
            placements: stage.placements,
            bounds: bounds(&stage.mesh.vertices),
            normals: !stage.normals.is_empty(),
            texture_coordinates: !stage.uvs.is_empty(),
            colors: !stage.colors.is_empty(),
            materials: stage.materials.iter().zip(&counts).map(material).collect(),
            textures: stage.images.iter().map(|image| [image.width, image.height]).collect(),
            lights,
            camera: stage.camera.as_ref().map(CameraOutput::from),
            skipped: stage.skipped.clone(),
            closed: defects.is_closed(),
            defects: defects.into(),
            seconds,
        }
    }

    fn print(&self) -> anyhow::Result<()> {
        let mut out = String::new();
        let count = |out: &mut String, what: &str, number: usize| {
            writeln!(out, "  {what:22}{:>12}", thousands(number as u64))
        };
        writeln!(out, "{}: a mesh in {}", self.file, self.format)?;
        count(&mut out, "triangles", self.triangles)?;
        count(&mut out, "vertices", self.vertices)?;
        if self.placements > 1 {
            count(&mut out, "meshes", self.meshes)?;
            count(&mut out, "  placed", self.placements)?;
        }
        if let Some([low, high]) = &self.bounds {
            writeln!(out, "  box                   {low:?} to {high:?}")?;
        }
        let has = [
            (self.normals, "normals"),
            (self.texture_coordinates, "texture coordinates"),
            (self.colors, "colours"),
        ];
        let has: Vec<&str> = has.iter().filter(|(has, _)| *has).map(|(_, what)| *what).collect();
        if !has.is_empty() {
            writeln!(out, "  has                   {}", has.join(", "))?;
        }
        count(&mut out, "materials", self.materials.len())?;
        for material in self.materials.iter().filter(|material| !material.name.is_empty()) {
            writeln!(
                out,
                "    {:<30} {:>10}",
                material.name.escape_debug().to_string(),
                thousands(material.triangles as u64)
            )?;
        }
        count(&mut out, "textures", self.textures.len())?;
        let LightCounts { point, spot, directional } = &self.lights;
        count(&mut out, "lights", point + spot + directional)?;
        if let Some(CameraOutput { from, at, angle, .. }) = &self.camera {
            writeln!(out, "  camera                from {from:?} to {at:?}, {angle:.1} degrees")?;
        }
        for what in &self.skipped {
            writeln!(out, "  not read              {what}")?;
        }
        let closed = if self.closed { "closed, turned alike everywhere" } else { "not closed" };
        writeln!(out, "  surface               {closed}")?;
        let defects = &self.defects;
        count(&mut out, "degenerate triangles", defects.degenerate_triangles)?;
        count(&mut out, "duplicate triangles", defects.duplicate_triangles)?;
        count(&mut out, "boundary edges", defects.boundary_edges)?;
        count(&mut out, "  in loops", defects.boundary_loops)?;
        count(&mut out, "non-manifold edges", defects.non_manifold_edges)?;
        count(&mut out, "turned edges", defects.turned_edges)?;
        count(&mut out, "isolated vertices", defects.isolated_vertices)?;
        if defects.equal_vertices > 0 {
            writeln!(
                out,
                "  {} vertices lie at the place of another one and count as that in the figures of edges and triangles",
                thousands(defects.equal_vertices as u64)
            )?;
        }
        writeln!(
            out,
            "  read in {:.2} s, checked in {:.2} s",
            self.seconds.read, self.seconds.check
        )?;
        print_text(&out)
    }
}

fn bounds(vertices: &[[f64; 3]]) -> Option<[[f64; 3]; 2]> {
    let first = *vertices.first()?;
    let mut corners = [first; 2];
    for vertex in vertices {
        for axis in 0..3 {
            corners[0][axis] = corners[0][axis].min(vertex[axis]);
            corners[1][axis] = corners[1][axis].max(vertex[axis]);
        }
    }
    Some(corners)
}

impl SceneOutput {
    fn new(file: &str, scene: &Scene) -> Self {
        let count =
            |is: fn(&Surface) -> bool| scene.objects.iter().filter(|o| is(&o.surface)).count();
        let geometry = scene.geometry(FacetPolicy::TwoSided).ok().filter(|g| !g.is_empty());
        SceneOutput {
            file: file.to_owned(),
            kind: "scene",
            format: "NFF",
            objects: scene.objects.len(),
            spheres: count(|s| matches!(s, Surface::Sphere { .. })),
            cones: count(|s| matches!(s, Surface::Cone(_))),
            polygons: count(|s| matches!(s, Surface::Polygon(_))),
            patches: count(|s| matches!(s, Surface::Patch { .. })),
            bounds: geometry.map(|g| [g.bounds().min, g.bounds().max]),
            materials: scene.materials.len(),
            lights: scene.lights.len(),
            camera: scene.camera.as_ref().map(CameraOutput::from),
        }
    }

    fn print(&self) -> anyhow::Result<()> {
        let mut out = String::new();
        writeln!(out, "{}: a scene in NFF", self.file)?;
        let counts = [
            ("objects", self.objects),
            ("  spheres", self.spheres),
            ("  cones", self.cones),
            ("  polygons", self.polygons),
            ("  patches", self.patches),
            ("materials", self.materials),
            ("lights", self.lights),
        ];
        for (what, number) in counts {
            writeln!(out, "  {what:22}{:>12}", thousands(number as u64))?;
        }
        if let Some([low, high]) = &self.bounds {
            writeln!(out, "  box                   {low:?} to {high:?}")?;
        }
        if let Some(CameraOutput { from, at, angle, .. }) = &self.camera {
            writeln!(out, "  camera                from {from:?} to {at:?}, {angle:.1} degrees")?;
        }
        print_text(&out)
    }
}
