//! The writer: the volume in models of at most 256 voxels a side, placed by the scene.

use super::scene::pivot;
use super::{FORMAT, palette};
use crate::slabs::lost;
use crate::{Sink, WriteError};
use octofold::volume::Region;
use octofold::{Finding, Run, Volume};

/// Voxels along a side of a model, at most.
const SIDE: usize = 256;

/// Writes palette indices: whole numbers from 0 (nothing) to 255, coloured by the labels.
pub fn write(volume: &dyn Volume, sink: &mut Sink<'_>, run: &Run) -> Result<(), WriteError> {
    if !volume.scalar_type().is_integer() {
        let fact = "its voxels are labels from 0 to 255, not measured values: write .nrrd".into();
        return Err(WriteError::Unfit { format: FORMAT, fact });
    }
    let corner = corner(volume, run);
    let mut models = Vec::new();
    for region in tiles(volume.dims()) {
        let count = voxels(volume, region, run)?.len();
        models.push((region, count));
    }
    // Empty models say nothing, but a file needs one.
    if models.iter().any(|&(_, count)| count > 0) {
        models.retain(|&(_, count)| count > 0);
    } else {
        models.truncate(1);
    }
    let scene = scene(&models, corner);
    let colours = colours(volume);
    let length: usize = models.iter().map(|(_, count)| 12 + 12 + 12 + 4 + 4 * count).sum();
    let length = length + scene.len() + colours.len();
    let Ok(length) = u32::try_from(length) else {
        let fact = "it has more full voxels than 4 GiB hold: write .nrrd".into();
        return Err(WriteError::Unfit { format: FORMAT, fact });
    };
    let mut head = b"VOX ".to_vec();
    put(&mut head, [150]);
    head.extend(b"MAIN");
    put(&mut head, [0, length]);
    sink.out.write_all(&head).map_err(lost)?;
    for (region, _) in models {
        let mut size = Vec::new();
        put(&mut size, region.dims().map(|n| n as u32));
        let voxels = voxels(volume, region, run)?;
        let mut chunks = chunk(b"SIZE", &size);
        chunks.extend(b"XYZI");
        put(&mut chunks, [4 + 4 * voxels.len() as u32, 0, voxels.len() as u32]);
        sink.out.write_all(&chunks).map_err(lost)?;
        sink.out.write_all(voxels.as_flattened()).map_err(lost)?;
    }
    sink.out.write_all(&scene).map_err(lost)?;
    sink.out.write_all(&colours).map_err(lost)
}

/// The world's voxel of sample (0, 0, 0): as placed, where samples are the middles of the world's
/// voxels, else the origin.
fn corner(volume: &dyn Volume, run: &Run) -> [i64; 3] {
    let placement = volume.placement();
    let upright = placement.axes == octofold::Placement::default().axes;
    let corner = placement.origin.map(|v| v - 0.5);
    if upright && corner.iter().all(|v| v.fract() == 0.0 && v.abs() < 1e9) {
        return corner.map(|v| v as i64);
    }
    let text = "vox voxels are unit cubes at whole coordinates: the placement was lost";
    run.finding(Finding::warning("placement-lost", text));
    [0; 3]
}

/// The boxes of the models.
fn tiles(dims: [usize; 3]) -> impl Iterator<Item = Region> {
    let starts = move |a: usize| (0..dims[a]).step_by(SIDE);
    starts(2).flat_map(move |z| {
        starts(1).flat_map(move |y| {
            starts(0).map(move |x| {
                let start = [x, y, z];
                Region { start, end: std::array::from_fn(|a| (start[a] + SIDE).min(dims[a])) }
            })
        })
    })
}

/// The full voxels of a model: x, y, z, index.
fn voxels(volume: &dyn Volume, model: Region, run: &Run) -> Result<Vec<[u8; 4]>, WriteError> {
    let [width, height, _] = model.dims();
    let mut voxels = Vec::new();
    for z in model.start[2]..model.end[2] {
        run.check()?;
        let mut slice = model;
        (slice.start[2], slice.end[2]) = (z, z + 1);
        let block = volume.read(slice)?;
        octofold::with_samples!(&block, samples => {
            for (y, row) in samples.chunks_exact(width).enumerate().take(height) {
                for (x, &sample) in row.iter().enumerate() {
                    let value = octofold::volume::Scalar::to_f64(sample);
                    if value == 0.0 {
                        continue;
                    }
                    if !(1.0..=255.0).contains(&value) {
                        let fact = format!(
                            "a sample is {value}, but labels go from 0 to 255: write .nrrd"
                        );
                        return Err(WriteError::Unfit { format: FORMAT, fact });
                    }
                    let z = z - model.start[2];
                    voxels.push([x as u8, y as u8, z as u8, value as u8]);
                }
            }
        });
    }
    Ok(voxels)
}

/// A transform, a group, and a transform and a shape for each model.
fn scene(models: &[(Region, usize)], corner: [i64; 3]) -> Vec<u8> {
    let mut out = transform(0, 1, None);
    let mut group = Vec::new();
    put(&mut group, [1, 0, models.len() as u32]);
    put(&mut group, (0..models.len() as u32).map(|i| 2 + 2 * i));
    out.extend(chunk(b"nGRP", &group));
    for (i, (region, _)) in (0u32..).zip(models) {
        let pivot = pivot(region.dims().map(|n| n as u32));
        let shift = std::array::from_fn(|a| corner[a] + region.start[a] as i64 + pivot[a]);
        out.extend(transform(2 + 2 * i, 3 + 2 * i, Some(shift)));
        let mut shape = Vec::new();
        put(&mut shape, [3 + 2 * i, 0, 1, i, 0]);
        out.extend(chunk(b"nSHP", &shape));
    }
    out
}

fn transform(id: u32, child: u32, shift: Option<[i64; 3]>) -> Vec<u8> {
    let mut content = Vec::new();
    // No attributes, the child, -1 as the format asks, no layer, one frame.
    put(&mut content, [id, 0, child, u32::MAX, u32::MAX, 1]);
    match shift {
        None => put(&mut content, [0]),
        Some([x, y, z]) => {
            let text = format!("{x} {y} {z}");
            put(&mut content, [1, 2]);
            content.extend(b"_t");
            put(&mut content, [text.len() as u32]);
            content.extend(text.as_bytes());
        }
    }
    chunk(b"nTRN", &content)
}

/// The colours of the labels, and of the default palette where there is none.
fn colours(volume: &dyn Volume) -> Vec<u8> {
    let mut palette = palette::default();
    for label in volume.labels() {
        let slot = label.value.checked_sub(1).and_then(|i| palette.get_mut(i as usize));
        if let Some(slot) = slot {
            *slot = label.colour;
        }
    }
    let mut content = palette.as_flattened().to_vec();
    put(&mut content, [0]);
    chunk(b"RGBA", &content)
}

fn chunk(id: &[u8; 4], content: &[u8]) -> Vec<u8> {
    let mut out = id.to_vec();
    put(&mut out, [content.len() as u32, 0]);
    out.extend(content);
    out
}

fn put(out: &mut Vec<u8>, numbers: impl IntoIterator<Item = u32>) {
    out.extend(numbers.into_iter().flat_map(u32::to_le_bytes));
}
