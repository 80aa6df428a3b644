//! From a scene to a picture: cells, tiles, threads.

use crate::aov::{AovBuffers, AovSample};
use crate::error::RenderError;
use crate::image::Image;
use crate::light::Lighting;
use crate::observer::{Observer, Readable, Tally};
use crate::ray_counts::RayCounts;
use crate::sampling::sample_in_pixel;
use crate::settings::RenderSettings;
use crate::view::{View, default_camera};
use crate::whitted::{EyeSample, FacingRule, Whitted};
use rayon::prelude::*;
use ropewalk::Geometry;
use ropewalk::traverse::{Counts, NoCounts, RayCaster};
use ropewalk_scene::Scene;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

/// Edge of a tile in cells: small enough to balance cores and to stop soon, large enough that its
/// bookkeeping does not show.
const TILE: u32 = 32;

/// How far a render has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Tiles finished.
    pub done: usize,
    /// Tiles in all.
    pub total: usize,
}

/// Watches and stops a render. The default does neither.
#[derive(Clone, Copy, Default)]
pub struct Monitor<'a> {
    /// Called after each tile, from any thread.
    pub progress: Option<&'a (dyn Fn(Progress) + Sync)>,
    /// Checked before each tile; once true, no further tile is begun.
    pub cancel: Option<&'a AtomicBool>,
}

impl Monitor<'_> {
    pub(crate) fn is_cancelled(&self) -> bool {
        self.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}

/// What a render brings back.
#[derive(Clone, Debug)]
pub struct Render {
    /// The picture, linear in the scene's colours; tiles that were not reached are black.
    pub image: Image,
    /// Rays by kind.
    pub counts: RayCounts,
    /// Traversal events of all rays; zero unless they were counted.
    pub traversal: Counts,
    /// Traversal events by kind of ray, indexed as [`RayKind::ALL`](crate::RayKind::ALL).
    pub traversal_by_kind: [Counts; 4],
    /// Auxiliary pictures, if asked for.
    pub aov: Option<AovBuffers>,
    /// Wall-clock seconds of tracing and shading.
    pub seconds_trace: f64,
    /// True if the render was stopped: picture and counts are incomplete.
    pub cancelled: bool,
}

/// Renders `scene`, whose primitives are `geometry` (object `i` as primitive `i`), with rays
/// answered by `caster`. A scene without a camera is seen through [`default_camera`].
///
/// Picture and counts are the same for any number of threads.
///
/// # Errors
/// [`RenderError`] on an unusable camera or setting, or if geometry and scene do not belong
/// together.
pub fn render<A: RayCaster>(
    scene: &Scene,
    geometry: &Geometry,
    caster: &A,
    settings: &RenderSettings,
    monitor: Monitor<'_>,
) -> Result<Render, RenderError> {
    let frame = Frame::new(scene, geometry, caster, settings)?;
    let trace = || {
        if settings.count_traversal || settings.aov {
            frame.render::<Counts>(monitor)
        } else {
            frame.render::<NoCounts>(monitor)
        }
    };
    match settings.threads {
        None => Ok(trace()),
        Some(threads) => rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map(|pool| pool.install(trace))
            .map_err(|e| RenderError::Threads { threads, reason: e.to_string() }),
    }
}

/// A picture about to be traced. It is a grid of cells: a cell is a pixel, or under the SPD rules a
/// corner between pixels.
pub(crate) struct Frame<'a, A> {
    tracer: Whitted<'a, A>,
    view: View,
    size: [u32; 2],
    settings: &'a RenderSettings,
}

/// Colour and auxiliary values of one cell.
#[derive(Clone, Copy)]
struct Cell {
    color: [f64; 3],
    aov: AovSample,
}

impl Cell {
    const EMPTY: Cell = Cell { color: [0.0; 3], aov: AovSample::MISS };
}

/// A part of the grid of cells.
struct Tile {
    x: std::ops::Range<u32>,
    y: std::ops::Range<u32>,
}

impl<'a, A: RayCaster> Frame<'a, A> {
    /// Checks that scene, geometry and settings make a picture.
    pub fn new(
        scene: &'a Scene,
        geometry: &'a Geometry,
        caster: &'a A,
        settings: &'a RenderSettings,
    ) -> Result<Self, RenderError> {
        let camera = scene.camera.unwrap_or_else(|| default_camera(&geometry.bounds()));
        let size = settings.checked_size(&camera)?;
        let view = View::new(&camera, size)?;
        if camera.from.iter().any(|x| x.abs() > f64::from(f32::MAX)) {
            let what = format!("from {:?} lies beyond 3.4e38, the end of f32", camera.from);
            return Err(RenderError::Camera { what });
        }
        check_objects(scene, geometry)?;
        let lighting = Lighting::new(scene, view.eye());
        let max_depth = settings.max_depth;
        let facing =
            if settings.spd_rules { FacingRule::SurfaceNormal } else { FacingRule::ViewerSide };
        let tracer = Whitted { scene, geometry, caster, lighting, max_depth, facing };
        Ok(Frame { tracer, view, size, settings })
    }

    /// Width and height of the grid of cells.
    pub fn cells(&self) -> [u32; 2] {
        if self.settings.spd_rules { self.size.map(|n| n + 1) } else { self.size }
    }

    /// Traces the samples of a cell, one after another.
    pub fn trace_cell<O: Observer>(
        &self,
        x: u32,
        y: u32,
        observer: &mut O,
        mut each: impl FnMut(EyeSample, &mut O),
    ) {
        let (left, top) = (f64::from(x), f64::from(y));
        if self.settings.spd_rules {
            let sample = self.tracer.eye(&self.view.ray(left, top), observer);
            return each(sample, observer);
        }
        let n = self.settings.samples_per_pixel;
        for i in 0..n {
            let [u, v] = sample_in_pixel(x, y, i, n);
            let sample = self.tracer.eye(&self.view.ray(left + u, top + v), observer);
            each(sample, observer);
        }
    }

    fn render<C: Readable + Send>(&self, monitor: Monitor<'_>) -> Render {
        let start = Instant::now();
        let tiles = self.tiles();
        let done = AtomicUsize::new(0);
        let traced: Vec<Option<(Vec<Cell>, Tally<C>)>> = tiles
            .par_iter()
            .map(|tile| {
                if monitor.is_cancelled() {
                    return None;
                }
                let out = self.trace_tile(tile);
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                if let Some(progress) = monitor.progress {
                    progress(Progress { done, total: tiles.len() });
                }
                Some(out)
            })
            .collect();
        self.assemble(&tiles, traced, start)
    }

    /// The tiles of the grid, row by row.
    fn tiles(&self) -> Vec<Tile> {
        let [w, h] = self.cells();
        let spans = |n: u32| (0..n).step_by(TILE as usize).map(move |a| a..(a + TILE).min(n));
        spans(h).flat_map(|y| spans(w).map(move |x| Tile { x, y: y.clone() })).collect()
    }

    fn trace_tile<C: Readable>(&self, tile: &Tile) -> (Vec<Cell>, Tally<C>) {
        let mut tally = Tally::<C>::default();
        let mut cells = Vec::with_capacity(tile.x.len() * tile.y.len());
        let mut samples = Vec::new();
        for y in tile.y.clone() {
            for x in tile.x.clone() {
                samples.clear();
                let mut before = tally.total();
                self.trace_cell(x, y, &mut tally, |sample, tally| {
                    let after = tally.total();
                    samples.push((sample.color, aov_sample(&sample, &before, &after)));
                    before = after;
                });
                cells.push(merged_cell(&samples));
            }
        }
        (cells, tally)
    }

    /// Puts the tiles together: cells into pixels, tallies into sums.
    fn assemble<C: Readable>(
        &self,
        tiles: &[Tile],
        traced: Vec<Option<(Vec<Cell>, Tally<C>)>>,
        start: Instant,
    ) -> Render {
        let columns = self.cells()[0] as usize;
        let mut grid = vec![Cell::EMPTY; columns * self.cells()[1] as usize];
        let mut counts = RayCounts::default();
        let mut traversal_by_kind = [Counts::default(); 4];
        let mut cancelled = false;
        for (tile, traced) in tiles.iter().zip(traced) {
            let Some((cells, tally)) = traced else {
                cancelled = true;
                continue;
            };
            for (y, row) in tile.y.clone().zip(cells.chunks_exact(tile.x.len())) {
                let at = y as usize * columns + tile.x.start as usize;
                grid[at..at + row.len()].copy_from_slice(row);
            }
            counts += tally.rays;
            for (sum, c) in traversal_by_kind.iter_mut().zip(tally.by_kind) {
                *sum += c.counts();
            }
        }
        let mut traversal = Counts::default();
        traversal_by_kind.iter().for_each(|&c| traversal += c);
        let (image, aov) = self.resolve(&grid);
        let seconds_trace = start.elapsed().as_secs_f64();
        Render { image, counts, traversal, traversal_by_kind, aov, seconds_trace, cancelled }
    }

    /// Makes pixels of cells: under the SPD rules the mean of four corners, else the cell itself.
    fn resolve(&self, grid: &[Cell]) -> (Image, Option<AovBuffers>) {
        let [w, h] = self.size;
        let columns = self.cells()[0] as usize;
        let mut image = Image::filled(w, h, [0.0; 3]);
        let mut aov = self.settings.aov.then(|| AovBuffers::new(image.pixels().len()));
        for (i, pixel) in image.pixels_mut().iter_mut().enumerate() {
            let (x, y) = (i % w as usize, i / w as usize);
            let at = y * columns + x;
            let cell = if self.settings.spd_rules {
                let corners = [at, at + 1, at + columns, at + columns + 1];
                merged_cell(&corners.map(|c| (grid[c].color, grid[c].aov)))
            } else {
                grid[at]
            };
            *pixel = cell.color.map(|c| c as f32);
            if let Some(aov) = &mut aov {
                aov.set(i, &cell.aov);
            }
        }
        (image, aov)
    }
}

/// Each object needs a primitive and a material.
fn check_objects(scene: &Scene, geometry: &Geometry) -> Result<(), RenderError> {
    let (primitives, objects) = (geometry.len(), scene.objects.len());
    if primitives != objects {
        return Err(RenderError::GeometryMismatch { geometry: primitives, scene: objects });
    }
    let materials = scene.materials.len();
    match scene.objects.iter().position(|o| o.material as usize >= materials) {
        None => Ok(()),
        Some(object) => {
            let material = scene.objects[object].material;
            Err(RenderError::MissingMaterial { object, material, materials })
        }
    }
}

fn aov_sample(sample: &EyeSample, before: &Counts, after: &Counts) -> AovSample {
    let steps = |c: &Counts| c.traversal_steps + c.rope_crossings + c.rope_tree_steps;
    AovSample {
        depth: sample.distance,
        normal: sample.normal.map(|x| x as f32),
        steps: (steps(after) - steps(before)) as f32,
        tests: (after.intersection_tests - before.intersection_tests) as f32,
    }
}

/// The mean colour of at least one sample, and their merged auxiliary values.
fn merged_cell(samples: &[([f64; 3], AovSample)]) -> Cell {
    let n = samples.len() as f64;
    let mean = |a: usize| samples.iter().map(|(c, _)| c[a]).sum::<f64>() / n;
    let color = std::array::from_fn(mean);
    Cell { color, aov: AovSample::merged(samples.iter().map(|&(_, aov)| aov)) }
}
