//! How a surface scatters light at a point: a mixture of metal, coated matte and glass.
//!
//! Directions are unit vectors in a frame whose third axis is the shading normal on the side of the viewer, so that
//! `wo.z > 0`. What single bounces between microfacets lose is put back, so that white surfaces lose nothing
//! (see [`albedo`](super::albedo)).

use super::albedo::{Glass, LEAST_ROUGHNESS, REFLECTION};
use super::{fresnel, ggx};
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, TAU};

/// The least reflectance at normal incidence of a coat: below it a coat reflects less than 2^-20 at any angle
/// ([`fresnel::at_grazing`]), which changes no digit that is shown, and the surface is matte.
const LEAST_COAT: f32 = 1.0 / (1 << 26) as f32;

/// A surface at a point; the three shares add up to 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bsdf<'a> {
    /// Share of metal.
    pub metal: f32,
    /// Share of matte under a coat.
    pub matte: f32,
    /// Share of glass.
    pub glass: f32,
    /// Albedo of matte, reflectance of metal at normal incidence, transmittance of a pane of glass.
    pub base: Vec3,
    /// Perceptual roughness; alpha is its square.
    pub roughness: f32,
    /// Index of refraction.
    pub ior: f32,
    /// True if the viewer is where the front is.
    pub outside: bool,
    /// The tables of `ior`; needed where there is glass.
    pub tables: Option<&'a Glass>,
}

/// A direction that a surface scatters light from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scattered {
    /// Direction away from the surface.
    pub wi: Vec3,
    /// The BSDF times the cosine over the density: what the path's throughput is multiplied with.
    pub weight: Vec3,
    /// Density by solid angle; infinite for mirrors and clear glass.
    pub density: f32,
    /// What the throughput was multiplied with because radiance changes with the index of refraction.
    pub compression: f32,
}

/// What a direction of view decides: probabilities of the lobes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lobes {
    mirror: f32,
    matte: f32,
    glass: f32,
    /// Share of light that the coat reflects.
    coat: f32,
}

/// The brightness by which lobes and lights are weighed.
pub(crate) fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

impl Bsdf<'_> {
    fn alpha(&self) -> f32 {
        self.roughness * self.roughness
    }

    /// True if reflection and refraction have one direction only.
    fn is_smooth(&self) -> bool {
        self.roughness < LEAST_ROUGHNESS
    }

    /// True if light that passes has one direction only; between like media there is no other.
    fn is_clear(&self) -> bool {
        self.is_smooth() || self.ior < 1.001
    }

    /// The index of refraction behind the surface over that on the viewer's side.
    fn eta(&self) -> f32 {
        if self.outside { self.ior } else { 1.0 / self.ior }
    }

    /// What the coat reflects at normal incidence; 0 for one that is not worth following.
    fn coat_f0(&self) -> f32 {
        let f0 = fresnel::normal_incidence(self.ior);
        if f0 < LEAST_COAT { 0.0 } else { f0 }
    }

    /// True if light can be scattered from more than single directions, so that lights are worth sampling.
    pub fn spreads(&self) -> bool {
        self.matte > 0.0
            || (self.metal > 0.0 && !self.is_smooth())
            || (self.glass > 0.0 && !self.is_clear())
    }

    /// The lobes for a direction of view.
    pub fn lobes(&self, wo: Vec3) -> Lobes {
        let coat = REFLECTION.dielectric(self.coat_f0(), wo.z, self.roughness);
        // No colour may be left out, so that weights stay bounded.
        let bright = self.base.max_element();
        let mirror = self.metal * bright + self.matte * coat;
        let matte = self.matte * (1.0 - coat) * bright;
        let sum = mirror + matte + self.glass;
        if sum <= 0.0 {
            return Lobes { mirror: 0.0, matte: 0.0, glass: 0.0, coat };
        }
        Lobes { mirror: mirror / sum, matte: matte / sum, glass: self.glass / sum, coat }
    }

    /// Reflectance of metal and coat together, for a facet seen at a cosine.
    fn mirror_reflectance(&self, wo: Vec3, cosine: f32) -> Vec3 {
        let f = Vec3::ONE * (1.0 - cosine.clamp(0.0, 1.0)).powi(5);
        let metal = self.base + (Vec3::ONE - self.base) * f;
        let once = REFLECTION.mirror(wo.z, self.roughness);
        // Light that bounces again is coloured again (Turquin 2019, equation 16).
        let metal = metal * (Vec3::ONE + self.base * ((1.0 - once) / once));
        self.metal * metal + Vec3::splat(self.matte * fresnel::schlick(self.coat_f0(), cosine))
    }

    /// The matte layer under the coat, without the cosine: what the coat does not reflect gets in and out (C. Kelemen
    /// and L. Szirmay-Kalos 2001), so that a white one loses nothing.
    fn matte_value(&self, lobes: &Lobes, wi: Vec3) -> Vec3 {
        let (f0, rough) = (self.coat_f0(), self.roughness);
        let (inward, outward) = (1.0 - REFLECTION.dielectric(f0, wi.z, rough), 1.0 - lobes.coat);
        let mean = 1.0 - REFLECTION.dielectric_mean(f0, rough);
        self.matte * FRAC_1_PI * outward * inward / mean * self.base
    }

    /// What keeps the energy of glass, over the light of one bounce.
    fn glass_gain(&self, wo: Vec3) -> f32 {
        self.tables.map_or(1.0, |t| 1.0 / t.share(self.outside, wo.z, self.roughness))
    }

    /// Colour of light that passes once: a pane has two surfaces.
    fn tint(&self) -> Vec3 {
        self.base.powf(0.5)
    }

    /// The BSDF times the cosine of `wi`, and the density with which [`Bsdf::sample`] gives `wi`; without mirrors and
    /// clear glass, which no other way of sampling meets.
    pub fn evaluate(&self, lobes: &Lobes, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        if wi.z > 0.0 {
            let (mut value, mut density) = (Vec3::ZERO, 0.0);
            if self.matte > 0.0 {
                value += self.matte_value(lobes, wi) * wi.z;
                density += lobes.matte * wi.z * FRAC_1_PI;
            }
            if !self.is_smooth() && lobes.mirror + lobes.glass > 0.0 {
                let m = (wo + wi).normalize();
                let (alpha, cosine) = (self.alpha(), wo.dot(m));
                let shape =
                    ggx::normals(m, alpha) * ggx::seen_from_both(wo, wi, alpha) / (4.0 * wo.z);
                let chance = ggx::visible_normal_density(wo, m, alpha) / (4.0 * cosine);
                value += self.mirror_reflectance(wo, cosine) * shape;
                density += lobes.mirror * chance;
                if self.glass > 0.0 && !self.is_clear() {
                    let (share, _) = fresnel::dielectric(wo, m, self.eta());
                    value += Vec3::splat(self.glass * self.glass_gain(wo) * share * shape);
                    density += lobes.glass * share * chance;
                }
            }
            return (value, density);
        }
        if wi.z == 0.0 || self.is_clear() || self.glass == 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        // Through rough glass (Walter et al. 2007).
        let (eta, alpha) = (self.eta(), self.alpha());
        let m = (wo + eta * wi).normalize_or_zero();
        let m = if m.z < 0.0 { -m } else { m };
        let (near, far) = (wo.dot(m), wi.dot(m));
        if near <= 0.0 || far >= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let (share, _) = fresnel::dielectric(wo, m, eta);
        let spread = (far + near / eta).powi(2);
        if spread <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let through = (1.0 - share) * -far / spread;
        let value = self.glass
            * self.glass_gain(wo)
            * through
            * ggx::normals(m, alpha)
            * ggx::seen_from_both(wo, wi, alpha)
            * near
            / wo.z
            / (eta * eta);
        let density = lobes.glass * through * ggx::visible_normal_density(wo, m, alpha);
        (value * self.tint(), density)
    }

    /// A direction by the lobes' brightness; `None` where the light is absorbed.
    pub fn sample(&self, lobes: &Lobes, wo: Vec3, u: [f32; 3]) -> Option<Scattered> {
        let place = [u[1], u[2]];
        if u[0] < lobes.matte {
            return self.spread(lobes, wo, cosine_direction(place));
        }
        let u = u[0] - lobes.matte;
        if u < lobes.mirror {
            if self.is_smooth() {
                let weight = self.mirror_reflectance(wo, wo.z) / lobes.mirror;
                return Some(single(Vec3::new(-wo.x, -wo.y, wo.z), weight, 1.0));
            }
            let m = ggx::sample_visible_normal(wo, self.alpha(), place);
            return self.spread(lobes, wo, 2.0 * wo.dot(m) * m - wo).filter(|s| s.wi.z > 0.0);
        }
        if lobes.glass <= 0.0 {
            return None;
        }
        let u = ((u - lobes.mirror) / lobes.glass).clamp(0.0, 1.0);
        let m = if self.is_clear() {
            Vec3::Z
        } else {
            ggx::sample_visible_normal(wo, self.alpha(), place)
        };
        let (share, refracted) = fresnel::dielectric(wo, m, self.eta());
        let weight = self.glass / lobes.glass;
        match refracted {
            Some(wi) if u >= share => {
                let compression = 1.0 / (self.eta() * self.eta());
                if self.is_clear() {
                    return Some(single(wi, weight * compression * self.tint(), compression));
                }
                let out = self.spread(lobes, wo, wi).filter(|s| s.wi.z < 0.0)?;
                Some(Scattered { compression, ..out })
            }
            _ => {
                let wi = 2.0 * wo.dot(m) * m - wo;
                if self.is_clear() {
                    return Some(single(wi, Vec3::splat(weight), 1.0));
                }
                self.spread(lobes, wo, wi).filter(|s| s.wi.z > 0.0)
            }
        }
    }

    /// A direction with the weight of all lobes.
    fn spread(&self, lobes: &Lobes, wo: Vec3, wi: Vec3) -> Option<Scattered> {
        let wi = wi.normalize_or_zero();
        let (value, density) = self.evaluate(lobes, wo, wi);
        let weight = value / density;
        (density > 0.0 && weight.is_finite()).then_some(Scattered {
            wi,
            weight,
            density,
            compression: 1.0,
        })
    }
}

/// A direction without a density.
fn single(wi: Vec3, weight: Vec3, compression: f32) -> Scattered {
    Scattered { wi, weight, density: f32::INFINITY, compression }
}

/// A direction above the surface by its cosine.
pub(crate) fn cosine_direction(u: [f32; 2]) -> Vec3 {
    let (r, phi) = (u[0].sqrt(), TAU * u[1]);
    Vec3::new(r * phi.cos(), r * phi.sin(), (1.0 - u[0]).max(0.0).sqrt())
}

/// A frame around a unit normal (T. Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    across: Vec3,
    along: Vec3,
    normal: Vec3,
}

impl Frame {
    /// The frame of a normal.
    pub fn new(n: Vec3) -> Frame {
        let sign = 1f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Frame {
            across: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            along: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            normal: n,
        }
    }

    /// A direction of the world in the frame.
    pub fn local(&self, w: Vec3) -> Vec3 {
        Vec3::new(w.dot(self.across), w.dot(self.along), w.dot(self.normal))
    }

    /// A direction of the frame in the world.
    pub fn world(&self, w: Vec3) -> Vec3 {
        w.x * self.across + w.y * self.along + w.z * self.normal
    }
}
