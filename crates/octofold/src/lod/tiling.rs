//! A model in tiles: octants that are drawn as a whole, each with the octants so many levels below it.
//!
//! A tile shows the patches round its octants of one level, or of the last level where none of them
//! goes deeper. Patches that reach into tiles beside it are drawn in each of these, on the same
//! vertices: tiles of one level fit together exactly, and so do all that have no tiles below them, which
//! are the finest mesh. Tiles of different levels overlap by an octant to both sides. The surface in a
//! tile is no further from its patches than the bounds of its octants tell.
//! Source: specification of LOD, D.2 "3D Tiles mapping".

use super::cut::{Criterion, Cut, NONE, Octant};
use super::drawn::{Diagonal, meshed};
use super::patches::{Mode, Patch, patches};
use super::sheets::Sheets;
use super::tree::Lod;
use super::{LodError, MOST_LEVELS};
use crate::attributes::PointColumn;
use crate::mesh::Mesh;
use crate::par;
use crate::run::Run;

/// Tiles that are drawn before what they show is handed on.
const BATCH: usize = 128;

/// Colours that differ by no more in any channel count as the same.
const SAME_COLOUR: u8 = 8;

/// One tile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tile {
    /// Its octant's node.
    pub node: u32,
    /// Its octant's level.
    pub level: u32,
    /// Where its octant stands among those of its level.
    pub place: [u32; 3],
    /// The tile above; the root's is itself.
    pub parent: u32,
    /// Whether there are tiles below it, one for each child of its octant.
    pub divided: bool,
    /// How far the surface in it may be from what it shows, in the world's unit, and its colours from where
    /// they belong; never less than in the tiles below.
    pub error: f64,
}

/// What a tile shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Content {
    /// Its patches, with normals and colours of points.
    pub mesh: Mesh,
    /// The octant of each point.
    pub octants: Vec<Octant>,
}

/// All tiles of a model.
#[derive(Debug, Clone)]
pub struct Tiling<'a> {
    lod: &'a Lod,
    span: u32,
    tiles: Vec<Tile>,
    /// The tile of each node, where it has one.
    of_node: Vec<u32>,
}

impl<'a> Tiling<'a> {
    /// Divides a model into tiles of `2^span` cells along an edge.
    ///
    /// # Errors
    /// Where `span` is not 1 to 16, or the work is interrupted.
    pub fn new(lod: &'a Lod, span: u32, run: &Run) -> Result<Self, LodError> {
        run.stage("tiles");
        run.check()?;
        if span == 0 || span > MOST_LEVELS {
            return Err(LodError::Level(span));
        }
        let nodes = lod.nodes();
        // Levels below each node: children stand behind their parents.
        let mut heights = vec![0u8; nodes.len()];
        for (i, node) in nodes.iter().enumerate().rev() {
            let first = node.first_child() as usize;
            let children = first..first + node.children().count_ones() as usize;
            if !children.is_empty() {
                heights[i] = 1 + heights[children].iter().fold(0, |a, &b| a.max(b));
            }
        }
        let mut of_node = vec![NONE; nodes.len()];
        let divided = |node: u32| u32::from(heights[node as usize]) > span;
        let root =
            Tile { node: 0, level: 0, place: [0; 3], parent: 0, divided: divided(0), error: 0.0 };
        let mut tiles = vec![root];
        of_node[0] = 0;
        let mut at = 0;
        while at < tiles.len() {
            let above = tiles[at];
            let node = nodes[above.node as usize];
            for octant in (0..8u32).filter(|o| above.divided && node.children() >> o & 1 == 1) {
                let child = node.child(octant);
                of_node[child as usize] = tiles.len() as u32;
                tiles.push(Tile {
                    node: child,
                    level: above.level + 1,
                    place: [0, 1, 2].map(|a| 2 * above.place[a] + (octant >> a & 1)),
                    parent: at as u32,
                    divided: divided(child),
                    error: 0.0,
                });
            }
            at += 1;
        }
        let mut tiling = Self { lod, span, tiles, of_node };
        tiling.measure(run)?;
        Ok(tiling)
    }

    /// The tiles, breadth-first, those of a level in Morton order.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// Levels of octants in a tile.
    pub fn span(&self) -> u32 {
        self.span
    }

    /// Draws all tiles, level by level and then those that have none below. `make` turns what a tile
    /// shows into what is kept, on any thread; `keep` takes it in a fixed order, with the tile's number.
    ///
    /// # Errors
    /// Where `make` or `keep` fails, or the work is interrupted.
    pub fn draw<T: Send, E: From<LodError> + Send>(
        &self,
        mode: Mode,
        run: &Run,
        make: impl Fn(usize, Content) -> Result<T, E> + Sync,
        mut keep: impl FnMut(usize, T) -> Result<(), E>,
    ) -> Result<(), E> {
        for group in self.groups() {
            let cut = Cut::select(self.lod, &group.criterion(self), run)?;
            let owners = self.owners(&cut, group);
            let found = patches(self.lod, &cut, mode, run)?;
            let shares = shares(&found, &owners);
            let shares: Vec<_> = shares.chunk_by(|a, b| a.0 == b.0).collect();
            run.stage("draw");
            for batch in shares.chunks(BATCH) {
                let made = par::blocks(run, batch.len(), 1, |range| {
                    let share = batch[range.start];
                    let patches = share.iter().map(|&(_, patch)| &found[patch as usize]);
                    let content = self.content(&cut, mode, patches);
                    make(share[0].0 as usize, content)
                });
                for (share, made) in batch.iter().zip(made.map_err(LodError::from)?) {
                    keep(share[0].0 as usize, made?)?;
                }
            }
        }
        Ok(())
    }

    /// Tiles that are drawn from one cut.
    fn groups(&self) -> impl Iterator<Item = Group> + use<> {
        let divided = self.tiles.iter().filter(|t| t.divided).map(|t| t.level);
        let levels = divided.max().map_or(0, |most| most + 1);
        (0..levels).map(Group::Divided).chain([Group::Whole])
    }

    /// The tile of each place of a cut, where one of the group holds it.
    fn owners(&self, cut: &Cut, group: Group) -> Vec<u32> {
        let mut owners: Vec<u32> = Vec::with_capacity(cut.entries.len());
        for entry in &cut.entries {
            let own = self.of_node[entry.node as usize];
            let above = owners.get(entry.parent as usize).copied().unwrap_or(NONE);
            let takes = self.tiles.get(own as usize).is_some_and(|tile| group.takes(tile));
            owners.push(if takes { own } else { above });
        }
        owners
    }

    /// Finds the error of each tile: the largest of its octants.
    fn measure(&mut self, run: &Run) -> Result<(), LodError> {
        for group in self.groups() {
            let cut = Cut::select(self.lod, &group.criterion(self), run)?;
            let owners = self.owners(&cut, group);
            let front = cut.places().filter(|&place| cut.is_front(place));
            for (place, owner) in front.map(|p| (p, owners[p as usize])).filter(|o| o.1 != NONE) {
                let octant = cut.octant(place);
                let cells = self.lod.error(octant.node).max(self.blur(&octant));
                let error = &mut self.tiles[owner as usize].error;
                *error = error.max(cells * self.lod.stretch());
            }
        }
        for at in (1..self.tiles.len()).rev() {
            let Tile { parent, error, .. } = self.tiles[at];
            let above = &mut self.tiles[parent as usize].error;
            *above = above.max(error);
        }
        Ok(())
    }

    /// How far colours that an octant shows may be from their place, in finest cells: half its side where
    /// its children differ in colour, else nothing.
    fn blur(&self, octant: &Octant) -> f64 {
        let Some(own) = self.lod.colour(octant.node) else { return 0.0 };
        let node = self.lod.nodes()[octant.node as usize];
        let first = node.first_child();
        let differs = |child: u32| {
            let other = self.lod.colour(child).unwrap_or(own);
            (0..4).any(|k| own[k].abs_diff(other[k]) > SAME_COLOUR)
        };
        let any = (first..first + node.children().count_ones()).any(differs);
        if any { f64::from(octant.size) / 2.0 } else { 0.0 }
    }

    fn content<'p>(
        &self,
        cut: &Cut,
        mode: Mode,
        patches: impl Iterator<Item = &'p Patch> + Clone,
    ) -> Content {
        let mut places: Vec<u32> = patches.clone().flat_map(|p| p.ring).collect();
        places.sort_unstable();
        places.dedup();
        let number = |place: u32| places.partition_point(|&p| p < place) as u32;
        let rings = patches.clone().map(|p| p.ring.map(number)).collect();
        let octants = places.iter().map(|&place| cut.octant(place)).collect();
        let sheets = Sheets { rings, places, apart: Vec::new() };
        let drawn = meshed(self.lod, cut, patches, sheets, mode, Diagonal::Flatter);
        Content { mesh: drawn.mesh, octants }
    }
}

/// Tiles that are drawn from one cut.
#[derive(Debug, Clone, Copy)]
enum Group {
    /// Those of a level that have tiles below them.
    Divided(u32),
    /// Those that have none.
    Whole,
}

impl Group {
    fn criterion(self, tiling: &Tiling<'_>) -> Criterion {
        Criterion::Level(match self {
            Self::Divided(level) => level + tiling.span,
            Self::Whole => tiling.lod.levels(),
        })
    }

    fn takes(self, tile: &Tile) -> bool {
        match self {
            Self::Divided(level) => tile.divided && tile.level == level,
            Self::Whole => !tile.divided,
        }
    }
}

/// Each tile with each patch that has a corner in it.
fn shares(patches: &[Patch], owners: &[u32]) -> Vec<(u32, u32)> {
    let mut shares = Vec::new();
    for (i, patch) in patches.iter().enumerate() {
        let tiles = patch.ring.map(|place| owners[place as usize]);
        for k in 0..4 {
            if tiles[k] != NONE && !tiles[..k].contains(&tiles[k]) {
                shares.push((tiles[k], i as u32));
            }
        }
    }
    par::sort(&mut shares);
    shares
}

impl Content {
    /// The octants of points as a column of numbers, from which patches between tiles of any levels
    /// can be made anew: the low corner in finest cells, and the level less one times 4096 with a bit
    /// for each edge that is crossed.
    pub fn column(&self, lod: &Lod) -> PointColumn {
        let of = |o: &Octant| {
            let [x, y, z] = o.corner.map(|c| c as f32);
            let edges = u32::from(lod.nodes()[o.node as usize].any());
            [x, y, z, ((o.level.max(1) - 1) << 12 | edges) as f32]
        };
        let values = self.octants.iter().flat_map(of).collect();
        PointColumn { name: "OCTANT".into(), width: 4, values }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lod::{BuildOptions, build, drawn};
    use crate::measure::{Nearest, Topology};
    use crate::samples::Sample;

    fn model(sample: Sample, level: u32) -> Lod {
        let mesh = sample.polygons(30).unwrap().triangulate();
        let options = BuildOptions { level, ..BuildOptions::default() };
        build(&mesh, &options, &Run::default()).unwrap()
    }

    fn all(tiling: &Tiling<'_>, mode: Mode) -> Vec<Option<Content>> {
        let mut all = vec![None; tiling.tiles().len()];
        let keep = |tile: usize, content| {
            assert!(all[tile].replace(content).is_none(), "tile {tile} was drawn twice");
            Ok(())
        };
        let make = |_, content| Ok::<_, LodError>(content);
        tiling.draw(mode, &Run::default(), make, keep).unwrap();
        all
    }

    /// Triangles as bits of their corners, each beginning with the lowest.
    fn triangles(mesh: &Mesh) -> Vec<[[u64; 3]; 3]> {
        let corners = |t: &[u32; 3]| t.map(|p| mesh.points[p as usize].map(f64::to_bits));
        let turned = |t: [[u64; 3]; 3]| {
            let first = (0..3).min_by_key(|&k| t[k]).unwrap();
            [0, 1, 2].map(|k| t[(first + k) % 3])
        };
        mesh.triangles.iter().map(|t| turned(corners(t))).collect()
    }

    #[test]
    fn tiles_without_others_below_are_the_finest_mesh() {
        for (sample, level) in [(Sample::Torus, 6), (Sample::Cone, 6), (Sample::Sphere, 5)] {
            let lod = model(sample, level);
            for mode in [Mode::Any, Mode::Parity] {
                let run = Run::default();
                let cut = Cut::select(&lod, &Criterion::Level(level), &run).unwrap();
                let found = patches(&lod, &cut, mode, &run).unwrap();
                let whole = drawn(&lod, &cut, &found, mode, Diagonal::Flatter, &run).unwrap().mesh;
                let mut expected = triangles(&whole);
                expected.sort_unstable();
                for span in [1, 2, 3, 9] {
                    let tiling = Tiling::new(&lod, span, &run).unwrap();
                    let contents = all(&tiling, mode);
                    let finest = tiling.tiles().iter().zip(&contents).filter(|(t, _)| !t.divided);
                    let meshes = finest.filter_map(|(_, content)| content.as_ref());
                    let mut found: Vec<_> = meshes.flat_map(|c| triangles(&c.mesh)).collect();
                    found.sort_unstable();
                    found.dedup();
                    assert_eq!(found, expected, "{sample:?} {mode:?} {span}");
                }
                if mode == Mode::Parity {
                    let count = whole.points.len();
                    let topology = Topology::of(count, &whole.triangles, &run).unwrap();
                    assert_eq!(topology.boundary_edges.count, 0);
                }
            }
        }
    }

    #[test]
    fn tiles_cover_each_other_and_errors_never_grow() {
        let lod = model(Sample::Torus, 7);
        for span in [2, 3, 4] {
            let tiling = Tiling::new(&lod, span, &Run::default()).unwrap();
            let tiles = tiling.tiles();
            let mut below = vec![0; tiles.len()];
            for tile in &tiles[1..] {
                let above = &tiles[tile.parent as usize];
                below[tile.parent as usize] += 1;
                assert!(tile.error <= above.error && above.divided);
                assert_eq!((tile.level, tile.place.map(|x| x / 2)), (above.level + 1, above.place));
            }
            for (tile, below) in tiles.iter().zip(below) {
                let children = lod.nodes()[tile.node as usize].children().count_ones();
                assert_eq!(below, if tile.divided { children } else { 0 });
            }
        }
    }

    #[test]
    fn the_finest_mesh_is_within_the_error_of_each_tile() {
        let lod = model(Sample::Torus, 7);
        let run = Run::default();
        let finest = Cut::select(&lod, &Criterion::Level(7), &run).unwrap();
        for span in [2, 3, 4] {
            let tiling = Tiling::new(&lod, span, &run).unwrap();
            let mut looked = 0;
            for (tile, content) in tiling.tiles().iter().zip(all(&tiling, Mode::Any)) {
                let Some(content) = content.filter(|_| tile.divided) else { continue };
                let near = Nearest::new(&content.mesh);
                for octant in finest.places().filter(|&p| finest.is_front(p)) {
                    let octant = finest.octant(octant);
                    let at = octant.corner.map(|c| c >> (7 - tile.level));
                    if at == tile.place && octant.level >= tile.level {
                        let own = lod.vertex(octant.node, octant.corner, octant.size);
                        let hit = near.nearest(lod.world(own)).unwrap();
                        let distance = hit.distance_squared.sqrt();
                        assert!(distance <= tile.error, "{distance} {}", tile.error);
                        looked += 1;
                    }
                }
            }
            assert!(looked > 1000);
        }
    }

    #[test]
    fn columns_tell_octants_exactly() {
        let lod = model(Sample::Cone, 6);
        let tiling = Tiling::new(&lod, 3, &Run::default()).unwrap();
        for content in all(&tiling, Mode::Any).into_iter().flatten() {
            let column = content.column(&lod);
            assert_eq!(content.octants.len(), content.mesh.points.len());
            for (o, words) in content.octants.iter().zip(column.values.chunks_exact(4)) {
                assert_eq!([words[0], words[1], words[2]], o.corner.map(|c| c as f32));
                let word = words[3] as u32;
                assert_eq!((word >> 12) + 1, o.level);
                assert_eq!(word & 0xfff, u32::from(lod.nodes()[o.node as usize].any()));
            }
        }
    }
}
