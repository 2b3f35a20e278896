//! 3D Tiles 1.1: a model of many levels of detail as a folder that viewers stream.
//!
//! | file | what |
//! | --- | --- |
//! | `tileset.json` | the root, and how all other names are made |
//! | `content/{level}/{x}/{y}/{z}.glb` | what a tile shows, as glTF |
//! | `subtrees/{level}/{x}/{y}/{z}.subtree` | which tiles there are, with their errors and boxes |
//!
//! Tiles are the octants of the model (implicit octree), each replaced by those below it. Points of
//! all tiles are told from the middle of the model, so that equal points are equal bytes. Beside
//! position, normal and colour each point has `_OCTANT`, from which patches between tiles of any levels
//! can be made anew: the low corner of its octant in finest cells, and 4096 times the octant's level less
//! one with a bit for each edge that is crossed. Source: OGC 3D Tiles 1.1, 22-025r4.

mod subtree;

use crate::{Sink, WriteError, gltf};
use glam::DVec3;
use octofold::lod::{Content, Lod, Mode, Tiling};
use octofold::{LengthUnit, Run, Soup};
use rustc_hash::FxHashMap;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use subtree::{LEVELS, Told};

/// Which way a model stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Up {
    /// As 3D Tiles do: coordinates stay.
    #[default]
    Z,
    /// As glTF does: the model is turned upright.
    Y,
}

/// How tiles are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TilesOptions {
    /// Levels of octants in a tile: it is `2^span` cells wide.
    pub span: u32,
    /// Which edges have patches.
    pub mode: Mode,
    /// The axis of the model that points up.
    pub up: Up,
}

impl Default for TilesOptions {
    fn default() -> Self {
        Self { span: 6, mode: Mode::Any, up: Up::Z }
    }
}

/// What was written.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TilesWritten {
    /// Tiles of each level, the root's first.
    pub tiles: Vec<u64>,
    /// Triangles that the tiles of each level show.
    pub triangles: Vec<u64>,
    /// Bytes of all contents.
    pub bytes: u64,
}

/// Writes all tiles of a model into a folder, which is new, empty, or holds tiles that were written
/// here before; these are replaced once all others are there.
pub fn write(
    lod: &Lod,
    options: &TilesOptions,
    folder: &Path,
    run: &Run,
) -> Result<TilesWritten, WriteError> {
    let io = |source| WriteError::Io { path: folder.into(), source };
    if !is_free(folder) {
        let fact = format!("{} holds other files: name a new or empty folder", folder.display());
        return Err(WriteError::Unfit { format: "a folder of tiles", fact });
    }
    std::fs::create_dir_all(folder).map_err(io)?;
    let work = tempfile::Builder::new().prefix(".octofold-").tempdir_in(folder).map_err(io)?;
    let tiling = Tiling::new(lod, options.span, run)?;
    let stand = Stand::new(lod, options.up);
    let mut tiles: Vec<Told> = (tiling.tiles().iter())
        .map(|t| Told {
            level: t.level,
            place: t.place,
            error: t.error * stand.metres,
            shape: [0.0; 12],
            shown: false,
        })
        .collect();
    let levels = tiles.last().map_or(0, |t| t.level) as usize + 1;
    let mut written = TilesWritten { tiles: vec![0; levels], triangles: vec![0; levels], bytes: 0 };
    tiles.iter().for_each(|t| written.tiles[t.level as usize] += 1);
    let mut bounds = vec![[DVec3::INFINITY, DVec3::NEG_INFINITY]; tiles.len()];
    let make = |_, content: Content| -> Result<_, WriteError> {
        let (soup, bounds) = stand.stood(lod, content);
        let count = soup.faces() as u64;
        let mut bytes = Vec::new();
        gltf::write_glb(&soup, &mut Sink::new(&mut bytes, "tile"), run)?;
        Ok((bytes, bounds, count))
    };
    tiling.draw(options.mode, run, make, |number, (bytes, own, triangles)| {
        let tile = &mut tiles[number];
        tile.shown = true;
        written.triangles[tile.level as usize] += triangles;
        written.bytes += bytes.len() as u64;
        bounds[number] = own;
        put(&named(work.path(), "content", tile.level, tile.place, "glb"), &bytes)
    })?;
    run.stage("write");
    // Boxes hold what is shown, and all that replaces it.
    for (number, tile) in tiling.tiles().iter().enumerate().skip(1).rev() {
        let own = bounds[number];
        let above = &mut bounds[tile.parent as usize];
        *above = [above[0].min(own[0]), above[1].max(own[1])];
    }
    for (tile, &[low, high]) in tiles.iter_mut().zip(&bounds) {
        let [middle, half] = [(low + high) / 2.0, (high - low) / 2.0];
        let is_there = middle.is_finite() && half.is_finite();
        let middle = if is_there { middle } else { DVec3::ZERO };
        // The surface may be that far from what is shown; and some viewers cannot do with flat boxes.
        let half = if is_there { half + tile.error } else { DVec3::ZERO };
        tile.shape[..3].copy_from_slice(&middle.to_array());
        (0..3).for_each(|axis| tile.shape[3 + 4 * axis] = half[axis]);
    }
    subtrees(&tiles, work.path(), run)?;
    put(&work.path().join("tileset.json"), &pretty(&stand.tileset(&tiles, levels)))?;
    replace(work.path(), folder).map_err(io)?;
    Ok(written)
}

/// True for a folder that is new or empty, or holds tiles of ours.
fn is_free(folder: &Path) -> bool {
    let Ok(mut entries) = std::fs::read_dir(folder) else { return !folder.exists() };
    let Ok(text) = std::fs::read(folder.join("tileset.json")) else {
        return entries.next().is_none();
    };
    let found: Option<Value> = serde_json::from_slice(&text).ok();
    found.is_some_and(|tileset| tileset["asset"]["extras"]["generator"] == GENERATOR)
}

const GENERATOR: &str = "Octofold";

/// Puts finished tiles in the place of older ones.
fn replace(work: &Path, folder: &Path) -> std::io::Result<()> {
    let tileset = folder.join("tileset.json");
    if tileset.exists() {
        std::fs::remove_file(&tileset)?;
    }
    for name in ["content", "subtrees"] {
        let old = folder.join(name);
        if old.exists() {
            std::fs::remove_dir_all(&old)?;
        }
        std::fs::rename(work.join(name), old)?;
    }
    std::fs::rename(work.join("tileset.json"), tileset)
}

fn named(folder: &Path, kind: &str, level: u32, [x, y, z]: [u32; 3], ending: &str) -> PathBuf {
    folder.join(format!("{kind}/{level}/{x}/{y}/{z}.{ending}"))
}

fn put(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let io = |source| WriteError::Io { path: path.into(), source };
    path.parent().map_or(Ok(()), std::fs::create_dir_all).map_err(io)?;
    std::fs::write(path, bytes).map_err(io)
}

fn pretty(value: &Value) -> Vec<u8> {
    format!("{value:#}\n").into_bytes()
}

/// Writes all subtrees.
fn subtrees(tiles: &[Told], work: &Path, run: &Run) -> Result<(), WriteError> {
    let mut groups: FxHashMap<(u32, [u32; 3]), usize> = FxHashMap::default();
    let mut all: Vec<(Vec<Told>, Vec<Told>)> = Vec::new();
    for tile in tiles {
        // Roots of subtrees come before what is in them.
        let group = *groups.entry(tile.root()).or_insert(all.len());
        if group == all.len() {
            all.push((Vec::new(), Vec::new()));
        }
        all[group].0.push(*tile);
        if tile.level > 0 && tile.level % LEVELS == 0 {
            let above = (tile.level - LEVELS, tile.place.map(|x| x >> LEVELS));
            if let Some(&above) = groups.get(&above) {
                all[above].1.push(*tile);
            }
        }
    }
    for (inside, below) in &all {
        run.check()?;
        let (level, place) = inside[0].root();
        let path = named(work, "subtrees", level, place, "subtree");
        put(&path, &subtree::file(inside, below))?;
    }
    Ok(())
}

/// Where a model stands in the world of 3D Tiles: metres, z up.
struct Stand {
    metres: f64,
    up: Up,
    /// The middle of the root, in the model's world.
    middle: DVec3,
    /// Half the edges of the root, in the model's world.
    halves: [DVec3; 3],
}

impl Stand {
    fn new(lod: &Lod, up: Up) -> Self {
        let half = f64::from(1u32 << lod.levels()) / 2.0;
        let frame = lod.frame();
        Self {
            metres: LengthUnit::scale(frame.unit, Some(LengthUnit::Metre)),
            up,
            middle: DVec3::from(frame.place([half; 3])),
            halves: frame.axes.map(|axis| DVec3::from(axis) * half),
        }
    }

    /// A direction as tiles have it.
    fn turned(&self, v: DVec3) -> DVec3 {
        match self.up {
            Up::Z => v,
            Up::Y => DVec3::new(v.x, -v.z, v.y),
        }
    }

    /// What a tile shows as glTF has it, y up, and its bounds in the tileset.
    fn stood(&self, lod: &Lod, content: Content) -> (Soup, [DVec3; 2]) {
        let column = content.column(lod);
        let mut mesh = content.mesh;
        let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        for point in &mut mesh.points {
            let place = self.turned(DVec3::from(*point) - self.middle) * self.metres;
            let place = place.as_vec3().as_dvec3();
            bounds = [bounds[0].min(place), bounds[1].max(place)];
            *point = [place.x, place.z, -place.y];
        }
        for normal in mesh.attributes.point_normals.iter_mut().flatten() {
            let [x, y, z] = normal.map(f64::from);
            let turned = self.turned(DVec3::new(x, y, z));
            *normal = [turned.x, turned.z, -turned.y].map(|x| x as f32);
        }
        mesh.unit = None;
        mesh.attributes.point_columns = vec![column];
        (mesh.into(), bounds)
    }

    fn tileset(&self, tiles: &[Told], levels: usize) -> Value {
        let middle = self.turned(self.middle) * self.metres;
        let axes = self.halves.map(|axis| self.turned(axis) * self.metres);
        let mut shape = vec![0.0; 3];
        shape.extend(axes.iter().flat_map(|axis| axis.to_array()));
        // Viewers that do not read a tile's own error take half that of the tile above. On the last level
        // nothing depends on it.
        let count = levels as u32;
        let above = tiles.iter().filter(|t| t.level == 0 || t.level + 1 < count);
        let error = above.map(|t| t.error * f64::from(1u32 << t.level)).fold(0.0, f64::max);
        let size = 2.0 * axes.iter().map(|a| a.length_squared()).sum::<f64>().sqrt();
        let DVec3 { x, y, z } = middle;
        json!({
            "asset": { "version": "1.1", "extras": { "generator": GENERATOR } },
            "schema": subtree::schema(),
            "geometricError": size.max(error),
            "root": {
                "transform": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1],
                "boundingVolume": { "box": shape },
                "geometricError": error,
                "refine": "REPLACE",
                "content": { "uri": "content/{level}/{x}/{y}/{z}.glb" },
                "implicitTiling": {
                    "subdivisionScheme": "OCTREE",
                    "subtreeLevels": LEVELS,
                    "availableLevels": levels,
                    "subtrees": { "uri": "subtrees/{level}/{x}/{y}/{z}.subtree" },
                },
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Source;
    use octofold::lod::{BuildOptions, build};
    use octofold::samples::Sample;

    fn model(level: u32) -> Lod {
        let mesh = Sample::Torus.polygons(24).unwrap().triangulate();
        build(&mesh, &BuildOptions { level, ..BuildOptions::default() }, &Run::default()).unwrap()
    }

    fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
        let mut open = vec![folder.to_path_buf()];
        let mut files = Vec::new();
        while let Some(path) = open.pop() {
            if path.is_dir() {
                open.extend(std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()));
            } else {
                let bytes = std::fs::read(&path).unwrap();
                files.push((path.strip_prefix(folder).unwrap().into(), bytes));
            }
        }
        files.sort();
        files
    }

    #[test]
    fn a_folder_holds_what_the_tileset_names() {
        let folder = tempfile::tempdir().unwrap();
        let options = TilesOptions { span: 2, ..TilesOptions::default() };
        let (lod, run) = (model(7), Run::default());
        let written = write(&lod, &options, folder.path(), &run).unwrap();
        assert_eq!(written.tiles.len(), 6);
        let all = files(folder.path());
        let is = |path: &Path, ending: &str| path.extension().is_some_and(|e| e == ending);
        let of = |ending: &str| all.iter().filter(|(path, _)| is(path, ending)).count() as u64;
        assert_eq!(of("glb"), written.tiles.iter().sum::<u64>());
        // Roots of subtrees: the root, and the tiles four levels below it.
        assert_eq!(of("subtree"), 1 + written.tiles[4]);
        assert_eq!(of("json"), 1);
        for (path, bytes) in all.iter().filter(|(path, _)| is(path, "glb")) {
            let soup = gltf::read(&Source::from_bytes("x.glb", bytes.as_slice()), &run).unwrap();
            assert!(soup.faces() > 0 && bytes.len() % 8 == 0, "{}", path.display());
        }
    }

    #[test]
    fn tiles_are_written_anew_and_other_files_are_not_touched() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tiles");
        let (options, run) = (TilesOptions { span: 2, ..TilesOptions::default() }, Run::default());
        write(&model(6), &options, &path, &run).unwrap();
        let first = files(&path);
        write(&model(5), &options, &path, &run).unwrap();
        assert!(files(&path).len() < first.len());
        write(&model(6), &options, &path, &run).unwrap();
        assert_eq!(files(&path), first);
        std::fs::write(folder.path().join("own.txt"), "own").unwrap();
        let refused = write(&model(5), &options, folder.path(), &run);
        assert!(matches!(refused, Err(WriteError::Unfit { .. })));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn a_subtree_tells_of_each_tile_once() {
        let folder = tempfile::tempdir().unwrap();
        write(
            &model(5),
            &TilesOptions { span: 3, ..TilesOptions::default() },
            folder.path(),
            &Run::default(),
        )
        .unwrap();
        let bytes = std::fs::read(folder.path().join("subtrees/0/0/0/0.subtree")).unwrap();
        let count = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
        assert_eq!((&bytes[..4], bytes[4]), (b"subt".as_slice(), 1));
        assert_eq!(24 + count(8) + count(16), bytes.len());
        assert_eq!((count(8) % 8, count(16) % 8), (0, 0));
        let told: Value = serde_json::from_slice(&bytes[24..24 + count(8)]).unwrap();
        let tiles = told["propertyTables"][0]["count"].as_u64().unwrap();
        assert_eq!(told["tileAvailability"]["availableCount"], tiles);
        assert_eq!(told["childSubtreeAvailability"]["constant"], 0);
        let there = &bytes[24 + count(8)..][..74];
        assert_eq!(there.iter().map(|b| u64::from(b.count_ones())).sum::<u64>(), tiles);
        assert_eq!(bytes.len(), 4960);
    }
}
