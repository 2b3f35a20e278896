//! The collapse of edges, the cheapest first, each only where every guarantee outlives it.

use super::boxes::{Boxes, Span};
use super::columns::Columns;
use super::complex::{Complex, NONE, Rank, Spoke};
use super::queue::{Queue, bucket};
use super::star::Star;
use super::tether::Tether;
use super::{Rejection, Tally};
use crate::attributes::Attributes;
use crate::par;
use crate::quadric::Quadric;
use crate::run::{Cancelled, Run};
use glam::DVec3;

/// Edges between two looks at the flag that stops the work.
const STRIDE: usize = 4096;

/// How much a point is held where planes do not settle it.
const PULL: f64 = 1e-6;

/// How much length costs beside the squares of distances.
const LENGTH: f64 = 1e-6;

/// The mesh and what waits to be done.
pub struct Reducer {
    pub complex: Complex,
    boxes: Boxes,
    queue: Queue,
    /// Bit i of a face tells that its side i waits.
    waits: Vec<u8>,
    star: Star,
    /// Marks of points.
    seen: Vec<u32>,
    mark: u32,
    pub tally: Tally,
    single: bool,
    /// Where an error is named.
    tether: Option<Tether>,
    pub columns: Columns,
    /// Where the best place is refused, others are tried.
    patient: bool,
}

impl Reducer {
    /// `single` tells that all coordinates are of single precision, and shall be.
    pub fn new(complex: Complex, columns: Columns, tether: Option<Tether>, single: bool) -> Self {
        let mut reducer = Self {
            complex,
            boxes: Boxes::default(),
            queue: Queue::new(),
            waits: Vec::new(),
            star: Star::default(),
            seen: Vec::new(),
            mark: 0,
            tally: Tally::default(),
            single,
            tether,
            columns,
            patient: false,
        };
        reducer.prepare();
        reducer
    }

    fn prepare(&mut self) {
        let complex = &self.complex;
        let spans = (0..complex.faces.len() as u32).map(|f| Span::around(&complex.places(f)));
        self.boxes = Boxes::new(spans);
        self.waits.resize(complex.faces.len(), 0);
        self.seen = vec![0; complex.at.len()];
        self.star.reset(complex.faces.len());
        self.mark = 0;
    }

    /// Puts all edges into the queue.
    pub fn fill(&mut self, edges: &[Spoke]) {
        for edge in edges {
            if !self.offer(edge.side) {
                *self.tally.rejected.entry(Rejection::Curve).or_insert(0) += 1;
            }
        }
    }

    /// Puts all edges into the queue again, to be tried with patience.
    pub fn refill(&mut self) {
        self.patient = true;
        self.compact();
        let edges = self.complex.rank();
        self.fill(&edges);
    }

    /// Lets seams go; false where there are none.
    pub fn give_up_seams(&mut self) -> bool {
        let any = self.complex.seams.iter().any(|&bits| bits != 0);
        self.complex.seams.fill(0);
        any
    }

    /// Points, triangles and columns of what is left, in the order of the input.
    pub fn finish(mut self) -> (Vec<DVec3>, Vec<[u32; 3]>, Attributes, Tally) {
        self.complex.compact();
        let complex = &self.complex;
        let mut points: Vec<u32> = (0..complex.at.len() as u32).collect();
        par::sort_by_key(&mut points, |&p| complex.point_names[p as usize]);
        let mut faces: Vec<u32> = (0..complex.faces.len() as u32).collect();
        par::sort_by_key(&mut faces, |&f| complex.face_names[f as usize]);
        let mut numbers = vec![0; points.len()];
        points.iter().enumerate().for_each(|(new, &old)| numbers[old as usize] = new as u32);
        let places = points.iter().map(|&p| complex.at[p as usize]).collect();
        let triangle = |&f: &u32| complex.faces[f as usize].corners.map(|p| numbers[p as usize]);
        let triangles = faces.iter().map(triangle).collect();
        (places, triangles, self.columns.gather(complex, &points, &faces), self.tally)
    }

    /// Collapses edges until no more than `target` faces are left, or none gives way.
    pub fn reduce(&mut self, target: usize, run: &Run) -> Result<(), Cancelled> {
        let start = self.complex.count;
        let mut last = self.complex.count;
        let mut tried = 0usize;
        while self.complex.count > target {
            let Some((bucket, side)) = self.queue.pop() else { return Ok(()) };
            tried += 1;
            if tried.is_multiple_of(STRIDE) {
                run.check()?;
                run.progress((start - self.complex.count) as u64, (start - target) as u64);
            }
            self.attempt(side, bucket, run)?;
            if self.complex.count < last / 2 {
                last = self.complex.count;
                self.compact();
            }
        }
        Ok(())
    }

    fn compact(&mut self) {
        let numbers = self.complex.compact();
        if let Some(tether) = &mut self.tether {
            tether.renumber(&numbers, self.complex.faces.len());
        }
        self.queue.renumber(|side| match numbers[(side >> 2) as usize] {
            NONE => None,
            face => Some(4 * face + (side & 3)),
        });
        for (old, &new) in numbers.iter().enumerate() {
            if new != NONE {
                self.waits[new as usize] = self.waits[old];
            }
        }
        self.waits.truncate(self.complex.faces.len());
        self.prepare();
    }

    /// Puts a side into the queue; false where it must not move.
    fn offer(&mut self, side: u32) -> bool {
        let price = self.price(self.complex.ends(side));
        if let Some((cost, _)) = price {
            self.waits[(side >> 2) as usize] |= 1 << (side & 3);
            self.queue.push(bucket(cost), side);
        }
        price.is_some()
    }

    /// What an edge costs, and where its point comes to lie; `None` where it must not move.
    fn price(&self, ends: [u32; 2]) -> Option<(f32, DVec3)> {
        let complex = &self.complex;
        let [a, b] = ends.map(|e| complex.at[e as usize]);
        let mut sum = complex.quadrics[ends[0] as usize];
        sum += complex.quadrics[ends[1] as usize];
        let place = match ends.map(|e| complex.ranks[e as usize]) {
            [Rank::Corner, Rank::Corner] => return None,
            [p, q] if p > q => a,
            [p, q] if p < q => b,
            _ => self.settle(sum, a, b),
        };
        let cost = sum.at(place) + LENGTH * sum.weight() * a.distance_squared(b);
        Some((cost as f32, place))
    }

    fn rounded(&self, p: DVec3) -> DVec3 {
        if self.single { p.as_vec3().as_dvec3() } else { p }
    }

    fn settle(&self, sum: Quadric, a: DVec3, b: DVec3) -> DVec3 {
        let middle = a.midpoint(b);
        match sum.lowest(middle, PULL) {
            Some(p) if p.distance_squared(middle) < 4.0 * a.distance_squared(b) => self.rounded(p),
            _ => a,
        }
    }

    /// Collapses an edge if it still costs no more than its bucket says, and may.
    fn attempt(&mut self, side: u32, from: usize, run: &Run) -> Result<(), Cancelled> {
        let face = (side >> 2) as usize;
        if !self.complex.is_alive(face as u32) {
            return Ok(());
        }
        self.waits[face] &= !(1 << (side & 3));
        let ends = self.complex.ends(side);
        let Some((cost, place)) = self.price(ends) else { return Ok(()) };
        let now = bucket(cost);
        if now > from {
            self.waits[face] |= 1 << (side & 3);
            self.queue.push(now, side);
            return Ok(());
        }
        let [a, b] = ends;
        let [rank_a, rank_b] = ends.map(|e| self.complex.ranks[e as usize]);
        let ends @ [kept, gone] = if rank_a >= rank_b { [a, b] } else { [b, a] };
        let mut refused = match self.collapse(ends, place, run)? {
            Ok(()) => return Ok(()),
            Err(reason) => reason,
        };
        if self.patient && rank_a == rank_b && refused > Rejection::Topology {
            let [p, q] = [kept, gone].map(|e| self.complex.at[e as usize]);
            for other in [p, q, self.rounded(p.midpoint(q))] {
                match self.collapse(ends, other, run)? {
                    Ok(()) => return Ok(()),
                    Err(reason) => refused = reason,
                }
            }
        }
        *self.tally.rejected.entry(refused).or_insert(0) += 1;
        Ok(())
    }

    /// Makes a collapse where every guarantee outlives it, else tells which does not.
    fn collapse(
        &mut self,
        [kept, gone]: [u32; 2],
        place: DVec3,
        run: &Run,
    ) -> Result<Result<(), Rejection>, Cancelled> {
        if let Err(reason) = self.prove(kept, gone, place) {
            return Ok(Err(reason));
        }
        if !self.keeps_near(run)? {
            return Ok(Err(Rejection::Distance));
        }
        self.take(kept, gone, place);
        Ok(Ok(()))
    }

    /// Whether every guarantee outlives the collapse.
    fn prove(&mut self, kept: u32, gone: u32, place: DVec3) -> Result<(), Rejection> {
        self.star.gather(&self.complex, [kept, gone], place)?;
        self.keeps_topology(kept, gone)?;
        self.star.keeps_sides(&self.complex)?;
        self.star.keeps_clear(&self.complex, &self.boxes)
    }

    /// The link condition of 2-complexes (Dey, Edelsbrunner, Guha and Nekhayev 1999): what both
    /// ends have in common, the edge has, in the mesh and among its special edges.
    fn keeps_topology(&mut self, kept: u32, gone: u32) -> Result<(), Rejection> {
        if self.mark > u32::MAX - 4 {
            self.seen.fill(0);
            self.mark = 0;
        }
        self.mark += 2;
        let (mark, both) = (self.mark, self.mark + 1);
        let Self { complex, star, seen, .. } = self;
        for corner in complex.around(kept) {
            complex.faces[(corner >> 2) as usize]
                .corners
                .iter()
                .for_each(|&p| seen[p as usize] = mark);
        }
        (seen[kept as usize], seen[gone as usize]) = (0, 0);
        let mut common = 0;
        for corner in complex.around(gone) {
            for &p in &complex.faces[(corner >> 2) as usize].corners {
                if seen[p as usize] == mark {
                    seen[p as usize] = both;
                    common += 1;
                }
            }
        }
        let apex = |f: &u32| {
            let corners = complex.faces[*f as usize].corners;
            corners.into_iter().find(|&p| p != kept && p != gone)
        };
        let mut apexes: Vec<u32> = star.dying.iter().filter_map(apex).collect();
        apexes.sort_unstable();
        apexes.dedup();
        // Where a face appears twice, the mesh is no complex.
        if common != apexes.len() || star.dying.len() != apexes.len() {
            return Err(Rejection::Topology);
        }
        // A face of either on the same far side would become the other's twin.
        let far = |corner: u32, end: u32| {
            let corners = complex.faces[(corner >> 2) as usize].corners;
            let mut far = corners.into_iter().filter(move |&p| p != end);
            let [p, q] = [far.next()?, far.next()?];
            let known = seen[p as usize] == both && seen[q as usize] == both;
            known.then_some([p.min(q), p.max(q)])
        };
        let twin = complex
            .around(kept)
            .filter_map(|c| far(c, kept))
            .any(|one| complex.around(gone).any(|c| far(c, gone) == Some(one)));
        if twin {
            return Err(Rejection::Topology);
        }
        if complex.ranks[kept as usize] > Rank::Free && complex.ranks[gone as usize] > Rank::Free {
            let mut spokes = [Vec::new(), Vec::new()];
            complex.spokes(kept, &mut spokes[0]);
            complex.spokes(gone, &mut spokes[1]);
            let special = |s: &&Spoke| s.is_special();
            let along = spokes[0].iter().filter(special).any(|s| s.to == gone);
            if !along {
                return Err(Rejection::Curve);
            }
            let mut of_gone = spokes[1].iter().filter(special);
            if of_gone.any(|s| spokes[0].iter().filter(special).any(|o| o.to == s.to)) {
                return Err(Rejection::Topology);
            }
        }
        Ok(())
    }

    /// Whether both meshes stay near each other.
    fn keeps_near(&mut self, run: &Run) -> Result<bool, Cancelled> {
        let Self { complex, star, tether, .. } = self;
        let Some(tether) = tether else { return Ok(true) };
        let (old, new): (Vec<u32>, _) = (star.old().collect(), star.new_patches());
        let beside: Vec<_> = star.beside(complex).collect();
        tether.holds(&old, &new, &beside, star.rise(complex), run)
    }

    /// Makes the collapse, and lets the edges round it wait.
    fn take(&mut self, kept: u32, gone: u32, place: DVec3) {
        let Self { complex, star, boxes, waits, tether, columns, .. } = self;
        let changed = star.fans.iter().map(|f| f.face);
        columns.collapse(complex, [kept, gone], place, changed, &star.dying);
        complex.collapse(kept, gone, place, &star.dying);
        if let Some(tether) = tether {
            tether.take(star.old(), star.fans.iter().map(|f| f.face));
        }
        for fan in &star.fans {
            boxes.set(fan.face, &fan.span);
        }
        for &face in &star.dying {
            boxes.remove(face);
            waits[face as usize] = 0;
        }
        self.tally.collapses += 1;
        let mut spokes: Vec<(u32, u32, bool)> = Vec::new();
        for corner in complex.around(kept) {
            let (face, i) = (corner >> 2, corner & 3);
            let before = (i + 2) % 3;
            for (i, to) in [(i, (i + 1) % 3), (before, before)] {
                let to = complex.faces[face as usize].corners[to as usize];
                let waiting = waits[face as usize] >> i & 1 == 1;
                match spokes.iter_mut().find(|s| s.0 == to) {
                    Some(spoke) => spoke.2 |= waiting,
                    None => spokes.push((to, 4 * face + i, waiting)),
                }
            }
        }
        for (_, side, _) in spokes.into_iter().filter(|s| !s.2) {
            self.offer(side);
        }
    }
}
