//! Lists of hits where a ray meets edges and vertices: which of the triangles there count.
//!
//! A ray that meets an edge or a vertex exactly hits each triangle around it ([`Triangle::meet`] counts edges as inside, so that no
//! ray is lost at a rim). In a list it shall cross the surface there as its neighbours do. So of the hits that touch
//! one edge or vertex those alone stay that a ray would have which is moved by an infinitely small step into the first of
//! them: where a surface goes on one, at a silhouette two, at a rim one. A closed surface is entered as often as it is left then, and the first
//! hit of a ray is the first of its list. docs/numerics.md has the argument.

use crate::primitive::{Triangle, edge_exactly};
use crate::ray::Shear;

/// The ends of the edge opposite of each vertex, in the order of the edge functions of [`Triangle::meet`].
const ENDS: [[usize; 2]; 3] = [[2, 1], [0, 2], [1, 0]];

/// A triangle in the plane across a ray, an edge or a vertex of which lies on the ray.
struct Outline {
    corners: [[f64; 3]; 3],
    edges: [f64; 3],
}

impl Outline {
    /// None if the ray meets neither edge nor vertex.
    fn new(frame: &Shear, vertices: [[f64; 3]; 3]) -> Option<Outline> {
        let corners = [0, 1, 2].map(|i| Triangle::corner(|axis| vertices[i][axis], frame));
        let edges = ENDS.map(|[p, q]| edge_exactly(corners[p], corners[q]));
        edges.contains(&0.0).then_some(Outline { corners, edges })
    }

    /// The vertex that lies on the ray, or the ends of the edge that does.
    fn touched(&self) -> impl Iterator<Item = [f64; 3]> {
        let on = |edge: usize| self.edges[edge] == 0.0;
        let single = (0..3).filter(|&edge| on(edge)).count() == 1;
        // A vertex lies on both edges but the one opposite of it.
        let counts = move |i: &usize| {
            let edges = (0..3).filter(|&edge| edge != *i && on(edge)).count();
            edges == if single { 1 } else { 2 }
        };
        (0..3).filter(counts).map(|i| self.corners[i])
    }

    /// True if the two share what lies on the ray, or a part of it.
    fn meets(&self, other: &Outline) -> bool {
        self.touched().any(|p| other.touched().any(|q| p == q))
    }

    /// From the ray to the middle of the triangle.
    fn inwards(&self) -> [f64; 2] {
        [0, 1].map(|a| self.corners.iter().map(|p| p[a]).sum::<f64>() / 3.0)
    }

    /// True if the ray is inside once it is moved by an infinitely small part of a step, and an infinitely smaller one at a
    /// right angle. Both triangles of an edge see the same sign.
    fn holds(&self, [x, y]: [f64; 2]) -> bool {
        let sign = |edge: usize| {
            let [p, q] = ENDS[edge].map(|i| self.corners[i]);
            let (dx, dy) = (p[0] - q[0], p[1] - q[1]);
            match (self.edges[edge], x * dy - y * dx) {
                (0.0, 0.0) => -y * dy - x * dx,
                (0.0, moved) => moved,
                (edge, _) => edge,
            }
        };
        let signs = [sign(0), sign(1), sign(2)];
        signs.iter().all(|&s| s > 0.0) || signs.iter().all(|&s| s < 0.0)
    }
}

/// True if two of `n` hits in order tie and touch an edge or a vertex each: others are for certain to stay. Coincident triangles tie
/// all along, so this is asked before anything is set up.
pub fn concerns(
    n: usize,
    frame: &Shear,
    tie: impl Fn(usize, usize) -> bool,
    triangle: impl Fn(usize) -> Option<[[f64; 3]; 3]>,
) -> bool {
    let touches = |i: usize| triangle(i).is_some_and(|t| Outline::new(frame, t).is_some());
    // Those of the run of ties so far that touch something.
    let mut touching = None;
    for i in 1..n {
        if tie(i - 1, i) {
            let touching = touching.get_or_insert_with(|| usize::from(touches(i - 1)));
            *touching += usize::from(touches(i));
            if *touching > 1 {
                return true;
            }
        } else {
            touching = None;
        }
    }
    false
}

/// Leaves out of the hits of a ray, which are in order, those that do not count; true if there were any.
///
/// `tie` says of two in turn whether their parameters may be one but for rounding. Only for such the triangle is asked for; what is
/// none stays.
pub fn leave_out<H>(
    hits: &mut Vec<H>,
    frame: &Shear,
    tie: impl Fn(&H, &H) -> bool,
    triangle: impl Fn(&H) -> Option<[[f64; 3]; 3]>,
) -> bool {
    let mut keep = vec![true; hits.len()];
    let (mut start, mut changed) = (0, false);
    while start < hits.len() {
        let ties = hits[start..].windows(2).take_while(|pair| tie(&pair[0], &pair[1])).count();
        let end = start + ties + 1;
        if ties > 0 {
            let outline = |hit: &H| Outline::new(frame, triangle(hit)?);
            let mut outlines: Vec<Option<Outline>> = hits[start..end].iter().map(outline).collect();
            for i in 0..outlines.len() {
                let Some(first) = outlines[i].take() else { continue };
                let step = first.inwards();
                for (j, other) in outlines.iter_mut().enumerate().skip(i + 1) {
                    if other.as_ref().is_some_and(|other| other.meets(&first)) {
                        keep[start + j] = other.take().is_some_and(|other| other.holds(step));
                        changed |= !keep[start + j];
                    }
                }
            }
        }
        start = end;
    }
    let mut kept = keep.iter();
    hits.retain(|_| *kept.next().expect("one entry a hit"));
    changed
}

/// True if two parameters in turn may be one: equal or next to each other.
#[inline(always)]
pub fn tie(a: f32, b: f32) -> bool {
    b <= a.next_up()
}

/// Where a parameter is followed by one that it may [`tie`] with, or nearly so, in increasing order. Many are looked at at once: nearly all lists
/// have none.
pub fn near_ties(t: &[f32]) -> impl Iterator<Item = usize> {
    const CHUNK: usize = 64;
    /// Numbers in order as integers; both zeros are one.
    #[inline(always)]
    fn rank(t: f32) -> u32 {
        let bits = (t + 0.0).to_bits();
        bits ^ (((bits as i32) >> 31) as u32 | 1 << 31)
    }
    // From the largest number below 0 to 0 it is two steps.
    let near = |pair: &[f32]| rank(pair[1]).wrapping_sub(rank(pair[0])) <= 2;
    (0..t.len().saturating_sub(1)).step_by(CHUNK).flat_map(move |start| {
        let chunk = &t[start..t.len().min(start + CHUNK + 1)];
        let any = chunk.windows(2).fold(false, |any, pair| any | near(pair));
        let pairs = if any { chunk } else { &[] };
        pairs
            .windows(2)
            .enumerate()
            .filter(move |(_, pair)| near(pair))
            .map(move |(i, _)| start + i)
    })
}

/// The same in `f64`, where parameters of triangles at one edge are apart by no more than 2^-42 of their distance
/// ([`Triangle`]).
#[inline(always)]
pub fn double_tie(a: f64, b: f64) -> bool {
    const SHARE: f64 = 1.0 / (1u64 << 38) as f64;
    b - a <= SHARE * a.abs().max(b.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every pair that ties is found, in lists longer than a chunk too, and few others.
    #[test]
    fn ties_are_found_wherever_they_stand() {
        let up = |t: f32| t.next_up();
        let kinds: [fn(f32) -> f32; 6] =
            [|t| t, |t| t.next_up(), |t| 2.0 * t.abs() + 1.0, |t| -t, |_| -0.0, |t| t - 1.0];
        for n in [0, 1, 2, 63, 64, 65, 66, 128, 129, 400] {
            for seed in 0..40u32 {
                let mut t = vec![[0.5f32, -0.0, -3.0, f32::MAX][seed as usize % 4]];
                let mut state = seed;
                while t.len() < n {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    // Mostly numbers that do not tie.
                    let kind = if state >> 28 < 12 { 2 } else { (state >> 16) as usize % 6 };
                    t.push(kinds[kind](*t.last().unwrap()).clamp(-1e30, 1e30));
                }
                t.truncate(n);
                let found: Vec<usize> = near_ties(&t).collect();
                let ties = |i: &usize| t[*i] <= t[i + 1] && tie(t[*i], t[i + 1]);
                let wanted: Vec<usize> = (0..n.saturating_sub(1)).filter(ties).collect();
                assert!(wanted.iter().all(|i| found.contains(i)), "{t:?}: {wanted:?}, {found:?}");
                let near = |&i: &usize| t[i] <= t[i + 1] && t[i + 1] <= up(up(t[i]));
                assert!(found.iter().all(near), "{t:?}: {found:?}");
                assert!(found.is_sorted());
            }
        }
    }
}
