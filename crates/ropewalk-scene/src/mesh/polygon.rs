//! Polygons to triangles.

/// Corners of a polygon that is not convex, at most: ears are looked for in quadratic time.
const MOST: usize = 1024;

/// Cuts a polygon of four or more corners: one that is convex by diagonals from its first corner, a
/// quadrilateral that is not from the corner where it is caved in, others ear by ear (Meisters 1975), as seen along the
/// sum of its corners' turns (Newell). What has no ears left, as it crosses itself, is cut from one corner. Triangles
/// are given by the numbers of their corners in the polygon, always two fewer than corners.
///
/// # Errors
/// [`MOST`] if it is neither convex nor that small.
pub fn cut(
    vertices: &[[f64; 3]],
    polygon: &[u32],
    mut push: impl FnMut([usize; 3]),
) -> Result<(), usize> {
    let n = polygon.len();
    let at = |i: usize| vertices[polygon[i % n] as usize];
    let mut normal = [0.0; 3];
    let origin = at(0);
    let from = |i: usize| -> [f64; 3] { std::array::from_fn(|a| at(i)[a] - origin[a]) };
    for i in 1..n - 1 {
        let turn = cross(from(i), from(i + 1));
        (0..3).for_each(|a| normal[a] += turn[a]);
    }
    let turn = |i: usize, j: usize, k: usize| -> f64 {
        let edge = |p: usize, q: usize| std::array::from_fn(|a| at(q)[a] - at(p)[a]);
        dot(cross(edge(i, j), edge(i, k)), normal)
    };
    let caved = (0..n).filter(|&i| turn(i, (i + 1) % n, (i + 2) % n) < 0.0).map(|i| (i + 1) % n);
    let caved: Vec<usize> = caved.take(2).collect();
    // What turns only one way and never goes around twice; two caved corners of four cross.
    let first = match caved[..] {
        [] => Some(0),
        [corner] if n == 4 => Some(corner),
        _ => None,
    };
    if let Some(first) = first {
        let corner = |i: usize| (first + i) % n;
        (1..n - 1).for_each(|i| push([corner(0), corner(i), corner(i + 1)]));
        return Ok(());
    }
    if n > MOST {
        return Err(MOST);
    }
    let mut left: Vec<usize> = (0..n).collect();
    while left.len() > 3 {
        let m = left.len();
        let is_ear = |&j: &usize| {
            let (p, q, r) = (left[(j + m - 1) % m], left[j], left[(j + 1) % m]);
            let holds = |&&i: &&usize| {
                ![p, q, r].contains(&i)
                    && ![p, q, r].iter().any(|&c| polygon[c] == polygon[i])
                    && turn(p, q, i) >= 0.0
                    && turn(q, r, i) >= 0.0
                    && turn(r, p, i) >= 0.0
            };
            turn(p, q, r) > 0.0 && !left.iter().any(|i| holds(&i))
        };
        let Some(j) = (0..m).find(is_ear) else {
            break;
        };
        let corner = |i: usize| left[i % m];
        push([corner(j + m - 1), corner(j), corner(j + 1)]);
        left.remove(j);
    }
    (1..left.len() - 1).for_each(|i| push([left[0], left[i], left[i + 1]]));
    Ok(())
}

fn cross(p: [f64; 3], q: [f64; 3]) -> [f64; 3] {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}

fn dot(p: [f64; 3], q: [f64; 3]) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[[f64; 2]]) -> (f64, usize) {
        let vertices: Vec<[f64; 3]> = points.iter().map(|p| [p[0], p[1], 0.5]).collect();
        let polygon: Vec<u32> = (0..points.len() as u32).collect();
        let mut faces = Vec::new();
        cut(&vertices, &polygon, |face| faces.push(face)).unwrap();
        let of = |f: &[usize; 3]| {
            let [a, b, c] = f.map(|i| points[i]);
            0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
        };
        assert!(faces.iter().all(|f| of(f) >= 0.0), "{faces:?}");
        (faces.iter().map(of).sum(), faces.len())
    }

    #[test]
    fn areas_stay_and_no_triangle_is_turned() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert_eq!(area(&square), (1.0, 2));
        // A dart, its dent at each corner in turn.
        let dart = [[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]];
        for turned in 0..4 {
            let mut dart = dart;
            dart.rotate_left(turned);
            assert_eq!(area(&dart), (4.0, 2), "{turned}");
        }
        let comb: Vec<[f64; 2]> = (0..9)
            .map(|i| [f64::from(8 - i), if i % 2 == 0 { 3.0 } else { 1.0 }])
            .chain([[0.0, 0.0], [8.0, 0.0]])
            .collect();
        assert_eq!(area(&comb), (16.0, 9));
    }

    #[test]
    fn whatever_it_is_it_ends() {
        let star: Vec<[f64; 3]> = (0..5)
            .map(|i| (f64::from(i) * 2.0 * std::f64::consts::TAU / 5.0).sin_cos())
            .map(|(x, y)| [x, y, 0.0])
            .collect();
        let flat = vec![[1.0, 2.0, 3.0]; 6];
        for vertices in [star, flat] {
            let polygon: Vec<u32> = (0..vertices.len() as u32).collect();
            let mut faces = Vec::new();
            cut(&vertices, &polygon, |face| faces.push(face)).unwrap();
            assert_eq!(faces.len(), vertices.len() - 2);
        }
        let zigzag: Vec<[f64; 3]> =
            (0..2000).map(|i| [f64::from(i), f64::from(i * i % 7), 0.0]).collect();
        let polygon: Vec<u32> = (0..2000).collect();
        assert_eq!(cut(&zigzag, &polygon, |_| {}), Err(MOST));
    }
}
