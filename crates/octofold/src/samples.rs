//! Built-in shapes, as fields, volumes and meshes on the unit cube.
//!
//! Solids have a [`Field`]: negative inside, exact in sign, with a Lipschitz constant of at most
//! 1, so that volumes made from it bound their own values. The primitives, the house and the scan
//! also have polygons of their own; the other meshes are isosurfaces of the field.

mod combination;
mod field;
mod grid;
mod house;
mod mesh;
mod part;
mod primitive;
mod product;
mod scan;

pub use field::Field;
pub use grid::{FieldMask, FieldSamples, Pose};
pub use scan::{ScanCensus, ScanPlan};

use crate::soup::{Soup, SoupBuilder};

/// A built-in shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)]
pub enum Sample {
    Sphere,
    Cube,
    Cylinder,
    Cone,
    Tetrahedron,
    Prism,
    Torus,
    HairDryer,
    Kettle,
    TapeCutter,
    Camera,
    Computer,
    Telephone,
    Bracket,
    Gear,
    Csg1,
    Csg2,
    Csg3,
    Csg4,
    Csg5,
    Csg6,
    PartA,
    PartB,
    PartC,
    PartD,
    PartE,
    Gyroid,
    House,
    Scan,
}

/// Fewest and most segments around a curved face.
const SEGMENTS: [usize; 2] = [3, 1 << 14];
/// Most cells along an edge of the unit cube.
const MOST_CELLS: usize = 1 << 20;

impl Sample {
    /// Every shape, in the order of `sample --list`.
    pub const ALL: [Self; 29] = [
        Self::Sphere,
        Self::Cube,
        Self::Cylinder,
        Self::Cone,
        Self::Tetrahedron,
        Self::Prism,
        Self::Torus,
        Self::HairDryer,
        Self::Kettle,
        Self::TapeCutter,
        Self::Camera,
        Self::Computer,
        Self::Telephone,
        Self::Bracket,
        Self::Gear,
        Self::Csg1,
        Self::Csg2,
        Self::Csg3,
        Self::Csg4,
        Self::Csg5,
        Self::Csg6,
        Self::PartA,
        Self::PartB,
        Self::PartC,
        Self::PartD,
        Self::PartE,
        Self::Gyroid,
        Self::House,
        Self::Scan,
    ];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        self.entry().0
    }

    /// The shape of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|s| s.name() == name)
    }

    /// What it is, in one line.
    pub fn about(self) -> &'static str {
        self.entry().1
    }

    /// The signed field, negative inside; `None` for shapes that are no solid.
    pub fn field(self) -> Option<Field> {
        self.entry().2
    }

    /// The field on the `resolution + 1` lattice points along each edge of the unit cube, negative
    /// inside; `None` for shapes that are no solid.
    pub fn volume(self, resolution: usize) -> Option<FieldSamples> {
        let resolution = resolution.clamp(1, MOST_CELLS);
        self.field().map(|field| FieldSamples { field, resolution })
    }

    /// The cells of the unit cube, `resolution` along each edge, whose centres are inside; `None`
    /// for shapes that are no solid.
    pub fn voxels(self, resolution: usize) -> Option<FieldMask> {
        let resolution = resolution.clamp(1, MOST_CELLS);
        self.field().map(|field| FieldMask { field, resolution, pose: Pose::default() })
    }

    /// The polygons of a shape that is made of polygons, with `resolution` segments around its
    /// curved faces; `None` for shapes that are only given by their field.
    pub fn polygons(self, resolution: usize) -> Option<Soup> {
        let segments = resolution.clamp(SEGMENTS[0], SEGMENTS[1]);
        let builder = match self {
            Self::Sphere => primitive::sphere(segments),
            Self::Cube => primitive::cube(),
            Self::Cylinder => primitive::cylinder(segments),
            Self::Cone => primitive::cone(segments),
            Self::Tetrahedron => primitive::tetrahedron(),
            Self::Prism => primitive::prism(),
            Self::Torus => primitive::torus(segments),
            Self::House => house::house(),
            Self::Scan => {
                return Some(ScanPlan { resolution: segments, ..ScanPlan::default() }.plant().0);
            }
            _ => return None,
        };
        Some(built(builder))
    }

    /// Name, description and field.
    fn entry(self) -> (&'static str, &'static str, Option<Field>) {
        match self {
            Self::Sphere => ("sphere", "ball of radius 0.4", Some(primitive::sphere_field)),
            Self::Cube => ("cube", "cube of side 0.7", Some(primitive::cube_field)),
            Self::Cylinder => {
                ("cylinder", "upright cylinder of radius 0.3", Some(primitive::cylinder_field))
            }
            Self::Cone => ("cone", "upright cone of radius 0.38", Some(primitive::cone_field)),
            Self::Tetrahedron => (
                "tetrahedron",
                "regular tetrahedron in a generic position",
                Some(primitive::tetrahedron_field),
            ),
            Self::Prism => ("prism", "upright prism on a triangle", Some(primitive::prism_field)),
            Self::Torus => ("torus", "ring of radii 0.3 and 0.1", Some(primitive::torus_field)),
            Self::HairDryer => {
                ("hair-dryer", "hair dryer with a tilted handle", Some(product::hair_dryer))
            }
            Self::Kettle => {
                ("kettle", "electric kettle with knob, spout and handle", Some(product::kettle))
            }
            Self::TapeCutter => {
                ("tape-cutter", "tape cutter with an open hub", Some(product::tape_cutter))
            }
            Self::Camera => ("camera", "camera with a hollow lens", Some(product::camera)),
            Self::Computer => {
                ("computer", "personal computer with screen and keys", Some(product::computer))
            }
            Self::Telephone => {
                ("telephone", "desk telephone with receiver and keys", Some(product::telephone))
            }
            Self::Bracket => {
                ("bracket", "angle bracket with gussets and holes", Some(product::bracket))
            }
            Self::Gear => ("gear", "wheel of 24 teeth with a keyway", Some(product::gear)),
            Self::Csg1 => ("csg1", "box and ball, drilled twice", Some(combination::csg1)),
            Self::Csg2 => {
                ("csg2", "rounded cube, drilled along three axes", Some(combination::csg2))
            }
            Self::Csg3 => {
                ("csg3", "crossed cylinders and a cube, rotated", Some(combination::csg3))
            }
            Self::Csg4 => ("csg4", "ball without a cube's corner", Some(combination::csg4)),
            Self::Csg5 => ("csg5", "two cones held by a ring", Some(combination::csg5)),
            Self::Csg6 => {
                ("csg6", "rounded cube with pips on three faces", Some(combination::csg6))
            }
            Self::PartA => ("part-a", "block with a boss", Some(part::a)),
            Self::PartB => ("part-b", "block with a trough", Some(part::b)),
            Self::PartC => ("part-c", "L-shaped block with a round top", Some(part::c)),
            Self::PartD => ("part-d", "block with a blind hole", Some(part::d)),
            Self::PartE => ("part-e", "square plate with a cylinder", Some(part::e)),
            Self::Gyroid => ("gyroid", "wall of a gyroid in a cube", Some(primitive::gyroid_field)),
            Self::House => {
                ("house", "open sheets: walls, roof and a chimney that pierces it", None)
            }
            Self::Scan => ("scan", "scan-like soup with planted defects", None),
        }
    }
}

/// The soup of polygons that were made here: indices and columns fit by construction.
fn built(builder: SoupBuilder) -> Soup {
    builder.build().unwrap_or_default()
}

#[cfg(test)]
mod tests;
