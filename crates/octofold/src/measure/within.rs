//! A certificate of distance: whether two meshes are nowhere further apart than allowed, decided
//! for every point of both.
//!
//! The distance from a convex set is a convex function: a piece of a triangle whose corners lie
//! within a distance of one and the same triangle of the other mesh lies within it as a whole. And
//! distance grows no faster than the way: a piece lies within the distance of its centre plus its
//! radius. A piece that passes neither test is cut, along the planes through the sides of the
//! triangle next to it where the bound is nearly met, else in half. A point found further away
//! than allowed refutes. Source: specification of surfaces, A.9.
//!
//! Points are compared as given. Rounding is met by a margin: *proven* means no further apart than
//! `distance` (1 + 10^-9) + 2^-40 c, where c is the largest coordinate of both meshes, and
//! *refuted* means that a point further away than that was found.

use super::nearest::{Face, Nearest};
use super::piece::{Axes, Ball, Piece, Plane};
use crate::attributes::LengthUnit;
use crate::mesh::Mesh;
use crate::par;
use crate::run::{Cancelled, Run};
use glam::DVec3;
use serde::Serialize;
use std::borrow::Cow;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Triangles in one unit of work.
const BLOCK: usize = 32;

/// Share of the allowed distance that is put down to rounding.
const MARGIN: f64 = 1e-9;

/// Share of the largest coordinate that is put down to rounding: 2^-40.
const GRAIN: f64 = 1.0 / (1u64 << 40) as f64;

/// A piece whose radius is this share of the limit is fine: it is only reached where the distance
/// comes as near to the limit as that.
const FINE: f64 = 1.0 / 1024.0;

/// Fine pieces that a unit of work looks at, before it leaves the rest undecided.
const PATIENCE: usize = 1 << 16;

/// The same for those who ask for many triangles that may as well not hold.
const COARSE: f64 = 1.0 / 16.0;
const HASTE: usize = 32;

/// Pieces between two looks at the flag that stops the work.
const STRIDE: usize = 4096;

/// One of two meshes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// The first.
    A,
    /// The second.
    B,
}

/// Whether two meshes are nowhere further apart than allowed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// No point of either is further from the other.
    Proven,
    /// A point is.
    Refuted {
        /// The mesh that it lies on.
        side: Side,
        /// Where it is.
        place: [f64; 3],
        /// Its distance from the other mesh.
        distance: f64,
    },
    /// No point was found that is, but along some line the distance comes so near to the allowed
    /// one that it cannot be told apart in reasonable time.
    Undecided {
        /// The mesh on which this is so.
        side: Side,
        /// A place where it is so.
        place: [f64; 3],
        /// The largest distance found.
        lower: f64,
        /// No point of either mesh is further from the other than this.
        upper: f64,
    },
    /// One of the two has no triangles: there is no distance.
    Empty,
}

/// What the largest distance from one mesh to another lies between.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Interval {
    /// The largest distance found.
    pub lower: f64,
    /// No point is further away than this.
    pub upper: f64,
    /// Where the largest was found.
    pub place: [f64; 3],
}

/// What the largest distances between two meshes lie between, in the unit of the first.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct HausdorffBounds {
    /// From the first mesh to the second.
    pub a_to_b: Interval,
    /// From the second mesh to the first.
    pub b_to_a: Interval,
}

/// Decides whether `a` and `b` are nowhere further apart than `distance`, seen from either; a
/// negative distance counts as 0.
///
/// Where both have a unit, and not the same, `b` is converted to the unit of `a`. Work grows with
/// the number of triangles, and with the area of those that are large beside `distance`.
pub fn within(a: &Mesh, b: &Mesh, distance: f64, run: &Run) -> Result<Verdict, Cancelled> {
    let Some(pair) = Pair::new(a, b) else { return Ok(Verdict::Empty) };
    let limit = distance.max(0.0) * (1.0 + MARGIN) + pair.grain;
    let mut verdict = Verdict::Proven;
    for side in [Side::A, Side::B] {
        let (mesh, to) = pair.from(side, run)?;
        let Some(fault) = decide(mesh, &to, limit, pair.grain, run)? else { continue };
        verdict = match (fault, verdict) {
            (Fault::Beyond(Far { place, distance }), _) => {
                return Ok(Verdict::Refuted { side, place: place.to_array(), distance });
            }
            (Fault::Doubt(_, bound), Verdict::Undecided { side, place, lower, upper }) => {
                Verdict::Undecided { side, place, lower, upper: upper.max(bound) }
            }
            (Fault::Doubt(Far { place, distance }, upper), _) => {
                Verdict::Undecided { side, place: place.to_array(), lower: distance, upper }
            }
        };
    }
    Ok(verdict)
}

/// Bounds of the largest distances between `a` and `b` both ways, `accuracy` apart at most, but
/// for rounding; `None` where one of the two has no triangles.
///
/// Where both have a unit, and not the same, `b` is converted to the unit of `a`.
pub fn hausdorff_bounds(
    a: &Mesh,
    b: &Mesh,
    accuracy: f64,
    run: &Run,
) -> Result<Option<HausdorffBounds>, Cancelled> {
    let Some(pair) = Pair::new(a, b) else { return Ok(None) };
    let bounds = |side| {
        let (mesh, to) = pair.from(side, run)?;
        bound(mesh, &to, accuracy, pair.grain, run)
    };
    Ok(Some(HausdorffBounds { a_to_b: bounds(Side::A)?, b_to_a: bounds(Side::B)? }))
}

/// Two meshes in one unit.
struct Pair<'a> {
    a: &'a Mesh,
    b: Cow<'a, Mesh>,
    /// What the coordinates and what is made of them may be off by rounding.
    grain: f64,
}

impl<'a> Pair<'a> {
    fn new(a: &'a Mesh, b: &'a Mesh) -> Option<Self> {
        let scale = LengthUnit::scale(b.unit, a.unit);
        let b = if scale == 1.0 {
            Cow::Borrowed(b)
        } else {
            Cow::Owned(b.map(|p| p.map(|x| x * scale)))
        };
        let empty = a.triangles.is_empty() || b.triangles.is_empty();
        let corners = [a.bounds(), b.bounds()].into_iter().flatten().flatten().flatten();
        let largest = corners.fold(0.0, |most: f64, x| most.max(x.abs()));
        (!empty).then_some(Self { a, b, grain: GRAIN * largest })
    }

    /// The mesh on `side`, and an index of the other.
    fn from(&self, side: Side, run: &Run) -> Result<(&Mesh, Nearest), Cancelled> {
        run.check()?;
        Ok(match side {
            Side::A => {
                run.stage("distances from a to b");
                (self.a, Nearest::new(&self.b))
            }
            Side::B => {
                run.stage("distances from b to a");
                (&self.b, Nearest::new(self.a))
            }
        })
    }
}

/// A point of one mesh and its distance from the other.
#[derive(Debug, Clone, Copy)]
struct Far {
    place: DVec3,
    distance: f64,
}

/// Why the rest of a triangle is not known to lie within the limit.
#[derive(Debug, Clone, Copy)]
enum Fault {
    /// A point beyond what is allowed.
    Beyond(Far),
    /// A point too near to the limit, and a bound for all that is in doubt.
    Doubt(Far, f64),
}

/// The first point of `mesh` beyond `limit`, else what is in doubt.
fn decide(
    mesh: &Mesh,
    to: &Nearest,
    limit: f64,
    grain: f64,
    run: &Run,
) -> Result<Option<Fault>, Cancelled> {
    let first_beyond = AtomicUsize::new(usize::MAX);
    let parts = par::blocks(run, mesh.triangles.len(), BLOCK, |range| {
        let block = range.start / BLOCK;
        let mut cover = Cover::new(to, limit, limit, grain);
        let mut doubts = Vec::new();
        for t in range {
            // What comes after a refutation is not asked for.
            if first_beyond.load(Ordering::Relaxed) < block {
                break;
            }
            match cover.triangle(mesh.corners(t).map(DVec3::from), run)? {
                Some(Fault::Beyond(far)) => {
                    first_beyond.fetch_min(block, Ordering::Relaxed);
                    return Ok(vec![Fault::Beyond(far)]);
                }
                Some(doubt) => doubts.push(doubt),
                None => {}
            }
        }
        Ok(doubts)
    })?;
    let faults = parts.into_iter().collect::<Result<Vec<_>, Cancelled>>()?.concat();
    let beyond = faults.iter().find(|fault| matches!(fault, Fault::Beyond(_)));
    Ok(beyond.copied().or_else(|| faults.into_iter().reduce(worse)))
}

/// The larger of two distances, and the larger of two bounds; a point beyond before any doubt.
fn worse(one: Fault, other: Fault) -> Fault {
    match (one, other) {
        (Fault::Doubt(p, upper), Fault::Doubt(q, bound)) => {
            Fault::Doubt(if q.distance > p.distance { q } else { p }, upper.max(bound))
        }
        (beyond @ Fault::Beyond(_), _) | (_, beyond) => beyond,
    }
}

/// Bounds of the largest distance of `mesh`.
fn bound(
    mesh: &Mesh,
    to: &Nearest,
    accuracy: f64,
    grain: f64,
    run: &Run,
) -> Result<Interval, Cancelled> {
    let farthest = |parts: Vec<Far>| {
        let start = Far { place: DVec3::ZERO, distance: f64::NEG_INFINITY };
        parts.into_iter().fold(start, |p, q| if q.distance > p.distance { q } else { p })
    };
    // Corners first: what lies below their largest distance needs no closer look.
    let corners = par::blocks(run, mesh.triangles.len(), BLOCK, |range| {
        let mut hint = None;
        let corners = range.flat_map(|t| mesh.corners(t));
        let far = corners.filter_map(|corner| {
            let place = DVec3::from(corner);
            let (face, distance) = to.nearest_face(place, f64::INFINITY, hint)?;
            hint = Some(face);
            Some(Far { place, distance })
        });
        farthest(far.collect())
    })?;
    let known = farthest(corners);
    let parts = par::blocks(run, mesh.triangles.len(), BLOCK, |range| {
        let (mut found, mut upper) = (known, 0.0f64);
        // Only what is further by more than rounding is told, or the same point would be again.
        let limits = |found: Far| {
            let allowed = found.distance * (1.0 + MARGIN) + grain;
            (allowed, allowed + accuracy.max(grain))
        };
        let (allowed, limit) = limits(found);
        let mut cover = Cover::new(to, allowed, limit, grain);
        for t in range {
            let mut fault = cover.triangle(mesh.corners(t).map(DVec3::from), run)?;
            while let Some(Fault::Beyond(far)) = fault {
                found = far;
                (cover.allowed, cover.limit) = limits(found);
                fault = cover.settle(run)?;
            }
            if let Some(Fault::Doubt(_, bound)) = fault {
                upper = upper.max(bound);
            }
        }
        Ok((found, upper.max(cover.limit)))
    })?;
    let (found, uppers): (Vec<_>, Vec<_>) =
        parts.into_iter().collect::<Result<Vec<_>, Cancelled>>()?.into_iter().unzip();
    let Far { place, distance } = farthest(found);
    let upper = uppers.into_iter().fold(distance, f64::max);
    Ok(Interval { lower: distance, upper, place: place.to_array() })
}

/// Faces among which the nearest to a point can be found.
pub(crate) trait Faces {
    /// The nearest face no farther than `distance`, by its place in [`Self::all`], and how far it
    /// is. The answer is the same with any `hint`; one that is near may save time.
    fn nearest(&self, p: DVec3, distance: f64, hint: Option<usize>) -> Option<(usize, f64)>;

    /// All of them.
    fn all(&self) -> &[Face];
}

impl Faces for Nearest {
    fn nearest(&self, p: DVec3, distance: f64, hint: Option<usize>) -> Option<(usize, f64)> {
        self.nearest_face(p, distance, hint)
    }

    fn all(&self) -> &[Face] {
        self.faces()
    }
}

/// A few faces are looked at one after the other.
impl Faces for Vec<Face> {
    fn nearest(&self, p: DVec3, distance: f64, _: Option<usize>) -> Option<(usize, f64)> {
        let squares = self.iter().map(|face| face.distance_squared(p)).enumerate();
        let best = squares.reduce(|best, new| if new.1 < best.1 { new } else { best });
        best.map(|(face, squared)| (face, squared.sqrt())).filter(|best| best.1 <= distance)
    }

    fn all(&self) -> &[Face] {
        self
    }
}

/// Whether triangles lie within a limit of faces, one after the other, without much patience: what
/// is not decided soon counts as beyond.
pub(crate) struct Reach<'a, T>(Cover<'a, T>);

impl<'a, T: Faces> Reach<'a, T> {
    /// `grain` is what coordinates may be off by rounding.
    pub(crate) fn new(to: &'a T, limit: f64, grain: f64) -> Self {
        Self(Cover { fine: COARSE, ..Cover::new(to, limit, limit, grain) })
    }

    /// Whether no point of a triangle is further away than the limit.
    pub(crate) fn holds(&mut self, corners: [DVec3; 3], run: &Run) -> Result<bool, Cancelled> {
        self.0.patience = HASTE;
        Ok(self.0.triangle(corners, run)?.is_none())
    }

    /// The faces that parts of the last triangle were found to lie near to, some more than once.
    pub(crate) fn met(&self) -> &[usize] {
        &self.0.met
    }
}

/// The search through triangles one after the other, and what is left of the current one.
struct Cover<'a, T> {
    to: &'a T,
    /// A point that is further away is told.
    allowed: f64,
    /// A piece that is nowhere further away is done.
    limit: f64,
    grain: f64,
    axes: Axes,
    waiting: Vec<Piece>,
    doubt: Option<Fault>,
    /// The face that was nearest last.
    hint: Option<usize>,
    /// Share of the limit below which a piece is fine.
    fine: f64,
    /// Fine pieces that are still looked at.
    patience: usize,
    looked_at: usize,
    /// The faces beside which pieces of the current triangle were left.
    met: Vec<usize>,
}

impl<'a, T: Faces> Cover<'a, T> {
    fn new(to: &'a T, allowed: f64, limit: f64, grain: f64) -> Self {
        Self {
            to,
            allowed,
            limit,
            grain,
            axes: Axes::of(&[DVec3::ZERO; 3]),
            waiting: Vec::new(),
            doubt: None,
            hint: None,
            fine: FINE,
            patience: PATIENCE,
            looked_at: 0,
            met: Vec::new(),
        }
    }

    /// Looks at a whole triangle.
    fn triangle(&mut self, corners: [DVec3; 3], run: &Run) -> Result<Option<Fault>, Cancelled> {
        self.waiting.clear();
        self.met.clear();
        if self.is_beside_hint(&corners) {
            self.met.extend(self.hint);
            return Ok(None);
        }
        self.axes = Axes::of(&corners);
        self.waiting.push(Piece::triangle(corners));
        self.settle(run)
    }

    /// Looks at what waits, up to the first point beyond what is allowed. Its piece stays, so that
    /// the search may go on with new limits.
    fn settle(&mut self, run: &Run) -> Result<Option<Fault>, Cancelled> {
        while let Some(piece) = self.waiting.pop() {
            self.looked_at += 1;
            if self.looked_at.is_multiple_of(STRIDE) {
                run.check()?;
            }
            let Ball { centre, radius } = piece.ball(&self.axes);
            if self.is_ball_beside_hint(centre, radius) || self.is_beside_hint(piece.corners()) {
                self.met.extend(self.hint);
                continue;
            }
            let Some((face, distance)) = self.nearest(centre) else {
                self.waiting.push(piece);
                return Ok(self.beyond(centre));
            };
            let upper = distance + radius;
            if upper <= self.limit || self.is_beside_hint(piece.corners()) {
                self.met.push(face);
                continue;
            }
            let spare = self.limit - distance;
            let nearly_met = 4.0 * spare < radius;
            if nearly_met {
                let face = &self.to.all()[face];
                let furthest = furthest(piece.corners(), face);
                if self.nearest(furthest).is_none() {
                    self.waiting.push(piece);
                    return Ok(self.beyond(furthest));
                }
            }
            match self.part(&piece, radius, nearly_met.then_some(face)) {
                Some(parts) => self.waiting.extend(parts),
                None => {
                    let doubt = Fault::Doubt(Far { place: centre, distance }, upper);
                    self.doubt = Some(self.doubt.map_or(doubt, |known| worse(known, doubt)));
                }
            }
        }
        Ok(self.doubt.take())
    }

    /// The nearest face to a point, where that is no farther than allowed.
    fn nearest(&mut self, p: DVec3) -> Option<(usize, f64)> {
        let found = self.to.nearest(p, self.allowed, self.hint)?;
        self.hint = Some(found.0);
        Some(found)
    }

    fn beyond(&self, place: DVec3) -> Option<Fault> {
        let (_, distance) = self.to.nearest(place, f64::INFINITY, self.hint)?;
        Some(Fault::Beyond(Far { place, distance }))
    }

    fn is_beside_hint(&self, corners: &[DVec3]) -> bool {
        self.hint.is_some_and(|face| {
            let face = &self.to.all()[face];
            corners.iter().all(|&c| face.distance_squared(c) <= self.limit * self.limit)
        })
    }

    fn is_ball_beside_hint(&self, centre: DVec3, radius: f64) -> bool {
        let spare = self.limit - radius;
        spare >= 0.0
            && self
                .hint
                .is_some_and(|face| self.to.all()[face].distance_squared(centre) <= spare * spare)
    }

    /// Both parts of a piece, along `face` where one is given; `None` where it is too small, or
    /// fine and patience has run out.
    fn part(&mut self, piece: &Piece, radius: f64, face: Option<usize>) -> Option<[Piece; 2]> {
        if radius < self.fine * self.limit {
            self.patience = self.patience.checked_sub(1)?;
        }
        if 4.0 * radius <= self.grain {
            return None;
        }
        let along_face = face.and_then(|f| self.cut_along(piece, radius, &self.to.all()[f]));
        along_face.or_else(|| piece.halves(&self.axes))
    }

    /// Parts of a piece to both sides of one of the planes that bound the places above `face` that
    /// lie within the limit; `None` where the piece is much larger than the face, or none of them
    /// parts it.
    fn cut_along(&self, piece: &Piece, radius: f64, face: &Face) -> Option<[Piece; 2]> {
        let [a, ab, ac] = face.spread();
        let edges = [(a, ab), (a + ab, ac - ab), (a + ac, -ac)];
        let longest = edges.iter().fold(0.0, |most: f64, e| most.max(e.1.length()));
        let up = ab.cross(ac).try_normalize().filter(|_| radius <= 2.0 * longest)?;
        let off = up * (self.limit - self.grain / 2.0);
        let caps = [Plane { point: a + off, normal: up }, Plane { point: a - off, normal: up }];
        let sides = edges.into_iter().filter_map(|(point, edge)| {
            Some(Plane { point, normal: edge.cross(up).try_normalize()? })
        });
        let thin = self.grain / 4.0;
        let depths = sides.chain(caps).map(|plane| (piece.depth(&plane), plane));
        let (_, plane) = depths.reduce(|best, new| if new.0 > best.0 { new } else { best })?;
        piece.cut(&plane, thin)
    }
}

/// The corner that is furthest from `face`.
fn furthest(corners: &[DVec3], face: &Face) -> DVec3 {
    let distances = corners.iter().map(|&c| (face.distance_squared(c), c));
    distances.fold((-1.0, DVec3::NAN), |far, new| if new.0 > far.0 { new } else { far }).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Triangles about half as large as the unit cube that they lie in, some without area.
    fn soup(most: usize) -> impl Strategy<Value = Mesh> {
        let unit = || prop::array::uniform3(0.0..1.0f64);
        let triangle = (unit(), unit(), unit(), 0..8u8).prop_map(|(a, b, c, kind)| match kind {
            0 => [a, b, a],
            1 => [a, a, a],
            2 => [a, b, std::array::from_fn(|x| (a[x] + b[x]) / 2.0)],
            3 => [a.map(|x| x.round()), b.map(|x| x.round()), c.map(|x| x.round())],
            _ => [a, b, c],
        });
        prop::collection::vec(triangle, 1..most).prop_map(|triangles| {
            let count = triangles.len() as u32;
            let numbers = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            Mesh::new(triangles.concat(), numbers).unwrap()
        })
    }

    /// The largest distance from a fine grid on every triangle of `from`, by trying all of `to`.
    fn sampled(from: &Mesh, to: &Mesh) -> f64 {
        const STEPS: usize = 24;
        let faces = Nearest::new(to);
        let distance = |p: DVec3| {
            let all = faces.faces().iter().map(|f| f.distance_squared(p));
            all.fold(f64::INFINITY, f64::min).sqrt()
        };
        let mut most = 0.0f64;
        for t in 0..from.triangles.len() {
            let [a, b, c] = from.corners(t).map(DVec3::from);
            for i in 0..=STEPS {
                for j in 0..=STEPS - i {
                    let [u, v] = [i, j].map(|n| n as f64 / STEPS as f64);
                    most = most.max(distance(a + (b - a) * u + (c - a) * v));
                }
            }
        }
        most
    }

    proptest! {
        #![proptest_config(crate::sweep::cases(96))]

        #[test]
        fn verdicts_and_bounds_agree_with_samples(
            a in soup(7),
            b in soup(7),
            share in 0.5..1.6f64,
            accuracy in 0.001..0.1f64,
        ) {
            let run = Run::default();
            let most = sampled(&a, &b).max(sampled(&b, &a));
            let distance = share * most;
            match within(&a, &b, distance, &run).unwrap() {
                Verdict::Proven => prop_assert!(most <= distance + 1e-9),
                Verdict::Refuted { side, place, distance: found } => {
                    prop_assert!(found > distance);
                    let (on, to) = if side == Side::A { (&a, &b) } else { (&b, &a) };
                    let [on, to] = [on, to].map(|m| Nearest::new(m).nearest(place).unwrap());
                    prop_assert!(on.distance_squared < 1e-24, "the place is not on the mesh");
                    prop_assert!((to.distance_squared.sqrt() - found).abs() < 1e-12);
                }
                undecided => prop_assert!(false, "{undecided:?}"),
            }
            let bounds = hausdorff_bounds(&a, &b, accuracy, &run).unwrap().unwrap();
            for (from, to, Interval { lower, upper, place }) in
                [(&a, &b, bounds.a_to_b), (&b, &a, bounds.b_to_a)]
            {
                prop_assert!(sampled(from, to) <= upper + 1e-9);
                prop_assert!((0.0..=accuracy + 1e-6).contains(&(upper - lower)));
                let [on, off] = [from, to].map(|m| Nearest::new(m).nearest(place).unwrap());
                prop_assert!(on.distance_squared < 1e-24);
                prop_assert!((off.distance_squared.sqrt() - lower).abs() < 1e-12);
            }
            let upper = bounds.a_to_b.upper.max(bounds.b_to_a.upper);
            prop_assert_eq!(within(&a, &b, upper, &run).unwrap(), Verdict::Proven);
        }

        #[test]
        fn a_mesh_is_within_nothing_of_itself(mesh in soup(12)) {
            prop_assert_eq!(within(&mesh, &mesh, 0.0, &Run::default()).unwrap(), Verdict::Proven);
        }
    }

    /// A square of `cells` by `cells` cells at height `z`, each cut by one of its diagonals.
    fn square(cells: u32, z: f64, diagonal: bool) -> Mesh {
        let step = 1.0 / f64::from(cells);
        let side = cells + 1;
        let points = (0..side * side)
            .map(|i| [f64::from(i % side) * step, f64::from(i / side) * step, z])
            .collect();
        let cell = |i: u32| {
            let low = i % cells + i / cells * side;
            let [a, b, c, d] = [low, low + 1, low + side + 1, low + side];
            if diagonal { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
        };
        Mesh::new(points, (0..cells * cells).flat_map(cell).collect()).unwrap()
    }

    #[test]
    fn squares_at_exactly_the_allowed_distance_are_proven() {
        let run = Run::default();
        for (few, many) in [(1, 1), (1, 7), (3, 32)] {
            for height in [0.0, 0.01, 0.3, 5.0] {
                let (a, b) = (square(few, 0.0, true), square(many, height, false));
                assert_eq!(within(&a, &b, height, &run).unwrap(), Verdict::Proven);
                let less = within(&a, &b, 0.999_999 * height, &run).unwrap();
                assert_eq!(matches!(less, Verdict::Refuted { .. }), height > 0.0, "{less:?}");
                let bounds = hausdorff_bounds(&a, &b, 1e-6, &run).unwrap().unwrap();
                for Interval { lower, upper, .. } in [bounds.a_to_b, bounds.b_to_a] {
                    assert!((lower - height).abs() < 1e-12 && upper - lower < 1.1e-6);
                }
            }
        }
    }

    /// Two walls `width` apart and one high, by `count` triangles each.
    fn walls(width: f64, count: u32) -> Mesh {
        let mut mesh = square(count, 0.0, true);
        let points = mesh.points.len() as u32;
        let other = mesh.points.iter().map(|&[x, y, _]| [width, x, y]).collect::<Vec<_>>();
        mesh.points.iter_mut().for_each(|p| *p = [0.0, p[0], p[1]]);
        mesh.points.extend(other);
        let beyond: Vec<_> = mesh.triangles.iter().map(|t| t.map(|p| p + points)).collect();
        mesh.triangles.extend(beyond);
        mesh
    }

    /// A rectangle above both of two walls that are 2 apart.
    fn lid(z: f64) -> Mesh {
        let corners = [[0.0, 0.0, z], [2.0, 0.0, z], [2.0, 1.0, z], [0.0, 1.0, z]];
        Mesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap()
    }

    #[test]
    fn the_middle_between_two_walls_is_as_far_as_half_of_their_distance() {
        let run = Run::default();
        let lid = lid(1.0);
        for count in [1, 4, 9] {
            let mut a = walls(2.0, count);
            let b = a.clone();
            let first = a.points.len() as u32;
            a.points.extend(&lid.points);
            a.triangles.extend(lid.triangles.iter().map(|t| t.map(|p| p + first)));
            assert_eq!(within(&a, &b, 1.0, &run).unwrap(), Verdict::Proven);
            let less = within(&a, &b, 0.9999, &run).unwrap();
            assert!(matches!(less, Verdict::Refuted { side: Side::A, .. }), "{less:?}");
        }
    }

    #[test]
    fn what_cannot_be_told_apart_is_undecided_and_bounded() {
        // The middle line is as far from the upper edges of both walls as the limit, to the last
        // bits, but no plane along a side of a wall tells where the one gets nearer than the other.
        let lid = lid(1.5);
        let limit = 1.25f64.sqrt() + 1e-13;
        let fault = decide(&lid, &Nearest::new(&walls(2.0, 1)), limit, 1e-13, &Run::default());
        let Ok(Some(Fault::Doubt(far, upper))) = fault else { panic!("{fault:?}") };
        assert!(far.distance <= limit && (limit..1.001 * limit).contains(&upper), "{far:?}");
    }

    #[test]
    fn a_mesh_without_triangles_is_at_no_distance() {
        let (run, square) = (Run::default(), square(1, 0.0, true));
        for (a, b) in [(&Mesh::default(), &square), (&square, &Mesh::default())] {
            assert_eq!(within(a, b, 1.0, &run).unwrap(), Verdict::Empty);
            assert_eq!(hausdorff_bounds(a, b, 1.0, &run).unwrap(), None);
        }
    }

    #[test]
    fn units_are_converted() {
        let mut millimetres = square(2, 0.0, true).map(|p| p.map(|x| 1000.0 * x));
        millimetres.unit = Some(LengthUnit::Millimetre);
        let mut metres = square(3, 0.01, true);
        metres.unit = Some(LengthUnit::Metre);
        let run = Run::default();
        assert_eq!(within(&millimetres, &metres, 10.0, &run).unwrap(), Verdict::Proven);
        assert_eq!(within(&metres, &millimetres, 0.01, &run).unwrap(), Verdict::Proven);
        assert_ne!(within(&millimetres, &metres, 9.99, &run).unwrap(), Verdict::Proven);
    }
}
