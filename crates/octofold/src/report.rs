//! What a command did, as data: `--json` prints exactly this.
//!
//! The library keeps no clock, so whoever runs the command fills in the times.

use crate::craft::{CraftAccount, CraftOptions};
use crate::histogram::Histogram;
use crate::lod::{self, Lod};
use crate::measure::{self, Comparison, HausdorffBounds, Measures, Weld};
use crate::network::census::Census;
use crate::network::code::Mode;
use crate::pipeline::{Kind, Shape, Step};
use crate::repair::RepairAccount;
use crate::run::{Finding, Run};
use crate::simplify::SimplifyAccount;
use crate::surface::SurfaceAccount;
use crate::unfold::{UnfoldAccount, UnfoldOptions};
use crate::volume::{Placement, Region, ScalarType, Volume, VolumeError};
use serde::Serialize;

/// The whole account of one command.
///
/// What was asked for (the measures of `info`, the distances of `compare`) stands at the top
/// level; the measures of what went in and what came out stand under `input` and `output`.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// Version of the program.
    pub version: &'static str,
    /// Name of the command.
    pub command: &'static str,
    /// What the command was asked for, where that is not a file.
    #[serde(flatten)]
    pub answer: Option<Answer>,
    /// Steps with their options.
    pub steps: Vec<Step>,
    /// Times, in the order of the work.
    pub stages: Vec<Stage>,
    /// Wall-clock time of the whole command.
    pub seconds: f64,
    /// Most memory held at any time, in bytes, where the system tells.
    pub peak_memory: Option<u64>,
    /// Measures of what went in.
    pub input: Option<ShapeMeasures>,
    /// Measures of what came out.
    pub output: Option<ShapeMeasures>,
    /// What the surface method tells of its own work: octants, rejections, open edges.
    pub surface: Option<SurfaceAccount>,
    /// What a repair tells of its own work.
    pub repair: Option<RepairReport>,
    /// What a simplification tells of its own work.
    pub simplify: Option<SimplifyReport>,
    /// How a model was made ready for unfolding.
    pub craft: Option<CraftReport>,
    /// What unfolding tells of its own work.
    pub unfold: Option<UnfoldReport>,
    /// Odd things that did not stop the work.
    pub findings: Vec<Finding>,
}

/// How a model was made ready for unfolding.
#[derive(Debug, Clone, Serialize)]
pub struct CraftReport {
    /// What was asked for.
    pub options: CraftOptions,
    /// What was done.
    #[serde(flatten)]
    pub account: CraftAccount,
}

/// How a mesh was unfolded, and what came of it.
#[derive(Debug, Clone, Serialize)]
pub struct UnfoldReport {
    /// What was asked for.
    pub options: UnfoldOptions,
    /// What was done.
    #[serde(flatten)]
    pub account: UnfoldAccount,
}

/// What was repaired, and what is proved of the file that was written.
#[derive(Debug, Clone, Serialize)]
pub struct RepairReport {
    /// What was done.
    #[serde(flatten)]
    pub account: RepairAccount,
    /// Closed, oriented, manifold and free of self-intersection, as read back from the file; of sheets:
    /// free of self-intersection and of repeated triangles, and each patch turned one way. `None` where
    /// there is no file to read.
    pub proved_of_file: Option<bool>,
    /// How far the output is from the input, and the input from the output.
    pub distances: Option<Comparison>,
}

/// How a mesh was simplified, and what is proved of the file that was written.
#[derive(Debug, Clone, Serialize)]
pub struct SimplifyReport {
    /// What was done.
    #[serde(flatten)]
    pub account: SimplifyAccount,
    /// No point of the file's mesh is further from the input than the error that was named, nor the
    /// other way round; `None` where none was, or there is no file to read.
    pub proved_within_error: Option<bool>,
    /// What the largest distances lie between, from the output to the input (`a_to_b`) and from the
    /// input to the output.
    pub distances: Option<HausdorffBounds>,
}

/// One stage of the work.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stage {
    /// Its name.
    pub name: &'static str,
    /// Wall-clock time.
    pub seconds: f64,
    /// Units of work done, where it counts them.
    pub count: Option<u64>,
}

/// What a command answers.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum Answer {
    /// `info`.
    Measures(Box<ShapeMeasures>),
    /// `compare`.
    Comparison(Comparison),
    /// `net info`.
    Network(Box<NetworkFacts>),
    /// `lod build`, `lod extract`, `lod tiles` and `lod info`.
    Lod(Box<LodFacts>),
    /// `net contains`.
    Voxels {
        /// Each place that was asked for.
        voxels: Vec<VoxelAnswer>,
    },
    /// `check`.
    Claims {
        /// True where every claim holds.
        holds: bool,
        /// The claims that were checked.
        claims: Vec<Claim>,
    },
}

/// What is known of a level-of-detail model, and of the part that was taken from it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LodFacts {
    /// Levels below the root.
    pub levels: u32,
    /// Side of a finest cell in the world, where cells are cubes.
    pub cell: f64,
    /// Octants.
    pub octants: u64,
    /// Octants without children.
    pub leaves: u64,
    /// Octants of each level, the root's first.
    pub octants_by_level: Vec<u64>,
    /// Mean and largest bound of the distance between surface and patches of each level, in the world's
    /// unit.
    pub errors_by_level: Vec<[f64; 2]>,
    /// Whether octants have colours.
    pub coloured: bool,
    /// Octants through which a border of the surface runs, of those without children.
    pub border_leaves: u64,
    /// Bytes of the file.
    pub bytes: Option<u64>,
    /// What was taken from it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extract: Option<ExtractFacts>,
    /// The chain of meshes that it was written as, the finest first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chain: Option<Vec<ExtractFacts>>,
    /// The tiles that it was written as.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tiles: Option<TilesFacts>,
}

/// The tiles of a level-of-detail model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TilesFacts {
    /// Tiles of each level, the root's first.
    pub tiles_by_level: Vec<u64>,
    /// Triangles that the tiles of each level show.
    pub triangles_by_level: Vec<u64>,
    /// Bytes of what they show.
    pub bytes: u64,
}

/// What was taken from a level-of-detail model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExtractFacts {
    /// Which edges have patches.
    pub mode: lod::Mode,
    /// Octants that were chosen.
    pub octants: u64,
    /// The same by level, the root's first.
    pub octants_by_level: Vec<u64>,
    /// Patches: polygons of three or four corners.
    pub patches: u64,
    /// Octants that were divided so that patches cross their edges.
    pub divided: u64,
    /// Patches that do not cross their edge.
    pub missing: u64,
    /// Largest bound of the distance between surface and patches over the chosen octants, in the
    /// world's unit.
    pub error: f64,
}

impl LodFacts {
    /// The facts of a model.
    pub fn of(lod: &Lod, bytes: Option<u64>) -> Self {
        let nodes = lod.nodes();
        let levels: Vec<_> = (0..=lod.levels()).map(|level| lod.level(level)).collect();
        let leaves = || (0..nodes.len()).filter(|&i| nodes[i].children() == 0);
        let errors = |level: &std::ops::Range<u32>| {
            let (sum, most) = level
                .clone()
                .map(|node| lod.error(node) * lod.stretch())
                .fold((0.0, 0f64), |(sum, most), error| (sum + error, most.max(error)));
            [sum / f64::from(level.end - level.start).max(1.0), most]
        };
        Self {
            levels: lod.levels(),
            cell: lod.stretch(),
            octants: nodes.len() as u64,
            leaves: leaves().count() as u64,
            octants_by_level: levels.iter().map(|l| u64::from(l.end - l.start)).collect(),
            errors_by_level: levels.iter().map(errors).collect(),
            coloured: lod.parts().colours.is_some(),
            border_leaves: leaves().filter(|&i| lod.traits(i as u32).is_border()).count() as u64,
            bytes,
            extract: None,
            chain: None,
            tiles: None,
        }
    }
}

/// What is known of a network in a file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NetworkFacts {
    /// Voxels along x, y, z.
    pub dims: [usize; 3],
    /// From voxels to the world.
    pub placement: Placement,
    /// Bytes of the file.
    pub bytes: u64,
    /// How it is coded.
    pub mode: Mode,
    /// Whether any part can be read without the rest.
    pub bricks: bool,
    /// Bits for each voxel of the surface.
    pub bits_per_surface_voxel: Option<f64>,
    /// Bits for each exposed face.
    pub bits_per_face: Option<f64>,
    /// Bytes of the labels that surface voxels carry, of those of the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub label_bytes: Option<u64>,
    /// Bytes of their colours.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub colour_bytes: Option<u64>,
    /// Runs of voxels along x.
    pub runs: u64,
    /// Voxels, and data of the network and of the octree.
    #[serde(flatten)]
    pub census: Census,
}

/// Whether a voxel is in a solid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct VoxelAnswer {
    /// The voxel.
    pub voxel: [i64; 3],
    /// Whether it is filled.
    pub filled: bool,
}

/// A claim about a shape, and whether it holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Claim {
    /// Its name, as the option that asks for it.
    pub name: &'static str,
    /// Whether it holds.
    pub holds: bool,
    /// What was found.
    pub fact: String,
    /// Where it does not hold: the first few places, in world coordinates.
    pub places: Vec<[f64; 3]>,
}

/// Measures of either kind of shape.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum ShapeMeasures {
    /// Of polygons.
    Mesh(Measures),
    /// Of samples.
    Volume(VolumeMeasures),
}

impl ShapeMeasures {
    /// Measures `shape`. Polygons are triangulated and welded by position first.
    pub fn of(shape: &Shape, run: &Run) -> Result<Self, VolumeError> {
        Ok(match shape {
            Shape::Soup(soup) => {
                Self::Mesh(measure::measure(&soup.triangulate(), Weld::Exact, run)?)
            }
            Shape::Volume(volume) => Self::Volume(VolumeMeasures::of(volume.as_ref(), run)?),
        })
    }
}

/// Facts about a volume.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VolumeMeasures {
    /// Always a volume.
    pub kind: Kind,
    /// Samples along x, y, z.
    pub dims: [usize; 3],
    /// Type of the samples.
    pub scalar_type: ScalarType,
    /// Samples are only 0 and 1.
    pub binary: bool,
    /// World distance between samples along x, y, z.
    pub spacing: [f64; 3],
    /// From sample indices to the world.
    pub placement: Placement,
    /// Box around all sample centres in the world, lowest and highest corner.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Lowest and highest finite value.
    pub range: Option<[f64; 2]>,
    /// Samples that are NaN or infinite.
    pub not_finite: u64,
    /// Samples that are not 0, where samples are whole numbers.
    pub nonzero: Option<u64>,
    /// Different values and how often each occurs, where they are few and whole or named.
    pub values: Option<Vec<ValueCount>>,
}

/// One value of a volume of few values.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ValueCount {
    /// The value.
    pub value: i64,
    /// Its name in the file's own table.
    pub name: Option<String>,
    /// Samples that have it.
    pub count: u64,
}

/// Volumes of more different values than this are not listed value by value.
const LISTED_VALUES: usize = 256;

impl VolumeMeasures {
    /// Reads the whole volume, unless it knows how many of its samples are 1.
    pub fn of(volume: &dyn Volume, run: &Run) -> Result<Self, VolumeError> {
        let known = if volume.is_binary() { volume.nonzero() } else { None };
        let histogram = match known {
            Some(ones) => of_mask(Region::all(volume.dims()), ones),
            None => Histogram::of(volume, run)?,
        };
        let placement = volume.placement();
        let table = volume.labels();
        let listed = |v: &Vec<_>| v.len() <= LISTED_VALUES || !table.is_empty();
        let counts = histogram.values();
        let nonzero = counts
            .as_ref()
            .map(|v| v.iter().filter(|(value, _)| *value != 0).map(|(_, n)| n).sum());
        let name = |value: i64| {
            let entry = table.iter().find(|label| i64::from(label.value) == value)?;
            (!entry.name.is_empty()).then(|| entry.name.clone())
        };
        let values = counts.filter(listed).map(|values| {
            let entry = |(value, count)| ValueCount { value, name: name(value), count };
            values.into_iter().map(entry).collect()
        });
        Ok(Self {
            kind: Kind::Volume,
            dims: volume.dims(),
            scalar_type: volume.scalar_type(),
            binary: volume.is_binary(),
            spacing: placement.axes.map(|a| glam::DVec3::from_array(a).length()),
            placement,
            bounds: bounds(&placement, Region::all(volume.dims())),
            range: histogram.range,
            not_finite: histogram.not_finite,
            nonzero,
            values,
        })
    }
}

/// The histogram of a mask with `ones` samples that are 1. The box may hold more samples than a
/// machine could visit.
fn of_mask(region: Region, ones: u64) -> Histogram {
    let all: u64 = region.dims().iter().map(|&d| d as u64).product();
    let (zeros, empty) = (all - ones, all == 0);
    let low = if zeros > 0 { 0.0 } else { 1.0 };
    let high = if ones > 0 { 1.0 } else { 0.0 };
    let counts = [zeros, ones].into_iter().filter(|&n| n > 0).collect();
    Histogram { range: (!empty).then_some([low, high]), not_finite: 0, counts, exact: true }
}

/// The box around the centres of all samples of `region`.
fn bounds(placement: &Placement, region: Region) -> Option<[[f64; 3]; 2]> {
    if region.is_empty() {
        return None;
    }
    let corners: Vec<[f64; 3]> = (0..8)
        .map(|corner| {
            placement.place(std::array::from_fn(|a| {
                let end = if corner >> a & 1 == 0 { region.start[a] } else { region.end[a] - 1 };
                end as f64
            }))
        })
        .collect();
    crate::mesh::bounds(&corners)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{DenseVolume, Label};

    #[test]
    fn a_label_volume_is_listed_by_name() {
        let samples = vec![0u8, 3, 3, 9];
        let mut v =
            DenseVolume::new([4, 1, 1], samples, Placement::spacing([2.0, 1.0, 1.0])).unwrap();
        v.labels = vec![Label { value: 3, name: "left".into(), colour: [0; 4] }];
        let m = VolumeMeasures::of(&v, &Run::default()).unwrap();
        let named = |value, name: Option<&str>, count| ValueCount {
            value,
            name: name.map(Into::into),
            count,
        };
        let expected = vec![named(0, None, 1), named(3, Some("left"), 2), named(9, None, 1)];
        assert_eq!(m.values, Some(expected));
        assert_eq!((m.nonzero, m.spacing), (Some(3), [2.0, 1.0, 1.0]));
        assert_eq!(m.bounds, Some([[0.0; 3], [6.0, 0.0, 0.0]]));
    }

    #[test]
    fn a_mask_is_counted_without_reading() {
        for (samples, ones) in [(vec![0u8, 1, 1], 2), (vec![1, 1, 1], 3), (vec![0, 0, 0], 0)] {
            let v = DenseVolume::new([3, 1, 1], samples, Placement::default()).unwrap();
            let read = Histogram::of(&v, &Run::default()).unwrap();
            assert_eq!(of_mask(Region::all([3, 1, 1]), ones), read);
        }
        assert_eq!(of_mask(Region::all([0, 4, 4]), 0).range, None);
    }
}
