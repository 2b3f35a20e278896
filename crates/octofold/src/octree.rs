//! Linear octrees: sorted keys and columns, no pointers.
//!
//! The leaves of an octree are its [`CellKey`]s in pre-order beside a column of classes, as in
//! Nishio, Kobori and Kutsuwa 1997: black inside, white outside, gray where a finest cell meets
//! the surface. Leaves tile the root; each black or white leaf is as large as can be, so their
//! number grows with the surface.

mod build;
pub mod key;

pub use key::{CellKey, VertexName};

/// What a leaf holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Class {
    /// Wholly outside.
    White,
    /// A finest cell that the surface meets.
    Gray,
    /// Wholly inside.
    Black,
}

/// A linear octree.
#[derive(Debug, Clone, PartialEq)]
pub struct Octree {
    levels: u32,
    keys: Vec<CellKey>,
    classes: Vec<Class>,
}

impl Octree {
    /// Levels below the root: 2^levels finest cells along an axis.
    pub fn levels(&self) -> u32 {
        self.levels
    }

    /// The leaves, in pre-order.
    pub fn keys(&self) -> &[CellKey] {
        &self.keys
    }

    /// The class of each leaf.
    pub fn classes(&self) -> &[Class] {
        &self.classes
    }

    /// The leaf that holds a finest cell, and its class.
    ///
    /// # Panics
    /// Where the cell lies outside the root.
    pub fn leaf_at(&self, cell: [u32; 3]) -> (CellKey, Class) {
        assert!(cell.iter().all(|&c| c >> self.levels == 0), "{cell:?} lies outside the root");
        let at = self.keys.partition_point(|&k| k <= CellKey::new(cell, self.levels)) - 1;
        (self.keys[at], self.classes[at])
    }

    /// The leaves below an octant, as a range of indices; empty where it lies inside a leaf.
    pub fn subtree(&self, octant: CellKey) -> std::ops::Range<usize> {
        let start = self.keys.partition_point(|&k| k < octant);
        let cells = 1 << (3 * (self.levels - octant.level()));
        let end = self.keys.partition_point(|&k| k.morton() < octant.morton() + cells);
        start..end.max(start)
    }

    /// Leaves of each class on each level: `[level][white, gray, black]`.
    pub fn census(&self) -> Vec<[u64; 3]> {
        let mut counts = vec![[0; 3]; self.levels as usize + 1];
        for (key, class) in self.keys.iter().zip(&self.classes) {
            counts[key.level() as usize][*class as usize] += 1;
        }
        counts
    }
}
