//! MagicaVoxel `.vox`: coloured voxels in a scene of models.
//!
//! All shapes of the scene are placed into one volume of palette indices, 0 where there is
//! nothing, whose labels are the colours of the indices in use; where shapes overlap, the later
//! one wins. Voxel (x, y, z) of the world fills the cube from there to one further along each
//! axis, z up, so its sample lies at its middle. Hidden nodes and layers are left out, of
//! animations the first frame is read.
//!
//! The format is read here and not by a crate: the one there is drops truncated chunks and node
//! numbers without a word, and panics on damaged rotations.
//! Source: the format descriptions in the repository `voxel-model` of MagicaVoxel's author.

mod chunks;
mod encode;
mod palette;
mod scene;

use crate::{At, ReadError, Source};
use chunks::{Chunk, Cursor};
use octofold::volume::DenseVolume;
use octofold::volume::Label;
use octofold::{Finding, Placement, Run, Volume};
use scene::{Pose, Scene};

pub use encode::write;

const FORMAT: &str = "vox";

/// The most samples that a scene is filled into.
const MAX_SAMPLES: usize = 1 << 30;

/// Shapes may fill their common box so many times over.
const MAX_OVERLAP: u64 = 8;

/// One model: its size and its voxels, as x, y, z and palette index.
struct Model<'a> {
    size: [u32; 3],
    voxels: &'a [[u8; 4]],
}

/// Reads the scene as one volume of palette indices.
pub fn read(source: &Source, run: &Run) -> Result<Box<dyn Volume>, ReadError> {
    let file = File::parse(&source.bytes)?;
    let placed = file.scene.shapes(&file.models, run)?;
    let mut low = [i64::MAX; 3];
    let mut high = [i64::MIN; 3];
    let mut voxels = 0u64;
    for (model, pose) in &placed {
        let (first, last) = pose.bounds(model.size);
        for a in 0..3 {
            low[a] = low[a].min(first[a]);
            high[a] = high[a].max(last[a]);
        }
        voxels += model.voxels.len() as u64;
    }
    if placed.is_empty() {
        return Err(ReadError::malformed(FORMAT, At::File, "the scene shows no voxels"));
    }
    let dims: [u64; 3] = std::array::from_fn(|a| (high[a] - low[a]) as u64);
    let [x, y, z] = dims;
    let count = x.checked_mul(y).and_then(|n| n.checked_mul(z));
    let Some(count) = count.filter(|&n| n <= MAX_SAMPLES as u64) else {
        let fact = format!(
            "the scene spans {x} x {y} x {z} voxels, more than the {MAX_SAMPLES} that are read: \
             move its parts closer together"
        );
        return Err(ReadError::unsupported(FORMAT, fact));
    };
    if voxels > MAX_OVERLAP * count {
        let fact = format!("{voxels} voxels lie in {count} places: shapes lie on each other");
        return Err(ReadError::malformed(FORMAT, At::File, fact));
    }
    let dims = dims.map(|n| n as usize);
    let mut samples = vec![0u8; count as usize];
    let mut used = [false; 256];
    for (i, (model, pose)) in placed.iter().enumerate() {
        run.check()?;
        run.progress(i as u64, placed.len() as u64);
        for &[x, y, z, index] in model.voxels {
            let world = pose.place([x, y, z].map(i64::from), model.size);
            let [x, y, z]: [usize; 3] = std::array::from_fn(|a| (world[a] - low[a]) as usize);
            samples[(z * dims[1] + y) * dims[0] + x] = index;
            used[usize::from(index)] = true;
        }
    }
    let origin = low.map(|v| v as f64 + 0.5);
    let placement = Placement { origin, ..Placement::default() };
    let volume = DenseVolume::new(dims, samples, placement).map(|mut volume| {
        volume.labels = file.labels(&used);
        Box::new(volume) as Box<dyn Volume>
    });
    volume.ok_or_else(|| ReadError::malformed(FORMAT, At::File, "the scene is damaged"))
}

/// What a file holds.
struct File<'a> {
    models: Vec<Model<'a>>,
    scene: Scene,
    /// Colours of the indices 1 to 255.
    palette: [[u8; 4]; 255],
}

impl<'a> File<'a> {
    fn parse(bytes: &'a [u8]) -> Result<Self, ReadError> {
        let mut file =
            Self { models: Vec::new(), scene: Scene::default(), palette: palette::default() };
        let mut cursor = Cursor::new(bytes, 0);
        if cursor.take(4)? != b"VOX " {
            let fact = "the file does not begin with VOX";
            return Err(ReadError::malformed(FORMAT, At::Byte(0), fact));
        }
        cursor.u32()?;
        let main = Chunk::next(&mut cursor)?;
        if &main.id != b"MAIN" {
            return Err(ReadError::malformed(FORMAT, At::Byte(8), "the first chunk is not MAIN"));
        }
        let mut cursor = main.children;
        let mut size = None;
        while !cursor.is_empty() {
            let Chunk { id, mut content, .. } = Chunk::next(&mut cursor)?;
            match &id {
                b"SIZE" => size = Some([content.u32()?, content.u32()?, content.u32()?]),
                b"XYZI" => {
                    let size = size.take().ok_or_else(|| {
                        content.malformed("the voxels of a model come before its size")
                    })?;
                    file.models.push(Model::parse(size, content)?);
                }
                b"RGBA" => {
                    for colour in &mut file.palette {
                        colour.copy_from_slice(content.take(4)?);
                    }
                }
                b"nTRN" => file.scene.transform(content)?,
                b"nGRP" => file.scene.group(content)?,
                b"nSHP" => file.scene.shape(content)?,
                b"LAYR" => file.scene.layer(content)?,
                // Materials, cameras, notes and the order of the palette's swatches.
                _ => {}
            }
        }
        Ok(file)
    }

    /// Labels of the palette indices in use.
    fn labels(&self, used: &[bool; 256]) -> Vec<Label> {
        let colours = self.palette.iter().zip(1..);
        colours
            .filter(|&(_, value)| used[value as usize])
            .map(|(&colour, value)| Label { value, name: String::new(), colour })
            .collect()
    }
}

impl<'a> Model<'a> {
    fn parse(size: [u32; 3], mut content: Cursor<'a>) -> Result<Self, ReadError> {
        if size.contains(&0) {
            return Err(content.malformed("a model has the size 0"));
        }
        let count = content.u32()? as usize;
        let voxels = content.clone().take(count.saturating_mul(4))?;
        let (voxels, _) = voxels.as_chunks::<4>();
        for (i, &[x, y, z, _]) in voxels.iter().enumerate() {
            if [x, y, z].iter().zip(size).any(|(&v, size)| u32::from(v) >= size) {
                content.take(4 * i)?;
                let [w, h, d] = size;
                let fact = format!("voxel ({x}, {y}, {z}) is not in its model of {w} x {h} x {d}");
                return Err(content.malformed(fact));
            }
        }
        Ok(Self { size, voxels })
    }
}

impl Scene {
    /// Every visible shape with its pose. A file without scene has its models one on the other.
    fn shapes<'m, 'a>(
        &self,
        models: &'m [Model<'a>],
        run: &Run,
    ) -> Result<Vec<(&'m Model<'a>, Pose)>, ReadError> {
        if self.is_empty() {
            if models.len() > 1 {
                let text = format!("the file holds {} frames: the first was read", models.len());
                run.finding(Finding::warning("first-frame", text).of(models.len() as u64));
            }
            return Ok(models.iter().take(1).map(|m| (m, Pose::corner(m.size))).collect());
        }
        let shapes = self.walk(run)?;
        let place = |(id, pose): (u32, Pose)| match models.get(id as usize) {
            Some(model) => Ok((model, pose)),
            None => {
                let fact = format!("a shape names model {id}, but there are {}", models.len());
                Err(ReadError::malformed(FORMAT, At::File, fact))
            }
        };
        shapes.into_iter().map(place).collect()
    }
}
