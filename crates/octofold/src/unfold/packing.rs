//! Pieces on pages: each goes to the lowest free place on the first page that has one, the largest
//! pieces first.
//!
//! Free places are told on a raster of square cells, a row of which is a few words of bits. A piece
//! marks every cell that comes within half the gap of it, so that two pieces that share no cell are
//! at least a gap apart.

use super::plane::{Motion, doubled_area, hull};
use super::room::Room;
use crate::run::{Cancelled, Run};
use glam::DVec2;

/// Something to cut out: convex polygons, counter-clockwise.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Item {
    /// The polygons.
    pub parts: Vec<Vec<DVec2>>,
    /// How many turns are tried beside the one that suits the page best.
    pub turns: u32,
}

impl Item {
    /// Its area.
    pub fn area(&self) -> f64 {
        self.parts.iter().map(|p| doubled_area(p)).sum::<f64>() / 2.0
    }
}

/// Where an item goes: its page, counted from 0, and how it moves there.
pub(super) type Spot = (u32, Motion);

/// Side of a cell in millimetres, and the least distance between items.
const CELL: f64 = 1.0;
const GAP: f64 = 1.0;

/// Packs items into rooms of one size. `None` for an item that does not fit an empty room.
pub(super) fn pack(
    items: &[Item],
    room: &Room,
    run: &Run,
) -> Result<(u32, Vec<Option<Spot>>), Cancelled> {
    let mut order: Vec<usize> = (0..items.len()).collect();
    order.sort_by(|&a, &b| items[b].area().total_cmp(&items[a].area()).then(a.cmp(&b)));
    let mut pages: Vec<Raster> = Vec::new();
    let mut spots = vec![None; items.len()];
    for (done, &i) in order.iter().enumerate() {
        run.check()?;
        run.progress(done as u64, items.len() as u64);
        let stamps = stamps(&items[i], room);
        let mut found = None;
        for page in 0..=pages.len() {
            if page == pages.len() {
                pages.push(Raster::empty(room));
            }
            let raster = &pages[page];
            let place = |s: &Stamp| raster.place(s).map(|[x, y]| (y + s.rows.len(), x, y));
            let lowest = stamps
                .iter()
                .enumerate()
                .filter_map(|(k, s)| place(s).map(|(top, x, y)| (top, x, y, k)))
                .min();
            if let Some((_, x, y, k)) = lowest {
                found = Some((page, [x, y], k));
                break;
            }
        }
        match found {
            Some((page, [x, y], k)) => {
                pages[page].add(&stamps[k], [x, y]);
                let corner = DVec2::new(x as f64, y as f64) * CELL;
                let motion = Motion::shift(corner).after(&stamps[k].motion);
                spots[i] = Some((page as u32, motion));
            }
            None => drop(pages.pop()),
        }
    }
    Ok((pages.len() as u32, spots))
}

/// An item turned, as the cells that it takes.
struct Stamp {
    rows: Vec<Vec<u64>>,
    width: usize,
    /// Takes the item to where its cells begin at the origin.
    motion: Motion,
}

/// The cells of a page that are taken.
struct Raster {
    rows: Vec<Vec<u64>>,
    width: usize,
}

fn stamps(item: &Item, room: &Room) -> Vec<Stamp> {
    let mut points: Vec<DVec2> = item.parts.concat();
    let (_, along) = room.best_turn(&hull(&mut points));
    let best = -along.to_angle();
    let turns = 2 * (1 + item.turns);
    let turn = |k: u32| best + std::f64::consts::TAU * f64::from(k) / f64::from(turns);
    (0..turns).map(|k| Stamp::new(item, turn(k))).collect()
}

impl Stamp {
    fn new(item: &Item, angle: f64) -> Self {
        let turn = Motion::turn(angle);
        let parts: Vec<Vec<DVec2>> =
            item.parts.iter().map(|p| p.iter().map(|&q| turn.at(q)).collect()).collect();
        let all = super::plane::Bounds::of(&parts.concat());
        let low = all.low - GAP / 2.0;
        let size = ((all.high - low + GAP / 2.0) / CELL).ceil();
        let (width, height) = (size.x as usize, size.y as usize);
        let mut rows = vec![vec![0u64; width.div_ceil(64)]; height];
        for part in &parts {
            let bounds = super::plane::Bounds::of(part);
            let reach = |y: f64| ((y - low.y) / CELL).floor().max(0.0) as usize;
            let last = reach(bounds.high.y + GAP / 2.0).min(height.saturating_sub(1));
            for row in reach(bounds.low.y - GAP / 2.0)..=last {
                let from = low.y + row as f64 * CELL - GAP / 2.0;
                let Some([left, right]) = extent(part, [from, from + CELL + GAP]) else { continue };
                let cell = |x: f64| ((x - low.x) / CELL).floor().max(0.0) as usize;
                let end = cell(right + GAP / 2.0).min(width.saturating_sub(1));
                for x in cell(left - GAP / 2.0)..=end {
                    rows[row][x / 64] |= 1 << (x % 64);
                }
            }
        }
        Self { rows, width, motion: Motion::shift(-low).after(&turn) }
    }
}

/// How far a convex polygon reaches to the left and right between two heights.
fn extent(part: &[DVec2], [low, high]: [f64; 2]) -> Option<[f64; 2]> {
    let mut found: Option<[f64; 2]> = None;
    let mut add = |x: f64| {
        let [l, r] = found.unwrap_or([x, x]);
        found = Some([l.min(x), r.max(x)]);
    };
    for (i, &p) in part.iter().enumerate() {
        let q = part[(i + 1) % part.len()];
        if (low..=high).contains(&p.y) {
            add(p.x);
        }
        for y in [low, high] {
            if (p.y < y) != (q.y < y) {
                add(p.x + (q.x - p.x) * (y - p.y) / (q.y - p.y));
            }
        }
    }
    found
}

impl Raster {
    fn empty(room: &Room) -> Self {
        // Half a gap and the rounding to cells may stick out: nothing stands beyond the room.
        let size = (room.size / CELL).floor() + 2.0;
        let (width, height) = (size.x as usize, size.y as usize);
        Self { rows: vec![vec![0; width.div_ceil(64) + 1]; height], width }
    }

    /// The lowest free place, the leftmost of these.
    fn place(&self, stamp: &Stamp) -> Option<[usize; 2]> {
        let rows = self.rows.len().checked_sub(stamp.rows.len())?;
        let columns = self.width.checked_sub(stamp.width)?;
        let spots = (0..=rows).flat_map(|y| (0..=columns).map(move |x| [x, y]));
        spots.into_iter().find(|&spot| self.is_free(stamp, spot))
    }

    fn is_free(&self, stamp: &Stamp, [x, y]: [usize; 2]) -> bool {
        let (word, shift) = (x / 64, x % 64);
        stamp.rows.iter().zip(&self.rows[y..]).all(|(own, taken)| {
            own.iter().enumerate().all(|(k, &bits)| {
                let low = bits << shift & taken[word + k];
                let high = if shift > 0 { bits >> (64 - shift) } else { 0 };
                low == 0 && (high == 0 || high & taken[word + k + 1] == 0)
            })
        })
    }

    fn add(&mut self, stamp: &Stamp, [x, y]: [usize; 2]) {
        let (word, shift) = (x / 64, x % 64);
        for (own, taken) in stamp.rows.iter().zip(&mut self.rows[y..]) {
            for (k, &bits) in own.iter().enumerate() {
                taken[word + k] |= bits << shift;
                if shift > 0 && bits >> (64 - shift) != 0 {
                    taken[word + k + 1] |= bits >> (64 - shift);
                }
            }
        }
    }
}
