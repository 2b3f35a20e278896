//! The boundary of a solid's voxels, as it is: every exposed face, joined to rectangles.
//!
//! Exposed faces of one plane become runs, and runs that lie side by side become rectangles. Corners of
//! rectangles that lie on the sides of others are corners of those as well, so the mesh is closed
//! without joining anything by distance; it encloses exactly the volume of the voxels. It is oriented,
//! and 2-manifold except where voxels touch along an edge or at a corner only. Work and memory are those
//! of the surface, and no grid is made. Source: specification (A11, "mesh").

use super::painted::Painted;
use super::{Network, Stretch};
use crate::mesh::Mesh;
use crate::par;
use crate::payload::Value;
use crate::run::{Cancelled, Run};

/// A corner of voxels, as x, y and z.
type Corner = [u32; 3];

/// Exposed faces of one direction and plane, from `start` to `end` along one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Strip {
    direction: u8,
    plane: u32,
    /// Faces of one strip are of one class.
    class: u32,
    start: u32,
    end: u32,
    /// From line to line along the other axis.
    lines: [u32; 2],
}

/// The axes along and across the runs of a direction.
const AXES: [[usize; 2]; 3] = [[1, 2], [0, 2], [0, 1]];

/// The boundary in world coordinates.
pub fn boundary(network: &Network, run: &Run) -> Result<Mesh, Cancelled> {
    Ok(classed(network, None, run)?.0)
}

impl Painted {
    /// The boundary in world coordinates, its faces coloured and labelled by the nodes that they are of.
    pub fn boundary(&self, run: &Run) -> Result<Mesh, Cancelled> {
        let values = self.payload().values();
        let mut all = values.to_vec();
        par::sort(&mut all);
        all.dedup();
        let class = |v: &Value| all.binary_search(v).map_or(0, |at| at as u32);
        let classes: Vec<u32> = values.iter().map(class).collect();
        let (mut mesh, faces) = classed(self.network(), Some(&classes), run)?;
        let of = |&class: &u32| all[class as usize];
        let kinds = self.payload().kinds();
        mesh.attributes.face_labels =
            kinds.labels.then(|| faces.iter().map(|c| of(c).label).collect());
        mesh.attributes.face_colours =
            kinds.colours.then(|| faces.iter().map(|c| of(c).colour).collect());
        Ok(mesh)
    }
}

/// The boundary, in which faces are joined where their nodes are of one class; and the class of each
/// triangle.
fn classed(
    network: &Network,
    classes: Option<&[u32]>,
    run: &Run,
) -> Result<(Mesh, Vec<u32>), Cancelled> {
    run.stage("boundary");
    let mut faces = Vec::new();
    let rectangles = rectangles(strips(network, classes));
    run.check()?;
    let mut corners: Vec<Corner> = rectangles.iter().flat_map(Strip::corners).collect();
    corners.sort_unstable();
    corners.dedup();
    let lines = [0, 1, 2].map(|axis| Line::all(&corners, axis));
    let mut mesh = Mesh { unit: network.placement.unit, ..Mesh::default() };
    let place = |c: &Corner| network.placement.place(c.map(|i| f64::from(i) - 0.5));
    mesh.points = corners.iter().map(place).collect();
    let turned = network.placement.determinant() < 0.0;
    let mut ring = Vec::new();
    for (number, rectangle) in rectangles.iter().enumerate() {
        if number % 65_536 == 0 {
            run.check()?;
        }
        rectangle.ring(&lines, &mut ring);
        let axes = AXES[rectangle.direction as usize / 2];
        clip(&corners, axes, &mut ring, |[a, b, c]| {
            let outwards = rectangle.is_outwards() != turned;
            mesh.triangles.push(if outwards { [a, b, c] } else { [a, c, b] });
            faces.push(rectangle.class);
        });
    }
    Ok((mesh, faces))
}

/// Runs of exposed faces of one class, joined along their lines.
fn strips(network: &Network, classes: Option<&[u32]>) -> Vec<Strip> {
    let mut strips = Vec::new();
    let mut next = 0;
    let mut add = |[y, z]: [u32; 2], s: Stretch, class: u32| {
        for direction in (0..6u8).filter(|d| s.mask >> d & 1 == 1) {
            let (plane, line, [start, end]) = match direction / 2 {
                // A stretch that is exposed along x is one voxel long.
                0 => (s.start, z, [y, y + 1]),
                1 => (y, z, [s.start, s.end]),
                _ => (z, y, [s.start, s.end]),
            };
            strips.push(Strip { direction, plane, class, start, end, lines: [line, line + 1] });
        }
    };
    network.for_each_row(|row, stretches| {
        for s in stretches {
            let Some(classes) = classes else {
                add(row, *s, 0);
                continue;
            };
            let own = &classes[next..][..(s.end - s.start) as usize];
            next += own.len();
            let mut start = s.start;
            for part in own.chunk_by(|a, b| a == b) {
                let end = start + part.len() as u32;
                add(row, Stretch { start, end, mask: s.mask }, part[0]);
                start = end;
            }
        }
    });
    strips.sort_unstable_by_key(|s| (s.direction, s.plane, s.lines, s.start));
    strips.dedup_by(|next, last| {
        let place = |s: &Strip| (s.direction, s.plane, s.lines, s.class);
        let goes_on = place(next) == place(last) && next.start == last.end;
        if goes_on {
            last.end = next.end;
        }
        goes_on
    });
    strips
}

/// Strips side by side, joined.
fn rectangles(mut strips: Vec<Strip>) -> Vec<Strip> {
    strips.sort_unstable();
    strips.dedup_by(|next, last| {
        let place = |s: &Strip| (s.direction, s.plane, s.class, s.start, s.end);
        let goes_on = place(next) == place(last) && next.lines[0] == last.lines[1];
        if goes_on {
            last.lines[1] = next.lines[1];
        }
        goes_on
    });
    strips
}

impl Strip {
    /// Whether its corners run counter-clockwise seen from outside.
    fn is_outwards(&self) -> bool {
        // Along and across make a right-handed frame with x and z, and a left-handed one with y.
        (self.direction % 2 == 1) != (self.direction / 2 == 1)
    }

    /// Its corners, round it.
    fn corners(&self) -> [Corner; 4] {
        let axis = self.direction as usize / 2;
        let [along, across] = AXES[axis];
        let [low, high] = self.lines;
        let ends = [[self.start, low], [self.end, low], [self.end, high], [self.start, high]];
        ends.map(|[i, j]| {
            let mut at = [0; 3];
            at[axis] = self.plane + u32::from(self.direction % 2);
            (at[along], at[across]) = (i, j);
            at
        })
    }

    /// All corners round it, its own and those of others on its sides, by number.
    fn ring(&self, lines: &[Vec<Line>; 3], ring: &mut Vec<u32>) {
        ring.clear();
        let corners = self.corners();
        let [along, across] = AXES[self.direction as usize / 2];
        for (i, axis) in [along, across, along, across].into_iter().enumerate() {
            let (from, to) = (corners[i], corners[(i + 1) % 4]);
            let on = Line::between(&lines[axis], axis, from, to);
            // The last is the next side's first.
            if from[axis] < to[axis] {
                ring.extend(on[..on.len() - 1].iter().map(|l| l.number));
            } else {
                ring.extend(on[1..].iter().rev().map(|l| l.number));
            }
        }
    }
}

/// A corner on a line along some axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Line {
    /// Where the line is, along the other two axes.
    line: [u32; 2],
    at: u32,
    number: u32,
}

impl Line {
    /// All corners, line by line along an axis.
    fn all(corners: &[Corner], axis: usize) -> Vec<Self> {
        let one = |(number, &corner): (usize, &Corner)| Self {
            line: AXES[axis].map(|a| corner[a]),
            at: corner[axis],
            number: number as u32,
        };
        let mut all: Vec<Self> = corners.iter().enumerate().map(one).collect();
        all.sort_unstable();
        all
    }

    /// The corners from one to another on a line along an axis, both among them, in rising order.
    fn between(all: &[Self], axis: usize, from: Corner, to: Corner) -> &[Self] {
        let line = AXES[axis].map(|a| from[a]);
        let (low, high) = (from[axis].min(to[axis]), from[axis].max(to[axis]));
        let first = all.partition_point(|l| (l.line, l.at) < (line, low));
        let end = all.partition_point(|l| (l.line, l.at) <= (line, high));
        &all[first..end]
    }
}

/// Cuts the ring round a rectangle into triangles, none of them flat.
fn clip(corners: &[Corner], axes: [usize; 2], ring: &mut Vec<u32>, mut emit: impl FnMut([u32; 3])) {
    let at = |n: u32| axes.map(|a| i64::from(corners[n as usize][a]));
    let turn = |[a, b, c]: [u32; 3]| {
        let [a, b, c] = [at(a), at(b), at(c)];
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let mut i = 0;
    while ring.len() > 3 {
        let count = ring.len();
        let ear = [0, 1, 2].map(|k| ring[(i + k) % count]);
        // What is left must not be flat: then it has a corner beyond the line of the ear's open side.
        let rest = (3..count).map(|k| ring[(i + k) % count]);
        if turn(ear) != 0 && rest.into_iter().any(|n| turn([ear[0], ear[2], n]) != 0) {
            emit(ear);
            ring.remove((i + 1) % count);
        } else {
            i += 1;
        }
        i %= ring.len();
    }
    if let [a, b, c] = ring[..] {
        emit([a, b, c]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::noise;
    use super::*;
    use crate::volume::Placement;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(crate::sweep::cases(60))]

        #[test]
        fn boundaries_are_closed_and_hold_the_voxels(
            dims in (1usize..14, 1usize..10, 1usize..10),
            seed in any::<u64>(),
            coarse in 1usize..5,
            dense in 5u64..96,
            mirrored in any::<bool>(),
        ) {
            let mut solid = noise([dims.0, dims.1, dims.2], seed, coarse, dense);
            let side = if mirrored { [-1.0, 1.0, 1.0] } else { [1.0; 3] };
            solid.placement = Placement::spacing(side);
            let network = Network::new(&solid, &Run::default()).unwrap();
            let mesh = boundary(&network, &Run::default()).unwrap();
            prop_assert!(mesh.check().is_ok());
            let mut edges: Vec<[u32; 2]> = Vec::new();
            let (mut volume, mut area) = (0.0, 0.0);
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|p| glam::DVec3::from(mesh.points[p as usize]));
                let normal = (b - a).cross(c - a);
                prop_assert!(normal.length() > 0.5);
                volume += a.dot(normal) / 6.0;
                area += normal.length() / 2.0;
                edges.extend([[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
            }
            let mut back: Vec<[u32; 2]> = edges.iter().map(|&[a, b]| [b, a]).collect();
            edges.sort_unstable();
            back.sort_unstable();
            prop_assert_eq!(edges, back);
            prop_assert!((volume - solid.count() as f64).abs() < 1e-6, "{} {}", volume, solid.count());
            prop_assert!((area - network.faces() as f64).abs() < 1e-6);
        }
    }
}
