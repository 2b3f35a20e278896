//! `octofold net info`: how large a network is, and how many data it has.

use crate::commands::info::table;
use crate::files::InputArgs;
use crate::job::{Account, Job, Outcome};
use anyhow::Result;
use octofold::network::census::census;
use octofold::report::{Answer, NetworkFacts};

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(flatten)]
    input: InputArgs,
}

const AFTER_HELP: &str = "\
Data are counted in three ways, always together, since the paper does not say what a datum is:
nodes (planes, edges, voxels) beside all nodes of the octree; items (with loops and their chains)
beside its mixed nodes; and bytes in plain records beside an octree without pointers. Each for two
readings of what a link is: `faces` that meet, and the voxels that share a face, `six`.

Example:
  octofold net info bunny.ofn --json";

impl Args {
    /// Reads, counts and tells.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let file = self.input.check()?.open()?.expect_network(&job.run)?;
        let solid = file.solid(&job.run)?;
        let census = census(&solid, &job.run)?;
        let bits = |count: u64| (count > 0).then(|| 8.0 * file.size() as f64 / count as f64);
        let facts = NetworkFacts {
            dims: file.dims(),
            placement: file.placement(),
            bytes: file.size(),
            mode: file.layout().mode,
            bricks: file.layout().bricks,
            bits_per_surface_voxel: bits(census.surface_voxels),
            bits_per_face: bits(census.faces),
            label_bytes: file.payload_bytes()[0],
            colour_bytes: file.payload_bytes()[1],
            runs: file.runs(),
            census,
        };
        if !job.json {
            job.answer(&table(&serde_json::to_value(&facts)?))?;
        }
        job.finish(Account {
            answer: Some(Answer::Network(Box::new(facts))),
            ..Account::default()
        })?;
        Ok(Outcome::Holds)
    }
}
