//! The boundary of a solid's voxels, as it is: polygons with holes, and their triangles.
//!
//! Exposed faces of one plane that share sides are one polygon, with an outer loop and inner ones
//! (`outlines`). Of the corners of the grid those are vertices at which a loop turns, and as many times
//! as fans of faces meet there (`fans`); a vertex on a straight side of another loop is a vertex of that as
//! well, so nothing is joined by distance. Polygons are cut into triangles on their own vertices
//! (`ears`). The mesh encloses exactly the volume of the voxels, and is closed, oriented and 2-manifold
//! for every solid: voxels that touch along an edge or at a corner only are parted, by vertices at the same
//! place. Where both sheets of such an edge end in the same two vertices, one takes a vertex more in its
//! middle. Work and memory are those of the surface, and no grid is made. Source: specification (A8, A9, A11).

mod ears;
mod fans;
mod outlines;

use super::painted::Painted;
use super::{Network, Stretch};
use crate::mesh::Mesh;
use crate::par;
use crate::payload::Value;
use crate::run::{Cancelled, Run};
use ears::Ears;
use fans::Face;
use outlines::{Outline, Strip, TILE, WAYS, outlines};

/// A corner of voxels, as x, y and z.
type Corner = [u32; 3];

/// The axes along and across the lines of a direction.
const AXES: [[usize; 2]; 3] = [[1, 2], [0, 2], [0, 1]];

/// Polygons, or corners, that one unit of work takes.
const BLOCK: usize = 512;

/// The boundary of a solid as polygons with holes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Polygons {
    /// Vertices in half voxels, each axis beginning where its first voxel does.
    pub vertices: Vec<[u32; 3]>,
    /// The polygons.
    pub polygons: Vec<Polygon>,
}

/// Faces in a plane that share sides.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Polygon {
    /// Where its faces look: axis `d / 2`, downwards where `d` is even.
    pub direction: u8,
    /// What its faces have in common.
    pub class: u32,
    /// Loops of vertices with the polygon on the left, seen so that the two other axes, in their order,
    /// run right and up: the outer one, then those of holes.
    pub loops: Vec<Vec<u32>>,
}

/// The boundary in world coordinates.
pub fn boundary(network: &Network, run: &Run) -> Result<Mesh, Cancelled> {
    let polygons = polygons(network, None, run)?;
    Ok(polygons.triangles(network, run)?.0)
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
        let polygons = polygons(self.network(), Some(&classes), run)?;
        let (mut mesh, faces) = polygons.triangles(self.network(), run)?;
        let of = |&class: &u32| all[class as usize];
        let kinds = self.payload().kinds();
        mesh.attributes.face_labels =
            kinds.labels.then(|| faces.iter().map(|c| of(c).label).collect());
        mesh.attributes.face_colours =
            kinds.colours.then(|| faces.iter().map(|c| of(c).colour).collect());
        Ok(mesh)
    }
}

/// The boundary as polygons, whose faces are of nodes of one class; `classes` has one for each node.
pub fn polygons(
    network: &Network,
    classes: Option<&[u32]>,
    run: &Run,
) -> Result<Polygons, Cancelled> {
    run.stage("outlines");
    let strips = strips(network, classes);
    let planes: Vec<&[Strip]> =
        strips.chunk_by(|a, b| (a.direction, a.plane) == (b.direction, b.plane)).collect();
    let found = par::blocks(run, planes.len(), 1, |range| {
        let plane = |strips: &[Strip]| {
            let mut strips = strips.to_vec();
            let found = outlines(&mut strips);
            (strips, found)
        };
        planes[range].iter().map(|p| plane(p)).collect::<Vec<_>>()
    })?;
    let (strips, outlines): (Vec<_>, Vec<_>) = found.into_iter().flatten().unzip();
    let (strips, outlines) = (strips.concat(), outlines.concat());
    run.stage("corners");
    let corners = Corners::new(network, &strips, &outlines, classes.is_some(), run)?;
    let mut polygons = Polygons { vertices: corners.vertices(), polygons: Vec::new() };
    let parts = par::blocks(run, outlines.len(), BLOCK, |range| {
        outlines[range].iter().map(|o| corners.polygon(o)).collect::<Vec<_>>()
    })?;
    let (found, sides): (Vec<_>, Vec<_>) = parts.into_iter().flatten().unzip();
    polygons.polygons = found;
    polygons.part_sides(sides);
    Ok(polygons)
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
            strips.push(Strip { direction, plane, line, start, end, class, tiled: false });
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
    par::sort(&mut strips);
    strips.dedup_by(|next, last| {
        let place = |s: &Strip| (s.direction, s.plane, s.line, s.class);
        let goes_on = place(next) == place(last) && next.start == last.end;
        if goes_on {
            last.end = next.end;
        }
        goes_on
    });
    strips
}

/// Where a corner of a plane lies.
fn corner(outline: &Outline, [along, across]: [u32; 2]) -> Corner {
    let axis = outline.direction as usize / 2;
    let mut at = [0; 3];
    at[axis] = outline.plane + u32::from(outline.direction % 2);
    (at[AXES[axis][0]], at[AXES[axis][1]]) = (along, across);
    at
}

/// The face on the left of a way from a corner on; it is there whether the way turned or not.
fn left_of(direction: u8, way: u8) -> Face {
    let axis = direction as usize / 2;
    let [along, across] = AXES[axis];
    let octant = u8::from(direction.is_multiple_of(2)) << axis
        | u8::from(matches!(way, 0 | 3)) << along
        | u8::from(matches!(way, 0 | 1)) << across;
    Face { octant, axis: axis as u8 }
}

/// A side of a polygon: its two vertices, the lower number first; the octant of its voxel at the lower end;
/// and the loop and the place in it.
type Side = ([u32; 2], u8, [u32; 2]);

/// The corners of the grid at which loops turn.
struct Corners {
    list: Vec<Corner>,
    filled: Vec<u8>,
    /// Vertices of fans.
    numbers: Vec<[u32; 4]>,
    lines: [Vec<Line>; 3],
}

/// Stands for a fan without a vertex.
const NONE: u32 = u32::MAX;

impl Corners {
    fn new(
        network: &Network,
        strips: &[Strip],
        outlines: &[Outline],
        classed: bool,
        run: &Run,
    ) -> Result<Self, Cancelled> {
        let turns = |o: &Outline| {
            let turns = o.loops.iter().flatten();
            turns.map(|&(at, _)| corner(o, at)).collect::<Vec<_>>()
        };
        let mut list: Vec<Corner> = outlines.iter().flat_map(turns).collect();
        par::sort(&mut list);
        list.dedup();
        let has_tiles = strips.iter().any(|s| s.tiled);
        let parts = par::blocks(run, list.len(), BLOCK, |range| {
            let of = |&at: &Corner| {
                let filled = filled(network, at);
                let needed = fans::vertices(filled, |from, to| {
                    let aside = (from.octant ^ to.octant).trailing_zeros() as usize;
                    let border = has_tiles && at[aside].is_multiple_of(TILE);
                    (classed || border) && {
                        let [from, to] = [from, to].map(|face| strip_of(strips, at, face));
                        from.class != to.class || border && from.tiled
                    }
                });
                (filled, needed)
            };
            list[range].iter().map(of).collect::<Vec<_>>()
        })?;
        let (filled, needed): (Vec<u8>, Vec<u8>) = parts.into_iter().flatten().unzip();
        let mut next = 0;
        let number = |fans: &u8| {
            std::array::from_fn(|fan| {
                let is = fans >> fan & 1 == 1;
                next += u32::from(is);
                if is { next - 1 } else { NONE }
            })
        };
        let numbers = needed.iter().map(number).collect();
        let lines = [0, 1, 2].map(|axis| Line::all(&list, axis));
        Ok(Self { list, filled, numbers, lines })
    }

    /// All vertices, in half voxels.
    fn vertices(&self) -> Vec<[u32; 3]> {
        let of = |(at, fans): (&Corner, &[u32; 4])| {
            let count = fans.iter().filter(|&&n| n != NONE).count();
            std::iter::repeat_n(at.map(|i| 2 * i), count)
        };
        self.list.iter().zip(&self.numbers).flat_map(of).collect()
    }

    /// The polygon of an outline, and its sides.
    fn polygon(&self, outline: &Outline) -> (Polygon, Vec<Side>) {
        let Outline { direction, class, .. } = *outline;
        let axes = AXES[direction as usize / 2];
        let mut sides = Vec::new();
        let mut loops = Vec::new();
        for turns in &outline.loops {
            let mut own: Vec<(u32, u8)> = Vec::new();
            for (i, &(at, way)) in turns.iter().enumerate() {
                let to = turns[(i + 1) % turns.len()].0;
                let axis = axes[way as usize % 2];
                let ends = [at, to].map(|p| corner(outline, p));
                let on = Line::between(&self.lines[axis], axis, ends[0], ends[1]);
                let face = left_of(direction, way);
                let mut add = |line: &Line| {
                    let corner = line.number as usize;
                    let fan = fans::fan_of(self.filled[corner], face);
                    let vertex = self.numbers[corner].get(fan as usize).copied().unwrap_or(NONE);
                    if vertex != NONE {
                        own.push((vertex, way));
                    }
                };
                // The last is the next side's first.
                if WAYS[way as usize].iter().sum::<i64>() > 0 {
                    on[..on.len() - 1].iter().for_each(&mut add);
                } else {
                    on[1..].iter().rev().for_each(&mut add);
                }
            }
            for (i, &(from, way)) in own.iter().enumerate() {
                let to = own[(i + 1) % own.len()].0;
                // Seen from its lower end the voxel lies the other way.
                let octant = left_of(direction, way).octant | 1 << axes[way as usize % 2];
                let place = [loops.len() as u32, i as u32];
                sides.push(([from.min(to), from.max(to)], octant, place));
            }
            loops.push(own.iter().map(|v| v.0).collect());
        }
        (Polygon { direction, class, loops }, sides)
    }
}

/// The voxels round a corner that are filled.
fn filled(network: &Network, at: Corner) -> u8 {
    let voxel = |octant: u8| {
        let mut voxel = at;
        for a in 0..3 {
            if octant >> a & 1 == 0 {
                voxel[a] = voxel[a].checked_sub(1)?;
            }
        }
        Some(voxel)
    };
    let is = |octant: &u8| voxel(*octant).is_some_and(|v| network.contains(v));
    (0..8).filter(is).map(|octant| 1 << octant).sum()
}

/// The strip that an exposed face at a corner is of.
fn strip_of(strips: &[Strip], at: Corner, face: Face) -> &Strip {
    let axis = face.axis as usize;
    let high = |a: usize| u32::from(face.octant >> a & 1);
    let place = |a: usize| at[a] + high(a) - 1;
    let key = (2 * face.axis + u8::from(high(axis) == 0), place(axis), place(AXES[axis][1]));
    let along = place(AXES[axis][0]);
    let after =
        strips.partition_point(|s| ((s.direction, s.plane, s.line), s.start) <= (key, along));
    &strips[after - 1]
}

impl Polygons {
    /// Parts sides that end in the same two vertices, though they are of two sheets that touch.
    fn part_sides(&mut self, sides: Vec<Vec<Side>>) {
        let numbered = |(polygon, sides): (usize, Vec<Side>)| {
            sides
                .into_iter()
                .map(move |(ends, octant, [l, i])| (ends, octant, [polygon as u32, l, i]))
        };
        let mut all: Vec<_> = sides.into_iter().enumerate().flat_map(numbered).collect();
        par::sort(&mut all);
        let mut added = Vec::new();
        for same in all.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() > 2) {
            for sheet in same.chunk_by(|a, b| a.1 == b.1).skip(1) {
                let number = self.vertices.len() as u32;
                let [a, b] = sheet[0].0.map(|v| self.vertices[v as usize]);
                self.vertices.push(std::array::from_fn(|i| a[i].midpoint(b[i])));
                added.extend(sheet.iter().map(|side| (side.2, number)));
            }
        }
        // The last first, so that places in front of it stay.
        added.sort_unstable();
        for ([polygon, l, i], number) in added.into_iter().rev() {
            self.polygons[polygon as usize].loops[l as usize].insert(i as usize + 1, number);
        }
    }

    /// The polygons as triangles in world coordinates, and the class of each.
    fn triangles(&self, network: &Network, run: &Run) -> Result<(Mesh, Vec<u32>), Cancelled> {
        run.stage("triangles");
        let placement = network.placement;
        let turned = placement.determinant() < 0.0;
        let parts = par::blocks(run, self.polygons.len(), BLOCK, |range| {
            let mut ears = Ears::default();
            let (mut triangles, mut classes) = (Vec::new(), Vec::new());
            for polygon in &self.polygons[range] {
                let axis = polygon.direction as usize / 2;
                // Along and across make a right-handed frame with x and z, and a left-handed one with y.
                let outwards = (polygon.direction % 2 == 1) != (axis == 1);
                let place = |v: u32| AXES[axis].map(|a| i64::from(self.vertices[v as usize][a]));
                ears.cut(&polygon.loops, place, |[a, b, c]| {
                    triangles.push(if outwards != turned { [a, b, c] } else { [a, c, b] });
                    classes.push(polygon.class);
                });
            }
            (triangles, classes)
        })?;
        let (triangles, classes): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
        let place = |v: &[u32; 3]| placement.place(v.map(|i| f64::from(i) / 2.0 - 0.5));
        let mesh = Mesh {
            points: self.vertices.iter().map(place).collect(),
            triangles: triangles.concat(),
            unit: placement.unit,
            ..Mesh::default()
        };
        Ok((mesh, classes.concat()))
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

#[cfg(test)]
mod tests {
    use super::super::tests::{noise, solid};
    use super::*;
    use crate::spans::Spans;
    use crate::volume::Placement;
    use proptest::prelude::*;

    /// Closed, oriented, 2-manifold, and of exactly the volume and the faces of the voxels.
    fn claims(solid: &Spans) -> Result<(), TestCaseError> {
        let network = Network::new(solid, &Run::default()).unwrap();
        let mesh = boundary(&network, &Run::default()).unwrap();
        prop_assert!(mesh.check().is_ok());
        let mut edges: Vec<[u32; 2]> = Vec::new();
        let (mut volume, mut area) = (0.0, 0.0);
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|p| glam::DVec3::from(mesh.points[p as usize]));
            let normal = (b - a).cross(c - a);
            // Sides are whole, but for those that were halved.
            prop_assert!(normal.length() > 0.2);
            volume += a.dot(normal) / 6.0;
            area += normal.length() / 2.0;
            edges.extend([[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
        }
        let mut back: Vec<[u32; 2]> = edges.iter().map(|&[a, b]| [b, a]).collect();
        edges.sort_unstable();
        back.sort_unstable();
        // Every edge is run along once each way, and the faces at a vertex are one fan.
        prop_assert!(edges.windows(2).all(|e| e[0] != e[1]));
        prop_assert_eq!(edges, back);
        prop_assert_eq!(fans(&mesh), mesh.points.len());
        prop_assert!((volume - solid.count() as f64).abs() < 1e-6, "{} {}", volume, solid.count());
        prop_assert!((area - network.faces() as f64).abs() < 1e-6);
        Ok(())
    }

    #[test]
    fn regions_with_many_corners_are_cut_and_fit() {
        for (seed, dims) in [(1, [70, 66, 3]), (2, [5, 90, 70]), (3, [65, 4, 65])] {
            let solid = noise(dims, seed, 1, 70);
            let network = Network::new(&solid, &Run::default()).unwrap();
            let found = strips(&network, None);
            assert!(found.iter().all(|s| !s.tiled));
            let mut plane: Vec<Strip> = found
                .chunk_by(|a, b| (a.direction, a.plane) == (b.direction, b.plane))
                .max_by_key(|plane| plane.len())
                .unwrap()
                .to_vec();
            outlines(&mut plane);
            assert!(plane.iter().any(|s| s.tiled));
            claims(&solid).unwrap();
        }
    }

    /// How many fans of triangles there are, over all points.
    fn fans(mesh: &Mesh) -> usize {
        // Corners of triangles, joined across the edges that they share.
        let mut sets = crate::sets::Sets::singles(3 * mesh.triangles.len());
        let mut edges = Vec::new();
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            for i in 0..3 {
                let [a, b] = [i, (i + 1) % 3];
                let ends = [(triangle[a], 3 * t + a), (triangle[b], 3 * t + b)];
                let low = usize::from(ends[1] < ends[0]);
                edges.push(([ends[low].0, ends[1 - low].0], ends[low].1, ends[1 - low].1));
            }
        }
        edges.sort_unstable();
        for pair in edges.chunk_by(|a, b| a.0 == b.0) {
            for other in &pair[1..] {
                sets.join(pair[0].1 as u32, other.1 as u32);
                sets.join(pair[0].2 as u32, other.2 as u32);
            }
        }
        (0..3 * mesh.triangles.len() as u32).filter(|&c| sets.root(c) == c).count()
    }

    #[test]
    fn a_box_has_twelve_triangles_and_a_frame_its_holes() {
        let run = Run::default();
        let count = |solid: &Spans| {
            let network = Network::new(solid, &run).unwrap();
            let found = polygons(&network, None, &run).unwrap();
            let holes: usize = found.polygons.iter().map(|p| p.loops.len() - 1).sum();
            let mesh = boundary(&network, &run).unwrap();
            [found.polygons.len(), holes, mesh.points.len(), mesh.triangles.len()]
        };
        let cube = solid([5, 6, 7], |_| true);
        assert_eq!(count(&cube), [6, 0, 8, 12]);
        let frame = solid([9, 9, 3], |at| at[..2].iter().any(|i| !(2..7).contains(i)));
        assert_eq!(count(&frame), [10, 2, 16, 32]);
        // Two voxels that touch along an edge, and two at a corner.
        let edge = solid([2, 2, 1], |[x, y, _]| x == y);
        assert_eq!(count(&edge), [12, 0, 16, 24]);
        let corner = solid([2, 2, 2], |[x, y, z]| x == y && y == z);
        assert_eq!(count(&corner), [12, 0, 16, 24]);
        // Plates that two voxels touching along an edge hold: the edge has one vertex more.
        let held = solid([2, 2, 3], |[x, y, z]| z != 1 || x == y);
        let [_, _, points, triangles] = count(&held);
        assert_eq!((points as i64 - triangles as i64 / 2), 0);
    }

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
            claims(&solid)?;
        }
    }
}
