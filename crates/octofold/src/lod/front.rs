//! A cut that follows an eye, and its patches, by what changes.
//!
//! The distance of an octant from the eye changes by no more than the eye travels: so an octant need not
//! be asked again before the eye has gone as far as its choice was from turning. Octants of the cut and
//! those above wait in a queue, by the length of the way at which they may turn. When some did, patches
//! are made anew only on the edges of octants that touch those. The result is that of a cut that is
//! chosen from the root down, and of all its patches, byte for byte.
//! Source: specification of LOD, D.2 "Incremental front".

use super::cut::{Cut, Eye, NONE, Octant, View};
use super::patches::{Around, Mode, Patch, Rings, neighbours_of};
use super::tree::Lod;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Where an octant is to a cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Below,
    Front,
    Above,
}

/// A cut that follows an eye. Places are nodes of the model.
pub struct Front<'a> {
    lod: &'a Lod,
    mode: Mode,
    eye: Eye,
    grid: Grid,
    view: View,
    travelled: f64,
    /// The length of the way at which each octant must be asked again.
    due: Vec<f64>,
    queue: BinaryHeap<Reverse<(u64, u32)>>,
    patches: Vec<Held>,
    /// The first patch of each octant, and patches that are free.
    firsts: Vec<u32>,
    free: Vec<u32>,
    /// The frame in which each octant's patches were last made.
    made: Vec<u32>,
    frame: u32,
}

/// What is round each octant, and which of them are in the cut.
struct Grid {
    levels: u32,
    starts: Vec<u32>,
    beside: Vec<[u32; 6]>,
    parents: Vec<u32>,
    corners: Vec<[u16; 3]>,
    firsts: Vec<(u32, u8)>,
    states: Vec<State>,
}

/// A patch among those of its owner.
#[derive(Debug, Clone, Copy)]
struct Held {
    patch: Patch,
    next: u32,
}

/// What a step of the eye changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Change {
    /// Octants that were asked.
    pub asked: u64,
    /// Octants that gave way to their children.
    pub divided: u64,
    /// Octants that took the place of those below.
    pub united: u64,
    /// Octants whose patches were made anew.
    pub remade: u64,
}

impl<'a> Front<'a> {
    /// The cut and the patches for an eye, as far as it is let.
    pub fn new(lod: &'a Lod, eye: Eye, mode: Mode) -> Self {
        // With every octant above it, a cut's places are the model's nodes.
        let all = Cut::by(lod, |_| false);
        let mut beside = Vec::new();
        neighbours_of(&all, &mut beside);
        let count = lod.nodes().len();
        let grid = Grid {
            levels: lod.levels(),
            starts: all.starts.clone(),
            beside,
            parents: all.entries.iter().map(|e| e.parent).collect(),
            corners: all.entries.iter().map(|e| e.corner).collect(),
            firsts: lod.nodes().iter().map(|n| (n.first_child(), n.children())).collect(),
            states: vec![State::Below; count],
        };
        let mut front = Self {
            lod,
            mode,
            eye,
            grid,
            view: View::new(lod, &eye),
            travelled: 0.0,
            due: vec![f64::INFINITY; count],
            queue: BinaryHeap::new(),
            patches: Vec::new(),
            firsts: vec![NONE; count],
            free: Vec::new(),
            made: vec![0; count],
            frame: 0,
        };
        front.grid.states[0] = State::Front;
        front.ask(0);
        front.moved(&[0]);
        front
    }

    /// Moves the eye.
    pub fn step(&mut self, position: [f64; 3]) -> Change {
        let before = self.view.eye;
        self.eye.position = position;
        self.view = View::new(self.lod, &self.eye);
        self.travelled += (self.view.eye - before).length();
        let mut change = Change::default();
        let mut touched = Vec::new();
        while let Some(&Reverse((bits, node))) = self.queue.peek()
            && f64::from_bits(bits) <= self.travelled
        {
            self.queue.pop();
            // What was asked since waits elsewhere in the queue.
            if self.due[node as usize].to_bits() != bits {
                continue;
            }
            change.asked += 1;
            let state = self.grid.states[node as usize];
            self.ask(node);
            match (state, self.grid.states[node as usize]) {
                (State::Front, State::Above) => change.divided += 1,
                (State::Above, State::Front) => change.united += 1,
                _ => continue,
            }
            touched.push(node);
        }
        change.remade = self.moved(&touched);
        change
    }

    /// The patches in the order of their owners' nodes and edges.
    pub fn patches(&self) -> Vec<Patch> {
        let mut all = Vec::with_capacity(self.patches.len());
        for &first in &self.firsts {
            let start = all.len();
            let mut next = first;
            while let Some(held) = self.patches.get(next as usize) {
                all.push(held.patch);
                next = held.next;
            }
            all[start..].sort_unstable_by_key(|patch| patch.edge);
        }
        all
    }

    /// The octants that the cut is made of, by their nodes.
    pub fn nodes(&self) -> impl Iterator<Item = u32> {
        let states = self.grid.states.iter().zip(0..);
        states.filter(|(state, _)| **state == State::Front).map(|(_, node)| node)
    }

    /// Chooses again for an octant in or above the cut, and for those below where it gives way.
    fn ask(&mut self, node: u32) {
        let octant = self.grid.octant(node);
        let (first, mask) = self.grid.firsts[node as usize];
        let children = first..first + mask.count_ones();
        let error = self.lod.error(node);
        let state = self.grid.states[node as usize];
        if mask == 0 {
            self.due[node as usize] = f64::INFINITY;
            return;
        }
        if self.view.takes(error, &octant) {
            if state == State::Above {
                children.for_each(|child| self.leave(child));
                self.grid.states[node as usize] = State::Front;
            }
        } else if state == State::Front {
            self.grid.states[node as usize] = State::Above;
            for child in children {
                self.grid.states[child as usize] = State::Front;
                self.ask(child);
            }
        }
        let wait = self.view.wait(error, &octant);
        // Rounding must not let it come late.
        let due = (self.travelled + wait) * (1.0 - 1e-12) - 1e-9;
        let due = due.max(self.travelled + f64::MIN_POSITIVE);
        self.due[node as usize] = due;
        if due.is_finite() {
            self.queue.push(Reverse((due.to_bits(), node)));
        }
    }

    /// Takes an octant and all below it out of the cut.
    fn leave(&mut self, node: u32) {
        let state = std::mem::replace(&mut self.grid.states[node as usize], State::Below);
        self.due[node as usize] = f64::INFINITY;
        match state {
            State::Below => {}
            State::Front => self.drop_patches(node),
            State::Above => {
                let (first, mask) = self.grid.firsts[node as usize];
                (first..first + mask.count_ones()).for_each(|child| self.leave(child));
            }
        }
    }

    fn drop_patches(&mut self, node: u32) {
        let mut next = std::mem::replace(&mut self.firsts[node as usize], NONE);
        while next != NONE {
            self.free.push(next);
            next = self.patches[next as usize].next;
        }
    }

    /// Makes the patches anew of all octants of the cut that touch one of `touched`.
    fn moved(&mut self, touched: &[u32]) -> u64 {
        self.frame += 1;
        let mut again = Vec::new();
        for &node in touched {
            // It may have gone since.
            let mut node = node;
            while self.grid.states[node as usize] == State::Below {
                node = self.grid.parents[node as usize];
            }
            if self.grid.states[node as usize] == State::Above {
                self.drop_patches(node);
            }
            let own = self.grid.octant(node);
            self.grid.touching(&own, &mut |found| {
                if self.made[found as usize] != self.frame {
                    self.made[found as usize] = self.frame;
                    again.push(found);
                }
            });
        }
        for &node in &again {
            self.drop_patches(node);
            let level = self.grid.level_start(node);
            let rings = Rings { lod: self.lod, around: &self.grid, mode: self.mode };
            let (patches, free) = (&mut self.patches, &mut self.free);
            let first = &mut self.firsts[node as usize];
            rings.of_octant(node, level, |patch| {
                let held = Held { patch, next: *first };
                match free.pop() {
                    Some(place) => {
                        patches[place as usize] = held;
                        *first = place;
                    }
                    None => {
                        *first = patches.len() as u32;
                        patches.push(held);
                    }
                }
            });
        }
        again.len() as u64
    }
}

impl Grid {
    fn level_start(&self, node: u32) -> u32 {
        self.starts[self.starts.partition_point(|&start| start <= node) - 1]
    }

    /// Visits the octants of the cut that share a piece of a crossed edge with `own`, some of them
    /// several times.
    fn touching(&self, own: &Octant, visit: &mut impl FnMut(u32)) {
        let beside = self.beside[own.node as usize];
        let level = self.starts[own.level as usize];
        self.meeting(own.node, own, visit);
        for first in 0..6 {
            let across = beside[first];
            if across == NONE {
                continue;
            }
            self.meeting(across, own, visit);
            for second in (first | 1) + 1..6 {
                let other = beside[second];
                // A crossed edge has octants all round.
                if other == NONE {
                    continue;
                }
                let found = if across >= level {
                    self.beside[across as usize][second]
                } else if other >= level {
                    self.beside[other as usize][first]
                } else {
                    self.found(own, [first, second])
                };
                if found != NONE {
                    self.meeting(found, own, visit);
                }
            }
        }
    }

    /// The octant across two sides of `own`, looked for from the root: of the same size or larger.
    #[cold]
    fn found(&self, own: &Octant, ways: [usize; 2]) -> u32 {
        let side = 1i64 << self.levels;
        let mut at = own.corner.map(i64::from);
        for way in ways {
            at[way / 2] += if way % 2 == 1 { i64::from(own.size) } else { -i64::from(own.size) };
        }
        if at.iter().any(|&c| c < 0 || c >= side) {
            return NONE;
        }
        let at = at.map(|c| c as u32);
        let (mut node, mut size) = (0, 1u32 << self.levels);
        while size > own.size && self.firsts[node as usize].1 != 0 {
            size /= 2;
            let octant = (0..3).fold(0, |o, a| o | u32::from(at[a] & size != 0) << a);
            node = self.child(node, octant);
            if node == NONE {
                return NONE;
            }
        }
        node
    }

    /// Visits the octants of the cut in `node`, or the one that it lies in, that touch `own`.
    fn meeting(&self, node: u32, own: &Octant, visit: &mut impl FnMut(u32)) {
        let mut node = node;
        while self.states[node as usize] == State::Below {
            node = self.parents[node as usize];
        }
        if self.states[node as usize] == State::Front {
            return visit(node);
        }
        self.descend(node, self.octant(node).size, own, visit);
    }

    fn descend(&self, node: u32, size: u32, own: &Octant, visit: &mut impl FnMut(u32)) {
        let corner = self.corners[node as usize].map(u32::from);
        let apart = (0..3)
            .any(|a| corner[a] > own.corner[a] + own.size || corner[a] + size < own.corner[a]);
        if apart {
            return;
        }
        if self.states[node as usize] == State::Front {
            return visit(node);
        }
        let (first, mask) = self.firsts[node as usize];
        let children = first..first + mask.count_ones();
        children.for_each(|child| self.descend(child, size / 2, own, visit));
    }
}

impl Around for &Grid {
    fn beside(&self, place: u32, way: usize) -> u32 {
        let mut found = self.beside[place as usize][way];
        while found != NONE && self.states[found as usize] == State::Below {
            found = self.parents[found as usize];
        }
        found
    }

    fn is_front(&self, place: u32) -> bool {
        self.states[place as usize] == State::Front
    }

    fn octant(&self, place: u32) -> Octant {
        Grid::octant(self, place)
    }

    fn child(&self, place: u32, octant: u32) -> u32 {
        Grid::child(self, place, octant)
    }

    fn node(&self, place: u32) -> u32 {
        place
    }
}

impl Grid {
    fn octant(&self, node: u32) -> Octant {
        let level = self.starts.partition_point(|&start| start <= node) as u32 - 1;
        let corner = self.corners[node as usize].map(u32::from);
        Octant { node, level, corner, size: 1 << (self.levels - level) }
    }

    fn child(&self, node: u32, octant: u32) -> u32 {
        let (first, mask) = self.firsts[node as usize];
        let before = (u32::from(mask) & ((1 << octant) - 1)).count_ones();
        if mask >> octant & 1 == 0 { NONE } else { first + before }
    }
}
