//! How far boundary cells are dilated, so that gaps are closed alike in every direction.
//!
//! A round adds the neighbours across faces, edges or corners of a cell. Rounds of the last kind alone
//! reach 1.7 times as far along the diagonals of the grid as along its axes; as many of each kind as
//! just hold a ball stay within 1.13 times its radius and one and a half cells. The order of rounds does
//! not matter.

/// How far points in two cells are nearer along an axis than the cells are apart, as is taken for granted.
///
/// At most it is a whole cell, but all cells of a curve take part, and with a whole cell gaps are closed
/// that are too wide by more than two cells to either side; with a half none opens yet.
const SLACK: f64 = 0.75;

/// Which neighbours of a cell a round adds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Neighbours {
    /// The 6 across faces.
    Faces,
    /// The 18 across faces and edges.
    Edges,
    /// All 26.
    Corners,
}

/// Rounds of dilation that reach all cells with a point within a radius of a point of the first cell,
/// but for [`SLACK`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// The radius, in cells.
    pub radius: f64,
    faces: u32,
    edges: u32,
    corners: u32,
}

impl Reach {
    /// The fewest rounds for a radius.
    ///
    /// Of the cells `v` away whose points are within the radius, each coordinate of `v` taken less
    /// [`SLACK`], the rounds must reach the largest coordinate, the largest sum of two, and the largest of
    /// all three.
    pub fn new(radius: f64) -> Self {
        let along = |rest: f64| ((rest.sqrt() + SLACK).ceil() as u32).saturating_sub(1).max(1);
        let rest = |v: u32, of: f64| of - (f64::from(v) - SLACK).powi(2);
        let square = radius * radius;
        let most = if radius > 0.0 { along(square) } else { 0 };
        let (mut two, mut three) = (most, most);
        for x in 1..=most {
            let left = rest(x, square).max(0.0);
            two = two.max(x + along(left));
            for y in (1..=x).take_while(|&y| y == 1 || rest(y, left) > 0.0) {
                three = three.max(x + y + along(rest(y, left).max(0.0)));
            }
        }
        let corners = three.saturating_sub(two);
        let diagonal = (two - most).max(corners);
        Self { radius, faces: most - diagonal, edges: diagonal - corners, corners }
    }

    /// How many rounds there are.
    pub fn rounds(&self) -> u32 {
        self.faces + self.edges + self.corners
    }

    /// What the rounds add.
    pub fn kinds(&self) -> impl Iterator<Item = Neighbours> {
        let times = |kind, count| std::iter::repeat_n(kind, count as usize);
        times(Neighbours::Corners, self.corners)
            .chain(times(Neighbours::Edges, self.edges))
            .chain(times(Neighbours::Faces, self.faces))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn cells_within(reach: Reach) -> BTreeSet<[i32; 3]> {
        let mut cells = BTreeSet::from([[0; 3]]);
        for kind in reach.kinds() {
            let most = match kind {
                Neighbours::Faces => 1,
                Neighbours::Edges => 2,
                Neighbours::Corners => 3,
            };
            let steps = (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]);
            let steps: Vec<[i32; 3]> =
                steps.filter(|s| s.map(i32::abs).iter().sum::<i32>() <= most).collect();
            let beside = |c: &[i32; 3]| {
                let c = *c;
                steps.iter().map(move |s| std::array::from_fn(|a| c[a] + s[a])).collect::<Vec<_>>()
            };
            cells = cells.iter().flat_map(beside).collect();
        }
        cells
    }

    #[test]
    fn rounds_hold_a_ball_and_little_more() {
        assert_eq!(Reach::new(0.0).rounds(), 0);
        for half in 1..=16 {
            let radius = f64::from(half) / 2.0;
            let reach = Reach::new(radius);
            let cells = cells_within(reach);
            let most = reach.rounds() as i32 + 1;
            for x in -most..=most {
                for y in -most..=most {
                    for z in -most..=most {
                        let least =
                            [x, y, z].map(|v| (f64::from(v.abs()) - SLACK).max(0.0).powi(2));
                        if least.iter().sum::<f64>() < radius * radius {
                            assert!(cells.contains(&[x, y, z]), "{radius}: {x} {y} {z}");
                        }
                    }
                }
            }
            let far = |c: &[i32; 3]| f64::from(c.map(|x| x * x).iter().sum::<i32>()).sqrt();
            let furthest = cells.iter().map(far).fold(0.0, f64::max);
            assert!(furthest <= 1.13 * radius + 1.5, "{radius}: {furthest}");
        }
    }
}
