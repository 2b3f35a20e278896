//! Patches of a sheet complex: each turned one way, with a list of the junctions between them.
//!
//! Triangles that share an edge with no third belong to one patch. Those that bound a solid part
//! look outwards; of other patches no way round is the right one, and so that it does not depend on
//! how the input was turned, closed and bent ones look away from their middle, flat ones upwards.
//! Source: specification of repair (A.2, ambiguities e and m).

use super::super::piercing::{Point, cross, sub};
use crate::sets::Sets;
use rustc_hash::FxHashMap;

/// What a sheet complex consists of. Lengths are in lattice steps.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Patches {
    /// The patch of each triangle.
    pub of: Vec<u32>,
    /// How many there are.
    pub count: usize,
    /// Patches that have one side only: two triangles at some of their edges run the same way.
    pub one_sided: usize,
    /// Patches without a border or junction.
    pub closed: usize,
    /// Edges with one triangle.
    pub borders: Vec<[u32; 2]>,
    /// Edges with three triangles or more.
    pub junctions: Vec<([u32; 2], u32)>,
}

/// The edges of triangles with who uses them: points, the lower first; triangle; whether that runs
/// from the lower to the higher.
type Use = ([u32; 2], u32, bool);

/// Finds the patches of some triangles and turns each one way. `outward` tells which triangles must
/// stay as they are.
pub fn patches(points: &[Point], triangles: &mut [[u32; 3]], outward: &[bool]) -> Patches {
    let mut uses: Vec<Use> = Vec::with_capacity(3 * triangles.len());
    for (t, triangle) in triangles.iter().enumerate() {
        for i in 0..3 {
            let (p, q) = (triangle[i], triangle[(i + 1) % 3]);
            uses.push(([p.min(q), p.max(q)], t as u32, p < q));
        }
    }
    crate::par::sort(&mut uses);
    let mut found = Patches { of: vec![u32::MAX; triangles.len()], ..Patches::default() };
    let mut links: Vec<[(u32, bool); 3]> = vec![[(u32::MAX, false); 3]; triangles.len()];
    let mut taken = vec![0u8; triangles.len()];
    for round in uses.chunk_by(|a, b| a.0 == b.0) {
        match *round {
            [one] => found.borders.push(one.0),
            [a, b] => {
                for (own, other) in [(a, b), (b, a)] {
                    let t = own.1 as usize;
                    links[t][taken[t] as usize] = (other.1, own.2 == other.2);
                    taken[t] += 1;
                }
            }
            _ => found.junctions.push((round[0].0, round.len() as u32)),
        }
    }
    drop(uses);
    let mut turned = vec![false; triangles.len()];
    let mut order: Vec<u32> = Vec::new();
    for seed in 0..triangles.len() {
        if found.of[seed] != u32::MAX {
            continue;
        }
        let patch = found.count as u32;
        found.count += 1;
        order.clear();
        order.push(seed as u32);
        found.of[seed] = patch;
        let (mut one_sided, mut open) = (false, false);
        let mut next = 0;
        while next < order.len() {
            let t = order[next] as usize;
            next += 1;
            open |= taken[t] < 3;
            for &(other, against) in &links[t][..taken[t] as usize] {
                let way = turned[t] != against;
                if found.of[other as usize] == u32::MAX {
                    found.of[other as usize] = patch;
                    turned[other as usize] = way;
                    order.push(other);
                } else if turned[other as usize] != way {
                    one_sided = true;
                }
            }
        }
        found.one_sided += usize::from(one_sided);
        found.closed += usize::from(!open);
        let flip = match order.iter().find(|&&t| outward[t as usize]) {
            Some(&t) => turned[t as usize],
            None => looks_inward(points, triangles, &order, &turned),
        };
        for &t in &order {
            if turned[t as usize] != flip {
                triangles[t as usize].swap(1, 2);
            }
        }
    }
    found
}

/// Whether a patch that is turned as noted looks towards its middle, or downwards where it is flat.
fn looks_inward(points: &[Point], triangles: &[[u32; 3]], order: &[u32], turned: &[bool]) -> bool {
    let corners = |t: u32| triangles[t as usize].map(|p| points[p as usize]);
    let origin = corners(order[0])[0];
    let (mut sum, mut weight) = ([0i128; 3], 0i128);
    for &t in order {
        for p in corners(t) {
            let away = sub(p, origin);
            (0..3).for_each(|a| sum[a] += i128::from(away[a]));
            weight += 1;
        }
    }
    let middle = sum.map(|x| (x / weight) as i64);
    let (mut volume, mut whole, mut size) = (0i128, [0i128; 3], 0i128);
    for &t in order {
        let [a, b, c] = corners(t);
        let normal = cross(sub(b, a), sub(c, a));
        let sign = if turned[t as usize] { -1 } else { 1 };
        let from = sub(a, origin);
        let height: i128 =
            (0..3).map(|i| i128::from(normal[i]) * i128::from(from[i] - middle[i])).sum();
        volume += sign * height;
        size += height.abs();
        (0..3).for_each(|i| whole[i] += sign * i128::from(normal[i]));
    }
    // Nearly flat patches have no middle to look away from.
    if volume.abs() * 4 > size && volume != 0 && bent(&whole, points, triangles, order) {
        return volume < 0;
    }
    let main = [2, 1, 0].into_iter().max_by_key(|&a| (whole[a].abs(), a));
    main.is_some_and(|a| whole[a] < 0)
}

/// Whether the areas of a patch do not add up to nearly their sum.
fn bent(whole: &[i128; 3], points: &[Point], triangles: &[[u32; 3]], order: &[u32]) -> bool {
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let area: f64 = order
        .iter()
        .map(|&t| {
            let [a, b, c] = triangles[t as usize].map(|p| points[p as usize]);
            length(cross(sub(b, a), sub(c, a)).map(|x| x as f64))
        })
        .sum();
    length(whole.map(|x| x as f64)) < 0.98 * area
}

/// A line of junction edges that hang together, between as many patches all along.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Triangles at each of its edges.
    pub sheets: u32,
    /// Its length.
    pub length: f64,
    /// Its box.
    pub bounds: [Point; 2],
}

/// Joins junction edges to lines, longest first.
pub fn lines(points: &[Point], junctions: &[([u32; 2], u32)]) -> Vec<Line> {
    let mut sets = Sets::singles(junctions.len());
    let mut last: FxHashMap<(u32, u32), u32> = FxHashMap::default();
    for (i, (ends, sheets)) in junctions.iter().enumerate() {
        for end in ends {
            if let Some(other) = last.insert((*end, *sheets), i as u32) {
                sets.join(other, i as u32);
            }
        }
    }
    let mut lines: Vec<Option<Line>> = vec![None; junctions.len()];
    for (i, &(ends, sheets)) in junctions.iter().enumerate() {
        let [p, q] = ends.map(|p| points[p as usize]);
        let empty = Line { sheets, length: 0.0, bounds: [p; 2] };
        let line = lines[sets.root(i as u32) as usize].get_or_insert(empty);
        line.length += sub(p, q).map(|x| x as f64).map(|x| x * x).iter().sum::<f64>().sqrt();
        let [low, high] = &mut line.bounds;
        for p in [p, q] {
            for a in 0..3 {
                low[a] = low[a].min(p[a]);
                high[a] = high[a].max(p[a]);
            }
        }
    }
    let mut lines: Vec<Line> = lines.into_iter().flatten().collect();
    lines.sort_by(|a, b| b.length.total_cmp(&a.length).then(a.bounds.cmp(&b.bounds)));
    lines
}
