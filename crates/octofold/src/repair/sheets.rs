//! Single sheets: parts of a model that are thin come out as one sheet, thick parts stay closed.
//!
//! The cells are labelled as for closed repair. The surface is then the dual of grid edges whose four
//! cells are not outside: one quad for each, not one for each side. What lies between two walls of a
//! thin part is collapsed. The result is a *sheet complex*: its edges join one, two or more sheets,
//! each patch is turned one way, and no two triangles meet but in what they share. Sources: Dohi,
//! Mitani, Nishihara, Fukui, single sheets by one face for each set of vertices (kept as
//! [`SheetRule::Dohi`]); specification of repair (A.2).

mod apexes;
mod cells;
mod collapse;
mod complex;
mod guide;
mod patches;
mod pockets;
mod thick;
mod traced;
mod weave;

use super::frame::Frame;
use super::piercing::Point;
use super::placement::Placement;
use super::smoothing::{self, Loose, Membrane};
use super::{Prepared, RepairAccount, RepairError, RepairOptions, inheritance, labels};
use super::{largest, prepare};
use crate::mesh::Mesh;
use crate::run::{Finding, Run};
use crate::surface::cell::{edge_at, edge_axis, edge_corner};
use apexes::Apexes;
use cells::Cells;
use collapse::Collapsed;
use complex::Complex;
use guide::SheetGuide;
use patches::Patches;
use traced::Traced;
use weave::Woven;

/// How single sheets are made.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SheetOptions {
    /// Cells and gaps; an automatic gap is the least.
    pub repair: RepairOptions,
    /// What makes one sheet of two.
    pub rule: SheetRule,
    /// Parts thinner than this become sheets, in the input's unit; never less than two cells.
    pub thickness: f64,
}

impl Default for SheetOptions {
    fn default() -> Self {
        let repair = RepairOptions::default();
        Self { repair, rule: SheetRule::Collapse, thickness: 0.0 }
    }
}

/// What makes one sheet of the two sides of a thin part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SheetRule {
    /// Elementary collapses of thin 3-cells.
    Collapse,
    /// As published: one face for each set of vertices, one vertex in each cell.
    Dohi,
}

/// What a sheet complex consists of. Lengths are in the input's unit.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SheetAccount {
    /// How it was made.
    pub rule: SheetRule,
    /// Parts thinner than this are sheets.
    pub thickness: f64,
    /// Parts of the surface between borders and junctions.
    pub patches: usize,
    /// Those without a border or junction.
    pub closed_patches: usize,
    /// Those with one side only, as of a Moebius band: they cannot be turned one way.
    pub one_sided_patches: usize,
    /// Length of all borders.
    pub border_length: f64,
    /// Lines at which more than two sheets meet, longest first.
    pub junctions: Vec<Junction>,
    /// Length of all junctions.
    pub junction_length: f64,
    /// Points at which parts of the surface touch that do not meet in an edge there.
    pub pinches: u64,
    /// Grid vertices in thin parts: those that were collapsed, or with the published rule those
    /// that it leaves as pillows.
    pub thin_vertices: u64,
    /// Those of them that lay between two parallel walls.
    pub between_walls: u64,
    /// Quads beyond the borders of the input that were taken away.
    pub dangling: u64,
}

/// A line at which more than two sheets meet.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Junction {
    /// Sheets at it.
    pub sheets: u32,
    /// Its length.
    pub length: f64,
    /// Its box.
    pub bounds: [[f64; 3]; 2],
}

/// A model of single sheets and closed parts.
#[derive(Debug, Clone, PartialEq)]
pub struct SheetComplex {
    /// Free of self-intersection; edges may have one, two or more triangles.
    pub mesh: Mesh,
    /// The patch of each triangle.
    pub patches: Vec<u32>,
    /// What was done.
    pub account: RepairAccount,
}

/// Makes single sheets of what is thin in a model.
pub fn sheets(mesh: &Mesh, options: &SheetOptions, run: &Run) -> Result<SheetComplex, RepairError> {
    let Prepared { census, throats, frame, content, rims, labels, enclosed } =
        prepare(mesh, &options.repair, false, run)?;
    let rounds = rounds(options.thickness, &frame)?;
    let (_, ranges) = content.full(&labels.bricks);
    let placement = Placement::new(&content, &labels.bricks, &ranges, &frame);
    let traced = Traced { placement: &placement, rims: &rims, bricks: &labels.bricks, rounds };
    let (surface, collapsed) =
        extract(&labels, &traced, options.rule, rounds, frame.steps, true, run)?;
    if surface.triangles.is_empty() {
        return Err(RepairError::Thin(frame.cell()));
    }
    let account = RepairAccount {
        census,
        cell: frame.cell(),
        cells: frame.lattice.cells(),
        gap: frame.gap(),
        exact_in_single_precision: frame.single,
        throats,
        gaps_closed: surface.membranes.len(),
        largest_gaps: largest(&surface.membranes, &frame),
        enclosed,
        surface_cells: surface.cells,
        filled_to_part: 0,
        quads: surface.quads,
        fans: surface.fans,
        sheets: Some(tell(&surface, collapsed, options.rule, rounds, &frame, run)),
    };
    let points = crate::par::map(&surface.points, |&p| frame.world(p));
    let mut output =
        Mesh { points, triangles: surface.triangles, unit: mesh.unit, ..Mesh::default() };
    output.attributes = inheritance::inherit(mesh, &output, run)?;
    Ok(SheetComplex { mesh: output, patches: surface.patches.of, account })
}

/// Rounds of erosion that leave nothing of parts of a thickness.
fn rounds(thickness: f64, frame: &Frame) -> Result<u32, RepairError> {
    let cells = thickness / frame.cell();
    let rounds = (cells / 2.0).ceil().max(1.0);
    if rounds <= f64::from(thick::MOST_ROUNDS) {
        Ok(rounds as u32)
    } else {
        Err(RepairError::Thickness { thickness, cells, most: 2 * thick::MOST_ROUNDS })
    }
}

/// A sheet complex on the output lattice.
struct Surface {
    points: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    patches: Patches,
    membranes: Vec<Membrane>,
    cells: usize,
    pinches: u64,
    quads: u64,
    fans: u64,
}

/// Makes the sheet complex of some labels. Without `lean` all points on walls stay.
fn extract<G: SheetGuide>(
    labels: &labels::Labels,
    guide: &G,
    rule: SheetRule,
    rounds: u32,
    steps: i32,
    lean: bool,
    run: &Run,
) -> Result<(Surface, Collapsed), RepairError> {
    let too_many = || RepairError::TooManyCells(f64::from(u32::MAX));
    run.stage("thin parts");
    let open = complex::open_vertices(labels, run)?;
    let (outside, inside) = (&labels.outside_runs, &labels.inside_runs);
    let solid = thick::thick(&labels.bricks, &open, outside, inside, rounds, run)?;
    let (mut complex, collapsed, pockets) = match rule {
        SheetRule::Collapse => {
            let mut complex = Complex::new(labels, open, solid, run)?;
            let found = collapse::collapse(&mut complex, guide, rounds, run)?;
            let (collapsed, pockets) = found.ok_or_else(too_many)?;
            (complex, collapsed, Some(pockets))
        }
        SheetRule::Dohi => {
            let closed: Vec<_> = open.iter().map(|o| o.map(|w| !w)).collect();
            let thin = closed.iter().zip(&solid).flat_map(|(c, s)| c.iter().zip(s));
            let cells = thin.map(|(c, s)| u64::from((c & !s).count_ones())).sum();
            let complex = Complex::new(labels, open, closed, run)?;
            (complex, Collapsed { cells, ..Collapsed::default() }, None)
        }
    };
    let cells = Cells::new(&complex, guide, rule == SheetRule::Dohi, run)?.ok_or_else(too_many)?;
    let mut apexes = Apexes::new(&cells, pockets.as_ref(), guide, steps, run)?;
    let membranes = smooth(&cells, &mut apexes, steps, run)?;
    let woven = weave::weave(&complex, &cells, &apexes, guide, steps, lean, run)?;
    let Woven { points, mut triangles, outward, quads, fans } = woven.ok_or_else(too_many)?;
    let (count, pinches) = (cells.members.len(), apexes.pinches);
    drop((cells, apexes, pockets));
    complex.quads = Default::default();
    run.stage("patches");
    let points = compact(points, &mut triangles);
    let patches = patches::patches(&points, &mut triangles, &outward);
    let surface =
        Surface { points, triangles, patches, membranes, cells: count, pinches, quads, fans };
    Ok((surface, collapsed))
}

/// Smooths the vertices of leaves where the input has nothing.
fn smooth(
    cells: &Cells<'_>,
    apexes: &mut Apexes,
    steps: i32,
    run: &Run,
) -> Result<Vec<Membrane>, RepairError> {
    run.stage("smooth");
    let parts = cells.members.per_brick(run, |bricks| {
        let mut loose = Vec::new();
        for brick in bricks {
            cells.members.in_brick(brick, |cell, place| {
                for (vertex, leaf) in cells.leaves(cell) {
                    if apexes.ranks[vertex as usize] > 0 || !leaf.alone {
                        continue;
                    }
                    let low = place.at.map(|x| x as i32 * steps);
                    let config = cells.config(cell);
                    let mut around = Vec::new();
                    for f in 0..6 {
                        let [group, _] = config.groups(f);
                        if group == 0 {
                            continue;
                        }
                        let (axis, e) = (f / 2, group.trailing_zeros() as usize);
                        if let Some(beside) = cells.along(place, axis, 2 * (f % 2) as i32 - 1) {
                            let e = edge_at(edge_corner(e) ^ 1 << axis, edge_axis(e));
                            around.push(apexes.of[cells.leaf_at(beside, e) as usize]);
                        }
                    }
                    loose.push(Loose { vertex, low, around });
                }
            });
        }
        loose
    })?;
    let loose: Vec<Loose> = parts.into_iter().flatten().collect();
    if loose.is_empty() {
        return Ok(Vec::new());
    }
    let free = vec![true; loose.len()];
    Ok(smoothing::settle(&loose, &free, &mut apexes.points, steps, run)?)
}

/// Drops points that no triangle uses.
fn compact(points: Vec<Point>, triangles: &mut [[u32; 3]]) -> Vec<Point> {
    let mut number = vec![u32::MAX; points.len()];
    triangles.iter().flatten().for_each(|&p| number[p as usize] = 0);
    let mut kept = Vec::with_capacity(points.len());
    for (number, point) in number.iter_mut().zip(points).filter(|(n, _)| **n == 0) {
        *number = kept.len() as u32;
        kept.push(point);
    }
    triangles.iter_mut().flatten().for_each(|p| *p = number[*p as usize]);
    kept
}

fn tell(
    surface: &Surface,
    collapsed: Collapsed,
    rule: SheetRule,
    rounds: u32,
    frame: &Frame,
    run: &Run,
) -> SheetAccount {
    let Surface { points, patches, pinches, .. } = surface;
    let step = frame.cell() / f64::from(frame.steps);
    let junctions: Vec<Junction> = patches::lines(points, &patches.junctions)
        .into_iter()
        .map(|line| Junction {
            sheets: line.sheets,
            length: line.length * step,
            bounds: line.bounds.map(|p| frame.world(p)),
        })
        .collect();
    if patches.one_sided > 0 {
        let text = format!(
            "{} patches have one side only, as a Moebius band: they cannot be turned one way",
            patches.one_sided
        );
        run.finding(Finding::warning("one-sided", text).of(patches.one_sided as u64));
    }
    let length = |[p, q]: [u32; 2]| {
        let [p, q] = [p, q].map(|p| points[p as usize]);
        let away = super::piercing::sub(p, q).map(|x| x as f64);
        away.iter().map(|x| x * x).sum::<f64>().sqrt() * step
    };
    SheetAccount {
        rule,
        thickness: 2.0 * f64::from(rounds) * frame.cell(),
        patches: patches.count,
        closed_patches: patches.closed,
        one_sided_patches: patches.one_sided,
        // An empty sum is minus zero.
        border_length: patches.borders.iter().map(|&e| length(e)).sum::<f64>() + 0.0,
        junction_length: junctions.iter().map(|j| j.length).sum::<f64>() + 0.0,
        junctions,
        pinches: *pinches,
        thin_vertices: collapsed.cells,
        between_walls: collapsed.between_walls,
        dangling: collapsed.dangling,
    }
}

#[cfg(test)]
mod tests;
