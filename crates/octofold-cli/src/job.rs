//! One run of a command: its context, the way from file to file, and the report at the end.

use crate::arguments::Cli;
use crate::files::{Input, Output};
use crate::memory;
use crate::terminal::{Loudness, Terminal};
use anyhow::{Context, Result, ensure};
use octofold::measure::{self, Measures, Verdict, Weld};
use octofold::pipeline::{self, Made, Shape, Step, StepError};
use octofold::repair;
use octofold::report::{
    Answer, CraftReport, RepairReport, Report, ShapeMeasures, SimplifyReport, UnfoldReport,
};
use octofold::simplify::SimplifyOptions;
use octofold::surface::SurfaceAccount;
use octofold::{Cancel, Kind, Mesh, Run};
use std::io::Write;
use std::sync::Arc;

/// Points spread over both meshes for the distances in a report.
const SAMPLES: usize = 200_000;

/// How far bounds of distances in a report may be apart, as a share of the model's longest side.
const ACCURACY: f64 = 1e-5;

/// How a command ended that did its work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// All is well.
    Holds,
    /// What was asked to hold does not.
    DoesNotHold,
}

/// The context of one command.
pub struct Job {
    /// For the library.
    pub run: Run,
    /// For people.
    pub terminal: Arc<Terminal>,
    /// A report goes to standard output.
    pub json: bool,
    command: &'static str,
}

/// What a command puts into its report.
#[derive(Default)]
pub struct Account {
    /// What it was asked for.
    pub answer: Option<Answer>,
    /// What it did.
    pub steps: Vec<Step>,
    /// Measures of what went in.
    pub input: Option<ShapeMeasures>,
    /// Measures of what came out.
    pub output: Option<ShapeMeasures>,
    /// What the surface method tells of its own work.
    pub surface: Option<SurfaceAccount>,
    /// What was repaired.
    pub repair: Option<RepairReport>,
    /// What was simplified.
    pub simplify: Option<SimplifyReport>,
    /// How a model was made ready for unfolding.
    pub craft: Option<CraftReport>,
    /// What was unfolded.
    pub unfold: Option<UnfoldReport>,
}

impl Job {
    /// The job of one command line.
    pub fn new(cli: &Cli, cancel: Cancel) -> Self {
        let loudness = match (cli.common.quiet, cli.common.verbose) {
            (true, _) => Loudness::Quiet,
            (_, true) => Loudness::Verbose,
            _ => Loudness::Usual,
        };
        let terminal = Arc::new(Terminal::new(loudness));
        let run = Run { cancel, watch: terminal.clone() };
        Self { run, terminal, json: cli.common.json, command: cli.command.name() }
    }

    /// Reads `input`, runs `steps`, writes `output` and reports: the one way of all commands that
    /// make a file from a file.
    pub fn convert(&self, input: &Input, steps: Vec<Step>, output: &Output) -> Result<Outcome> {
        let opened = input.open()?;
        self.convert_read(opened.kind(), || opened.read(&self.run), steps, output)
    }

    /// The same for an input that `read` reads and that holds a shape of kind `from`.
    pub fn convert_read(
        &self,
        from: Kind,
        read: impl FnOnce() -> Result<Shape>,
        steps: Vec<Step>,
        output: &Output,
    ) -> Result<Outcome> {
        self.refuse_mixed_output(output)?;
        let to = output.kind();
        let kind = match pipeline::outcome(from, &steps) {
            Err(error @ StepError::Misfit { .. }) if from != to => {
                return Err(error).context(advice(from, to));
            }
            other => other?,
        };
        ensure!(
            kind == to,
            "{} holds a {to}, but there is a {kind} to write: {}",
            output.name(),
            advice(from, to)
        );
        let shape = read()?;
        let input = self.measures(&shape)?;
        let Made { shape, surface, .. } = pipeline::pipeline(shape, &steps, &self.run)?;
        let measures = self.measures(&shape)?;
        output.write(&shape, &self.run)?;
        let account = Account { steps, input, output: measures, surface, ..Account::default() };
        self.finish(account)?;
        self.say_written(output, &size(&shape));
        Ok(Outcome::Holds)
    }

    /// Reads `input`, repairs it, writes `output`, and proves the result again of the file. What was
    /// changed is written to `explain` in colours.
    pub fn repair(
        &self,
        input: &Input,
        step: Step,
        output: &Output,
        explain: Option<&Output>,
    ) -> Result<Outcome> {
        for output in [Some(output), explain].into_iter().flatten() {
            self.refuse_mixed_output(output)?;
            ensure!(
                output.kind() == Kind::Mesh,
                "{} holds a {}, and a repaired mesh is to be written",
                output.name(),
                output.kind()
            );
        }
        let soup = input.open()?.read_mesh(&self.run)?;
        let shape = Shape::Soup(soup);
        let measured = self.measures(&shape)?;
        let reference = (self.json || explain.is_some()).then(|| shape.clone());
        let steps = vec![step];
        let Made { shape, repair, .. } = pipeline::pipeline(shape, &steps, &self.run)?;
        output.write(&shape, &self.run)?;
        let size = size(&shape);
        // The proof of what was written needs the memory.
        let shape = explain.is_some().then_some(shape);
        let proof = if output.is_pipe() { None } else { Some(self.measure_written(output)?) };
        let sheets = repair.as_ref().and_then(|r| r.sheets.as_ref());
        let holds = proof.as_ref().map(|(_, m)| match sheets {
            None => m.closed && m.oriented && m.manifold && m.self_intersections == 0,
            Some(sheets) => {
                m.self_intersections == 0
                    && m.duplicate_triangles == 0
                    && (m.oriented || sheets.one_sided_patches > 0)
            }
        });
        if let (Some(explain), Some(Shape::Soup(soup)), Some(Shape::Soup(made)), Some(told)) =
            (explain, &reference, &shape, &repair)
        {
            let (before, after) = (soup.triangulate(), made.triangulate());
            let shown = repair::explain(&before, &after, told.cell, &self.run)?;
            explain.write_mesh(&shown.into(), &self.run)?;
        }
        let distances = match (&reference, &proof) {
            (Some(Shape::Soup(soup)), Some((written, _))) if self.json => {
                self.run.stage("distances");
                Some(measure::compare(written, &soup.triangulate(), SAMPLES, &self.run)?)
            }
            _ => None,
        };
        let repair =
            repair.map(|account| RepairReport { account, proved_of_file: holds, distances });
        let written = proof.map(|(_, m)| ShapeMeasures::Mesh(m));
        self.finish(Account {
            steps,
            input: measured,
            output: written,
            repair,
            ..Account::default()
        })?;
        self.say_written(output, &size);
        if holds == Some(false) {
            self.terminal.say(&format!(
                "{}: rounding in this format has spoilt the mesh: write PLY or OBJ",
                output.name()
            ));
            return Ok(Outcome::DoesNotHold);
        }
        Ok(Outcome::Holds)
    }

    /// Reads `input`, simplifies it, writes `output`, and proves its distances from the file.
    pub fn simplify(
        &self,
        input: &Input,
        options: SimplifyOptions,
        output: &Output,
    ) -> Result<Outcome> {
        self.refuse_mixed_output(output)?;
        ensure!(
            output.kind() == Kind::Mesh,
            "{} holds a {}, and a simplified mesh is to be written",
            output.name(),
            output.kind()
        );
        let soup = input.open()?.read_mesh(&self.run)?;
        let proves = !output.is_pipe() && (self.json || options.error.is_some());
        let reference = if proves { Some(soup.triangulate()) } else { None };
        let shape = Shape::Soup(soup);
        let measured = self.measures(&shape)?;
        let steps = vec![Step::Simplify(options)];
        let Made { shape, simplify, .. } = pipeline::pipeline(shape, &steps, &self.run)?;
        let measures = self.measures(&shape)?;
        output.write(&shape, &self.run)?;
        let (mut proved_within_error, mut distances) = (None, None);
        if let Some(reference) = reference {
            let written = output.as_input().open()?.read_mesh(&self.run)?.triangulate();
            if let Some(error) = options.error {
                let verdict = measure::within(&written, &reference, error, &self.run)?;
                proved_within_error = Some(matches!(verdict, Verdict::Proven | Verdict::Empty));
            }
            if self.json {
                let accuracy = reference.bounds().map_or(0.0, |[low, high]| {
                    ACCURACY * (0..3).map(|x| high[x] - low[x]).fold(0.0, f64::max)
                });
                distances = measure::hausdorff_bounds(&written, &reference, accuracy, &self.run)?;
            }
        }
        let simplify =
            simplify.map(|account| SimplifyReport { account, proved_within_error, distances });
        self.finish(Account {
            steps,
            input: measured,
            output: measures,
            simplify,
            ..Account::default()
        })?;
        self.say_written(output, &size(&shape));
        if proved_within_error == Some(false) {
            self.terminal.say(&format!(
                "{}: the error is passed, as rounding in this format has moved points: write PLY or OBJ",
                output.name()
            ));
            return Ok(Outcome::DoesNotHold);
        }
        Ok(Outcome::Holds)
    }

    /// Measures what stands in a file that was just written.
    fn measure_written(&self, output: &Output) -> Result<(Mesh, Measures)> {
        let mesh = output.as_input().open()?.read_mesh(&self.run)?.into_mesh();
        let measures = measure::measure(&mesh, Weld::Exact, &self.run)?;
        Ok((mesh, measures))
    }

    /// Writes a shape that was made here, and reports.
    pub fn write(&self, shape: &Shape, output: &Output) -> Result<Outcome> {
        self.refuse_mixed_output(output)?;
        let measures = self.measures(shape)?;
        output.write(shape, &self.run)?;
        self.finish(Account { output: measures, ..Account::default() })?;
        self.say_written(output, &size(shape));
        Ok(Outcome::Holds)
    }

    /// Measures for the report; nothing is measured that nobody asked for.
    pub fn measures(&self, shape: &Shape) -> Result<Option<ShapeMeasures>> {
        Ok(if self.json { Some(ShapeMeasures::of(shape, &self.run)?) } else { None })
    }

    fn refuse_mixed_output(&self, output: &Output) -> Result<()> {
        ensure!(
            !(self.json && output.is_pipe()),
            "--json and the output `-` would mix on standard output: name a file"
        );
        Ok(())
    }

    fn say_written(&self, output: &Output, what: &str) {
        let seconds = self.terminal.seconds();
        self.terminal.say(&format!("{}: {what}, {seconds:.2} s", output.name()));
    }

    /// Ends the last stage, and prints the report where one is asked for.
    pub fn finish(&self, account: Account) -> Result<()> {
        let (stages, findings) = self.terminal.finish();
        self.terminal.clear();
        if !self.json {
            return Ok(());
        }
        let Account { answer, steps, input, output, surface, repair, simplify, craft, unfold } =
            account;
        let report = Report {
            version: env!("CARGO_PKG_VERSION"),
            command: self.command,
            answer,
            steps,
            stages,
            seconds: self.terminal.seconds(),
            peak_memory: memory::peak(),
            input,
            output,
            surface,
            repair,
            simplify,
            craft,
            unfold,
            findings,
        };
        self.answer(&serde_json::to_string_pretty(&report)?)
    }

    /// Prints what was asked for to standard output.
    pub fn answer(&self, text: &str) -> Result<()> {
        let mut out = std::io::stdout().lock();
        writeln!(out, "{text}")?;
        Ok(out.flush()?)
    }
}

/// Which command leads from a kind to another.
fn advice(from: Kind, to: Kind) -> String {
    let command = match (from, to) {
        (Kind::Mesh, Kind::Volume) => "voxelize",
        (Kind::Volume, Kind::Mesh) => "surface",
        _ => "convert",
    };
    format!("`octofold {command}` makes a {to} of a {from}")
}

/// How large a shape is, in words.
fn size(shape: &Shape) -> String {
    match shape {
        Shape::Soup(soup) => format!("{} points, {} faces", soup.points().len(), soup.faces()),
        Shape::Volume(volume) => {
            let [x, y, z] = volume.dims();
            format!("{x} x {y} x {z} samples ({})", volume.scalar_type().name())
        }
    }
}
