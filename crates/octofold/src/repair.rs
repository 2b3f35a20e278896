//! Repair: any polygons become a closed model.
//!
//! The input marks the cells that it touches; gaps are closed, the outside is flooded, and the
//! surface between outside and the rest is rebuilt with its vertices on the input. Whatever the input,
//! the result is closed, oriented, 2-manifold and free of self-intersection by construction, on a
//! lattice whose world coordinates are exact in single precision where 24 bits allow. Sources:
//! Bischoff, Pavic and Kobbelt 2005, "Automatic restoration of polygon models"; specification of
//! repair (A.1, D).

mod apexes;
mod bricks;
mod cells;
mod census;
mod content;
mod explain;
mod flood;
mod frame;
mod inheritance;
mod labels;
mod loops;
mod members;
mod patches;
mod piercing;
mod placement;
mod reach;
mod sheets;
mod smoothing;
mod throats;

pub use census::Census;
pub use explain::explain;
pub use frame::{Gap, MAX_RESOLUTION};
pub use labels::Enclosed;
pub use sheets::{Junction, SheetAccount, SheetComplex, SheetOptions, SheetRule, sheets};
pub use throats::Throat;

use crate::lattice::LatticeError;
use crate::measure::Winding;
use crate::mesh::Mesh;
use crate::run::{Cancelled, Finding, Run};
use crate::solid::{NotSolid, Solid};
use crate::voxelize::Size;
use apexes::Apexes;
use bricks::BRICK;
use cells::Cells;
use content::{Content, Rims};
use frame::Frame;
use labels::Labels;
use patches::Patches;
use piercing::Guide;
use placement::Placement;
use smoothing::Membrane;

/// How a model is repaired.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RepairOptions {
    /// How fine the cells are.
    pub size: Size,
    /// The largest gap that is closed.
    pub gap: Gap,
    /// Enclosed spaces of at least this volume stay empty where the input does not wind round them;
    /// without it all are filled.
    pub keep_cavities: Option<f64>,
}

impl Default for RepairOptions {
    fn default() -> Self {
        Self { size: Size::Resolution(256), gap: Gap::Auto, keep_cavities: None }
    }
}

/// Why a model could not be repaired.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RepairError {
    /// There is nothing that could have a surface.
    #[error("there are no faces to repair")]
    Empty,
    /// Everything is thinner than a cell in two directions.
    #[error("no part of the model is a surface at cells of {0}: choose a higher resolution")]
    Thin(f64),
    /// No such grid.
    #[error("{0} cells along the longest side: choose between 1 and {MAX_RESOLUTION}")]
    Resolution(f64),
    /// No such gap.
    #[error("a gap of {cells} cells cannot be closed: choose between 0 and 8192 cells")]
    Gap {
        /// Its width.
        cells: f64,
    },
    /// Sheets are not that thick.
    #[error(
        "sheets of thickness {thickness} would be {cells:.1} cells thick, and can be {most} at most: \
         choose larger cells or a smaller thickness"
    )]
    Thickness {
        /// What was asked for.
        thickness: f64,
        /// The same in cells.
        cells: f64,
        /// The most cells.
        most: u32,
    },
    /// No lattice fits.
    #[error(transparent)]
    Lattice(#[from] LatticeError),
    /// The surface alone has more cells than fit in memory.
    #[error("the surface would take about {0:.1e} cells: choose a lower resolution")]
    TooManyCells(f64),
    /// The result is not what it should be, which is a fault of this program.
    #[error("the repaired mesh is not closed: {0}")]
    NotSolid(#[from] NotSolid),
    /// Loops could not be told apart, which is a fault of this program.
    #[error("the surface could not be told apart in {0} cells")]
    Unresolved(usize),
    /// The work was interrupted.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What a repair tells of its own work. Lengths are in the input's unit.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct RepairAccount {
    /// The input.
    pub census: Census,
    /// Edge of a cell.
    pub cell: f64,
    /// Cells along x, y and z.
    pub cells: [u32; 3],
    /// Gaps of this width are closed.
    pub gap: f64,
    /// Every output coordinate is exact in single precision.
    pub exact_in_single_precision: bool,
    /// Openings through which the outside gets, or would get, into a large space.
    pub throats: Vec<Throat>,
    /// How many gaps were closed where the outside can see it.
    pub gaps_closed: usize,
    /// The largest of them.
    pub largest_gaps: Vec<ClosedGap>,
    /// Spaces that the outside does not reach.
    pub enclosed: Enclosed,
    /// Cells of the surface.
    pub surface_cells: usize,
    /// Cells that were filled so that sheets of the surface could be told apart.
    pub filled_to_part: u64,
    /// Quads in two triangles.
    pub quads: u64,
    /// Quads that kept their point on an edge of a cell.
    pub fans: u64,
    /// What came of it where single sheets were asked for.
    pub sheets: Option<SheetAccount>,
}

/// A gap that was closed: surface where the input has none.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ClosedGap {
    /// The middle of its box.
    pub place: [f64; 3],
    /// The diagonal of its box.
    pub size: f64,
    /// Cells that it goes through.
    pub cells: usize,
}

/// Gaps that a report lists one by one.
const LISTED: usize = 20;

/// A repaired model.
#[derive(Debug, Clone, PartialEq)]
pub struct Repaired {
    /// Closed, oriented, 2-manifold, free of self-intersection.
    pub solid: Solid,
    /// What was done.
    pub account: RepairAccount,
}

/// A model on its lattice, its cells labelled.
struct Prepared {
    census: Census,
    throats: Vec<Throat>,
    frame: Frame,
    content: Content,
    rims: Rims,
    labels: Labels,
    enclosed: Enclosed,
}

/// Labels the cells; throats are looked for where the gap is automatic and `seek` says so.
fn prepare(
    mesh: &Mesh,
    options: &RepairOptions,
    seek: bool,
    run: &Run,
) -> Result<Prepared, RepairError> {
    let bounds = used_bounds(mesh).ok_or(RepairError::Empty)?;
    let census = Census::of(mesh, run)?;
    let throats = if seek { throats::throats(mesh, bounds, run)? } else { Vec::new() };
    let options = throats::settle(options, &throats);
    let frame = Frame::new(bounds, options.size, options.gap)?;
    let content = Content::new(mesh, &frame, run)?;
    let rims = content.rims(&frame, run)?;
    let reach = frame.reach.rounds().div_ceil(BRICK);
    let (bricks, near) =
        content::bricks_round(frame.bricks(), content.codes(), &rims.cells(), reach);
    let (full, _) = content.full(&bricks);
    let winding = options.keep_cavities.map(|least| (least, Winding::new(mesh)));
    let keep = |cells: u64, at: [u32; 3]| {
        let volume = cells as f64 * frame.cell().powi(3);
        winding.as_ref().is_some_and(|(least, winding)| {
            volume >= *least && winding.at(frame.centre(at)).abs() < 0.5
        })
    };
    let (labels, enclosed) = Labels::new(bricks, &full, near, frame.reach, &keep, run)?;
    Ok(Prepared { census, throats, frame, content, rims, labels, enclosed })
}

/// Repairs a model.
pub fn repair(mesh: &Mesh, options: &RepairOptions, run: &Run) -> Result<Repaired, RepairError> {
    let Prepared { census, throats, frame, content, mut labels, enclosed, .. } =
        prepare(mesh, options, true, run)?;
    let mut filled = 0;
    let (patches, membranes, surface_cells) = loop {
        let (_, ranges) = content.full(&labels.bricks);
        let placement = Placement::new(&content, &labels.bricks, &ranges, &frame);
        match extract(&labels, &placement, frame.steps, true, run)? {
            Extracted::Done { patches, membranes, cells } => break (patches, membranes, cells),
            Extracted::Shared(cells) => {
                filled += cells.len() as u64;
                labels.fill(&cells);
            }
        }
    };
    if patches.triangles.is_empty() {
        return Err(RepairError::Thin(frame.cell()));
    }
    let gap = frame.gap();
    tell(&throats, gap, filled, run);
    let account = RepairAccount {
        census,
        cell: frame.cell(),
        cells: frame.lattice.cells(),
        gap,
        exact_in_single_precision: frame.single,
        throats,
        gaps_closed: membranes.len(),
        largest_gaps: largest(&membranes, &frame),
        enclosed,
        surface_cells,
        filled_to_part: filled,
        quads: patches.quads,
        fans: patches.fans,
        sheets: None,
    };
    let points = crate::par::map(&patches.points, |&p| frame.world(p));
    let mut output =
        Mesh { points, triangles: patches.triangles, unit: mesh.unit, ..Mesh::default() };
    output.attributes = inheritance::inherit(mesh, &output, run)?;
    run.stage("prove");
    Ok(Repaired { solid: Solid::try_from(output)?, account })
}

/// What may surprise.
fn tell(throats: &[Throat], gap: f64, filled: u64, run: &Run) {
    if let Some(throat) = throats.iter().find(|t| t.width > gap) {
        let ([x, y, z], width) = (throat.place, throat.width);
        let text = format!(
            "the outside gets in through an opening near {x:.4}, {y:.4}, {z:.4}, so what is behind \
             it is a shell: a gap of {width:.4} closes it"
        );
        run.finding(Finding::warning("leak", text));
    }
    if filled > 0 {
        let text = format!("{filled} cells were filled to tell sheets of the surface apart");
        run.finding(Finding::note("filled-to-part", text).of(filled));
    }
}

fn largest(membranes: &[Membrane], frame: &Frame) -> Vec<ClosedGap> {
    let mut order: Vec<&Membrane> = membranes.iter().collect();
    order.sort_by_key(|m| (std::cmp::Reverse(m.cells), m.bounds));
    let gap = |m: &&Membrane| {
        let [low, high] = m.bounds.map(|p| frame.world(p));
        let size = (0..3).map(|a| (high[a] - low[a]).powi(2)).sum::<f64>().sqrt();
        let place = std::array::from_fn(|a| f64::midpoint(low[a], high[a]));
        ClosedGap { place, size, cells: m.cells }
    };
    order.iter().take(LISTED).map(gap).collect()
}

/// The box round the points that triangles use.
fn used_bounds(mesh: &Mesh) -> Option<[[f64; 3]; 2]> {
    let used = mesh.triangles.iter().flatten().map(|&p| mesh.points[p as usize]);
    used.fold(None, |bounds: Option<[[f64; 3]; 2]>, p| {
        let [low, high] = bounds.unwrap_or([p, p]);
        Some([
            std::array::from_fn(|a| low[a].min(p[a])),
            std::array::from_fn(|a| high[a].max(p[a])),
        ])
    })
}

/// What came of an extraction.
enum Extracted {
    /// The surface, its parts where the input has none, and in how many cells it is.
    Done { patches: Patches, membranes: Vec<Membrane>, cells: usize },
    /// These outside cells must be filled first.
    Shared(Vec<[u32; 3]>),
}

/// The surface between outside cells and all others.
fn extract<G: Guide>(
    labels: &Labels,
    guide: &G,
    steps: i32,
    lean: bool,
    run: &Run,
) -> Result<Extracted, RepairError> {
    let too_many = RepairError::TooManyCells(f64::from(u32::MAX));
    let Some(cells) = Cells::new(labels, run)? else { return Err(too_many) };
    let mut apexes = match Apexes::new(&cells, guide, steps, run)? {
        Ok(apexes) => apexes,
        Err(failed) => {
            let mut fill: Vec<[u32; 3]> = Vec::new();
            for place in &failed {
                let config = cells.members.find(*place).map(|cell| cells.config(cell));
                let round = config.map(|c| apexes::touching(*place, c)).unwrap_or_default();
                fill.extend(round.into_iter().find(|&at| labels.is_outside(at)));
            }
            fill.sort_unstable();
            fill.dedup();
            if fill.is_empty() {
                return Err(RepairError::Unresolved(failed.len()));
            }
            return Ok(Extracted::Shared(fill));
        }
    };
    let membranes = smoothing::smooth(&cells, &mut apexes, steps, run)?;
    let count = cells.len();
    let Some(patches) = patches::patches(&cells, apexes, guide, steps, lean, run)? else {
        return Err(too_many);
    };
    Ok(Extracted::Done { patches, membranes, cells: count })
}

#[cfg(test)]
mod tests;
