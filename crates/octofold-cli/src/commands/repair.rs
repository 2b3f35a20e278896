//! `octofold repair`: any polygons into a closed mesh, or into single sheets where they are thin.

use crate::files::{InputArgs, Output, OutputArgs};
use crate::job::{Job, Outcome};
use anyhow::{Result, ensure};
use octofold::pipeline::Step;
use octofold::repair::{Gap, RepairOptions, SheetOptions, SheetRule};
use octofold::voxelize::Size;
use std::path::PathBuf;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// Cells along the longest side of the model's box [default: 256]
    #[arg(long, value_name = "N", group = "size")]
    resolution: Option<u32>,
    /// Side of a cell, in the model's own unit
    #[arg(long, value_name = "SIZE", group = "size")]
    cell: Option<f64>,
    /// Widest gap or hole that is closed, in the model's own unit; auto closes those through which
    /// the outside gets into a large space, up to a quarter of the model's longest side, and else
    /// those of two cells
    #[arg(long, value_name = "G", default_value = "auto", value_parser = parse_gap)]
    gap: Gap,
    /// Leave cavities empty, those of at least this volume where one is named: enclosed spaces that
    /// the model does not wind round
    #[arg(long, value_name = "VOLUME", num_args = 0..=1, default_missing_value = "0",
        require_equals = true)]
    keep_cavities: Option<f64>,
    /// Make one sheet of parts that are thin instead of a front and a back; dohi: by the rule as
    /// published, with its faults
    #[arg(long, value_name = "RULE", num_args = 0..=1, default_missing_value = "collapse",
        require_equals = true)]
    sheet: Option<RuleArg>,
    /// With --sheet: parts thinner than this are sheets, in the model's own unit, up to eight cells
    /// [default: two cells]
    #[arg(long, value_name = "T", requires = "sheet")]
    thickness: Option<f64>,
    /// Also write a mesh coloured by what was done: kept (gray), closed (orange), and of the input
    /// what is gone (blue)
    #[arg(long, value_name = "FILE")]
    explain: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum RuleArg {
    Collapse,
    Dohi,
}

const AFTER_HELP: &str = "\
Whatever the input, the output is closed, oriented and manifold, and no two triangles meet outside
what they share. That is proved again from the written file; exit code 1 where the file's format
has spoilt it. Parts thinner than a cell get a front and a back; parts smaller than a cell, and
whatever lies inside, vanish. With --sheet thin parts get one sheet instead: edges may then have one,
two or more faces, each patch is turned one way, and --gap auto is two cells. With --json the report tells under `repair` what was found and done.

Examples:
  octofold repair scan.obj scan.stl
  octofold repair house.glb house.3mf --resolution 512 --gap 0.05
  octofold repair house.glb sheets.obj --sheet --explain changes.ply
  octofold repair bottle.stl bottle.ply --cell 0.2 --keep-cavities=100";

fn parse_gap(text: &str) -> Result<Gap, String> {
    if text == "auto" {
        return Ok(Gap::Auto);
    }
    match text.parse::<f64>() {
        Ok(width) if width.is_finite() && width >= 0.0 => Ok(Gap::Width(width)),
        _ => Err("a width that is not negative, or auto, is asked for".into()),
    }
}

impl Args {
    /// Validates and repairs.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let size = match (self.resolution, self.cell) {
            (_, Some(cell)) => {
                ensure!(cell.is_finite() && cell > 0.0, "--cell must be above 0");
                Size::Pitch(cell)
            }
            (resolution, None) => Size::Resolution(resolution.unwrap_or(256)),
        };
        let finite = |x: f64| x.is_finite() && x >= 0.0;
        ensure!(self.keep_cavities.is_none_or(finite), "--keep-cavities must not be negative");
        let options = RepairOptions { size, gap: self.gap, keep_cavities: self.keep_cavities };
        let (input, output) = (self.input.check()?, self.output.check()?);
        let finite = |x: f64| x.is_finite() && x >= 0.0;
        ensure!(self.thickness.is_none_or(finite), "--thickness must not be negative");
        let step = match self.sheet {
            None => Step::Repair(options),
            Some(rule) => Step::Sheets(SheetOptions {
                repair: options,
                rule: match rule {
                    RuleArg::Collapse => SheetRule::Collapse,
                    RuleArg::Dohi => SheetRule::Dohi,
                },
                thickness: self.thickness.unwrap_or(0.0),
            }),
        };
        let explain = self.explain.map(|path| Output::new(path, None)).transpose()?;
        job.repair(&input, step, &output, explain.as_ref())
    }
}
