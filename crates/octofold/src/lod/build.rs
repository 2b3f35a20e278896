//! From a mesh or a volume to the model.

use super::bounds::bounds;
use super::crossings::Crossings;
use super::cubes::Cubes;
use super::field;
use super::leaves::Leaves;
use super::pyramid::{Finish, Level, pyramid};
use super::rim::Rim;
use super::tree::{Lod, Node, Parts, error_step, leaf_error, leaf_shape};
use super::{LodError, MOST_LEVELS};
use crate::lattice::{Lattice, LatticeError};
use crate::mesh::Mesh;
use crate::run::Run;
use crate::surface::CubesOptions;
use crate::tint::{Images, Tint};
use crate::volume::{Placement, Volume};
use crate::voxelize;
use glam::{DMat3, DVec3};

/// Where the vertex of an octant is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum VertexRule {
    /// As published: the mean of the surface's vertices in the octant, else of its crossings with the
    /// octant's edges.
    Mean,
    /// The point of least squared distances to the planes of the surface at its crossings.
    #[default]
    Quadric,
}

/// How a model is built.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BuildOptions {
    /// Levels below the root: 2^level finest cells along an axis. Meshes only; the cells of a volume
    /// are between its samples.
    pub level: u32,
    /// Where vertices are.
    pub vertex: VertexRule,
    /// Octants whose patches are exact have no children.
    pub early_leaves: bool,
}

impl Default for BuildOptions {
    fn default() -> Self {
        Self { level: 8, vertex: VertexRule::default(), early_leaves: true }
    }
}

/// Share of the root's side that the longest side of a mesh takes.
const FILLED: f64 = 0.96;

/// Patches that are so near to the surface, in finest cells, count as exact: steps of vertices are no
/// finer in octants of eight cells.
const EXACT: f32 = 1.0 / 32.0;

/// Finest cells that a surface may cross: they are sorted in memory.
const MOST_CELLS: f64 = 1e8;

/// The model of a mesh: closed, open or not manifold.
///
/// # Errors
/// Where the level is not one of 1 to 16, the mesh crosses no edge of the grid or too many, or the
/// work is interrupted.
pub fn build(mesh: &Mesh, options: &BuildOptions, run: &Run) -> Result<Lod, LodError> {
    build_painted(mesh, &[], options, run)
}

/// The same as [`build`], with the images of its materials: octants have the mean of what they show.
///
/// # Errors
/// As [`build`].
pub fn build_painted(
    mesh: &Mesh,
    images: &Images,
    options: &BuildOptions,
    run: &Run,
) -> Result<Lod, LodError> {
    let (surface, frame) = Surface::of(mesh, images, options.level, run)?;
    Ok(surface.built(options.level, frame, options, run)?.lod)
}

/// The same model, and what marching cubes must know of its octants, which have no colours of images.
///
/// # Errors
/// As [`build`].
pub fn build_with_cubes(
    mesh: &Mesh,
    options: &BuildOptions,
    run: &Run,
) -> Result<(Lod, Cubes), LodError> {
    let (surface, frame) = Surface::of(mesh, &[], options.level, run)?;
    let Built { lod, all, leaves, crossings } =
        surface.built(options.level, frame, options, run)?;
    run.stage("cubes");
    run.check()?;
    let cubes = Cubes::of(&lod, &all, &leaves, &crossings);
    Ok((lod, cubes))
}

/// The model of a volume's surface at an iso value, closed half a sample outside the volume's border
/// or left open there. `options.level` is not used.
///
/// # Errors
/// Where the volume has no surface or too large a one, more than 65 535 samples along an axis, or
/// cannot be read, or the work is interrupted.
pub fn build_volume(
    volume: &dyn Volume,
    surface: &CubesOptions,
    options: &BuildOptions,
    run: &Run,
) -> Result<Lod, LodError> {
    let longest = volume.dims().into_iter().max().unwrap_or(0);
    let levels = (longest + 1).next_power_of_two().trailing_zeros().max(1);
    if levels > MOST_LEVELS {
        return Err(LodError::Level(levels));
    }
    let crossings = field::crossings(volume, surface, run)?;
    let mut frame = volume.placement();
    frame.origin = frame.place([-1.0; 3]);
    let surface = Surface { crossings, vertices: Vec::new(), rim: Rim::default() };
    Ok(surface.built(levels, frame, options, run)?.lod)
}

/// The root's cube round a mesh.
fn root(mesh: &Mesh, level: u32) -> Result<Lattice, LatticeError> {
    let [low, high] = mesh.bounds().ok_or(LatticeError::Bounds)?;
    let longest = (0..3).map(|a| high[a] - low[a]).fold(0.0, f64::max);
    let side = if longest > 0.0 { longest / FILLED } else { 1.0 };
    let corner = |way: f64| std::array::from_fn(|a| (low[a] + high[a]) / 2.0 + way * side / 2.0);
    let pitch = side / f64::from(1u32 << level);
    let lattice = Lattice::fit([corner(-1.0), corner(1.0)], 1 << level)?;
    // Rounding may leave a side one cell short.
    if lattice.cells() == [1 << level; 3] {
        return Ok(lattice);
    }
    let grown = pitch * 1e-9;
    let corner =
        |way: f64| std::array::from_fn(|a| (low[a] + high[a]) / 2.0 + way * (side / 2.0 - grown));
    Lattice::with_pitch([corner(-1.0), corner(1.0)], pitch)
}

fn area(mesh: &Mesh) -> f64 {
    let of = |t: usize| {
        let [a, b, c] = mesh.corners(t).map(DVec3::from);
        (b - a).cross(c - a).length() / 2.0
    };
    (0..mesh.triangles.len()).map(of).sum()
}

/// A surface on the finest grid.
struct Surface {
    crossings: Crossings,
    /// In finest cells.
    vertices: Vec<DVec3>,
    rim: Rim,
}

/// A model with all that it was made of.
struct Built {
    lod: Lod,
    /// Octants of all levels, those without which the model does too among them.
    all: Vec<Level>,
    leaves: Leaves,
    crossings: Crossings,
}

impl Surface {
    /// The surface of a mesh on the grid of a level, and where that grid is.
    fn of(
        mesh: &Mesh,
        images: &Images,
        level: u32,
        run: &Run,
    ) -> Result<(Self, Placement), LodError> {
        if level == 0 || level > MOST_LEVELS {
            return Err(LodError::Level(level));
        }
        run.stage("lattice");
        let lattice = root(mesh, level)?;
        let facets = voxelize::facets(mesh, &lattice);
        let squares = area(mesh) / (lattice.cell() * lattice.cell());
        if squares > MOST_CELLS {
            return Err(LodError::TooMany(squares as u64));
        }
        let tint = Tint::of(mesh, images, lattice.cell());
        let mut crossings = Crossings::of_mesh(&facets, tint.as_ref(), &lattice, run)?;
        let mut used = vec![false; mesh.points.len()];
        mesh.triangles.iter().flatten().for_each(|&p| used[p as usize] = true);
        let size = f64::from(1u32 << lattice.sub_bits());
        let vertices: Vec<DVec3> = (mesh.points.iter().zip(&used))
            .filter(|(_, used)| **used)
            .map(|(&p, _)| DVec3::from(lattice.snap(p).map(f64::from)) / size)
            .collect();
        let (rim, even) = Rim::of(mesh, &lattice, run)?;
        if even {
            crossings.judge_by_parity();
        }
        let frame = Placement {
            origin: lattice.origin(),
            unit: mesh.unit,
            ..Placement::spacing([lattice.cell(); 3])
        };
        Ok((Self { crossings, vertices, rim }, frame))
    }

    fn built(
        self,
        levels: u32,
        frame: Placement,
        options: &BuildOptions,
        run: &Run,
    ) -> Result<Built, LodError> {
        if self.crossings.edges.is_empty() {
            return Err(LodError::NoSurface(levels));
        }
        let coloured = self.crossings.colours.is_some();
        let leaves = Leaves::new(&self.crossings, &self.vertices, &self.rim, run)?;
        let linear = DMat3::from_cols_array_2d(&frame.axes);
        let normals = linear.inverse().transpose();
        let turn = |n: DVec3| (normals * n).normalize_or(DVec3::Z);
        let finish = Finish { rule: options.vertex, turn: &turn, coloured };
        let all = pyramid(&leaves, &self.crossings, &self.vertices, levels, &finish, run)?;
        let bounds = bounds(&all, &leaves, &self.crossings, &self.vertices, &self.rim, run)?;
        run.stage("columns");
        let count: u64 = all.iter().map(|level| level.codes.len() as u64).sum();
        if count >= u64::from(u32::MAX) {
            return Err(LodError::TooMany(count));
        }
        let parts = columns(levels, frame, &all, &bounds, options.early_leaves);
        let lod = Lod::from_parts(parts)?;
        Ok(Built { lod, all, leaves, crossings: self.crossings })
    }
}

/// The columns of all octants that are kept, breadth-first.
fn columns(
    levels: u32,
    frame: Placement,
    all: &[Level],
    bounds: &[Vec<f32>],
    early_leaves: bool,
) -> Parts {
    let coloured = all.iter().any(|level| !level.colours.is_empty());
    let (mut nodes, mut errors, mut shapes, mut traits) = (vec![], vec![], vec![], vec![]);
    let (mut vertices, mut normals, mut colours) = (vec![], vec![], vec![]);
    let mut kept = vec![true];
    let mut next = 1;
    for (level, bounds) in all.iter().zip(bounds) {
        let mut below = Vec::new();
        for i in 0..level.codes.len() {
            let exact = early_leaves && bounds[i] <= EXACT;
            let children = level.masks[i].count_ones();
            below.extend(std::iter::repeat_n(kept[i] && !exact, children as usize));
            if !kept[i] {
                continue;
            }
            let mask = if exact { 0 } else { level.masks[i] };
            let first = if mask == 0 { 0 } else { next };
            next += mask.count_ones();
            nodes.push(Node::new(first, mask, level.crossed[i]));
            errors.push(error_step(f64::from(bounds[i])));
            shapes.push(level.shapes[i]);
            traits.push(level.traits[i]);
            vertices.push(level.vertices[i]);
            normals.push(level.normals[i]);
            if coloured {
                colours.push(level.colours[i]);
            }
        }
        kept = below;
    }
    rounded(&nodes, &mut errors, &mut shapes);
    Parts {
        levels,
        frame,
        nodes: nodes.into(),
        errors: errors.into(),
        shapes: shapes.into(),
        traits: traits.into(),
        vertices: vertices.into(),
        normals: normals.into(),
        colours: coloured.then(|| colours.into()),
    }
}

/// Rounds the bounds and the flatness of octants without children, where nothing is chosen by them, to the
/// side that promises less: bounds of octants above stay no less.
fn rounded(nodes: &[Node], errors: &mut [u8], shapes: &mut [u8]) {
    for (i, node) in nodes.iter().enumerate().rev() {
        if node.children() == 0 {
            errors[i] = leaf_error(errors[i]);
            shapes[i] = leaf_shape(shapes[i]);
        } else {
            let first = node.first_child() as usize;
            let below = &errors[first..first + node.children().count_ones() as usize];
            let worst = below.iter().copied().max().unwrap_or(0);
            errors[i] = errors[i].max(worst);
        }
    }
}
