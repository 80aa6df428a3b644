//! How much of the sky and of the sun is seen from where: shares of free rays from the cells of a coarse grid.
//!
//! They only say how often the sky or the sun is chosen as the light of a point, so that the picture is as right with
//! bad ones as with good ones, but for noise.

use super::sampler::{hash, unit_float};
use super::world::World;
use crate::renderer::Monitor;
use glam::Vec3;
use rayon::prelude::*;
use ropewalk::kernel::BatchCaster;
use ropewalk::{Hit, Ray};

/// Cells along each axis of the mesh's box.
const CELLS: usize = 16;

/// Rays of a cell to the sky, and as many to the sun.
const RAYS: u32 = 32;

/// Shares of sky and sun.
#[derive(Clone, Debug)]
pub(crate) struct Sight {
    low: Vec3,
    /// Cells for a length.
    scale: Vec3,
    cells: Vec<[f32; 2]>,
}

impl Sight {
    /// Casts the rays; `None` in a world without sky and sun, or with one light alone, and once it is cancelled.
    pub fn new(world: &World, caster: &BatchCaster<'_>, monitor: &Monitor<'_>) -> Option<Sight> {
        let is_needed = world.environment().is_some() || world.sun().is_some();
        if !is_needed || world.lights().len() < 2 {
            return None;
        }
        let [low, high] = world.stage_box();
        let size = (high - low).max(Vec3::splat(f32::MIN_POSITIVE));
        let cells = (0..CELLS.pow(3) as u32)
            .into_par_iter()
            .map(|cell| {
                let goes_on = !monitor.is_cancelled();
                goes_on.then(|| shares_of_cell(world, caster, cell, low, size))
            })
            .collect::<Option<_>>()?;
        Some(Sight { low, scale: CELLS as f32 / size, cells })
    }

    /// The shares of the sky and of the sun that are seen around a point; all of them outside of the mesh's box.
    pub fn at(&self, point: Vec3) -> [f32; 2] {
        let [x, y, z] = ((point - self.low) * self.scale).to_array();
        let last = CELLS as f32;
        let outside = |x: f32| !(-1e-3..=last + 1e-3).contains(&x);
        if outside(x) || outside(y) || outside(z) {
            return [1.0; 2];
        }
        let [x, y, z] = [x, y, z].map(|x| (x.max(0.0) as usize).min(CELLS - 1));
        self.cells[(z * CELLS + y) * CELLS + x]
    }
}

fn shares_of_cell(
    world: &World,
    caster: &BatchCaster<'_>,
    cell: u32,
    low: Vec3,
    size: Vec3,
) -> [f32; 2] {
    let rays: Vec<Ray> = (0..RAYS).flat_map(|ray| rays_of(world, cell, ray, low, size)).collect();
    let mut blocked = vec![false; rays.len()];
    if world.has_cutouts() {
        let filter = |ray: usize, hit: &Hit| {
            let key = hash(cell ^ hash(ray as u32));
            world.is_there(hit, || unit_float(hash(key ^ hash(hit.prim_id))))
        };
        caster.with_filter(filter).occluded_into(&rays, &mut blocked);
    } else {
        caster.occluded_into(&rays, &mut blocked);
    }
    // Laplace's rule: nothing is surely hidden.
    [0, 1].map(|which| {
        let free = blocked.iter().skip(which).step_by(2).filter(|&&b| !b).count();
        (free as f32 + 1.0) / (RAYS + 2) as f32
    })
}

/// A ray to the sky and one to the sun, from anywhere in a cell.
fn rays_of(world: &World, cell: u32, ray: u32, low: Vec3, size: Vec3) -> [Ray; 2] {
    let number = |k: u32| unit_float(hash(cell ^ hash(ray * 8 + k)));
    let n = CELLS as u32;
    let corner = Vec3::new((cell % n) as f32, (cell / n % n) as f32, (cell / (n * n)) as f32);
    let inside = Vec3::new(number(0), number(1), number(2));
    let origin = low + (corner + inside) * size / CELLS as f32;
    let up = world.sky_to_world(Vec3::Z);
    let sky = world.environment().and_then(|map| map.sample([number(3), number(4)]));
    let sky = sky.map_or(up, |(direction, ..)| world.sky_to_world(direction));
    let sun = world.sun().map_or(up, |sun| sun.towards);
    [sky, sun].map(|direction| Ray::new(origin.to_array(), direction.to_array()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::{Backdrop, Surroundings, Up};
    use ropewalk::build::{BuildSettings, Preset};
    use ropewalk::wide::WideTree;
    use ropewalk_scene::{Mesh, Stage};
    use std::sync::atomic::AtomicBool;

    #[test]
    fn casting_stops_when_cancelled() {
        let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0]];
        let stage = Stage::of_mesh("one".into(), Mesh { vertices, faces: vec![[0, 1, 2]] });
        let around = Surroundings { up: Up::Z, backdrop: Backdrop::Sky, ground: false };
        let world = World::new(stage, &around).expect("sound");
        let settings = BuildSettings::preset(Preset::Balanced);
        let (tree, _) = WideTree::build(world.geometry(), &settings, &()).expect("built");
        let caster = BatchCaster::new(&tree, world.geometry()).with_threads(1);
        for stops in [false, true] {
            let flag = AtomicBool::new(stops);
            let monitor = Monitor { progress: None, cancel: Some(&flag) };
            assert_eq!(Sight::new(&world, &caster, &monitor).is_none(), stops);
        }
    }
}
