//! Disjoint sets of numbers that are joined one by one.

/// The numbers from 0 to a count, each in one set.
#[derive(Debug, Clone, Default)]
pub struct Sets(Vec<u32>);

impl Sets {
    /// Each number in a set of its own.
    pub fn singles(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    /// Starts again with `count` numbers.
    pub fn reset(&mut self, count: usize) {
        self.0.clear();
        self.0.extend(0..count as u32);
    }

    /// True where `a` and `b` were in different sets until now.
    pub fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
        a != b
    }

    /// The lowest number in the set of `i`.
    pub fn root(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            let up = self.0[self.0[i as usize] as usize];
            self.0[i as usize] = up;
            i = up;
        }
        i
    }
}
