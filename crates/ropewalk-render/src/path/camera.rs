//! The camera: a thin lens, and a place for it from which the whole mesh is seen.

use crate::error::RenderError;
use crate::vec3;
use crate::view::View;
use glam::{DMat3, DVec3, Vec3};
use ropewalk::Ray;
use ropewalk_scene::{Camera, Mesh};
use std::f64::consts::TAU;

/// Full view angle of [`fitted_camera`] in degrees, across.
const ANGLE: f64 = 32.0;

/// From where it looks: turned so far to the right of the front, and raised so far, in degrees.
const TURN: f64 = 30.0;
const RISE: f64 = 22.0;

/// The share of the picture that the mesh fills at most, across or down.
const FILL: f64 = 0.78;

/// Halvings of the range in which the middle of the picture is looked for.
const CENTRING: u32 = 12;

/// The axis that points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Up {
    /// As in glTF.
    #[default]
    Y,
    /// As in CAD.
    Z,
}

impl Up {
    /// Unit vectors: to the right, to the front, upwards.
    pub fn axes(self) -> [[f64; 3]; 3] {
        match self {
            Up::Y => [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]],
            Up::Z => [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]],
        }
    }
}

/// A lens of finite size, which makes things out of focus blurred.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lens {
    /// Diameter in units of the scene; 0 is a pinhole.
    pub aperture: f64,
    /// Distance of the plane in focus, along the view direction; `None` is the point looked at.
    pub focus: Option<f64>,
}

/// A camera that sees all of `vertices` in a picture of `size` pixels, from above in front and to the right.
pub fn fitted_camera(vertices: &[[f64; 3]], size: [u32; 2], up: Up) -> Camera {
    let [right, front, above] = up.axes().map(DVec3::from_array);
    let (azimuth, rise) = (TURN.to_radians(), RISE.to_radians());
    let towards = rise.cos() * (azimuth.sin() * right + azimuth.cos() * front) + rise.sin() * above;
    let forward = -towards;
    let side = forward.cross(above).normalize();
    let upward = side.cross(forward);
    let across = (0.5 * ANGLE).to_radians().tan();
    let down = across * f64::from(size[1]) / f64::from(size[0]);
    // Each side of the view is a plane through the eye: how far out it must be for all points to be inside.
    let slopes = [across * FILL, down * FILL];
    let mut far = [f64::NEG_INFINITY; 4];
    let mut depth = [f64::INFINITY, f64::NEG_INFINITY];
    for vertex in vertices {
        let p = DVec3::from_array(*vertex);
        let (x, y, z) = (p.dot(side), p.dot(upward), p.dot(forward));
        let sides = [x - slopes[0] * z, -x - slopes[0] * z, y - slopes[1] * z, -y - slopes[1] * z];
        for (far, out) in far.iter_mut().zip(sides) {
            *far = far.max(out);
        }
        depth = [depth[0].min(z), depth[1].max(z)];
    }
    if vertices.is_empty() {
        (far, depth) = ([1.0; 4], [0.0; 2]);
    }
    let back = ((far[0] + far[1]) / (2.0 * slopes[0])).max((far[2] + far[3]) / (2.0 * slopes[1]));
    let middle = 0.5 * (depth[0] + depth[1]);
    // A single point is seen from some distance too.
    let back = if back + middle > 0.0 { back } else { 1.0 - middle };
    let centred = |axis: DVec3, ends: [f64; 2]| {
        // Moved sideways until both ends look equally far off the middle.
        let (mut low, mut high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        for _ in 0..CENTRING {
            let mid = 0.5 * (low + high);
            let slopes = vertices.iter().map(|v| {
                let p = DVec3::from_array(*v);
                (p.dot(axis) - mid) / (p.dot(forward) + back)
            });
            let (least, most) =
                slopes.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
            if least + most > 0.0 { low = mid } else { high = mid }
        }
        0.5 * (low + high)
    };
    // Both planes of a pair meet the axis where the eye may be at most.
    let ends = |k: usize, slope: f64| [far[k] - slope * back, slope * back - far[k + 1]];
    let x = centred(side, ends(0, slopes[0]));
    let y = centred(upward, ends(2, slopes[1]));
    let from = x * side + y * upward - back * forward;
    let at = from + (back + middle) * forward;
    Camera {
        from: from.to_array(),
        at: at.to_array(),
        up: above.to_array(),
        angle: ANGLE,
        hither: 0.0,
        resolution: size,
    }
}

/// A camera moved around the point that it looks at, by degrees around the axis that points up.
pub fn orbited(camera: &Camera, up: Up, degrees: f64) -> Camera {
    let axis = DVec3::from_array(up.axes()[2]);
    let turn = DMat3::from_axis_angle(axis, degrees.to_radians());
    let at = DVec3::from_array(camera.at);
    let from = at + turn * (DVec3::from_array(camera.from) - at);
    let up = turn * DVec3::from_array(camera.up);
    Camera { from: from.to_array(), up: up.to_array(), ..*camera }
}

/// Points around all that a mesh covers when it is turned around the middle of its box.
pub fn swept(mesh: &Mesh, up: Up) -> Vec<[f64; 3]> {
    const LEVELS: usize = 64;
    const TURNS: u32 = 32;
    let [right, front, above] = up.axes().map(DVec3::from_array);
    let points = || mesh.vertices.iter().map(|&v| DVec3::from_array(v));
    let (low, high) = points()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let middle = 0.5 * low + 0.5 * high;
    let (bottom, tall) = (low.dot(above), (high - low).dot(above));
    let mut radii = [0f64; LEVELS];
    for p in points() {
        let level = ((p.dot(above) - bottom) / tall * LEVELS as f64) as usize;
        let out = (p - middle) - (p - middle).dot(above) * above;
        let radius = &mut radii[level.min(LEVELS - 1)];
        *radius = radius.max(out.length());
    }
    let ring = |(level, &radius): (usize, &f64)| {
        (0..TURNS).flat_map(move |k| {
            let (sine, cosine) = (TAU * f64::from(k) / f64::from(TURNS)).sin_cos();
            let out = middle + radius * (cosine * right + sine * front);
            let base = out - out.dot(above) * above;
            [level, level + 1]
                .map(|l| (base + (bottom + tall * l as f64 / LEVELS as f64) * above).to_array())
        })
    };
    radii.iter().enumerate().filter(|(_, radius)| **radius > 0.0).flat_map(ring).collect()
}

/// A camera made into rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LensView {
    view: View,
    side: DVec3,
    upward: DVec3,
    forward: DVec3,
    radius: f64,
    focus: f64,
}

impl LensView {
    /// The view of a camera and its lens for a picture of `size` pixels.
    pub fn new(camera: &Camera, lens: &Lens, size: [u32; 2]) -> Result<Self, RenderError> {
        let view = View::new(camera, size)?;
        let fail = |what: String| Err(RenderError::Camera { what });
        let way = vec3::sub(camera.at, camera.from);
        let forward = DVec3::from_array(vec3::unit(way).unwrap_or([0.0, 0.0, 1.0]));
        let side = forward.cross(DVec3::from_array(camera.up)).normalize();
        let focus = lens.focus.unwrap_or(vec3::length(way));
        if !(focus > 0.0 && focus.is_finite()) {
            return fail(format!("the distance in focus is {focus}: expected more than 0"));
        }
        if !(lens.aperture >= 0.0 && lens.aperture.is_finite()) {
            return fail(format!("the aperture is {}: expected 0 or more", lens.aperture));
        }
        let (radius, upward) = (0.5 * lens.aperture, side.cross(forward));
        Ok(LensView { view, side, upward, forward, radius, focus })
    }

    /// The ray through a point of the picture, in pixels from its upper left corner, and a point of the lens in the
    /// unit square; its direction has unit length.
    pub fn ray(&self, x: f64, y: f64, lens: [f32; 2]) -> Ray {
        let ray = self.view.ray(x, y);
        if self.radius == 0.0 {
            return ray;
        }
        let direction = DVec3::from_array(ray.dir.map(f64::from));
        let eye = DVec3::from_array(self.view.eye());
        let sharp = eye + direction * (self.focus / direction.dot(self.forward));
        let (r, phi) = (self.radius * f64::from(lens[0]).sqrt(), TAU * f64::from(lens[1]));
        let origin = eye + r * (phi.cos() * self.side + phi.sin() * self.upward);
        let towards: Vec3 = (sharp - origin).normalize().as_vec3();
        Ray::new(origin.as_vec3().to_array(), towards.to_array())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fitted_cameras_see_all_and_fill_the_picture() {
        let cloud: Vec<[f64; 3]> = (0..50u32)
            .map(|i| [7, 11, 13].map(|k| f64::from(i * k % 17) - 5.0))
            .map(|p| [p[0], 0.2 * p[1] + 90.0, p[2]])
            .collect();
        for (size, up) in [([64, 64], Up::Y), ([160, 40], Up::Z), ([30, 90], Up::Y)] {
            let camera = fitted_camera(&cloud, size, up);
            let view = View::new(&camera, size).expect("a good camera");
            let [a, b, c] = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(|(x, y)| {
                let d = view.ray(x * f64::from(size[0]), y * f64::from(size[1])).dir;
                DVec3::from_array(d.map(f64::from))
            });
            // Places in the picture, from the corner's direction and the edges.
            let forward =
                (DVec3::from_array(camera.at) - DVec3::from_array(camera.from)).normalize();
            let flat = |d: DVec3| d / d.dot(forward);
            let (corner, across, down) = (flat(a), flat(b) - flat(a), flat(c) - flat(a));
            let mut box_ = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
            for p in &cloud {
                let d = flat(DVec3::from_array(*p) - DVec3::from_array(camera.from)) - corner;
                let place = [across, down].map(|axis| d.dot(axis) / axis.length_squared());
                for (k, x) in place.into_iter().enumerate() {
                    box_ = [
                        if k == 0 {
                            [box_[0][0].min(x), box_[0][1]]
                        } else {
                            [box_[0][0], box_[0][1].min(x)]
                        },
                        if k == 0 {
                            [box_[1][0].max(x), box_[1][1]]
                        } else {
                            [box_[1][0], box_[1][1].max(x)]
                        },
                    ];
                }
            }
            let extents = [0, 1].map(|k| box_[1][k] - box_[0][k]);
            assert!((extents[0].max(extents[1]) - FILL).abs() < 1e-3, "{extents:?}");
            for k in 0..2 {
                assert!((box_[0][k] + box_[1][k] - 1.0).abs() < 1e-3, "centred: {box_:?}");
            }
        }
    }

    #[test]
    fn rays_of_the_lens_meet_in_the_plane_in_focus() {
        let camera = Camera {
            from: [0.0, -2.0, 0.0],
            at: [0.0, 3.0, 0.0],
            up: [0.0, 0.0, 1.0],
            angle: 60.0,
            hither: 0.0,
            resolution: [10, 10],
        };
        let lens = Lens { aperture: 0.5, focus: None };
        let view = LensView::new(&camera, &lens, [10, 10]).expect("a good camera");
        let at = |u: [f32; 2]| {
            let ray = view.ray(2.0, 7.0, u);
            let t = (3.0 - f64::from(ray.origin[1])) / f64::from(ray.dir[1]);
            (ray.origin, DVec3::from_array(ray.at(t as f32)))
        };
        let (middle, sharp) = at([0.0, 0.0]);
        for u in [[0.9, 0.1], [0.5, 0.6], [0.999, 0.9]] {
            let (origin, point) = at(u);
            assert!((point - sharp).length() < 1e-5, "{point} {sharp}");
            let out = Vec3::from_array(origin) - Vec3::from_array(middle);
            assert!((out.length() - 0.25 * u[0].sqrt()).abs() < 1e-6 && out.y.abs() < 1e-6);
        }
        for lens in [Lens { aperture: -1.0, focus: None }, Lens { aperture: 0.0, focus: Some(0.0) }]
        {
            assert!(LensView::new(&camera, &lens, [10, 10]).is_err());
        }
    }
}
