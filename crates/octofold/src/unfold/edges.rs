//! Which faces meet at which edge: any number of faces may.

/// A side of a face, which runs along its edge from `from` to `to`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Side {
    /// Point where the side begins.
    pub from: u32,
    /// Point where it ends.
    pub to: u32,
    /// The face.
    pub face: u32,
    /// Which of the face's sides.
    pub number: u32,
}

impl Side {
    /// The ends, the lower one first.
    pub fn ends(&self) -> [u32; 2] {
        [self.from.min(self.to), self.from.max(self.to)]
    }

    /// True where the other side runs along the same edge the other way.
    pub fn opposes(&self, other: &Self) -> bool {
        self.from == other.to && self.to == other.from
    }
}

/// The sides of all faces, edge by edge.
#[derive(Debug, Clone, Default)]
pub(super) struct Edges {
    sides: Vec<Side>,
    starts: Vec<u32>,
}

impl Edges {
    /// Sorts `sides` by their edges, and those of an edge by face.
    pub fn new(mut sides: Vec<Side>) -> Self {
        sides.sort_unstable_by_key(|s| (s.ends(), s.face, s.number));
        let starts = (0..sides.len()).filter(|&i| i == 0 || sides[i].ends() != sides[i - 1].ends());
        let mut starts: Vec<u32> = starts.map(|i| i as u32).collect();
        starts.push(sides.len() as u32);
        Self { sides, starts }
    }

    /// The sides of triangles.
    pub fn of_triangles(triangles: &[[u32; 3]]) -> Self {
        let side = |(face, t): (usize, &[u32; 3])| {
            let (face, t) = (face as u32, *t);
            [0, 1, 2].map(|k| Side { from: t[k], to: t[(k + 1) % 3], face, number: k as u32 })
        };
        Self::new(triangles.iter().enumerate().flat_map(side).collect())
    }

    /// How many edges there are.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// The sides at edge `edge`.
    pub fn sides(&self, edge: usize) -> &[Side] {
        &self.sides[self.starts[edge] as usize..self.starts[edge + 1] as usize]
    }

    /// The edge between two points.
    pub fn find(&self, [a, b]: [u32; 2]) -> Option<usize> {
        let ends = [a.min(b), a.max(b)];
        let first = self.sides.partition_point(|s| s.ends() < ends);
        let known = self.sides.get(first).is_some_and(|s| s.ends() == ends);
        known.then(|| self.starts.partition_point(|&s| (s as usize) <= first) - 1)
    }

    /// All edges, in order of their ends.
    pub fn iter(&self) -> impl Iterator<Item = &[Side]> {
        (0..self.len()).map(|e| self.sides(e))
    }
}
