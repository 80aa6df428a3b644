//! Solid angles.

/// The sum of the signed solid angles of triangles, seen from a point, over 4 pi.
pub fn winding_number(point: [f64; 3], triangles: impl Iterator<Item = [[f32; 3]; 3]>) -> f64 {
    let halves: f64 = triangles.map(|triangle| half_solid_angle(point, triangle)).sum();
    // -0.0 where there is nothing.
    halves / std::f64::consts::TAU + 0.0
}

/// Half of the solid angle of a triangle, positive where its back is seen: from inside of a surface
/// whose front is outside (van Oosterom and Strackee, 1983). 0 from its plane, also from the triangle
/// itself, so that a point on a closed surface gets the mean of both sides.
fn half_solid_angle(point: [f64; 3], triangle: [[f32; 3]; 3]) -> f64 {
    let [a, b, c] =
        triangle.map(|v| std::array::from_fn::<f64, 3, _>(|i| f64::from(v[i]) - point[i]));
    let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let length = |p: [f64; 3]| dot(p, p).sqrt();
    let normal = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
    let volume = dot(a, normal);
    if volume == 0.0 {
        return 0.0;
    }
    let (la, lb, lc) = (length(a), length(b), length(c));
    volume.atan2(la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb)
}
