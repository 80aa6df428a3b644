//! The control points of the teapot: Newell's, and Crow's bottom. Turned parts are stored as
//! profiles, handle and spout as halves.

use super::transform::Vec3;

/// A bicubic Bezier patch: four rows of four points.
pub(super) type ControlPoints = [[Vec3; 4]; 4];

/// A ring of a turned part: radius, distance from the axis of the inner control points of a
/// quarter circle, height.
type Ring = [f64; 3];

const RIM: [[Ring; 4]; 1] =
    [[[1.4, 0.784, 2.4], [1.3375, 0.749, 2.53125], [1.4375, 0.805, 2.53125], [1.5, 0.84, 2.4]]];

const BODY: [[Ring; 4]; 2] = [
    [[1.5, 0.84, 2.4], [1.75, 0.98, 1.875], [2.0, 1.12, 1.35], [2.0, 1.12, 0.9]],
    [[2.0, 1.12, 0.9], [2.0, 1.12, 0.45], [1.5, 0.84, 0.225], [1.5, 0.84, 0.15]],
];

const LID: [[Ring; 4]; 2] = [
    [[0.0, 0.0, 3.15], [0.8, 0.45, 3.15], [0.0, 0.0, 2.85], [0.2, 0.112, 2.7]],
    [[0.2, 0.112, 2.7], [0.4, 0.224, 2.55], [1.3, 0.728, 2.55], [1.3, 0.728, 2.4]],
];

const BOTTOM: [[Ring; 4]; 1] =
    [[[0.0, 0.0, 0.0], [1.425, 0.798, 0.0], [1.5, 0.84, 0.075], [1.5, 0.84, 0.15]]];

/// The halves at negative y.
const HANDLE: [ControlPoints; 2] = [
    [
        [[-1.6, 0.0, 2.025], [-1.6, -0.3, 2.025], [-1.5, -0.3, 2.25], [-1.5, 0.0, 2.25]],
        [[-2.3, 0.0, 2.025], [-2.3, -0.3, 2.025], [-2.5, -0.3, 2.25], [-2.5, 0.0, 2.25]],
        [[-2.7, 0.0, 2.025], [-2.7, -0.3, 2.025], [-3.0, -0.3, 2.25], [-3.0, 0.0, 2.25]],
        [[-2.7, 0.0, 1.8], [-2.7, -0.3, 1.8], [-3.0, -0.3, 1.8], [-3.0, 0.0, 1.8]],
    ],
    [
        [[-2.7, 0.0, 1.8], [-2.7, -0.3, 1.8], [-3.0, -0.3, 1.8], [-3.0, 0.0, 1.8]],
        [[-2.7, 0.0, 1.575], [-2.7, -0.3, 1.575], [-3.0, -0.3, 1.35], [-3.0, 0.0, 1.35]],
        [[-2.5, 0.0, 1.125], [-2.5, -0.3, 1.125], [-2.65, -0.3, 0.9375], [-2.65, 0.0, 0.9375]],
        [[-2.0, 0.0, 0.9], [-2.0, -0.3, 0.9], [-1.9, -0.3, 0.6], [-1.9, 0.0, 0.6]],
    ],
];

const SPOUT: [ControlPoints; 2] = [
    [
        [[1.7, 0.0, 1.425], [1.7, -0.66, 1.425], [1.7, -0.66, 0.6], [1.7, 0.0, 0.6]],
        [[2.6, 0.0, 1.425], [2.6, -0.66, 1.425], [3.1, -0.66, 0.825], [3.1, 0.0, 0.825]],
        [[2.3, 0.0, 2.1], [2.3, -0.25, 2.1], [2.4, -0.25, 2.025], [2.4, 0.0, 2.025]],
        [[2.7, 0.0, 2.4], [2.7, -0.25, 2.4], [3.3, -0.25, 2.4], [3.3, 0.0, 2.4]],
    ],
    [
        [[2.7, 0.0, 2.4], [2.7, -0.25, 2.4], [3.3, -0.25, 2.4], [3.3, 0.0, 2.4]],
        [[2.8, 0.0, 2.475], [2.8, -0.25, 2.475], [3.525, -0.25, 2.49375], [3.525, 0.0, 2.49375]],
        [[2.9, 0.0, 2.475], [2.9, -0.15, 2.475], [3.45, -0.15, 2.5125], [3.45, 0.0, 2.5125]],
        [[2.8, 0.0, 2.4], [2.8, -0.15, 2.4], [3.2, -0.15, 2.4], [3.2, 0.0, 2.4]],
    ],
];

/// The 32 patches: rim, body, handle, spout, lid, bottom.
pub(super) fn control_points() -> impl Iterator<Item = ControlPoints> {
    turned(&RIM, Sense::Clockwise)
        .chain(turned(&BODY, Sense::Clockwise))
        .chain(mirrored(&HANDLE))
        .chain(mirrored(&SPOUT))
        .chain(turned(&LID, Sense::Clockwise))
        .chain(turned(&BOTTOM, Sense::CounterClockwise))
}

/// The way round in which the quarters of a turned part follow each other, seen from above.
#[derive(Clone, Copy)]
enum Sense {
    Clockwise,
    CounterClockwise,
}

/// Four quarters of each profile, the first beginning at the x axis.
fn turned(profiles: &'static [[Ring; 4]], sense: Sense) -> impl Iterator<Item = ControlPoints> {
    profiles.iter().flat_map(move |profile| {
        (0..4).map(move |quarter| {
            profile.map(|[radius, inner, z]| {
                [[radius, 0.0], [radius, inner], [inner, radius], [0.0, radius]].map(|p| {
                    let [x, y] = (0..quarter).fold(p, |[x, y], _| [-y, x]);
                    let y = match sense {
                        Sense::Clockwise => -y,
                        Sense::CounterClockwise => y,
                    };
                    // Adding zero turns a negative zero into the positive one.
                    [x + 0.0, y + 0.0, z]
                })
            })
        })
    })
}

/// Each half, and after it its mirror image at positive y.
fn mirrored(halves: &'static [ControlPoints]) -> impl Iterator<Item = ControlPoints> {
    halves.iter().flat_map(|half| {
        let mirror = half.map(|[a, b, c, d]| [d, c, b, a].map(|[x, y, z]| [x, 0.0 - y, z]));
        [*half, mirror]
    })
}
