//! `octofold completions`: scripts for shells.

use crate::arguments::Cli;
use crate::job::Outcome;
use anyhow::Result;
use clap::CommandFactory;
use std::io::Write;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  octofold completions bash > ~/.local/share/bash-completion/completions/octofold"
)]
pub struct Args {
    /// The shell
    shell: clap_complete::Shell,
}

impl Args {
    /// Prints the script.
    pub fn run(self) -> Result<Outcome> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "octofold", &mut script);
        std::io::stdout().write_all(&script)?;
        Ok(Outcome::Holds)
    }
}
