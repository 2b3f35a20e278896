//! A table of rows: items along x, kept for those rows of a grid that have any.

use std::ops::Range;

/// Items by row `(y, z)`, in order of z, y and x.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows<T> {
    /// First row and first item of each slice z, and the ends.
    slices: Vec<First>,
    rows: Vec<Row>,
    items: Vec<T>,
}

/// Where a slice begins.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct First {
    row: usize,
    item: usize,
}

/// One row that has items.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Row {
    y: u32,
    /// One past its last item, counted from the first of its slice; its first is where the row before
    /// ends.
    end: u32,
}

impl<T> Default for Rows<T> {
    fn default() -> Self {
        Self { slices: vec![First::default()], rows: Vec::new(), items: Vec::new() }
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
        let first = self.open();
        self.items[first..].last_mut()
    }

    /// Where the slice that is being built begins.
    fn first(&self) -> First {
        self.slices.last().copied().unwrap_or_default()
    }

    /// The first item of the row that is being built.
    fn open(&self) -> usize {
        let First { row, item } = self.first();
        item + self.rows[row..].last().map_or(0, |r| r.end as usize)
    }

    /// Ends row `y`; one without items is not kept.
    pub fn end_row(&mut self, y: u32) {
        if self.open() < self.items.len() {
            self.rows.push(Row { y, end: (self.items.len() - self.first().item) as u32 });
        }
    }

    /// Ends a slice.
    pub fn end_slice(&mut self) {
        self.slices.push(First { row: self.rows.len(), item: self.items.len() });
    }

    /// Makes room for what slices of other tables hold.
    pub fn reserve(&mut self, others: &[&Self], slices: Range<usize>) {
        let ends = |table: &&Self| [slices.start, slices.end].map(|z| table.slices[z]);
        let rows = others.iter().map(ends).map(|[start, end]| end.row - start.row);
        self.rows.reserve(rows.sum());
        let items = others.iter().map(ends).map(|[start, end]| end.item - start.item);
        self.items.reserve(items.sum());
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
        let rows = tables.map(|t| &t.rows[t.slices[z].row..t.slices[z + 1].row]);
        let items = tables.map(|t| &t.items[t.slices[z].item..t.slices[z + 1].item]);
        let start = self.items.len();
        let (mut next, mut from) = ([0; 2], [0; 2]);
        loop {
            let [first, second] = [0, 1].map(|i| &rows[i][next[i]..]);
            let mut both = 0;
            for (a, b) in first.iter().zip(second).take_while(|(a, b)| a.y == b.y) {
                let ends = [a.end as usize, b.end as usize];
                let before = self.items.len();
                merge(&items[0][from[0]..ends[0]], &items[1][from[1]..ends[1]], &mut self.items);
                if self.items.len() > before {
                    self.rows.push(Row { y: a.y, end: (self.items.len() - start) as u32 });
                }
                from = ends;
                both += 1;
            }
            let rest = [&first[both..], &second[both..]];
            next = next.map(|n| n + both);
            // All rows that only one of them has up to the next of the other, at once.
            let own = match rest.map(|rows| rows.first()) {
                [None, None] => break,
                [Some(a), Some(b)] => usize::from(b.y < a.y),
                [first, _] => usize::from(first.is_none()),
            };
            let until = rest[1 - own].first().map_or(u32::MAX, |r| r.y);
            let alone = match rest[own].last() {
                Some(last) if last.y < until => rest[own],
                _ => &rest[own][..rest[own].iter().take_while(|r| r.y < until).count()],
            };
            let end = alone.last().map_or(from[own], |r| r.end as usize);
            if kept[own] {
                let to = self.items.len() - start;
                let moved = |r: &Row| Row { y: r.y, end: (r.end as usize - from[own] + to) as u32 };
                self.rows.extend(alone.iter().map(moved));
                self.items.extend_from_slice(&items[own][from[own]..end]);
            }
            next[own] += alone.len();
            from[own] = end;
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
        let moved = |s: &First| First { row: s.row + rows, item: s.item + items };
        self.slices.extend(other.slices[1..].iter().map(moved));
        self.rows.extend(other.rows);
        self.items.extend(other.items);
    }

    /// All items.
    pub fn items(&self) -> &[T] {
        &self.items
    }

    /// The place among all items of the first of a row, and its items; none beyond the last slice.
    pub fn row(&self, y: usize, z: usize) -> (usize, &[T]) {
        let Some(&[first, end]) = self.slices.get(z..z + 2) else { return (0, &[]) };
        let slice = &self.rows[first.row..end.row];
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
        let range = items_of(slice, first.item, at);
        (range.start, &self.items[range])
    }

    /// The rows of a slice that have items, with their y, from `rows` on.
    pub fn of_slice(
        &self,
        z: usize,
        from: u32,
    ) -> impl ExactSizeIterator<Item = (u32, &[T])> + Clone {
        let (first, end) = (self.slices[z], self.slices[z + 1]);
        let slice = &self.rows[first.row..end.row];
        let from = slice.partition_point(|r| r.y < from);
        (from..slice.len())
            .map(move |row| (slice[row].y, &self.items[items_of(slice, first.item, row)]))
    }
}

/// Where the items of a row of a slice are, which begin at `first`.
fn items_of(slice: &[Row], first: usize, row: usize) -> Range<usize> {
    let start = row.checked_sub(1).map_or(0, |before| slice[before].end as usize);
    first + start..first + slice[row].end as usize
}
