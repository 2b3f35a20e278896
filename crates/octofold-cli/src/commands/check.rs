//! `octofold check`: claims about a mesh, and where they do not hold.

use crate::files::{Input, InputArgs, ReadingArgs};
use crate::job::{Account, Job, Outcome};
use anyhow::{Result, ensure};
use octofold::measure::{self, Measures, Weld};
use octofold::report::{Answer, Claim, ShapeMeasures};
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
    /// The mesh and REF are nowhere further apart than --distance, seen from either
    #[arg(long, value_name = "REF", requires = "distance")]
    within: Option<PathBuf>,
    /// Largest distance for --within, in the mesh's own unit
    #[arg(long, value_name = "D", requires = "within")]
    distance: Option<f64>,
    /// Points that are spread over each mesh by area for --within, beside all its vertices
    #[arg(long, value_name = "N", default_value_t = 200_000)]
    samples: usize,
}

const AFTER_HELP: &str = "\
Without a claim, all but --within are checked. Points at the same position count as one. Where a
claim does not hold, the exit code is 1 and the first few places are told as world coordinates.

Examples:
  octofold check part.stl --closed --manifold --no-self-intersections
  octofold check repaired.ply --within scan.ply --distance 0.5";

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
    distance: f64,
    samples: usize,
}

impl Args {
    /// The claims, or why they make no sense.
    pub fn check(self) -> Result<Check> {
        let within = match self.within.zip(self.distance) {
            Some((path, distance)) => {
                ensure!(distance >= 0.0, "--distance must not be negative");
                let reference = ReadingArgs::default().of(&path)?;
                Some(Within { reference, distance, samples: self.samples })
            }
            None => None,
        };
        let all = !(self.closed
            || self.manifold
            || self.oriented
            || self.no_self_intersections
            || within.is_some());
        Ok(Check {
            input: self.input.check()?,
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
        let measures = measure::measure(&mesh, Weld::Exact, &job.run)?;
        let asked = [
            (self.closed, closed as fn(&Measures) -> Claim),
            (self.manifold, manifold),
            (self.oriented, oriented),
            (self.no_self_intersections, no_self_intersections),
        ];
        let mut claims: Vec<_> =
            asked.iter().filter(|(asked, _)| *asked).map(|(_, claim)| claim(&measures)).collect();
        if let Some(Within { reference, distance, samples }) = &self.within {
            let reference = reference.open()?.read_mesh(&job.run)?.triangulate();
            let apart = measure::compare(&mesh, &reference, *samples, &job.run)?;
            claims.push(Claim {
                name: "within",
                holds: apart.hausdorff.is_some_and(|d| d <= *distance),
                fact: match apart.hausdorff {
                    Some(found) => {
                        format!("the furthest samples are {found:?} apart, {distance:?} is allowed")
                    }
                    None => "one of the two has no triangles".into(),
                },
                places: Vec::new(),
            });
        }
        let holds = claims.iter().all(|c| c.holds);
        if !job.json {
            job.answer(&claims.iter().map(line).collect::<Vec<_>>().join("\n"))?;
        }
        let answer = Some(Answer::Claims { holds, claims });
        let input = Some(ShapeMeasures::Mesh(measures));
        job.finish(Account { answer, input, ..Account::default() })?;
        Ok(if holds { Outcome::Holds } else { Outcome::DoesNotHold })
    }
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
