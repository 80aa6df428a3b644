//! From a world to a picture, pass by pass.

use super::camera::LensView;
use super::film::{Cell, Film};
use super::integrator::{Integrator, PathCounts, Tile, Wave};
use super::settings::{LightChoice, PathSettings};
use super::sight::Sight;
use super::world::World;
use crate::error::RenderError;
use crate::renderer::{Monitor, Progress};
use crate::view::View;
use rayon::prelude::*;
use ropewalk::kernel::BatchCaster;
use ropewalk::wide::WideTree;
use ropewalk_scene::Camera;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Edge of a tile in pixels: a wave of some thousand rays is coherent enough and long enough for the batch engine.
const TILE: u32 = 64;

/// Most samples of a pixel in a pass: a pass ends soon, so that little is lost when it is given up.
const PASS: u32 = 4;

/// What a render brings back.
#[derive(Clone, Debug)]
pub struct PathRender {
    /// The complete passes.
    pub film: Film,
    /// Rays and times of all passes, those given up included.
    pub counts: PathCounts,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// True if it was stopped before all samples, but not by its own time limit.
    pub cancelled: bool,
}

/// The largest coordinate of a camera, where the scene is as large as 1 to 2.
const FARTHEST: f64 = 1e12;

/// Follows paths from `camera` through `world`, whose geometry has been made into `tree`. `each_pass` sees the picture
/// after every pass and may end the render; what it sees depends on the number of passes alone, not on threads.
///
/// # Errors
/// [`RenderError`] on an unusable camera or setting.
pub fn trace_paths(
    world: &World,
    tree: &WideTree,
    camera: &Camera,
    settings: &PathSettings,
    monitor: Monitor<'_>,
    each_pass: &mut (dyn FnMut(&Film) -> ControlFlow<()> + Send),
) -> Result<PathRender, RenderError> {
    settings.check()?;
    let mut lens = settings.lens;
    lens.aperture *= world.scale();
    lens.focus = lens.focus.map(|x| x * world.scale());
    // Of the camera as it was given, so that errors name its own numbers.
    View::new(camera, settings.size)?;
    let placed = world.place_camera(camera);
    if placed.from.iter().any(|x| x.abs() > FARTHEST) {
        let from = camera.from;
        let what = format!("from {from:?} lies more than {FARTHEST:e} times the scene's size away");
        return Err(RenderError::Camera { what });
    }
    let view = LensView::new(&placed, &lens, settings.size)?;
    let mut integrator = Integrator {
        world,
        caster: BatchCaster::new(tree, world.geometry()).with_threads(1),
        sight: None,
        light_choice: settings.light_choice,
        view,
        width: settings.size[0],
        seed: settings.seed,
        max_depth: settings.max_depth,
        strategy: settings.strategy,
        clamp: settings.clamp.unwrap_or(f32::INFINITY),
    };
    let mut trace = || {
        if settings.light_choice == LightChoice::Place {
            integrator.sight = Sight::new(world, &integrator.caster, &monitor);
        }
        let mut done = passes(&integrator, settings, monitor, each_pass);
        if settings.walk_costs && done.film.samples() > 0 {
            let [width, height] = settings.size;
            let row = |y: u32| (0..width).map(|x| integrator.walk_cost(x, y)).collect();
            let rows: Vec<Vec<_>> = (0..height).into_par_iter().map(row).collect();
            done.film.set_walks(rows.concat());
        }
        done
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

/// Numbers of samples of the passes: 1, 1, 2, 4, 4 and so on.
fn pass_lengths(samples: u32) -> impl Iterator<Item = u32> {
    let mut done = 0;
    std::iter::from_fn(move || {
        let next = done.clamp(1, PASS).min(samples - done);
        done += next;
        (next > 0).then_some(next)
    })
}

fn passes(
    integrator: &Integrator<'_>,
    settings: &PathSettings,
    monitor: Monitor<'_>,
    each_pass: &mut (dyn FnMut(&Film) -> ControlFlow<()> + Send),
) -> PathRender {
    let start = Instant::now();
    let tiles = tiles(settings.size);
    let mut film = Film::new(settings.size);
    let mut counts = PathCounts::default();
    let mut cancelled = false;
    let total = tiles.len() * pass_lengths(settings.samples).count();
    let done = AtomicUsize::new(0);
    for length in pass_lengths(settings.samples) {
        let is_late = || {
            let over = |limit: f64| start.elapsed().as_secs_f64() >= limit;
            film.samples() > 0 && settings.seconds.is_some_and(over)
        };
        let traced: Vec<Option<(Vec<Cell>, PathCounts)>> = tiles
            .par_iter()
            .map_init(Wave::default, |wave, tile| {
                if monitor.is_cancelled() || is_late() {
                    return None;
                }
                let out = integrator.trace(tile, film.samples(), length, wave);
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                if let Some(progress) = monitor.progress {
                    progress(Progress { done, total });
                }
                Some(out)
            })
            .collect();
        traced.iter().flatten().for_each(|(_, part)| counts += part);
        if traced.iter().any(Option::is_none) {
            cancelled = monitor.is_cancelled();
            break;
        }
        for (tile, (cells, _)) in tiles.iter().zip(traced.iter().flatten()) {
            for (i, cell) in cells.iter().enumerate() {
                let (x, y) = (i as u32 % tile.width, i as u32 / tile.width);
                let at = (tile.y + y) as usize * settings.size[0] as usize + (tile.x + x) as usize;
                film.add(at, cell);
            }
        }
        film.end_pass(length);
        if each_pass(&film).is_break() {
            break;
        }
    }
    PathRender { film, counts, seconds: start.elapsed().as_secs_f64(), cancelled }
}

fn tiles([width, height]: [u32; 2]) -> Vec<Tile> {
    let spans = |n: u32| (0..n).step_by(TILE as usize).map(move |a| (a, TILE.min(n - a)));
    spans(height)
        .flat_map(|(y, height)| spans(width).map(move |(x, width)| Tile { x, y, width, height }))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_double_and_end_with_the_samples() {
        let lengths = |n| pass_lengths(n).collect::<Vec<_>>();
        assert_eq!(lengths(1), [1]);
        assert_eq!(lengths(3), [1, 1, 1]);
        assert_eq!(lengths(14), [1, 1, 2, 4, 4, 2]);
    }

    #[test]
    fn tiles_cover_the_picture() {
        let tiles = tiles([130, 65]);
        assert_eq!(tiles.len(), 6);
        assert_eq!(tiles.iter().map(Tile::cells).sum::<usize>(), 130 * 65);
    }
}
