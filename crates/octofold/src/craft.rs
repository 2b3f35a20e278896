//! Craft: any polygons become sheets of paper that fold into a model of them, with nothing to do by
//! hand.
//!
//! What cannot be built as it is (faces that cut each other, cracks, parts within parts) is repaired
//! first, thin parts to single sheets. Parts too small to hold are left out, and the rest is
//! simplified and flattened until it has no more flat faces than asked for; where the topology
//! stands against that, it is repaired again on larger cells. All this is a list of [`Step`]s, told in
//! the account, that gives the same mesh again. Source: Dohi, Mitani, Nishihara and Fukui;
//! specification of papercraft (C1 to C4).

mod survey;

pub use survey::Cause;

use crate::mesh::{Mesh, bounds};
use crate::pipeline::{self, Made, Shape, Step, StepError};
use crate::repair::{Gap, RepairAccount, RepairError, RepairOptions, SheetOptions};
use crate::run::{Finding, Run, Watch};
use crate::simplify::{PruneAccount, PruneOptions, SimplifyAccount, SimplifyOptions};
use crate::unfold::{
    self, FlattenAccount, FlattenOptions, Scale, UnfoldError, UnfoldOptions, Unfolded,
};
use crate::voxelize::Size;
use std::sync::Arc;

/// How a model is made of paper.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CraftOptions {
    /// The most flat faces.
    pub faces: u64,
    /// Cells along the longest side where the model is repaired; by its size on paper where not told.
    pub resolution: Option<u32>,
    /// How far points may move so that faces are flat, in millimetres on paper.
    pub flatness: f64,
    /// Parts shorter than this are left out, in millimetres on paper.
    pub smallest: f64,
    /// The model is made smaller where a face would not fit a page; else that is cut across.
    pub shrink: bool,
    /// Pages, tabs and size.
    pub sheets: UnfoldOptions,
}

impl Default for CraftOptions {
    fn default() -> Self {
        Self {
            faces: 200,
            resolution: None,
            flatness: 0.5,
            smallest: 5.0,
            shrink: true,
            sheets: UnfoldOptions { effort: EFFORT, ..UnfoldOptions::default() },
        }
    }
}

/// Why there are no sheets.
#[derive(Debug, thiserror::Error)]
pub enum CraftError {
    /// The model could not be made ready.
    #[error(transparent)]
    Step(#[from] StepError),
    /// It could not be unfolded.
    #[error(transparent)]
    Unfold(#[from] UnfoldError),
}

impl From<crate::run::Cancelled> for CraftError {
    fn from(cancelled: crate::run::Cancelled) -> Self {
        Self::Step(cancelled.into())
    }
}

/// What is told of the work. Lengths are in millimetres on paper where nothing else is said.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct CraftAccount {
    /// Why the model was repaired; nothing where it could be built as it was.
    pub repaired: Option<Cause>,
    /// What was tried, in order.
    pub attempts: Vec<Attempt>,
    /// Which of these was taken.
    pub taken: usize,
    /// The repair, in the model's unit.
    pub repair: Option<RepairAccount>,
    /// Parts that were left out.
    pub prune: Option<PruneAccount>,
    /// The last simplification.
    pub simplify: Option<SimplifyAccount>,
    /// The flattening, in the model's unit.
    pub flatten: Option<FlattenAccount>,
    /// How much smaller the model was made than asked for, so that its faces fit the page.
    pub shrunk: Option<f64>,
}

/// One way to make the model ready, and what came of it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Attempt {
    /// The steps.
    pub steps: Vec<Step>,
    /// Flat faces.
    pub faces: Option<usize>,
    /// What stood against it.
    pub error: Option<String>,
}

/// A model of paper.
#[derive(Debug, Clone)]
pub struct Crafted {
    /// The mesh that was unfolded.
    pub mesh: Mesh,
    /// What makes this mesh of the polygons of the input.
    pub steps: Vec<Step>,
    /// What was done until it could be unfolded.
    pub account: CraftAccount,
    /// The sheets.
    pub unfolded: Unfolded,
}

/// How long to look for fewer pieces where that is not told: few parts gain from more.
pub const EFFORT: u32 = 1;

/// Thickness in millimetres on paper of parts that are better built of a single sheet, and the most
/// that it may be in cells.
const THIN: f64 = 2.0;
const THIN_CELLS: f64 = 6.0;

/// Share of the area that fewer faces may not change.
const SPOILT: f64 = 0.15;

/// Millimetres of a cell on paper where the resolution is not told, and the least and most cells.
const CELL: f64 = 1.2;
const CELLS: [f64; 2] = [32.0, 512.0];

/// Cells along the longest side where the topology of finer ones stands against few faces, as shares
/// of the first try.
const COARSER: [f64; 3] = [1.0, 0.55, 0.3];

/// Triangles for each face asked for from which further tries begin.
const AMPLE: u64 = 16;

/// Triangles for each face asked for, in hundredths: flat faces are often of several.
const SHARES: [u64; 11] = [800, 560, 400, 320, 260, 215, 180, 150, 130, 113, 100];

/// Error of the simplification that looks for what is flat already, in parts of the flatness.
const ERROR: f64 = 1.0;

/// Faces beyond those asked for, as a share, that are not worth another try.
const ENOUGH: f64 = 1.05;

/// Makes sheets of any polygons.
pub fn craft(mesh: &Mesh, options: &CraftOptions, run: &Run) -> Result<Crafted, CraftError> {
    let Some([low, high]) = bounds(&mesh.points) else { return Err(UnfoldError::Empty.into()) };
    let extent: [f64; 3] = std::array::from_fn(|a| high[a] - low[a]);
    let longest = extent.iter().copied().fold(0.0, f64::max);
    let sheets = options.sheets;
    let factor = match sheets.scale {
        Scale::Factor(factor) => factor,
        Scale::Height(height) => height / extent[sheets.up as usize],
        Scale::Size(size) => size / longest,
    };
    if !(factor.is_finite() && factor > 0.0) {
        return Err(UnfoldError::Flat.into());
    }
    run.stage("survey");
    let bare = Mesh {
        points: mesh.points.clone(),
        triangles: mesh.triangles.clone(),
        unit: mesh.unit,
        ..Mesh::default()
    };
    let cause = survey::cause(&bare, factor, run)?;
    let bench = Bench { bare, factor, options, run };
    let mut tries = Vec::new();
    if cause.is_none() {
        tries.push(Vec::new());
    }
    tries.extend(bench.repairs(longest));
    let (mut attempts, mut best): (Vec<Attempt>, Option<(usize, Ready)>) = (Vec::new(), None);
    let (mut failed, mut done): (Option<CraftError>, _) = (None, None);
    for first in tries {
        run.check()?;
        let mut steps = first;
        match bench.ready(&mut steps) {
            Ok(ready) => {
                let faces = ready.faces;
                let mut attempt = Attempt { steps, faces: Some(faces), error: None };
                if faces as f64 > ENOUGH * options.faces as f64 {
                    if best.as_ref().is_none_or(|(_, known)| faces < known.faces) {
                        best = Some((attempts.len(), ready));
                    }
                    attempts.push(attempt);
                    continue;
                }
                match bench.unfolded(&ready.mesh) {
                    Ok(unfolded) => {
                        done = Some((attempts.len(), ready, unfolded));
                        attempts.push(attempt);
                        break;
                    }
                    // A face so thin that rounding turns it over is there on these cells alone.
                    Err(error @ UnfoldError::Overlap { .. }) => {
                        attempt.error = Some(error.to_string());
                        attempts.push(attempt);
                        failed = Some(error.into());
                    }
                    Err(error) => return Err(error.into()),
                }
            }
            Err(error @ StepError::Cancelled(_)) => return Err(error.into()),
            Err(error) => {
                attempts.push(Attempt { steps, faces: None, error: Some(error.to_string()) });
                failed = Some(error.into());
            }
        }
    }
    let (taken, ready, (unfolded, shrunk)) = match (done, best) {
        (Some(done), _) => done,
        (None, Some((taken, ready))) => {
            let unfolded = bench.unfolded(&ready.mesh)?;
            (taken, ready, unfolded)
        }
        (None, None) => return Err(failed.unwrap_or(UnfoldError::Empty.into())),
    };
    tell(&ready, options, run);
    let account = CraftAccount {
        repaired: if ready.repair.is_some() { cause.or(Some(Cause::Faces)) } else { None },
        taken,
        repair: ready.repair,
        prune: ready.prune,
        simplify: ready.simplify,
        flatten: ready.flatten,
        shrunk,
        attempts: attempts.clone(),
    };
    let steps = attempts.swap_remove(taken).steps;
    Ok(Crafted { mesh: ready.mesh, steps, account, unfolded })
}

/// A mesh that can be unfolded.
struct Ready {
    mesh: Mesh,
    faces: usize,
    repair: Option<RepairAccount>,
    prune: Option<PruneAccount>,
    simplify: Option<SimplifyAccount>,
    flatten: Option<FlattenAccount>,
}

/// What all tries have in common.
struct Bench<'a> {
    bare: Mesh,
    /// Millimetres on paper for each unit of the mesh.
    factor: f64,
    options: &'a CraftOptions,
    run: &'a Run,
}

impl Bench<'_> {
    /// Repairs to try, one after the other.
    fn repairs(&self, longest: f64) -> Vec<Vec<Step>> {
        let cells = longest * self.factor / CELL;
        let finest = match self.options.resolution {
            Some(cells) => f64::from(cells),
            None => cells.clamp(CELLS[0], CELLS[1]),
        };
        let repair = |share: f64| RepairOptions {
            size: Size::Resolution((finest * share).round().max(1.0) as u32),
            gap: Gap::Auto,
            keep_cavities: None,
        };
        let sheets = |&share: &f64| {
            let cell = longest / (finest * share);
            let thickness = (THIN / self.factor).min(THIN_CELLS * cell);
            let repair = repair(share);
            vec![Step::Sheets(SheetOptions { repair, thickness, ..SheetOptions::default() })]
        };
        let closed = COARSER[1..].iter().map(|&share| vec![Step::Repair(repair(share))]);
        COARSER.iter().map(sheets).chain(closed).collect()
    }

    /// Runs `steps`, then simplifies and flattens until there are no more faces than asked for; the
    /// steps that did so are added.
    fn ready(&self, steps: &mut Vec<Step>) -> Result<Ready, StepError> {
        let options = self.options;
        let quiet =
            Run { cancel: self.run.cancel.clone(), watch: Arc::new(Quiet(self.run.clone())) };
        let prune = Step::Prune(PruneOptions { size: options.smallest / self.factor });
        steps.push(prune);
        let shape = Shape::Soup(self.bare.clone().into());
        let Made { shape, repair, prune, .. } = pipeline::pipeline(shape, steps, &quiet)?;
        let mut simplify = None;
        let mut reduce = |shape: Shape, options: SimplifyOptions, steps: &mut Vec<Step>| {
            let step = Step::Simplify(options);
            let made = pipeline::pipeline(shape, std::slice::from_ref(&step), &quiet)?;
            steps.push(step);
            simplify = made.simplify;
            Ok::<Shape, StepError>(made.shape)
        };
        let ample = SimplifyOptions { faces: Some(AMPLE * options.faces), ..Default::default() };
        let mut shape = shape;
        if triangles(&shape) as u64 > AMPLE * options.faces {
            shape = reduce(shape, ample, steps)?;
        }
        let error = ERROR * options.flatness / self.factor;
        let near = SimplifyOptions { error: Some(error), ..Default::default() };
        shape = reduce(shape, near, steps)?;
        let mut best: Option<(Made, Vec<Step>, usize)> = None;
        let whole = area(&shape);
        let flat = FlattenOptions {
            distance: options.flatness / self.factor,
            ..FlattenOptions::default()
        };
        let count = triangles(&shape);
        let fewer = SHARES.iter().map(|share| share * options.faces / 100);
        for target in std::iter::once(count as u64).chain(fewer) {
            if target > count as u64 {
                continue;
            }
            let mut own = Vec::new();
            if target < count as u64 {
                let faces = Some(target);
                own.push(Step::Simplify(SimplifyOptions { faces, ..Default::default() }));
            }
            own.push(Step::Flatten(flat));
            let made = pipeline::pipeline(shape.clone(), &own, &quiet)?;
            let faces = made.flatten.as_ref().map_or(usize::MAX, |f| f.faces);
            if best.is_some() && (area(&made.shape) / whole - 1.0).abs() > SPOILT {
                break;
            }
            if best.as_ref().is_none_or(|(_, _, known)| faces < *known) {
                best = Some((made, own, faces));
            }
            if faces as u64 <= options.faces {
                break;
            }
        }
        let Some((made, own, faces)) = best else { return Err(RepairError::Empty.into()) };
        steps.extend(own);
        let Shape::Soup(soup) = made.shape else { return Err(RepairError::Empty.into()) };
        let simplify = made.simplify.or(simplify);
        let mesh = soup.triangulate();
        Ok(Ready { mesh, faces, repair, prune, simplify, flatten: made.flatten })
    }

    /// Unfolds, smaller than asked for where that may be and must.
    fn unfolded(&self, mesh: &Mesh) -> Result<(Unfolded, Option<f64>), UnfoldError> {
        let divide = !self.options.shrink;
        let sheets = |factor: f64| {
            let scale = Scale::Factor(factor);
            UnfoldOptions { scale, divide, ..self.options.sheets }
        };
        let error = match unfold::unfold(mesh, &sheets(self.factor), self.run) {
            Ok(unfolded) => return Ok((unfolded, None)),
            Err(error) => error,
        };
        let UnfoldError::LargeFace { width, height, room_width, room_height } = error else {
            return Err(error);
        };
        // A face may lie across as well; a little less than what fits leaves room for rounding.
        let share = 0.98 * (room_width / width).min(room_height / height);
        let unfolded = unfold::unfold(mesh, &sheets(self.factor * share), self.run)?;
        let text = format!(
            "the model is made {:.0}% of its size so that its largest face fits a page",
            100.0 * share
        );
        self.run.finding(Finding::note("smaller", text));
        Ok((unfolded, Some(share)))
    }
}

/// Hears stages, and nothing that a try that is not taken has to tell.
struct Quiet(Run);

impl Watch for Quiet {
    fn stage(&self, name: &'static str) {
        self.0.stage(name);
    }

    fn progress(&self, done: u64, total: u64) {
        self.0.progress(done, total);
    }
}

fn triangles(shape: &Shape) -> usize {
    match shape {
        Shape::Soup(soup) => soup.faces(),
        Shape::Volume(_) => 0,
    }
}

fn area(shape: &Shape) -> f64 {
    let Shape::Soup(soup) = shape else { return 0.0 };
    let mesh = soup.triangulate();
    let doubled = |t: usize| {
        let [a, b, c] = mesh.corners(t).map(glam::DVec3::from);
        (b - a).cross(c - a).length()
    };
    (0..mesh.triangles.len()).map(doubled).sum::<f64>() / 2.0
}

/// What may surprise.
fn tell(ready: &Ready, options: &CraftOptions, run: &Run) {
    if let Some(prune) = ready.prune.filter(|p| p.parts_left_out > 0) {
        let text = format!(
            "{} of {} parts are smaller than {} mm and are left out",
            prune.parts_left_out, prune.parts, options.smallest
        );
        run.finding(Finding::note("small-parts", text).of(prune.parts_left_out as u64));
    }
    if ready.faces as u64 > options.faces {
        let text = format!(
            "{} faces are left where {} were asked for: fewer would change the topology, or spoil the shape",
            ready.faces, options.faces
        );
        run.finding(Finding::warning("faces", text).of(ready.faces as u64));
    }
}

#[cfg(test)]
mod tests;
