//! Rays of a picture in rows (scanlines), as arrays have them, moved into tiles: neighbours in a picture are alike in both
//! directions, and a beam of 16 x 8 of them meets far less of the scene than one of 128 x 1.
//!
//! ```text
//! find the rows    the ray at which a row ends is far from the one before; twice that gives the width
//! move             tiles of 16 x 8, along a Morton curve, some thousand rays at a time
//! answer           each ray where it stood
//! ```
//! Rays from one point and parallel rays are told by where they go, or by where they start. A wrong guess costs time
//! and changes no answer.

use super::beam::Answers;
use crate::ray::Ray;

/// Fewest rays that are worth a look, and fewest in a row.
const FEWEST: usize = 1024;
const NARROWEST: usize = 16;

/// Fewest rows that are worth moving.
const FEWEST_ROWS: usize = 4;

/// A row ends where rays are so much farther apart than the two before, squared.
const JUMP: f32 = 25.0;

/// Rays of neighbouring rows are so much farther apart than those in a row at most, squared.
const APART: f32 = 36.0;

/// Scanlines and rays that are looked at to be sure.
const SAMPLE: usize = 64;

/// Columns and rows of a tile.
const COLUMNS: usize = 16;
pub const ROWS: usize = 8;

/// Rays that are moved at a time, as many rows more as fill a band: they stay in the second cache.
const TOGETHER: usize = 8192;

/// Columns and rows of a tile's rays along a Morton curve, columns first.
static CURVE: [(u8, u8); COLUMNS * ROWS] = {
    let mut curve = [(0, 0); COLUMNS * ROWS];
    let mut i = 0;
    while i < curve.len() {
        let (mut x, mut y, mut bit) = (0, 0, 0);
        while bit < 4 {
            x |= (i >> (2 * bit) & 1) << bit;
            y |= (i >> (2 * bit + 1) & 1) << bit;
            bit += 1;
        }
        curve[i] = (x as u8, y as u8);
        i += 1;
    }
    curve
};

/// How a picture's rays lie in a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scanlines {
    /// Rays of a row.
    pub width: usize,
    /// Rays of the first row that are missing at its beginning.
    pub missing: usize,
}

impl Scanlines {
    /// The rows in a batch, `None` if it does not look like some.
    pub fn of(rays: &[Ray]) -> Option<Scanlines> {
        if rays.len() < FEWEST {
            return None;
        }
        let turns = rays[0].dir != rays[1].dir;
        let apart = |i: usize, j: usize| {
            let (a, b) = (&rays[i], &rays[j]);
            let (a, b) = if turns { (a.dir, b.dir) } else { (a.origin, b.origin) };
            (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f32>()
        };
        let most = rays.len() / FEWEST_ROWS;
        let mut before = apart(0, 1);
        let mut ends = [0; 2];
        let (mut found, mut i) = (0, 2);
        while found < 2 {
            // Scanlines so long are not worth the search either.
            if i > 2 * most + 2 {
                return None;
            }
            let step = apart(i - 1, i);
            if step > JUMP * before {
                ends[found] = i;
                found += 1;
                // The step to the next row says nothing about the steps in it.
                i += 1;
                before = apart(i - 1, i);
            } else {
                before = step;
            }
            i += 1;
        }
        let width = ends[1] - ends[0];
        if width < NARROWEST || width > most {
            return None;
        }
        let first = ends[0] % width;
        let rows = (rays.len() - 1 - first) / width;
        let is_end = |k: usize| {
            let i = first + k * width;
            i == 0 || i + 1 >= rays.len() || apart(i - 1, i) > JUMP * apart(i, i + 1)
        };
        let are_ends = (0..SAMPLE.min(rows)).all(|k| is_end(k * rows / SAMPLE.min(rows)));
        let is_near = |k: usize| {
            let mut i = k * (rays.len() - width - 2) / SAMPLE;
            // Not across the end of a row.
            i -= usize::from(i > 0 && (i + 1) % width == first);
            let step = apart(i, i + 1);
            step > 0.0 && apart(i, i + width) <= APART * step
        };
        let missing = (width - first) % width;
        (are_ends && (0..SAMPLE).all(is_near)).then_some(Scanlines { width, missing })
    }

    /// Rays of some whole bands of tiles, about as many as asked.
    pub fn bands(&self, rays: usize) -> usize {
        rays.div_ceil(self.width * ROWS) * self.width * ROWS
    }
}

/// The room that moving needs, kept by each thread.
#[derive(Default)]
pub struct Tiles {
    /// The rays in their new order.
    pub rays: Vec<Ray>,
    /// Where they stood.
    pub stood: Vec<u32>,
    /// What becomes of them.
    pub answers: Answers,
    /// The rays' places in a tile that lacks none, from its first one on.
    offsets: Vec<u32>,
    next_row: usize,
}

impl Tiles {
    /// Begins with the first row.
    pub fn start(&mut self, rows: Scanlines) {
        let offset = |(x, y): &(u8, u8)| (usize::from(*y) * rows.width + usize::from(*x)) as u32;
        self.offsets.clear();
        self.offsets.extend(CURVE.iter().map(offset));
        self.next_row = 0;
    }

    /// Moves the rays of the next bands; false if there are no more.
    pub fn advance(&mut self, rows: Scanlines, rays: &[Ray]) -> bool {
        self.rays.clear();
        self.stood.clear();
        let Scanlines { width, missing } = rows;
        let end = (missing + rays.len()).div_ceil(width);
        while self.next_row < end && self.rays.len() < TOGETHER {
            let whole = self.next_row * width >= missing
                && (self.next_row + ROWS) * width <= missing + rays.len();
            for column in (0..width).step_by(COLUMNS) {
                let first = self.next_row * width + column;
                if whole && column + COLUMNS <= width {
                    let first = first - missing;
                    self.rays.extend(self.offsets.iter().map(|&i| rays[first + i as usize]));
                    self.stood.extend(self.offsets.iter().map(|&i| first as u32 + i));
                    continue;
                }
                for (&(x, _), &offset) in CURVE.iter().zip(&self.offsets) {
                    let at = (first + offset as usize).checked_sub(missing);
                    let Some(at) = at.filter(|&at| at < rays.len()) else { continue };
                    if column + usize::from(x) < width {
                        self.rays.push(rays[at]);
                        self.stood.push(at as u32);
                    }
                }
            }
            self.next_row += ROWS;
        }
        !self.rays.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::random::Random;

    /// A picture seen from a point, or by parallel rays.
    fn picture(width: usize, height: usize, parallel: bool) -> Vec<Ray> {
        let at = |i: usize| {
            let (x, y) = ((i % width) as f32 / width as f32, (i / width) as f32 / width as f32);
            match parallel {
                true => Ray::new([x - 0.5, y - 0.5, 3.0], [0.1, 0.2, -1.0]),
                false => Ray::new([0.1, 0.2, 3.0], [x - 0.45, 0.4 - y, -1.0]),
            }
        };
        (0..width * height).map(at).collect()
    }

    #[test]
    fn rows_are_found_wherever_a_batch_begins() {
        for (width, height) in [(64, 64), (640, 48), (100, 37), (17, 200), (1024, 8), (333, 333)] {
            for parallel in [false, true] {
                let rays = picture(width, height, parallel);
                for skipped in [0, 1, 2, 5, width / 2, width - 1, width, width + 3] {
                    let rays = &rays[skipped..];
                    if rays.len() < FEWEST.max(FEWEST_ROWS * width) {
                        continue;
                    }
                    let rows = Scanlines { width, missing: skipped % width };
                    assert_eq!(Scanlines::of(rays), Some(rows), "{width} x {height}, {skipped}");
                }
            }
        }
    }

    #[test]
    fn other_rays_have_no_rows() {
        let mut random = Random(7);
        let mut number = || random.signed();
        let incoherent = |number: &mut dyn FnMut() -> f32| {
            Ray::new([number(), number(), number()], [number(), number(), number()])
        };
        for _ in 0..200 {
            let rays: Vec<Ray> = (0..2000).map(|_| incoherent(&mut number)).collect();
            assert_eq!(Scanlines::of(&rays), None);
            // Bounces from one point.
            let rays: Vec<Ray> = rays.iter().map(|ray| Ray::new([0.0; 3], ray.dir)).collect();
            assert_eq!(Scanlines::of(&rays), None);
        }
        let rays = picture(64, 64, false);
        // Scanlines of different lengths, one row, rays all the same, numbers that are none, few rows, few rays.
        let ragged: Vec<Ray> =
            rays.iter().enumerate().filter(|(i, _)| i % 97 != 0).map(|x| *x.1).collect();
        assert_eq!(Scanlines::of(&ragged), None);
        assert_eq!(Scanlines::of(&picture(4096, 1, false)), None);
        assert_eq!(Scanlines::of(&vec![rays[0]; 4096]), None);
        let mut broken = rays.clone();
        broken[0].dir[0] = f32::NAN;
        assert_eq!(Scanlines::of(&broken[..]), None);
        assert_eq!(Scanlines::of(&vec![broken[0]; 4096]), None);
        assert_eq!(Scanlines::of(&picture(700, 3, false)), None);
        // Rows that are much farther apart than the rays in them.
        let rows =
            picture(640, 480, false).chunks(640).step_by(8).flatten().copied().collect::<Vec<_>>();
        assert_eq!(Scanlines::of(&rows), None);
        assert_eq!(Scanlines::of(&rays[..1000]), None);
        assert_eq!(Scanlines::of(&[]), None);
    }

    /// Each ray is moved once, and most tiles are whole.
    #[test]
    fn every_ray_is_moved_once() {
        for (width, n, missing) in [(64, 4096, 0), (100, 3700, 37), (17, 3000, 16), (2048, 9000, 5)]
        {
            let rays: Vec<Ray> = (0..n).map(|i| Ray::new([i as f32; 3], [1.0; 3])).collect();
            let (rows, mut tiles, mut times) =
                (Scanlines { width, missing }, Tiles::default(), vec![0; n]);
            for _ in 0..2 {
                tiles.start(rows);
                while tiles.advance(rows, &rays) {
                    assert_eq!(tiles.rays.len(), tiles.stood.len());
                    for (ray, &stood) in tiles.rays.iter().zip(&tiles.stood) {
                        assert_eq!(*ray, rays[stood as usize]);
                        times[stood as usize] += 1;
                    }
                }
            }
            assert!(times.iter().all(|&times| times == 2), "{width}");
        }
        let (rows, mut tiles) = (Scanlines { width: 64, missing: 0 }, Tiles::default());
        tiles.start(rows);
        tiles.advance(rows, &picture(64, 64, false));
        for tile in tiles.stood.chunks(COLUMNS * ROWS) {
            let (first, last) = (tile[0] as usize, *tile.last().unwrap() as usize);
            assert_eq!((last % 64 - first % 64, last / 64 - first / 64), (COLUMNS - 1, ROWS - 1));
        }
    }
}
