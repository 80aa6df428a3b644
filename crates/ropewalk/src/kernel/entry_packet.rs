//! Where a packet of sixteen short segments enters the tree, those of one particle in turn as a rule.
//!
//! ```text
//! the box around all is searched for as that of one segment    nothing near it: none hits anything
//! from its entry down, each cell with the segments that reach it; in a leaf, those that meet a triangle's box
//!     a segment meets none      no hit
//!     boxes in one leaf         that leaf is its entry
//!     boxes in several          the packet's entry is
//! too many cells                the segments in the rest of them are searched for one by one
//! one leaves the root's cell    all are searched for one by one
//! ```
//! Whether a segment leaves its cell cannot be predicted, so most of the time of segments one by one goes into wrong
//! guesses. Where they are short, four packets of five need one search; where they are not, packets are given up.

#![allow(unsafe_code)]

use super::beam::Vector;
use super::entry::{Corners, Locate, Path, Segment, path};
use super::events::Events;
use super::prefetch_line;
use crate::ray::Ray;
use crate::wide::{
    BLOCK_LINES, Block, LEAF, LINE, Treelet, WIDTH, WideTree, code_line, code_offset,
};

/// Segments of a packet.
pub const PACKET: usize = 16;

/// Most cells that are looked at for a packet.
const LOOKS: usize = 16;

/// Cells that so many looks lead to.
const QUEUE: usize = 1 + 8 * LOOKS;

/// Packets that look at so many cells on the mean take no more time than their rays one by one. Measured on walks: at 2 to 4
/// looks they take three quarters of it, at 6 and more as much or a little more.
const PAYS: u32 = 7;

/// Looks beyond that until packets are given up, at first and after they have paid for some time.
const CREDIT: [u32; 2] = [200, 400];

/// So many rays go one by one when packets are given up, and twice as many each time they are again.
const SINGLE: u32 = 4096;

/// The most that may become of [`SINGLE`].
const MOST_SINGLE: u32 = 16 * SINGLE;

/// The numbers of sixteen rays by their places in a [`Ray`].
#[repr(C, align(64))]
pub struct Columns(pub [[f32; PACKET]; 8]);

/// The boxes of a packet's segments, widened as that of a [`Segment`]: the lower corners by axis, then the negated upper
/// ones.
#[repr(C, align(64))]
struct Boxes([[f32; PACKET]; 6]);

impl Boxes {
    /// Those of some rays; the second value is false if a number is NaN.
    ///
    /// # Safety
    /// The machine must have the features of `V`, and the caller must enable them.
    #[inline(always)]
    unsafe fn new<V: Vector>(Columns(rays): &Columns, slack: f32) -> (Self, Segment, bool) {
        let mut boxes = Boxes([[0.0; PACKET]; 6]);
        let mut around = Segment { corners: Corners([f32::INFINITY; 8]), end: [0.0; 4] };
        let mut ordered = (1 << PACKET) - 1;
        // SAFETY: passed on to the caller; all rows have as many numbers as there are lanes.
        unsafe {
            let (t_min, t_max, slack) = (V::load(&rays[6]), V::load(&rays[7]), V::splat(slack));
            for a in 0..3 {
                let (origin, dir) = (V::load(&rays[a]), V::load(&rays[a + 3]));
                let (from, to) = (dir.mul_add(t_min, origin), dir.mul_add(t_max, origin));
                let low = from.min(to).min(origin) - slack;
                let high = from.max(to).max(origin) + slack;
                low.store(&mut boxes.0[a]);
                (V::splat(0.0) - high).store(&mut boxes.0[a + 3]);
                ordered &= low.le(high);
                around.corners.0[a] = low.lowest();
                around.corners.0[a + 4] = -high.highest();
            }
        }
        (boxes, around, ordered == (1 << PACKET) - 1)
    }

    /// The segments that reach a child of a treelet.
    ///
    /// # Safety
    /// See [`Boxes::new`].
    #[inline(always)]
    unsafe fn reaching<V: Vector>(&self, treelet: &Treelet, child: usize) -> u32 {
        let mut lanes = u32::MAX;
        for (level, h) in path(child).into_iter().enumerate() {
            let upper = child >> (2 - level) & 1;
            let plane = f32::from_bits(treelet.plane[h % 7].to_bits() ^ (upper as u32) << 31);
            let row = &self.0[(treelet.axis(h) + 3 * upper) % 6];
            // SAFETY: passed on to the caller; rows have as many numbers as there are lanes.
            lanes &= unsafe { V::load(row).lt(V::splat(plane)) };
        }
        lanes
    }

    /// The segments whose boxes meet that of a triangle of a block; `around` is the box around all.
    ///
    /// # Safety
    /// See [`Boxes::new`].
    #[inline(always)]
    unsafe fn meeting<V: Vector>(&self, Corners(around): &Corners, block: &Block) -> u32 {
        // SAFETY: passed on to the caller; rows have as many numbers as there are lanes.
        unsafe {
            let (low, high, both) = extent::<V>(around, block, [0, 1]);
            let (low_z, high_z, z) = extent::<V>(around, block, [2, 2]);
            // Triangles that something may meet: hardly any as a rule.
            let mut lanes = both & both >> WIDTH & z & ((1 << WIDTH) - 1);
            if lanes == 0 {
                return 0;
            }
            let mut bounds = [[0.0; PACKET]; 4];
            low.store(&mut bounds[0]);
            low_z.store(&mut bounds[1]);
            high.store(&mut bounds[2]);
            high_z.store(&mut bounds[3]);
            let mut met = 0;
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize % WIDTH;
                lanes &= lanes - 1;
                let (mut on, places) = (u32::MAX, [(0, lane), (0, lane + WIDTH), (1, lane)]);
                for (a, (row, lane)) in places.into_iter().enumerate() {
                    on &= V::load(&self.0[a]).le(V::splat(bounds[row + 2][lane]));
                    on &= V::load(&self.0[a + 3]).le(V::splat(-bounds[row][lane]));
                }
                met |= on;
            }
            met
        }
    }
}

/// Lower and upper corners of a block's triangles along two axes, one half of the lanes for each, and the lanes in which they
/// meet a box.
///
/// A function, since what a closure does with vectors is called out of line where the CPU is not known to the compiler.
///
/// # Safety
/// See [`Boxes::new`].
#[inline(always)]
unsafe fn extent<V: Vector>(around: &[f32; 8], block: &Block, [i, j]: [usize; 2]) -> (V, V, u32) {
    // SAFETY: passed on to the caller; rows are loaded two at a time.
    unsafe {
        let [p, q, r] = &block.vertex;
        let p = V::load_two(&p[i], &p[j]);
        let q = V::load_two(&q[i], &q[j]);
        let r = V::load_two(&r[i], &r[j]);
        let (low, high) = (p.min(q).min(r), p.max(q).max(r));
        let begins = V::load_two(&[around[i]; WIDTH], &[around[j]; WIDTH]);
        // The upper corner is negated.
        let ends = V::load_two(&[-around[i + 4]; WIDTH], &[-around[j + 4]; WIDTH]);
        (low, high, begins.le(high) & low.le(ends))
    }
}

/// The search for the entries of rays in turn, in packets where that pays.
pub struct Packets {
    path: Path,
    columns: Columns,
    /// Cells to be looked at and the segments that reach them, first in first out: others come before a cell's memory
    /// is there.
    queue: [(u32, u32); QUEUE],
    /// Looks that packets may yet take beyond [`PAYS`] each.
    credit: u32,
    /// Rays that go one by one before the next packet.
    single: u32,
    /// So many the next time.
    next_single: u32,
}

/// What is known of the segments of a packet.
struct Sorted {
    /// Those that may hit something.
    left: u32,
    /// Those of which some cells have not been looked at.
    rest: u32,
}

impl Packets {
    /// In a tree; `None` if its root is not a treelet.
    pub fn new(tree: &WideTree) -> Option<Packets> {
        Some(Packets {
            path: Path::new(tree)?,
            columns: Columns([[0.0; PACKET]; 8]),
            queue: [(0, 0); QUEUE],
            credit: CREDIT[0],
            single: 0,
            next_single: SINGLE,
        })
    }

    /// True if the next rays are to be searched for in a packet, else one of them by itself.
    #[inline(always)]
    pub fn is_due(&mut self) -> bool {
        // Written with a branch: without one, the optimiser of Rust 1.95 loses the count where this is asked in a loop.
        if self.single == 0 {
            return true;
        }
        self.single -= 1;
        false
    }

    /// The entry of one ray; see [`Path::enter`].
    ///
    /// # Safety
    /// As for [`Path::enter`].
    #[inline(always)]
    pub unsafe fn enter_one<L: Locate, E: Events>(
        &mut self,
        tree: &WideTree,
        ray: &Ray,
        events: &mut E,
    ) -> Option<u32> {
        // SAFETY: passed on to the caller.
        unsafe { self.path.enter::<L, E>(tree, ray, events) }
    }

    /// Of [`PACKET`] rays at most, those that may hit something; the codes of their entries are in `entries`.
    ///
    /// # Safety
    /// As for [`Path::enter`].
    #[inline(always)]
    pub unsafe fn enter_packet<L: Locate, E: Events>(
        &mut self,
        tree: &WideTree,
        rays: &[Ray],
        entries: &mut [u32; PACKET],
        events: &mut E,
    ) -> u32 {
        let Some(last) = rays.last() else { return 0 };
        // SAFETY: passed on to the caller.
        unsafe {
            match rays.first_chunk::<PACKET>() {
                Some(rays) => L::columns(rays, &mut self.columns),
                None => {
                    let rays: [Ray; PACKET] = std::array::from_fn(|i| *rays.get(i).unwrap_or(last));
                    L::columns(&rays, &mut self.columns);
                }
            }
            let (boxes, mut around, ordered) =
                Boxes::new::<L::Row>(&self.columns, self.path.slack());
            let all = u32::MAX >> (32 - rays.len());
            if !(ordered && self.path.holds::<L>(&around)) {
                self.note(LOOKS as u32);
                return self.enter_each::<L, E>(tree, rays, all, entries, events);
            }
            around.end = L::segment(last, 0.0).end;
            let entry = self.path.enter_segment::<L, E>(tree, &around, events);
            if entry == 0 {
                self.note(1);
                events.skipped(all.count_ones());
                return 0;
            }
            let Sorted { mut left, rest } =
                self.sort_out::<L, E>(tree, (&boxes, &around), (entry, all), entries, events);
            events.skipped((all & !left & !rest).count_ones());
            if rest != 0 {
                left |= self.enter_each::<L, E>(tree, rays, rest, entries, events);
            }
            left
        }
    }

    /// Looks at what is near the segments of a packet; its entry and its segments are given.
    #[inline(always)]
    unsafe fn sort_out<L: Locate, E: Events>(
        &mut self,
        tree: &WideTree,
        (boxes, around): (&Boxes, &Segment),
        (entry, all): (u32, u32),
        entries: &mut [u32; PACKET],
        events: &mut E,
    ) -> Sorted {
        // Segments that meet boxes, and those of them that do so in several leaves.
        let (mut left, mut several, mut rest) = (0, 0, 0);
        let (mut next, mut end) = (0, 1);
        let lines = tree.lines().as_ptr();
        self.queue[0] = (entry, all);
        while next < end {
            let (code, lanes) = self.queue[next % QUEUE];
            next += 1;
            if next > LOOKS {
                rest |= lanes;
                continue;
            }
            if code & LEAF != 0 {
                // SAFETY: passed on to the caller; the codes of a tree lead to its cells.
                let met = lanes & unsafe { meeting::<L, E>(tree, (boxes, around), code, events) };
                several |= met & left;
                put(code, met & !left, entries);
                left |= met;
                continue;
            }
            events.looked();
            // SAFETY: as above.
            let (treelet, mut children) = unsafe {
                let treelet = &*lines.add(code_offset(code)).cast::<Treelet>();
                (treelet, L::reached(around, treelet))
            };
            let first = end;
            while children != 0 {
                let child = children.trailing_zeros() as usize % 8;
                children &= children - 1;
                // SAFETY: passed on to the caller.
                let lanes = lanes & unsafe { boxes.reaching::<L::Row>(treelet, child) };
                self.queue[end % QUEUE] = (treelet.child[child], lanes);
                end += usize::from(lanes != 0);
            }
            for (code, _) in &self.queue[first..end] {
                // All of a block, or one line time and again.
                let step = if code & LEAF == 0 { 0 } else { LINE };
                let address = lines.wrapping_add(code_offset(*code));
                for line in 0..BLOCK_LINES {
                    prefetch_line(address.wrapping_add(line * step));
                }
            }
        }
        // Those that are searched for one by one count as a few more.
        self.note(next.min(LOOKS + 4) as u32);
        put(entry, several, entries);
        Sorted { left: left & !rest, rest }
    }

    /// Some of the rays, one by one; not called, since a function by itself would not know the level's features.
    #[inline(always)]
    unsafe fn enter_each<L: Locate, E: Events>(
        &mut self,
        tree: &WideTree,
        rays: &[Ray],
        asked: u32,
        entries: &mut [u32; PACKET],
        events: &mut E,
    ) -> u32 {
        let mut left = 0;
        for (i, ray) in rays.iter().enumerate().filter(|(i, _)| asked >> i & 1 == 1) {
            // SAFETY: passed on to the caller.
            if let Some(code) = unsafe { self.path.enter::<L, E>(tree, ray, events) } {
                entries[i % PACKET] = code;
                left |= 1 << i;
            }
        }
        left
    }

    /// Takes note of how many cells a packet looked at.
    #[inline(always)]
    fn note(&mut self, looks: u32) {
        let credit = self.credit + PAYS;
        if credit < looks {
            (self.credit, self.single) = (CREDIT[0], self.next_single);
            self.next_single = (2 * self.next_single).min(MOST_SINGLE);
        } else {
            self.credit = (credit - looks).min(CREDIT[1]);
            if self.credit == CREDIT[1] {
                self.next_single = SINGLE;
            }
        }
    }
}

/// The segments that meet the box of a triangle of a leaf.
#[inline(always)]
unsafe fn meeting<L: Locate, E: Events>(
    tree: &WideTree,
    (boxes, around): (&Boxes, &Segment),
    code: u32,
    events: &mut E,
) -> u32 {
    if tree.has_shapes() {
        return u32::MAX;
    }
    let (mut line, mut met) = (code_line(code), 0);
    for _ in 0..tree.block_count(code) {
        events.boxed();
        // SAFETY: the codes of a tree lead to its blocks; the rest passed on to the caller.
        unsafe {
            let block = &*tree.lines().as_ptr().add(line * LINE).cast::<Block>();
            met |= boxes.meeting::<L::Row>(&around.corners, block);
        }
        line += BLOCK_LINES;
    }
    met
}

/// Sets the entries of some segments.
#[inline(always)]
fn put(code: u32, mut segments: u32, entries: &mut [u32; PACKET]) {
    while segments != 0 {
        entries[segments.trailing_zeros() as usize % PACKET] = code;
        segments &= segments - 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::build_default;
    use crate::geometry::Geometry;
    use crate::kernel::events::{BatchEvents, NoEvents};
    use crate::kernel::random::Random;
    use crate::kernel::scalar::Scalar;
    use crate::traverse::{BruteForce, NoCounts, RayCaster};

    fn soup(random: &mut Random, triangles: u32) -> (Geometry, WideTree) {
        let mut vertices = Vec::new();
        for _ in 0..triangles {
            let at = [0; 3].map(|_| random.signed());
            for _ in 0..3 {
                vertices.push(at.map(|x| x + 0.1 * random.signed()));
            }
        }
        let faces: Vec<[u32; 3]> = (0..triangles).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let geometry = Geometry::from_triangles(&vertices, &faces).unwrap();
        let wide = WideTree::compile(&build_default(&geometry).unwrap().0, &geometry).unwrap();
        (geometry, wide)
    }

    /// A particle that goes in steps of up to this length.
    fn walk(random: &mut Random, length: f32, n: usize) -> Vec<Ray> {
        let mut at = [0.0f32; 3];
        let step = |_| {
            let dir = [0; 3].map(|_| length * random.signed());
            let ray = Ray::new(at, dir).with_range(0.0, 1.0);
            at = std::array::from_fn(|a| (at[a] + dir[a]).clamp(-1.0, 1.0));
            ray
        };
        (0..n).map(step).collect()
    }

    /// True if what a cell holds, leaf by leaf, has the primitive.
    fn holds(tree: &WideTree, code: u32, prim_id: u32) -> bool {
        let row = |line: usize| tree.lines().as_ptr().wrapping_add(line * LINE);
        if code == 0 {
            return false;
        }
        if code & LEAF == 0 {
            // SAFETY: the codes of a tree lead to its cells.
            let treelet = unsafe { &*row(code_line(code)).cast::<Treelet>() };
            return treelet.child.iter().any(|&child| holds(tree, child, prim_id));
        }
        (0..tree.block_count(code)).any(|i| {
            // SAFETY: as above.
            let block =
                unsafe { &*row(code_line(code) + i as usize * BLOCK_LINES).cast::<Block>() };
            block.id.iter().any(|id| id & crate::wide::ID_MASK == prim_id)
        })
    }

    /// Packets of all sizes: what is not returned hits nothing, and what hits something enters above its primitive. No
    /// more are answered one by one, and it takes less than one look a packet.
    #[test]
    fn nothing_is_lost_in_packets() {
        let mut random = Random(3);
        let (mut hits, mut skipped, mut looks) = (0, [0, 0], 0);
        for round in 0..160 {
            let (geometry, tree) = soup(&mut random, 150);
            let length = [0.002, 0.01, 0.05, 0.3][round % 4];
            let rays = walk(&mut random, length, 600);
            let (mut packets, mut path) = (Packets::new(&tree).unwrap(), Path::new(&tree).unwrap());
            let (mut entries, mut events, mut next) = ([0; PACKET], BatchEvents::default(), 0);
            while next < rays.len() {
                let most = rays.len().min(next + 1 + round % 20);
                let n = PACKET.min(most - next);
                // SAFETY: portable code; the tree is that of the packets.
                let left = unsafe {
                    let rays = &rays[next..next + n];
                    packets.enter_packet::<Scalar, _>(&tree, rays, &mut entries, &mut events)
                };
                assert_eq!(left >> n, 0, "segments that there are not");
                for (i, ray) in rays[next..next + n].iter().enumerate() {
                    let hit = BruteForce { geometry: &geometry }.closest_hit(ray, &mut NoCounts);
                    let Some(hit) = hit else { continue };
                    hits += 1;
                    assert_eq!(left >> i & 1, 1, "round {round}, {ray:?} hits {hit:?}");
                    assert!(holds(&tree, entries[i], hit.prim_id), "round {round}, {ray:?}");
                }
                next += n;
            }
            let mut single = BatchEvents::default();
            for ray in &rays {
                // SAFETY: as above.
                unsafe { path.enter::<Scalar, _>(&tree, ray, &mut single) };
            }
            if length < 0.005 && round % 20 > 10 {
                skipped = [skipped[0] + events.skipped, skipped[1] + single.skipped];
                looks += events.looked;
            }
        }
        assert!(hits > 300, "{hits}");
        assert!(skipped[0] >= skipped[1] && looks < skipped[0] / 16, "{skipped:?} {looks}");
    }

    /// Long segments go one by one after some packets, short ones in packets again after some time.
    #[test]
    fn packets_are_given_up_and_taken_up_again() {
        let mut random = Random(4);
        let (_, tree) = soup(&mut random, 2000);
        let mut packets = Packets::new(&tree).unwrap();
        let mut entries = [0; PACKET];
        let mut share = |rays: &[Ray]| {
            let (mut next, mut in_packets) = (0, 0);
            while next < rays.len() {
                if !packets.is_due() {
                    next += 1;
                    continue;
                }
                let n = PACKET.min(rays.len() - next);
                // SAFETY: portable code; the tree is that of the packets.
                unsafe {
                    let rays = &rays[next..next + n];
                    packets.enter_packet::<Scalar, _>(&tree, rays, &mut entries, &mut NoEvents);
                }
                (next, in_packets) = (next + n, in_packets + n);
            }
            in_packets as f64 / rays.len() as f64
        };
        let (short, long) = (walk(&mut random, 1e-4, 200_000), walk(&mut random, 0.5, 200_000));
        assert_eq!(share(&short), 1.0);
        let tried = share(&long);
        assert!((1e-4..0.05).contains(&tried), "{tried}");
        let again = share(&short);
        assert!((0.5..1.0).contains(&again), "{again}");
        assert_eq!(share(&short), 1.0);
    }

    /// The end of a ray from afar is rounded by more than boxes are widened by.
    #[test]
    fn rays_from_afar_lose_nothing_in_packets() {
        let mut random = Random(6);
        let mut hits = 0;
        for _ in 0..2000 {
            // Few cells: where there are many, the rest of them is searched for one by one.
            let (geometry, tree) = soup(&mut random, 40);
            let mut rays = walk(&mut random, 0.02, PACKET);
            for ray in rays.iter_mut().step_by(3) {
                let dir = [0; 3].map(|_| random.signed());
                ray.origin = std::array::from_fn(|a| random.signed() - 3e7 * dir[a]);
                *ray = Ray::new(ray.origin, dir).with_range(0.0, 3e7);
            }
            let Some(mut packets) = Packets::new(&tree) else { continue };
            let mut entries = [0; PACKET];
            // SAFETY: portable code; the tree is that of the packets.
            let left = unsafe {
                packets.enter_packet::<Scalar, _>(&tree, &rays, &mut entries, &mut NoEvents)
            };
            for (i, ray) in rays.iter().enumerate() {
                let hit = BruteForce { geometry: &geometry }.closest_hit(ray, &mut NoCounts);
                if let Some(hit) = hit {
                    hits += i32::from(i % 3 == 0);
                    assert!(left >> i & 1 == 1 && holds(&tree, entries[i], hit.prim_id), "{ray:?}");
                }
            }
        }
        assert!(hits > 100, "{hits}");
    }

    /// A ray that is none spoils its packet, not the others in it.
    #[test]
    fn rays_without_numbers_go_by_themselves() {
        let mut random = Random(5);
        let (geometry, tree) = soup(&mut random, 300);
        for at in 0..PACKET {
            let mut rays = walk(&mut random, 0.1, PACKET);
            rays[at].origin[at % 3] = f32::NAN;
            rays[(at + 5) % PACKET].t_max = f32::INFINITY;
            rays[(at + 9) % PACKET].dir = [0.0, 0.0, f32::INFINITY];
            let (mut packets, mut entries) = (Packets::new(&tree).unwrap(), [0; PACKET]);
            // SAFETY: portable code; the tree is that of the packets.
            let left = unsafe {
                packets.enter_packet::<Scalar, _>(&tree, &rays, &mut entries, &mut NoEvents)
            };
            for (i, ray) in rays.iter().enumerate() {
                let hit = BruteForce { geometry: &geometry }.closest_hit(ray, &mut NoCounts);
                if let Some(hit) = hit {
                    assert!(left >> i & 1 == 1 && holds(&tree, entries[i], hit.prim_id), "{ray:?}");
                }
            }
        }
    }
}
