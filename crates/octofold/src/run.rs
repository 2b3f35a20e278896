//! The running context of every method: cancel, progress and findings.
//!
//! A method takes a `&Run` last. It asks [`Run::check`] once per block of work, names its stages
//! with [`Run::stage`], and tells of odd things that did not stop it with [`Run::finding`]. The
//! library keeps no clock: whoever implements [`Watch`] may time the stages.

use serde::Serialize;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The work was interrupted through [`Cancel`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("interrupted")]
pub struct Cancelled;

/// A flag shared between the work and whoever may stop it.
#[derive(Debug, Clone, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// Asks all work that watches this flag to stop at its next block.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// True once [`Cancel::cancel`] was called.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// How much a finding matters to the reader of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Worth knowing; nothing was changed or lost.
    Note,
    /// The result may not be what was expected.
    Warning,
}

/// Something odd that did not stop the work.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Stable name to act on, such as `skipped-lines` or `first-of-4d`.
    pub code: &'static str,
    /// How much it matters.
    pub severity: Severity,
    /// One sentence for people.
    pub text: String,
    /// How many things it speaks of, where that is a number.
    pub count: Option<u64>,
}

impl Finding {
    /// A finding that changes nothing.
    pub fn note(code: &'static str, text: impl Into<String>) -> Self {
        Self { code, severity: Severity::Note, text: text.into(), count: None }
    }

    /// A finding that may surprise.
    pub fn warning(code: &'static str, text: impl Into<String>) -> Self {
        Self { code, severity: Severity::Warning, text: text.into(), count: None }
    }

    /// The same finding, about `count` things.
    #[must_use]
    pub fn of(mut self, count: u64) -> Self {
        self.count = Some(count);
        self
    }
}

/// Listener to stages, progress and findings. All methods may be called from any thread.
pub trait Watch: Send + Sync {
    /// A stage begins; the one before it has ended.
    fn stage(&self, _name: &'static str) {}
    /// `done` of `total` units of the current stage are finished.
    fn progress(&self, _done: u64, _total: u64) {}
    /// Something odd was found.
    fn finding(&self, _finding: Finding) {}
}

/// Hears nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Watch for Silent {}

/// The context that a method runs in. Cheap to clone.
#[derive(Clone)]
pub struct Run {
    /// The flag that stops the work.
    pub cancel: Cancel,
    /// Who listens.
    pub watch: Arc<dyn Watch>,
}

impl Default for Run {
    fn default() -> Self {
        Self { cancel: Cancel::default(), watch: Arc::new(Silent) }
    }
}

impl std::fmt::Debug for Run {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Run").field("cancel", &self.cancel).finish_non_exhaustive()
    }
}

impl Run {
    /// A context that reports to `watch`.
    pub fn with_watch(watch: impl Watch + 'static) -> Self {
        Self { cancel: Cancel::default(), watch: Arc::new(watch) }
    }

    /// `Err(Cancelled)` once the work was asked to stop.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.cancel.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }

    /// Begins a stage.
    pub fn stage(&self, name: &'static str) {
        self.watch.stage(name);
    }

    /// Reports progress within the stage.
    pub fn progress(&self, done: u64, total: u64) {
        self.watch.progress(done, total);
    }

    /// Reports something odd.
    pub fn finding(&self, finding: Finding) {
        self.watch.finding(finding);
    }
}
