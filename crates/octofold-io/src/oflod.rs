//! Octofold's own format of level-of-detail models, `.oflod`.
//!
//! All numbers are little-endian.
//!
//! | bytes | what |
//! | --- | --- |
//! | 4 | `OFL` and the version, 1 |
//! | 4 | flags: 1 colours, 2 coded; the unit in bits 8 to 11, counted from 1; where coded, the form of the code less 1 in bits 16 to 23 |
//! | 8 | levels below the root |
//! | 8 | octants |
//! | 96 | axes and origin of the place of finest cells in the world |
//! | 8 | bytes behind the header |
//! | 8 | CRC-32C of all before it |
//!
//! Behind the header stand the columns of [`octofold::lod::Parts`] one after the other: nodes (8 bytes
//! an octant), vertices (3), normals (2), errors, shapes and traits (1 each), colours (4, where there
//! are any). A file is opened by mapping it; only nodes are looked through, and then every walk is
//! safe. Where the columns are coded, their stream takes this place, with its own CRC-32C before it.
//! Codes of other forms than the newest are refused.

use crate::ofn::{UNITS, crc32c};
use crate::slabs::lost;
use crate::source::Bytes;
use crate::{At, ReadError, Sink, Source, WriteError};
use bytemuck::Pod;
use octofold::lod::{Column, Lod, LodError, Node, Parts};
use octofold::{Placement, Run};
use std::sync::Arc;

const FORMAT: &str = "oflod";

/// The name and version that a file begins with.
const MAGIC: &[u8] = b"OFL\x01";

/// Bytes of the header.
const HEADER: usize = 136;

const COLOURED: u32 = 1;
const CODED: u32 = 2;

/// The form of the code that is written and read.
const FORM: u32 = 2;

/// Bytes of an octant in columns, without its colour.
const OCTANT: usize = 16;

/// Bytes of a colour.
const COLOUR: usize = 4;

/// Writes a model: as columns that can be mapped, or coded in a fraction of their bytes.
pub fn write(lod: &Lod, coded: bool, sink: &mut Sink<'_>, run: &Run) -> Result<(), WriteError> {
    run.stage("write");
    let parts = lod.parts();
    let body = if coded {
        let stream = lod.encoded(run)?;
        let mut body = u64::from(crc32c(&stream)).to_le_bytes().to_vec();
        body.extend(stream);
        body
    } else {
        let mut body: Vec<u8> = bytemuck::cast_slice(&parts.nodes).to_vec();
        body.extend_from_slice(parts.vertices.as_flattened());
        body.extend_from_slice(parts.normals.as_flattened());
        body.extend_from_slice(&parts.errors);
        body.extend_from_slice(&parts.shapes);
        body.extend_from_slice(&parts.traits);
        if let Some(colours) = &parts.colours {
            body.extend_from_slice(colours.as_flattened());
        }
        body
    };
    sink.out.write_all(&header(parts, coded, body.len())).map_err(lost)?;
    sink.out.write_all(&body).map_err(lost)
}

fn header(parts: &Parts, coded: bool, body: usize) -> Vec<u8> {
    let unit = parts.frame.unit.and_then(|unit| UNITS.iter().position(|u| *u == unit));
    let flag = |set, flag| if set { flag } else { 0 };
    let flags = flag(parts.colours.is_some(), COLOURED)
        | flag(coded, CODED | (FORM - 1) << 16)
        | unit.map_or(0, |unit| (unit as u32 + 1) << 8);
    let mut out = MAGIC.to_vec();
    out.extend(flags.to_le_bytes());
    out.extend(u64::from(parts.levels).to_le_bytes());
    out.extend((parts.nodes.len() as u64).to_le_bytes());
    let place = parts.frame.axes.as_flattened().iter().chain(&parts.frame.origin);
    out.extend(place.flat_map(|v| v.to_le_bytes()));
    out.extend((body as u64).to_le_bytes());
    out.extend(u64::from(crc32c(&out)).to_le_bytes());
    out
}

/// Opens a model. Columns stay in the file and are read where they are needed.
pub fn read(source: &Source, run: &Run) -> Result<Lod, ReadError> {
    run.stage("open");
    let found = open(&source.bytes, run);
    found.map_err(|error| match error {
        ReadError::Cancelled(_) => error,
        _ => ReadError::In { path: source.path.clone(), source: Box::new(error) },
    })
}

fn open(bytes: &Bytes, run: &Run) -> Result<Lod, ReadError> {
    let wrong = |at: usize, fact: &str| ReadError::malformed(FORMAT, At::Byte(at as u64), fact);
    match bytes.get(..4) {
        Some(MAGIC) => {}
        Some([b'O', b'F', b'L', version]) => {
            let fact = format!("version {version} of the format is not known here");
            return Err(ReadError::unsupported(FORMAT, fact));
        }
        _ => return Err(wrong(0, "the file does not begin with OFL")),
    }
    let Some(head) = bytes.get(..HEADER) else {
        return Err(wrong(bytes.len(), "the file is cut off within its header"));
    };
    let word = |at: usize| {
        let mut word = [0; 8];
        word.copy_from_slice(&head[at..at + 8]);
        word
    };
    let count = |at: usize| u64::from_le_bytes(word(at));
    if count(HEADER - 8) != u64::from(crc32c(&head[..HEADER - 8])) {
        return Err(wrong(HEADER - 8, "the header's checksum does not fit it: it is damaged"));
    }
    let flags = (count(0) >> 32) as u32;
    let number = |i: usize| f64::from_le_bytes(word(24 + 8 * i));
    let unit = match flags >> 8 & 15 {
        0 => None,
        unit => Some(*UNITS.get(unit as usize - 1).ok_or_else(|| wrong(5, "no such unit"))?),
    };
    let axes = [0, 1, 2].map(|c| [0, 1, 2].map(|r| number(3 * c + r)));
    let frame = Placement { axes, origin: [9, 10, 11].map(number), unit };
    let body = bytes.len() - HEADER;
    if count(120) != body as u64 {
        let fact = format!("{} bytes should follow the header, and {body} do", count(120));
        return Err(wrong(HEADER, &fact));
    }
    let (octants, coloured) = (count(16), flags & COLOURED != 0);
    let levels = u32::try_from(count(8)).unwrap_or(u32::MAX);
    if flags & CODED != 0 {
        let form = (flags >> 16 & 255) + 1;
        if form != FORM {
            let fact = format!(
                "its octants are coded in form {form}, and only form {FORM} is read here: write it anew \
                 with `lod build`"
            );
            return Err(ReadError::unsupported(FORMAT, fact));
        }
        let Some(stream) = bytes.get(HEADER + 8..) else {
            return Err(wrong(HEADER, "the file is cut off"));
        };
        let mut sum = [0; 8];
        sum.copy_from_slice(&bytes[HEADER..HEADER + 8]);
        if u64::from_le_bytes(sum) != u64::from(crc32c(stream)) {
            return Err(wrong(HEADER, "the checksum of its octants does not fit: it is damaged"));
        }
        let lod = Lod::decoded(stream, levels, frame, octants, coloured, run);
        return lod.map_err(damaged);
    }
    let wanted = (OCTANT + if coloured { COLOUR } else { 0 }) as u64;
    if octants.checked_mul(wanted) != Some(body as u64) {
        let fact = format!("{octants} octants of {wanted} bytes do not take {body} bytes");
        return Err(wrong(HEADER, &fact));
    }
    let n = octants as usize;
    let shared = Arc::new(bytes.clone());
    let mut next = HEADER;
    let parts = Parts {
        levels,
        frame,
        nodes: column::<Node>(&shared, &mut next, n)?,
        vertices: column(&shared, &mut next, n)?,
        normals: column(&shared, &mut next, n)?,
        errors: column(&shared, &mut next, n)?,
        shapes: column(&shared, &mut next, n)?,
        traits: column(&shared, &mut next, n)?,
        colours: if coloured { Some(column(&shared, &mut next, n)?) } else { None },
    };
    Lod::from_parts(parts).map_err(damaged)
}

fn damaged(error: LodError) -> ReadError {
    match error {
        LodError::Cancelled(cancelled) => cancelled.into(),
        error => ReadError::malformed(FORMAT, At::File, error.to_string()),
    }
}

/// The next `count` items, where they lie.
fn column<T: Pod>(
    bytes: &Arc<Bytes>,
    next: &mut usize,
    count: usize,
) -> Result<Column<T>, ReadError> {
    let range = *next..*next + count * size_of::<T>();
    *next = range.end;
    if let Some(column) = Column::shared(bytes.clone(), range.clone()) {
        return Ok(column);
    }
    // Bytes in memory need not be aligned.
    let mut items = vec![T::zeroed(); count];
    let held: &[u8] = bytes.get(range).unwrap_or_default();
    if held.len() != count * size_of::<T>() {
        return Err(ReadError::malformed(FORMAT, At::File, "the file is cut off"));
    }
    bytemuck::cast_slice_mut(&mut items).copy_from_slice(held);
    Ok(items.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use octofold::lod::{BuildOptions, build};
    use octofold::samples::Sample;

    fn model(level: u32, coloured: bool) -> Lod {
        let mut mesh = Sample::Torus.polygons(12).unwrap().triangulate();
        if coloured {
            let colours = (0..mesh.points.len()).map(|i| [i as u8, 128, 255 - i as u8, 255]);
            mesh.attributes.point_colours = Some(colours.collect());
        }
        build(&mesh, &BuildOptions { level, ..BuildOptions::default() }, &Run::default()).unwrap()
    }

    fn written(lod: &Lod, coded: bool) -> Vec<u8> {
        let mut bytes = Vec::new();
        write(lod, coded, &mut Sink::new(&mut bytes, "x"), &Run::default()).unwrap();
        bytes
    }

    fn opened(bytes: &[u8]) -> Result<Lod, ReadError> {
        read(&Source::from_bytes("x.oflod", bytes), &Run::default())
    }

    #[test]
    fn both_forms_keep_everything() {
        for coloured in [false, true] {
            let lod = model(6, coloured);
            for coded in [false, true] {
                assert_eq!(opened(&written(&lod, coded)).unwrap(), lod, "{coloured} {coded}");
            }
        }
    }

    #[test]
    fn files_are_mapped_and_pinned_byte_for_byte() {
        let lod = model(2, true);
        let sums = [false, true].map(|coded| {
            let bytes = written(&lod, coded);
            (bytes.len(), crc32c(&bytes))
        });
        assert_eq!(sums, [(956, 1_815_060_517), (551, 2_185_628_462)]);
        let mut file = tempfile::NamedTempFile::new().unwrap();
        std::io::Write::write_all(&mut file, &written(&lod, false)).unwrap();
        let source = Source::open(file.path()).unwrap();
        assert_eq!(read(&source, &Run::default()).unwrap(), lod);
    }

    #[test]
    fn codes_of_another_form_are_refused() {
        let mut bytes = written(&model(2, false), true);
        bytes[6] = 0;
        let sum = u64::from(crc32c(&bytes[..HEADER - 8]));
        bytes[HEADER - 8..HEADER].copy_from_slice(&sum.to_le_bytes());
        let error = opened(&bytes).unwrap_err();
        let told = std::error::Error::source(&error).map_or(error.to_string(), |e| e.to_string());
        assert!(told.contains("coded in form 1, and only form 2"), "{told}");
    }

    #[test]
    fn every_prefix_and_much_damage_is_an_error_or_harmless() {
        use octofold::lod::{Criterion, Cut, Diagonal, Mode, drawn, patches, settled};
        let lod = model(3, true);
        let mut random = crate::dice::dice();
        for coded in [false, true] {
            let bytes = written(&lod, coded);
            for end in 0..bytes.len() {
                assert!(opened(&bytes[..end]).is_err(), "{end}");
            }
            for _ in 0..400 {
                let mut damaged = bytes.clone();
                for _ in 0..1 + random() % 3 {
                    let at = random() % damaged.len();
                    damaged[at] = random() as u8;
                }
                if coded {
                    let sum = u64::from(crc32c(&damaged[HEADER + 8..]));
                    damaged[HEADER..HEADER + 8].copy_from_slice(&sum.to_le_bytes());
                }
                let sum = u64::from(crc32c(&damaged[..HEADER - 8]));
                damaged[HEADER - 8..HEADER].copy_from_slice(&sum.to_le_bytes());
                let Ok(lod) = opened(&damaged) else { continue };
                let run = Run::default();
                for mode in Mode::ALL {
                    let cut = Cut::select(&lod, &Criterion::Tolerance(0.02), &run).unwrap();
                    let cut = settled(&lod, cut, mode, &run).unwrap().cut;
                    let found = patches(&lod, &cut, mode, &run).unwrap();
                    let drawn = drawn(&lod, &cut, &found, mode, Diagonal::Flatter, &run).unwrap();
                    drawn.mesh.check().unwrap();
                }
            }
        }
    }
}
