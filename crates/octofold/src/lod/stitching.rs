//! Marching cubes on the octants of a cut, and its cracks stitched or filled: the method that
//! multi-scale patches are measured against.
//!
//! Stitching goes over the faces between octants of different levels, the largest first. A vertex of
//! the smaller octants on an edge of the larger one goes to that edge's vertex, one within the face to
//! the nearest point of the larger one's segments there, with its normal. What it cannot close: faces
//! on which the larger octant has no segment, or two; edges of which only the halves are crossed.
//! Source: specification of LOD, A.7 (He et al. 1996, Shu et al. 1995).

use super::cracks::{Cracks, on_face, quarter};
use super::cubes::{CELLS, Cubes};
use super::cut::{Cut, NONE};
use super::direction;
use super::patches::neighbours_of;
use super::tree::Lod;
use crate::mesh::Mesh;
use glam::{DVec3, Vec3};

/// What becomes of the cracks between octants of different levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Seams {
    /// Nothing.
    Open,
    /// Vertices of the smaller octants move onto the larger ones' segments.
    Stitched,
    /// Polygons of the same shape fill them: closed for every closed surface and any cut.
    Filled,
}

/// Marching cubes on the octants of a cut. Vertices are those of [`Cubes`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Marched {
    /// Triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// The first triangle of each patch: of each loop in an octant, and of each filled crack.
    pub patches: Vec<u32>,
    /// Patches that fill cracks; they come last.
    pub fillings: u64,
    /// Faces between octants of different levels.
    pub mixed_faces: u64,
    /// Times that a vertex was moved.
    pub moves: u64,
    /// Times that a vertex had nowhere to go.
    pub stays: u64,
    /// Octants that were left out: the surface is not closed there.
    pub undecided: u64,
}

/// What lies open between the octants of a cut.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Gaps {
    /// Cracks that one can see through.
    pub count: u64,
    /// Their area, in the squares of finest cells.
    pub area: f64,
    /// The largest.
    pub largest: f64,
}

/// Cracks of no more area, in the squares of finest cells, are shut but for rounding.
const SHUT: f64 = 1e-3;

/// Marching cubes again and again, frame after frame, in the same memory and on one thread.
#[derive(Debug, Clone)]
pub struct Marching<'a> {
    lod: &'a Lod,
    cubes: &'a Cubes,
    neighbours: Vec<[u32; 6]>,
    places: Vec<[f32; 3]>,
    normals: Vec<[u8; 2]>,
    /// Vertices that are not where they were found.
    moved: Vec<u32>,
    marched: Marched,
}

impl<'a> Marching<'a> {
    /// Ready for cuts of `lod`, which `cubes` were made with.
    pub fn new(lod: &'a Lod, cubes: &'a Cubes) -> Self {
        Self {
            lod,
            cubes,
            neighbours: Vec::new(),
            places: cubes.places.clone(),
            normals: cubes.normals.clone(),
            moved: Vec::new(),
            marched: Marched::default(),
        }
    }

    /// Marching cubes on the octants of a cut.
    pub fn make(&mut self, cut: &Cut, seams: Seams) -> &Marched {
        for vertex in self.moved.drain(..) {
            self.places[vertex as usize] = self.cubes.places[vertex as usize];
            self.normals[vertex as usize] = self.cubes.normals[vertex as usize];
        }
        let Marched { mut triangles, mut patches, .. } = std::mem::take(&mut self.marched);
        triangles.clear();
        patches.clear();
        self.marched = Marched { triangles, patches, ..Marched::default() };
        self.march(cut);
        match seams {
            Seams::Open => {}
            Seams::Stitched => {
                neighbours_of(cut, &mut self.neighbours);
                self.stitch(cut);
            }
            Seams::Filled => {
                neighbours_of(cut, &mut self.neighbours);
                self.fill(cut);
            }
        }
        &self.marched
    }

    fn march(&mut self, cut: &Cut) {
        let (cells, nodes) = (&*CELLS, self.lod.nodes());
        let Marched { triangles, patches, undecided, .. } = &mut self.marched;
        for entry in cut.entries.iter().filter(|e| e.first == NONE) {
            let node = nodes[entry.node as usize];
            let Some(piece) = cells.piece(node) else {
                *undecided += u64::from(node.odd() != 0);
                continue;
            };
            let own = self.cubes.vertices(entry.node);
            let first = triangles.len() as u32;
            patches.extend(piece.loops.iter().map(|&l| first + u32::from(l)));
            triangles.extend(piece.triangles.iter().map(|t| t.map(|v| own[v as usize])));
        }
    }

    /// Visits the faces between octants of the cut and divided ones of their size, the largest first.
    fn mixed_faces(cut: &Cut, neighbours: &[[u32; 6]], mut visit: impl FnMut(u32, usize, u32)) {
        for level in cut.starts.windows(2) {
            for place in (level[0]..level[1]).filter(|&place| cut.is_front(place)) {
                for (way, &beside) in neighbours[place as usize].iter().enumerate() {
                    if beside != NONE && beside >= level[0] && !cut.is_front(beside) {
                        visit(place, way, beside);
                    }
                }
            }
        }
    }

    fn stitch(&mut self, cut: &Cut) {
        let cracks = Cracks { lod: self.lod, cubes: self.cubes, cut };
        let Self { neighbours, places, normals, moved, marched, .. } = self;
        let mut smaller = Vec::new();
        Self::mixed_faces(cut, neighbours, |place, way, beside| {
            marched.mixed_faces += 1;
            let node = cut.entries[place as usize].node;
            let own = cracks.lod.nodes()[node as usize];
            if own.odd() != 0 && CELLS.piece(own).is_none() {
                return;
            }
            let mut ends = cracks.segments(node, way);
            let ends = [ends.next(), ends.next()];
            let face = Face { way: way ^ 1, ends, edges: cracks.crossings(node, way) };
            smaller.push((beside, 0b1111u8));
            while let Some((divided, touching)) = smaller.pop() {
                for (u, v) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let child = cracks.child(divided, quarter(face.way, u, v));
                    if child == NONE {
                        continue;
                    }
                    let touching = touching & (1 << u | 4 << v);
                    if !cut.is_front(child) {
                        smaller.push((child, touching));
                        continue;
                    }
                    let node = cut.entries[child as usize].node;
                    for (side, edge) in on_face(face.way).into_iter().enumerate() {
                        let Some(vertex) = cracks.cubes.vertex(cracks.lod, node, edge) else {
                            continue;
                        };
                        let home = if touching >> side & 1 == 1 {
                            face.edges[side]
                                .map(|own| (places[own as usize], normals[own as usize]))
                        } else {
                            face.nearest(vertex, places, normals)
                        };
                        let Some((place, normal)) = home else {
                            marched.stays += 1;
                            continue;
                        };
                        if places[vertex as usize] != place {
                            places[vertex as usize] = place;
                            normals[vertex as usize] = normal;
                            moved.push(vertex);
                            marched.moves += 1;
                        }
                    }
                }
            }
        });
    }

    fn fill(&mut self, cut: &Cut) {
        let cracks = Cracks { lod: self.lod, cubes: self.cubes, cut };
        let Marched { triangles, patches, fillings, mixed_faces, .. } = &mut self.marched;
        Self::mixed_faces(cut, &self.neighbours, |place, way, beside| {
            *mixed_faces += 1;
            cracks.visit(place, way, beside, &mut |outline| {
                *fillings += 1;
                patches.push(triangles.len() as u32);
                let [first, rest @ ..] = outline else { return };
                triangles.extend(rest.windows(2).map(|w| [*first, w[1], w[0]]));
            });
        });
    }

    /// What is open between the octants of the cut that was last made, as its vertices are now.
    pub fn gaps(&mut self, cut: &Cut) -> Gaps {
        neighbours_of(cut, &mut self.neighbours);
        let cracks = Cracks { lod: self.lod, cubes: self.cubes, cut };
        let mut gaps = Gaps::default();
        Self::mixed_faces(cut, &self.neighbours, |place, way, beside| {
            cracks.visit(place, way, beside, &mut |outline| {
                let area = self.area(outline);
                if area > SHUT {
                    gaps.count += 1;
                    gaps.area += area;
                    gaps.largest = gaps.largest.max(area);
                }
            });
        });
        gaps
    }

    /// The area that an outline's triangles have, in the squares of finest cells.
    fn area(&self, outline: &[u32]) -> f64 {
        let at = |v: u32| Vec3::from(self.places[v as usize]).as_dvec3();
        let [first, rest @ ..] = outline else { return 0.0 };
        let first = at(*first);
        let of = |w: &[u32]| (at(w[0]) - first).cross(at(w[1]) - first).length() / 2.0;
        rest.windows(2).map(of).sum()
    }

    /// The mesh that was last made, in the world, with normals.
    pub fn mesh(&self) -> Mesh {
        let mut numbers = vec![NONE; self.places.len()];
        let mut mesh = Mesh { unit: self.lod.frame().unit, ..Mesh::default() };
        let mut normals = Vec::new();
        for triangle in &self.marched.triangles {
            mesh.triangles.push(triangle.map(|vertex| {
                let number = &mut numbers[vertex as usize];
                if *number == NONE {
                    *number = mesh.points.len() as u32;
                    let place = Vec3::from(self.places[vertex as usize]).as_dvec3();
                    mesh.points.push(self.lod.world(place));
                    let normal = direction::unpacked(self.normals[vertex as usize]);
                    normals.push(normal.as_vec3().to_array());
                }
                *number
            }));
        }
        mesh.attributes.point_normals = Some(normals);
        mesh
    }
}

/// A face of a larger octant as smaller ones see it.
struct Face {
    /// The side on which the smaller ones have it.
    way: usize,
    /// Ends of the larger one's segments.
    ends: [Option<[u32; 2]>; 2],
    /// Vertices on its edges.
    edges: [Option<u32>; 4],
}

impl Face {
    /// The nearest point of the segments, and the normal there.
    fn nearest(
        &self,
        vertex: u32,
        places: &[[f32; 3]],
        normals: &[[u8; 2]],
    ) -> Option<([f32; 3], [u8; 2])> {
        let at = |v: u32| Vec3::from(places[v as usize]).as_dvec3();
        let from = at(vertex);
        let on = |&[a, b]: &[u32; 2]| {
            let (start, way) = (at(a), at(b) - at(a));
            let whole = way.length_squared();
            let share = if whole > 0.0 { (from - start).dot(way) / whole } else { 0.0 };
            let share = share.clamp(0.0, 1.0);
            (start + way * share, share, [a, b])
        };
        let near = |p: &(DVec3, f64, [u32; 2]), q: &(DVec3, f64, [u32; 2])| {
            p.0.distance_squared(from).total_cmp(&q.0.distance_squared(from))
        };
        let (place, share, ends) = self.ends.iter().flatten().map(on).min_by(near)?;
        let [first, second] = ends.map(|v| direction::unpacked(normals[v as usize]));
        Some((place.as_vec3().to_array(), direction::packed(first.lerp(second, share))))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{passes_of, random_cut, thin};
    use super::super::{BuildOptions, Criterion, build_with_cubes};
    use super::*;
    use crate::measure::{Nearest, Topology};
    use crate::run::Run;
    use crate::samples::Sample;
    use crate::sweep::cases;
    use proptest::prelude::*;

    static CLOSED: std::sync::LazyLock<Vec<(Mesh, Lod, Cubes)>> = std::sync::LazyLock::new(|| {
        let meshes = [
            Sample::Torus.polygons(40).unwrap().triangulate(),
            Sample::Cone.polygons(30).unwrap().triangulate(),
            Sample::Tetrahedron.polygons(3).unwrap().triangulate(),
            thin(),
        ];
        let options = BuildOptions { level: 7, ..BuildOptions::default() };
        let built = |mesh: Mesh| {
            let (lod, cubes) = build_with_cubes(&mesh, &options, &Run::default()).unwrap();
            (mesh, lod, cubes)
        };
        meshes.map(built).into()
    });

    /// Mixed faces on which the larger octant has one segment and no vertex stays behind.
    fn sound_faces(marching: &Marching<'_>, cut: &Cut) -> Vec<(u32, usize, u32)> {
        let cracks = Cracks { lod: marching.lod, cubes: marching.cubes, cut };
        let mut sound = Vec::new();
        Marching::mixed_faces(cut, &marching.neighbours, |place, way, beside| {
            let node = cut.entries[place as usize].node;
            let edges = cracks.crossings(node, way);
            let mut below = vec![(beside, 0b1111u8)];
            let mut fits = cracks.segments(node, way).count() == 1;
            while let Some((divided, touching)) = below.pop() {
                for (u, v) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let child = cracks.child(divided, quarter(way ^ 1, u, v));
                    if child == NONE {
                        continue;
                    }
                    let touching = touching & (1 << u | 4 << v);
                    let own = cracks.crossings(cut.entries[child as usize].node, way ^ 1);
                    fits &= (0..4).all(|side| {
                        own[side].is_none() || touching >> side & 1 == 0 || edges[side].is_some()
                    });
                    if !cut.is_front(child) {
                        below.push((child, touching));
                    }
                }
            }
            if fits {
                sound.push((place, way, beside));
            }
        });
        sound
    }

    #[test]
    fn uniform_cuts_are_closed_manifolds_through_the_crossings() {
        for (mesh, lod, cubes) in CLOSED.iter() {
            for level in 3..=7 {
                let cut = Cut::by(lod, |o| o.level >= level);
                let mut marching = Marching::new(lod, cubes);
                let even = cut.census().iter().filter(|&&n| n > 0).count() == 1;
                let marched = marching.make(&cut, if even { Seams::Open } else { Seams::Filled });
                assert_eq!(marched.undecided, 0);
                let made = marching.mesh();
                let topology =
                    Topology::of(made.points.len(), &made.triangles, &Run::default()).unwrap();
                assert!(topology.is_oriented());
                if even {
                    assert!(topology.is_closed());
                    assert_eq!(topology.nonmanifold_edges.count, 0);
                }
                let nearest = Nearest::new(mesh);
                for &point in made.points.iter().step_by(7) {
                    let off = nearest.nearest(point).unwrap().distance_squared.sqrt();
                    assert!(off < 0.02 * lod.stretch(), "{off}");
                }
            }
        }
    }

    proptest! {
        #![proptest_config(cases(24))]

        #[test]
        fn filled_cuts_are_closed(which in 0usize..4, seed: u64, least in 2u32..5) {
            let (_, lod, cubes) = &CLOSED[which];
            let cut = random_cut(lod, seed, least);
            let mut marching = Marching::new(lod, cubes);
            let marched = marching.make(&cut, Seams::Filled);
            prop_assert!(marched.mixed_faces > 0 && marched.fillings > 0);
            for (edge, (net, times)) in passes_of(marched.triangles.iter().map(|t| t.to_vec())) {
                prop_assert!(net == 0 && times % 2 == 0, "{edge:?}: {times} times, net {net}");
            }
        }

        /// Where smaller octants cross a face as the larger one does, nothing stays open.
        #[test]
        fn stitched_faces_are_shut(which in 0usize..4, seed: u64, least in 2u32..5) {
            let (_, lod, cubes) = &CLOSED[which];
            let cut = random_cut(lod, seed, least);
            let mut marching = Marching::new(lod, cubes);
            marching.make(&cut, Seams::Open);
            let before = marching.gaps(&cut);
            let moves = marching.make(&cut, Seams::Stitched).moves;
            let after = marching.gaps(&cut);
            prop_assert!(moves > 0 && after.area < before.area && after.count < before.count);
            let sound = sound_faces(&marching, &cut);
            prop_assert!(!sound.is_empty());
            let cracks = Cracks { lod, cubes, cut: &cut };
            for (place, way, beside) in sound {
                let mut worst = 0f64;
                cracks.visit(place, way, beside, &mut |outline| {
                    worst = worst.max(marching.area(outline));
                });
                prop_assert!(worst <= SHUT, "{worst}");
            }
        }
    }

    #[test]
    fn frames_do_not_remember_those_before() {
        let (_, lod, cubes) = &CLOSED[0];
        let mut marching = Marching::new(lod, cubes);
        let fine = Cut::select(lod, &Criterion::Level(7), &Run::default()).unwrap();
        let plain = marching.make(&fine, Seams::Open).clone();
        let mesh = marching.mesh();
        for seams in [Seams::Stitched, Seams::Filled] {
            marching.make(&random_cut(lod, 5, 2), seams);
        }
        assert_eq!(marching.make(&fine, Seams::Open), &plain);
        assert_eq!(marching.mesh(), mesh);
    }
}
