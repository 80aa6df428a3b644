//! `ropewalk render MESH`: pictures of paths.

use super::render::Args;
use crate::engine::{self, Watch};
use crate::interrupt;
use crate::output::{Tree, print_json, thousands, usage};
use anyhow::Context;
use ropewalk::build::{BuildSettings, Preset};
use ropewalk::wide::WideTree;
use ropewalk_render::path::{
    Backdrop, Development, Environment, Lens, PathCounts, PathRender, PathSettings, Surroundings,
    Tone, Up, World, fitted_camera, is_whole_picture, orbited, swept, tessellated, trace_paths,
    write_film,
};
use ropewalk_render::{ImageFormat, Monitor, Progress, check_image_path};
use ropewalk_scene::room::room;
use ropewalk_scene::{
    Builtin, Camera, Loaded, MeshFormat, MeshLimits, NffLimits, Recognised, Stage, parse_builtin,
    recognise,
};
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Parallels of spheres of NFF scenes: silhouettes stay round at usual sizes.
const SPHERE_STEPS: u32 = 24;

/// Options of pictures of paths.
#[derive(clap::Args)]
#[command(next_help_heading = "Paths")]
pub struct Options {
    /// Follow paths of light, as for mesh files, also in NFF files and built-in scenes
    #[arg(long)]
    pub path: bool,
    /// Seconds after which the picture is written with the samples that it has; of each frame of a turntable
    #[arg(long, value_parser = positive)]
    seconds: Option<f64>,
    /// Noise differs between seeds
    #[arg(long)]
    seed: Option<u32>,
    /// Brightness of a PNG in stops; 0 under the sky, else the mean becomes mid-grey
    #[arg(long, allow_hyphen_values = true, value_parser = finite)]
    exposure: Option<f64>,
    /// Tone curve of a PNG: agx or clip
    #[arg(long)]
    tone: Option<String>,
    /// Light from a picture of all directions, .hdr or .exr, in place of the sky
    #[arg(long, value_name = "FILE", conflicts_with = "no_sky")]
    environment: Option<PathBuf>,
    /// A sky and a sun also for files with lights of their own
    #[arg(long, conflicts_with_all = ["no_sky", "environment"])]
    sky: bool,
    /// No light but the file's
    #[arg(long)]
    no_sky: bool,
    /// Ground also for files with a camera or lights of their own
    #[arg(long, conflicts_with = "no_ground")]
    ground: bool,
    /// No ground below the mesh
    #[arg(long)]
    no_ground: bool,
    /// The axis that points up, y or z; z of STL and NFF files and built-in scenes, else y
    #[arg(long)]
    up: Option<String>,
    /// Place of the camera, X,Y,Z; needs --at
    #[arg(long, allow_hyphen_values = true, value_parser = point, requires = "at")]
    from: Option<[f64; 3]>,
    /// Point that the camera looks at, X,Y,Z; needs --from
    #[arg(long, allow_hyphen_values = true, value_parser = point, requires = "from")]
    at: Option<[f64; 3]>,
    /// Full view angle across in degrees
    #[arg(long, value_parser = positive)]
    angle: Option<f64>,
    /// Diameter of the lens in units of the scene
    #[arg(long, value_parser = positive)]
    aperture: Option<f64>,
    /// Distance in focus in units of the scene, needs --aperture; that of the point looked at if not given
    #[arg(long, value_parser = positive, requires = "aperture")]
    focus: Option<f64>,
    /// Largest luminance of light that bounced; darkens glass and corners, but takes away bright specks
    #[arg(long, value_parser = positive)]
    clamp: Option<f64>,
    /// So many frames NAME.0000.png and on, once around; frames that are there already are kept
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=9999))]
    turntable: Option<u32>,
}

impl Options {
    /// The first option given.
    pub fn given(&self) -> Option<&'static str> {
        let options = [
            (self.seconds.is_some(), "--seconds"),
            (self.seed.is_some(), "--seed"),
            (self.exposure.is_some(), "--exposure"),
            (self.tone.is_some(), "--tone"),
            (self.environment.is_some(), "--environment"),
            (self.sky, "--sky"),
            (self.no_sky, "--no-sky"),
            (self.ground, "--ground"),
            (self.no_ground, "--no-ground"),
            (self.up.is_some(), "--up"),
            (self.from.is_some(), "--from"),
            (self.angle.is_some(), "--angle"),
            (self.aperture.is_some(), "--aperture"),
            (self.focus.is_some(), "--focus"),
            (self.clamp.is_some(), "--clamp"),
            (self.turntable.is_some(), "--turntable"),
        ];
        options.into_iter().find(|(given, _)| *given).map(|(_, name)| name)
    }

    /// The first option given that changes a PNG alone.
    fn of_png(&self) -> Option<&'static str> {
        let options = [(self.exposure.is_some(), "--exposure"), (self.tone.is_some(), "--tone")];
        options.into_iter().find(|(given, _)| *given).map(|(_, name)| name)
    }

    fn up(&self, is_z: bool) -> anyhow::Result<Up> {
        Ok(match self.up.as_deref() {
            None if is_z => Up::Z,
            None | Some("y") => Up::Y,
            Some("z") => Up::Z,
            Some(other) => {
                return Err(usage(format!("no axis '{other}' can point up; there are: y, z")));
            }
        })
    }

    fn tone(&self) -> anyhow::Result<Tone> {
        let Some(name) = self.tone.as_deref() else { return Ok(Tone::default()) };
        Tone::ALL.into_iter().find(|t| t.name() == name).ok_or_else(|| {
            let names = Tone::ALL.map(Tone::name).join(", ");
            usage(format!("no tone curve is called '{name}'; there are: {names}"))
        })
    }

    fn surroundings(&self, stage: &Stage, up: Up) -> anyhow::Result<Surroundings> {
        let mut around = Surroundings::of(stage, up);
        if let Some(path) = &self.environment {
            around.backdrop = Backdrop::Environment(Environment::read(path)?);
        } else if self.sky {
            around.backdrop = Backdrop::Sky;
        } else if self.no_sky {
            around.backdrop = Backdrop::None;
        }
        around.ground = (around.ground || self.ground) && !self.no_ground;
        Ok(around)
    }

    fn camera(&self, stage: &Stage, size: Option<[u32; 2]>, up: Up) -> Camera {
        let own = stage.camera.map_or(PathSettings::default().size, |camera| camera.resolution);
        let size = size.unwrap_or(own);
        let mut camera = match (self.from.zip(self.at), stage.camera) {
            (Some((from, at)), _) => {
                let [_, _, above] = up.axes();
                Camera { from, at, up: above, angle: 60.0, hither: 0.0, resolution: size }
            }
            (None, Some(camera)) => Camera { resolution: size, ..camera },
            (None, None) if self.turntable.is_some() => {
                fitted_camera(&swept(&stage.mesh, up), size, up)
            }
            (None, None) => fitted_camera(&stage.mesh.vertices, size, up),
        };
        camera.angle = self.angle.unwrap_or(camera.angle);
        camera
    }
}

fn finite(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| "expected a number".into())
}

fn positive(text: &str) -> Result<f64, String> {
    finite(text).ok().filter(|x| *x >= 0.0).ok_or_else(|| "expected a number from 0 on".into())
}

fn point(text: &str) -> Result<[f64; 3], String> {
    let parts: Result<Vec<f64>, _> = text.split(',').map(finite).collect();
    parts
        .ok()
        .and_then(|p| <[f64; 3]>::try_from(p).ok())
        .ok_or_else(|| "expected three numbers such as 1,0,-2.5".into())
}

#[derive(Serialize)]
struct Output {
    scene: String,
    method: &'static str,
    pictures: Vec<String>,
    /// Frames that were there already.
    kept: usize,
    size: [u32; 2],
    samples: u32,
    rays: PathRays,
    /// Share of the threads' time that is spent in the batch engine.
    traversal_share: f64,
    /// Millions of rays a second, all work included.
    mrays: f64,
    /// Millions of rays a second and thread within the batch engine.
    traversal_mrays: f64,
    tree: Tree,
    seconds: Seconds,
}

#[derive(Default, Serialize)]
struct PathRays {
    primary: u64,
    primary_hits: u64,
    bounce: u64,
    bounce_hits: u64,
    shadow: u64,
    shadow_hits: u64,
}

#[derive(Serialize)]
struct Seconds {
    read: f64,
    build: f64,
    trace: f64,
}

/// Renders a mesh, or an NFF scene as triangles, and writes the pictures.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let options = &args.paths;
    let tone = options.tone()?;
    let start = Instant::now();
    let (stage, is_z) = read(&args.scene)?;
    let up = options.up(is_z)?;
    let name = stage.name.clone();
    let picture =
        args.output.clone().unwrap_or_else(|| format!("{}.png", name.replace(':', "_")).into());
    let format = check_image_path(&picture)?;
    if format == ImageFormat::Exr
        && let Some(name) = options.of_png()
    {
        return Err(usage(format!("{name} is for PNG: an EXR file has the light as it is")));
    }
    let around = options.surroundings(&stage, up)?;
    if around.is_dark(&stage) {
        let scene = &args.scene;
        eprintln!(
            "ropewalk: {scene}: nothing shines, the picture will be black; leave out --no-sky"
        );
    }
    let camera = options.camera(&stage, args.size, up);
    // Inside, the sky is no measure of what is seen.
    let is_lit_by_sky = matches!(around.backdrop, Backdrop::Sky) && !stage.daylight;
    let exposure = options.exposure.map(|x| x as f32).or(is_lit_by_sky.then_some(0.0));
    let settings = PathSettings {
        size: camera.resolution,
        samples: args.samples.unwrap_or(if options.seconds.is_some() { 1 << 24 } else { 64 }),
        seconds: options.seconds,
        max_depth: args.depth.unwrap_or(PathSettings::default().max_depth),
        seed: options.seed.unwrap_or(0),
        threads: (args.threads > 0).then_some(args.threads),
        lens: Lens { aperture: options.aperture.unwrap_or(0.0), focus: options.focus },
        clamp: options.clamp.map(|x| x as f32),
        walk_costs: format == ImageFormat::Exr,
        ..PathSettings::default()
    };
    let world = World::new(stage, &around).with_context(|| args.scene.clone())?;
    let read_seconds = start.elapsed().as_secs_f64();
    let build = BuildSettings { threads: args.threads, ..BuildSettings::preset(Preset::Balanced) };
    let (tree, report) = engine::build_wide(world.geometry(), &build)?;
    let mut job = Job {
        world,
        tree,
        up,
        settings,
        development: Development { exposure, tone },
        counts: PathCounts::default(),
        seconds: 0.0,
        samples: 0,
        pictures: Vec::new(),
        kept: 0,
    };
    match options.turntable {
        None => job.picture(&camera, &picture)?,
        Some(frames) => job.turntable(&camera, &picture, frames)?,
    }
    let c = &job.counts;
    let mrays = |seconds: f64| c.rays() as f64 / seconds.max(1e-9) / 1e6;
    let output = Output {
        scene: name,
        method: "paths",
        pictures: job.pictures,
        kept: job.kept,
        size: settings.size,
        samples: job.samples,
        rays: PathRays {
            primary: c.camera,
            primary_hits: c.camera_hits,
            bounce: c.bounce,
            bounce_hits: c.bounce_hits,
            shadow: c.shadow,
            shadow_hits: c.shadow_hits,
        },
        traversal_share: c.traversal_share(),
        mrays: mrays(job.seconds),
        traversal_mrays: mrays(c.seconds_traversal),
        tree: Tree::new(&report, job.tree.bytes() as u64),
        seconds: Seconds { read: read_seconds, build: report.seconds, trace: job.seconds },
    };
    if args.json { print_json(&output) } else { print_text(&output) }
}

/// A stage from a mesh file, or from an NFF scene as triangles; whether `z` is up in files of its kind.
fn read(spec: &str) -> anyhow::Result<(Stage, bool)> {
    let builtin = parse_builtin(spec)?;
    if let Some(Builtin::Room(size)) = builtin {
        let wrong = || usage(format!("{spec}: there is no room of that size"));
        return Ok((room(size).ok_or_else(wrong)?, false));
    }
    if builtin.is_none()
        && let Recognised::Mesh(format) = recognise(spec)?
    {
        let bar = interrupt::bar(1000, "read");
        let watch = Watch { cancel: interrupt::flag(), bar: &bar };
        let stage = Stage::read_monitored(Path::new(spec), &MeshLimits::DEFAULT, &watch);
        bar.finish_and_clear();
        if interrupt::flag().load(std::sync::atomic::Ordering::Relaxed) {
            return Err(interrupt::interrupted());
        }
        let stage = stage?;
        for sentence in &stage.skipped {
            eprintln!("ropewalk: {spec}: {sentence}");
        }
        return Ok((stage, format == MeshFormat::Stl));
    }
    match ropewalk_scene::load(spec, &NffLimits::default())? {
        Loaded::Scene(scene) => Ok((tessellated(&scene, SPHERE_STEPS), true)),
        Loaded::Mesh(name, mesh) => Ok((Stage::of_mesh(name, mesh), false)),
    }
}

/// Pictures of one world.
struct Job {
    world: World,
    tree: WideTree,
    up: Up,
    settings: PathSettings,
    development: Development,
    counts: PathCounts,
    seconds: f64,
    samples: u32,
    pictures: Vec<String>,
    kept: usize,
}

impl Job {
    fn picture(&mut self, camera: &Camera, path: &Path) -> anyhow::Result<()> {
        let done = self.trace(camera, "render")?;
        let samples = done.film.samples();
        if samples == 0 {
            return Err(interrupt::interrupted());
        }
        write_film(path, &done.film, &self.development)?;
        self.pictures.push(path.display().to_string());
        if done.cancelled {
            let wanted = self.settings.samples;
            let path = path.display();
            anyhow::bail!("interrupted; {path} has {samples} of {wanted} samples a pixel");
        }
        Ok(())
    }

    /// Frames that are there are kept; a frame is written with all its samples or not at all.
    fn turntable(&mut self, camera: &Camera, path: &Path, frames: u32) -> anyhow::Result<()> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("png");
        let name = |frame: u32| path.with_extension(format!("{frame:04}.{extension}"));
        let size = self.settings.size;
        for frame in 0..frames {
            let place = name(frame);
            if is_whole_picture(&place, size) {
                self.kept += 1;
                continue;
            }
            let turn = 360.0 * f64::from(frame) / f64::from(frames);
            self.world.turn_sky(self.up, turn);
            let done = self.trace(&orbited(camera, self.up, turn), "frame")?;
            if done.cancelled {
                let there = (0..frames).filter(|&i| is_whole_picture(&name(i), size)).count();
                anyhow::bail!(
                    "interrupted; {there} of {frames} frames are there, run again to go on"
                );
            }
            write_film(&place, &done.film, &self.development)?;
            self.pictures.push(place.display().to_string());
        }
        Ok(())
    }

    fn trace(&mut self, camera: &Camera, what: &'static str) -> anyhow::Result<PathRender> {
        let bar = interrupt::bar(1000, what);
        let flag = interrupt::flag();
        let limit = self.settings.seconds;
        let start = Instant::now();
        let progress = |p: Progress| {
            let of_samples = p.done as f64 / p.total as f64;
            let of_time = limit.map_or(0.0, |limit| start.elapsed().as_secs_f64() / limit);
            bar.set_position((1000.0 * of_samples.max(of_time)).min(1000.0) as u64);
        };
        let monitor = Monitor { progress: Some(&progress), cancel: Some(&flag) };
        let each = &mut |_: &_| ControlFlow::Continue(());
        let done = trace_paths(&self.world, &self.tree, camera, &self.settings, monitor, each)?;
        bar.finish_and_clear();
        self.counts += &done.counts;
        self.seconds += done.seconds;
        self.samples = done.film.samples();
        Ok(done)
    }
}

fn print_text(o: &Output) -> anyhow::Result<()> {
    let pictures = match &o.pictures[..] {
        [] => "all frames were there".to_owned(),
        [one] => one.clone(),
        [first, .., last] => format!("{first} to {last}"),
    };
    say!("{}, paths: {pictures}", o.scene);
    let [width, height] = o.size;
    say!("  {width} x {height} pixels, {} samples each", o.samples);
    let r = &o.rays;
    say!(
        "  rays     {} primary ({} hit), {} bounced ({} hit), {} shadow ({} hit)",
        thousands(r.primary),
        thousands(r.primary_hits),
        thousands(r.bounce),
        thousands(r.bounce_hits),
        thousands(r.shadow),
        thousands(r.shadow_hits)
    );
    say!(
        "  speed    {:.2} million rays a second; {:.0} % of the time in traversal, there {:.2} a thread",
        o.mrays,
        100.0 * o.traversal_share,
        o.traversal_mrays
    );
    let s = &o.seconds;
    say!("  seconds  read {:.2}, build {:.2}, trace {:.2}", s.read, s.build, s.trace);
    Ok(())
}
