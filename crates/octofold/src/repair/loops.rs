//! What the surface does to one cell: piercing points, arcs and loops.
//!
//! A corner is *open* where one of its eight cells is outside; an edge is *uncut* where one of its
//! four cells is. An edge that is not uncut is pierced once for each of its open ends. On each face
//! of a cell every run of open corners joined by uncut edges ends in two piercing points, which an
//! arc joins; so every piercing point has two arcs, and arcs form loops. Loops part the cell's
//! surface into open and other regions, and each lies between one of each kind. Source:
//! specification of repair (A.1.6).

use crate::surface::cell::{edge_at, edge_axis, edge_corner, face_corners};

/// Piercing points that a cell can have: point `2 e + s` lies on edge `e` towards its end `s`.
pub const POINTS: usize = 24;

/// In place of a number: none.
pub const NONE: u8 = u8::MAX;

/// The open corners of a cell in the low eight bits, its uncut edges in the twelve above.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Config(pub u32);

impl Config {
    /// Configurations that a number can name.
    pub const COUNT: usize = 1 << 20;

    /// Whether corner `c` is open.
    pub const fn open(self, c: usize) -> bool {
        self.0 >> c & 1 == 1
    }

    /// Whether edge `e` is uncut.
    pub const fn uncut(self, e: usize) -> bool {
        self.0 >> (8 + e) & 1 == 1
    }

    /// Which ends of edge `e` have a piercing point.
    pub const fn pierced(self, e: usize) -> [bool; 2] {
        let (low, axis) = (edge_corner(e), edge_axis(e));
        let cut = !self.uncut(e);
        [cut && self.open(low), cut && self.open(low | 1 << axis)]
    }
}

/// The corner that a piercing point belongs to.
pub const fn corner_of(point: usize) -> usize {
    let (edge, end) = (point / 2, point % 2);
    edge_corner(edge) | end << edge_axis(edge)
}

/// The loops of a configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct Loops {
    /// How many there are.
    pub count: u8,
    /// The loop of each piercing point.
    pub of: [u8; POINTS],
    /// The piercing point that follows, with the open side on the left seen from outside the cell.
    pub next: [u8; POINTS],
    /// The face on which the arc to the point that follows runs.
    pub via: [u8; POINTS],
    /// Arcs on each face.
    pub arcs: [u8; 6],
}

impl Loops {
    /// Follows all arcs.
    pub fn new(config: Config) -> Self {
        let mut loops = Self {
            count: 0,
            of: [NONE; POINTS],
            next: [NONE; POINTS],
            via: [NONE; POINTS],
            arcs: [0; 6],
        };
        for f in 0..6 {
            let corners = face_corners(f);
            let along = |i: usize| {
                let (a, b) = (corners[i % 4], corners[(i + 1) % 4]);
                let axis = (a ^ b).trailing_zeros() as usize;
                (edge_at(a, axis), axis)
            };
            for i in 0..4 {
                let (before, axis) = along(i + 3);
                if !config.open(corners[i]) || config.uncut(before) {
                    continue;
                }
                let start = 2 * before + (corners[i] >> axis & 1);
                let mut j = i;
                while config.uncut(along(j).0) {
                    j += 1;
                }
                let (after, axis) = along(j);
                let end = 2 * after + (corners[j % 4] >> axis & 1);
                // The open run is on the left of the way back from its end to its start.
                loops.next[end] = start as u8;
                loops.via[end] = f as u8;
                loops.arcs[f] += 1;
            }
        }
        for first in 0..POINTS {
            if loops.next[first] != NONE && loops.of[first] == NONE {
                let mut at = first;
                while loops.of[at] == NONE {
                    loops.of[at] = loops.count;
                    at = loops.next[at] as usize;
                }
                loops.count += 1;
            }
        }
        loops
    }

    /// The piercing points of loop `number`, in order.
    pub fn points(&self, number: u8) -> impl Iterator<Item = usize> + '_ {
        let first = self.of.iter().position(|&l| l == number);
        let next = move |&at: &usize| Some(self.next[at] as usize).filter(|n| Some(*n) != first);
        std::iter::successors(first, next)
    }

    /// The piercing points of face `f`, as the start and the end of each arc on it.
    pub fn on_face(&self, f: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let arcs = (0..POINTS).filter(move |&p| self.via[p] as usize == f);
        arcs.map(|p| (p, self.next[p] as usize))
    }

    /// Sides of the loops that have no point in common: for each loop whether that is its open side
    /// or the other, where one of these borders on no other loop.
    pub fn sides(&self, config: Config) -> Vec<Option<Side>> {
        let open = Regions::<8>::new((0..12).filter(|&e| config.uncut(e)).map(|e| {
            let low = edge_corner(e);
            [low, low | 1 << edge_axis(e)]
        }));
        let other = Regions::<6>::new((0..12).filter(|&e| !config.uncut(e)).map(|e| {
            let (axis, low) = (edge_axis(e), edge_corner(e));
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            [2 * u + (low >> u & 1), 2 * v + (low >> v & 1)]
        }));
        let of: Vec<(usize, usize)> = (0..self.count)
            .map(|l| {
                let point = self.of.iter().position(|&o| o == l).unwrap_or_default();
                (open.of(corner_of(point)), other.of(self.via[point] as usize))
            })
            .collect();
        let alone = |pick: fn(&(usize, usize)) -> usize, l: usize| {
            of.iter().filter(|r| pick(r) == pick(&of[l])).count() == 1
        };
        (0..of.len())
            .map(|l| {
                if alone(|r| r.0, l) {
                    Some(Side::Open)
                } else if alone(|r| r.1, l) {
                    Some(Side::Other)
                } else {
                    None
                }
            })
            .collect()
    }
}

/// One of the two sides of a loop on the surface of its cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The left, with the open corners.
    Open,
    /// The right.
    Other,
}

/// Sets of connected corners or faces.
struct Regions<const N: usize>([usize; N]);

impl<const N: usize> Regions<N> {
    fn new(links: impl Iterator<Item = [usize; 2]>) -> Self {
        let mut regions = Self(std::array::from_fn(|i| i));
        for [a, b] in links {
            let (a, b) = (regions.of(a), regions.of(b));
            regions.0.iter_mut().filter(|r| **r == b).for_each(|r| *r = a);
        }
        regions
    }

    fn of(&self, item: usize) -> usize {
        self.0[item]
    }
}

/// The loops of all configurations that occur.
pub struct Patterns {
    of: Vec<u32>,
    loops: Vec<Loops>,
}

impl Patterns {
    /// The loops of `configs`.
    pub fn new(configs: impl Iterator<Item = Config>) -> Self {
        let mut patterns = Self { of: vec![0; Config::COUNT], loops: Vec::new() };
        for config in configs {
            let at = &mut patterns.of[config.0 as usize];
            if *at == 0 {
                patterns.loops.push(Loops::new(config));
                *at = patterns.loops.len() as u32;
            }
        }
        patterns
    }

    /// The loops of one of them.
    pub fn get(&self, config: Config) -> &Loops {
        &self.loops[self.of[config.0 as usize] as usize - 1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether a configuration can occur: uncut edges have two open ends.
    fn sound(config: Config) -> bool {
        (0..12).all(|e| {
            let low = edge_corner(e);
            !config.uncut(e) || (config.open(low) && config.open(low | 1 << edge_axis(e)))
        })
    }

    #[test]
    fn in_every_configuration_points_lie_on_loops_between_two_regions() {
        let mut seen = 0;
        for number in 0..Config::COUNT as u32 {
            let config = Config(number);
            if !sound(config) {
                continue;
            }
            seen += 1;
            let loops = Loops::new(config);
            for p in 0..POINTS {
                let pierced = config.pierced(p / 2)[p % 2];
                assert_eq!(loops.of[p] != NONE, pierced, "{number:x} {p}");
            }
            // Every point is followed by one, and follows one.
            let mut after: Vec<u8> = loops.next.iter().copied().filter(|&n| n != NONE).collect();
            after.sort_unstable();
            after.dedup();
            assert_eq!(after.len(), loops.of.iter().filter(|&&l| l != NONE).count());
            let sides = loops.sides(config);
            assert!(loops.count < 2 || sides.iter().flatten().count() >= 2, "{number:x}");
            for l in 0..loops.count {
                assert!(loops.points(l).count() >= 2);
            }
        }
        assert!(seen > 10_000, "{seen}");
    }
}
