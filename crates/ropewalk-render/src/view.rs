//! The pinhole camera of NFF.

use crate::error::RenderError;
use crate::vec3::{Vec3, add, add_scaled, cross, scale, sub, unit};
use ropewalk::{Aabb, Ray};
use ropewalk_scene::Camera;

/// Full view angle of [`default_camera`] in degrees, that of most SPD scenes.
const DEFAULT_ANGLE: f64 = 45.0;

/// Picture size of [`default_camera`], that of the SPD scenes.
const DEFAULT_RESOLUTION: [u32; 2] = [512, 512];

/// A camera that sees the whole of `bounds`, from the front, right and above (`z` is up).
pub fn default_camera(bounds: &Aabb) -> Camera {
    let (center, radius) = if bounds.is_empty() {
        ([0.0; 3], 1.0)
    } else {
        let middle = |a: usize| 0.5 * (f64::from(bounds.min[a]) + f64::from(bounds.max[a]));
        let radius = 0.5 * bounds.diagonal();
        (std::array::from_fn(middle), if radius > 0.0 { radius } else { 1.0 })
    };
    // The sphere around the box touches the view cone.
    let distance = radius / (0.5 * DEFAULT_ANGLE).to_radians().sin();
    let towards = unit([1.0, -2.0, 1.0]).unwrap_or([0.0, -1.0, 0.0]);
    Camera {
        from: add_scaled(center, distance, towards),
        at: center,
        up: [0.0, 0.0, 1.0],
        angle: DEFAULT_ANGLE,
        hither: 0.0,
        resolution: DEFAULT_RESOLUTION,
    }
}

/// A camera and a picture size made into rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    eye: Vec3,
    /// Direction through the upper left corner of the frame.
    corner: Vec3,
    /// From there one pixel to the right.
    right: Vec3,
    /// From there one pixel down.
    down: Vec3,
}

impl View {
    /// The view of `camera` for a picture of `size` pixels.
    ///
    /// The view angle spans the frame's width from the outer edge of the first column to that of
    /// the last, so that under the SPD rules the outermost corner rays enclose it. Pixels are
    /// square.
    ///
    /// Deviation: the NFF text measures the angle between the *centres* of the outermost pixel rows
    /// (and assumes a square picture); that frame is wider by 1/(w - 1), 0.2 % at 512 pixels.
    pub fn new(camera: &Camera, size: [u32; 2]) -> Result<Self, RenderError> {
        let fail = |what: String| Err(RenderError::Camera { what });
        let apart = sub(camera.at, camera.from);
        let largest = apart.iter().fold(0.0f64, |a, x| a.max(x.abs()));
        // Squares may overflow.
        let Some(forward) = unit(apart).or_else(|| unit(scale(apart, 1.0 / largest))) else {
            return fail(format!(
                "from {:?} and at {:?} must be two different finite points",
                camera.from, camera.at
            ));
        };
        let Some(side) = unit(cross(forward, camera.up)) else {
            return fail(format!("up {:?} must not run along the view direction", camera.up));
        };
        if !(camera.angle > 0.0 && camera.angle < 180.0) {
            return fail(format!("angle {} must lie between 0 and 180 degrees", camera.angle));
        }
        let half = (0.5 * camera.angle).to_radians().tan();
        let [w, h] = size.map(f64::from);
        let pixel = 2.0 * half / w;
        let upward = cross(side, forward);
        let corner = add(forward, add(scale(side, -half), scale(upward, 0.5 * h * pixel)));
        Ok(View {
            eye: camera.from,
            corner,
            right: scale(side, pixel),
            down: scale(upward, -pixel),
        })
    }

    /// The eye point.
    pub fn eye(&self) -> Vec3 {
        self.eye
    }

    /// The eye ray through a point of the frame, in pixels from its upper left corner; its
    /// direction has unit length.
    pub fn ray(&self, x: f64, y: f64) -> Ray {
        let dir = add_scaled(add_scaled(self.corner, x, self.right), y, self.down);
        let dir = unit(dir).unwrap_or([0.0; 3]);
        Ray::new(self.eye.map(|c| c as f32), dir.map(|c| c as f32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vec3::dot;

    fn camera() -> Camera {
        Camera {
            from: [0.0, -2.0, 0.0],
            at: [0.0, 1.0, 0.0],
            up: [0.0, 0.0, 3.0],
            angle: 90.0,
            hither: 0.0,
            resolution: [8, 4],
        }
    }

    #[test]
    fn frame_is_upright_and_spans_the_angle() {
        let view = View::new(&camera(), [8, 4]).expect("a good camera");
        let [x, y, z] = view.ray(8.0, 0.0).dir;
        assert!((x - y).abs() < 1e-6 && (z - 0.5 * y).abs() < 1e-6, "{x} {y} {z}");
        assert_eq!(view.ray(4.0, 2.0).dir, [0.0, 1.0, 0.0]);
    }

    #[test]
    fn unusable_cameras_are_refused() {
        let bad = [
            Camera { at: [0.0, -2.0, 0.0], ..camera() },
            Camera { up: [0.0, 1.0, 0.0], ..camera() },
            Camera { angle: 180.0, ..camera() },
            Camera { angle: f64::NAN, ..camera() },
            Camera { from: [f64::NAN, 0.0, 0.0], ..camera() },
            Camera { at: [f64::INFINITY, 0.0, 0.0], ..camera() },
        ];
        for camera in bad {
            assert!(matches!(View::new(&camera, [8, 8]), Err(RenderError::Camera { .. })));
        }
    }

    #[test]
    fn default_camera_sees_all_corners() {
        let bounds = Aabb::new([-1.0, 2.0, 3.0], [5.0, 2.5, 3.0]);
        let camera = default_camera(&bounds);
        let forward = unit(sub(camera.at, camera.from)).expect("distinct");
        for i in 0..8 {
            let p: Vec3 = std::array::from_fn(|a| {
                f64::from(if i >> a & 1 == 0 { bounds.min[a] } else { bounds.max[a] })
            });
            let to = unit(sub(p, camera.from)).expect("distinct");
            assert!(dot(to, forward) >= (0.5 * camera.angle).to_radians().cos() - 1e-9);
        }
    }
}
