//! Integer names of cells and of the vertices that methods make on them.
//!
//! Names are equal on every thread and in every block: order is a sort, joining is a merge by
//! name and never by distance.

/// Levels below the root that a key can tell apart: 2^19 cells along an axis.
pub const MAX_LEVEL: u32 = 19;

const LEVEL_BITS: u32 = 5;

/// Interleaves the low 21 bits of x, y, z; x in the lowest place.
pub const fn morton([x, y, z]: [u32; 3]) -> u64 {
    spread(x) | spread(y) << 1 | spread(z) << 2
}

/// The x, y, z whose [`morton`] code is `code`.
pub const fn unmorton(code: u64) -> [u32; 3] {
    [gather(code), gather(code >> 1), gather(code >> 2)]
}

const fn spread(v: u32) -> u64 {
    let mut v = v as u64 & 0x1f_ffff;
    v = (v | v << 32) & 0x001f_0000_0000_ffff;
    v = (v | v << 16) & 0x001f_0000_ff00_00ff;
    v = (v | v << 8) & 0x100f_00f0_0f00_f00f;
    v = (v | v << 4) & 0x10c3_0c30_c30c_30c3;
    (v | v << 2) & 0x1249_2492_4924_9249
}

const fn gather(code: u64) -> u32 {
    let mut v = code & 0x1249_2492_4924_9249;
    v = (v | v >> 2) & 0x10c3_0c30_c30c_30c3;
    v = (v | v >> 4) & 0x100f_00f0_0f00_f00f;
    v = (v | v >> 8) & 0x001f_0000_ff00_00ff;
    v = (v | v >> 16) & 0x001f_0000_0000_ffff;
    ((v | v >> 32) & 0x1f_ffff) as u32
}

/// Name of an octant: the Morton code of its low corner in finest cells in the high bits, its
/// level (0 for the root) in the low five.
///
/// Sorted order is pre-order: a cell comes before its descendants, and a subtree is one slice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CellKey(u64);

impl CellKey {
    /// The root octant.
    pub const ROOT: Self = Self(0);

    /// The octant of `level` whose low corner is `corner`, in finest cells.
    pub const fn new(corner: [u32; 3], level: u32) -> Self {
        Self(morton(corner) << LEVEL_BITS | level as u64)
    }

    /// The octant of `level` with Morton code `code` of its low corner.
    pub const fn from_morton(code: u64, level: u32) -> Self {
        Self(code << LEVEL_BITS | level as u64)
    }

    /// Level below the root.
    pub const fn level(self) -> u32 {
        (self.0 & ((1 << LEVEL_BITS) - 1)) as u32
    }

    /// Morton code of the low corner.
    pub const fn morton(self) -> u64 {
        self.0 >> LEVEL_BITS
    }

    /// Low corner in finest cells.
    pub const fn corner(self) -> [u32; 3] {
        unmorton(self.morton())
    }

    /// Edge length in finest cells, in a tree with `levels` levels below the root.
    pub const fn size(self, levels: u32) -> u32 {
        1 << (levels - self.level())
    }

    /// Child `octant` (x in bit 0, y in bit 1, z in bit 2), in a tree with `levels` levels.
    pub const fn child(self, octant: u32, levels: u32) -> Self {
        let level = self.level() + 1;
        let code = self.morton() | (octant as u64) << (3 * (levels - level));
        Self::from_morton(code, level)
    }

    /// The octant one level up; `None` for the root.
    pub const fn parent(self, levels: u32) -> Option<Self> {
        let level = self.level();
        if level == 0 {
            return None;
        }
        let shift = 3 * (levels - level + 1);
        Some(Self::from_morton(self.morton() >> shift << shift, level - 1))
    }

    /// True where `other` is this octant or lies in it, in a tree with `levels` levels.
    pub const fn contains(self, other: Self, levels: u32) -> bool {
        let shift = 3 * (levels - self.level());
        other.level() >= self.level() && other.morton() >> shift == self.morton() >> shift
    }
}

/// Name of a vertex that a method makes on a lattice edge or inside a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VertexName(u64);

impl VertexName {
    /// The last lattice index along an axis that has a name.
    pub const LAST: u32 = (1 << 20) - 2;

    /// The vertex on the lattice edge that leaves `low` along `axis`; no index is above
    /// [`Self::LAST`]` + 1`.
    pub const fn on_edge(low: [u32; 3], axis: usize) -> Self {
        Self(morton(low) << 2 | axis as u64)
    }

    /// The vertex inside the cell with low corner `low`.
    pub const fn in_cell(low: [u32; 3]) -> Self {
        Self(morton(low) << 2 | 3)
    }

    /// Low end of the edge, or low corner of the cell.
    pub const fn low(self) -> [u32; 3] {
        unmorton(self.0 >> 2)
    }

    /// The edge's axis; `None` for a vertex inside a cell.
    pub const fn axis(self) -> Option<usize> {
        match self.0 & 3 {
            3 => None,
            axis => Some(axis as usize),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn bits_land_one_by_one() {
        for bit in 0..21 {
            for axis in 0..3 {
                let mut corner = [0; 3];
                corner[axis] = 1 << bit;
                assert_eq!(morton(corner), 1 << (3 * bit + axis));
            }
        }
    }

    proptest! {
        #[test]
        fn names_round_trip(corner in prop::array::uniform3(0u32..1 << 19), axis in 0usize..3) {
            prop_assert_eq!(unmorton(morton(corner)), corner);
            let name = VertexName::on_edge(corner, axis);
            prop_assert_eq!((name.low(), name.axis()), (corner, Some(axis)));
            let name = VertexName::in_cell(corner);
            prop_assert_eq!((name.low(), name.axis()), (corner, None));
        }

        #[test]
        fn sorted_order_is_pre_order(
            corner in prop::array::uniform3(0u32..1 << 19),
            level in 1u32..19,
            octant in 0u32..8,
        ) {
            let mask = !((1 << (MAX_LEVEL - level)) - 1);
            let cell = CellKey::new(corner.map(|c| c & mask), level);
            let child = cell.child(octant, MAX_LEVEL);
            prop_assert!(cell < child);
            prop_assert_eq!(child.parent(MAX_LEVEL), Some(cell));
            prop_assert!(cell.contains(child, MAX_LEVEL) && !child.contains(cell, MAX_LEVEL));
            if octant < 7 {
                prop_assert!(child < cell.child(octant + 1, MAX_LEVEL));
            }
            prop_assert_eq!(cell.size(MAX_LEVEL), 2 * child.size(MAX_LEVEL));
        }
    }
}
