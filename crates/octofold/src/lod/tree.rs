//! The model: a pointerless octree in columns, breadth-first.
//!
//! Children of an octant lie side by side, the octants of a level one after the other in Morton
//! order, so that any subtree is one slice of each level. What the walk needs is eight bytes.

use super::column::Column;
use super::{LodError, MOST_LEVELS, direction};
use crate::volume::Placement;
use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3};
use std::ops::Range;
use std::sync::LazyLock;

/// What the walk needs of an octant, in eight bytes.
///
/// Edge `4 axis + b + 2 c` of an octant runs along `axis` on the low (0) or high (1) side along the
/// next axis (`b`) and the one after (`c`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Node {
    first: u32,
    /// Children in the lowest 8 bits, then 12 bits of edges that are crossed an odd number of times,
    /// then 12 bits that tell of those which way, and of all others whether they are crossed.
    bits: u32,
}

const EDGES: u32 = (1 << 12) - 1;

impl Node {
    /// An octant with the children `mask`, of which the first is node `first`.
    pub fn new(first: u32, mask: u8, crossed: Crossed) -> Self {
        let Crossed { any, odd, negative } = crossed;
        let low = (any & !odd) | (odd & negative);
        let bits = u32::from(mask) | u32::from(odd) << 8 | u32::from(low) << 20;
        Self { first, bits }
    }

    /// Children that there are, one bit each, x in the lowest bit of their number.
    #[inline]
    pub fn children(self) -> u8 {
        self.bits as u8
    }

    /// The first child's node, where there is one.
    #[inline]
    pub fn first_child(self) -> u32 {
        self.first
    }

    /// The node of a child that there is.
    #[inline]
    pub fn child(self, octant: u32) -> u32 {
        self.first + (self.bits & ((1 << octant) - 1)).count_ones()
    }

    /// Edges that are crossed an odd number of times.
    #[inline]
    pub fn odd(self) -> u16 {
        (self.bits >> 8 & EDGES) as u16
    }

    /// Edges that are crossed.
    #[inline]
    pub fn any(self) -> u16 {
        ((self.bits >> 8 | self.bits >> 20) & EDGES) as u16
    }

    /// Edges of the odd ones along which the surface is entered rather than left.
    #[inline]
    pub fn negative(self) -> u16 {
        (self.bits >> 8 & self.bits >> 20 & EDGES) as u16
    }
}

/// How the surface crosses the edges of an octant, one bit an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Crossed {
    /// At least once.
    pub any: u16,
    /// An odd number of times.
    pub odd: u16,
    /// An odd number of times, and the surface is entered along the axis.
    pub negative: u16,
}

/// What else is known of an octant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Traits(pub u8);

impl Traits {
    /// A border of the surface runs through it.
    pub const BORDER: u8 = 1;

    /// Whether a border of the surface runs through the octant.
    pub fn is_border(self) -> bool {
        self.0 & Self::BORDER != 0
    }
}

/// The columns of a model, as they are read and written.
#[derive(Debug, Clone, PartialEq)]
pub struct Parts {
    /// Levels below the root.
    pub levels: u32,
    /// Finest cells, counted from the root's low corner, to the world.
    pub frame: Placement,
    /// What the walk needs.
    pub nodes: Column<Node>,
    /// Steps of [`Lod::error`].
    pub errors: Column<u8>,
    /// Steps of [`Lod::flatness`].
    pub shapes: Column<u8>,
    /// [`Traits`].
    pub traits: Column<u8>,
    /// Places of the vertices in their octants, in 128 steps an axis.
    pub vertices: Column<[u8; 3]>,
    /// Normals, as points of an unfolded octahedron.
    pub normals: Column<[u8; 2]>,
    /// Colours, sRGB with straight alpha, where the input has them.
    pub colours: Option<Column<[u8; 4]>>,
}

/// A level-of-detail model.
#[derive(Debug, Clone, PartialEq)]
pub struct Lod {
    parts: Parts,
    /// First node of each level, and one past the last node.
    starts: Vec<u32>,
    stretch: f64,
    to_normals: DMat3,
}

/// Steps of a vertex along an axis of its octant.
pub(super) const STEPS: u32 = 128;

/// The bound of each step of error, in finest cells: an eighth of an octave apart.
static ERRORS: LazyLock<[f64; 256]> = LazyLock::new(|| {
    std::array::from_fn(|step| match step {
        0 => 0.0,
        _ => 2f64.powf((step as f64 - 1.0) / 8.0 - 12.0),
    })
});

/// The lowest step whose bound is not below `error`, in finest cells.
pub(super) fn error_step(error: f64) -> u8 {
    ERRORS.partition_point(|&bound| bound < error).min(255) as u8
}

/// The lowest step of an octant without children that is not below another: a quarter of an octave
/// apart.
pub(super) fn leaf_error(step: u8) -> u8 {
    if step == 0 { 0 } else { step | 1 }
}

/// The highest flatness of an octant without children that is not above another: in fifteenths.
pub(super) fn leaf_shape(shape: u8) -> u8 {
    shape / 17 * 17
}

impl Lod {
    /// The model of these columns, once they are found to fit together. Every later walk ends and
    /// stays inside, whatever the columns hold.
    pub fn from_parts(parts: Parts) -> Result<Self, LodError> {
        let damaged = |fact| Err(LodError::Damaged(fact));
        let count = parts.nodes.len();
        if parts.levels == 0 || parts.levels > MOST_LEVELS {
            return damaged("it has no levels or too many");
        }
        if count == 0 || count >= u32::MAX as usize {
            return damaged("it has no octants or too many");
        }
        let lengths = [
            parts.errors.len(),
            parts.shapes.len(),
            parts.traits.len(),
            parts.vertices.len(),
            parts.normals.len(),
            parts.colours.as_ref().map_or(count, |c| c.len()),
        ];
        if lengths != [count; 6] {
            return damaged("its columns differ in length");
        }
        let finite = |v: &[f64; 3]| v.iter().all(|x| x.is_finite());
        if !parts.frame.axes.iter().chain([&parts.frame.origin]).all(finite) {
            return damaged("its place in the world is not made of finite numbers");
        }
        let mut starts = vec![0, 1];
        let mut next = 1u64;
        while let &[.., start, end] = starts.as_slice()
            && start < end
        {
            for node in &parts.nodes[start as usize..end as usize] {
                if node.children() != 0 {
                    if u64::from(node.first_child()) != next {
                        return damaged("an octant's children are not where they should be");
                    }
                    next += u64::from(node.children().count_ones());
                    if next > count as u64 {
                        return damaged("an octant's children are missing");
                    }
                }
            }
            starts.push(next as u32);
        }
        starts.pop();
        if next != count as u64 {
            return damaged("octants belong to nothing");
        }
        if starts.len() > parts.levels as usize + 2 {
            return damaged("its octants lie deeper than its levels");
        }
        let linear = DMat3::from_cols_array_2d(&parts.frame.axes);
        let to_normals = linear.inverse().transpose();
        let to_normals = if to_normals.is_finite() { to_normals } else { DMat3::IDENTITY };
        Ok(Self { stretch: stretch(linear), to_normals, starts, parts })
    }

    /// Its columns.
    pub fn parts(&self) -> &Parts {
        &self.parts
    }

    /// Levels below the root that the finest cells have.
    pub fn levels(&self) -> u32 {
        self.parts.levels
    }

    /// Finest cells, counted from the root's low corner, to the world.
    pub fn frame(&self) -> &Placement {
        &self.parts.frame
    }

    /// All octants, breadth-first.
    pub fn nodes(&self) -> &[Node] {
        &self.parts.nodes
    }

    /// The octants of a level.
    pub fn level(&self, level: u32) -> Range<u32> {
        let at = |level: u32| {
            *self.starts.get(level as usize).unwrap_or(&(self.parts.nodes.len() as u32))
        };
        at(level)..at(level + 1)
    }

    /// The largest length in the world of a step of one finest cell in any direction, or a little
    /// more.
    pub fn stretch(&self) -> f64 {
        self.stretch
    }

    /// A bound of how far the surface in an octant is from the patches round the octant's vertex,
    /// in finest cells; never less than that of an octant inside. In octaves, it is told in eighths;
    /// where an octant has no children, in quarters.
    pub fn error(&self, node: u32) -> f64 {
        ERRORS[self.parts.errors[node as usize] as usize]
    }

    /// `(min n_i . n_j + 1) / 2` over the normals of the surface in an octant: 1 where it is flat,
    /// 0 where it turns back. Where an octant has no children, it is rounded down to fifteenths.
    pub fn flatness(&self, node: u32) -> f64 {
        f64::from(self.parts.shapes[node as usize]) / 255.0
    }

    /// What else is known of an octant.
    pub fn traits(&self, node: u32) -> Traits {
        Traits(self.parts.traits[node as usize])
    }

    /// The vertex of an octant with low corner `corner` and side `size` in finest cells, in finest
    /// cells.
    #[inline]
    pub fn vertex(&self, node: u32, corner: [u32; 3], size: u32) -> DVec3 {
        place(self.parts.vertices[node as usize], corner, size)
    }

    /// The unit normal at the vertex of an octant, in the world.
    pub fn normal(&self, node: u32) -> DVec3 {
        direction::unpacked(self.parts.normals[node as usize])
    }

    /// The colour at the vertex of an octant.
    pub fn colour(&self, node: u32) -> Option<[u8; 4]> {
        self.parts.colours.as_ref().map(|c| c[node as usize])
    }

    /// A place in finest cells, in the world.
    pub fn world(&self, place: DVec3) -> [f64; 3] {
        self.parts.frame.place(place.to_array())
    }

    /// The normal in the world of a face square to an axis of the grid.
    pub(super) fn along(&self, axis: usize) -> DVec3 {
        self.to_normals.col(axis)
    }
}

/// Where a vertex of so many steps lies, in finest cells.
#[inline]
pub(super) fn place(steps: [u8; 3], corner: [u32; 3], size: u32) -> DVec3 {
    let scale = f64::from(size) / f64::from(STEPS);
    let at = |a: usize| f64::from(corner[a]) + (f64::from(steps[a]) + 0.5) * scale;
    DVec3::new(at(0), at(1), at(2))
}

/// A bound of the largest stretch of a linear map; exact where its columns are square to each
/// other.
pub(super) fn stretch(linear: DMat3) -> f64 {
    let columns = [linear.x_axis, linear.y_axis, linear.z_axis];
    let lengths = columns.map(|c| c.length());
    let longest = lengths.into_iter().fold(0.0, f64::max);
    let square = (0..3).all(|i| {
        let j = (i + 1) % 3;
        columns[i].dot(columns[j]).abs() <= 1e-12 * lengths[i] * lengths[j]
    });
    let sum = lengths.iter().map(|l| l * l).sum::<f64>().sqrt();
    if square { longest } else { sum }
}
