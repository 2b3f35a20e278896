//! The files that a command reads and writes: as typed, then validated.

use anyhow::{Context, Result, bail, ensure};
use octofold::network::code::Mode;
use octofold::network::painted::Painted;
use octofold::network::palette::Labelled;
use octofold::pipeline::{Shape, SolidOptions};
use octofold::spans::Spans;
use octofold::volume::ScalarType;
use octofold::{Kind, Run, Soup, Volume};
use octofold_io::raw::RawLayout;
use octofold_io::{Format, Source, WriteError, ofn};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Writes the bytes of a whole file, or nothing.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    Ok(octofold_io::save(path, |sink| {
        let failed = |source| WriteError::Io { path: path.into(), source };
        sink.out.write_all(bytes).map_err(failed)
    })?)
}

/// What names an input, as typed.
#[derive(Debug, clap::Args)]
pub struct InputArgs {
    /// File to read; `-` reads standard input
    #[arg(value_name = "IN")]
    input: PathBuf,
    #[command(flatten)]
    reading: ReadingArgs,
}

/// How inputs are read, as typed.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct ReadingArgs {
    /// Format of the input, where its bytes and name do not tell
    #[arg(long, value_name = "FORMAT", value_parser = parse_format, help_heading = "Reading")]
    from: Option<Format>,
    /// Samples along x, y and z of a raw volume, such as 512x512x300
    #[arg(long, value_name = "XxYxZ", value_parser = parse_dims, help_heading = "Reading")]
    dims: Option<Dims>,
    /// Type of the samples of a raw volume: u8, i8, u16, i16, u32, i32, f32 or f64
    #[arg(long, value_name = "TYPE", value_parser = parse_scalar, help_heading = "Reading")]
    dtype: Option<ScalarType>,
    /// Bytes before the first sample of a raw volume
    #[arg(long, value_name = "BYTES", default_value_t = 0, help_heading = "Reading")]
    offset: u64,
    /// The samples of a raw volume are big-endian
    #[arg(long, help_heading = "Reading")]
    big_endian: bool,
}

/// What names an output, as typed.
#[derive(Debug, clap::Args)]
pub struct OutputArgs {
    /// File to write, its format by its ending; `-` writes standard output
    #[arg(value_name = "OUT")]
    output: PathBuf,
    /// Format of the output, where its name does not tell
    #[arg(long, value_name = "FORMAT", value_parser = parse_format)]
    to: Option<Format>,
}

/// Samples along x, y and z; a type of its own because clap takes an array for a list.
#[derive(Debug, Clone, Copy)]
struct Dims([usize; 3]);

/// An input that can be opened.
pub struct Input {
    path: PathBuf,
    format: Option<Format>,
    layout: Option<RawLayout>,
}

/// An output whose format is known.
#[derive(Debug)]
pub struct Output {
    /// The file, `-` for standard output.
    pub path: PathBuf,
    format: Format,
    layout: ofn::Layout,
}

/// An input that was opened, and what its format holds.
pub struct Opened {
    source: Source,
    format: Format,
    layout: Option<RawLayout>,
}

impl InputArgs {
    /// The input, or why it makes no sense.
    pub fn check(self) -> Result<Input> {
        self.reading.of(&self.input)
    }

    /// The input, a mesh, and `reference` beside it: what says how the samples of a raw volume lie
    /// speaks of the reference.
    pub fn check_beside(self, reference: &Path) -> Result<[Input; 2]> {
        let Self { input, reading } = self;
        let of_input = ReadingArgs { from: reading.from, ..ReadingArgs::default() };
        let of_reference = ReadingArgs { from: None, ..reading };
        Ok([of_input.of(&input)?, of_reference.of(reference)?])
    }
}

impl ReadingArgs {
    /// The input `path`, read this way.
    pub fn of(&self, path: &Path) -> Result<Input> {
        let layout = match (self.dims, self.dtype) {
            (Some(Dims(dims)), Some(scalar)) => {
                Some(RawLayout { dims, scalar, offset: self.offset, big_endian: self.big_endian })
            }
            (None, None) => None,
            _ => bail!("--dims and --dtype go together: a raw volume needs both"),
        };
        let by_name = Format::of_name(&path.to_string_lossy());
        // Whoever says how the samples lie means a raw file, whatever its name.
        let format = self.from.or(layout.and(Some(Format::Raw)));
        ensure!(
            layout.is_some() || format.or(by_name) != Some(Format::Raw),
            "{}: a raw volume does not say what it holds: add --dims XxYxZ --dtype TYPE",
            path.display()
        );
        Ok(Input { path: path.into(), format, layout })
    }
}

impl OutputArgs {
    /// The output, or why it makes no sense.
    pub fn check(self) -> Result<Output> {
        Output::new(self.output, self.to)
    }
}

impl Input {
    /// The file, `-` for standard input.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Opens the file and finds its format.
    pub fn open(&self) -> Result<Opened> {
        let source = Source::open(&self.path)?;
        let format = match self.format {
            Some(format) => format,
            None => Format::of_source(&source)?,
        };
        Ok(Opened { source, format, layout: self.layout })
    }
}

impl Opened {
    /// What the format holds.
    pub fn kind(&self) -> Kind {
        self.format.kind()
    }

    /// True where the format's models stand along y by convention.
    pub fn stands_along_y(&self) -> bool {
        matches!(self.format, Format::Gltf | Format::Glb | Format::Obj)
    }

    /// Reads the shape.
    pub fn read(&self, run: &Run) -> Result<Shape> {
        run.stage("read");
        let (source, format) = (&self.source, Some(self.format));
        Ok(match self.kind() {
            Kind::Mesh => octofold_io::read_mesh(source, format, run)?.into(),
            Kind::Volume => octofold_io::read_volume(source, format, self.layout, run)?.into(),
        })
    }

    /// The header of an `.ofn` file; `None` of any other.
    pub fn network(&self, run: &Run) -> Result<Option<ofn::File>> {
        if self.format != Format::Ofn {
            return Ok(None);
        }
        let file = ofn::File::open(&self.source, run);
        Ok(Some(file.with_context(|| self.source.path.display().to_string())?))
    }

    /// The header of an `.ofn` file; any other is refused.
    pub fn expect_network(&self, run: &Run) -> Result<ofn::File> {
        self.network(run)?.with_context(|| {
            format!(
                "{}: this is no .ofn file: `octofold net encode` makes one",
                self.source.path.display()
            )
        })
    }

    /// Reads a volume that stands for a solid; a mesh is refused.
    pub fn read_volume(&self, run: &Run) -> Result<Arc<dyn Volume>> {
        match self.read(run)? {
            Shape::Volume(volume) => Ok(volume),
            Shape::Soup(_) => bail!(
                "{}: this is a mesh, and a solid is asked for: `octofold net encode` makes one",
                self.source.path.display()
            ),
        }
    }

    /// The solid of a volume that was read from here.
    pub fn solid(&self, volume: &dyn Volume, run: &Run) -> Result<Spans> {
        let solid = octofold::pipeline::solid(volume, &SolidOptions::default(), run);
        solid.with_context(|| self.source.path.display().to_string())
    }

    /// Reads polygons; a volume is refused.
    pub fn read_mesh(&self, run: &Run) -> Result<Soup> {
        match self.read(run)? {
            Shape::Soup(soup) => Ok(soup),
            Shape::Volume(_) => bail!(
                "{}: this is a volume, and a mesh is asked for: `octofold surface` makes one",
                self.source.path.display()
            ),
        }
    }
}

impl Output {
    /// The output `path` in the format that `to` or its name tells.
    pub fn new(path: PathBuf, to: Option<Format>) -> Result<Self> {
        let name = path.to_string_lossy();
        let format = to.or_else(|| Format::of_name(&name)).with_context(|| {
            format!("{name}: the name does not tell the format; say --to FORMAT, {}", formats())
        })?;
        Ok(Self { path, format, layout: ofn::Layout::default() })
    }

    /// The same, written as `layout` says where the format is `.ofn`.
    pub fn in_layout(self, layout: ofn::Layout) -> Result<Self> {
        ensure!(
            layout == ofn::Layout::default() || self.format == Format::Ofn,
            "{}: --archive and --bricks are for .ofn files",
            self.name()
        );
        Ok(Self { layout, ..self })
    }

    /// How a solid is written as one stream; `None` in any other format, or in bricks.
    pub fn stream(&self) -> Option<Mode> {
        (self.format == Format::Ofn && !self.layout.bricks).then_some(self.layout.mode)
    }

    /// What the format holds.
    pub fn kind(&self) -> Kind {
        self.format.kind()
    }

    /// True for standard output.
    pub fn is_pipe(&self) -> bool {
        self.path.as_os_str() == "-"
    }

    /// The file, to be read back.
    pub fn as_input(&self) -> Input {
        Input { path: self.path.clone(), format: Some(self.format), layout: None }
    }

    /// The name for messages.
    pub fn name(&self) -> String {
        if self.is_pipe() {
            format!("standard output ({})", self.format.name())
        } else {
            self.path.display().to_string()
        }
    }

    /// Writes the shape, whole or not at all.
    pub fn write(&self, shape: &Shape, run: &Run) -> Result<()> {
        match shape {
            Shape::Soup(soup) => self.write_mesh(soup, run),
            Shape::Volume(volume) => self.write_volume(volume.as_ref(), run),
        }
    }

    /// Writes polygons.
    pub fn write_mesh(&self, soup: &Soup, run: &Run) -> Result<()> {
        run.stage("write");
        Ok(octofold_io::write_mesh(soup, &self.path, Some(self.format), run)?)
    }

    /// Writes samples.
    pub fn write_volume(&self, volume: &dyn Volume, run: &Run) -> Result<()> {
        run.stage("write");
        if self.format == Format::Ofn {
            return Ok(octofold_io::write_solid(volume, &self.path, self.layout, run)?);
        }
        if self.format == Format::Vox
            && let Some(painted) = Painted::of(volume, run)?
        {
            let coloured = Labelled::by_colour(&painted, VOX_COLOURS);
            return Ok(octofold_io::write_volume(&coloured, &self.path, Some(self.format), run)?);
        }
        Ok(octofold_io::write_volume(volume, &self.path, Some(self.format), run)?)
    }
}

/// Colours of a .vox file, at most.
const VOX_COLOURS: usize = 255;

/// All formats in one phrase.
fn formats() -> String {
    let names: Vec<_> = Format::ALL.iter().map(|f| f.name()).collect();
    format!("one of {}", names.join(", "))
}

/// A format by any of its endings.
pub fn parse_format(text: &str) -> Result<Format, String> {
    Format::of_name(text).ok_or_else(|| format!("no such format; {}", formats()))
}

fn parse_scalar(text: &str) -> Result<ScalarType, String> {
    let names = ScalarType::ALL.map(ScalarType::name).join(", ");
    let found = ScalarType::ALL.into_iter().find(|t| t.name() == text);
    found.ok_or_else(|| format!("no such type; one of {names}"))
}

fn parse_dims(text: &str) -> Result<Dims, String> {
    let numbers: Result<Vec<usize>, _> = text.split(['x', ',']).map(str::parse).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z]) if x > 0 && y > 0 && z > 0 => Ok(Dims([x, y, z])),
        _ => Err("three counts above 0 are asked for, such as 512x512x300".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dims_are_three_counts() {
        assert_eq!(parse_dims("2x3x4").unwrap().0, [2, 3, 4]);
        assert_eq!(parse_dims("2,3,4").unwrap().0, [2, 3, 4]);
        for bad in ["2x3", "0x1x1", "axbxc", "1x2x3x4", "-1x2x3", ""] {
            assert!(parse_dims(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn formats_go_by_any_of_their_endings() {
        assert_eq!(parse_format("nii.gz"), Ok(Format::Nifti));
        assert_eq!(parse_format("STL"), Ok(Format::Stl));
        assert!(parse_format("docx").is_err());
    }

    #[test]
    fn an_output_needs_a_known_format() {
        assert_eq!(Output::new("a.PLY".into(), None).unwrap().kind(), Kind::Mesh);
        assert_eq!(Output::new("-".into(), Some(Format::Npy)).unwrap().kind(), Kind::Volume);
        assert!(Output::new("-".into(), None).is_err());
    }
}
