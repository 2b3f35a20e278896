//! `octofold net contains`: whether voxels are in a solid.

use crate::files::ReadingArgs;
use crate::job::{Account, Job, Outcome};
use anyhow::{Context, Result, ensure};
use octofold::report::{Answer, VoxelAnswer};
use std::path::PathBuf;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    /// File to read
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// Places, three numbers each: voxels counted from 0
    #[arg(value_name = "X Y Z", required = true, num_args = 3.., allow_negative_numbers = true)]
    places: Vec<f64>,
    /// Places are in the world, and not voxels
    #[arg(long)]
    world: bool,
}

const AFTER_HELP: &str = "\
Of a file in bricks only the brick that holds the place is read. What lies beyond the box is outside.

Examples:
  octofold net contains bunny.ofn 100 100 100
  octofold net contains bunny.ofn --world 0.01 0.1 0.02 0.02 0.1 0.02";

impl Args {
    /// Finds the voxels and tells.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        ensure!(self.places.len().is_multiple_of(3), "places are three numbers each");
        let file = ReadingArgs::default().of(&self.input)?.open()?.expect_network(&job.run)?;
        let to_voxels = file.placement().inverse().context("the solid's voxels are flat")?;
        let mut answers = Vec::new();
        for place in self.places.chunks_exact(3) {
            let place = [place[0], place[1], place[2]];
            let at =
                if self.world { to_voxels.place(place).map(|v| (v + 0.5).floor()) } else { place };
            ensure!(
                at.iter().all(|v| v.fract() == 0.0 && v.abs() < 1e15),
                "{place:?} names no voxel: whole numbers are asked for, or --world"
            );
            let voxel = at.map(|v| v as i64);
            let filled = match voxel.map(usize::try_from) {
                [Ok(x), Ok(y), Ok(z)] => file.contains([x, y, z], &job.run)?,
                _ => false,
            };
            answers.push(VoxelAnswer { voxel, filled });
        }
        if !job.json {
            let lines = answers.iter().map(|a| {
                let [x, y, z] = a.voxel;
                format!("{x} {y} {z} {}", if a.filled { "inside" } else { "outside" })
            });
            job.answer(&lines.collect::<Vec<_>>().join("\n"))?;
        }
        let all = answers.iter().all(|a| a.filled);
        job.finish(Account {
            answer: Some(Answer::Voxels { voxels: answers }),
            ..Account::default()
        })?;
        Ok(if all { Outcome::Holds } else { Outcome::DoesNotHold })
    }
}
