//! Measures: what a mesh is, what is wrong with it and where, and how far two meshes differ.

pub mod borders;
mod bvh;
pub mod distance;
pub mod extent;
pub mod intersect;
pub mod nearest;
mod piece;
pub mod sew;
pub mod topology;
pub mod weld;
pub mod winding;
pub mod within;

pub use borders::borders;
pub use distance::{Comparison, Distances, compare};
pub use extent::Extent;
use intersect::meeting_pairs;
pub use intersect::self_intersections;
pub use nearest::{Hit, Nearest, nearest_on};
pub use sew::{Sewn, sew};
pub use topology::{Defect, Topology};
pub use weld::{Weld, Welding, weld, weld_points};
pub use winding::Winding;
pub use within::{HausdorffBounds, Interval, Verdict, hausdorff_bounds, within};

use crate::mesh::Mesh;
use crate::par;
use crate::run::{Cancelled, Run};
use serde::Serialize;
use std::borrow::Cow;

/// Everything that `info` tells about a mesh. `None`, `null` in JSON, where a measure does not
/// apply.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measures {
    /// Always `mesh`.
    pub kind: &'static str,
    /// Points that a triangle uses.
    pub points: usize,
    /// All triangles.
    pub triangles: usize,
    /// Sets of triangles connected across edges.
    pub components: usize,
    /// Edges with one triangle.
    pub boundary_edges: usize,
    /// Edges with three triangles or more.
    pub nonmanifold_edges: usize,
    /// Points whose triangles form more than one fan.
    pub nonmanifold_points: usize,
    /// Edges with two triangles that run along it the same way.
    pub misoriented_edges: usize,
    /// Triangles that name a point twice.
    pub degenerate_triangles: usize,
    /// Triangles on the same three points as an earlier one.
    pub duplicate_triangles: usize,
    /// Pairs of triangles that meet outside a shared corner or edge.
    pub self_intersections: usize,
    /// There are triangles, and every edge has exactly two.
    pub closed: bool,
    /// No edge has three triangles, no point two fans, and no triangle is repeated.
    pub manifold: bool,
    /// Neighbours run along their edge in opposite ways, at every edge with two triangles.
    pub oriented: bool,
    /// Points minus edges plus triangles, those that name a point twice left out.
    pub euler: i64,
    /// Handles of all components together; only where closed, oriented and manifold.
    pub genus: Option<u64>,
    /// Signed volume; only where every edge is run along as often one way as the other.
    pub volume: Option<f64>,
    /// Area.
    pub area: f64,
    /// Lowest and highest coordinates of all points, used or not.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Triangles whose corners lie exactly on one line.
    pub zero_area_triangles: usize,
    /// The first places where something is wrong.
    #[serde(skip)]
    pub places: Places,
}

/// Positions of the first few defects of each kind.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Places {
    /// Ends of edges with one triangle.
    pub boundary_edges: Vec<[[f64; 3]; 2]>,
    /// Ends of edges with three triangles or more.
    pub nonmanifold_edges: Vec<[[f64; 3]; 2]>,
    /// Ends of edges that two triangles run along the same way.
    pub misoriented_edges: Vec<[[f64; 3]; 2]>,
    /// Points with more than one fan.
    pub nonmanifold_points: Vec<[f64; 3]>,
    /// Middles of triangles that name a point twice.
    pub degenerate_triangles: Vec<[f64; 3]>,
    /// Middles of repeated triangles.
    pub duplicate_triangles: Vec<[f64; 3]>,
    /// Pairs of triangles that meet, and the middle of the box in which they do.
    pub self_intersections: Vec<([u32; 2], [f64; 3])>,
}

/// Measures everything.
pub fn measure(mesh: &Mesh, weld: Weld, run: &Run) -> Result<Measures, Cancelled> {
    run.stage("topology");
    let (points, triangles) = match weld {
        Weld::Off => (Cow::from(&mesh.points), Cow::from(&mesh.triangles)),
        Weld::Exact => {
            let Welding { points, of } = weld_points(&mesh.points, run)?;
            let triangles = par::map(&mesh.triangles, |t| t.map(|p| of[p as usize]));
            (points.into(), triangles.into())
        }
    };
    let topology = Topology::of(points.len(), &triangles, run)?;
    let extent = Extent::of(mesh, run)?;
    run.stage("self-intersections");
    let pairs = match weld {
        Weld::Off => self_intersections(mesh, run)?,
        Weld::Exact => meeting_pairs(&points, &triangles, run)?,
    };
    Ok(Measures {
        kind: "mesh",
        points: topology.points,
        triangles: mesh.triangles.len(),
        components: topology.components,
        boundary_edges: topology.boundary_edges.count,
        nonmanifold_edges: topology.nonmanifold_edges.count,
        nonmanifold_points: topology.nonmanifold_points.count,
        misoriented_edges: topology.misoriented_edges.count,
        degenerate_triangles: topology.degenerate_triangles.count,
        duplicate_triangles: topology.duplicate_triangles.count,
        self_intersections: pairs.len(),
        closed: topology.is_closed(),
        manifold: topology.is_manifold(),
        oriented: topology.is_oriented(),
        euler: topology.euler(),
        genus: topology.genus(),
        volume: topology.is_balanced().then_some(extent.volume),
        area: extent.area,
        bounds: mesh.bounds(),
        zero_area_triangles: extent.zero_area_triangles,
        places: Places::new(mesh, &points, &topology, &pairs),
    })
}

impl Places {
    fn new(mesh: &Mesh, points: &[[f64; 3]], topology: &Topology, pairs: &[[u32; 2]]) -> Self {
        let edges = |defect: &Defect<[u32; 2]>| {
            defect.first.iter().map(|e| e.map(|p| points[p as usize])).collect()
        };
        let middles = |defect: &Defect<u32>| {
            defect.first.iter().map(|&t| middle(&mesh.corners(t as usize))).collect()
        };
        let meeting = |&[a, b]: &[u32; 2]| {
            let [a_box, b_box] = [a, b].map(|t| span(&mesh.corners(t as usize)));
            let common = [
                std::array::from_fn(|x| a_box[0][x].max(b_box[0][x])),
                std::array::from_fn(|x| a_box[1][x].min(b_box[1][x])),
            ];
            ([a, b], middle(&common))
        };
        Self {
            boundary_edges: edges(&topology.boundary_edges),
            nonmanifold_edges: edges(&topology.nonmanifold_edges),
            misoriented_edges: edges(&topology.misoriented_edges),
            nonmanifold_points: {
                let first = &topology.nonmanifold_points.first;
                first.iter().map(|&p| points[p as usize]).collect()
            },
            degenerate_triangles: middles(&topology.degenerate_triangles),
            duplicate_triangles: middles(&topology.duplicate_triangles),
            self_intersections: pairs.iter().take(topology::PLACES).map(meeting).collect(),
        }
    }
}

fn middle(points: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|x| points.iter().map(|p| p[x]).sum::<f64>() / points.len() as f64)
}

/// Lowest and highest coordinates of a triangle.
fn span([a, b, c]: &[[f64; 3]; 3]) -> [[f64; 3]; 2] {
    [
        std::array::from_fn(|x| a[x].min(b[x]).min(c[x])),
        std::array::from_fn(|x| a[x].max(b[x]).max(c[x])),
    ]
}
