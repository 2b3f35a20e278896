//! The collapse of edges, the cheapest first, each only where every guarantee outlives it.

use super::boxes::{Boxes, Span};
use super::clearance::{Conflict, Flat, Patch, conflict, flat, turn};
use super::columns::Columns;
use super::complex::{Complex, NONE, Rank, Spoke};
use super::queue::{Queue, bucket};
use super::tether::Tether;
use super::{Rejection, Tally};
use crate::attributes::Attributes;
use crate::par;
use crate::quadric::Quadric;
use crate::run::{Cancelled, Run};
use glam::DVec3;

/// Edges between two looks at the flag that stops the work.
const STRIDE: usize = 4096;

/// Most faces round both ends of an edge.
const MOST: usize = 256;

/// Cosine of the largest turn of a face in one step, squared: 60 degrees.
const TURN: f64 = 0.25;

/// Cosine of the largest turn of a face from what it stands for, squared: 75 degrees.
const DRIFT: f64 = 0.067;

/// Height of a face, by its longest side, below which it must not get flatter, squared.
const FLAT: f64 = 0.001;

/// Cosine of the angle between an axis and normals of faces that are seen along it, squared: 85
/// degrees.
const GRAZING: f64 = 0.0076;

/// How much a point is held where planes do not settle it.
const PULL: f64 = 1e-6;

/// How much length costs beside the squares of distances.
const LENGTH: f64 = 1e-6;

/// A face round a point that moves.
#[derive(Debug)]
struct Fan {
    face: u32,
    patch: Patch,
    normal: DVec3,
    span: Span,
}

/// A direction along an axis from which a star is seen.
#[derive(Debug, Clone, Copy)]
struct View {
    axis: usize,
    up: bool,
}

impl View {
    /// From where the normals point most.
    fn of(fans: &[Fan]) -> Self {
        let sum: DVec3 = fans.iter().map(|f| f.normal).sum();
        let axis = steepest(sum);
        Self { axis, up: sum[axis] > 0.0 }
    }

    /// What is left of a place, turned so that what is seen from above runs counter-clockwise.
    fn flat(&self, p: DVec3) -> Flat {
        let [u, v] = flat(self.axis, p);
        if self.up { [u, v] } else { [v, u] }
    }

    /// How far a triangle that is seen from above lies over or under a place; `None` beside it.
    fn height(&self, at: &[DVec3; 3], p: DVec3) -> Option<f64> {
        let [a, b, c] = at.map(|q| self.flat(q));
        let o = self.flat(p);
        let part = |p: Flat, q: Flat| (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0]);
        let parts = [part(b, c), part(c, a), part(a, b)];
        let sum: f64 = parts.iter().sum();
        let inside = parts.iter().all(|&x| x >= -1e-9 * sum);
        let height = (0..3).map(|i| parts[i] / sum * (at[i][self.axis] - p[self.axis])).sum();
        inside.then_some(height)
    }

    /// How far two segments are apart in height where they cross; `None` where they do not.
    fn gap(&self, [a, b]: [DVec3; 2], [c, d]: [DVec3; 2]) -> Option<f64> {
        let [p, q, r, s] = [a, b, c, d].map(|x| self.flat(x));
        let cross = |u: Flat, v: Flat| u[0] * v[1] - u[1] * v[0];
        let way = |u: Flat, v: Flat| [v[0] - u[0], v[1] - u[1]];
        let (along, other, between) = (way(p, q), way(r, s), way(p, r));
        let area = cross(along, other);
        let (t, u) = (cross(between, other) / area, cross(between, along) / area);
        let on = |x: f64| (-1e-9..=1.0 + 1e-9).contains(&x);
        let height = |a: DVec3, b: DVec3, t: f64| a[self.axis] + (b[self.axis] - a[self.axis]) * t;
        (on(t) && on(u)).then(|| height(a, b, t) - height(c, d, u))
    }

    /// Whether a face with this normal is seen from above, and not from its edge: two such faces
    /// are not folded onto each other.
    fn sees(&self, normal: DVec3) -> bool {
        let along = if self.up { normal[self.axis] } else { -normal[self.axis] };
        along > 0.0 && along * along > GRAZING * normal.length_squared()
    }
}

/// What one edge becomes.
#[derive(Debug, Default)]
struct Star {
    /// Faces that change.
    fans: Vec<Fan>,
    /// Faces on the edge, which end.
    dying: Vec<u32>,
    /// How many faces change or end.
    old: usize,
    /// Faces near the changed ones.
    near: Vec<u32>,
    /// Changed faces as seen from above.
    flats: Vec<[Flat; 3]>,
    /// The changed faces go all the way round their point.
    whole_round: bool,
    /// From where they were seen, where they are one graph over their place.
    view: Option<View>,
}

/// The mesh and what waits to be done.
pub struct Reducer {
    pub complex: Complex,
    boxes: Boxes,
    queue: Queue,
    /// Bit i of a face tells that its side i waits.
    waits: Vec<u8>,
    star: Star,
    /// Marks of points and of faces.
    seen: Vec<u32>,
    marks: Vec<u32>,
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
            marks: Vec::new(),
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
        self.marks = vec![0; complex.faces.len()];
        self.mark = 0;
    }

    /// Puts all edges into the queue.
    pub fn fill(&mut self, edges: &[Spoke]) {
        for edge in edges {
            self.offer(edge.side);
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

    /// Puts a side into the queue.
    fn offer(&mut self, side: u32) {
        if let Some((cost, _)) = self.price(self.complex.ends(side)) {
            self.waits[(side >> 2) as usize] |= 1 << (side & 3);
            self.queue.push(bucket(cost), side);
        }
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
        if self.mark > u32::MAX - 4 {
            self.seen.fill(0);
            self.marks.fill(0);
            self.mark = 0;
        }
        self.gather(kept, gone, place)?;
        self.keeps_topology(kept, gone)?;
        self.keeps_sides()?;
        self.keeps_clear()
    }

    /// Collects the faces that would change or end.
    fn gather(&mut self, kept: u32, gone: u32, place: DVec3) -> Result<(), Rejection> {
        let Self { complex, star, marks, mark, .. } = self;
        let Star { fans, dying, old, .. } = star;
        (fans.clear(), dying.clear(), *old = 0);
        *mark += 2;
        let stays = complex.at[kept as usize] == place;
        star.whole_round = !stays && complex.ranks[kept as usize] == Rank::Free;
        for point in [kept, gone] {
            for corner in complex.around(point) {
                let (face, i) = (corner >> 2, (corner & 3) as usize);
                let mut corners = complex.faces[face as usize].corners;
                corners.rotate_left(i);
                let both = corners.contains(&kept) && corners.contains(&gone);
                if both && point == gone {
                    continue;
                }
                if both {
                    dying.push(face);
                } else if point == gone || !stays {
                    corners[0] = kept;
                    let [_, b, c] = corners.map(|p| complex.at[p as usize]);
                    let at = [place, b, c];
                    let normal = (b - place).cross(c - place);
                    let span = Span::around(&at);
                    fans.push(Fan { face, patch: Patch { corners, at }, normal, span });
                } else {
                    continue;
                }
                marks[face as usize] = *mark;
                *old += 1;
                if *old > MOST {
                    return Err(Rejection::Crowd);
                }
            }
        }
        Ok(())
    }

    /// The link condition of 2-complexes (Dey, Edelsbrunner, Guha and Nekhayev 1999): what both
    /// ends have in common, the edge has, in the mesh and among its special edges.
    fn keeps_topology(&mut self, kept: u32, gone: u32) -> Result<(), Rejection> {
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

    /// No face turns over, by much in one step or in many, and none becomes a sliver.
    fn keeps_sides(&self) -> Result<(), Rejection> {
        for fan in &self.star.fans {
            let [a, b, c] = self.complex.places(fan.face);
            let before = (b - a).cross(c - a);
            let doubled = fan.normal.length_squared();
            let turned = |from: DVec3, most: f64| {
                let dot = fan.normal.dot(from);
                let bound = most * doubled * from.length_squared();
                bound > 0.0 && (dot <= 0.0 || dot * dot < bound)
            };
            if doubled == 0.0 {
                return Err(Rejection::Sliver);
            }
            let stands_for = self.complex.stands_for[fan.face as usize].as_dvec3();
            if turned(before, TURN) || turned(stands_for, DRIFT) {
                return Err(Rejection::Turn);
            }
            // Squares of the height by the longest side.
            let shape = |t: [DVec3; 3], doubled: f64| doubled / longest_squared(t).powi(2);
            let now = shape(fan.patch.at, doubled);
            if now < FLAT && now < 0.25 * shape([a, b, c], before.length_squared()) {
                return Err(Rejection::Sliver);
            }
        }
        Ok(())
    }

    /// No changed face meets another, or folds onto it, that its former self did not.
    fn keeps_clear(&mut self) -> Result<(), Rejection> {
        let Self { complex, star, boxes, marks, mark, .. } = self;
        let Star { fans, dying, near, flats, whole_round, view: seen_from, .. } = star;
        let patch = |face: u32| {
            let corners = complex.faces[face as usize].corners;
            Patch { corners, at: corners.map(|p| complex.at[p as usize]) }
        };
        let rejects = |fan: &Fan, found: Conflict, other: u32| {
            let reason = match found {
                Conflict::Same => return Some(Rejection::Topology),
                Conflict::Folded => Rejection::Fold,
                Conflict::Meeting => Rejection::Crossing,
            };
            let former = patch(fan.face);
            let [a, b, c] = former.at;
            let known = conflict(&former, &patch(other), steepest((b - a).cross(c - a)));
            (known != Some(found)).then_some(reason)
        };
        let ends = dying.iter().map(|&f| boxes.get(f));
        let spans = fans.iter().map(|fan| fan.span).chain(ends);
        let whole = spans.reduce(|mut whole, span| {
            whole.join(&span);
            whole
        });
        near.clear();
        whole.iter().for_each(|whole| boxes.near(whole, near));
        let view = View::of(fans);
        let mut open = !*whole_round;
        flats.clear();
        for fan in fans.iter() {
            let seen = fan.patch.at.map(|p| view.flat(p));
            open |= !view.sees(fan.normal) || turn(seen[0], seen[1], seen[2]) != 1;
            flats.push(seen);
        }
        // Faces that are all seen from above do not meet where they go round their point once.
        let clear =
            !open && flats.iter().filter(|[o, p, q]| p[1] <= o[1] && o[1] < q[1]).count() == 1;
        *seen_from = clear.then_some(view);
        if !clear {
            for (i, fan) in fans.iter().enumerate() {
                for other in &fans[..i] {
                    let found = conflict(&fan.patch, &other.patch, steepest(fan.normal));
                    if let Some(reason) = found.and_then(|c| rejects(fan, c, other.face)) {
                        return Err(reason);
                    }
                }
            }
        }
        for &face in near.iter() {
            if marks[face as usize] == *mark {
                continue;
            }
            let span = boxes.get(face);
            let mut other = None;
            for (fan, seen) in fans.iter().zip(flats.iter()) {
                if !fan.span.overlaps(&span) {
                    continue;
                }
                let (other, from_above) = other.get_or_insert_with(|| {
                    let patch = patch(face);
                    (patch, patch.at.map(|p| view.flat(p)))
                });
                if !open && is_beyond(fan, seen, other, from_above, &view) {
                    continue;
                }
                let found = conflict(&fan.patch, other, steepest(fan.normal));
                if let Some(reason) = found.and_then(|c| rejects(fan, c, face)) {
                    return Err(reason);
                }
            }
        }
        Ok(())
    }

    /// Whether both meshes stay near each other.
    fn keeps_near(&mut self, run: &Run) -> Result<bool, Cancelled> {
        let Self { complex, star, marks, mark, tether, .. } = self;
        let Some(tether) = tether else { return Ok(true) };
        let beside: Vec<(u32, Patch)> = star
            .near
            .iter()
            .filter(|&&f| marks[f as usize] != *mark)
            .map(|&f| {
                (f, Patch { corners: complex.faces[f as usize].corners, at: complex.places(f) })
            })
            .collect();
        let rise = star.view.and_then(|view| rise(complex, star, view));
        let new: Vec<(u32, Patch)> = star.fans.iter().map(|f| (f.face, f.patch)).collect();
        let old: Vec<u32> = new.iter().map(|f| f.0).chain(star.dying.iter().copied()).collect();
        tether.holds(&old, &new, &beside, rise, run)
    }

    /// Makes the collapse, and lets the edges round it wait.
    fn take(&mut self, kept: u32, gone: u32, place: DVec3) {
        let Self { complex, star, boxes, waits, tether, columns, .. } = self;
        let changed = star.fans.iter().map(|f| f.face);
        columns.collapse(complex, [kept, gone], place, changed, &star.dying);
        complex.collapse(kept, gone, place, &star.dying);
        if let Some(tether) = tether {
            let new: Vec<(u32, Patch)> = star.fans.iter().map(|f| (f.face, f.patch)).collect();
            let old: Vec<u32> = new.iter().map(|f| f.0).chain(star.dying.iter().copied()).collect();
            tether.take(&old, &new);
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

/// Whether the line of a side of a fan that is seen from above has all of another face strictly on
/// its outer side, but for points that they share.
fn is_beyond(
    fan: &Fan,
    seen: &[Flat; 3],
    other: &Patch,
    from_above: &[Flat; 3],
    view: &View,
) -> bool {
    [1, 0, 2].into_iter().any(|i| {
        let j = (i + 1) % 3;
        let [p, q] = [fan.patch.corners[i], fan.patch.corners[j]];
        let mut shared = 0;
        let beyond = (0..3).all(|k| {
            let corner = other.corners[k];
            if corner == p || corner == q {
                shared += 1;
                return true;
            }
            turn(seen[i], seen[j], from_above[k]) < 0
        });
        beyond
            && (shared < 2 || {
                let [a, b, c] = other.at;
                view.sees((b - a).cross(c - a))
            })
    })
}

/// The largest difference in height between a star and what it becomes, which is a graph over its
/// place as seen along `view`; `None` where the star itself is not.
fn rise(complex: &Complex, star: &Star, view: View) -> Option<f64> {
    let before: Vec<Patch> = star
        .fans
        .iter()
        .map(|f| f.face)
        .chain(star.dying.iter().copied())
        .map(|f| Patch { corners: complex.faces[f as usize].corners, at: complex.places(f) })
        .collect();
    let ring = |p: &u32| star.fans.iter().any(|f| f.patch.corners[1..].contains(p));
    let mut most = 0.0f64;
    let mut see = |height: Option<f64>| {
        height.is_some_and(|h| {
            most = most.max(h.abs());
            true
        })
    };
    for old in &before {
        let [a, b, c] = old.at;
        if !view.sees((b - a).cross(c - a)) {
            return None;
        }
        for i in 0..3 {
            let inner = old.corners[i];
            if ring(&inner) {
                continue;
            }
            // Each inner point of the old star, and each of its inner edges against those of the new.
            let over = star.fans.iter().find_map(|f| view.height(&f.patch.at, old.at[i]));
            if !see(over) {
                return None;
            }
            for k in [1, 2] {
                let (end, to) = (old.corners[(i + k) % 3], old.at[(i + k) % 3]);
                for fan in &star.fans {
                    if fan.patch.corners[1] != end
                        && let Some(gap) =
                            view.gap([old.at[i], to], [fan.patch.at[0], fan.patch.at[1]])
                    {
                        see(Some(gap));
                    }
                }
            }
        }
    }
    let place = star.fans.first()?.patch.at[0];
    let over = before.iter().find_map(|old| view.height(&old.at, place));
    see(over).then_some(most)
}

/// The coordinate axis that a normal leans to most.
fn steepest(normal: DVec3) -> usize {
    let n = normal.abs();
    if n.x >= n.y && n.x >= n.z {
        0
    } else if n.y >= n.z {
        1
    } else {
        2
    }
}

fn longest_squared([a, b, c]: [DVec3; 3]) -> f64 {
    a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a))
}
