//! A table of rows: items along x, kept for those rows of a grid that have any.

use std::ops::Range;

/// Items by row `(y, z)`, in order of z, y and x.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows<T> {
    /// First row of each slice z, and the end.
    slices: Vec<usize>,
    rows: Vec<Row>,
    items: Vec<T>,
}

/// One row that has items.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Row {
    y: u32,
    /// One past its last item; its first is where the row before ends.
    end: usize,
}

impl<T> Default for Rows<T> {
    fn default() -> Self {
        Self { slices: vec![0], rows: Vec::new(), items: Vec::new() }
    }
}

impl<T> Rows<T> {
    /// A table of `depth` slices of items in order of row `[y, z]`; `join` may take an item into the
    /// one before it in its row.
    pub fn collect(
        depth: usize,
        ordered: impl IntoIterator<Item = ([u32; 2], T)>,
        join: impl Fn(&mut T, &T) -> bool,
    ) -> Self {
        let mut rows = Self::default();
        let mut at = None;
        for (row, item) in ordered {
            if at != Some(row) {
                if let Some([y, _]) = at.replace(row) {
                    rows.end_row(y);
                }
                rows.fill_to(row[1] as usize);
            }
            if !rows.last_mut().is_some_and(|last| join(last, &item)) {
                rows.push(item);
            }
        }
        if let Some([y, _]) = at {
            rows.end_row(y);
        }
        rows.fill_to(depth);
        rows
    }

    /// Ends slices until there are `depth`.
    pub fn fill_to(&mut self, depth: usize) {
        while self.slices.len() <= depth {
            self.end_slice();
        }
    }

    /// Adds an item to the row that is being built.
    pub fn push(&mut self, item: T) {
        self.items.push(item);
    }

    /// Adds items to the row that is being built.
    pub fn extend(&mut self, items: &[T])
    where
        T: Copy,
    {
        self.items.extend_from_slice(items);
    }

    /// The last item of the row that is being built.
    pub fn last_mut(&mut self) -> Option<&mut T> {
        let first = self.rows.last().map_or(0, |r| r.end);
        self.items[first..].last_mut()
    }

    /// Ends row `y`; one without items is not kept.
    pub fn end_row(&mut self, y: u32) {
        let end = self.items.len();
        if self.rows.last().map_or(0, |r| r.end) < end {
            self.rows.push(Row { y, end });
        }
    }

    /// Ends a slice.
    pub fn end_slice(&mut self) {
        self.slices.push(self.rows.len());
    }

    /// Adds the slices of another table behind its own.
    pub fn append(&mut self, other: Self) {
        let (rows, items) = (self.rows.len(), self.items.len());
        self.slices.extend(other.slices[1..].iter().map(|s| s + rows));
        self.rows.extend(other.rows.iter().map(|r| Row { y: r.y, end: r.end + items }));
        self.items.extend(other.items);
    }

    /// All items.
    pub fn items(&self) -> &[T] {
        &self.items
    }

    /// The place among all items of the first of a row, and its items; none beyond the last slice.
    pub fn row(&self, y: usize, z: usize) -> (usize, &[T]) {
        let Some(&[first, end]) = self.slices.get(z..z + 2) else { return (0, &[]) };
        let slice = &self.rows[first..end];
        let Some(lowest) = slice.first() else { return (0, &[]) };
        // Where no row is missing the place is known.
        let guess = y.wrapping_sub(lowest.y as usize);
        let at = match slice.get(guess) {
            Some(row) if row.y as usize == y => guess,
            _ => match slice.binary_search_by_key(&(y as u32), |r| r.y) {
                Ok(at) => at,
                Err(_) => return (0, &[]),
            },
        };
        let range = self.items_of(first + at);
        (range.start, &self.items[range])
    }

    /// The rows of a slice that have items, with their y, from `rows` on.
    pub fn of_slice(
        &self,
        z: usize,
        from: u32,
    ) -> impl ExactSizeIterator<Item = (u32, &[T])> + Clone {
        let slice = self.slices[z]..self.slices[z + 1];
        let first = slice.start + self.rows[slice.clone()].partition_point(|r| r.y < from);
        (first..slice.end).map(|row| (self.rows[row].y, &self.items[self.items_of(row)]))
    }

    fn items_of(&self, row: usize) -> Range<usize> {
        row.checked_sub(1).map_or(0, |before| self.rows[before].end)..self.rows[row].end
    }
}
