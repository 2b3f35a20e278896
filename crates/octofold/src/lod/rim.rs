//! The border of an open surface: in pieces, each in one finest cell.
//!
//! A border is where the edges of a single triangle are. Points that lie on each other count as one,
//! since formats split them where colours or normals differ.

use crate::lattice::Lattice;
use crate::measure::weld_points;
use crate::mesh::Mesh;
use crate::octree::key::morton;
use crate::par;
use crate::radix::{self, Equal};
use crate::run::{Cancelled, Run};
use crate::scan;
use glam::DVec3;

/// Items of one block of work.
const BLOCK: usize = 1 << 14;

/// A piece of the border.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    /// Morton code of the finest cell that it lies in.
    pub code: u64,
    /// Its ends, in finest cells.
    pub ends: [DVec3; 2],
}

/// The border of a surface.
#[derive(Debug, Default)]
pub(super) struct Rim {
    /// Morton codes of the finest cells that it touches, in order.
    pub cells: Vec<u64>,
    /// Its pieces, in the order of their cells.
    pub pieces: Vec<Piece>,
}

impl Rim {
    /// The border of a mesh on the lattice, and whether every edge has an even number of triangles.
    pub(super) fn of(mesh: &Mesh, lattice: &Lattice, run: &Run) -> Result<(Self, bool), Cancelled> {
        let same = weld_points(&mesh.points, run)?;
        let edges = par::blocks(run, mesh.triangles.len(), BLOCK, |block| {
            let triangles = mesh.triangles[block].iter().map(|t| t.map(|p| same.of[p as usize]));
            let edges = triangles.flat_map(|[p, q, r]| [[p, q], [q, r], [r, p]]);
            let key = |[p, q]: [u32; 2]| u64::from(p.min(q)) << 32 | u64::from(p.max(q));
            edges.map(key).collect::<Vec<_>>()
        })?;
        let size = f64::from(1u32 << lattice.sub_bits());
        let (mut rim, mut even) = (Self::default(), true);
        for share in radix::sort(edges, 0, Equal::Keep) {
            for group in share.chunk_by(|a, b| a == b) {
                let ends = [group[0] >> 32, group[0] & u64::from(u32::MAX)];
                if ends[0] == ends[1] {
                    continue;
                }
                even &= group.len() % 2 == 0;
                if group.len() == 1 {
                    let [p, q] = ends.map(|p| lattice.snap(same.points[p as usize]));
                    let touch = |cell| rim.cells.push(morton(cell));
                    scan::cells(&[p, q, q], lattice.sub_bits(), touch);
                    rim.cut([p, q].map(|p| DVec3::from(p.map(f64::from)) / size));
                }
            }
        }
        rim.cells.sort_unstable();
        rim.cells.dedup();
        rim.pieces.sort_by_key(|piece| piece.code);
        Ok((rim, even))
    }

    /// Adds an edge of the border, cut at the planes between cells.
    fn cut(&mut self, [from, to]: [DVec3; 2]) {
        let way = to - from;
        let mut cuts = vec![0.0, 1.0];
        for axis in 0..3 {
            let (low, high) = (from[axis].min(to[axis]), from[axis].max(to[axis]));
            // No end lies on a plane.
            let planes = low.ceil() as u32..high.ceil() as u32;
            cuts.extend(planes.map(|plane| (f64::from(plane) - from[axis]) / way[axis]));
        }
        cuts.sort_by(f64::total_cmp);
        for pair in cuts.windows(2).filter(|pair| pair[0] < pair[1]) {
            let cell = (from + way * ((pair[0] + pair[1]) / 2.0)).to_array().map(|x| x as u32);
            let ends = [from + way * pair[0], from + way * pair[1]];
            self.pieces.push(Piece { code: morton(cell), ends });
        }
    }
}
