//! `octofold paper wakatsuki`: the experiments of Wakatsuki, Ishii, Takahashi, Imai and Makino 2003.
//!
//! Cuts of one model are drawn by multi-scale patches (MP) and by marching cubes whose cracks are
//! stitched (CS): Fig. 10, tables 1 and 2, Fig. 13, pictures of Figs. 2, 11 and 12, each with the rules
//! as published and with ours. A folder gets tables, charts, pictures, all figures as JSON and CSV, and
//! a page to look at.

mod published;
mod tables;
mod trial;

use super::chart::{Axes, Series, chart};
use super::folder::{self, Folder, figure, gallery, paragraph};
use super::table::Table;
use crate::files::ReadingArgs;
use crate::job::{Job, Outcome};
use crate::{memory, picture};
use anyhow::{Context, Result};
use octofold::lod::{
    BuildOptions, Criterion, Cubes, Cut, Diagonal, Eye, Front, Lod, Mode, Patchwork, VertexRule,
    build, build_with_cubes, drawn, patches,
};
use octofold::measure::weld;
use octofold::picture::{Shading, Style, View};
use octofold::samples::Sample;
use octofold::surface::{Inside, Method as SurfaceMethod, SurfaceOptions, surface};
use octofold::{Mesh, Run, par};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;
use trial::{Bench, Method, Probes, Trial, least};

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    /// Folder for tables, charts, pictures and the page
    #[arg(value_name = "OUTDIR")]
    folder: PathBuf,
    /// Mesh to convert; a built-in kettle where none is named. The paper's is the Stanford bunny
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Levels below the root
    #[arg(long, value_name = "L", default_value_t = published::LEVEL,
        value_parser = clap::value_parser!(u32).range(4..=12))]
    level: u32,
}

const AFTER_HELP: &str = "\
Open index.html in OUTDIR with any browser. Marching cubes leave out octants at the border of an open
mesh. Lengths are those of the paper: the root cube has side 256.

Examples:
  octofold paper wakatsuki wakatsuki
  octofold paper wakatsuki wakatsuki --model bunny.obj";

/// Distances of Fig. 10.
const DISTANCES: [f64; 9] = [250.0, 354.0, 500.0, 707.0, 1000.0, 1414.0, 2000.0, 2828.0, 4000.0];
/// Where the eye of Fig. 2 is, and how much less it asks, so that levels can be told apart.
const NEAR: f64 = 180.0;
const COARSER: f64 = 12.0;
/// Patches that an eye is followed with, frames, and degrees between two of them.
const FOLLOWED: usize = 100_000;
const FRAMES: u32 = 120;
const STEP: f64 = 0.5;
/// Field of view in degrees, and rows of the picture, of eyes.
const FOV: f64 = 45.0;
const ROWS: f64 = 1080.0;

/// Which octants are chosen, and where their vertices are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Rules {
    /// Mean vertices; formulas 1 and 2.
    Published,
    /// Quadric vertices; a bound of the error in pixels.
    Ours,
}

impl Rules {
    const ALL: [Self; 2] = [Self::Published, Self::Ours];

    fn name(self) -> &'static str {
        match self {
            Self::Published => "published",
            Self::Ours => "ours",
        }
    }

    fn options(self, level: u32) -> BuildOptions {
        let vertex = match self {
            Self::Published => VertexRule::Mean,
            Self::Ours => VertexRule::Quadric,
        };
        BuildOptions { level, vertex, ..BuildOptions::default() }
    }

    /// What is chosen for an eye; the more `measure`, the fewer octants.
    fn criterion(self, position: [f64; 3], measure: f64) -> Criterion {
        match self {
            Self::Published => Criterion::Wakatsuki { eye: position, share: measure },
            Self::Ours => Criterion::Pixels(eye(position, measure)),
        }
    }
}

fn eye(position: [f64; 3], pixels: f64) -> Eye {
    Eye { position, fov: FOV.to_radians(), height: ROWS, pixels }
}

/// The model by one set of rules.
#[derive(Debug, Clone, Serialize)]
struct Model {
    rules: Rules,
    octants: usize,
    /// Of the conversion on one thread, the least of three.
    seconds: f64,
    /// The same in time of the processor.
    processor_seconds: Option<f64>,
    /// Bytes of the model.
    bytes: usize,
    /// Bytes for marching cubes: as held here, with only the crossings of each octant in as few bytes as
    /// the model has, and with twelve positions and normals in each octant, as published.
    cubes_held: usize,
    cubes_packed: usize,
    cubes_published: usize,
}

/// All methods at one distance.
#[derive(Debug, Clone, Serialize)]
struct Sight {
    rules: Rules,
    distance: f64,
    /// Edge length as a share of the distance (published), or pixels (ours).
    measure: f64,
    octants: usize,
    octants_by_level: Vec<u64>,
    trials: Vec<Trial>,
}

/// One point of Fig. 10.
#[derive(Debug, Clone, Serialize)]
struct Timing {
    rules: Rules,
    distance: f64,
    select_ms: f64,
    patches: usize,
    patches_ms: f64,
    cubes: usize,
    stitched_ms: f64,
    open_ms: f64,
}

/// An eye that goes round the model.
#[derive(Debug, Clone, Serialize)]
struct Following {
    patches: usize,
    pixels: f64,
    /// From the root down, in memory that is used again, and in new memory.
    select_ms: f64,
    patches_ms: f64,
    first_ms: f64,
    /// Of a frame: the mean, the median and the slowest.
    step_ms: [f64; 3],
    /// Octants that changed in a frame, and whose patches were made anew, in the mean.
    changed: f64,
    remade: f64,
}

/// All that was measured.
#[derive(Debug, Clone, Serialize)]
struct Results {
    version: &'static str,
    paper: &'static str,
    model: String,
    triangles: usize,
    level: u32,
    published: [published::Row; 3],
    models: Vec<Model>,
    sights: Vec<Sight>,
    timings: Vec<Timing>,
    /// Milliseconds of drawing the original, and of the patches at 1000, in software.
    drawing_ms: [f64; 2],
    following: Following,
}

/// The folder and what is measured.
struct Desk<'a> {
    folder: Folder,
    job: &'a Job,
    /// Stops with the job; findings of single experiments stay out of its report.
    run: Run,
    name: String,
    mesh: Mesh,
    upright: bool,
    level: u32,
}

impl Args {
    /// Runs the experiments and writes the folder.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let Self { folder, model, level } = self;
        let run = Run { cancel: job.run.cancel.clone(), ..Run::default() };
        let (name, mesh, upright) = match model {
            Some(path) => {
                let opened = ReadingArgs::default().of(&path)?.open()?;
                let upright = opened.stands_along_y();
                let mesh = weld(&opened.read_mesh(&job.run)?.triangulate(), &run)?;
                let name = path.file_stem().unwrap_or_default().to_string_lossy();
                (name.into_owned(), mesh, upright)
            }
            None => ("kettle".into(), kettle(1 << level, &run)?, false),
        };
        let folder = Folder::create(folder)?;
        let desk = Desk { folder, job, run, name, mesh, upright, level };
        let results = desk.results()?;
        let tables = tables::all(&results);
        let charts = desk.charts(&results)?;
        let (csv, body) = (tables::csv(&results), desk.body(&tables, &charts));
        desk.folder.finish(job, "Wakatsuki et al. 2003", &tables, &results, &csv, &body)
    }
}

/// The kettle, with so many samples along its cube.
fn kettle(samples: usize, run: &Run) -> Result<Mesh> {
    let field = Sample::Kettle.volume(samples).context("the kettle is a solid")?;
    let options = SurfaceOptions {
        method: SurfaceMethod::Cubes,
        iso: Some(0.0),
        inside: Inside::Below,
        ..SurfaceOptions::default()
    };
    Ok(surface(&field, &options, run)?.mesh)
}

impl Desk<'_> {
    fn results(&self) -> Result<Results> {
        let steps = Rules::ALL.len() as u64 * (1 + published::ROWS.len() as u64) + 1;
        let mut done = 0;
        let mut next = || {
            done += 1;
            self.job.run.progress(done, steps);
            self.job.run.check()
        };
        self.job.run.stage("experiments");
        let (mut models, mut sights, mut timings) = (Vec::new(), Vec::new(), Vec::new());
        let mut drawing_ms = [0.0; 2];
        let mut following = None;
        for rules in Rules::ALL {
            let (model, lod, cubes) = self.model(rules)?;
            models.push(model);
            next()?;
            let probes = Probes::of(&self.mesh, self.unit(&lod));
            let bench = Bench { lod: &lod, cubes: &cubes, probes: &probes, run: &self.run };
            for row in published::ROWS {
                let sight = self.sight(&bench, rules, row)?;
                if row.distance == published::ROWS[0].distance {
                    timings.extend(self.timings(&bench, rules, sight.measure)?);
                    let near = self.pictures(&bench, rules, &sight)?;
                    if rules == Rules::Ours {
                        drawing_ms = [&self.mesh, &near].map(|mesh| self.drawing(mesh));
                    }
                }
                sights.push(sight);
                next()?;
            }
            if rules == Rules::Ours {
                following = Some(self.follow(&lod)?);
                next()?;
            }
        }
        Ok(Results {
            version: env!("CARGO_PKG_VERSION"),
            paper: "Wakatsuki, Ishii, Takahashi, Imai, Makino 2003",
            model: self.name.clone(),
            triangles: self.mesh.triangles.len(),
            level: self.level,
            published: published::ROWS,
            models,
            sights,
            timings,
            drawing_ms,
            following: following.context("an eye was followed")?,
        })
    }

    /// The paper's unit of length in the world.
    fn unit(&self, lod: &Lod) -> f64 {
        lod.stretch() * f64::from(1u32 << self.level) / published::SIDE
    }

    /// A place so far in front of the model's middle, turned by so many degrees.
    fn place(&self, lod: &Lod, distance: f64, degrees: f64) -> [f64; 3] {
        let side = f64::from(1u32 << self.level);
        let middle = lod.world([side / 2.0; 3].into());
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let way = if self.upright { [sine, 0.0, cosine] } else { [sine, -cosine, 0.0] };
        std::array::from_fn(|a| middle[a] + way[a] * distance * self.unit(lod))
    }

    fn model(&self, rules: Rules) -> Result<(Model, Lod, Cubes)> {
        let options = rules.options(self.level);
        let (mut seconds, mut processor) = (f64::INFINITY, None::<f64>);
        for _ in 0..3 {
            let (took, ran) = par::with_threads(1, || -> Result<_> {
                let (begin, before) = (Instant::now(), memory::ran());
                build(&self.mesh, &options, &self.run)?;
                let ran = memory::ran().zip(before).map(|(after, before)| after - before);
                Ok((begin.elapsed().as_secs_f64(), ran))
            })?;
            seconds = seconds.min(took);
            processor = ran.map(|ran| processor.map_or(ran, |least| least.min(ran)));
        }
        let (lod, cubes) = build_with_cubes(&self.mesh, &options, &self.run)?;
        let octants = lod.nodes().len();
        // Eight bytes of tree and edges, bound, flatness and traits; then vertex and normal, or a byte
        // and a normal for each crossing.
        let model = Model {
            rules,
            octants,
            seconds,
            processor_seconds: processor,
            bytes: octants * (11 + 5),
            cubes_held: octants * 11 + cubes.bytes(),
            cubes_packed: octants * 11 + cubes.crossings() * 3,
            cubes_published: octants * (11 + 12 * 3),
        };
        Ok((model, lod, cubes))
    }

    fn sight(&self, bench: &Bench<'_>, rules: Rules, row: published::Row) -> Result<Sight> {
        let place = self.place(bench.lod, row.distance, 0.0);
        let of = |measure| rules.criterion(place, measure);
        let (cut, measure) = matched(bench.lod, Mode::Any, row.patches as usize, of);
        let trials = Method::ALL.map(|method| bench.trial(&cut, method));
        Ok(Sight {
            rules,
            distance: row.distance,
            measure,
            octants: cut.len(),
            octants_by_level: cut.census(),
            trials: trials.into_iter().collect::<Result<_>>()?,
        })
    }

    fn timings(&self, bench: &Bench<'_>, rules: Rules, measure: f64) -> Result<Vec<Timing>> {
        let timing = |distance: f64| -> Result<Timing> {
            self.job.run.check()?;
            let criterion = rules.criterion(self.place(bench.lod, distance, 0.0), measure);
            let mut cut = Cut::default();
            let select_ms = least(|| {
                cut.reselect(bench.lod, &criterion);
                cut.places().len()
            });
            let cubes = bench.made(&cut, Method::Stitched)?.firsts;
            Ok(Timing {
                rules,
                distance,
                select_ms,
                patches: patches(bench.lod, &cut, Mode::Any, &self.run)?.len(),
                patches_ms: bench.milliseconds(&cut, Method::Patches),
                cubes: cubes.len(),
                stitched_ms: bench.milliseconds(&cut, Method::Stitched),
                open_ms: bench.milliseconds(&cut, Method::Open),
            })
        };
        DISTANCES.into_iter().map(timing).collect()
    }

    fn follow(&self, lod: &Lod) -> Result<Following> {
        let around = |frame: u32| self.place(lod, published::SIDE, STEP * f64::from(frame));
        let of = |pixels| Criterion::Pixels(eye(around(0), pixels));
        let (mut cut, pixels) = matched(lod, Mode::Any, FOLLOWED, of);
        let criterion = Criterion::Pixels(eye(around(0), pixels));
        let select_ms = least(|| {
            cut.reselect(lod, &criterion);
            cut.places().len()
        });
        let mut patchwork = Patchwork::default();
        let patches_ms = least(|| patchwork.make(lod, &cut, Mode::Any).len());
        let first_ms = least(|| {
            let mut cut = Cut::default();
            cut.reselect(lod, &criterion);
            Patchwork::default().make(lod, &cut, Mode::Any).len()
        });
        let mut front = Front::new(lod, eye(around(0), pixels), Mode::Any);
        let (mut times, mut changed, mut remade) = (Vec::new(), 0, 0);
        for frame in 1..=FRAMES {
            let begin = Instant::now();
            let change = front.step(around(frame));
            times.push(begin.elapsed().as_secs_f64() * 1e3);
            changed += change.divided + change.united;
            remade += change.remade;
        }
        let mean = times.iter().sum::<f64>() / f64::from(FRAMES);
        times.sort_by(f64::total_cmp);
        let (median, slowest) = (times[times.len() / 2], times[times.len() - 1]);
        Ok(Following {
            patches: patchwork.make(lod, &cut, Mode::Any).len(),
            pixels,
            select_ms,
            patches_ms,
            first_ms,
            step_ms: [mean, median, slowest],
            changed: changed as f64 / f64::from(FRAMES),
            remade: remade as f64 / f64::from(FRAMES),
        })
    }

    fn view(&self) -> View {
        let view = View { size: [880, 760], ..View::default() };
        if self.upright { view.y_up() } else { view }
    }

    /// Milliseconds of drawing a mesh in software, on one thread.
    fn drawing(&self, mesh: &Mesh) -> f64 {
        let drawn = || octofold::picture::render(mesh, &self.view(), &Style::default(), &self.run);
        par::with_threads(1, || least(|| drawn().map_or(0, |picture| picture.rgba.len())))
    }

    /// Writes the pictures of one set of rules, and hands back the patches at the first distance.
    fn pictures(&self, bench: &Bench<'_>, rules: Rules, sight: &Sight) -> Result<Mesh> {
        let of = |distance: f64, measure: f64| {
            let criterion = rules.criterion(self.place(bench.lod, distance, 0.0), measure);
            Cut::select(bench.lod, &criterion, &self.run)
        };
        let cut = of(sight.distance, sight.measure)?;
        let patches_mesh = bench.made(&cut, Method::Patches)?.mesh;
        self.draw(&patches_mesh, &format!("fig11-mp-{}.png", rules.name()))?;
        let cubes_mesh = bench.made(&cut, Method::Stitched)?.mesh;
        self.draw(&cubes_mesh, &format!("fig12-cs-{}.png", rules.name()))?;
        let near = of(NEAR, COARSER * sight.measure)?;
        let found = patches(bench.lod, &near, Mode::Any, &self.run)?;
        let mut levels =
            drawn(bench.lod, &near, &found, Mode::Any, Diagonal::Flatter, &self.run)?.mesh;
        let colour = |p: &octofold::lod::Patch| {
            let triangles = p.corners().count() - 2;
            std::iter::repeat_n(tint(near.octant(p.owner).level), triangles)
        };
        levels.attributes.face_colours = Some(found.iter().flat_map(colour).collect());
        self.draw(&levels, &format!("fig2-levels-{}.png", rules.name()))?;
        Ok(patches_mesh)
    }

    fn draw(&self, mesh: &Mesh, name: &str) -> Result<()> {
        let style = Style {
            shading: Shading::Flat,
            wireframe: Some(Style::INK),
            back: None,
            ..Style::default()
        };
        picture::draw_mesh(mesh, &self.view(), &style, &self.folder.path(name), &self.run)
    }

    /// Writes the charts; their file names.
    fn charts(&self, results: &Results) -> Result<Vec<String>> {
        let mut names = Vec::new();
        let mut write = |name: &str, title: &str, along, lines: &[Series]| -> Result<()> {
            if let Some(svg) = chart(title, Axes::Along(along), lines)? {
                self.folder.write(name, svg.as_bytes())?;
                names.push(name.to_string());
            }
            Ok(())
        };
        for rules in Rules::ALL {
            let own = || results.timings.iter().filter(move |t| t.rules == rules);
            let line = |name: &str, colour, value: &dyn Fn(&Timing) -> f64| Series {
                name: name.into(),
                colour,
                published: false,
                points: own().map(|t| (t.distance, value(t))).collect(),
            };
            let (mp, cs, grey) = ([38, 102, 190], [214, 122, 32], [120, 128, 138]);
            let times = [
                line("MP", mp, &|t| t.patches_ms),
                line("CS", cs, &|t| t.stitched_ms),
                line("cubes alone", grey, &|t| t.open_ms),
            ];
            let title = format!("Fig. 10: milliseconds, rules {}", rules.name());
            write(&format!("fig10-time-{}.svg", rules.name()), &title, "distance", &times)?;
            let counts =
                [line("MP", mp, &|t| t.patches as f64), line("CS", cs, &|t| t.cubes as f64)];
            let title = format!("Fig. 10: patches, rules {}", rules.name());
            write(&format!("fig10-patches-{}.svg", rules.name()), &title, "distance", &counts)?;
            let near = results.sights.iter().find(|s| s.rules == rules);
            let areas = |method: Method, colour| Series {
                name: method.name().into(),
                colour,
                published: false,
                points: near
                    .and_then(|s| s.trials.iter().find(|t| t.method == method))
                    .map(|t| tables::shares(&t.areas))
                    .unwrap_or_default(),
            };
            let lines = [areas(Method::Patches, mp), areas(Method::Stitched, cs)];
            let title = format!("Fig. 13: patches by area at 1000, rules {}", rules.name());
            write(&format!("fig13-areas-{}.svg", rules.name()), &title, "area", &lines)?;
        }
        Ok(names)
    }

    fn body(&self, tables: &[Table], charts: &[String]) -> String {
        let charts: String = charts.iter().map(|name| figure(name, "")).collect();
        let pictures: String = Rules::ALL
            .into_iter()
            .flat_map(|rules| {
                let name = rules.name();
                [
                    ("fig2-levels", "Fig. 2: levels near the eye"),
                    ("fig11-mp", "Fig. 11: multi-scale patches at 1000"),
                    ("fig12-cs", "Fig. 12: stitched cracks at 1000"),
                ]
                .map(|(file, caption)| {
                    figure(&format!("{file}-{name}.png"), &format!("{caption}, rules {name}"))
                })
            })
            .collect();
        format!(
            "<h1>Multi-scale patches</h1>\n{}{}<h2>Figures</h2>\n{}{}<h2>Pictures</h2>\n{}",
            paragraph(&format!(
                "The experiments of Wakatsuki, Ishii, Takahashi, Imai and Makino 2003, repeated with \
                 {} at level {} beside the published figures, which are those of the Stanford bunny \
                 at level 8 on a Pentium III at 550 MHz. Lengths are in the paper's unit: the root \
                 cube has side 256.",
                self.name, self.level
            )),
            paragraph(
                "MP are multi-scale patches, CS is marching cubes on the same octants with stitched \
                 cracks. Rules as published: mean vertices, octants by formulas 1 and 2. Ours: \
                 quadric vertices, octants by a bound of the error in pixels. For each distance the \
                 threshold is the one that gives the paper's count of patches."
            ),
            gallery(&charts),
            folder::tables(tables),
            gallery(&pictures),
        )
    }
}

/// The cut whose patches are nearest in number to `target`, and the measure that gives it; the more
/// measure, the fewer patches.
fn matched(
    lod: &Lod,
    mode: Mode,
    target: usize,
    criterion: impl Fn(f64) -> Criterion,
) -> (Cut, f64) {
    let (mut cut, mut patchwork) = (Cut::default(), Patchwork::default());
    let mut count = |measure: f64| {
        cut.reselect(lod, &criterion(measure));
        patchwork.make(lod, &cut, mode).len()
    };
    let (mut low, mut high) = (1e-7f64, 1e5f64);
    let mut best = (usize::MAX, low);
    for _ in 0..60 {
        let middle = (low * high).sqrt();
        let found = count(middle);
        let off = found.abs_diff(target);
        if off < best.0 {
            best = (off, middle);
        }
        if found > target {
            low = middle;
        } else {
            high = middle;
        }
        if best.0 * 1000 < target {
            break;
        }
    }
    count(best.1);
    (cut, best.1)
}

/// A colour for each level.
fn tint(level: u32) -> [u8; 4] {
    const TINTS: [[u8; 3]; 6] = [
        [86, 152, 196],
        [240, 176, 72],
        [132, 186, 108],
        [214, 112, 104],
        [160, 136, 200],
        [232, 220, 110],
    ];
    let [r, g, b] = TINTS[level as usize % TINTS.len()];
    [r, g, b, 255]
}
