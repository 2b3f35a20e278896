//! Volumes into meshes.

pub mod account;
mod adaptive;
pub mod cell;
mod certified;
pub mod cubes;
mod descent;
mod digital;
pub mod labels;
mod prism;
mod seam;
mod slab;
mod tel;
pub mod threshold;

use crate::mesh::Mesh;
use crate::run::Run;
use crate::volume::{Volume, VolumeError};
pub use account::{OctreeAccount, Rejection, SurfaceAccount, Tally};
pub use adaptive::adaptive_cubes;
pub use certified::{Certificate, CertifiedOptions, Coordinates, LEAST_TOLERANCE, certified};
pub use cubes::{CubesOptions, Inside, marching_cubes};
pub use labels::{LabelComplex, LabelMesh, label_complex, label_meshes};
pub use tel::tel;

/// The ways to turn a volume into a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum Method {
    /// Certified TEL: few triangles, proved closed, manifold, free of self-intersection and within
    /// a tolerance of marching cubes.
    #[default]
    #[serde(rename = "ctel")]
    Certified,
    /// Marching cubes with a consistent face rule: every mixed cell gets its patch.
    #[serde(rename = "mc")]
    Cubes,
    /// Octants of any size carry one patch of marching cubes each, where that is near enough: the
    /// method that TEL was compared with.
    #[serde(rename = "amc")]
    Adaptive,
    /// TEL as published in 1997: octants carry polygons over their loops. A historical method,
    /// kept to be compared with; it guarantees nothing.
    #[serde(rename = "tel")]
    Tel,
}

impl Method {
    /// Every method.
    pub const ALL: [Self; 4] = [Self::Certified, Self::Cubes, Self::Adaptive, Self::Tel];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Certified => "ctel",
            Self::Cubes => "mc",
            Self::Adaptive => "amc",
            Self::Tel => "tel",
        }
    }

    /// Whether it can leave the surface open at the volume's border, and mesh labels.
    pub fn is_general(self) -> bool {
        matches!(self, Self::Certified | Self::Cubes)
    }
}

/// How a volume becomes a mesh.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SurfaceOptions {
    /// The method.
    pub method: Method,
    /// The isovalue; one half for masks. See [`threshold`] for a choice.
    pub iso: Option<f64>,
    /// Which side of the isovalue is inside.
    pub inside: Inside,
    /// One closed surface per label; `iso`, `inside` and `open` are not used.
    pub labels: bool,
    /// Leave the surface open at the volume's border.
    pub open: bool,
    /// Add vertex normals.
    pub normals: bool,
    /// With certified TEL, the largest distance from marching cubes, in samples.
    pub tolerance: f64,
    /// With certified TEL, collapse edges across octants.
    pub collapse: bool,
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        Self {
            method: Method::default(),
            iso: None,
            inside: Inside::default(),
            labels: false,
            open: false,
            normals: false,
            tolerance: 1.0,
            collapse: true,
        }
    }
}

impl SurfaceOptions {
    /// What is asked for that the method cannot do, by the name of the option.
    pub fn unfit(&self) -> Option<&'static str> {
        let asked = [(self.open, "open"), (self.labels, "labels")];
        let first = asked.into_iter().find(|(is_asked, _)| *is_asked);
        first.filter(|_| !self.method.is_general()).map(|(_, name)| name)
    }
}

/// A mesh, and what its method tells of its own work.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surface {
    /// The mesh in world coordinates.
    pub mesh: Mesh,
    /// The account, from methods that have something to tell.
    pub account: Option<SurfaceAccount>,
}

/// Turns a volume into a mesh. Options that do not fit the method ([`SurfaceOptions::unfit`]) are
/// not used.
pub fn surface(
    volume: &dyn Volume,
    options: &SurfaceOptions,
    run: &Run,
) -> Result<Surface, VolumeError> {
    let SurfaceOptions { method, iso, inside, open, .. } = *options;
    let cubes = CubesOptions { iso: iso.unwrap_or(0.5), inside, open };
    let (mut mesh, account) = match method {
        Method::Certified | Method::Cubes if options.labels => {
            (labels::merge(label_meshes(volume, run)?, volume)?, None)
        }
        Method::Certified => {
            let SurfaceOptions { tolerance, collapse, .. } = *options;
            let options = CertifiedOptions { surface: cubes, tolerance, collapse };
            let (mesh, certificate) = certified(volume, &options, run)?;
            (mesh, Some(SurfaceAccount::Certified(certificate)))
        }
        Method::Cubes => (marching_cubes(volume, &cubes, run)?, None),
        Method::Adaptive => {
            let (mesh, account) = adaptive_cubes(volume, &cubes, run)?;
            (mesh, Some(SurfaceAccount::Adaptive(account)))
        }
        Method::Tel => {
            let (mesh, account) = tel(volume, &cubes, run)?;
            (mesh, Some(SurfaceAccount::Tel(account)))
        }
    };
    if options.normals {
        mesh.attributes.point_normals = Some(mesh.area_weighted_normals());
    }
    Ok(Surface { mesh, account })
}

/// Random samples in 0..=1 for tests: blocks of `smooth` samples a side share a value.
#[cfg(test)]
pub(crate) fn noise(dims: [usize; 3], seed: u64, smooth: u64) -> crate::volume::DenseVolume<u8> {
    let sample = |i: usize| {
        let at = [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]];
        let block = at.iter().fold(seed, |h, &x| {
            (h ^ (x as u64 / smooth)).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29)
        });
        (block >> 40 & 1) as u8
    };
    let samples = (0..dims.iter().product()).map(sample).collect();
    let mut volume =
        crate::volume::DenseVolume::new(dims, samples, crate::Placement::default()).unwrap();
    volume.binary = true;
    volume
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::par;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(crate::sweep::cases(48))]

        #[test]
        fn runs_of_voxels_have_the_surface_of_their_samples(
            dims in prop::array::uniform3(1usize..80),
            seed in any::<u64>(),
            smooth in 2u64..9,
            open in any::<bool>(),
        ) {
            let volume = noise([dims[0], dims[1] % 9 + 1, dims[2] % 9 + 1], seed, smooth);
            let runs = crate::spans::Spans::at_least(&volume, 0.5, &Run::default()).unwrap();
            for method in Method::ALL {
                let open = open && method.is_general();
                let options = SurfaceOptions { method, open, ..SurfaceOptions::default() };
                let [a, b] = [&volume as &dyn Volume, &runs]
                    .map(|v| surface(v, &options, &Run::default()).unwrap());
                prop_assert!(a == b, "{}", method.name());
            }
        }

        #[test]
        fn threads_do_not_change_a_byte(
            dims in prop::array::uniform3(1usize..14),
            seed in any::<u64>(),
            smooth in 1u64..7,
        ) {
            let volume = noise(dims, seed, smooth);
            for method in Method::ALL {
                let options = SurfaceOptions { method, ..SurfaceOptions::default() };
                let found = [1, 2, 3, 8].map(|threads| {
                    par::with_threads(threads, || {
                        surface(&volume, &options, &Run::default()).unwrap()
                    })
                });
                prop_assert!(found.windows(2).all(|f| f[0] == f[1]), "{}", method.name());
                let Surface { mesh, account } = &found[0];
                prop_assert!(mesh.check().is_ok());
                if let Some(account) = account.as_ref().and_then(SurfaceAccount::octree) {
                    prop_assert_eq!(mesh.triangles.len(), account.closed.triangles);
                }
            }
        }
    }
}
