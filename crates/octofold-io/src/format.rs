//! The file formats, how they are told apart, and the readers and writers behind them.

use crate::{ReadError, Source};
pub use octofold::Kind;

/// Every file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Format {
    Obj,
    Ply,
    Stl,
    Off,
    Gltf,
    Glb,
    ThreeMf,
    Nifti,
    Nrrd,
    Npy,
    Raw,
    Binvox,
    Vox,
    Ofn,
}

impl Format {
    /// All formats, in the order of the help text.
    pub const ALL: [Self; 14] = [
        Self::Obj,
        Self::Ply,
        Self::Stl,
        Self::Off,
        Self::Gltf,
        Self::Glb,
        Self::ThreeMf,
        Self::Nifti,
        Self::Nrrd,
        Self::Npy,
        Self::Raw,
        Self::Binvox,
        Self::Vox,
        Self::Ofn,
    ];

    /// Name for messages and for `--from` and `--to`.
    pub fn name(self) -> &'static str {
        self.endings()[0]
    }

    /// File-name endings, lower case, the usual one first.
    pub fn endings(self) -> &'static [&'static str] {
        match self {
            Self::Obj => &["obj"],
            Self::Ply => &["ply"],
            Self::Stl => &["stl"],
            Self::Off => &["off", "coff", "noff"],
            Self::Gltf => &["gltf"],
            Self::Glb => &["glb"],
            Self::ThreeMf => &["3mf"],
            Self::Nifti => &["nii", "nii.gz", "hdr", "hdr.gz", "img", "img.gz"],
            Self::Nrrd => &["nrrd", "nhdr"],
            Self::Npy => &["npy"],
            Self::Raw => &["raw"],
            Self::Binvox => &["binvox"],
            Self::Vox => &["vox"],
            Self::Ofn => &["ofn"],
        }
    }

    /// What it holds.
    pub fn kind(self) -> Kind {
        match self {
            Self::Obj
            | Self::Ply
            | Self::Stl
            | Self::Off
            | Self::Gltf
            | Self::Glb
            | Self::ThreeMf => Kind::Mesh,
            _ => Kind::Volume,
        }
    }

    /// The format that a file name's ending stands for.
    pub fn of_name(name: &str) -> Option<Self> {
        let lower = name.to_ascii_lowercase();
        Self::ALL.into_iter().find(|f| {
            f.endings().iter().any(|e| {
                lower.strip_suffix(e).is_some_and(|rest| rest.ends_with('.') || rest.is_empty())
            })
        })
    }

    /// The format of `source`: by its first bytes where they are telling, else by its name.
    pub fn of_source(source: &Source) -> Result<Self, ReadError> {
        let name = source.path.to_string_lossy();
        let bytes = &source.bytes;
        let starts = |magic: &[u8]| bytes.starts_with(magic);
        let by_magic = if starts(b"ply\n") || starts(b"ply\r") {
            Some(Self::Ply)
        } else if starts(b"glTF") {
            Some(Self::Glb)
        } else if starts(b"NRRD000") {
            Some(Self::Nrrd)
        } else if starts(b"\x93NUMPY") {
            Some(Self::Npy)
        } else if starts(b"#binvox") {
            Some(Self::Binvox)
        } else if starts(b"VOX ") {
            Some(Self::Vox)
        } else if starts(b"OFN") {
            Some(Self::Ofn)
        } else if crate::nifti::sniff(bytes) {
            Some(Self::Nifti)
        } else {
            None
        };
        by_magic.or_else(|| Self::of_name(&name)).ok_or_else(|| {
            let known: Vec<_> = Self::ALL.iter().map(|f| f.name()).collect();
            ReadError::UnknownFormat(format!(
                "{name}: neither its first bytes nor its name tell a known format; \
                 say --from FORMAT, one of {}",
                known.join(", ")
            ))
        })
    }
}
