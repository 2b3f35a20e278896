//! What people see while the work runs: a progress bar, findings and stages on standard error.
//!
//! The terminal is also the clock: it times the stages that the library names.

use indicatif::{ProgressBar, ProgressStyle};
use octofold::report::Stage;
use octofold::run::Severity;
use octofold::{Finding, Watch};
use std::io::Write;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// How much is said on standard error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Loudness {
    /// Errors only.
    Quiet,
    /// Findings, a progress bar on a terminal, and a last line.
    Usual,
    /// Also every stage with its time.
    Verbose,
}

/// Listens to a run, times it and shows it.
pub struct Terminal {
    loudness: Loudness,
    bar: ProgressBar,
    begin: Instant,
    log: Mutex<Log>,
}

#[derive(Default)]
struct Log {
    stages: Vec<Stage>,
    open: Option<OpenStage>,
    findings: Vec<Finding>,
}

struct OpenStage {
    name: &'static str,
    begin: Instant,
    count: Option<u64>,
}

impl Terminal {
    /// A terminal that says as much as `loudness` allows. The bar shows only where standard error
    /// is a terminal.
    pub fn new(loudness: Loudness) -> Self {
        let bar = if loudness == Loudness::Quiet {
            ProgressBar::hidden()
        } else {
            let style = ProgressStyle::with_template("{msg:20!} {bar:40} {percent:>3}% {elapsed}");
            let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::new(1).with_style(style)
        };
        Self { loudness, bar, begin: Instant::now(), log: Mutex::default() }
    }

    /// Takes the bar away.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }

    /// One line for people, unless quiet.
    pub fn say(&self, line: &str) {
        if self.loudness > Loudness::Quiet {
            self.line(line);
        }
    }

    /// One line for people, always.
    pub fn error(&self, line: &str) {
        self.line(line);
    }

    fn line(&self, line: &str) {
        // Nothing can be told where standard error is closed.
        self.bar.suspend(|| drop(writeln!(std::io::stderr(), "{line}")));
    }

    /// Time since the start.
    pub fn seconds(&self) -> f64 {
        self.begin.elapsed().as_secs_f64()
    }

    /// Ends the current stage; all stages and findings so far.
    pub fn finish(&self) -> (Vec<Stage>, Vec<Finding>) {
        let mut log = self.log();
        self.end_stage(&mut log);
        (log.stages.clone(), log.findings.clone())
    }

    fn end_stage(&self, log: &mut Log) {
        let Some(OpenStage { name, begin, count }) = log.open.take() else { return };
        let seconds = begin.elapsed().as_secs_f64();
        log.stages.push(Stage { name, seconds, count });
        if self.loudness == Loudness::Verbose {
            self.line(&format!("{seconds:>9.3} s  {name}"));
        }
    }

    fn log(&self) -> MutexGuard<'_, Log> {
        self.log.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Watch for Terminal {
    fn stage(&self, name: &'static str) {
        let mut log = self.log();
        self.end_stage(&mut log);
        log.open = Some(OpenStage { name, begin: Instant::now(), count: None });
        self.bar.set_message(name);
        self.bar.set_length(1);
        self.bar.set_position(0);
    }

    fn progress(&self, done: u64, total: u64) {
        if let Some(stage) = &mut self.log().open {
            stage.count = stage.count.max(Some(done));
        }
        self.bar.set_length(total);
        self.bar.set_position(done);
    }

    fn finding(&self, finding: Finding) {
        let severity = match finding.severity {
            Severity::Note => "note",
            Severity::Warning => "warning",
        };
        self.say(&format!("{severity}: {}", finding.text));
        self.log().findings.push(finding);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_and_findings_are_kept_in_order() {
        let t = Terminal::new(Loudness::Quiet);
        t.stage("one");
        t.progress(3, 4);
        t.progress(2, 4);
        t.stage("two");
        t.finding(Finding::note("odd", "odd"));
        let (stages, findings) = t.finish();
        let named: Vec<_> = stages.iter().map(|s| (s.name, s.count)).collect();
        assert_eq!(named, [("one", Some(3)), ("two", None)]);
        assert_eq!(findings.len(), 1);
    }
}
