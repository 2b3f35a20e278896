//! Tabs to glue pieces by: trapezes outside the sides that they are on. A tab lies on no facet and no
//! other tab of its piece, and once folded over inside the facet that it is glued under.
//!
//! Each joint takes the largest tab that is free, the most hampered joints first; a joint left
//! without pushes others to their next best. What still has none gets a strip: a loose hinge with
//! a fold along its middle, glued under both facets.

use super::facets::{Facets, gathered};
use super::grid::Grid;
use super::patch::Outline;
use super::plane::{Bounds, Motion, convex_meet, doubled_area};
use super::seams::{FacetSide, Joint};
use crate::run::{Cancelled, Run};
use glam::DVec2;

/// Where facets lie: the piece of each, and its place in that.
#[derive(Debug, Clone)]
pub(super) struct Placed {
    /// Piece of each facet.
    pub piece: Vec<u32>,
    /// Place of each facet in its piece.
    pub place: Vec<Motion>,
    /// Facets of each piece.
    pub pieces: Vec<Vec<u32>>,
}

/// How tabs are cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TabSize {
    /// Height of a usual tab.
    pub height: f64,
    /// A tab must be this high somewhere.
    pub least: f64,
}

/// A tab in the plane of its piece.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tab {
    /// The joint that it holds.
    pub joint: u32,
    /// The side that it is on, and the side that it is glued to.
    pub way: [FacetSide; 2],
    /// Its outline, from the end of its side to the beginning, then the corners outside.
    pub shape: Vec<DVec2>,
    bounds: Bounds,
    value: f64,
}

/// A loose hinge: its outline, and the fold between its first corner and the one halfway round.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Strip {
    /// The joint that it holds.
    pub joint: u32,
    /// Its outline, counter-clockwise.
    pub shape: Vec<DVec2>,
    /// The ends of its fold.
    pub fold: [DVec2; 2],
}

/// Slopes at the ends of a tab, as cotangents: 60, 45, 30, 20, 12, 7 and 4 degrees.
const SLOPES: [f64; 7] = [0.577, 1.0, 1.732, 2.747, 4.705, 8.144, 14.3];

/// The angle in radians down to which a tab is fitted into a corner.
const LEAST_ANGLE: f64 = 0.02;

/// Heights that are tried, as parts of the usual one.
const HEIGHTS: [f64; 6] = [1.0, 0.8, 0.6, 0.45, 0.3, 0.2];

/// Distance in millimetres up to which two corners are one.
const SAME: f64 = 1e-6;

/// Depth in millimetres up to which a tab only touches.
const TOUCH: f64 = 1e-9;

/// Tabs for all joints that can have one, and strips for the others.
pub(super) fn tabs(
    mesh: &Facets,
    placed: &Placed,
    joints: &[Joint],
    size: TabSize,
    run: &Run,
) -> Result<(Vec<Tab>, Vec<Strip>), Cancelled> {
    let paper = Paper::new(mesh, placed);
    let hampered = crate::par::blocks(run, joints.len(), 64, |range| {
        let value = |j: usize| {
            let tabs = joints[j].ways.iter().filter_map(|&way| paper.best(j, way, size, 0, &[]));
            tabs.map(|tab| tab.value).fold(0.0, f64::max)
        };
        range.map(value).collect::<Vec<f64>>()
    })?;
    let hampered: Vec<f64> = hampered.concat();
    let mut order: Vec<usize> = (0..joints.len()).filter(|&j| hampered[j] > 0.0).collect();
    order.sort_by(|&a, &b| hampered[a].total_cmp(&hampered[b]).then(a.cmp(&b)));
    let mut board = Board::new(&paper, joints, size);
    let mut left: Vec<usize> = order.into_iter().filter(|&j| !board.set(j)).collect();
    // What was pushed to a smaller tab may make room for another.
    for _ in 0..3 {
        run.check()?;
        left.retain(|&j| !board.set(j) && !board.push(j));
    }
    let mut tabs: Vec<Tab> = board.tabs.into_iter().flatten().collect();
    tabs.sort_by_key(|tab| tab.joint);
    let mut has = vec![false; joints.len()];
    tabs.iter().for_each(|tab| has[tab.joint as usize] = true);
    let bare = (0..joints.len()).filter(|&j| !has[j]);
    let strips = bare.map(|j| paper.strip(j as u32, &joints[j], size)).collect();
    Ok((tabs, strips))
}

/// All pieces with their facets.
struct Paper<'a> {
    mesh: &'a Facets,
    placed: &'a Placed,
    outlines: Vec<(Bounds, Outline)>,
    grids: Vec<Grid>,
}

impl<'a> Paper<'a> {
    fn new(mesh: &'a Facets, placed: &'a Placed) -> Self {
        let outline = |(facet, motion): (&super::facets::Facet, &Motion)| {
            let parts = facet.parts.iter().map(|part| gathered(part, &facet.flat));
            let outline = Outline::new(parts).placed(motion);
            (outline.bounds(), outline)
        };
        let outlines: Vec<(Bounds, Outline)> =
            mesh.facets.iter().zip(&placed.place).map(outline).collect();
        let grid = |facets: &Vec<u32>| {
            let sum: f64 =
                facets.iter().map(|&f| outlines[f as usize].0.size().element_sum() / 2.0).sum();
            let mut grid = Grid::new(facets.len(), sum / facets.len().max(1) as f64);
            facets.iter().for_each(|&f| grid.insert(f, &outlines[f as usize].0));
            grid
        };
        let grids = placed.pieces.iter().map(grid).collect();
        Self { mesh, placed, outlines, grids }
    }

    /// The best tab for joint `joint` that keeps off facets and off the tabs `others`, with slopes of
    /// at least number `gentle`.
    fn best(
        &self,
        joint: usize,
        way: [FacetSide; 2],
        size: TabSize,
        gentle: usize,
        others: &[&Tab],
    ) -> Option<Tab> {
        let [(facet, side), under] = way;
        let base = self.mesh.facets[facet as usize]
            .side(side)
            .map(|p| self.placed.place[facet as usize].at(p));
        let length = base[0].distance(base[1]);
        let piece = self.placed.piece[facet as usize];
        let reach = Bounds::of(&trapeze(base, [0.0; 2], size.height));
        let mut near: Vec<u32> = Vec::new();
        self.grids[piece as usize].near(&reach, |f| {
            if reach.meet(&self.outlines[f as usize].0, 0.0) && !near.contains(&f) {
                near.push(f);
            }
            false
        });
        let others: Vec<&Tab> =
            others.iter().copied().filter(|tab| tab.bounds.meet(&reach, 0.0)).collect();
        let [first, second] = self.slopes(way, base, &near, gentle);
        let mut slopes: Vec<(f64, [f64; 2])> = Vec::new();
        for &a in &first {
            for &b in &second {
                let height = size.height.min(length / (a + b));
                slopes.push((height * (length - height * (a + b) / 2.0), [a, b]));
            }
        }
        slopes.sort_by(|p, q| q.0.total_cmp(&p.0));
        let mut best: Option<(f64, Vec<DVec2>)> = None;
        for (most, [a, b]) in slopes {
            if best.as_ref().is_some_and(|(value, _)| most <= *value) {
                break;
            }
            let top = length / (a + b);
            let low = HEIGHTS.iter().map(|part| part * size.height).filter(|&h| h < top);
            let capped = (top <= size.height).then_some(top);
            for height in capped.into_iter().chain(low) {
                let value = height * (length - height * (a + b) / 2.0);
                let poor = height < size.least || value < 0.4 * size.least * length;
                if poor || best.as_ref().is_some_and(|(known, _)| value <= *known) {
                    break;
                }
                let shape = trapeze(base, [a, b], height);
                if self.is_clear(&shape, &near, &others)
                    && self.is_hidden([a, b], height, [(facet, side), under])
                {
                    best = Some((value, shape));
                    break;
                }
            }
        }
        best.map(|(value, shape)| {
            let bounds = Bounds::of(&shape);
            Tab { joint: joint as u32, way, shape, bounds, value }
        })
    }

    /// Slopes to try at the ends of a base: the usual ones, and those that just fit beside a facet
    /// that begins there and into the corner of the facet that the tab is glued under.
    fn slopes(
        &self,
        [on, under]: [FacetSide; 2],
        base: [DVec2; 2],
        near: &[u32],
        gentle: usize,
    ) -> [Vec<f64>; 2] {
        let corners = self.mesh.facets[under.0 as usize].corner_angles(under.1);
        let [a, b] = if self.run_alike(on, under) { [0, 1] } else { [1, 0] };
        let fits = [(base, corners[a], -1.0), ([base[1], base[0]], corners[b], 1.0)];
        fits.map(|([end, other], corner, outside)| {
            let along = other - end;
            let turn = |p: DVec2| outside * along.angle_to(p - end);
            let beside = near.iter().flat_map(|&f| self.outlines[f as usize].1.corners());
            let angles = beside
                .filter(|[corner, _]| corner.distance(end) < SAME)
                .map(|[_, neighbour]| turn(neighbour))
                .chain([corner]);
            let just = angles.filter(|&a| a > LEAST_ANGLE).map(|a| a.tan().recip());
            let mut slopes = SLOPES.to_vec();
            slopes.extend(just.filter(|&slope| slope > SLOPES[0]));
            slopes.retain(|&slope| slope >= SLOPES[gentle]);
            slopes.sort_by(f64::total_cmp);
            slopes.dedup();
            slopes
        })
    }

    fn is_clear(&self, shape: &[DVec2], near: &[u32], others: &[&Tab]) -> bool {
        let bounds = Bounds::of(shape);
        let off_facet = |&f: &u32| {
            let (other, outline) = &self.outlines[f as usize];
            !bounds.meet(other, 0.0) || outline.parts().all(|part| !convex_meet(shape, part, TOUCH))
        };
        near.iter().all(off_facet)
            && others.iter().all(|tab| !convex_meet(shape, &tab.shape, TOUCH))
    }

    /// True where the tab, folded over, stays inside the facet that it is glued under.
    fn is_hidden(&self, slopes: [f64; 2], height: f64, way: [FacetSide; 2]) -> bool {
        let shape = self.folded(slopes, height, way);
        let facet = &self.mesh.facets[way[1].0 as usize];
        let within =
            |part: &Vec<u32>| doubled_area(&clipped(&shape, &gathered(part, &facet.flat))) / 2.0;
        let inside: f64 = facet.parts.iter().map(within).sum();
        inside >= doubled_area(&shape) / 2.0 - 1e-6
    }

    /// A tab folded over, in the plane of the facet that it is glued under.
    fn folded(&self, slopes: [f64; 2], height: f64, [on, under]: [FacetSide; 2]) -> Vec<DVec2> {
        let [a, b] = self.mesh.facets[under.0 as usize].side(under.1);
        let [p, q] = slopes;
        // A trapeze lies right of its base; the facet is left of its side.
        trapeze([b, a], if self.run_alike(on, under) { [q, p] } else { slopes }, height)
    }

    /// True where two sides run along their edge the same way.
    fn run_alike(&self, a: FacetSide, b: FacetSide) -> bool {
        let from = |(facet, side): FacetSide| {
            let facet = &self.mesh.facets[facet as usize];
            facet.corners[facet.sides[side as usize][0] as usize]
        };
        from(a) == from(b)
    }

    /// A strip for a joint without a tab.
    fn strip(&self, number: u32, joint: &Joint, size: TabSize) -> Strip {
        let [on, under] = joint.ways[0];
        let [a, b] = self.mesh.facets[on.0 as usize].side(on.1);
        let base = [DVec2::ZERO, DVec2::new(a.distance(b), 0.0)];
        let wing = |way: [FacetSide; 2]| {
            let mut best = (0.0, [SLOPES[0]; 2], size.least);
            for &p in &SLOPES {
                for &q in &SLOPES {
                    let top = base[1].x / (p + q);
                    let mut heights = HEIGHTS.iter().map(|part| (part * size.height).min(top));
                    let hidden = heights.find(|&h| self.is_hidden([p, q], h, way));
                    let Some(height) = hidden else { continue };
                    let value = height * (base[1].x - height * (p + q) / 2.0);
                    if value > best.0 {
                        best = (value, [p, q], height);
                    }
                }
            }
            (best.1, best.2.min(base[1].x / (best.1[0] + best.1[1])).max(size.least / 2.0))
        };
        // Either wing is what the other facet would glue under this one.
        let (slopes, height) = wing([on, under]);
        let below = trapeze(base, slopes, height);
        let ([p, q], height) = wing([under, on]);
        let slopes = if self.run_alike(on, under) { [q, p] } else { [p, q] };
        let above = trapeze([base[1], base[0]], slopes, height);
        let shape = [&base[..1], &below[2..], &base[1..], &above[2..]].concat();
        Strip { joint: number, shape, fold: base }
    }
}

/// Tabs set so far.
struct Board<'a> {
    paper: &'a Paper<'a>,
    joints: &'a [Joint],
    size: TabSize,
    tabs: Vec<Option<Tab>>,
    /// Joints with tabs on each piece.
    on: Vec<Vec<u32>>,
}

impl<'a> Board<'a> {
    fn new(paper: &'a Paper<'a>, joints: &'a [Joint], size: TabSize) -> Self {
        let on = vec![Vec::new(); paper.placed.pieces.len()];
        Self { paper, joints, size, tabs: vec![None; joints.len()], on }
    }

    /// Gives a joint the best tab that is free.
    fn set(&mut self, joint: usize) -> bool {
        let mut best: Option<Tab> = None;
        for &way in &self.joints[joint].ways {
            let piece = self.paper.placed.piece[way[0].0 as usize] as usize;
            let others: Vec<&Tab> =
                self.on[piece].iter().filter_map(|&j| self.tabs[j as usize].as_ref()).collect();
            let tab = self.paper.best(joint, way, self.size, 0, &others);
            if let Some(tab) = tab
                && best.as_ref().is_none_or(|known| tab.value > known.value)
            {
                best = Some(tab);
            }
        }
        best.map(|tab| self.put(tab)).is_some()
    }

    /// Gives a joint a tab where others are in the way, if these find other places.
    fn push(&mut self, joint: usize) -> bool {
        for gentle in [0, 2, 4, 5] {
            for &way in &self.joints[joint].ways {
                let Some(tab) = self.paper.best(joint, way, self.size, gentle, &[]) else {
                    continue;
                };
                let piece = self.paper.placed.piece[way[0].0 as usize] as usize;
                let in_way = |&j: &u32| {
                    self.tabs[j as usize]
                        .as_ref()
                        .is_some_and(|t| convex_meet(&tab.shape, &t.shape, TOUCH))
                };
                let moved: Vec<u32> = self.on[piece].iter().copied().filter(in_way).collect();
                if moved.len() > 3 {
                    continue;
                }
                let before: Vec<Tab> = moved.iter().filter_map(|&j| self.take(j)).collect();
                self.put(tab);
                if moved.iter().all(|&j| self.set(j as usize)) {
                    return true;
                }
                for &j in &moved {
                    self.take(j);
                }
                self.take(joint as u32);
                before.into_iter().for_each(|tab| self.put(tab));
            }
        }
        false
    }

    fn put(&mut self, tab: Tab) {
        let piece = self.paper.placed.piece[tab.way[0].0 as usize] as usize;
        self.on[piece].push(tab.joint);
        let joint = tab.joint as usize;
        self.tabs[joint] = Some(tab);
    }

    fn take(&mut self, joint: u32) -> Option<Tab> {
        let tab = self.tabs[joint as usize].take()?;
        let piece = self.paper.placed.piece[tab.way[0].0 as usize] as usize;
        self.on[piece].retain(|&j| j != joint);
        Some(tab)
    }
}

/// A trapeze right of its base, counter-clockwise: the ends of the base, the second one first, then
/// the corners beyond the first and beyond the second. Slopes are cotangents at the ends.
fn trapeze(base: [DVec2; 2], slopes: [f64; 2], height: f64) -> Vec<DVec2> {
    let [a, b] = base;
    let along = (b - a).normalize_or_zero();
    let out = -along.perp() * height;
    let corners = [a + out + along * slopes[0] * height, b + out - along * slopes[1] * height];
    if (corners[1] - corners[0]).dot(along) <= 1e-6 {
        return vec![b, a, corners[0].midpoint(corners[1])];
    }
    vec![b, a, corners[0], corners[1]]
}

/// What two convex polygons share (Sutherland and Hodgman 1974).
fn clipped(shape: &[DVec2], by: &[DVec2]) -> Vec<DVec2> {
    let mut left = shape.to_vec();
    for (i, &p) in by.iter().enumerate() {
        let along = by[(i + 1) % by.len()] - p;
        let mut kept = Vec::with_capacity(left.len() + 1);
        for (k, &r) in left.iter().enumerate() {
            let s = left[(k + 1) % left.len()];
            let (x, y) = (along.perp_dot(r - p), along.perp_dot(s - p));
            if x >= 0.0 {
                kept.push(r);
            }
            if x * y < 0.0 {
                kept.push(r.lerp(s, x / (x - y)));
            }
        }
        left = kept;
    }
    left
}
