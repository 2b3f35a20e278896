//! `octofold check`: claims about a mesh, and where they do not hold.

use crate::commands::surface::SurfaceArgs;
use crate::files::{Input, InputArgs};
use crate::job::{Account, Job, Outcome};
use anyhow::{Context, Result, bail, ensure};
use octofold::measure::{self, Measures, Verdict, Weld};
use octofold::report::{Answer, Claim, ShapeMeasures};
use octofold::surface::{Method, SurfaceOptions};
use octofold::{LengthUnit, Mesh, Placement, Run, Shape, Step, pipeline};
use std::path::PathBuf;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(flatten)]
    input: InputArgs,
    /// There are triangles, and every edge has exactly two
    #[arg(long)]
    closed: bool,
    /// No edge has three triangles, no point two fans, and no triangle is repeated
    #[arg(long)]
    manifold: bool,
    /// Neighbouring triangles wind the same way
    #[arg(long)]
    oriented: bool,
    /// No two triangles meet outside a shared corner or edge
    #[arg(long)]
    no_self_intersections: bool,
    /// No point of the mesh is further from REF than allowed, and none of REF from the mesh; REF is
    /// a mesh, or a volume whose marching cubes surface is meant
    #[arg(long, value_name = "REF", requires = "allowed")]
    within: Option<PathBuf>,
    /// Largest distance for --within, in the mesh's own unit
    #[arg(long, value_name = "D", requires = "within", group = "allowed")]
    distance: Option<f64>,
    /// Largest distance for --within, in voxels of REF
    #[arg(long, value_name = "T", requires = "within", group = "allowed")]
    voxels: Option<f64>,
    #[command(flatten, next_help_heading = "Where REF is a volume")]
    surface: SurfaceArgs,
}

const AFTER_HELP: &str = "\
Without a claim, all but --within are checked. Points at the same position count as one. Where a
claim does not hold, the exit code is 1 and the first few places are told as world coordinates.

--within is proven for every point of both, not sampled: it holds up to 10^-9 of the distance, or it
is refuted by a place, or, which is rare, told to be too near to call.

Examples:
  octofold check part.stl --closed --manifold --no-self-intersections
  octofold check repaired.ply --within scan.ply --distance 0.5
  octofold check brain.ply --within brain.nii.gz --voxels 1";

/// As validated.
pub struct Check {
    input: Input,
    closed: bool,
    manifold: bool,
    oriented: bool,
    no_self_intersections: bool,
    within: Option<Within>,
}

struct Within {
    reference: Input,
    allowed: Allowed,
    surface: SurfaceArgs,
}

#[derive(Clone, Copy)]
enum Allowed {
    /// In the mesh's unit.
    Distance(f64),
    /// In voxels of the reference.
    Voxels(f64),
}

impl Args {
    /// The claims, or why they make no sense.
    pub fn check(self) -> Result<Check> {
        let allowed = self.distance.map(Allowed::Distance).or(self.voxels.map(Allowed::Voxels));
        let (input, within) = match self.within.zip(allowed) {
            Some((path, allowed)) => {
                let (Allowed::Distance(most) | Allowed::Voxels(most)) = allowed;
                ensure!(most >= 0.0, "--distance and --voxels must not be negative");
                let [input, reference] = self.input.check_beside(&path)?;
                (input, Some(Within { reference, allowed, surface: self.surface }))
            }
            None => {
                let unused = self.surface == SurfaceArgs::default();
                ensure!(
                    unused,
                    "--iso, --below, --labels and --open go with --within and a volume"
                );
                (self.input.check()?, None)
            }
        };
        let all = !(self.closed
            || self.manifold
            || self.oriented
            || self.no_self_intersections
            || within.is_some());
        Ok(Check {
            input,
            closed: all || self.closed,
            manifold: all || self.manifold,
            oriented: all || self.oriented,
            no_self_intersections: all || self.no_self_intersections,
            within,
        })
    }
}

impl Check {
    /// Reads, checks and tells.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let mesh = self.input.open()?.read_mesh(&job.run)?.triangulate();
        let asked = [
            (self.closed, closed as fn(&Measures) -> Claim),
            (self.manifold, manifold),
            (self.oriented, oriented),
            (self.no_self_intersections, no_self_intersections),
        ];
        // Nothing is measured that nobody asked for.
        let measures = if job.json || asked.iter().any(|(asked, _)| *asked) {
            Some(measure::measure(&mesh, Weld::Exact, &job.run)?)
        } else {
            None
        };
        let mut claims: Vec<_> = measures
            .iter()
            .flat_map(|m| asked.iter().filter(|(asked, _)| *asked).map(|(_, claim)| claim(m)))
            .collect();
        if let Some(within) = &self.within {
            claims.push(within.claim(&mesh, &job.run)?);
        }
        let holds = claims.iter().all(|c| c.holds);
        if !job.json {
            job.answer(&claims.iter().map(line).collect::<Vec<_>>().join("\n"))?;
        }
        let answer = Some(Answer::Claims { holds, claims });
        let input = measures.map(ShapeMeasures::Mesh);
        job.finish(Account { answer, input, ..Account::default() })?;
        Ok(if holds { Outcome::Holds } else { Outcome::DoesNotHold })
    }
}

impl Within {
    fn claim(&self, mesh: &Mesh, run: &Run) -> Result<Claim> {
        let opened = self.reference.open()?;
        let shape = opened.read(run)?;
        let (steps, placement) = match &shape {
            Shape::Volume(volume) => {
                let options = SurfaceOptions { method: Method::Cubes, ..self.surface.check()? };
                (vec![Step::Surface(options)], Some(volume.placement()))
            }
            Shape::Soup(_) => {
                let unused = self.surface == SurfaceArgs::default();
                ensure!(unused, "--iso, --below, --labels and --open need a volume as REF");
                (Vec::new(), None)
            }
        };
        let Shape::Soup(reference) = pipeline(shape, &steps, run)?.shape else {
            bail!("a surface is a mesh")
        };
        let reference = reference.triangulate();
        match self.allowed {
            Allowed::Distance(most) => claim(mesh, &reference, most, "", None, run),
            Allowed::Voxels(most) => {
                let placement = placement.context("--voxels needs a volume as REF")?;
                let index = placement.inverse().context(
                    "the samples of REF lie in one plane: there are no voxels to measure in",
                )?;
                let scale = LengthUnit::scale(mesh.unit, placement.unit);
                let mesh = mesh.map(|p| index.place(p.map(|x| x * scale)));
                let reference = reference.map(|p| index.place(p));
                let [mesh, reference] = [mesh, reference].map(|m| Mesh { unit: None, ..m });
                claim(&mesh, &reference, most, " voxels", Some(placement), run)
            }
        }
    }
}

/// Decides the claim; `placement` leads back to the world.
fn claim(
    mesh: &Mesh,
    reference: &Mesh,
    allowed: f64,
    unit: &str,
    placement: Option<Placement>,
    run: &Run,
) -> Result<Claim> {
    let verdict = measure::within(mesh, reference, allowed, run)?;
    let (fact, place) = match verdict {
        Verdict::Proven => {
            (format!("no point of either is further than {allowed}{unit} from the other"), None)
        }
        Verdict::Empty => ("one of the two has no triangles".into(), None),
        Verdict::Undecided { place, lower, upper, .. } => {
            let found = format!("the furthest point found is {lower}{unit} away");
            (format!("{found}, none is further than {upper}, {allowed} is allowed"), Some(place))
        }
        Verdict::Refuted { place, distance, .. } => {
            // The first point found need not be the furthest.
            let bounds = measure::hausdorff_bounds(mesh, reference, distance / 1000.0, run)?;
            let ends = bounds.map(|b| [b.a_to_b, b.b_to_a]);
            let furthest = ends.into_iter().flatten().max_by(|p, q| p.lower.total_cmp(&q.lower));
            let (found, place) = furthest.map_or((distance, place), |f| (f.lower, f.place));
            let text = format!("the furthest point found is {found}{unit} away");
            (format!("{text}, {allowed} is allowed"), Some(place))
        }
    };
    let world = |p| placement.map_or(p, |placement| placement.place(p));
    let places = place.map(world).into_iter().collect();
    Ok(Claim { name: "within", holds: verdict == Verdict::Proven, fact, places })
}

fn closed(m: &Measures) -> Claim {
    let places = m.places.boundary_edges.iter().chain(&m.places.nonmanifold_edges);
    Claim {
        name: "closed",
        holds: m.closed,
        fact: if m.triangles == 0 {
            "there are no triangles".into()
        } else {
            format!(
                "{} boundary edges, {} edges with three triangles or more",
                m.boundary_edges, m.nonmanifold_edges
            )
        },
        places: places.map(middle).collect(),
    }
}

fn manifold(m: &Measures) -> Claim {
    let edges = m.places.nonmanifold_edges.iter().map(middle);
    let others = m.places.nonmanifold_points.iter().chain(&m.places.duplicate_triangles);
    Claim {
        name: "manifold",
        holds: m.manifold,
        fact: format!(
            "{} edges with three triangles or more, {} points with more than one fan, \
             {} repeated triangles",
            m.nonmanifold_edges, m.nonmanifold_points, m.duplicate_triangles
        ),
        places: edges.chain(others.copied()).collect(),
    }
}

fn oriented(m: &Measures) -> Claim {
    Claim {
        name: "oriented",
        holds: m.oriented,
        fact: format!("{} edges whose triangles wind against each other", m.misoriented_edges),
        places: m.places.misoriented_edges.iter().map(middle).collect(),
    }
}

fn no_self_intersections(m: &Measures) -> Claim {
    Claim {
        name: "no-self-intersections",
        holds: m.self_intersections == 0,
        fact: format!("{} pairs of triangles that meet", m.self_intersections),
        places: m.places.self_intersections.iter().map(|(_, place)| *place).collect(),
    }
}

fn middle([a, b]: &[[f64; 3]; 2]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) / 2.0)
}

/// A claim for people, with the places where it does not hold on lines of their own.
fn line(claim: &Claim) -> String {
    let verdict = if claim.holds { "holds" } else { "does not hold" };
    let mut text = format!("{}: {verdict} ({})", claim.name, claim.fact);
    for [x, y, z] in &claim.places {
        text += &format!("\n  at {x}, {y}, {z}");
    }
    text
}
