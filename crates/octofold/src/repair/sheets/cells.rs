//! The cells through which sheets go, and the leaves of each.
//!
//! The surface meets the walls of a cell in a graph: a point on each edge whose quad stands, and on
//! each face lines that join these. A *leaf* is a connected part of the graph; each leaf has a vertex
//! of its own. Source: specification of repair (A.2, ambiguity f).

use super::super::bricks::{Block, Place, coordinates};
use super::super::labels::per_brick;
use super::super::members::Members;
use super::complex::{Complex, Vertex};
use super::guide::{Leaf, Pairing, SheetGuide};
use crate::run::{Cancelled, Run};
use crate::sets::Sets;
use crate::surface::cell::{edge_at, edge_axis, edge_corner, face_corners};

/// The edges of a cell whose quads stand in the low twelve bits; above them two bits for each face,
/// how it pairs them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Config(pub u32);

impl Config {
    /// Whether the quad of edge `e` stands.
    pub const fn stands(self, e: usize) -> bool {
        self.0 >> e & 1 == 1
    }

    /// How face `f` pairs its edges, where it has four.
    pub const fn pairing(self, f: usize) -> Pairing {
        match self.0 >> (12 + 2 * f) & 3 {
            1 => Pairing::Even,
            2 => Pairing::Odd,
            _ => Pairing::Junction,
        }
    }

    fn with(self, f: usize, pairing: Pairing) -> Self {
        let bits = match pairing {
            Pairing::Junction => 0,
            Pairing::Even => 1,
            Pairing::Odd => 2,
        };
        Self(self.0 & !(3 << (12 + 2 * f)) | bits << (12 + 2 * f))
    }

    /// The edges of face `f` whose quads stand, in groups that are joined on the face.
    pub fn groups(self, f: usize) -> [u16; 2] {
        let round = edges_round(f);
        let of = |picks: [usize; 2]| picks.iter().fold(0, |bits, &k| bits | 1u16 << round[k]);
        match self.pairing(f) {
            // An arc between two edges cuts off the corner between them.
            Pairing::Odd => [of([0, 1]), of([2, 3])],
            Pairing::Even => [of([1, 2]), of([3, 0])],
            Pairing::Junction => {
                let all = round.iter().fold(0, |bits, e| bits | 1u16 << e);
                [all & self.0 as u16, 0]
            }
        }
    }

    /// The leaves, by their lowest edges; all in one where `joined`.
    pub fn leaves(self, joined: bool) -> impl Iterator<Item = u16> {
        let mut leaves = [0u16; 12];
        let mut count = 0;
        for e in (0..12).filter(|&e| self.stands(e)) {
            leaves[count] = 1 << e;
            count += 1;
        }
        let mut join = |edges: u16| {
            let Some(first) = (0..count).find(|&l| leaves[l] & edges != 0) else { return };
            let mut l = first + 1;
            while l < count {
                if leaves[l] & edges != 0 {
                    leaves[first] |= leaves[l];
                    leaves.copy_within(l + 1..count, l);
                    count -= 1;
                } else {
                    l += 1;
                }
            }
        };
        for f in 0..6 {
            self.groups(f).into_iter().filter(|&g| g != 0).for_each(&mut join);
        }
        if joined {
            join(0xfff);
        }
        leaves.into_iter().take(count)
    }

    /// Whether a leaf ends on a wall.
    fn has_rim(self, leaf: u16) -> bool {
        (0..6).flat_map(|f| self.groups(f)).any(|g| g & leaf != 0 && g.count_ones() == 1)
    }
}

/// The edges of face `f`, each between a corner and the next from its lowest corner on.
pub fn edges_round(f: usize) -> [usize; 4] {
    let corners = face_corners(f);
    std::array::from_fn(|i| {
        let (a, b) = (corners[i], corners[(i + 1) % 4]);
        edge_at(a & b, (a ^ b).trailing_zeros() as usize)
    })
}

/// All cells with a standing quad.
pub struct Cells<'a> {
    /// The cells.
    pub members: Members<'a>,
    configs: Vec<Config>,
    /// First leaf of each cell, and the end.
    leaves: Vec<u32>,
    /// Whether each cell has one leaf whatever its walls say.
    joined: bool,
}

impl<'a> Cells<'a> {
    /// Finds them; `None` where there are more leaves than 32 bits can number. With `joined` each
    /// cell has one leaf, and faces are never paired.
    pub fn new<G: SheetGuide>(
        complex: &Complex<'a>,
        guide: &G,
        joined: bool,
        run: &Run,
    ) -> Result<Option<Self>, Cancelled> {
        run.stage("cells");
        let bricks = complex.bricks;
        let nothing = vec![false; bricks.runs()];
        let found = per_brick(bricks, run, |brick| {
            let halos = [0, 1, 2].map(|a| bricks.halo(brick, &complex.quads[a], &nothing));
            let mut block: Block = [0; 8];
            let mut configs = Vec::new();
            if halos.iter().flatten().all(|&row| row == 0) {
                return (block, configs);
            }
            for cell in 0..512 {
                let [x, y, z] = coordinates(cell).map(|c| c as usize);
                let bit = |e: usize| {
                    let low = edge_corner(e);
                    let (x, y, z) = (x + (low & 1), y + (low >> 1 & 1), z + (low >> 2));
                    u32::from(halos[edge_axis(e)][10 * (z + 1) + y + 1]) >> (x + 1) & 1
                };
                let edges = (0..12).fold(0, |bits, e| bits | bit(e) << e);
                if edges != 0 {
                    block[cell as usize / 64] |= 1 << (cell % 64);
                    configs.push(Config(edges));
                }
            }
            (block, configs)
        })?;
        let blocks = found.iter().map(|f| f.0).collect();
        let Some(members) = Members::new(bricks, blocks) else { return Ok(None) };
        let configs = found.into_iter().flat_map(|f| f.1).collect();
        let mut cells = Self { members, configs, leaves: Vec::new(), joined };
        if !joined {
            cells.pair(complex, guide, run)?;
        }
        let counts = cells
            .members
            .per_cell(run, |cell, _| cells.config(cell).leaves(joined).count() as u32)?;
        let mut total = 0u64;
        cells.leaves.reserve_exact(counts.len() + 1);
        cells.leaves.push(0);
        for count in counts {
            total += u64::from(count);
            cells.leaves.push(total as u32);
        }
        Ok((total < u64::from(u32::MAX) / 8).then_some(cells))
    }

    /// Pairs the edges of faces with four.
    fn pair<G: SheetGuide>(
        &mut self,
        complex: &Complex<'_>,
        guide: &G,
        run: &Run,
    ) -> Result<(), Cancelled> {
        let low = self.members.per_cell(run, |cell, place| {
            let config = self.config(cell);
            (0..3).fold(config, |config, axis| {
                let full = edges_round(2 * axis).iter().all(|&e| config.stands(e));
                if full {
                    config.with(2 * axis, pairing(complex, guide, place, axis))
                } else {
                    config
                }
            })
        })?;
        let low = self.without_holes(low, run)?;
        self.configs = self.members.per_cell(run, |cell, place| self.whole(&low, cell, place))?;
        Ok(())
    }

    /// A configuration of whose faces only the low ones are known, with the high ones, which are low
    /// ones of other cells.
    fn whole(&self, low: &[Config], cell: u32, place: Place) -> Config {
        (0..3).fold(low[cell as usize], |config, axis| match self.along(place, axis, 1) {
            Some(above) => config.with(2 * axis + 1, low[above as usize].pairing(2 * axis)),
            None => config,
        })
    }

    /// The cell `by` further along an axis.
    pub fn along(&self, place: Place, axis: usize, by: i32) -> Option<u32> {
        let mut local = coordinates(place.cell).map(|x| x as i32);
        local[axis] += by;
        self.members.beside(place.brick, local)
    }

    /// Takes back pairings that would open a hole. A face that pairs its edges is parted in two, which
    /// is made up for where a cell falls into more leaves: of faces that hang together all stay joined
    /// where there are more of them than leaves won.
    fn without_holes(&self, mut low: Vec<Config>, run: &Run) -> Result<Vec<Config>, Cancelled> {
        let parts = self.members.per_brick(run, |bricks| {
            let mut found = Vec::new();
            for brick in bricks {
                self.members.in_brick(brick, |cell, place| {
                    let whole = self.whole(&low, cell, place);
                    let faces: Vec<(usize, u32)> = (0..3)
                        .filter(|&axis| whole.pairing(2 * axis) != Pairing::Junction)
                        .filter_map(|axis| Some((axis, self.along(place, axis, -1)?)))
                        .collect();
                    if (0..6).any(|f| whole.pairing(f) != Pairing::Junction) {
                        let plain = self.config(cell).leaves(false).count();
                        found.push((cell, whole.leaves(false).count() - plain, faces));
                    }
                });
            }
            found
        })?;
        let paired = parts.concat();
        let number = |cell: u32| paired.binary_search_by_key(&cell, |p| p.0).ok();
        let mut sets = Sets::singles(paired.len());
        for (i, (_, _, faces)) in paired.iter().enumerate() {
            for below in faces.iter().filter_map(|&(_, below)| number(below)) {
                sets.join(i as u32, below as u32);
            }
        }
        let mut surplus = vec![0i64; paired.len()];
        for (i, (_, won, faces)) in paired.iter().enumerate() {
            surplus[sets.root(i as u32) as usize] += *won as i64 - faces.len() as i64;
        }
        for (i, (cell, _, faces)) in paired.iter().enumerate() {
            if surplus[sets.root(i as u32) as usize] < 0 {
                let config = &mut low[*cell as usize];
                for &(axis, _) in faces {
                    *config = config.with(2 * axis, Pairing::Junction);
                }
            }
        }
        Ok(low)
    }

    /// The configuration of a cell.
    pub fn config(&self, cell: u32) -> Config {
        self.configs[cell as usize]
    }

    /// The leaves of a cell, with the number of each.
    pub fn leaves(&self, cell: u32) -> impl Iterator<Item = (u32, Leaf)> {
        let config = self.config(cell);
        let first = self.leaves[cell as usize];
        let alone = self.is_alone(cell);
        let leaf = move |(n, edges): (usize, u16)| {
            (first + n as u32, Leaf { edges, rim: config.has_rim(edges), alone })
        };
        config.leaves(self.joined).enumerate().map(leaf)
    }

    /// Whether a cell has one leaf.
    pub fn is_alone(&self, cell: u32) -> bool {
        self.leaves[cell as usize + 1] - self.leaves[cell as usize] == 1
    }

    /// The number of the leaf with edge `e` of a cell.
    pub fn leaf_at(&self, cell: u32, e: usize) -> u32 {
        let first = self.leaves[cell as usize];
        if self.is_alone(cell) {
            return first;
        }
        let of = self.config(cell).leaves(self.joined).position(|l| l >> e & 1 == 1);
        first + of.unwrap_or_default() as u32
    }
}

/// How the low face of a cell along `axis` pairs its four edges: solid parts that touch across a
/// corner stay joined there, as in closed repair; else as the shape has it.
fn pairing<G: SheetGuide>(complex: &Complex<'_>, guide: &G, place: Place, axis: usize) -> Pairing {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let along_u = complex.step(place, u, 1);
    let along_v = complex.step(place, v, 1);
    let across = along_u.and_then(|p| complex.step(p, v, 1));
    let solid = [Some(place), along_u, across, along_v]
        .map(|p| p.is_none_or(|p| complex.vertex(p) == Vertex::Solid));
    match solid {
        [true, false, true, false] => Pairing::Odd,
        [false, true, false, true] => Pairing::Even,
        _ => guide.pairing(place, axis),
    }
}

/// Calls `visit` for each edge in a set.
pub fn each_edge(edges: u16, visit: impl FnMut(usize)) {
    (0..12).filter(|e| edges >> e & 1 == 1).for_each(visit);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_part_the_edges_of_every_configuration() {
        for edges in 1..1u32 << 12 {
            let config = Config(edges);
            let mut seen = 0;
            for leaf in config.leaves(false) {
                assert_eq!(seen & leaf, 0);
                seen |= leaf;
                let touched = (0..6).flat_map(|f| config.groups(f)).filter(|g| g & leaf != 0);
                assert!(touched.into_iter().all(|g| g & !leaf == 0));
            }
            assert_eq!(u32::from(seen), edges);
            assert_eq!(config.leaves(true).collect::<Vec<_>>(), [edges as u16]);
        }
    }

    #[test]
    fn a_pairing_is_the_same_from_both_sides_of_a_face() {
        for axis in 0..3 {
            let all = |f: usize| edges_round(f).iter().fold(0, |bits, e| bits | 1u32 << e);
            for pairing in [Pairing::Even, Pairing::Odd] {
                let low = Config(all(2 * axis)).with(2 * axis, pairing).groups(2 * axis);
                let high = Config(all(2 * axis + 1)).with(2 * axis + 1, pairing);
                let moved = |group: u16| {
                    let mut edges = 0;
                    each_edge(group, |e| {
                        edges |= 1 << edge_at(edge_corner(e) | 1 << axis, edge_axis(e))
                    });
                    edges
                };
                let mut seen = low.map(moved);
                let mut groups = high.groups(2 * axis + 1);
                seen.sort_unstable();
                groups.sort_unstable();
                assert_eq!(seen, groups);
            }
        }
    }
}
