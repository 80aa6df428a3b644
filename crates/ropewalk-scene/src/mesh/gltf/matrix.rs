//! Transforms of nodes.

use super::super::error::{Result, wrong};
use super::super::placed::{Matrix, is_mirrored};
use super::{array, part};
use serde_json::Value;

/// Rounded, after it is scaled to a length that `f32` holds.
pub fn small(v: [f64; 3]) -> [f32; 3] {
    let most = v.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    if most > 0.0 && most.is_finite() { v.map(|x| (x / most) as f32) } else { [0.0; 3] }
}

/// The matrix that moves normals, up to a factor: of cofactors, with the sign of the determinant, since faces of mirrored
/// meshes are turned.
pub fn cofactors(m: &Matrix) -> [[f64; 3]; 3] {
    let sign = if is_mirrored(m) { -1.0 } else { 1.0 };
    std::array::from_fn(|i| {
        let (p, q) = (m[(i + 1) % 3], m[(i + 2) % 3]);
        std::array::from_fn(|j| {
            let (k, l) = ((j + 1) % 3, (j + 2) % 3);
            sign * (p[k] * q[l] - p[l] * q[k])
        })
    })
}

/// The transform of a node: its matrix, or translation times rotation times scale.
pub fn transform(node: &Value, name: &str) -> Result<Matrix> {
    if !node["matrix"].is_null() {
        let m = numbers(node, "matrix", [0.0; 16], name)?;
        // Column by column.
        return Ok([0, 1, 2].map(|i| [m[i], m[4 + i], m[8 + i], m[12 + i]]));
    }
    let (t, s) =
        (numbers(node, "translation", [0.0; 3], name)?, numbers(node, "scale", [1.0; 3], name)?);
    Ok(composed(t, numbers(node, "rotation", NO_ROTATION, name)?, s))
}

/// The quaternion that turns nothing.
pub const NO_ROTATION: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// Translation times rotation, a quaternion with its real part last, times scale.
pub fn composed(t: [f64; 3], [x, y, z, w]: [f64; 4], s: [f64; 3]) -> Matrix {
    let r = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ];
    [0, 1, 2].map(|i| [r[i][0] * s[0], r[i][1] * s[1], r[i][2] * s[2], t[i]])
}

/// One transform behind another; `a` is done last.
pub fn times(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let last = if j == 3 { a[i][3] } else { 0.0 };
            a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j] + last
        })
    })
}

/// So many numbers of a node, or what stands for them.
fn numbers<const N: usize>(
    node: &Value,
    key: &str,
    default: [f64; N],
    name: &str,
) -> Result<[f64; N]> {
    if node[key].is_null() {
        return Ok(default);
    }
    let values: Vec<f64> = array(node, key).iter().filter_map(Value::as_f64).collect();
    let found = || wrong(part(format!("{name}.{key}")), format!("{N} numbers"), &node[key]);
    values.try_into().map_err(|_| found())
}
