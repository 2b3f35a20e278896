//! `octofold demo`: built-in shapes through every main path, and a page to look at.
//!
//! Every arrow reads a file that was written before and writes the next one, just as the commands
//! do that the page names.

mod page;

use crate::files::{self, Output, ReadingArgs};
use crate::job::{Account, Job, Outcome};
use crate::picture;
use anyhow::{Context, Result};
use octofold::report::ShapeMeasures;
use octofold::samples::Sample;
use octofold::surface::{Inside, SurfaceOptions};
use octofold::volume::{DenseVolume, Label, Region};
use octofold::voxelize::{Fill, Size, VoxelizeOptions};
use octofold::{Shape, Step, Volume, pipeline};
use page::{Panel, Scene};
use std::path::PathBuf;
use std::sync::Arc;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = "Open index.html in OUTDIR with any browser.")]
pub struct Args {
    /// Folder for all files and the page
    #[arg(value_name = "OUTDIR", default_value = "octofold-demo")]
    folder: PathBuf,
}

/// Voxels along the longest side of whatever the demo voxelizes.
const RESOLUTION: u32 = 128;

impl Args {
    /// Makes all files and the page.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let folder = self.folder;
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        let stage = Stage { folder, job };
        let scenes = [stage.scan()?, stage.product()?, stage.gray()?, stage.labels()?];
        let index = stage.folder.join("index.html");
        files::write(&index, page::html(&scenes).as_bytes())?;
        job.finish(Account::default())?;
        let seconds = job.terminal.seconds();
        job.terminal.say(&format!("{}: open it in a browser, {seconds:.2} s", index.display()));
        Ok(Outcome::Holds)
    }
}

/// The folder that the demo plays in.
struct Stage<'a> {
    folder: PathBuf,
    job: &'a Job,
}

impl Stage<'_> {
    fn scan(&self) -> Result<Scene> {
        let scan = Sample::Scan.mesh(64, &self.job.run)?.into();
        Ok(Scene {
            title: "A damaged scan becomes a solid",
            text: "A scan-like surface with planted defects: holes, flipped and repeated faces, \
                   T-junctions, parts inside, intersections. Voxels are filled by the winding \
                   number, and marching cubes gives back a surface that is closed and manifold.",
            panels: vec![
                self.written("scan.ply", &scan)?,
                self.arrow("scan.ply", voxels(), "scan.nrrd")?,
                self.arrow("scan.nrrd", surface(), "scan-closed.ply")?,
            ],
            commands: vec![
                "octofold sample scan scan.ply".into(),
                format!("octofold voxelize scan.ply scan.nrrd --resolution {RESOLUTION}"),
                "octofold surface scan.nrrd scan-closed.ply".into(),
            ],
        })
    }

    fn product(&self) -> Result<Scene> {
        let kettle = Sample::Kettle.mesh(128, &self.job.run)?.into();
        Ok(Scene {
            title: "A mesh becomes voxels, and voxels a mesh",
            text: "An electric kettle made by set operations. Voxelization is exact: a voxel is \
                   set where its centre is inside. The place in the world survives the way \
                   through the file.",
            panels: vec![
                self.written("kettle.obj", &kettle)?,
                self.arrow("kettle.obj", voxels(), "kettle.nii.gz")?,
                self.arrow("kettle.nii.gz", surface(), "kettle.stl")?,
            ],
            commands: vec![
                "octofold sample kettle kettle.obj --resolution 128".into(),
                format!("octofold voxelize kettle.obj kettle.nii.gz --resolution {RESOLUTION}"),
                "octofold surface kettle.nii.gz kettle.stl".into(),
            ],
        })
    }

    fn gray(&self) -> Result<Scene> {
        let gyroid = Sample::Gyroid.volume(96).context("the gyroid is a field")?;
        let iso = SurfaceOptions {
            iso: Some(0.0),
            inside: Inside::Below,
            normals: true,
            ..SurfaceOptions::default()
        };
        Ok(Scene {
            title: "A gray volume becomes a smooth surface",
            text: "A gyroid as gray values in f32. The surface runs between the samples where the \
                   value is 0, is closed at the border and carries normals.",
            panels: vec![
                self.written("gyroid.nrrd", &Shape::Volume(Arc::new(gyroid)))?,
                self.arrow("gyroid.nrrd", Step::Surface(iso), "gyroid.glb")?,
            ],
            commands: vec![
                "octofold sample gyroid gyroid.nrrd --gray --resolution 96".into(),
                "octofold surface gyroid.nrrd gyroid.glb --iso 0 --below --normals".into(),
            ],
        })
    }

    fn labels(&self) -> Result<Scene> {
        let atlas = Shape::Volume(Arc::new(atlas()?));
        let labels = SurfaceOptions { labels: true, ..SurfaceOptions::default() };
        Ok(Scene {
            title: "A label volume becomes parts",
            text: "Three shapes in one volume, told apart by their label. One pass gives one part \
                   per label; each is closed.",
            panels: vec![
                self.written("atlas.nrrd", &atlas)?,
                self.arrow("atlas.nrrd", Step::Surface(labels), "atlas.ply")?,
            ],
            commands: vec!["octofold surface atlas.nrrd atlas.ply --labels".into()],
        })
    }

    /// Reads `from`, runs `step`, writes `to`.
    fn arrow(&self, from: &str, step: Step, to: &str) -> Result<Panel> {
        let input = ReadingArgs::default().of(&self.folder.join(from))?;
        let shape = input.open()?.read(&self.job.run)?;
        self.written(to, &pipeline(shape, &[step], &self.job.run)?.shape)
    }

    /// Writes `shape`, reads it again, measures and draws it.
    fn written(&self, name: &str, shape: &Shape) -> Result<Panel> {
        let path = self.folder.join(name);
        let run = &self.job.run;
        Output::new(path.clone(), None)?.write(shape, run)?;
        let again = ReadingArgs::default().of(&path)?.open()?.read(run)?;
        let picture = format!("{name}.png");
        picture::draw(&again, &self.folder.join(&picture), run)?;
        let measures = serde_json::to_value(ShapeMeasures::of(&again, run)?)?;
        Ok(Panel { file: name.into(), picture, measures })
    }
}

fn voxels() -> Step {
    Step::Voxelize(VoxelizeOptions { size: Size::Resolution(RESOLUTION), fill: Fill::Solid })
}

fn surface() -> Step {
    Step::Surface(SurfaceOptions::default())
}

/// Three shapes in one volume of labels; where they overlap, the first wins.
fn atlas() -> Result<DenseVolume<u8>> {
    let shapes = [
        (Sample::Torus, [230, 120, 60, 255]),
        (Sample::Cone, [70, 140, 210, 255]),
        (Sample::Cylinder, [120, 180, 90, 255]),
    ];
    let mut samples = Vec::new();
    let mut labels = Vec::new();
    let mut frame = None;
    for (value, (sample, colour)) in (1u8..).zip(shapes) {
        let mask = sample.voxels(96).context("a solid has voxels")?;
        let block = mask.read(Region::all(mask.dims()))?;
        samples.resize(block.len(), 0);
        for (i, label) in samples.iter_mut().enumerate() {
            if *label == 0 && block.value(i) > 0.0 {
                *label = value;
            }
        }
        labels.push(Label { value: value.into(), name: sample.name().into(), colour });
        frame = Some((mask.dims(), mask.placement()));
    }
    let (dims, placement) = frame.context("there are shapes")?;
    let mut atlas = DenseVolume::new(dims, samples, placement).context("shapes share a lattice")?;
    atlas.labels = labels;
    Ok(atlas)
}
