//! The twelve edges of an octant, and the ring of octants round an edge.
//!
//! Edge `4 axis + b + 2 c` runs along `axis`, on the low (0) or high (1) side along the next axis and
//! the one after. Seen against the axis, the four places round an edge are numbered in a ring: both
//! sides low, next axis high, both high, the axis after high.

/// The axes across an edge along `axis`, in order.
pub(super) const fn across(axis: usize) -> [usize; 2] {
    [(axis + 1) % 3, (axis + 2) % 3]
}

/// What is fixed about an edge of an octant.
#[derive(Debug, Clone, Copy)]
pub(super) struct Local {
    /// The axis that the edge runs along.
    pub axis: usize,
    /// The sides of the octant on which it lies along the axes across.
    pub sides: [u32; 2],
    /// The ways across these sides, `2 axis + side`.
    pub ways: [usize; 2],
    /// Places in the ring: of the octant, of those across the first and the second side, and of the
    /// one across both.
    pub places: [usize; 4],
}

/// All twelve.
pub(super) const LOCAL: [Local; 12] = {
    let empty = Local { axis: 0, sides: [0; 2], ways: [0; 2], places: [0; 4] };
    let mut table = [empty; 12];
    let mut edge = 0;
    while edge < 12 {
        let axis = edge / 4;
        let [b, c] = across(axis);
        let (sb, sc) = (edge & 1, edge >> 1 & 1);
        // On its low side an edge has the octant on the high side.
        let (ob, oc) = (1 - sb, 1 - sc);
        table[edge] = Local {
            axis,
            sides: [sb as u32, sc as u32],
            ways: [2 * b + sb, 2 * c + sc],
            places: [place(ob, oc), place(sb, oc), place(ob, sc), place(sb, sc)],
        };
        edge += 1;
    }
    table
};

/// Place in the ring by the sides along both axes across.
const fn place(b: usize, c: usize) -> usize {
    match (b, c) {
        (0, 0) => 0,
        (1, 0) => 1,
        (1, 1) => 2,
        _ => 3,
    }
}

/// Edges of which each child of an octant has a half.
pub(super) const HALVES: [u16; 8] = {
    let mut halves = [0; 8];
    let mut edge = 0;
    while edge < 12 {
        let Local { axis, sides, .. } = LOCAL[edge];
        let [b, c] = across(axis);
        let low = (sides[0] << b | sides[1] << c) as usize;
        halves[low] |= 1 << edge;
        halves[low | 1 << axis] |= 1 << edge;
        edge += 1;
    }
    halves
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_have_four_places_and_agree_on_each_edge() {
        for (edge, local) in LOCAL.iter().enumerate() {
            let mut places = local.places;
            places.sort_unstable();
            assert_eq!(places, [0, 1, 2, 3]);
            // The octant across a side has the same edge on its other side, one place further.
            let across = LOCAL[edge ^ 1];
            assert_eq!(across.places[0], local.places[1]);
            assert_eq!(LOCAL[edge ^ 2].places[0], local.places[2]);
            assert_eq!(LOCAL[edge ^ 3].places[0], local.places[3]);
            // Places in order are beside each other.
            assert_eq!((local.places[0] + 4 - local.places[1]) % 2, 1);
            assert_eq!((local.places[0] + local.places[3]) % 2, 0);
        }
    }
}
