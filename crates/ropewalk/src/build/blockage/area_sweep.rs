//! The area left of a sweeping plane.

use crate::primitive::AreaRamp;

/// Walks sorted [`AreaRamp`]s upwards and keeps the area below the plane.
///
/// The running state is the area, its derivative (the width) and the slope of that at the last
/// position, advanced from breakpoint to breakpoint: unlike the coefficients of a polynomial about
/// the cell's face, it cancels only what one step adds.
pub(in crate::build) struct AreaSweep<'a> {
    ramps: &'a [AreaRamp],
    next: usize,
    x: f64,
    area: f64,
    width: f64,
    slope: f64,
}

impl<'a> AreaSweep<'a> {
    /// `ramps` sorted by position.
    pub fn new(ramps: &'a [AreaRamp]) -> Self {
        let x = ramps.first().map_or(0.0, |r| r.x);
        AreaSweep { ramps, next: 0, x, area: 0.0, width: 0.0, slope: 0.0 }
    }

    /// The area of everything up to and including the plane at `x`.
    pub fn total(ramps: &'a [AreaRamp], x: f64) -> f64 {
        let mut sweep = AreaSweep::new(ramps);
        sweep.below(x) + sweep.in_plane(x)
    }

    /// The area below a plane at `x`, without what lies in it. Positions must not decrease.
    #[inline]
    pub fn below(&mut self, x: f64) -> f64 {
        while let Some(ramp) = self.ramps.get(self.next).filter(|r| r.x < x) {
            self.move_to(ramp.x);
            self.area += ramp.step;
            self.width += ramp.width;
            self.slope += ramp.slope;
            self.next += 1;
        }
        if x > self.x {
            self.move_to(x);
        }
        self.area.max(0.0)
    }

    /// The area in a plane at `x`, after [`AreaSweep::below`] with the same `x`.
    #[inline]
    pub fn in_plane(&self, x: f64) -> f64 {
        self.ramps[self.next..].iter().take_while(|r| r.x == x).map(|r| r.step).sum()
    }

    #[inline]
    fn move_to(&mut self, x: f64) {
        let d = x - self.x;
        self.area += d * (self.width + 0.5 * self.slope * d);
        self.width += d * self.slope;
        self.x = x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aabb::Aabb;
    use crate::primitive::{Primitive, Sphere, Triangle};
    use proptest::prelude::*;

    /// The blockage sweep must equal direct evaluation to this share of the cell's area
    /// (docs/paper.md, section 4).
    const TOLERANCE: f64 = 1e-6;

    /// The area of one ramp's contribution below `x`, by its definition.
    fn direct(ramps: &[AreaRamp], x: f64) -> f64 {
        let value = |r: &AreaRamp| {
            let d = x - r.x;
            r.step + r.width * d + 0.5 * r.slope * d * d
        };
        ramps.iter().filter(|r| r.x < x).map(value).sum()
    }

    proptest! {
        #[test]
        fn sweep_equals_the_direct_sum(
            triangles in prop::collection::vec(
                prop::array::uniform3(prop::array::uniform3(-2.0f32..3.0)), 1..50),
            spheres in prop::collection::vec((prop::array::uniform3(0.0f32..1.0), 0.01f32..0.5), 0..20),
            flat in 0usize..6,
        ) {
            let cell = Aabb::new([0.0; 3], [1.0; 3]);
            let axis = flat % 3;
            let mut ramps = Vec::new();
            for (i, mut vertices) in triangles.into_iter().enumerate() {
                if i % 4 == 0 && flat < 3 {
                    vertices.iter_mut().for_each(|v| v[axis] = 0.25);
                }
                Triangle { vertices }.area_ramps(&cell, axis, &mut ramps);
            }
            for (center, radius) in spheres {
                Sphere { center, radius }.area_ramps(&cell, axis, &mut ramps);
            }
            let unsorted = ramps.clone();
            ramps.sort_unstable_by(|a, b| a.x.total_cmp(&b.x));
            let mut sweep = AreaSweep::new(&ramps);
            for i in 0..=32 {
                let x = f64::from(i) / 32.0;
                let expected = direct(&unsorted, x);
                let found = sweep.below(x);
                let error = (found - expected).abs() / cell.area();
                // The sum itself may be a hundred times the cell's area.
                prop_assert!(error <= TOLERANCE * expected.max(1.0), "{found} {expected} at {x}");
            }
        }
    }

    #[test]
    fn what_lies_in_the_plane_is_kept_apart() {
        let at = |x, step| AreaRamp { x, step, ..AreaRamp::default() };
        let ramps = [at(0.25, 1.0), at(0.5, 2.0), at(0.5, 4.0), at(1.0, 8.0)];
        let mut sweep = AreaSweep::new(&ramps);
        assert_eq!((sweep.below(0.5), sweep.in_plane(0.5)), (1.0, 6.0));
        assert_eq!((sweep.below(1.0), sweep.in_plane(1.0)), (7.0, 8.0));
        assert_eq!(AreaSweep::total(&ramps, 1.0), 15.0);
        assert_eq!(AreaSweep::total(&[], 1.0), 0.0);
    }
}
