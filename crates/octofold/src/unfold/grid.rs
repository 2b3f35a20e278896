//! Which shapes may be near which: a grid of squares, wound round a torus so that it needs no
//! bounds.

use super::plane::Bounds;
use glam::DVec2;

/// Numbers of shapes by the squares that their boxes touch.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    scale: f64,
    bits: u32,
    cells: Vec<Vec<u32>>,
}

impl Grid {
    /// A grid for about `count` shapes of about `size`.
    pub fn new(count: usize, size: f64) -> Self {
        let bits = (4 * count.max(4)).next_power_of_two().ilog2().div_ceil(2).min(10);
        let scale = 1.0 / size.max(f64::MIN_POSITIVE);
        Self { scale, bits, cells: vec![Vec::new(); 1 << (2 * bits)] }
    }

    /// Adds shape `number`.
    pub fn insert(&mut self, number: u32, bounds: &Bounds) {
        self.visit(bounds, |cell| cell.push(number));
    }

    /// Takes shape `number` out; `bounds` is as it was put in.
    pub fn remove(&mut self, number: u32, bounds: &Bounds) {
        self.visit(bounds, |cell| {
            if let Some(place) = cell.iter().position(|&n| n == number) {
                cell.swap_remove(place);
            }
        });
    }

    /// Shapes in the squares that `bounds` touches, some of them several times; stops where `found`
    /// says so.
    pub fn near(&self, bounds: &Bounds, mut found: impl FnMut(u32) -> bool) {
        let [columns, rows] = self.spans(bounds);
        for row in rows.0..=rows.1 {
            for column in columns.0..=columns.1 {
                if self.cells[self.cell(column, row)].iter().any(|&n| found(n)) {
                    return;
                }
            }
        }
    }

    fn visit(&mut self, bounds: &Bounds, mut change: impl FnMut(&mut Vec<u32>)) {
        let [columns, rows] = self.spans(bounds);
        for row in rows.0..=rows.1 {
            for column in columns.0..=columns.1 {
                let cell = self.cell(column, row);
                change(&mut self.cells[cell]);
            }
        }
    }

    fn cell(&self, column: i64, row: i64) -> usize {
        let mask = (1 << self.bits) - 1;
        ((row & mask) << self.bits | (column & mask)) as usize
    }

    /// Columns and rows, each square of the torus once.
    fn spans(&self, bounds: &Bounds) -> [(i64, i64); 2] {
        let round = |p: DVec2| (p * self.scale).floor().to_array().map(|x| x as i64);
        let (low, high) = (round(bounds.low), round(bounds.high));
        let once = (1 << self.bits) - 1;
        [0, 1].map(|axis| (low[axis], high[axis].min(low[axis] + once)))
    }
}
