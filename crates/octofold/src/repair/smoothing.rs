//! Vertices of cells without shape, where gaps were closed: pulled smooth between their neighbours.
//!
//! Each goes to the middle of the vertices round it, many times over, and never leaves its cell, so
//! all guarantees stay. Sources: specification of repair (A.1.7); Bischoff, Pavic, Kobbelt 2005.

use super::apexes::Apexes;
use super::bricks::{Place, coordinates};
use super::cells::Cells;
use super::piercing::Point;
use crate::par;
use crate::run::{Cancelled, Run};
use crate::surface::cell::{edge_at, edge_axis, edge_corner};
use glam::DVec3;
use rustc_hash::FxHashMap;

/// Rounds of smoothing.
const ROUNDS: usize = 48;

/// A connected part of the surface that lies where the input has nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Membrane {
    /// Box of its vertices.
    pub bounds: [Point; 2],
    /// Cells that it goes through.
    pub cells: usize,
}

/// A vertex without shape.
pub struct Loose {
    /// Its number.
    pub vertex: u32,
    /// The low corner of its cell.
    pub low: Point,
    /// The vertices that it is joined to.
    pub around: Vec<u32>,
}

/// Smooths the vertices of rank 0, and tells which connected parts they form.
pub fn smooth(
    cells: &Cells<'_>,
    apexes: &mut Apexes,
    steps: i32,
    run: &Run,
) -> Result<Vec<Membrane>, Cancelled> {
    run.stage("smooth");
    let parts = cells.members.per_brick(run, |bricks| {
        let mut loose = Vec::new();
        for brick in bricks {
            cells.members.in_brick(brick, |cell, place| {
                let first = cells.first_loop(cell);
                if apexes.ranks[first as usize] > 0 {
                    return;
                }
                let low = place.at.map(|x| x as i32 * steps);
                let count = u32::from(cells.loops(cell).count);
                loose.extend((first..first + count).map(|vertex| Loose {
                    vertex,
                    low,
                    around: around(cells, cell, place, vertex - first),
                }));
            });
        }
        loose
    })?;
    let loose: Vec<Loose> = parts.into_iter().flatten().collect();
    if loose.is_empty() {
        return Ok(Vec::new());
    }
    // Loops that share their cell were placed so that they do not meet.
    let alone: Vec<bool> = loose.iter().map(|l| apexes.is_alone(l.vertex)).collect();
    settle(&loose, &alone, &mut apexes.points, steps, run)
}

/// Smooths loose vertices, those that are `free`, and tells which connected parts they form.
pub fn settle(
    loose: &[Loose],
    free: &[bool],
    points: &mut [Point],
    steps: i32,
    run: &Run,
) -> Result<Vec<Membrane>, Cancelled> {
    let places: FxHashMap<u32, u32> =
        loose.iter().enumerate().map(|(i, l)| (l.vertex, i as u32)).collect();
    let fixed = |vertex: u32| DVec3::from_array(points[vertex as usize].map(f64::from));
    let mut at: Vec<DVec3> = loose.iter().map(|l| fixed(l.vertex)).collect();
    for _ in 0..ROUNDS {
        run.check()?;
        at = par::map(loose, |l| {
            let beside = l
                .around
                .iter()
                .map(|v| places.get(v).map_or_else(|| fixed(*v), |&i| at[i as usize]));
            let middle = beside.sum::<DVec3>() / l.around.len().max(1) as f64;
            let low = DVec3::from_array(l.low.map(f64::from));
            middle.clamp(low + 1.0, low + f64::from(steps - 1))
        });
    }
    for ((l, at), _) in loose.iter().zip(&at).zip(free).filter(|(_, free)| **free) {
        points[l.vertex as usize] = at.to_array().map(|x| x.round() as i32);
    }
    Ok(membranes(loose, &places, points))
}

/// The vertices of the loops that a loop has arcs with.
fn around(cells: &Cells<'_>, cell: u32, place: Place, number: u32) -> Vec<u32> {
    let loops = cells.loops(cell);
    let inside = coordinates(place.cell);
    loops
        .points(number as u8)
        .filter_map(|p| {
            let face = loops.via[p] as usize;
            let (axis, side) = (face / 2, face % 2);
            let mut local = inside.map(|x| x as i32);
            local[axis] += 2 * side as i32 - 1;
            let beside = cells.members.beside(place.brick, local)?;
            let e = edge_at(edge_corner(p / 2) ^ 1 << axis, edge_axis(p / 2));
            Some(cells.loop_at(beside, 2 * e + p % 2))
        })
        .collect()
}

fn membranes(loose: &[Loose], places: &FxHashMap<u32, u32>, points: &[Point]) -> Vec<Membrane> {
    let mut seen = vec![false; loose.len()];
    let mut found = Vec::new();
    for first in 0..loose.len() {
        if std::mem::replace(&mut seen[first], true) {
            continue;
        }
        let start = points[loose[first].vertex as usize];
        let mut membrane = Membrane { bounds: [start; 2], cells: 0 };
        let mut waiting = vec![first];
        while let Some(i) = waiting.pop() {
            let p = points[loose[i].vertex as usize];
            let [low, high] = &mut membrane.bounds;
            for a in 0..3 {
                low[a] = low[a].min(p[a]);
                high[a] = high[a].max(p[a]);
            }
            membrane.cells += 1;
            for v in &loose[i].around {
                if let Some(&j) = places.get(v)
                    && !std::mem::replace(&mut seen[j as usize], true)
                {
                    waiting.push(j as usize);
                }
            }
        }
        found.push(membrane);
    }
    found
}
