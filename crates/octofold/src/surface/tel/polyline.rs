//! Polylines: a loop's chain becomes a polygon, face by face (section 3.2).
//!
//! Each piece of a chain is cut at its farthest voxel until no voxel lies further than one voxel
//! from the line (Douglas and Peucker 1973). Distances are to the segment, not to the line (G13);
//! a loop that lies on one face is cut at its two extremes first (G14); directions and ties are
//! settled by coordinates, so that both octants beside a face find the same polyline (G15). All in
//! integers.

use super::Voxel;
use super::trace::Piece;

/// A point of a polygon.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Point {
    /// The gray voxel whose centre it is.
    pub voxel: Voxel,
    /// The face on which the polygon runs on from it.
    pub face: u8,
}

/// The loop with all of its voxels.
pub fn whole(pieces: &[Piece]) -> Vec<Point> {
    polygon(pieces, |voxels| vec![true; voxels.len()])
}

/// The loop simplified to within one voxel.
pub fn simplified(pieces: &[Piece]) -> Vec<Point> {
    polygon(pieces, kept)
}

fn polygon(pieces: &[Piece], keep: impl Fn(&[Voxel]) -> Vec<bool>) -> Vec<Point> {
    let mut ring: Vec<Point> = Vec::new();
    let mut add = |face: u8, voxels: &[Voxel]| {
        let keep = keep(voxels);
        // The last voxel is the first of what follows.
        for (&voxel, _) in voxels.iter().zip(&keep).rev().skip(1).rev().filter(|(_, k)| **k) {
            match ring.last_mut() {
                Some(last) if last.voxel == voxel => last.face = face,
                _ => ring.push(Point { voxel, face }),
            }
        }
    };
    match pieces {
        [piece] => {
            let [there, back] = at_extremes(&piece.voxels);
            add(piece.face, &there);
            add(piece.face, &back);
        }
        _ => pieces.iter().for_each(|piece| add(piece.face, &piece.voxels)),
    }
    if ring.len() > 1 && ring.first().map(|p| p.voxel) == ring.last().map(|p| p.voxel) {
        ring.pop();
    }
    ring
}

/// A closed chain as the two ways between its extremes.
fn at_extremes(voxels: &[Voxel]) -> [Vec<Voxel>; 2] {
    let mut round = voxels.to_vec();
    if round.len() > 1 {
        round.pop();
    }
    let least = (0..round.len()).min_by_key(|&i| round[i]).unwrap_or(0);
    round.rotate_left(least);
    let most = (0..round.len()).max_by_key(|&i| round[i]).unwrap_or(0);
    let first = round[0];
    let back = round[most..].iter().copied().chain([first]).collect();
    round.truncate(most + 1);
    [round, back]
}

/// Which voxels of an open chain its polyline keeps.
fn kept(voxels: &[Voxel]) -> Vec<bool> {
    let mut keep = vec![false; voxels.len()];
    let (Some(&first), Some(&last)) = (voxels.first(), voxels.last()) else { return keep };
    // Of equal voxels the one nearer to the smaller end counts as the first.
    let backward = last < first;
    let rank = |i: usize| if backward { voxels.len() - i } else { i };
    keep[0] = true;
    keep[voxels.len() - 1] = true;
    let mut open = vec![(0, voxels.len() - 1)];
    while let Some((a, b)) = open.pop() {
        let apart = |i: usize| apart(voxels[i], voxels[a], voxels[b]);
        let order = |&i: &usize, &j: &usize| {
            let near = (apart(i).0.cmp(&apart(j).0)).then(voxels[j].cmp(&voxels[i]));
            near.then(rank(j).cmp(&rank(i)))
        };
        if let Some(farthest) = (a + 1..b).max_by(order) {
            let (distance, unit) = apart(farthest);
            if distance > unit {
                keep[farthest] = true;
                open.extend([(a, farthest), (farthest, b)]);
            }
        }
    }
    keep
}

/// The squared distance of `p` from the segment, as a fraction whose second part is the same for
/// all points.
fn apart(p: Voxel, from: Voxel, to: Voxel) -> (i128, i128) {
    let along = difference(to, from);
    let length = dot(along, along);
    if length == 0 {
        let r = difference(p, from);
        return (dot(r, r), 1);
    }
    let r = difference(p, from);
    let share = dot(r, along);
    if share <= 0 {
        (dot(r, r) * length, length)
    } else if share >= length {
        let r = difference(p, to);
        (dot(r, r) * length, length)
    } else {
        (dot(r, r) * length - share * share, length)
    }
}

fn difference(a: Voxel, b: Voxel) -> [i128; 3] {
    std::array::from_fn(|x| i128::from(a[x]) - i128::from(b[x]))
}

fn dot(a: [i128; 3], b: [i128; 3]) -> i128 {
    (0..3).map(|x| a[x] * b[x]).sum()
}

/// Whether two sides of a polygon that lie on the same face meet, other than neighbours at their
/// common point (G16).
pub fn meets_itself(ring: &[Point]) -> bool {
    let points = ring.len();
    let flat = |p: Point, face: u8| {
        let axis = usize::from(face / 2);
        [1, 2].map(|x| i64::from(p.voxel[(axis + x) % 3]))
    };
    (0..points).any(|i| {
        let face = ring[i].face;
        let side = |k: usize| [flat(ring[k], face), flat(ring[(k + 1) % points], face)];
        let others = (i + 2..points).filter(|&j| j + 1 < points + i && ring[j].face == face);
        others.into_iter().any(|j| meet(side(i), side(j)))
    })
}

/// Whether two closed segments in the plane have a point in common.
fn meet([a, b]: [[i64; 2]; 2], [c, d]: [[i64; 2]; 2]) -> bool {
    let turn = |p: [i64; 2], q: [i64; 2], r: [i64; 2]| {
        ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])).signum()
    };
    let boxes =
        (0..2).all(|x| a[x].min(b[x]) <= c[x].max(d[x]) && c[x].min(d[x]) <= a[x].max(b[x]));
    boxes && turn(a, b, c) * turn(a, b, d) <= 0 && turn(c, d, a) * turn(c, d, b) <= 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(crate::sweep::cases(128))]

        #[test]
        fn both_directions_keep_the_same_voxels(turns in prop::collection::vec(0u8..4, 0..60)) {
            let mut at = [100u32, 100, 7];
            let mut chain = vec![at];
            for turn in turns {
                let axis = usize::from(turn / 2);
                at[axis] = if turn % 2 == 0 { at[axis] + 1 } else { at[axis] - 1 };
                chain.push(at);
            }
            let keep = kept(&chain);
            chain.reverse();
            let mut back = kept(&chain);
            back.reverse();
            // A chain that ends where it began has no smaller end.
            if chain.first() != chain.last() {
                prop_assert_eq!(&keep, &back);
            }
            chain.reverse();
            let corners: Vec<usize> = (0..chain.len()).filter(|&i| keep[i]).collect();
            for pair in corners.windows(2) {
                for i in pair[0]..=pair[1] {
                    let (distance, unit) = apart(chain[i], chain[pair[0]], chain[pair[1]]);
                    prop_assert!(distance <= unit);
                }
            }
        }
    }

    #[test]
    fn segments_meet_where_they_touch() {
        assert!(meet([[0, 0], [4, 4]], [[0, 4], [4, 0]]));
        assert!(meet([[0, 0], [4, 0]], [[2, 0], [2, 3]]));
        assert!(meet([[0, 0], [4, 0]], [[3, 0], [9, 0]]));
        assert!(!meet([[0, 0], [4, 0]], [[5, 0], [9, 0]]));
        assert!(!meet([[0, 0], [4, 0]], [[0, 1], [4, 1]]));
    }
}
