//! Affine transforms.

use crate::double::DoubleRay;

/// Why a matrix was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TransformError {
    /// An entry is NaN, infinite or too large.
    #[error(
        "row {row}, column {column} is {found}; every entry must be finite and at most 1e100 in size"
    )]
    Entry {
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
        /// Its value.
        found: f64,
    },
    /// It flattens space, or nearly so.
    #[error(
        "the condition of the linear part is {condition:.3e}; it must have an inverse, with a condition of at most 1e9"
    )]
    Singular {
        /// Norm of the linear part times norm of its inverse; infinite without one.
        condition: f64,
    },
}

/// An affine transform from an object's space to the scene's: `p -> linear p + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    linear: [[f64; 3]; 3],
    inverse: [[f64; 3]; 3],
    translation: [f64; 3],
    condition: f64,
}

/// Conditions beyond this are refused.
const MAX_CONDITION: f64 = 1e9;

fn apply(m: &[[f64; 3]; 3], p: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * p[0] + row[1] * p[1] + row[2] * p[2])
}

/// The largest sum of the sizes of a row's entries.
fn norm(m: &[[f64; 3]; 3]) -> f64 {
    m.iter().map(|row| row.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max)
}

impl Transform {
    /// Nothing moves.
    pub const IDENTITY: Transform = Transform {
        linear: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        inverse: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        translation: [0.0; 3],
        condition: 1.0,
    };

    /// The transform of a matrix of three rows, the last column of which is the translation.
    ///
    /// # Errors
    /// [`TransformError`] for an entry that is not finite or beyond `1e100`, and for a linear part without
    /// an inverse or with a condition beyond `1e9`.
    pub fn new(rows: [[f64; 4]; 3]) -> Result<Self, TransformError> {
        for (row, entries) in rows.iter().enumerate() {
            for (column, &found) in entries.iter().enumerate() {
                if found.is_nan() || found.abs() > 1e100 {
                    return Err(TransformError::Entry { row, column, found });
                }
            }
        }
        let linear = rows.map(|[a, b, c, _]| [a, b, c]);
        let translation = rows.map(|row| row[3]);
        // Scaled, so that products neither overflow nor underflow.
        let size = norm(&linear);
        let m = linear.map(|row| row.map(|x| x / size));
        let cofactor = |i: usize, j: usize| {
            let (r, s) = ((i + 1) % 3, (i + 2) % 3);
            let (c, d) = ((j + 1) % 3, (j + 2) % 3);
            m[r][c] * m[s][d] - m[r][d] * m[s][c]
        };
        let det = (0..3).map(|j| m[0][j] * cofactor(0, j)).sum::<f64>();
        let inverse: [[f64; 3]; 3] =
            std::array::from_fn(|i| std::array::from_fn(|j| cofactor(j, i) / det / size));
        let finite = inverse.iter().flatten().all(|x| x.is_finite());
        let condition = if finite { norm(&linear) * norm(&inverse) } else { f64::INFINITY };
        if condition > MAX_CONDITION {
            return Err(TransformError::Singular { condition });
        }
        Ok(Transform { linear, inverse, translation, condition })
    }

    /// A point of the object in the scene.
    pub fn point(&self, p: [f64; 3]) -> [f64; 3] {
        let q = apply(&self.linear, p);
        std::array::from_fn(|a| q[a] + self.translation[a])
    }

    /// A normal of the object in the scene, of unit length.
    pub fn normal(&self, n: [f64; 3]) -> [f64; 3] {
        let m = &self.inverse;
        let turned: [f64; 3] =
            std::array::from_fn(|a| m[0][a] * n[0] + m[1][a] * n[1] + m[2][a] * n[2]);
        let largest = turned.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let n = turned.map(|x| x / largest);
        let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
        n.map(|x| x / length)
    }

    /// A ray of the scene in the object's space, with the same parameters.
    pub fn ray_to_object(&self, ray: &DoubleRay) -> DoubleRay {
        let from: [f64; 3] = std::array::from_fn(|a| ray.origin[a] - self.translation[a]);
        let (origin, dir) = (apply(&self.inverse, from), apply(&self.inverse, ray.dir));
        DoubleRay { origin, dir, ..*ray }
    }

    /// By how much rounding is magnified on the way to the object and back.
    pub(super) fn condition(&self) -> f64 {
        self.condition
    }
}
