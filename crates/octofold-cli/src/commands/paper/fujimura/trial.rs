//! One shape at one resolution: as a network, as an octree, as bytes.

use anyhow::{Context, Result};
use octofold::Run;
use octofold::network::Network;
use octofold::network::census::{Compression, OctreeCount, octree};
use octofold::network::code::Mode;
use octofold::network::compress::{CompressOptions, Reading, compress};
use octofold::samples::{Pose, Sample};
use octofold::spans::Spans;
use octofold::volume::{Region, Volume};
use octofold_io::ofn::SolidWriter;
use serde::Serialize;
use std::time::Instant;

/// Voxels along an axis up to which the voxel model is held whole.
const MOST_DENSE: usize = 512;

/// Voxels along an axis up to which archives are written, at 2 microseconds a voxel of the surface.
const MOST_ARCHIVED: usize = 512;

/// Work is repeated, and the least time taken, until it took so long in all.
const TIMED_SECONDS: f64 = 0.1;
const MOST_TIMED: usize = 5;

/// How a shape lies in its grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Position {
    /// As it was made, but off the grid.
    Upright,
    /// By a rotation that fits no lattice, and smaller, so that it stays in the grid.
    Turned,
}

/// Where shapes lie: no multiple of a voxel.
const SHIFT: [f64; 3] = [0.004_713, -0.003_379, 0.002_131];

/// Columns of the rotation.
const TURN: [[f64; 3]; 3] = [
    [0.736_468_947_426_569, -0.600_445_367_478_849, 0.311_574_790_619_511],
    [0.518_548_024_986_798, 0.796_876_346_162_228, 0.309_993_604_304_070],
    [-0.434_420_804_357_587, -0.066_734_171_159_364, 0.898_234_443_305_855],
];

impl Position {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Upright, Self::Turned];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Upright => "upright",
            Self::Turned => "turned",
        }
    }

    fn pose(self) -> Pose {
        match self {
            Self::Upright => Pose { shift: SHIFT, ..Pose::default() },
            Self::Turned => Pose { turn: TURN, scale: 0.7, shift: SHIFT },
        }
    }
}

/// How long what took.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Seconds {
    /// From runs of voxels to linked surface voxels.
    pub network: f64,
    /// From there to planes, edges and voxels, in the paper's reading.
    pub compression: f64,
    /// From runs of voxels to the octree.
    pub octree: f64,
    /// From all voxels, each of which is looked at, to the octree.
    pub octree_of_voxels: Option<f64>,
    /// From runs of voxels to a file in fast mode.
    pub fast: f64,
    /// From runs of voxels to a file in archive mode.
    pub archive: Option<f64>,
}

/// Bytes of whole files.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Files {
    /// In fast mode.
    pub fast: usize,
    /// In archive mode.
    pub archive: Option<usize>,
}

/// What was found.
#[derive(Debug, Clone, Serialize)]
pub struct Trial {
    #[serde(serialize_with = "as_name")]
    pub shape: Sample,
    pub position: Position,
    /// Voxels along an axis.
    pub resolution: usize,
    pub voxels: u64,
    pub surface_voxels: u64,
    pub octree: OctreeCount,
    pub compressed: Vec<Compression>,
    pub files: Files,
    pub seconds: Seconds,
}

fn as_name<S: serde::Serializer>(sample: &Sample, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(sample.name())
}

impl Trial {
    /// Measures a shape.
    pub fn new(shape: Sample, position: Position, resolution: usize, run: &Run) -> Result<Self> {
        let mask = shape.voxels(resolution).context("the shape is a solid")?;
        let solid = mask.posed(position.pose()).spans(run)?;
        let (network, network_seconds) = timed(|| Network::new(&solid, run));
        let network = network?;
        let (octree, octree_seconds) = timed(|| octree(&solid));
        let mut compression = 0.0;
        let compressed = Reading::ALL.map(|reading| {
            let options = CompressOptions { reading, ..CompressOptions::default() };
            let (compressed, seconds) = timed(|| compress(&network, &options));
            if reading == Reading::Six {
                compression = seconds;
            }
            Compression::new(reading, &compressed, &octree)
        });
        let (fast, fast_seconds) = timed(|| bytes(&solid, Mode::Fast, run));
        let archive = (resolution <= MOST_ARCHIVED).then(|| {
            let begin = Instant::now();
            bytes(&solid, Mode::Archive, run).map(|n| (n, begin.elapsed().as_secs_f64()))
        });
        let archive = archive.transpose()?;
        let dense = (resolution <= MOST_DENSE).then(|| voxel_octree(&solid)).transpose()?;
        Ok(Self {
            shape,
            position,
            resolution,
            voxels: solid.count(),
            surface_voxels: network.count(),
            octree,
            compressed: compressed.to_vec(),
            files: Files { fast: fast?, archive: archive.map(|a| a.0) },
            seconds: Seconds {
                network: network_seconds,
                compression,
                octree: octree_seconds,
                octree_of_voxels: dense,
                fast: fast_seconds,
                archive: archive.map(|a| a.1),
            },
        })
    }

    /// The data in one reading.
    pub fn compression(&self, reading: Reading) -> Option<&Compression> {
        self.compressed.iter().find(|c| c.reading == reading)
    }
}

/// A result and the least time that it took.
fn timed<T>(work: impl Fn() -> T) -> (T, f64) {
    let (mut least, mut spent, mut times) = (f64::INFINITY, 0.0, 0);
    loop {
        let begin = Instant::now();
        let result = work();
        let took = begin.elapsed().as_secs_f64();
        (least, spent, times) = (least.min(took), spent + took, times + 1);
        if spent > TIMED_SECONDS || times == MOST_TIMED {
            return (result, least);
        }
    }
}

/// Bytes of a whole file.
fn bytes(solid: &Spans, mode: Mode, run: &Run) -> Result<usize> {
    let mut writer = SolidWriter::new(solid.dims(), solid.placement, mode);
    writer.push(solid, run)?;
    Ok(writer.finish().len())
}

/// How long the octree takes from the voxel model, each of whose voxels is looked at.
fn voxel_octree(solid: &Spans) -> Result<f64> {
    let block = solid.read(Region::all(solid.dims()))?;
    let octofold::volume::Block::U8(voxels) = block else { return Ok(0.0) };
    let side = solid.dims()[0];
    Ok(timed(|| mixed_of_voxels(&voxels, side)).1)
}

/// Mixed nodes of the octree of a cube of voxels, level by level from the finest: 0 is empty, 1 full
/// and 2 mixed.
fn mixed_of_voxels(voxels: &[u8], side: usize) -> u64 {
    let mut mixed = 0;
    let mut level: std::borrow::Cow<[u8]> = voxels.into();
    let mut side = side;
    while side > 1 {
        let half = side.div_ceil(2);
        let mut above = Vec::with_capacity(half.pow(3));
        let at = |x: usize, y: usize, z: usize| {
            if x < side && y < side && z < side { level[(z * side + y) * side + x] } else { 0 }
        };
        for z in 0..half {
            for y in 0..half {
                for x in 0..half {
                    let first = at(2 * x, 2 * y, 2 * z);
                    let same = first < 2
                        && (1..8).all(|i: usize| {
                            at(2 * x + (i & 1), 2 * y + (i >> 1 & 1), 2 * z + (i >> 2)) == first
                        });
                    above.push(if same { first } else { 2 });
                    mixed += u64::from(!same);
                }
            }
        }
        (level, side) = (above.into(), half);
    }
    mixed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_octrees_are_the_same() {
        for (shape, position) in
            [(Sample::Gear, Position::Upright), (Sample::Csg1, Position::Turned)]
        {
            let solid = shape.voxels(32).unwrap().posed(position.pose());
            let solid = solid.spans(&Run::default()).unwrap();
            let block = solid.read(Region::all(solid.dims())).unwrap();
            let octofold::volume::Block::U8(voxels) = block else { panic!() };
            assert_eq!(mixed_of_voxels(&voxels, 32), octree(&solid).mixed);
        }
    }

    #[test]
    fn shapes_stay_within_their_grid() {
        for shape in super::super::SHAPES {
            for position in Position::ALL {
                let mask = shape.voxels(64).unwrap().posed(position.pose());
                let extent = mask.spans(&Run::default()).unwrap().extent().unwrap();
                let within = (0..3).all(|a| extent.start[a] > 0 && extent.end[a] < 64);
                assert!(within, "{} {}: {extent:?}", shape.name(), position.name());
            }
        }
    }
}
