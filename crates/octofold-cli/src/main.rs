//! The command `octofold`: arguments, terminal, exit codes and reports around the library.
//!
//! Exit codes: 0 done; 1 done, but what was asked to hold does not; 2 usage, input or output;
//! 130 interrupted. Answers, shapes and reports go to standard output, all else to standard error.

mod arguments;
mod commands;
mod files;
mod job;
mod memory;
mod page;
mod picture;
mod sheets;
mod terminal;

use arguments::Cli;
use clap::Parser;
use job::{Job, Outcome};
use octofold::{Cancel, par};
use std::io::Write;
use std::process::ExitCode;

const DOES_NOT_HOLD: u8 = 1;
const FAILED: u8 = 2;
const INTERRUPTED: u8 = 130;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let cancel = Cancel::default();
    watch_for_interrupts(&cancel);
    let job = Job::new(&cli, cancel.clone());
    let outcome = par::with_threads(cli.common.threads.into(), || commands::run(cli.command, &job));
    job.terminal.clear();
    match outcome {
        Ok(Outcome::Holds) => ExitCode::SUCCESS,
        Ok(Outcome::DoesNotHold) => DOES_NOT_HOLD.into(),
        Err(_) if cancel.is_cancelled() => {
            job.terminal.error("interrupted");
            INTERRUPTED.into()
        }
        // Whoever reads our output has seen enough.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            job.terminal.error(&format!("error: {}", chain(&error)));
            FAILED.into()
        }
    }
}

/// The first interrupt asks the work to stop at its next block, the second stops at once.
fn watch_for_interrupts(cancel: &Cancel) {
    let cancel = cancel.clone();
    let handler = move || {
        if cancel.is_cancelled() {
            std::process::exit(INTERRUPTED.into());
        }
        cancel.cancel();
    };
    if let Err(error) = ctrlc::set_handler(handler) {
        // Without a handler the system's own one still ends the program.
        let _ = writeln!(std::io::stderr(), "note: interrupts are not caught: {error}");
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        let io = cause.downcast_ref::<std::io::Error>();
        io.is_some_and(|e| e.kind() == std::io::ErrorKind::BrokenPipe)
    })
}

/// The error and its causes in one line; causes that an error already quotes are not repeated.
fn chain(error: &anyhow::Error) -> String {
    error.chain().fold(String::new(), |line, cause| {
        let cause = cause.to_string();
        match line.as_str() {
            "" => cause,
            said if said.contains(&cause) => line,
            said => format!("{said}: {cause}"),
        }
    })
}
