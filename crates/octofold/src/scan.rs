//! The exact scan converter: which cells a triangle touches, and where grid lines cross it.
//!
//! Triangles are given in odd sub-steps of a [`crate::lattice::Lattice`]. A cell is *touched* when
//! its closed box and the closed triangle share a point. By the separating axis theorem that is so
//! iff the plane of the triangle meets the box and the projections along x, y and z overlap; each
//! condition is linear in the cell's indices, so it is solved for whole rows, and the work is that
//! of the cells found. All decisions are made in integers: i64 for triangles of a few cells, i128
//! for the rest. Sources: Schwarz and Seidel 2010; specifications of network (D3.2), repair (D.3).

/// A triangle in sub-steps.
pub type Facet = [[i32; 3]; 3];

/// Where a line along an axis crosses a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Crossing {
    /// The line's cell along the two other axes, the next axis (x after z) first.
    pub row: [u32; 2],
    /// The half cell along the axis in which the crossing lies; cell `half / 2`.
    pub half: u32,
    /// The sub-step along the axis in which the crossing lies.
    pub step: u32,
    /// The triangle's normal points along the axis: the line leaves a solid here.
    pub leaving: bool,
}

impl Crossing {
    /// The first cell whose centre lies beyond the crossing; a crossing on a centre lies beyond it.
    pub fn first_centre(&self) -> u32 {
        self.half.div_ceil(2)
    }
}

/// Which lines along an axis are asked for their crossings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lines {
    /// Through cell centres.
    Centres,
    /// Through cell corners: the grid's own edges. Row `[i, j]` is the low corner's line.
    Corners,
}

/// Integers wide enough for a plane evaluated at a lattice point.
trait Wide:
    Copy
    + Ord
    + From<i64>
    + std::ops::Add<Output = Self>
    + std::ops::Sub<Output = Self>
    + std::ops::Mul<Output = Self>
    + std::ops::Neg<Output = Self>
{
    /// Quotient rounded down; the divisor is positive.
    fn floor_div(self, by: Self) -> i64;
}

impl Wide for i64 {
    fn floor_div(self, by: Self) -> i64 {
        self.div_euclid(by)
    }
}

impl Wide for i128 {
    fn floor_div(self, by: Self) -> i64 {
        // An estimate in floating point, put right in integers: 128-bit division is slow.
        let mut quotient = (self as f64 / by as f64).floor() as i64;
        while i128::from(quotient) * by > self {
            quotient -= 1;
        }
        while (i128::from(quotient) + 1) * by <= self {
            quotient += 1;
        }
        quotient
    }
}

/// Calls `emit` once for each cell that the triangle touches.
pub fn cells(facet: &Facet, sub_bits: u32, emit: impl FnMut([u32; 3])) {
    let local = Local::new(facet, sub_bits);
    if local.fits_i64() {
        local.cells::<i64>(emit);
    } else {
        local.cells::<i128>(emit);
    }
}

/// Calls `emit` for each crossing of the triangle with the lines along `axis`.
///
/// A line that meets an edge of the triangle counts as if it ran a little further along the next
/// axis, and much less along the one after: so it crosses exactly one of two triangles that share
/// the edge, or both or none where the surface folds, and a closed surface is crossed evenly.
pub fn crossings(
    facet: &Facet,
    sub_bits: u32,
    axis: usize,
    lines: Lines,
    emit: impl FnMut(Crossing),
) {
    let local = Local::new(facet, sub_bits);
    if local.fits_i64() {
        local.crossings::<i64>(axis, lines, emit);
    } else {
        local.crossings::<i128>(axis, lines, emit);
    }
}

/// A triangle moved by whole cells to the origin.
struct Local {
    corners: [[i64; 3]; 3],
    /// The cell that became the origin.
    base: [i64; 3],
    /// Last cell of the bounding box along each axis.
    last: [i64; 3],
    sub_bits: u32,
}

impl Local {
    fn new(facet: &Facet, sub_bits: u32) -> Self {
        let wide = facet.map(|p| p.map(i64::from));
        let over = |a: usize, pick: fn(i64, i64) -> i64| {
            pick(pick(wide[0][a], wide[1][a]), wide[2][a]) >> sub_bits
        };
        let base = [0, 1, 2].map(|a| over(a, i64::min));
        let last = [0, 1, 2].map(|a| over(a, i64::max) - base[a]);
        let corners = wide.map(|p| [0, 1, 2].map(|a| p[a] - (base[a] << sub_bits)));
        Self { corners, base, last, sub_bits }
    }

    /// True where 12 e^3 < 2^62 for coordinates up to e, the largest number that a plane
    /// evaluation meets.
    fn fits_i64(&self) -> bool {
        let cells = 1 + self.last.into_iter().max().unwrap_or(0);
        ((cells + 1) << self.sub_bits) < 1 << 19
    }

    fn normal<I: Wide>(&self) -> [I; 3] {
        let [p, q, r] = self.corners;
        let a = [0, 1, 2].map(|i| I::from(q[i] - p[i]));
        let b = [0, 1, 2].map(|i| I::from(r[i] - p[i]));
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    }

    fn cells<I: Wide>(&self, mut emit: impl FnMut([u32; 3])) {
        let zero = I::from(0);
        let mut normal = self.normal::<I>();
        let abs = |x: I| if x < zero { -x } else { x };
        let flat = normal.iter().all(|&n| n == zero);
        // Columns run along the axis in which the triangle is steepest to them; without area, rows
        // run across its longest extent, so that either way each row meets few cells.
        let (u, v, w) = if flat {
            let v = (0..3).max_by_key(|&a| (self.last[a], a)).unwrap_or(0);
            ((v + 1) % 3, v, (v + 2) % 3)
        } else {
            let w = (0..3).max_by_key(|&a| (abs(normal[a]), a)).unwrap_or(0);
            ((w + 1) % 3, (w + 2) % 3, w)
        };
        if normal[w] < zero {
            normal = normal.map(|n| -n);
        }
        let size = I::from(1 << self.sub_bits);
        let step = normal.map(|n| n * size);
        let [low, high] =
            [I::min as fn(I, I) -> I, I::max].map(|pick| pick(zero, step[u]) + pick(zero, step[v]));
        let [across, along, side] =
            [(u, v), (w, v), (w, u)].map(|(x, y)| Outline::touching(self, x, y));
        let first = self.corners[0].map(I::from);
        let offset = normal[u] * first[u] + normal[v] * first[v] + normal[w] * first[w];
        for j in 0..=self.last[v] {
            let (i0, i1) = across.row(j, self.last[u]);
            let (k0, k1) = along.row(j, self.last[w]);
            for i in i0..=i1 {
                let (mut k0, mut k1) = (k0, k1);
                if !flat {
                    let plane = step[u] * I::from(i) + step[v] * I::from(j) - offset;
                    k0 = k0.max(-(plane + high).floor_div(step[w]) - 1);
                    k1 = k1.min((-(plane + low)).floor_div(step[w]));
                }
                for k in k0..=k1 {
                    if side.holds(k, i) {
                        let mut cell = [0; 3];
                        for (axis, index) in [(u, i), (v, j), (w, k)] {
                            cell[axis] = (self.base[axis] + index) as u32;
                        }
                        emit(cell);
                    }
                }
            }
        }
    }

    fn crossings<I: Wide>(&self, axis: usize, lines: Lines, mut emit: impl FnMut(Crossing)) {
        let (u, v, w) = ((axis + 1) % 3, (axis + 2) % 3, axis);
        // Corners are odd: the line along the low side of the first cell is never met.
        if lines == Lines::Corners && (self.last[u] == 0 || self.last[v] == 0) {
            return;
        }
        let zero = I::from(0);
        let mut normal = self.normal::<I>();
        let leaving = normal[w] > zero;
        if normal[w] == zero {
            return;
        }
        if !leaving {
            normal = normal.map(|n| -n);
        }
        let offset = match lines {
            Lines::Centres => 1 << (self.sub_bits - 1),
            Lines::Corners => 0,
        };
        let outline = Outline::crossing(self, u, v, offset);
        let [start_u, start_v, start_w] = [u, v, w].map(|a| I::from(self.corners[0][a]));
        let start = self.base[w] << self.sub_bits;
        for j in 0..=self.last[v] {
            let (i0, i1) = outline.row(j, self.last[u]);
            for i in i0..=i1 {
                let [x, y] = [i, j].map(|c| I::from((c << self.sub_bits) + offset));
                let rise = normal[u] * (x - start_u) + normal[v] * (y - start_v);
                let step = start + (normal[w] * start_w - rise).floor_div(normal[w]);
                emit(Crossing {
                    row: [(self.base[u] + i) as u32, (self.base[v] + j) as u32],
                    half: (step >> (self.sub_bits - 1)) as u32,
                    step: step as u32,
                    leaving,
                });
            }
        }
    }
}

/// The projection of a triangle along one axis as conditions `a i + b j + c >= 0` on the cells
/// `(i, j)` of the other two.
struct Outline {
    conditions: [[i64; 3]; 6],
    count: usize,
}

impl Outline {
    /// Conditions for cells whose closed square meets the projection, given that it lies in the
    /// bounding box.
    fn touching(local: &Local, x: usize, y: usize) -> Self {
        let area = local.area(x, y);
        let mut outline = Self { conditions: [[0; 3]; 6], count: 0 };
        for [a, b, c] in local.edges(x, y) {
            // The corner of the square that lies furthest along the edge's inner normal decides.
            let mut add = |sign: i64| {
                let [a, b] = [a, b].map(|n| (sign * n) << local.sub_bits);
                outline.push([a, b, sign * c + a.max(0) + b.max(0)]);
            };
            // A projection without area has no inner side: the square must meet its line.
            if area >= 0 {
                add(1);
            }
            if area <= 0 {
                add(-1);
            }
        }
        outline
    }

    /// Conditions for lines through `offset` in each cell that cross the projection.
    fn crossing(local: &Local, x: usize, y: usize, offset: i64) -> Self {
        let sign = local.area(x, y).signum();
        let mut outline = Self { conditions: [[0; 3]; 6], count: 0 };
        for [a, b, c] in local.edges(x, y) {
            let [a, b, c] = [a, b, c].map(|n| sign * n);
            // On the edge itself the line counts as moved along x, then along y.
            let tie_is_inside = a > 0 || (a == 0 && b > 0);
            let c = c + (a + b) * offset - i64::from(!tie_is_inside);
            outline.push([a << local.sub_bits, b << local.sub_bits, c]);
        }
        outline
    }

    fn push(&mut self, condition: [i64; 3]) {
        self.conditions[self.count] = condition;
        self.count += 1;
    }

    /// First and last `i` in `0..=last` for which all conditions hold with this `j`.
    fn row(&self, j: i64, last: i64) -> (i64, i64) {
        let (mut first, mut last) = (0, last);
        for &[a, b, c] in &self.conditions[..self.count] {
            let rest = b * j + c;
            if a > 0 {
                first = first.max(-rest.div_euclid(a));
            } else if a < 0 {
                last = last.min(rest.div_euclid(-a));
            } else if rest < 0 {
                return (0, -1);
            }
        }
        (first, last)
    }

    fn holds(&self, i: i64, j: i64) -> bool {
        self.conditions[..self.count].iter().all(|&[a, b, c]| a * i + b * j + c >= 0)
    }
}

impl Local {
    /// Twice the signed area of the projection onto axes `x` and `y`.
    fn area(&self, x: usize, y: usize) -> i64 {
        let [p, q, r] = self.corners;
        (q[x] - p[x]) * (r[y] - p[y]) - (q[y] - p[y]) * (r[x] - p[x])
    }

    /// For each edge, `a x + b y + c`, positive to its left.
    fn edges(&self, x: usize, y: usize) -> [[i64; 3]; 3] {
        [0, 1, 2].map(|i| {
            let (p, q) = (self.corners[i], self.corners[(i + 1) % 3]);
            let (a, b) = (p[y] - q[y], q[x] - p[x]);
            [a, b, -(a * p[x] + b * p[y])]
        })
    }
}

/// True where the triangle meets one of the 26 segments from the centre of a touched cell to its
/// face centres, edge middles and corners, or lies in one plane with such a segment.
pub fn crosses_star(facet: &Facet, sub_bits: u32, cell: [u32; 3]) -> bool {
    let half = 1i128 << (sub_bits - 1);
    let centre = cell.map(|c| (i128::from(c) << sub_bits) + half);
    let corners = facet.map(|p| [0, 1, 2].map(|a| i128::from(p[a]) - centre[a]));
    let cross = |a: [i128; 3], b: [i128; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let dot = |a: [i128; 3], b: [i128; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let sub = |a: [i128; 3], b: [i128; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let [p, q, r] = corners;
    let normal = cross(sub(q, p), sub(r, p));
    let height = dot(normal, p);
    // Half of the directions; each stands for the line through the centre both ways.
    (14..27).any(|d| {
        let direction = [d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1];
        let reach = dot(normal, direction) * half;
        if height.abs() > reach.abs() {
            return false;
        }
        // The line passes the three edges on the same side.
        let sides = [(p, q), (q, r), (r, p)].map(|(a, b)| dot(cross(a, b), direction));
        sides.iter().all(|&s| s >= 0) || sides.iter().all(|&s| s <= 0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SUB: u32 = 4;

    /// Small odd coordinates, often equal, so that flat and thin triangles are common.
    fn facet(cells: i32) -> impl Strategy<Value = Facet> {
        let step = (0..cells << (SUB - 1)).prop_map(|i| 2 * i + 1);
        prop::array::uniform3(prop::array::uniform3(step))
    }

    /// All thirteen axes of the separating axis theorem for a closed triangle and a closed box.
    fn overlaps(facet: &Facet, cell: [u32; 3]) -> bool {
        let low = cell.map(|c| i128::from(c) << SUB);
        let size = 1i128 << SUB;
        let corners = facet.map(|p| [0, 1, 2].map(|a| i128::from(p[a])));
        let sub = |a: [i128; 3], b: [i128; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
        let cross = |a: [i128; 3], b: [i128; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let edges = [0, 1, 2].map(|i| sub(corners[(i + 1) % 3], corners[i]));
        let units = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
        let normal = cross(edges[0], edges[1]);
        let mut axes = vec![normal];
        axes.extend(units);
        axes.extend(edges.iter().flat_map(|&e| units.map(|u| cross(e, u))));
        // Without area, the directions in the plane of triangle and box edge are needed too.
        axes.extend(edges.iter().map(|&e| cross(e, normal)));
        axes.iter().all(|axis| {
            let dot = |p: [i128; 3]| (0..3).map(|a| axis[a] * p[a]).sum::<i128>();
            let of_triangle = corners.map(dot);
            let of_box: Vec<i128> = (0..8)
                .map(|c| dot([0, 1, 2].map(|a| low[a] + (c >> a & 1) as i128 * size)))
                .collect();
            of_triangle.iter().max() >= of_box.iter().min()
                && of_box.iter().max() >= of_triangle.iter().min()
        })
    }

    fn found(facet: &Facet) -> Vec<[u32; 3]> {
        let mut cells = Vec::new();
        super::cells(facet, SUB, |c| cells.push(c));
        cells.sort_unstable();
        cells
    }

    proptest! {
        #![proptest_config(crate::sweep::cases(512))]

        #[test]
        fn touched_cells_are_those_that_overlap(facet in facet(6)) {
            let mut expected = Vec::new();
            for x in 0..6 {
                for y in 0..6 {
                    for z in 0..6 {
                        if overlaps(&facet, [x, y, z]) {
                            expected.push([x, y, z]);
                        }
                    }
                }
            }
            prop_assert_eq!(found(&facet), expected);
        }

        #[test]
        fn both_widths_agree(facet in facet(40), axis in 0usize..3) {
            let local = Local::new(&facet, SUB);
            prop_assert!(local.fits_i64());
            let (mut narrow, mut wide) = (Vec::new(), Vec::new());
            local.cells::<i64>(|c| narrow.push(c));
            local.cells::<i128>(|c| wide.push(c));
            prop_assert_eq!(narrow, wide);
            for lines in [Lines::Centres, Lines::Corners] {
                let (mut narrow, mut wide) = (Vec::new(), Vec::new());
                local.crossings::<i64>(axis, lines, |c| narrow.push(c));
                local.crossings::<i128>(axis, lines, |c| wide.push(c));
                prop_assert_eq!(narrow, wide);
            }
        }

        #[test]
        fn lines_cross_a_tetrahedron_in_pairs_round_its_inside(
            a in facet(6),
            d in facet(6),
            axis in 0usize..3,
        ) {
            let [p, q, r] = a;
            let s = d[0];
            let orient = |a: [i32; 3], b: [i32; 3], c: [i32; 3], d: [i32; 3]| {
                let m = [b, c, d].map(|x| [0, 1, 2].map(|k| i64::from(x[k]) - i64::from(a[k])));
                m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
                    - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
                    + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
            };
            let turn = orient(p, q, r, s).signum();
            prop_assume!(turn != 0);
            let faces = if turn > 0 {
                [[p, r, q], [p, q, s], [q, r, s], [r, p, s]]
            } else {
                [[p, q, r], [p, s, q], [q, s, r], [r, s, p]]
            };
            let mut all = Vec::new();
            for face in &faces {
                crossings(face, SUB, axis, Lines::Centres, |c| all.push(c));
            }
            all.sort_unstable();
            for row in 0..36u32 {
                let row = [row % 6, row / 6];
                let here: Vec<_> = all.iter().filter(|c| c.row == row).collect();
                prop_assert_eq!(here.len() % 2, 0);
                for k in 0..6u32 {
                    let mut centre = [0; 3];
                    centre[axis] = k;
                    centre[(axis + 1) % 3] = row[0];
                    centre[(axis + 2) % 3] = row[1];
                    let centre = centre.map(|c| ((c << SUB) + (1 << (SUB - 1))) as i32);
                    let sides = faces.map(|[a, b, c]| orient(a, b, c, centre).signum());
                    if sides.contains(&0) {
                        continue;
                    }
                    let winding: i32 = here
                        .iter()
                        .filter(|c| c.first_centre() <= k)
                        .map(|c| if c.leaving { -1 } else { 1 })
                        .sum();
                    let inside = sides.iter().all(|&s| s < 0) || sides.iter().all(|&s| s > 0);
                    prop_assert_eq!(winding, i32::from(inside));
                }
            }
        }
    }
}
