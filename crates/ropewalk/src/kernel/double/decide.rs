//! What the search finds, decided in `f64`.

#![allow(unsafe_code)]

use super::Accepts;
use super::gather::Gather;
use crate::double::{DoubleGeometry, DoubleRay, Place};
use crate::kernel::beam::Doubles;
use crate::kernel::exact::{Exact, meet};
use crate::kernel::level::Simd;
use crate::kernel::query::{BatchQuery, Clear};
use crate::kernel::slot::Slot;
use crate::kernel::wave::WAVE;
use crate::ray::Hit;
use crate::wide::{ID_MASK, WIDTH};

/// A triangle that a ray hits for sure.
#[derive(Clone, Copy)]
pub struct Note {
    pub prim_id: u32,
    /// Bounds of the parameter, in the numbers of the search.
    pub low: f32,
    pub high: f32,
}

/// So many pairs of ray and triangle at least are decided at once, so that their triangles come from memory
/// side by side.
const PENDING: usize = 64;

/// Decides in `f64` what the search finds, and puts it to a [`Gather`].
///
/// What is hit for sure is only noted, as bounds: most of it lies behind something else in the end. The
/// parameters of the rest are worked out for many finished rays at once, eight at a time.
pub struct Decide<'a, G: Gather> {
    geometry: &'a DoubleGeometry,
    rays: &'a [DoubleRay],
    places: &'a [Place],
    first_ray: usize,
    filter: Option<&'a dyn Accepts>,
    /// What each slot has found.
    notes: [Vec<Note>; WAVE],
    /// Rays with what is known of them, and where their pairs end in `pending`.
    finished: Vec<(u32, G::Known, usize)>,
    /// Pairs of a ray and a triangle that it hits for sure.
    pending: Vec<(u32, u32)>,
    /// Their parameters.
    t: Vec<f64>,
    pairs: Pairs,
    gather: G,
}

/// Rays and triangles, one pair a lane, in the axis order of the ray's shear.
#[repr(C, align(64))]
struct Pairs {
    /// Coordinates by vertex and axis.
    corner: [[[f64; WIDTH]; 3]; 3],
    origin: [[f64; WIDTH]; 3],
    dir: [[f64; WIDTH]; 3],
}

impl Pairs {
    const EMPTY: Pairs =
        Pairs { corner: [[[0.0; WIDTH]; 3]; 3], origin: [[0.0; WIDTH]; 3], dir: [[0.0; WIDTH]; 3] };

    #[inline(always)]
    fn set(&mut self, lane: usize, ray: &DoubleRay, corners: [&[f64; 3]; 3]) {
        let lane = lane % WIDTH;
        let size = ray.dir.map(f64::abs);
        let y = usize::from(size[1] > size[0]);
        let kz = if size[2] > size[y] { 2 } else { y };
        // The winding does not matter.
        let k = [[1, 2, 0], [2, 0, 1], [0, 1, 2]][kz];
        for a in 0..3 {
            for (row, corner) in self.corner.iter_mut().zip(corners) {
                row[a][lane] = corner[k[a]];
            }
            self.origin[a][lane] = ray.origin[k[a]];
            self.dir[a][lane] = ray.dir[k[a]];
        }
    }

    /// Writes the parameters of the hits; returns the lanes that the reference must be asked about.
    ///
    /// # Safety
    /// As for [`meet`].
    #[inline(always)]
    unsafe fn meet<D: Doubles>(&self, t: &mut [f64]) -> u32 {
        let mut hit = 0;
        for first in (0..WIDTH).step_by(D::LANES) {
            // SAFETY: passed on to the caller; `LANES` divides `WIDTH`.
            unsafe {
                let [a, b, c] = &self.corner;
                let corners = [load::<D>(a, first), load::<D>(b, first), load::<D>(c, first)];
                let (origin, dir) = (load::<D>(&self.origin, first), load::<D>(&self.dir, first));
                let met = meet(origin, dir, corners);
                met.t.store(&mut t[first..]);
                hit |= met.hit << first;
            }
        }
        !hit & ((1 << WIDTH) - 1)
    }
}

/// The lanes of three rows from `first` on.
///
/// # Safety
/// As for [`meet`].
#[inline(always)]
unsafe fn load<D: Doubles>([x, y, z]: &[[f64; WIDTH]; 3], first: usize) -> [D; 3] {
    // SAFETY: passed on to the caller.
    unsafe { [D::load(&x[first..]), D::load(&y[first..]), D::load(&z[first..])] }
}

impl<'a, G: Gather> Decide<'a, G> {
    /// Decides about rays, the first of which has the number that comes with them in its batch, and the places of
    /// which say how they are searched for.
    pub fn new(
        (geometry, filter): (&'a DoubleGeometry, Option<&'a dyn Accepts>),
        (rays, places, first_ray): (&'a [DoubleRay], &'a [Place], usize),
        gather: G,
    ) -> Self {
        Decide {
            geometry,
            rays,
            places,
            first_ray,
            filter,
            notes: std::array::from_fn(|_| Vec::new()),
            finished: Vec::new(),
            pending: Vec::new(),
            t: Vec::new(),
            pairs: Pairs::EMPTY,
            gather,
        }
    }

    /// Answers a ray that cannot be searched for from all triangles.
    pub fn answer_alone(&mut self, index: usize) {
        for id in 0..self.geometry.len() as u32 {
            if self.offer(0, index, id).is_some() && G::ANY {
                break;
            }
        }
        let known = self.gather.finish(0);
        self.gather.answer(index, known, std::iter::empty());
    }

    /// The answers.
    pub fn into_gather(self) -> G {
        self.gather
    }

    /// Tests a triangle; the limit of what still matters, if it is hit.
    fn offer(&mut self, k: usize, index: usize, prim_id: u32) -> Option<f64> {
        let hit = self.geometry.intersect(prim_id, &self.rays[index])?;
        let accepts = |filter: &dyn Accepts| filter.accepts(self.first_ray + index, &hit);
        let accepted = self.filter.is_none_or(accepts);
        accepted.then(|| self.gather.take(k, (hit.t, hit.prim_id)))
    }

    fn test(&mut self, k: usize, slot: &mut Slot, prim_id: u32) {
        let index = slot.ray as usize;
        if let Some(limit) = self.offer(k, index, prim_id) {
            slot.limit = slot.limit.min(self.places[index].after(limit));
            slot.best_id = prim_id;
        }
    }

    /// Works out the parameters of all pairs and answers the rays.
    ///
    /// # Safety
    /// As for [`BatchQuery::take_clear`].
    #[inline(always)]
    unsafe fn answer<L: Simd>(&mut self) {
        const NOTHING: [f64; 3] = [f64::NAN; 3];
        let (faces, vertices) = (self.geometry.faces(), self.geometry.vertices());
        // An altered file may name what is not there.
        let face = |id: u32| faces.get(id as usize).unwrap_or(&[u32::MAX; 3]);
        let corner = |i: u32| vertices.get(i as usize).unwrap_or(&NOTHING);
        for &(_, id) in &self.pending {
            // SAFETY: passed on to the caller.
            unsafe { L::prefetch((&raw const *face(id)).cast()) };
        }
        for &(_, id) in &self.pending {
            for &vertex in face(id) {
                // SAFETY: passed on to the caller.
                unsafe { L::prefetch((&raw const *corner(vertex)).cast()) };
            }
        }
        let groups = self.pending.chunks(WIDTH);
        self.t.resize(groups.len() * WIDTH, 0.0);
        for (pending, t) in groups.zip(self.t.chunks_exact_mut(WIDTH)) {
            for (lane, &(index, id)) in pending.iter().enumerate() {
                let &[a, b, c] = face(id);
                let corners = [corner(a), corner(b), corner(c)];
                self.pairs.set(lane, &self.rays[index as usize], corners);
            }
            // SAFETY: passed on to the caller.
            let open = unsafe { self.pairs.meet::<L::Doubles>(t) };
            for (lane, &(index, id)) in pending.iter().enumerate() {
                if open >> lane & 1 == 1 {
                    let hit = self.geometry.intersect(id, &self.rays[index as usize]);
                    // A clear hit is a hit, but for a tree that does not fit the geometry.
                    t[lane] = hit.map_or(f64::INFINITY, |hit| hit.t);
                }
                t[lane] += 0.0;
            }
        }
        let mut from = 0;
        for (index, known, end) in self.finished.drain(..) {
            let ids = self.pending[from..end].iter().map(|&(_, id)| id);
            let hits = self.t[from..end].iter().copied().zip(ids).filter(|hit| hit.0.is_finite());
            self.gather.answer(index as usize, known, hits);
            from = end;
        }
        self.pending.clear();
    }
}

impl<G: Gather> BatchQuery for Decide<'_, G> {
    const ANY: bool = G::ANY;
    const ROUNDED: bool = true;
    const TRIANGLES: bool = true;

    #[inline(always)]
    unsafe fn take_clear<L: Simd>(
        &mut self,
        k: usize,
        slot: &mut Slot,
        hits: &Clear<'_>,
        _exact: &Exact<'_>,
    ) -> u32 {
        if self.filter.is_some() {
            return hits.lanes;
        }
        let [inner_min, inner_max] = self.places[slot.ray as usize].inner;
        let (mut lanes, mut unclear) = (hits.lanes, 0);
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % WIDTH;
            lanes &= lanes - 1;
            let (low, high) = (hits.range.low[lane], hits.range.high[lane]);
            if low < inner_min || high > inner_max {
                unclear |= 1 << lane;
                continue;
            }
            let prim_id = hits.block.id[lane] & ID_MASK;
            if G::ANY {
                slot.best_id = prim_id;
                self.gather.take(k, (0.0, prim_id));
            } else {
                self.notes[k].push(Note { prim_id, low, high });
                slot.limit = slot.limit.min(self.gather.limit(&mut self.notes[k]));
            }
        }
        unclear
    }

    #[inline(always)]
    fn decide(
        &mut self,
        k: usize,
        slot: &mut Slot,
        (line, lane): (usize, usize),
        exact: &Exact<'_>,
    ) {
        self.test(k, slot, exact.lines.block(line).id[lane] & ID_MASK);
    }

    fn take(&mut self, k: usize, slot: &mut Slot, hit: &Hit, _exact: &Exact<'_>) {
        // No shapes, and no ray of the search is extreme, but in altered files.
        self.test(k, slot, hit.prim_id);
    }

    #[inline(always)]
    fn finish(&mut self, k: usize, slot: &mut Slot, _exact: &Exact<'_>) {
        let known = self.gather.finish(k);
        let (limit, notes) = (slot.limit, &mut self.notes[k]);
        notes.retain(|note| note.low <= limit);
        if notes.len() > 1 {
            notes.sort_unstable_by_key(|note| note.prim_id);
            notes.dedup_by_key(|note| note.prim_id);
        }
        self.pending.extend(notes.drain(..).map(|note| (slot.ray, note.prim_id)));
        self.finished.push((slot.ray, known, self.pending.len()));
    }

    fn miss(&mut self, index: usize) {
        self.gather.miss(index);
    }

    #[inline(always)]
    unsafe fn settle<L: Simd>(&mut self, _exact: &Exact<'_>, all: bool) {
        if self.pending.len() >= PENDING || all {
            // SAFETY: passed on to the caller.
            unsafe { self.answer::<L>() };
        }
    }
}
