//! binvox: full and empty voxels, run-length encoded.
//!
//! Version 1 reads as a binary volume; in version 2 full voxels have values from 1 to 255, which
//! are kept.
//! In the file y runs fastest, then z, then x, and the header's `dim` counts along x, z and y in
//! that order; here x is made the fastest. Voxels are cubes: with the largest dimension `d`, the
//! centre of voxel `i` lies at `scale * (i + 0.5) / d + translate`.
//! Source: Patrick Min's description of the format, versions 1 and 2.

use crate::{At, ReadError, Sink, Source, WriteError, mapped::sound_placement, slabs::lost};
use octofold::volume::{Block, DenseVolume, Region};
use octofold::{Finding, Placement, Run, Volume};

const FORMAT: &str = "binvox";

/// Voxels that one run covers at most.
const MAX_RUN: usize = u8::MAX as usize;

/// Samples that the writer holds at a time, unless one slice of x is larger.
const SLAB: usize = 4 << 20;

/// Reads a volume, binary where the file is of version 1.
pub fn read(source: &Source, run: &Run) -> Result<Box<dyn Volume>, ReadError> {
    let bytes = &source.bytes;
    let header = Header::parse(bytes)?;
    let runs = &bytes[header.end..];
    let [nx, ny, nz] = header.dims;
    let count = nx.checked_mul(ny).and_then(|n| n.checked_mul(nz));
    let count = count.filter(|&n| n <= runs.len() / 2 * MAX_RUN).ok_or_else(|| {
        let fact = format!(
            "{nx} x {ny} x {nz} voxels are more than {} runs can cover: the data is cut off",
            runs.len() / 2
        );
        ReadError::malformed(FORMAT, At::Byte(bytes.len() as u64), fact)
    })?;
    let mut samples = vec![0u8; count];
    let mut done = 0;
    let mut taken = 0;
    for (i, pair) in runs.chunks_exact(2).enumerate() {
        if done == count {
            break;
        }
        if i % (1 << 16) == 0 {
            run.check()?;
            run.progress(done as u64, count as u64);
        }
        let end = done + usize::from(pair[1]);
        if end > count {
            let at = At::Byte((header.end + 2 * i) as u64);
            let fact = format!("a run ends at voxel {end}, but there are {count}");
            return Err(ReadError::malformed(FORMAT, at, fact));
        }
        if pair[0] != 0 {
            for at in done..end {
                let (x, z, y) = (at / (ny * nz), at / ny % nz, at % ny);
                samples[(z * ny + y) * nx + x] = if header.binary { 1 } else { pair[0] };
            }
        }
        done = end;
        taken = 2 * (i + 1);
    }
    if done < count {
        let fact = format!("the data ends after {done} of {count} voxels");
        return Err(ReadError::malformed(FORMAT, At::Byte(bytes.len() as u64), fact));
    }
    if taken < runs.len() {
        run.finding(Finding::note("trailing-data", "more data follows the last voxel"));
    }
    let placement = sound_placement(header.placement(), run);
    let volume = DenseVolume::new(header.dims, samples, placement).map(|mut volume| {
        volume.binary = header.binary;
        Box::new(volume) as Box<dyn Volume>
    });
    volume.ok_or_else(|| ReadError::malformed(FORMAT, At::File, "the dimensions are damaged"))
}

struct Header {
    /// Along x, y, z.
    dims: [usize; 3],
    /// Voxels are full or empty, nothing else.
    binary: bool,
    translate: [f64; 3],
    scale: f64,
    /// First byte of the runs.
    end: usize,
}

impl Header {
    fn parse(bytes: &[u8]) -> Result<Self, ReadError> {
        let mut header =
            Self { dims: [0; 3], binary: true, translate: [0.0; 3], scale: 1.0, end: 0 };
        for number in 1.. {
            let malformed = |fact: &str| ReadError::malformed(FORMAT, At::Line(number), fact);
            let rest = &bytes[header.end..];
            let Some(length) = rest.iter().position(|&b| b == b'\n') else {
                return Err(malformed("the header is cut off: there is no line `data`"));
            };
            header.end += length + 1;
            let line = String::from_utf8_lossy(&rest[..length]);
            let mut words = line.split_whitespace();
            let keyword = words.next().unwrap_or_default();
            let numbers: Option<Vec<f64>> = words
                .take_while(|word| !word.starts_with('#'))
                .map(|word| word.parse().ok())
                .collect();
            match (number, keyword, numbers.as_deref()) {
                (1, "#binvox", Some([1.0])) => {}
                (1, "#binvox", Some([2.0])) => header.binary = false,
                (1, "#binvox", _) => {
                    let fact = "only versions 1 and 2 of the format are known here";
                    return Err(ReadError::unsupported(FORMAT, fact));
                }
                (1, ..) => return Err(malformed("the file does not begin with #binvox 1")),
                (_, "dim", Some(&[x, z, y])) => {
                    let is_count = |n: &f64| *n >= 1.0 && *n <= 1e9 && n.fract() == 0.0;
                    if ![x, y, z].iter().all(is_count) {
                        return Err(malformed("the dimensions are no three counts"));
                    }
                    header.dims = [x as usize, y as usize, z as usize];
                }
                (_, "translate", Some(&[x, y, z])) => header.translate = [x, y, z],
                (_, "scale", Some(&[scale])) => header.scale = scale,
                (_, "dim" | "translate" | "scale", _) => {
                    return Err(malformed("the numbers on this line are damaged"));
                }
                (_, "data", _) if header.dims[0] > 0 => return Ok(header),
                (_, "data", _) => return Err(malformed("there is no line `dim` before `data`")),
                // Comments, empty lines and keywords of later programs.
                _ => {}
            }
        }
        Err(ReadError::malformed(FORMAT, At::File, "the header does not end"))
    }

    fn placement(&self) -> Placement {
        let longest = self.dims.into_iter().max().unwrap_or(1) as f64;
        let step = self.scale / longest;
        let origin = self.translate.map(|t| t + step / 2.0);
        Placement { origin, ..Placement::spacing([step; 3]) }
    }
}

/// Writes a binary volume; any other does not fit.
pub fn write(volume: &dyn Volume, sink: &mut Sink<'_>, run: &Run) -> Result<(), WriteError> {
    if !volume.is_binary() {
        let fact = "its voxels are full or empty only: voxelize first, or write .nrrd".into();
        return Err(WriteError::Unfit { format: FORMAT, fact });
    }
    let dims @ [nx, ny, nz] = volume.dims();
    let (step, origin) = cubes(&volume.placement()).unwrap_or_else(|| {
        let text = "binvox voxels are upright cubes: the placement was lost, samples lie 1 apart";
        run.finding(Finding::warning("placement-lost", text));
        (1.0, [0.0; 3])
    });
    let [tx, ty, tz] = origin.map(|o| o - step / 2.0);
    let scale = step * nx.max(ny).max(nz) as f64;
    let header = format!(
        "#binvox 1\ndim {nx} {nz} {ny}\ntranslate {tx:?} {ty:?} {tz:?}\nscale {scale:?}\ndata\n"
    );
    sink.out.write_all(header.as_bytes()).map_err(lost)?;
    let thickness = (SLAB / (ny * nz).max(1)).max(1);
    let mut runs = Runs { value: 0, length: 0, out: Vec::new() };
    for start in (0..nx).step_by(thickness) {
        let end = (start + thickness).min(nx);
        let region = Region { start: [start, 0, 0], end: [end, dims[1], dims[2]] };
        let Block::U8(samples) = volume.read(region)? else {
            let fact = "its samples are not bytes".into();
            return Err(WriteError::Unfit { format: FORMAT, fact });
        };
        for x in 0..end - start {
            run.check()?;
            run.progress((start + x) as u64, nx as u64);
            // Along z, then y, exactly as the rows of the block follow each other.
            for row in samples.chunks_exact(end - start) {
                runs.push(u8::from(row[x] != 0));
            }
            sink.out.write_all(&runs.out).map_err(lost)?;
            runs.out.clear();
        }
    }
    runs.flush();
    sink.out.write_all(&runs.out).map_err(lost)
}

/// Spacing and origin, where voxels are upright cubes.
fn cubes(placement: &Placement) -> Option<(f64, [f64; 3])> {
    let step = placement.axes[0][0];
    let upright = Placement::spacing([step; 3]).axes;
    let near = |a: &f64, b: &f64| (a - b).abs() <= step * 1e-6;
    let same = placement.axes.iter().flatten().zip(upright.iter().flatten());
    (step > 0.0 && same.into_iter().all(|(a, b)| near(a, b))).then_some((step, placement.origin))
}

/// Pairs of value and length.
struct Runs {
    value: u8,
    length: u8,
    out: Vec<u8>,
}

impl Runs {
    fn push(&mut self, value: u8) {
        if value != self.value || self.length == u8::MAX {
            self.flush();
            self.value = value;
        }
        self.length += 1;
    }

    fn flush(&mut self) {
        if self.length > 0 {
            self.out.extend([self.value, self.length]);
            self.length = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(header: &str, runs: &[u8]) -> Source {
        Source::from_bytes("x.binvox", [header.as_bytes(), runs].concat())
    }

    #[test]
    fn y_runs_fastest_then_z_then_x() {
        let header = "#binvox 1\n# note\ndim 2 3 4\ntranslate 1 2 3 # why\nscale 8\ndata\n";
        // Voxel (1, 0, 0) is number 12, voxel (0, 0, 1) is number 4, voxel (0, 1, 0) number 1.
        let runs = [0, 1, 1, 1, 0, 2, 1, 1, 0, 7, 1, 1, 0, 11];
        let volume = read(&source(header, &runs), &Run::default()).unwrap();
        assert_eq!(volume.dims(), [2, 4, 3]);
        assert!(volume.is_binary());
        let block = volume.read(Region::all([2, 4, 3])).unwrap();
        let ones: Vec<_> = (0..24).filter(|&i| block.value(i) == 1.0).collect();
        assert_eq!(ones, [1, 2, 8]);
        assert_eq!(volume.placement().place([0.0; 3]), [2.0, 3.0, 4.0]);
        assert_eq!(volume.placement().place([1.0, 1.0, 1.0]), [4.0, 5.0, 6.0]);
    }

    #[test]
    fn runs_must_fill_the_box_exactly() {
        let header = "#binvox 1\ndim 2 2 2\ndata\n";
        for (runs, says) in [
            (&[0u8, 7][..], "after 7 of 8"),
            (&[0, 7, 1, 2], "ends at voxel 9"),
            (&[], "0 runs can cover"),
        ] {
            let error = read(&source(header, runs), &Run::default()).err().unwrap();
            assert!(error.to_string().contains(says), "{error}");
        }
        assert!(read(&source(header, &[0, 8]), &Run::default()).is_ok());
    }

    #[test]
    fn version_2_keeps_values() {
        let header = "#binvox 2\ndim 1 1 2\ndata\n";
        let volume = read(&source(header, &[7, 1, 0, 1]), &Run::default()).unwrap();
        assert!(!volume.is_binary());
        let all = volume.read(Region::all([1, 2, 1])).unwrap();
        assert_eq!(all, Block::U8(vec![7, 0].into()));
    }

    #[test]
    fn absurd_dimensions_are_refused() {
        for dim in ["999999999 999999999 999999999", "1e300 1 1", "-1 1 1", "nan 1 1", "0 1 1"] {
            let header = format!("#binvox 1\ndim {dim}\ndata\n");
            assert!(read(&source(&header, &[0, 255]), &Run::default()).is_err(), "{dim}");
        }
        assert!(read(&source("#binvox 3\ndim 1 1 1\ndata\n", &[0, 1]), &Run::default()).is_err());
    }
}
