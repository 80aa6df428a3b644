//! A choice of a light by where it is needed: a binary tree of lights, each node with bounds of what is below it.
//!
//! A. Conty Estevez and C. Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", HPG 2018: the
//! build by surface area and orientation, the importance of a node from its distance and angles. Deviation: one light
//! is chosen, without splitting; both faces of a light count as one cone and its mirror image.

use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};

/// Bins along an axis for the splits that are tried.
const BINS: usize = 12;

/// Depth from which nodes are halved, whatever that costs: it bounds the recursion of the build.
const BINNED_DEPTH: u32 = 64;

/// No parent, or no light.
const NONE: u32 = u32::MAX;

/// A point to be lit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub point: Vec3,
    /// Unit normal of a surface that only light from its front matters to; zero where light from all around does.
    pub normal: Vec3,
}

/// Where some lights are and how they shine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightBounds {
    pub low: Vec3,
    pub high: Vec3,
    /// Axis of a cone of the normals, and half of its angle in 0 to pi; each shines up to a right angle around it.
    pub axis: Vec3,
    pub spread: f32,
    /// Radiant intensity along the normals, added up.
    pub intensity: f32,
    /// Whether lights shine backwards as well.
    pub two_sided: bool,
}

impl LightBounds {
    /// The bounds of both.
    fn with(&self, other: &LightBounds) -> LightBounds {
        let (axis, spread) = cone_of_both((self.axis, self.spread), (other.axis, other.spread));
        LightBounds {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            axis,
            spread,
            intensity: self.intensity + other.intensity,
            two_sided: self.two_sided || other.two_sided,
        }
    }

    fn center(&self) -> Vec3 {
        0.5 * (self.low + self.high)
    }

    /// What the walk needs of them.
    fn glow(&self) -> Glow {
        let (sine, cosine) = self.spread.sin_cos();
        Glow {
            center: self.center(),
            radius2: 0.25 * (self.high - self.low).length_squared(),
            axis: self.axis,
            intensity: self.intensity,
            // Pi itself has a sine below 0 in `f32`.
            spread: Angle { cosine, sine: sine.max(0.0) },
            two_sided: self.two_sided,
        }
    }

    /// What the build weighs a side of a split by: intensity, surface and solid angle.
    fn cost(&self) -> f32 {
        let d = self.high - self.low;
        let surface = d.x * d.y + d.y * d.z + d.z * d.x + 0.1 * d.length_squared();
        let edge = (self.spread + FRAC_PI_2).min(PI);
        let (s, c) = (self.spread.sin(), self.spread.cos());
        let rim = 2.0 * edge * s - (self.spread - 2.0 * edge).cos() - 2.0 * self.spread * s + c;
        self.intensity * surface * (2.0 * PI * (1.0 - c) + FRAC_PI_2 * rim)
    }
}

/// Bounds of lights with what each visit would compute anew.
#[derive(Clone, Copy, Debug)]
struct Glow {
    /// Middle of the box, and the square of the radius of the sphere around it.
    center: Vec3,
    radius2: f32,
    axis: Vec3,
    intensity: f32,
    spread: Angle,
    two_sided: bool,
}

impl Glow {
    /// An estimate of the irradiance by these lights, without what is in their way; 0 only where they give none.
    fn importance(&self, place: &Place) -> f32 {
        let way = self.center - place.point;
        let radius2 = self.radius2;
        let distance2 = way.length_squared();
        let nearest2 = distance2.max(radius2);
        if nearest2 <= 0.0 {
            return self.intensity;
        }
        if distance2 <= radius2 {
            return self.intensity / nearest2;
        }
        let towards = way / distance2.sqrt();
        // Half of the angle that the sphere around the box fills, widened by more than rounding: the arcsine rises by
        // at least as much as its argument.
        let uncertain = Angle::of_sine((radius2 / distance2).sqrt() + 1e-3);
        let cosine = -towards.dot(self.axis);
        let leaving = Angle::of_cosine(if self.two_sided { cosine.abs() } else { cosine })
            .less(self.spread)
            .less(uncertain);
        let arriving = if place.normal == Vec3::ZERO {
            1.0
        } else {
            Angle::of_cosine(place.normal.dot(towards)).less(uncertain).cosine
        };
        self.intensity * leaving.cosine.max(0.0) * arriving.max(0.0) / nearest2
    }
}

/// An angle from 0 to pi by its cosine and sine, so that angles are taken from each other without inverse functions
/// (as in pbrt-v4's `LightBounds`).
#[derive(Clone, Copy, Debug)]
struct Angle {
    cosine: f32,
    sine: f32,
}

impl Angle {
    fn of_cosine(cosine: f32) -> Angle {
        let cosine = cosine.clamp(-1.0, 1.0);
        Angle { cosine, sine: (1.0 - cosine * cosine).sqrt() }
    }

    /// At most a right angle.
    fn of_sine(sine: f32) -> Angle {
        let sine = sine.clamp(0.0, 1.0);
        Angle { cosine: (1.0 - sine * sine).sqrt(), sine }
    }

    /// The difference to a smaller angle; 0 if the other is not smaller.
    fn less(self, other: Angle) -> Angle {
        if self.cosine >= other.cosine {
            return Angle { cosine: 1.0, sine: 0.0 };
        }
        Angle {
            cosine: self.cosine * other.cosine + self.sine * other.sine,
            sine: (self.sine * other.cosine - self.cosine * other.sine).max(0.0),
        }
    }
}

/// A cone around two.
fn cone_of_both(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let (wide, narrow) = if a.1 >= b.1 { (a, b) } else { (b, a) };
    let between = wide.0.dot(narrow.0).clamp(-1.0, 1.0).acos();
    if (between + narrow.1).min(PI) <= wide.1 {
        return wide;
    }
    let half = 0.5 * (wide.1 + between + narrow.1);
    let side = (narrow.0 - wide.0 * wide.0.dot(narrow.0)).normalize_or_zero();
    if half >= PI || side == Vec3::ZERO {
        return (wide.0, PI);
    }
    let turn = half - wide.1;
    ((wide.0 * turn.cos() + side * turn.sin()).normalize(), half)
}

#[derive(Clone, Copy, Debug)]
struct Node {
    glow: Glow,
    parent: u32,
    /// Both children, or `NONE` and the light.
    below: [u32; 2],
}

/// A tree over lights.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightTree {
    nodes: Vec<Node>,
    /// The leaf of each light.
    leaves: Vec<u32>,
}

impl LightTree {
    /// The tree over lights, which it numbers as they come.
    pub fn new(lights: &[LightBounds]) -> LightTree {
        let mut tree = LightTree { nodes: Vec::new(), leaves: vec![NONE; lights.len()] };
        let mut order: Vec<u32> = (0..lights.len() as u32).collect();
        if !order.is_empty() {
            tree.add(lights, &mut order, NONE, 0);
        }
        tree
    }

    fn add(&mut self, lights: &[LightBounds], part: &mut [u32], parent: u32, depth: u32) -> u32 {
        let at = self.nodes.len() as u32;
        let first = lights[part[0] as usize];
        let bounds = part[1..].iter().fold(first, |all, &i| all.with(&lights[i as usize]));
        self.nodes.push(Node { glow: bounds.glow(), parent, below: [NONE, part[0]] });
        if part.len() == 1 {
            self.leaves[part[0] as usize] = at;
            return at;
        }
        let middle = split(lights, part, depth);
        let (left, right) = part.split_at_mut(middle);
        let left = self.add(lights, left, at, depth + 1);
        let right = self.add(lights, right, at, depth + 1);
        self.nodes[at as usize].below = [left, right];
        at
    }

    /// The importance of all lights together.
    pub fn importance(&self, place: &Place) -> f32 {
        self.nodes.first().map_or(0.0, |root| root.glow.importance(place))
    }

    /// A light for a number in `0..1`, and its probability; `None` where no light arrives.
    pub fn sample(&self, place: &Place, mut u: f64) -> Option<(usize, f32)> {
        let mut node = self.nodes.first()?;
        let mut probability = 1.0;
        while node.below[0] != NONE {
            let share = self.share_of_left(node, place)?;
            let next = if u < f64::from(share) {
                probability *= share;
                u /= f64::from(share);
                node.below[0]
            } else {
                probability *= 1.0 - share;
                u = (u - f64::from(share)) / f64::from(1.0 - share);
                node.below[1]
            };
            node = &self.nodes[next as usize];
        }
        (probability > 0.0).then_some((node.below[1] as usize, probability))
    }

    /// The probability with which [`LightTree::sample`] gives a light.
    pub fn probability(&self, light: usize, place: &Place) -> f32 {
        let mut at = self.leaves[light];
        let mut probability = 1.0;
        while self.nodes[at as usize].parent != NONE {
            let parent = self.nodes[at as usize].parent;
            let node = &self.nodes[parent as usize];
            let Some(share) = self.share_of_left(node, place) else { return 0.0 };
            probability *= if node.below[0] == at { share } else { 1.0 - share };
            at = parent;
        }
        probability
    }

    /// The share of an inner node's first child; `None` if nothing comes from either.
    fn share_of_left(&self, node: &Node, place: &Place) -> Option<f32> {
        let [a, b] = node.below.map(|i| self.nodes[i as usize].glow.importance(place));
        (a + b > 0.0).then(|| a / (a + b))
    }
}

/// Puts lights into two parts and gives the length of the first.
fn split(lights: &[LightBounds], part: &mut [u32], depth: u32) -> usize {
    let center = |i: u32| lights[i as usize].center();
    let start = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) =
        part.iter().map(|&i| center(i)).fold(start, |(low, high), c| (low.min(c), high.max(c)));
    let size = high - low;
    let longest = size.max_element();
    let bin = |i: u32, axis: usize| {
        (((center(i)[axis] - low[axis]) / size[axis] * BINS as f32) as usize).min(BINS - 1)
    };
    let mut best = (f32::INFINITY, 0, 0);
    for axis in (0..3).filter(|&a| size[a] > 0.0 && depth < BINNED_DEPTH) {
        let mut bins = [None::<LightBounds>; BINS];
        for &i in part.iter() {
            let (cell, light) = (&mut bins[bin(i, axis)], &lights[i as usize]);
            *cell = Some(cell.map_or(*light, |b| b.with(light)));
        }
        let both = |a: Option<LightBounds>, b: Option<LightBounds>| match (a, b) {
            (Some(a), Some(b)) => Some(a.with(&b)),
            (a, b) => a.or(b),
        };
        let mut behind = [None; BINS + 1];
        for i in (0..BINS).rev() {
            behind[i] = both(bins[i], behind[i + 1]);
        }
        let mut before = None;
        for i in 1..BINS {
            before = both(before, bins[i - 1]);
            // Thin boxes are not cut along their long sides.
            let regular = longest / size[axis];
            if let (Some(a), Some(b)) = (before, behind[i]) {
                let cost = regular * (a.cost() + b.cost());
                if cost < best.0 {
                    best = (cost, axis, i);
                }
            }
        }
    }
    if best.0.is_finite() {
        let (_, axis, first) = best;
        // Stable: the tree depends on the lights alone.
        part.sort_by_key(|&i| bin(i, axis) >= first);
        return part.partition_point(|&i| bin(i, axis) < first);
    }
    let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
    part.sort_by(|&a, &b| center(a)[axis].total_cmp(&center(b)[axis]));
    part.len() / 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::sampler::{hash, unit_float};

    fn number(i: u32) -> f32 {
        unit_float(hash(i))
    }

    fn unit(i: u32) -> Vec3 {
        let at = |k| 2.0 * number(3 * i + k) - 1.0;
        Vec3::new(at(0), at(1), at(2)).normalize_or(Vec3::X)
    }

    fn lights(n: u32) -> Vec<LightBounds> {
        let of = |i: u32| {
            let low = 4.0 * unit(1000 + i);
            let spread = [0.0, 0.4, PI][i as usize % 3];
            let high = low + Vec3::splat(if i.is_multiple_of(2) { 0.0 } else { 0.2 });
            let (axis, two_sided) = (unit(5000 + i), i.is_multiple_of(5));
            LightBounds { low, high, axis, spread, intensity: 0.1 + number(i), two_sided }
        };
        (0..n).map(of).collect()
    }

    /// What sampling says and what is asked for agree; probabilities add up to one, or less where nothing may arrive.
    #[test]
    fn probabilities_are_those_of_the_choice() {
        for n in [1, 2, 3, 60] {
            let tree = LightTree::new(&lights(n));
            for k in 0..40 {
                let normal = if k % 4 == 0 { Vec3::ZERO } else { unit(k) };
                let place = Place { point: 5.0 * unit(90 + k), normal };
                let sum: f32 = (0..n as usize).map(|i| tree.probability(i, &place)).sum();
                assert!(sum < 1.0 + 1e-4, "{n} {k}: {sum}");
                let steps = 4096;
                let mut counts = vec![0.0; n as usize];
                for i in 0..steps {
                    let u = (f64::from(i) + 0.5) / f64::from(steps);
                    if let Some((light, p)) = tree.sample(&place, u) {
                        assert!((p / tree.probability(light, &place) - 1.0).abs() < 1e-4);
                        counts[light] += 1.0 / f64::from(steps);
                    }
                }
                for (light, count) in counts.iter().enumerate() {
                    let p = f64::from(tree.probability(light, &place));
                    assert!((count - p).abs() < 2.0 / f64::from(steps), "{light}: {count} {p}");
                }
            }
        }
    }

    /// The importance without inverse functions is what the angles say.
    #[test]
    fn cosines_say_what_angles_say() {
        let lights = lights(60);
        let (mut dark, mut lit) = (0, 0);
        for k in 0..2000u32 {
            let light = &lights[k as usize % 60];
            let light = light.with(&lights[(k as usize * 7 + 1) % 60]);
            let normal = if k % 4 == 0 { Vec3::ZERO } else { unit(k) };
            let place = Place { point: 9.0 * unit(30_000 + k), normal };
            let glow = light.glow();
            let way = light.center() - place.point;
            let (distance2, radius2) = (way.length_squared(), glow.radius2);
            if distance2 <= radius2 {
                continue;
            }
            let uncertain = ((radius2 / distance2).sqrt() + 1e-3).min(1.0).asin();
            let bounded = |cosine: f32, spread: f32| {
                (cosine.acos() - spread).max(0.0).max(uncertain) - uncertain
            };
            let cosine = -way.normalize().dot(light.axis);
            let cosine = if light.two_sided { cosine.abs() } else { cosine };
            let leaving = bounded(cosine, light.spread).cos().max(0.0);
            let facing = bounded(normal.dot(way.normalize()), 0.0).cos().max(0.0);
            let arriving = if normal == Vec3::ZERO { 1.0 } else { facing };
            let expected = light.intensity * leaving * arriving / distance2;
            let found = glow.importance(&place);
            let scale = light.intensity / distance2;
            assert!((found - expected).abs() < 1e-3 * scale, "{k}: {found} {expected}");
            if found > 0.0 { lit += 1 } else { dark += 1 }
        }
        assert!(dark > 50 && lit > 500, "{dark} {lit}");
    }

    /// Where a light reaches a point, no node above it says that none does.
    #[test]
    fn no_light_that_arrives_is_left_out() {
        let lights = lights(60);
        let tree = LightTree::new(&lights);
        let mut reached = 0;
        for k in 0..400 {
            let place = Place { point: 5.0 * unit(900 + k), normal: unit(k) };
            for (i, light) in lights.iter().enumerate() {
                let way = light.center() - place.point;
                let leaving = -way.dot(light.axis) / way.length();
                let faces = if light.two_sided { leaving.abs() } else { leaving } > 1e-3;
                if faces && way.dot(place.normal) > 0.0 {
                    reached += 1;
                    assert!(tree.probability(i, &place) > 0.0, "{k} {i}");
                }
            }
        }
        assert!(reached > 1000, "{reached}");
    }

    #[test]
    fn a_cone_around_two_holds_both() {
        for i in 0..2000 {
            let (a, b) = ((unit(i), 2.0 * number(i)), (unit(7000 + i), number(9 + i)));
            let (axis, spread) = cone_of_both(a, b);
            for cone in [a, b] {
                let reach = axis.dot(cone.0).clamp(-1.0, 1.0).acos() + cone.1;
                assert!(reach.min(PI) <= spread + 2e-3, "{i}: {reach} {spread}");
            }
        }
    }
}
