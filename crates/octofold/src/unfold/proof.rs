//! The proof that nothing on a page lies on anything else, in whole numbers.
//!
//! All shapes of a page are taken apart into triangles. Two triangles are apart where a line along a
//! side of one has the other beyond it; rounding to steps may bring shapes that touch into each other,
//! so a few steps of depth are forgiven. Products of coordinates fit into 128 bits: no answer is
//! rounded.

use super::grid::Grid;
use super::pattern::{Pattern, STEP, Spot};
use super::plane::Bounds;
use glam::DVec2;

/// Depth in steps up to which shapes touch.
const TOUCH: i128 = 3;

/// Two things on a page that lie on one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Overlap {
    /// The page, counted from 0.
    pub page: u32,
    /// Where, in steps.
    pub at: Spot,
}

/// A triangle and the number of the thing that it is of.
struct Shard {
    corners: [Spot; 3],
    bounds: Bounds,
}

/// The first place where two faces, tabs or strips of a page lie on one another, a shape is turned
/// over, or something is off its page.
pub fn first_overlap(pattern: &Pattern) -> Option<Overlap> {
    (0..pattern.pages).find_map(|page| {
        let outlines = outlines(pattern, page);
        let size = pattern.page.map(super::pattern::steps);
        let off = outlines
            .iter()
            .flatten()
            .find(|p| (0..2).any(|axis| p[axis] < 0 || p[axis] > size[axis]));
        if let Some(&at) = off {
            return Some(Overlap { page, at });
        }
        let mut shards = Vec::new();
        for outline in &outlines {
            match shards_of(outline) {
                Some(own) => shards.extend(own),
                None => return Some(Overlap { page, at: outline[0] }),
            }
        }
        meeting(&shards).map(|at| Overlap { page, at })
    })
}

fn outlines(pattern: &Pattern, page: u32) -> Vec<Vec<Spot>> {
    let on_page = pattern.pieces.iter().filter(|piece| piece.page == page);
    let of_piece = |piece: &super::pattern::Piece| {
        let tiles = piece.tiles.iter().map(|t| t.corners.iter().map(|c| c.at).collect());
        let tabs = piece.tabs.iter().map(|tab| tab.outline.clone());
        tiles.chain(tabs).collect::<Vec<Vec<Spot>>>()
    };
    let strips = pattern.strips.iter().filter(|s| s.page == page).map(|s| s.outline.clone());
    on_page.flat_map(of_piece).chain(strips).collect()
}

/// The triangles of a simple polygon, counter-clockwise, by clipping ears; `None` where it is not
/// one.
fn shards_of(outline: &[Spot]) -> Option<Vec<Shard>> {
    let mut ring = outline.to_vec();
    let mut shards = Vec::with_capacity(ring.len());
    while ring.len() > 3 {
        let n = ring.len();
        let ear = (0..n).find(|&i| {
            let ear = [ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n]];
            let holds = |&p: &Spot| {
                (0..3).all(|k| orient(ear[k], ear[(k + 1) % 3], p) >= 0) && !ear.contains(&p)
            };
            orient(ear[0], ear[1], ear[2]) > 0 && !ring.iter().any(holds)
        });
        // Without a proper ear a corner on a straight side, or nearly so, may go.
        let flat = || {
            (0..n).find(|&i| {
                let [a, b, c] = [ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n]];
                depth_within(orient(a, b, c).abs(), a, c)
            })
        };
        let i = ear.or_else(flat)?;
        let corners = [ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n]];
        if orient(corners[0], corners[1], corners[2]) > 0 {
            shards.push(Shard::new(corners));
        }
        ring.remove(i);
    }
    let corners = [ring[0], ring[1], ring[2]];
    let area = orient(corners[0], corners[1], corners[2]);
    if area > 0 {
        shards.push(Shard::new(corners));
    }
    (area > 0 || !shards.is_empty()).then_some(shards)
}

impl Shard {
    fn new(corners: [Spot; 3]) -> Self {
        let points = corners.map(|[x, y]| DVec2::new(x as f64, y as f64) * STEP);
        Self { corners, bounds: Bounds::of(&points) }
    }
}

fn meeting(shards: &[Shard]) -> Option<Spot> {
    let sizes: f64 = shards.iter().map(|s| s.bounds.size().element_sum() / 2.0).sum();
    let mut grid = Grid::new(shards.len(), sizes / shards.len().max(1) as f64);
    for (number, shard) in shards.iter().enumerate() {
        let mut found = None;
        grid.near(&shard.bounds, |other| {
            let other = &shards[other as usize];
            if shard.bounds.meet(&other.bounds, 0.0) && meet(&shard.corners, &other.corners) {
                found = Some(shard.corners[0]);
            }
            found.is_some()
        });
        if found.is_some() {
            return found;
        }
        grid.insert(number as u32, &shard.bounds);
    }
    None
}

fn meet(a: &[Spot; 3], b: &[Spot; 3]) -> bool {
    let parted = |a: &[Spot; 3], b: &[Spot; 3]| {
        (0..3).any(|i| {
            let (p, q) = (a[i], a[(i + 1) % 3]);
            b.iter().all(|&r| {
                let over = orient(p, q, r);
                over <= 0 || depth_within(over, p, q)
            })
        })
    };
    !parted(a, b) && !parted(b, a)
}

/// True where a triangle of twice the area `area` over the side `p q` is at most [`TOUCH`] high.
fn depth_within(area: i128, p: Spot, q: Spot) -> bool {
    let [x, y] = [0, 1].map(|axis| i128::from(q[axis] - p[axis]));
    // Twice the area is height times side. What passes the first test can be squared.
    let longest = TOUCH * (x.abs() + y.abs());
    area <= longest && area * area <= TOUCH * TOUCH * (x * x + y * y)
}

/// Twice the area of a triangle, positive counter-clockwise.
fn orient(a: Spot, b: Spot, c: Spot) -> i128 {
    let [[px, py], [qx, qy]] =
        [b, c].map(|p| [0, 1].map(|axis| i128::from(p[axis]) - i128::from(a[axis])));
    px * qy - py * qx
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touching_is_apart_and_four_steps_are_not() {
        let a = [[0, 0], [1_000_000, 0], [0, 1_000_000]];
        let over = |depth: i64| [[0, depth], [0, -1_000_000], [1_000_000, depth]];
        assert!(!meet(&a, &over(0)));
        assert!(!meet(&a, &over(3)));
        assert!(meet(&a, &over(4)));
    }

    #[test]
    fn a_polygon_is_covered_by_its_triangles() {
        let comb = [[0, 0], [10, 0], [20, 0], [20, 9], [15, 2], [10, 9], [5, 2], [0, 9]];
        let comb = comb.map(|p: Spot| p.map(|x| x * 1000));
        let shards = shards_of(&comb).unwrap();
        let area: i128 =
            shards.iter().map(|s| orient(s.corners[0], s.corners[1], s.corners[2])).sum();
        let whole: i128 = (1..7).map(|i| orient(comb[0], comb[i], comb[i + 1])).sum();
        assert_eq!(area, whole);
        assert!(meeting(&shards).is_none());
        let mut back = comb;
        back.reverse();
        assert!(shards_of(&back).is_none());
    }
}
