//! How much light a rough surface sends back when light bounces between microfacets once only, tabulated, so that
//! what is missing can be put back.
//!
//! C. Kulla and A. Conty, "Revisiting Physically Based Shading at Imageworks" (2017); E. Turquin, "Practical
//! multiple scattering compensation for microfacet models" (2019).

use super::fresnel;
use super::ggx;
use glam::Vec3;
use std::sync::LazyLock;

/// Nodes over the square root of the cosine, and over roughness.
const NODES: usize = 32;

/// Points of each integral.
const POINTS: u32 = 512;

/// The least roughness at which a surface is rough; below it is a mirror.
pub(crate) const LEAST_ROUGHNESS: f32 = 0.03;

/// A function of a cosine and a roughness, both 0 to 1.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    values: Vec<f32>,
}

impl Table {
    /// Means of `weigh` over visible normals; it gets the direction of view, the normal and alpha.
    fn of(weigh: impl Fn(Vec3, Vec3, f32) -> f32) -> Table {
        let mut values = Vec::with_capacity(NODES * NODES);
        for row in 0..NODES {
            let roughness = (row as f32 / (NODES - 1) as f32).max(0.5 * LEAST_ROUGHNESS);
            let alpha = roughness * roughness;
            for column in 0..NODES {
                let cosine = (column as f32 / (NODES - 1) as f32).powi(2).max(1e-4);
                let view = Vec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
                let sum: f32 = (0..POINTS)
                    .map(|i| {
                        // A Hammersley set.
                        let u = (i as f32 + 0.5) / POINTS as f32;
                        let v = (f64::from(i.reverse_bits()) / 2f64.powi(32)) as f32;
                        weigh(view, ggx::sample_visible_normal(view, alpha, [v, u]), alpha)
                    })
                    .sum();
                values.push(sum / POINTS as f32);
            }
        }
        Table { values }
    }

    /// The value between nodes.
    pub fn at(&self, cosine: f32, roughness: f32) -> f32 {
        let place = |x: f32| {
            let x = x.clamp(0.0, 1.0) * (NODES - 1) as f32;
            let node = (x as usize).min(NODES - 2);
            (node, x - node as f32)
        };
        let (column, x) = place(cosine.max(0.0).sqrt());
        let (row, y) = place(roughness);
        let mix = |a: f32, b: f32, t: f32| a + t * (b - a);
        let node = |row: usize, column: usize| self.values[row * NODES + column];
        mix(
            mix(node(row, column), node(row, column + 1), x),
            mix(node(row + 1, column), node(row + 1, column + 1), x),
            y,
        )
    }

    /// The mean over directions by cosine, of each roughness.
    fn means(&self) -> Vec<f32> {
        let steps = 1024;
        let of = |roughness: f32| -> f32 {
            let at = |i: u32| (i as f32 + 0.5) / steps as f32;
            (0..steps).map(|i| 2.0 * at(i) * self.at(at(i), roughness)).sum::<f32>() / steps as f32
        };
        (0..NODES).map(|row| of(row as f32 / (NODES - 1) as f32)).collect()
    }
}

/// What a surface reflects, split so that any reflectance at normal incidence `f0` follows (B. Karis, "Real Shading
/// in Unreal Engine 4", 2013): `f0 * (all - grazing) + f90 * grazing`, with Schlick's approximation.
pub(crate) struct Reflection {
    /// Of a perfect mirror.
    all: Table,
    /// The part that Schlick's approximation adds towards grazing angles.
    grazing: Table,
    all_mean: Vec<f32>,
    grazing_mean: Vec<f32>,
}

/// The tables of reflection, made when first asked for.
pub(crate) static REFLECTION: LazyLock<Reflection> = LazyLock::new(|| {
    let reflected = |view: Vec3, m: Vec3, alpha: f32| {
        let out = 2.0 * view.dot(m) * m - view;
        if out.z <= 0.0 {
            return 0.0;
        }
        ggx::seen_from_both(view, out, alpha) / ggx::seen(view, alpha)
    };
    let all = Table::of(reflected);
    let grazing = Table::of(|view, m, alpha| {
        reflected(view, m, alpha) * (1.0 - view.dot(m).clamp(0.0, 1.0)).powi(5)
    });
    let (all_mean, grazing_mean) = (all.means(), grazing.means());
    Reflection { all, grazing, all_mean, grazing_mean }
});

impl Reflection {
    /// The share of light from a direction that a perfect mirror sends back after one bounce.
    pub fn mirror(&self, cosine: f32, roughness: f32) -> f32 {
        if roughness < LEAST_ROUGHNESS { 1.0 } else { self.all.at(cosine, roughness) }
    }

    /// The share of light that a dielectric sends back.
    pub fn dielectric(&self, f0: f32, cosine: f32, roughness: f32) -> f32 {
        if f0 == 0.0 {
            return 0.0;
        }
        if roughness < LEAST_ROUGHNESS {
            return fresnel::schlick(f0, cosine);
        }
        let grazing = self.grazing.at(cosine, roughness);
        f0 * (self.all.at(cosine, roughness) - grazing) + fresnel::at_grazing(f0) * grazing
    }

    /// The mean of [`Reflection::dielectric`] over directions.
    pub fn dielectric_mean(&self, f0: f32, roughness: f32) -> f32 {
        if f0 == 0.0 {
            return 0.0;
        }
        if roughness < LEAST_ROUGHNESS {
            return f0 + (fresnel::at_grazing(f0) - f0) / 21.0;
        }
        let x = roughness.clamp(0.0, 1.0) * (NODES - 1) as f32;
        let row = (x as usize).min(NODES - 2);
        let at = |m: &[f32]| m[row] + (x - row as f32) * (m[row + 1] - m[row]);
        let grazing = at(&self.grazing_mean);
        f0 * (at(&self.all_mean) - grazing) + fresnel::at_grazing(f0) * grazing
    }
}

/// The share of light that rough glass sends on after one bounce, back or through, from outside and from inside.
#[derive(Clone, Debug)]
pub(crate) struct Glass {
    outside: Table,
    inside: Table,
}

impl Glass {
    /// The tables of an index of refraction.
    pub fn new(ior: f32) -> Glass {
        let of = |eta: f32| {
            Table::of(move |view, m, alpha| {
                let (share, refracted) = fresnel::dielectric(view, m, eta);
                let reflected = 2.0 * view.dot(m) * m - view;
                let mut sum = 0.0;
                if reflected.z > 0.0 {
                    sum += share * ggx::seen_from_both(view, reflected, alpha);
                }
                if let Some(out) = refracted.filter(|out| out.z < 0.0) {
                    sum += (1.0 - share) * ggx::seen_from_both(view, out, alpha);
                }
                sum / ggx::seen(view, alpha)
            })
        };
        Glass { outside: of(ior), inside: of(1.0 / ior) }
    }

    /// The share, from the side where light arrives.
    pub fn share(&self, from_outside: bool, cosine: f32, roughness: f32) -> f32 {
        let table = if from_outside { &self.outside } else { &self.inside };
        table.at(cosine, roughness).max(0.05)
    }
}
