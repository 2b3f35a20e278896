//! Polygons with holes into triangles, exactly and on their own corners only.
//!
//! Corners are whole numbers, and some of them lie on straight sides. Each hole is joined to the ring round
//! it by a bridge to the nearest corner that it sees, then ears are cut: triangles at a corner whose third
//! side runs inside and touches nothing. So a ring of n corners becomes n - 2 triangles, none of them flat,
//! and every side stays a side. A polygon may touch itself at corners. Source: Meisters, "Polygons have
//! ears", 1975; Held, "FIST", 2001.

/// A corner in its plane.
pub type Place = [i64; 2];

/// Reusable room for cutting polygons.
#[derive(Default)]
pub struct Ears {
    ring: Vec<u32>,
    next: Vec<u32>,
    last: Vec<u32>,
}

/// Twice the area of a triangle, above 0 where it turns left.
fn turn(a: Place, b: Place, c: Place) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Whether `to` lies strictly in the angle at a corner, on the left of its way.
fn sees([before, corner, after]: [Place; 3], to: Place) -> bool {
    match turn(before, corner, after) {
        0 => turn(corner, after, to) > 0,
        1.. => turn(corner, after, to) > 0 && turn(corner, to, before) > 0,
        _ => !(turn(corner, to, after) >= 0 && turn(corner, before, to) >= 0),
    }
}

/// Whether a place lies in a triangle or on its border.
fn holds([a, b, c]: [Place; 3], p: Place) -> bool {
    turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0
}

/// Whether two segments have a place in common; one that is an end of both does not count.
fn meet([a, b]: [Place; 2], [c, d]: [Place; 2]) -> bool {
    let between = |p: Place, [a, b]: [Place; 2]| {
        turn(a, b, p) == 0
            && p != a
            && p != b
            && (0..2).all(|i| (a[i].min(b[i])..=a[i].max(b[i])).contains(&p[i]))
    };
    let sides = [turn(a, b, c), turn(a, b, d), turn(c, d, a), turn(c, d, b)].map(i64::signum);
    sides[0] * sides[1] < 0 && sides[2] * sides[3] < 0
        || between(c, [a, b])
        || between(d, [a, b])
        || between(a, [c, d])
        || between(b, [c, d])
        || ([a, b] == [c, d] || [a, b] == [d, c])
}

impl Ears {
    /// Cuts a polygon: the outer loop goes counter-clockwise, those of holes clockwise. `place` tells where
    /// corners lie; triangles name them.
    pub fn cut(
        &mut self,
        loops: &[Vec<u32>],
        place: impl Fn(u32) -> Place,
        mut emit: impl FnMut([u32; 3]),
    ) {
        let Some((outer, holes)) = loops.split_first() else { return };
        self.ring.clear();
        self.ring.extend(outer);
        // The leftmost first: a hole then sees a corner of the ring.
        let leftmost = |hole: &Vec<u32>| {
            let at = (0..hole.len()).min_by_key(|&i| place(hole[i])).unwrap_or(0);
            (place(hole[at]), at)
        };
        let mut holes: Vec<_> = holes.iter().map(|hole| (leftmost(hole), hole)).collect();
        holes.sort_by_key(|h| h.0);
        for ((_, at), hole) in holes {
            self.bridge(hole, at, &place);
        }
        self.clip(&place, &mut emit);
    }

    /// Joins a hole to the ring, from its corner `at`.
    fn bridge(&mut self, hole: &[u32], at: usize, place: &impl Fn(u32) -> Place) {
        let own = |i: usize| place(hole[(at + i) % hole.len()]);
        let from = own(0);
        let corner = [own(hole.len() - 1), from, own(1)];
        let count = self.ring.len();
        let on = |i: usize| place(self.ring[i % count]);
        let far = |i: usize| {
            let to = on(i);
            (to[0] - from[0]).pow(2) + (to[1] - from[1]).pow(2)
        };
        let mut to: Vec<usize> = (0..count).filter(|&i| on(i)[0] < from[0]).collect();
        to.sort_by_key(|&i| (far(i), i));
        let free = |&i: &usize| {
            let way = [from, on(i)];
            sees(corner, way[1])
                && sees([on(i + count - 1), way[1], on(i + 1)], from)
                && (0..count).all(|k| !meet(way, [on(k), on(k + 1)]))
                && (0..hole.len()).all(|k| !meet(way, [own(k), own(k + 1)]))
        };
        let best = to.iter().copied().find(free).or(to.first().copied()).unwrap_or(0);
        let again = self.ring[best];
        let turned = (0..=hole.len()).map(|i| hole[(at + i) % hole.len()]);
        let joined: Vec<u32> = turned.chain([again]).collect();
        self.ring.splice(best + 1..best + 1, joined);
    }

    /// Cuts ears off the ring.
    fn clip(&mut self, place: &impl Fn(u32) -> Place, emit: &mut impl FnMut([u32; 3])) {
        let count = self.ring.len() as u32;
        if count < 3 {
            return;
        }
        let places: Vec<Place> = self.ring.iter().map(|&n| place(n)).collect();
        self.next.clear();
        self.next.extend((1..count).chain([0]));
        self.last.clear();
        self.last.extend([count - 1].into_iter().chain(0..count - 1));
        let (mut at, mut left, mut tried) = (0u32, count, 0);
        while left > 3 {
            let [before, after] = [self.last[at as usize], self.next[at as usize]];
            // A ring that has no ear is not a polygon; whatever is cut then, sides stay sides.
            if tried > left || self.is_ear(&places, before, at, after) {
                emit([before, at, after].map(|i| self.ring[i as usize]));
                self.next[before as usize] = after;
                self.last[after as usize] = before;
                left -= 1;
                tried = 0;
                // The next but one: long fans make thin triangles.
                at = self.next[after as usize];
            } else {
                tried += 1;
                at = after;
            }
        }
        let [before, after] = [self.last[at as usize], self.next[at as usize]];
        emit([before, at, after].map(|i| self.ring[i as usize]));
    }

    fn is_ear(&self, places: &[Place], before: u32, at: u32, after: u32) -> bool {
        let of = |i: u32| places[i as usize];
        let ear = [of(before), of(at), of(after)];
        if turn(ear[0], ear[1], ear[2]) <= 0
            || !sees([of(self.last[before as usize]), ear[0], ear[1]], ear[2])
            || !sees([ear[1], ear[2], of(self.next[after as usize])], ear[0])
        {
            return false;
        }
        let low = [0, 1].map(|i| ear.iter().map(|p| p[i]).min().unwrap_or(0));
        let high = [0, 1].map(|i| ear.iter().map(|p| p[i]).max().unwrap_or(0));
        let mut other = self.next[after as usize];
        while other != before {
            let p = of(other);
            let near = (0..2).all(|i| (low[i]..=high[i]).contains(&p[i]));
            if near && !ear.contains(&p) && holds(ear, p) {
                return false;
            }
            other = self.next[other as usize];
        }
        true
    }
}
