//! `octofold lod build`: a mesh or a volume into a model.

use crate::files::InputArgs;
use crate::job::{Account, Job, Outcome};
use anyhow::{Result, ensure};
use octofold::Shape;
use octofold::lod::{self, BuildOptions, MOST_LEVELS, VertexRule};
use octofold::pipeline;
use octofold::report::{Answer, LodFacts};
use octofold::surface::{CubesOptions, Inside};
use octofold_io::{images, oflod, save};
use std::path::PathBuf;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(flatten)]
    input: InputArgs,
    /// File to write, `.oflod`; `-` writes standard output
    #[arg(value_name = "OUT")]
    output: PathBuf,
    /// Meshes: levels below the root, 2^L finest cells along an axis [default: 8]
    #[arg(long, value_name = "L",
        value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_LEVELS)))]
    level: Option<u32>,
    /// Where the vertices of octants are: means, as published, or nearest to the planes of the surface
    #[arg(long, value_name = "RULE", default_value = "quadric")]
    vertex: RuleArg,
    /// Volumes: the value at the surface; midway between the samples of masks, Otsu's threshold of gray
    /// values unless told
    #[arg(long, value_name = "V", allow_negative_numbers = true)]
    iso: Option<f64>,
    /// Volumes: samples below the value are inside
    #[arg(long)]
    below: bool,
    /// Volumes: leave the surface open at the volume's border
    #[arg(long)]
    open: bool,
    /// Divide octants to the last level, even where the surface is flat
    #[arg(long)]
    full: bool,
    /// A quarter of the bytes; such a file is unpacked when it is opened
    #[arg(long)]
    compress: bool,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum RuleArg {
    Mean,
    Quadric,
}

const AFTER_HELP: &str = "\
A mesh may be closed, open, or have any number of triangles at an edge. The work grows with the
surface. The cells of a volume are between its samples.

Examples:
  octofold lod build bunny.ply bunny.oflod --level 9
  octofold lod build brain.nii.gz brain.oflod --iso 90 --compress";

impl Args {
    /// Validates, builds and writes.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        ensure!(
            !(job.json && self.output.as_os_str() == "-"),
            "--json and the output `-` would mix on standard output: name a file"
        );
        let vertex = match self.vertex {
            RuleArg::Mean => VertexRule::Mean,
            RuleArg::Quadric => VertexRule::Quadric,
        };
        let level = self.level.unwrap_or(BuildOptions::default().level);
        let options = BuildOptions { level, vertex, early_leaves: !self.full };
        let shape = self.input.check()?.open()?.read(&job.run)?;
        let input = job.measures(&shape)?;
        let lod = match shape {
            Shape::Soup(soup) => {
                let for_volumes = self.iso.is_some() || self.below || self.open;
                ensure!(
                    !for_volumes,
                    "--iso, --below and --open are for volumes, and this is a mesh"
                );
                let mesh = soup.triangulate();
                drop(soup);
                let images = images(&mesh.attributes, &job.run);
                lod::build_painted(&mesh, &images, &options, &job.run)?
            }
            Shape::Volume(volume) => {
                ensure!(self.level.is_none(), "--level is for meshes, and this is a volume");
                let iso = pipeline::iso(volume.as_ref(), self.iso, &job.run)?;
                let inside = if self.below { Inside::Below } else { Inside::Above };
                let surface = CubesOptions { iso, inside, open: self.open };
                lod::build_volume(volume.as_ref(), &surface, &options, &job.run)?
            }
        };
        save(&self.output, |sink| oflod::write(&lod, self.compress, sink, &job.run))?;
        let bytes = std::fs::metadata(&self.output).ok().map(|m| m.len());
        let facts = LodFacts::of(&lod, bytes);
        job.terminal.say(&format!(
            "{}: {} levels, {} octants, {:.2} s",
            self.output.display(),
            facts.levels,
            facts.octants,
            job.terminal.seconds()
        ));
        let answer = Some(Answer::Lod(Box::new(facts)));
        job.finish(Account { answer, input, ..Account::default() })?;
        Ok(Outcome::Holds)
    }
}
