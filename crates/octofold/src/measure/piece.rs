//! A convex piece of a triangle, and how it is cut by planes.

use glam::DVec3;

/// Most corners of a piece; one that has as many is cut along a diagonal, which makes no new one.
const MOST: usize = 12;

/// A convex polygon in the plane of a triangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    corners: [DVec3; MOST],
    count: usize,
}

/// All points at which `normal`, of unit length, has the same product as at `point`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    pub(super) point: DVec3,
    pub(super) normal: DVec3,
}

/// Unit directions in the plane of a triangle: along its longest edge, and across.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axes([DVec3; 2]);

/// The middle of the rectangle round a piece, which lies in the piece, and the distance of the
/// corner furthest from it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ball {
    pub(super) centre: DVec3,
    pub(super) radius: f64,
}

impl Axes {
    /// The axes of a triangle; without area there may be none across, without length none at all.
    pub(super) fn of([a, b, c]: &[DVec3; 3]) -> Self {
        let edges = [b - a, c - b, a - c];
        let longest = |best: DVec3, e: DVec3| {
            if e.length_squared() > best.length_squared() { e } else { best }
        };
        let along = edges.into_iter().fold(DVec3::ZERO, longest).normalize_or_zero();
        let across = along.cross(edges[0].cross(edges[1]).normalize_or_zero());
        Self([along, across])
    }
}

impl Piece {
    /// A whole triangle.
    pub(super) fn triangle([a, b, c]: [DVec3; 3]) -> Self {
        let mut corners = [DVec3::ZERO; MOST];
        corners[..3].copy_from_slice(&[a, b, c]);
        Self { corners, count: 3 }
    }

    /// The corners, in order.
    pub(super) fn corners(&self) -> &[DVec3] {
        &self.corners[..self.count]
    }

    /// A ball round the piece.
    ///
    /// A half plane whose border passes through the middle of a rectangle holds a whole side of
    /// it, hence a point of the piece: so the middle is in the piece.
    pub(super) fn ball(&self, axes: &Axes) -> Ball {
        let first = self.corners[0];
        let centre = axes.0.iter().fold(first, |centre, &axis| {
            let [low, high] = self.extent(axis);
            centre + axis * ((low + high) / 2.0)
        });
        let squared = self.corners().iter().map(|c| c.distance_squared(centre));
        Ball { centre, radius: squared.fold(0.0, f64::max).sqrt() }
    }

    /// Lowest and highest product with `axis`, seen from the first corner.
    fn extent(&self, axis: DVec3) -> [f64; 2] {
        let first = self.corners[0];
        self.corners[1..self.count].iter().fold([0.0, 0.0], |[low, high]: [f64; 2], &c| {
            let at = (c - first).dot(axis);
            [low.min(at), high.max(at)]
        })
    }

    /// Both halves of the piece, cut across its longer extent; `None` where there is nothing to
    /// cut.
    pub(super) fn halves(&self, axes: &Axes) -> Option<[Self; 2]> {
        if self.count == MOST {
            let (half, first) = (MOST / 2, self.corners[0]);
            let near = self.corners[..=half].iter().copied();
            let far = std::iter::once(first).chain(self.corners[half..].iter().copied());
            return Some([near.collect(), far.collect()]);
        }
        let [along, across] = axes.0.map(|axis| (axis, self.extent(axis)));
        let longer = |e: [f64; 2]| e[1] - e[0];
        let (normal, [low, high]) = if longer(across.1) > longer(along.1) { across } else { along };
        let point = self.corners[0] + normal * ((low + high) / 2.0);
        self.cut(&Plane { point, normal }, 0.0)
    }

    /// The least extent of the piece to either side of a plane; negative where it is on one side.
    pub(super) fn depth(&self, plane: &Plane) -> f64 {
        let (mut behind, mut before) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        for &c in self.corners() {
            let side = plane.side(c);
            (behind, before) = (behind.max(-side), before.max(side));
        }
        behind.min(before)
    }

    /// The parts behind and before a plane; `None` where one is no thicker than `thin`, or where
    /// there is no room for another corner.
    pub(super) fn cut(&self, plane: &Plane, thin: f64) -> Option<[Self; 2]> {
        let depth = self.depth(plane);
        if self.count == MOST || depth.is_nan() || depth <= thin {
            return None;
        }
        let mut parts = [Self { corners: [DVec3::ZERO; MOST], count: 0 }; 2];
        for i in 0..self.count {
            let (here, next) = (self.corners[i], self.corners[(i + 1) % self.count]);
            let (side, beyond) = (plane.side(here), plane.side(next));
            if side <= 0.0 {
                parts[0].push(here);
            }
            if side >= 0.0 {
                parts[1].push(here);
            }
            if side * beyond < 0.0 {
                let meeting = here + (next - here) * (side / (side - beyond));
                parts.iter_mut().for_each(|part| part.push(meeting));
            }
        }
        Some(parts)
    }

    fn push(&mut self, corner: DVec3) {
        self.corners[self.count] = corner;
        self.count += 1;
    }
}

impl FromIterator<DVec3> for Piece {
    fn from_iter<I: IntoIterator<Item = DVec3>>(corners: I) -> Self {
        let mut piece = Self { corners: [DVec3::ZERO; MOST], count: 0 };
        corners.into_iter().for_each(|c| piece.push(c));
        piece
    }
}

impl Plane {
    fn side(&self, p: DVec3) -> f64 {
        (p - self.point).dot(self.normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn area(piece: &Piece) -> f64 {
        let [first, rest @ ..] = piece.corners() else { return 0.0 };
        let fan = rest.windows(2).map(|w| (w[0] - first).cross(w[1] - first));
        fan.sum::<DVec3>().length() / 2.0
    }

    proptest! {
        #[test]
        fn parts_make_up_the_whole_and_hold_their_centres(
            corners in prop::array::uniform3(prop::array::uniform3(-1.0..1.0f64)),
            planes in prop::collection::vec((prop::array::uniform3(-1.0..1.0f64), 0.1..0.9f64), 30),
        ) {
            let corners = corners.map(DVec3::from);
            let axes = Axes::of(&corners);
            let mut pieces = vec![Piece::triangle(corners)];
            let whole = area(&pieces[0]);
            prop_assume!(whole > 1e-3);
            for (normal, share) in planes {
                let normal = DVec3::from(normal).normalize_or(DVec3::X);
                let point = corners[0].lerp(corners[1].lerp(corners[2], share), share);
                let plane = Plane { point, normal };
                pieces = pieces
                    .iter()
                    .flat_map(|p| match (p.cut(&plane, 1e-9), p.count == MOST) {
                        (Some(parts), _) => parts.to_vec(),
                        (None, true) => p.halves(&axes).unwrap().to_vec(),
                        (None, false) => vec![*p],
                    })
                    .collect();
            }
            prop_assert!((pieces.iter().map(area).sum::<f64>() - whole).abs() < 1e-9);
            for piece in pieces {
                let Ball { centre, radius } = piece.ball(&axes);
                prop_assert!(piece.corners().iter().all(|c| c.distance(centre) <= radius + 1e-12));
                let around: f64 = (0..piece.count)
                    .map(|i| {
                        let next = piece.corners[(i + 1) % piece.count];
                        (piece.corners[i] - centre).cross(next - centre).length() / 2.0
                    })
                    .sum();
                prop_assert!((around - area(&piece)).abs() < 1e-9, "the centre is outside");
            }
        }
    }

    #[test]
    fn points_have_no_halves() {
        let corners = [DVec3::ONE; 3];
        assert!(Piece::triangle(corners).halves(&Axes::of(&corners)).is_none());
    }

    #[test]
    fn segments_are_halved() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::X];
        let axes = Axes::of(&corners);
        let parts = Piece::triangle(corners).halves(&axes).unwrap();
        assert!(parts.iter().all(|p| p.ball(&axes).radius == 0.25));
    }
}
