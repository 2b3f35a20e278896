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

    /// Makes room for what slices of other tables hold.
    pub fn reserve(&mut self, others: &[&Self], slices: Range<usize>) {
        let first = |table: &Self, row: usize| row.checked_sub(1).map_or(0, |r| table.rows[r].end);
        for table in others {
            let [start, end] = [slices.start, slices.end].map(|z| table.slices[z]);
            self.rows.reserve(self.rows.len() + end - start);
            self.items.reserve(self.items.len() + first(table, end) - first(table, start));
        }
        self.slices.reserve(slices.len());
    }

    /// Adds a slice whose rows are made of those of two tables: `merge` adds the items of a row that
    /// both have; of any other it stays as it is where that table is `kept`.
    pub fn merge_slice(
        &mut self,
        tables: [&Self; 2],
        z: usize,
        kept: [bool; 2],
        merge: impl Fn(&[T], &[T], &mut Vec<T>),
    ) where
        T: Copy,
    {
        let mut next = tables.map(|t| t.slices[z]);
        let ends = tables.map(|t| t.slices[z + 1]);
        let mut items =
            [0, 1].map(|i| next[i].checked_sub(1).map_or(0, |r| tables[i].rows[r].end));
        loop {
            let row = |i: usize| (next[i] < ends[i]).then(|| tables[i].rows[next[i]]);
            let (first, second) = (row(0), row(1));
            let own = match (first, second) {
                (None, None) => break,
                (Some(a), Some(b)) if a.y == b.y => {
                    let before = self.items.len();
                    let [own, other] = [(0, a), (1, b)].map(|(i, r)| &tables[i].items[items[i]..r.end]);
                    merge(own, other, &mut self.items);
                    if self.items.len() > before {
                        self.rows.push(Row { y: a.y, end: self.items.len() });
                    }
                    next = next.map(|n| n + 1);
                    items = [a.end, b.end];
                    continue;
                }
                (Some(a), b) => usize::from(b.is_some_and(|b| b.y < a.y)),
                (None, Some(_)) => 1,
            };
            // All rows that only one of them has up to the next of the other, at once.
            let until = [second, first][own].map_or(u32::MAX, |r| r.y);
            let rows = &tables[own].rows[next[own]..ends[own]];
            let count = rows.iter().take_while(|r| r.y < until).count();
            let end = rows[count - 1].end;
            if kept[own] {
                let to = self.items.len();
                let moved = |r: &Row| Row { y: r.y, end: r.end - items[own] + to };
                self.rows.extend(rows[..count].iter().map(moved));
                self.items.extend_from_slice(&tables[own].items[items[own]..end]);
            }
            next[own] += count;
            items[own] = end;
        }
        self.end_slice();
    }

    /// Adds the slices of another table behind its own.
    pub fn append(&mut self, other: Self) {
        if self.slices.len() == 1 && self.rows.is_empty() {
            *self = other;
            return;
        }
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
