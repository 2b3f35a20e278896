//! A star: the faces round both ends of an edge, what they become, and what must not happen to them.

use super::Rejection;
use super::boxes::{Boxes, Span};
use super::clearance::{Conflict, Flat, Patch, conflict, turn};
use super::complex::{Complex, Rank};
use super::view::{View, steepest};
use glam::DVec3;

/// Most faces round both ends of an edge.
const MOST: usize = 256;

/// Cosine of the largest turn of a face in one step, squared: 60 degrees.
const TURN: f64 = 0.25;

/// Cosine of the largest turn of a face from what it stands for, squared: 75 degrees.
const DRIFT: f64 = 0.067;

/// Height of a face, by its longest side, below which it must not get flatter, squared.
const FLAT: f64 = 0.001;

/// A face round a point that moves.
#[derive(Debug)]
pub struct Fan {
    pub face: u32,
    pub patch: Patch,
    normal: DVec3,
    pub span: Span,
}

/// What one edge becomes.
#[derive(Debug, Default)]
pub struct Star {
    /// Faces that change.
    pub fans: Vec<Fan>,
    /// Faces on the edge, which end.
    pub dying: Vec<u32>,
    /// Faces near the changed ones.
    near: Vec<u32>,
    /// Changed faces as seen from above.
    flats: Vec<[Flat; 3]>,
    /// The changed faces go all the way round their point.
    whole_round: bool,
    /// From where they were seen, where they are one graph over their place.
    view: Option<View>,
    /// Marks of the faces that change or end.
    marks: Vec<u32>,
    mark: u32,
}

impl Star {
    /// Makes room for the marks of all faces.
    pub fn reset(&mut self, faces: usize) {
        self.marks.clear();
        self.marks.resize(faces, 0);
        self.mark = 0;
    }

    /// Faces that change or end.
    pub fn old(&self) -> impl Iterator<Item = u32> + '_ {
        self.fans.iter().map(|f| f.face).chain(self.dying.iter().copied())
    }

    /// Faces that change, as they become.
    pub fn new_patches(&self) -> Vec<(u32, Patch)> {
        self.fans.iter().map(|f| (f.face, f.patch)).collect()
    }

    /// Faces near them that stay.
    pub fn beside<'a>(&'a self, complex: &'a Complex) -> impl Iterator<Item = (u32, Patch)> + 'a {
        let stays = |f: &&u32| self.marks[**f as usize] != self.mark;
        self.near.iter().filter(stays).map(|&f| (f, complex.patch(f)))
    }

    /// Collects the faces that would change or end.
    pub fn gather(
        &mut self,
        complex: &Complex,
        [kept, gone]: [u32; 2],
        place: DVec3,
    ) -> Result<(), Rejection> {
        let Self { fans, dying, marks, mark, .. } = self;
        fans.clear();
        dying.clear();
        if *mark == u32::MAX {
            marks.fill(0);
            *mark = 0;
        }
        *mark += 1;
        let stays = complex.at[kept as usize] == place;
        self.whole_round = !stays && complex.ranks[kept as usize] == Rank::Free;
        for point in [kept, gone] {
            for corner in complex.around(point) {
                let (face, i) = (corner >> 2, (corner & 3) as usize);
                let mut corners = complex.faces[face as usize].corners;
                corners.rotate_left(i);
                let both = corners.contains(&kept) && corners.contains(&gone);
                if both && point == gone {
                    continue;
                }
                if both {
                    dying.push(face);
                } else if point == gone || !stays {
                    corners[0] = kept;
                    let [_, b, c] = corners.map(|p| complex.at[p as usize]);
                    let at = [place, b, c];
                    let normal = (b - place).cross(c - place);
                    let span = Span::around(&at);
                    fans.push(Fan { face, patch: Patch { corners, at }, normal, span });
                } else {
                    continue;
                }
                marks[face as usize] = *mark;
                if fans.len() + dying.len() > MOST {
                    return Err(Rejection::Crowd);
                }
            }
        }
        Ok(())
    }

    /// No face turns over, by much in one step or in many, and none becomes a sliver.
    pub fn keeps_sides(&self, complex: &Complex) -> Result<(), Rejection> {
        for fan in &self.fans {
            let [a, b, c] = complex.places(fan.face);
            let before = (b - a).cross(c - a);
            let doubled = fan.normal.length_squared();
            let turned = |from: DVec3, most: f64| {
                let dot = fan.normal.dot(from);
                let bound = most * doubled * from.length_squared();
                bound > 0.0 && (dot <= 0.0 || dot * dot < bound)
            };
            if doubled == 0.0 {
                return Err(Rejection::Sliver);
            }
            let stands_for = complex.stands_for[fan.face as usize].as_dvec3();
            if turned(before, TURN) || turned(stands_for, DRIFT) {
                return Err(Rejection::Turn);
            }
            // Squares of the height by the longest side.
            let shape = |t: [DVec3; 3], doubled: f64| doubled / longest_squared(t).powi(2);
            let now = shape(fan.patch.at, doubled);
            if now < FLAT && now < 0.25 * shape([a, b, c], before.length_squared()) {
                return Err(Rejection::Sliver);
            }
        }
        Ok(())
    }

    /// No changed face meets another, or folds onto it, that its former self did not.
    pub fn keeps_clear(&mut self, complex: &Complex, boxes: &Boxes) -> Result<(), Rejection> {
        let Self { fans, dying, near, flats, whole_round, view: seen_from, marks, mark, .. } = self;
        let rejects = |fan: &Fan, found: Conflict, other: u32| {
            let reason = match found {
                Conflict::Same => return Some(Rejection::Topology),
                Conflict::Folded => Rejection::Fold,
                Conflict::Meeting => Rejection::Crossing,
            };
            let former = complex.patch(fan.face);
            let [a, b, c] = former.at;
            let known = conflict(&former, &complex.patch(other), steepest((b - a).cross(c - a)));
            (known != Some(found)).then_some(reason)
        };
        let ends = dying.iter().map(|&f| boxes.get(f));
        let spans = fans.iter().map(|fan| fan.span).chain(ends);
        let whole = spans.reduce(|mut whole, span| {
            whole.join(&span);
            whole
        });
        near.clear();
        whole.iter().for_each(|whole| boxes.near(whole, near));
        let view = View::along(fans.iter().map(|fan| fan.normal).sum());
        let mut open = !*whole_round;
        flats.clear();
        for fan in fans.iter() {
            let seen = fan.patch.at.map(|p| view.flat(p));
            open |= !view.sees(fan.normal) || turn(seen[0], seen[1], seen[2]) != 1;
            flats.push(seen);
        }
        // Faces that are all seen from above do not meet where they go round their point once.
        let clear =
            !open && flats.iter().filter(|[o, p, q]| p[1] <= o[1] && o[1] < q[1]).count() == 1;
        *seen_from = clear.then_some(view);
        if !clear {
            for (i, fan) in fans.iter().enumerate() {
                for other in &fans[..i] {
                    let found = conflict(&fan.patch, &other.patch, steepest(fan.normal));
                    if let Some(reason) = found.and_then(|c| rejects(fan, c, other.face)) {
                        return Err(reason);
                    }
                }
            }
        }
        for &face in near.iter() {
            if marks[face as usize] == *mark {
                continue;
            }
            let span = boxes.get(face);
            let mut other = None;
            for (fan, seen) in fans.iter().zip(flats.iter()) {
                if !fan.span.overlaps(&span) {
                    continue;
                }
                let (other, from_above) = other.get_or_insert_with(|| {
                    let patch = complex.patch(face);
                    (patch, patch.at.map(|p| view.flat(p)))
                });
                if !open && is_beyond(fan, seen, other, from_above, &view) {
                    continue;
                }
                let found = conflict(&fan.patch, other, steepest(fan.normal));
                if let Some(reason) = found.and_then(|c| rejects(fan, c, face)) {
                    return Err(reason);
                }
            }
        }
        Ok(())
    }

    /// The largest difference in height between the old faces and the new ones; `None` where either
    /// are not one graph over their place.
    pub fn rise(&self, complex: &Complex) -> Option<f64> {
        let view = self.view?;
        let before: Vec<Patch> = self.old().map(|f| complex.patch(f)).collect();
        let ring = |p: &u32| self.fans.iter().any(|f| f.patch.corners[1..].contains(p));
        let mut most = 0.0f64;
        let mut see = |height: Option<f64>| {
            height.is_some_and(|h| {
                most = most.max(h.abs());
                true
            })
        };
        for old in &before {
            let [a, b, c] = old.at;
            if !view.sees((b - a).cross(c - a)) {
                return None;
            }
            for i in 0..3 {
                let inner = old.corners[i];
                if ring(&inner) {
                    continue;
                }
                // Each inner point of the old star, and each of its inner edges against those of the new.
                let over = self.fans.iter().find_map(|f| view.height(&f.patch.at, old.at[i]));
                if !see(over) {
                    return None;
                }
                for k in [1, 2] {
                    let (end, to) = (old.corners[(i + k) % 3], old.at[(i + k) % 3]);
                    for fan in &self.fans {
                        if fan.patch.corners[1] != end
                            && let Some(gap) =
                                view.gap([old.at[i], to], [fan.patch.at[0], fan.patch.at[1]])
                        {
                            see(Some(gap));
                        }
                    }
                }
            }
        }
        let place = self.fans.first()?.patch.at[0];
        let over = before.iter().find_map(|old| view.height(&old.at, place));
        see(over).then_some(most)
    }
}

/// Whether the line of a side of a fan that is seen from above has all of another face strictly on
/// its outer side, but for points that they share.
fn is_beyond(
    fan: &Fan,
    seen: &[Flat; 3],
    other: &Patch,
    from_above: &[Flat; 3],
    view: &View,
) -> bool {
    [1, 0, 2].into_iter().any(|i| {
        let j = (i + 1) % 3;
        let [p, q] = [fan.patch.corners[i], fan.patch.corners[j]];
        let mut shared = 0;
        let beyond = (0..3).all(|k| {
            let corner = other.corners[k];
            if corner == p || corner == q {
                shared += 1;
                return true;
            }
            turn(seen[i], seen[j], from_above[k]) < 0
        });
        beyond
            && (shared < 2 || {
                let [a, b, c] = other.at;
                view.sees((b - a).cross(c - a))
            })
    })
}

fn longest_squared([a, b, c]: [DVec3; 3]) -> f64 {
    a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a))
}
