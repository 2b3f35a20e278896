//! `octofold net union`, `intersection`, `difference` and `xor`: set operations from file to file.

use super::LayoutArgs;
use crate::files::{self, Opened, Output, OutputArgs, ReadingArgs};
use crate::job::{Job, Outcome};
use anyhow::{Context, Result, ensure};
use octofold::network::carry::{combine_painted, framed_painted};
use octofold::network::combine::{Operation, combine};
use octofold::network::frame::framed;
use octofold::network::painted::Painted;
use octofold::spans::Spans;
use octofold::{Kind, Shape, Volume};
use octofold_io::ofn::{File, SolidWriter};
use std::path::PathBuf;
use std::sync::Arc;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    /// Solids to read, two or more: .ofn files or any binary volumes
    #[arg(value_name = "IN", required = true, num_args = 2..)]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    layout: LayoutArgs,
    #[command(flatten)]
    reading: ReadingArgs,
}

const AFTER_HELP: &str = "\
Solids on one grid, from .ofn to .ofn, are read and written slab after slab and never held whole.
Where grids lie whole voxels apart they are shifted; any other is resampled to the voxels of the
first. A surface voxel of the result carries the label or colour of the first operand on whose
surface it lies; where a cut lays it bare, that of the voxel on the other side of the cut.

Example:
  octofold net difference block.ofn hole.ofn part.ofn";

impl Args {
    /// Validates, combines and writes.
    pub fn run(self, operation: Operation, job: &Job) -> Result<Outcome> {
        let output = self.output.check()?.in_layout(self.layout.into())?;
        ensure!(
            output.kind() == Kind::Volume,
            "{} holds a mesh, and a solid is to be written: `octofold surface` makes a mesh of it",
            output.name()
        );
        let inputs = self.inputs.iter().map(|path| self.reading.of(path)?.open());
        let inputs = inputs.collect::<Result<Vec<_>>>()?;
        if !job.json
            && let Some(bytes) = streamed(operation, &inputs, &output, job)?
        {
            job.run.stage("write");
            files::write(&output.path, &bytes)?;
            job.terminal.finish();
            let seconds = job.terminal.seconds();
            let text = format!("{}: {} bytes, {seconds:.2} s", output.name(), bytes.len());
            job.terminal.say(&text);
            return Ok(Outcome::Holds);
        }
        let volumes = inputs.iter().map(|input| input.read_volume(&job.run));
        let volumes = volumes.collect::<Result<Vec<_>>>()?;
        let each = || inputs.iter().zip(&volumes);
        if volumes.iter().any(|volume| volume.payload().is_some()) {
            let solids = each().map(|(input, volume)| {
                if let Some(painted) = Painted::of(volume.as_ref(), &job.run)? {
                    return Ok(painted);
                }
                Ok(Painted::plain(input.solid(volume.as_ref(), &job.run)?, &job.run)?)
            });
            let solids = framed_painted(operation, solids.collect::<Result<_>>()?, &job.run)?;
            job.run.stage("combine");
            let combined = combine_painted(operation, &solids, &job.run)?;
            let combined = combined.context("there are no solids to combine")?;
            return job.write(&Shape::Volume(Arc::new(combined)), &output);
        }
        let solids = each().map(|(input, volume)| input.solid(volume.as_ref(), &job.run));
        let solids = solids.collect::<Result<Vec<_>>>()?;
        drop(volumes);
        let solids = framed(operation, solids, &job.run)?;
        job.run.stage("combine");
        let solids: Vec<&Spans> = solids.iter().collect();
        let combined = combine(operation, &solids, &job.run)?;
        let Some(combined) = combined else { anyhow::bail!("there are no solids to combine") };
        job.write(&Shape::Volume(Arc::new(combined)), &output)
    }
}

/// The result as a stream, made slab after slab; `None` where files or grids do not allow that.
fn streamed(
    operation: Operation,
    inputs: &[Opened],
    output: &Output,
    job: &Job,
) -> Result<Option<Vec<u8>>> {
    let Some(mode) = output.stream() else { return Ok(None) };
    let files = inputs.iter().map(|input| input.network(&job.run)).collect::<Result<Vec<_>>>()?;
    let Some(files) = files.into_iter().collect::<Option<Vec<File>>>() else { return Ok(None) };
    if files.iter().any(|file| !file.kinds().is_none()) {
        return Ok(None);
    }
    let grid = |file: &File| (file.dims(), file.placement());
    let Some(first) = files.first().filter(|&first| files.iter().all(|f| grid(f) == grid(first)))
    else {
        return Ok(None);
    };
    job.run.stage("combine");
    let slabs = files.iter().map(|file| file.slabs(&job.run));
    let mut slabs = slabs.collect::<Result<Vec<_>, _>>()?;
    let mut writer = SolidWriter::new(first.dims(), first.placement(), mode);
    let depth = first.dims()[2];
    let mut done = 0;
    while done < depth {
        let next = slabs.iter_mut().map(|file| file.next_slab(&job.run));
        let next = next.collect::<Result<Option<Vec<_>>, _>>()?;
        let solids = next.unwrap_or_default();
        let solids: Vec<&Spans> = solids.iter().collect();
        let Some(combined) = combine(operation, &solids, &job.run)? else { break };
        writer.push(&combined, &job.run)?;
        done += combined.dims()[2];
    }
    Ok(Some(writer.finish()))
}
