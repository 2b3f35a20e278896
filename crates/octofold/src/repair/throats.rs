//! Openings through which the outside gets in, and how wide a gap must be closed to keep it out.
//!
//! Boundary edges are dilated far, and given back round by round from the widest reach on, while the
//! outside floods what opens: a flood of maximum capacity, which tells for every width at once what
//! is reached. Where one opening lets it into a large space at once, that is a throat. It is run on a
//! coarse grid, where reach is cheap. Source: specification of repair (D.4).

use super::bricks::{BRICK, Block, Bricks, coordinates, count, each};
use super::content::{self, Content};
use super::frame::{Frame, Gap};
use super::labels::{from_border, spread};
use super::reach::Reach;
use super::{RepairError, RepairOptions};
use crate::mesh::Mesh;
use crate::run::Run;
use crate::voxelize::Size;

/// Cells along the longest side of the coarse grid.
const RESOLUTION: u32 = 128;

/// Rounds of dilation: the widest opening is a quarter of the longest side.
const ROUNDS: u32 = RESOLUTION / 8;

/// The smallest share of the model's box behind a throat.
const SHARE: f64 = 0.01;

/// The smallest space behind a throat, in cubes of its width: the mouth of a cup is none.
const CUBES: f64 = 8.0;

/// An opening through which the outside gets into a space.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Throat {
    /// A gap of this width closes it, in the input's unit; to within a 64th of the longest side.
    pub width: f64,
    /// Where it is.
    pub place: [f64; 3],
    /// The volume behind it.
    pub volume: f64,
}

/// The throats of a model, widest first; none where its surface has no boundary.
pub fn throats(mesh: &Mesh, bounds: [[f64; 3]; 2], run: &Run) -> Result<Vec<Throat>, RepairError> {
    let gap = Gap::Cells(2.0 * f64::from(ROUNDS));
    let frame = Frame::new(bounds, Size::Resolution(RESOLUTION), gap)?;
    let content = Content::new(mesh, &frame, run)?;
    let rims = content.rims(&frame, run)?.cells();
    if rims.is_empty() {
        return Ok(Vec::new());
    }
    run.stage("throats");
    let reach = ROUNDS.div_ceil(BRICK);
    let (bricks, rims) = content::bricks_round(frame.bricks(), content.codes(), &rims, reach);
    let (full, _) = content.full(&bricks);
    let mut near = Vec::new();
    for round in 0..=ROUNDS {
        near.push(spread(&bricks, rims.clone(), Reach::new(f64::from(round)), run)?);
    }
    let closed: Vec<Block> = full
        .iter()
        .zip(&near[ROUNDS as usize])
        .map(|(f, n)| std::array::from_fn(|z| f[z] | n[z]))
        .collect();
    let mut flood = from_border(&bricks, closed, run)?;
    let box_volume: f64 =
        (0..3).map(|a| (bounds[1][a] - bounds[0][a]) / frame.cell()).map(|n| n.max(1.0)).product();
    let mut found = Vec::new();
    for round in (0..ROUNDS as usize).rev() {
        for brick in 0..bricks.len() as u32 {
            let b = brick as usize;
            let opened: Block =
                std::array::from_fn(|z| near[round + 1][b][z] & !near[round][b][z] & !full[b][z]);
            if opened == [0; 8] {
                continue;
            }
            let before = flood.volume;
            flood.open(brick, &opened);
            flood.spread(run)?;
            let gained = (flood.volume - before).saturating_sub(u64::from(count(&opened)));
            // The coarse grid sees boundary edges up to a cell thicker than they are.
            let width = 2.0 * (round as f64 + 2.0);
            if gained as f64 > f64::max(SHARE * box_volume, CUBES * width.powi(3)) {
                found.push(Throat {
                    width: width * frame.cell(),
                    place: middle(&bricks, brick, &opened, &frame),
                    volume: gained as f64 * frame.cell().powi(3),
                });
            }
        }
    }
    Ok(found)
}

/// The options with a gap of known width: where that is up to the model, the one that keeps the
/// outside out of all throats.
pub fn settle(options: &RepairOptions, throats: &[Throat]) -> RepairOptions {
    let widest = throats.iter().map(|t| t.width).reduce(f64::max);
    match (options.gap, widest) {
        (Gap::Auto, Some(width)) => RepairOptions { gap: Gap::Width(width), ..*options },
        _ => *options,
    }
}

/// The middle of cells of a brick, in the world.
fn middle(bricks: &Bricks, brick: u32, cells: &Block, frame: &Frame) -> [f64; 3] {
    let corner = bricks.at(brick).map(|x| f64::from(x * BRICK) + 0.5);
    let mut sum = [0.0; 3];
    each(cells, |cell| {
        let at = coordinates(cell);
        (0..3).for_each(|a| sum[a] += corner[a] + f64::from(at[a]));
    });
    let n = f64::from(count(cells));
    std::array::from_fn(|a| frame.lattice.origin()[a] + sum[a] / n * frame.cell())
}
