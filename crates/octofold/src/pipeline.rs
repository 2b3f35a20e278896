//! The list of steps that every front end builds, and the one function that runs it.
//!
//! A step is plain data: the command, a steps file and the Python module name the same steps with
//! the same options. Converting a file is the empty list.

use crate::histogram::Histogram;
use crate::network::ball::{self, Ball, BallError};
use crate::network::boundary::boundary;
use crate::network::carry;
use crate::network::motion::{self, Motion, MotionError};
use crate::network::painted::{PaintError, Painted};
use crate::network::{Network, NetworkError};
use crate::repair::{self, RepairAccount, RepairError, RepairOptions, SheetOptions};
use crate::run::{Cancelled, Finding, Run};
use crate::simplify::{self, PruneAccount, PruneOptions, SimplifyAccount, SimplifyOptions};
use crate::soup::Soup;
use crate::spans::Spans;
use crate::surface::{self, SurfaceAccount, SurfaceOptions, threshold};
use crate::unfold::{self, FlattenAccount, FlattenOptions};
use crate::volume::{Volume, VolumeError};
use crate::voxelize::{self, VoxelizeError, VoxelizeOptions};
use std::sync::Arc;

/// What kind of shape a file or a step holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Polygons.
    Mesh,
    /// Samples.
    Volume,
}

impl std::fmt::Display for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Mesh => "mesh",
            Self::Volume => "volume",
        })
    }
}

/// The value that flows from step to step.
#[derive(Clone)]
#[expect(clippy::large_enum_variant, reason = "only one or two shapes live at a time")]
pub enum Shape {
    /// Polygons.
    Soup(Soup),
    /// Samples.
    Volume(Arc<dyn Volume>),
}

impl Shape {
    /// Which of the two it is.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Soup(_) => Kind::Mesh,
            Self::Volume(_) => Kind::Volume,
        }
    }
}

impl From<Soup> for Shape {
    fn from(soup: Soup) -> Self {
        Self::Soup(soup)
    }
}

impl From<Box<dyn Volume>> for Shape {
    fn from(volume: Box<dyn Volume>) -> Self {
        Self::Volume(volume.into())
    }
}

/// One step from shape to shape, with its options.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(tag = "step", rename_all = "lowercase")]
pub enum Step {
    /// Cuts polygons into triangles; corners, order and columns stay.
    Triangulate,
    /// Mesh to voxels.
    Voxelize(VoxelizeOptions),
    /// Volume to the mesh of its surface.
    Surface(SurfaceOptions),
    /// Any polygons to a closed mesh.
    Repair(RepairOptions),
    /// Any polygons to single sheets where they are thin, closed parts where they are not.
    Sheets(SheetOptions),
    /// Leaves out small parts.
    Prune(PruneOptions),
    /// Fewer faces, with guarantees.
    Simplify(SimplifyOptions),
    /// Nearly flat parts become flat.
    Flatten(FlattenOptions),
    /// Volume to the runs of what is inside.
    Solid(SolidOptions),
    /// Moves a solid, exactly resampled.
    Move(Motion),
    /// Grows or shrinks a solid by a ball.
    Ball(BallOptions),
    /// Solid to the mesh of its voxels' faces.
    Boundary,
}

/// How a solid grows or shrinks.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct BallOptions {
    /// Which of the two, and by how much.
    pub ball: Ball,
}

/// What of a volume is inside.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct SolidOptions {
    /// The least value inside; one half for masks, Otsu's threshold for gray values where it is not
    /// told.
    pub iso: Option<f64>,
}

impl Step {
    /// Names of all steps, as in a steps file.
    pub const ALL: [&'static str; 12] = [
        "triangulate",
        "voxelize",
        "surface",
        "repair",
        "sheets",
        "prune",
        "simplify",
        "flatten",
        "solid",
        "move",
        "ball",
        "boundary",
    ];

    /// Name, as in a steps file.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Triangulate => Self::ALL[0],
            Self::Voxelize(_) => Self::ALL[1],
            Self::Surface(_) => Self::ALL[2],
            Self::Repair(_) => Self::ALL[3],
            Self::Sheets(_) => Self::ALL[4],
            Self::Prune(_) => Self::ALL[5],
            Self::Simplify(_) => Self::ALL[6],
            Self::Flatten(_) => Self::ALL[7],
            Self::Solid(_) => Self::ALL[8],
            Self::Move(_) => Self::ALL[9],
            Self::Ball(_) => Self::ALL[10],
            Self::Boundary => Self::ALL[11],
        }
    }

    /// What it takes.
    pub fn takes(&self) -> Kind {
        match self {
            Self::Triangulate
            | Self::Voxelize(_)
            | Self::Repair(_)
            | Self::Sheets(_)
            | Self::Prune(_)
            | Self::Simplify(_)
            | Self::Flatten(_) => Kind::Mesh,
            Self::Surface(_) | Self::Solid(_) | Self::Move(_) | Self::Ball(_) | Self::Boundary => {
                Kind::Volume
            }
        }
    }

    /// What it gives.
    pub fn gives(&self) -> Kind {
        match self {
            Self::Triangulate
            | Self::Boundary
            | Self::Surface(_)
            | Self::Repair(_)
            | Self::Sheets(_)
            | Self::Prune(_)
            | Self::Simplify(_)
            | Self::Flatten(_) => Kind::Mesh,
            Self::Voxelize(_) | Self::Solid(_) | Self::Move(_) | Self::Ball(_) => Kind::Volume,
        }
    }
}

/// Why a list of steps did not run to its end.
#[derive(Debug, thiserror::Error)]
pub enum StepError {
    /// A step does not fit what comes before it.
    #[error("step {number} ({name}) takes a {takes}, but gets a {gets}")]
    Misfit {
        /// The step, counted from 1.
        number: usize,
        /// Its name.
        name: &'static str,
        /// What it takes.
        takes: Kind,
        /// What it gets.
        gets: Kind,
    },
    /// The samples are numbers of parts, and no single iso value means anything.
    #[error(
        "this volume names {0} labels, not gray values: ask for labels to get one part per label, \
         or name an iso value"
    )]
    Labels(usize),
    /// No value splits the samples in two.
    #[error("{0}: there is no surface; name an iso value if one is meant")]
    Even(String),
    /// A surface method cannot do what its options ask for.
    #[error("method {method} does not take the option {option}: method mc does")]
    Unfit {
        /// The method's name.
        method: &'static str,
        /// The option's name.
        option: &'static str,
    },
    /// The mesh could not be voxelized.
    #[error(transparent)]
    Voxelize(#[from] VoxelizeError),
    /// The mesh could not be repaired.
    #[error(transparent)]
    Repair(#[from] RepairError),
    /// The solid could not be moved.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// The solid could not be grown or shrunk.
    #[error(transparent)]
    Ball(#[from] BallError),
    /// The solid has no network.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// The volume could not be read.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// What the surface carries could not be read.
    #[error(transparent)]
    Paint(#[from] PaintError),
    /// The work was interrupted.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What `steps` make of a shape of kind `kind`, or the first step that does not fit.
pub fn outcome(kind: Kind, steps: &[Step]) -> Result<Kind, StepError> {
    steps.iter().enumerate().try_fold(kind, |gets, (i, step)| {
        let (number, name, takes) = (i + 1, step.name(), step.takes());
        if let Step::Surface(options) = step
            && let Some(option) = options.unfit()
        {
            return Err(StepError::Unfit { method: options.method.name(), option });
        }
        if takes == gets {
            Ok(step.gives())
        } else {
            Err(StepError::Misfit { number, name, takes, gets })
        }
    })
}

/// What steps made.
#[derive(Clone)]
pub struct Made {
    /// The shape.
    pub shape: Shape,
    /// What the method of the last surface step tells of its own work.
    pub surface: Option<SurfaceAccount>,
    /// What the last repair tells of its own work.
    pub repair: Option<RepairAccount>,
    /// What the last pruning tells of its own work.
    pub prune: Option<PruneAccount>,
    /// What the last simplification tells of its own work.
    pub simplify: Option<SimplifyAccount>,
    /// What the last flattening tells of its own work.
    pub flatten: Option<FlattenAccount>,
}

/// Runs `steps` one after the other. Whether they fit together is checked before any work.
pub fn pipeline(shape: Shape, steps: &[Step], run: &Run) -> Result<Made, StepError> {
    outcome(shape.kind(), steps)?;
    let mut shape = shape;
    let mut account = None;
    let mut repaired = None;
    let mut pruned = None;
    let mut simplified = None;
    let mut flattened = None;
    for step in steps {
        run.check()?;
        shape = match (step, shape) {
            (Step::Triangulate, Shape::Soup(soup)) => {
                run.stage("triangulate");
                Shape::Soup(soup.triangulate().into())
            }
            (Step::Voxelize(options), Shape::Soup(soup)) => {
                run.stage("triangulate");
                let mesh = soup.triangulate();
                drop(soup);
                let cells = voxelize::voxelize(&mesh, options, run)?;
                if cells.count() == 0 {
                    run.finding(Finding::warning("empty-volume", "no voxel is set"));
                }
                Shape::Volume(Arc::new(cells))
            }
            (Step::Surface(options), Shape::Volume(volume)) => {
                let options = with_iso(volume.as_ref(), options, run)?;
                let surface::Surface { mut mesh, account: told } =
                    surface::surface(volume.as_ref(), &options, run)?;
                account = told;
                if let Some(painted) = Painted::of(volume.as_ref(), run)? {
                    painted.dress(&mut mesh, run)?;
                }
                if mesh.triangles.is_empty() {
                    run.finding(empty_surface(&options));
                }
                Shape::Soup(mesh.into())
            }
            // What is inside is known already, and its surface carries something.
            (Step::Solid(_), shape @ Shape::Volume(_)) if carries(&shape) => shape,
            (Step::Solid(options), Shape::Volume(volume)) => {
                Shape::Volume(Arc::new(solid(volume.as_ref(), options, run)?))
            }
            (Step::Move(motion), Shape::Volume(volume)) => {
                if let Some(painted) = Painted::of(volume.as_ref(), run)? {
                    Shape::Volume(Arc::new(carry::transformed_painted(&painted, motion, run)?))
                } else {
                    let solid = solid(volume.as_ref(), &SolidOptions::default(), run)?;
                    Shape::Volume(Arc::new(motion::transformed(&solid, motion, run)?))
                }
            }
            (Step::Ball(options), Shape::Volume(volume)) => {
                if let Some(painted) = Painted::of(volume.as_ref(), run)? {
                    Shape::Volume(Arc::new(carry::balled_painted(&painted, options.ball, run)?))
                } else {
                    let solid = solid(volume.as_ref(), &SolidOptions::default(), run)?;
                    Shape::Volume(Arc::new(ball::balled(&solid, options.ball, run)?))
                }
            }
            (Step::Boundary, Shape::Volume(volume)) => {
                let mesh = if let Some(painted) = Painted::of(volume.as_ref(), run)? {
                    painted.boundary(run)?
                } else {
                    let solid = solid(volume.as_ref(), &SolidOptions::default(), run)?;
                    boundary(&Network::new(&solid, run)?, run)?
                };
                Shape::Soup(mesh.into())
            }
            (Step::Repair(options), Shape::Soup(soup)) => {
                run.stage("triangulate");
                let mesh = soup.triangulate();
                drop(soup);
                let repair::Repaired { solid, account: told } =
                    repair::repair(&mesh, options, run)?;
                repaired = Some(told);
                Shape::Soup(solid.into_mesh().into())
            }
            (Step::Sheets(options), Shape::Soup(soup)) => {
                run.stage("triangulate");
                let mesh = soup.triangulate();
                drop(soup);
                let repair::SheetComplex { mesh, account: told, .. } =
                    repair::sheets(&mesh, options, run)?;
                repaired = Some(told);
                Shape::Soup(mesh.into())
            }
            (Step::Simplify(options), Shape::Soup(soup)) => {
                run.stage("triangulate");
                let mesh = soup.triangulate();
                drop(soup);
                let simplify::Simplified { mesh, account: told } =
                    simplify::simplify(&mesh, options, run)?;
                simplified = Some(told);
                Shape::Soup(mesh.into())
            }
            (Step::Prune(options), Shape::Soup(soup)) => {
                let simplify::Pruned { mesh, account: told } =
                    simplify::prune(&soup.triangulate(), options, run)?;
                pruned = Some(told);
                Shape::Soup(mesh.into())
            }
            (Step::Flatten(options), Shape::Soup(soup)) => {
                let unfold::Flattened { mesh, account: told } =
                    unfold::flatten(&soup.triangulate(), options, run)?;
                flattened = Some(told);
                Shape::Soup(mesh.into())
            }
            (_, unfit) => unfit,
        };
    }
    Ok(Made {
        shape,
        surface: account,
        repair: repaired,
        prune: pruned,
        simplify: simplified,
        flatten: flattened,
    })
}

/// Whether the surface voxels of a volume carry something.
fn carries(shape: &Shape) -> bool {
    matches!(shape, Shape::Volume(volume) if volume.payload().is_some())
}

/// What of a volume is inside.
pub fn solid(volume: &dyn Volume, options: &SolidOptions, run: &Run) -> Result<Spans, StepError> {
    Ok(Spans::at_least(volume, iso(volume, options.iso, run)?, run)?)
}

/// The iso value that is asked for, one half for a mask, else Otsu's threshold of gray values.
///
/// # Errors
/// Where the volume has labels, or no value splits its samples, or it cannot be read.
pub fn iso(volume: &dyn Volume, asked: Option<f64>, run: &Run) -> Result<f64, StepError> {
    let options = SurfaceOptions { iso: asked, ..SurfaceOptions::default() };
    Ok(with_iso(volume, &options, run)?.iso.unwrap_or(0.5))
}

fn empty_surface(options: &SurfaceOptions) -> Finding {
    let text = match options.iso {
        _ if options.labels => "no sample is a label, a whole number above 0".into(),
        Some(iso) => format!("no sample is inside at iso value {iso}"),
        None => "no sample is inside".into(),
    };
    Finding::warning("empty-surface", format!("there is no surface: {text}"))
}

/// The same options with an iso value: the one asked for, 0.5 for a binary volume, else Otsu's
/// threshold, with a finding that says which.
fn with_iso(
    volume: &dyn Volume,
    options: &SurfaceOptions,
    run: &Run,
) -> Result<SurfaceOptions, StepError> {
    if options.labels || options.iso.is_some() {
        return Ok(*options);
    }
    let with = |iso| SurfaceOptions { iso: Some(iso), ..*options };
    if volume.is_binary() {
        return Ok(with(0.5));
    }
    if !volume.labels().is_empty() {
        return Err(StepError::Labels(volume.labels().len()));
    }
    let histogram = Histogram::of(volume, run)?;
    let values = histogram.values().unwrap_or_default().len();
    if (3..=FEW_VALUES).contains(&values) {
        run.finding(Finding::warning(
            "few-values",
            format!(
                "the samples take only {values} different values; \
                 if these are labels, ask for labels to get one part per label"
            ),
        ));
    }
    let [low, high] = histogram.range.unwrap_or_default();
    match threshold::otsu(&histogram) {
        Some(iso) => {
            let text = format!("iso value {iso} (Otsu's threshold; values are {low} to {high})");
            run.finding(Finding::note("iso-otsu", text));
            Ok(with(iso))
        }
        None => Err(StepError::Even(match histogram.range {
            Some([low, high]) if low == high => format!("every sample is {low}"),
            Some([low, high]) => format!("values from {low} to {high} cannot be told apart"),
            None => "no sample is a finite number".into(),
        })),
    }
}

/// Whole-number volumes with at most this many different values may well be labels.
const FEW_VALUES: usize = 128;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{DenseVolume, Placement};
    use crate::voxelize::{Fill, Size};

    #[test]
    fn steps_that_do_not_fit_are_named() {
        let steps = [Step::Triangulate, Step::Surface(SurfaceOptions::default())];
        let error = outcome(Kind::Mesh, &steps).unwrap_err().to_string();
        assert_eq!(error, "step 2 (surface) takes a volume, but gets a mesh");
        assert!(pipeline(Soup::default().into(), &steps, &Run::default()).is_err());
    }

    #[test]
    fn options_that_do_not_fit_the_method_are_named() {
        let method = surface::Method::Tel;
        let step = [Step::Surface(SurfaceOptions { method, open: true, ..Default::default() })];
        let error = outcome(Kind::Volume, &step).unwrap_err().to_string();
        assert_eq!(error, "method tel does not take the option open: method mc does");
    }

    #[test]
    fn accounts_come_with_the_shape() {
        let mask = crate::samples::Sample::PartA.voxels(16).unwrap();
        for method in surface::Method::ALL {
            let step = [Step::Surface(SurfaceOptions { method, ..Default::default() })];
            let volume = Shape::Volume(Arc::new(mask));
            let made = pipeline(volume, &step, &Run::default()).unwrap();
            match made.surface.map(|account| serde_json::to_value(account).unwrap()) {
                Some(account) => assert_eq!(account["method"], method.name()),
                None => assert_eq!(method, surface::Method::Cubes),
            }
        }
    }

    #[test]
    fn steps_are_plain_data() {
        let steps = vec![
            Step::Triangulate,
            Step::Voxelize(VoxelizeOptions { size: Size::Resolution(128), fill: Fill::Solid }),
            Step::Surface(SurfaceOptions::default()),
            Step::Repair(RepairOptions::default()),
            Step::Sheets(SheetOptions::default()),
            Step::Prune(PruneOptions::default()),
            Step::Simplify(SimplifyOptions::default()),
            Step::Flatten(FlattenOptions::default()),
            Step::Solid(SolidOptions { iso: Some(2.5) }),
            Step::Move(Motion {
                linear: [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 2.0]],
                about: None,
                shift: [1.0, 0.5, 0.0],
            }),
            Step::Ball(BallOptions { ball: Ball::Erode(1.5) }),
            Step::Boundary,
        ];
        let text = serde_json::to_string(&steps).unwrap();
        assert_eq!(serde_json::from_str::<Vec<Step>>(&text).unwrap(), steps);
        let names: Vec<_> = steps.iter().map(Step::name).collect();
        assert_eq!(names, Step::ALL);
        for (step, name) in steps.iter().zip(Step::ALL) {
            assert_eq!(serde_json::to_value(step).unwrap()["step"], name);
        }
    }

    #[test]
    fn the_empty_list_changes_nothing() {
        let soup = Soup::default();
        match pipeline(soup.clone().into(), &[], &Run::default()).unwrap().shape {
            Shape::Soup(same) => assert_eq!(same, soup),
            Shape::Volume(_) => panic!("a soup became a volume"),
        }
    }

    #[test]
    fn labels_ask_for_a_choice() {
        let mut atlas = DenseVolume::new([2, 1, 1], vec![0u8, 5], Placement::default()).unwrap();
        atlas.labels =
            vec![crate::volume::Label { value: 5, name: "five".into(), colour: [255; 4] }];
        let step = [Step::Surface(SurfaceOptions::default())];
        let result = pipeline(Shape::Volume(Arc::new(atlas)), &step, &Run::default());
        assert!(matches!(result, Err(StepError::Labels(1))));
    }
}
