//! What is drawn of a pattern, page by page: lines in layers and painted polygons, in millimetres from
//! the lower left corner. All sheet formats draw this.

use crate::lettering::strokes;
use crate::prints::{self, ModelColours, Print};
use octofold::unfold::pattern::{Fold, Pattern, Piece, Spot, Tile, millimetres};
use octofold::{Cancelled, Run};

/// What a line is for, and so which tool it is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Layer {
    /// Scissors or knife.
    Cut,
    /// Fold away from the printed side.
    Mountain,
    /// Fold towards the printed side.
    Valley,
    /// Where a tab begins.
    Tab,
    /// Numbers.
    Label,
    /// The ruler and the number of the page.
    Page,
}

/// How a layer is drawn.
pub(crate) struct Stroke {
    /// Red, green and blue.
    pub colour: [u8; 3],
    /// Width in millimetres.
    pub width: f64,
    /// Lengths of dashes and gaps in millimetres; none for an unbroken line.
    pub dashes: &'static [f64],
}

/// A line through points.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Line {
    pub layer: Layer,
    pub points: Vec<[f64; 2]>,
    pub closed: bool,
}

/// A painted polygon.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Paint {
    pub colour: [u8; 3],
    pub points: Vec<[f64; 2]>,
}

/// One page.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Drawing {
    pub print: Option<Print>,
    pub fills: Vec<Paint>,
    pub lines: Vec<Line>,
}

impl Layer {
    /// All layers, in the order that they are drawn in.
    pub const ALL: [Self; 6] =
        [Self::Page, Self::Tab, Self::Mountain, Self::Valley, Self::Cut, Self::Label];

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cut => "cut",
            Self::Mountain => "score-mountain",
            Self::Valley => "score-valley",
            Self::Tab => "tab",
            Self::Label => "label",
            Self::Page => "page",
        }
    }

    /// How it is drawn.
    pub fn stroke(self) -> Stroke {
        let (colour, width, dashes): (_, _, &[f64]) = match self {
            Self::Cut => ([0, 0, 0], 0.25, &[]),
            Self::Mountain => ([200, 30, 30], 0.18, &[2.0, 1.0]),
            Self::Valley => ([20, 70, 200], 0.18, &[3.0, 0.8, 0.4, 0.8]),
            Self::Tab => ([120, 120, 120], 0.15, &[0.6, 0.6]),
            Self::Label => ([70, 70, 70], 0.13, &[]),
            Self::Page => ([90, 90, 90], 0.15, &[]),
        };
        Stroke { colour, width, dashes }
    }
}

/// Width of the white under numbers on a print, in millimetres.
pub(crate) const HALO: f64 = 0.6;

/// Length of the ruler.
const RULER: f64 = 100.0;

/// Heights of numbers that are tried, the largest first.
const HEIGHTS: [f64; 5] = [2.4, 1.9, 1.5, 1.2, 0.9];

/// The pages of a pattern, in the colours of a model where there are any.
pub(crate) fn pages(
    pattern: &Pattern,
    colours: Option<&ModelColours<'_>>,
    run: &Run,
) -> Result<Vec<Drawing>, Cancelled> {
    let mut pages = lines(pattern);
    if let Some(colours) = colours {
        for (page, print) in pages.iter_mut().zip(prints::prints(pattern, colours, run)?) {
            page.fills.clear();
            page.print = Some(print);
        }
    }
    Ok(pages)
}

fn lines(pattern: &Pattern) -> Vec<Drawing> {
    let mut pages = vec![Drawing::default(); pattern.pages as usize];
    for (number, piece) in (1..).zip(&pattern.pieces) {
        let page = &mut pages[piece.page as usize];
        for (tile, colours) in piece.tiles.iter().zip(std::iter::repeat(&pattern.mesh.colours)) {
            let Some(colours) = colours else { break };
            let points = tile.corners.iter().map(|c| point(c.at)).collect();
            page.fills.push(Paint { colour: colours[tile.face as usize], points });
        }
        draw_piece(page, piece, number);
    }
    for strip in &pattern.strips {
        let page = &mut pages[strip.page as usize];
        page.closed(Layer::Cut, &strip.outline);
        page.open(Layer::Tab, &strip.fold);
        let [a, b] = strip.fold.map(point);
        page.number(
            strip.edge,
            [a, b],
            &strip.outline.iter().map(|&p| point(p)).collect::<Vec<_>>(),
        );
    }
    for (number, page) in (1..).zip(&mut pages) {
        page.frame(pattern, number);
    }
    pages
}

fn draw_piece(page: &mut Drawing, piece: &Piece, number: u32) {
    for outline in piece.outlines() {
        page.closed(Layer::Cut, &outline);
    }
    for crease in piece.creases() {
        let layer = match crease {
            c if c.tab && c.fold.abs() < 1.0 => Layer::Tab,
            c if c.fold > 0.0 => Layer::Mountain,
            _ => Layer::Valley,
        };
        page.open(layer, &crease.ends);
    }
    for tile in &piece.tiles {
        let polygon: Vec<[f64; 2]> = tile.corners.iter().map(|c| point(c.at)).collect();
        for (a, b) in tile.sides().filter(|(a, _)| a.fold == Fold::Seam) {
            page.number(a.edge, [point(a.at), point(b.at)], &polygon);
        }
    }
    page.piece_number(piece, number);
}

impl Drawing {
    fn closed(&mut self, layer: Layer, spots: &[Spot]) {
        let points = spots.iter().map(|&p| point(p)).collect();
        self.lines.push(Line { layer, points, closed: true });
    }

    fn open(&mut self, layer: Layer, spots: &[Spot]) {
        let points = spots.iter().map(|&p| point(p)).collect();
        self.lines.push(Line { layer, points, closed: false });
    }

    /// Writes `number` left of a side, as large as fits into `polygon`.
    fn number(&mut self, number: u32, [a, b]: [[f64; 2]; 2], polygon: &[[f64; 2]]) {
        let mut text = number.to_string();
        // A point tells which way up a number is that makes sense both ways.
        if text.contains(['6', '9']) && text.chars().all(|c| "0689".contains(c)) {
            text.push('.');
        }
        let wide = strokes(&text).1;
        let length = (b[0] - a[0]).hypot(b[1] - a[1]).max(f64::MIN_POSITIVE);
        let along = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
        let place = |height: f64, share: f64| {
            let from = share * length - wide * height / 2.0;
            let up = 0.25 * height + 0.2;
            let at = |x: f64, y: f64| {
                [a[0] + along[0] * x - along[1] * y, a[1] + along[1] * x + along[0] * y]
            };
            let corners = [
                at(from, up),
                at(from + wide * height, up),
                at(from + wide * height, up + height),
                at(from, up + height),
            ];
            (at(from, up), corners)
        };
        let spots = HEIGHTS.iter().flat_map(|&h| [0.5, 0.38, 0.62, 0.27, 0.73].map(|s| (h, s)));
        let fitting = spots.into_iter().find(|&(h, s)| {
            wide * h < 0.9 * length && place(h, s).1.iter().all(|&c| holds(polygon, c))
        });
        let (height, share) = fitting.unwrap_or((0.9, 0.5));
        self.text(&text, place(height, share).0, along, height);
    }

    /// Writes the number of a piece in a circle where there is room.
    fn piece_number(&mut self, piece: &Piece, number: u32) {
        let area = |tile: &Tile| {
            let mut sides = Vec::new();
            for (a, b) in tile.sides() {
                let ([ax, ay], [bx, by]) = (point(a.at), point(b.at));
                sides.push(ax * by - bx * ay);
            }
            sides.iter().sum::<f64>()
        };
        let Some(tile) = piece.tiles.iter().max_by(|a, b| area(a).total_cmp(&area(b))) else {
            return;
        };
        let polygon: Vec<[f64; 2]> = tile.corners.iter().map(|c| point(c.at)).collect();
        let count = polygon.len() as f64;
        let middle = [0, 1].map(|axis| polygon.iter().map(|p| p[axis]).sum::<f64>() / count);
        let text = number.to_string();
        let wide = strokes(&text).1;
        let height = (area(tile) / 2.0).sqrt().clamp(5.0, 30.0) / 6.0;
        let begin = [middle[0] - wide * height / 2.0, middle[1] - height / 2.0];
        self.text(&text, begin, [1.0, 0.0], height);
        let radius = 0.75 * height.max(wide * height) + 0.2;
        let ring = (0..32).map(|k| {
            let angle = std::f64::consts::TAU * f64::from(k) / 32.0;
            [middle[0] + radius * angle.cos(), middle[1] + radius * angle.sin()]
        });
        self.lines.push(Line { layer: Layer::Label, points: ring.collect(), closed: true });
    }

    /// Draws the ruler and the number of the page.
    fn frame(&mut self, pattern: &Pattern, number: u32) {
        let left = 10.0f64.min(pattern.page[0] / 20.0);
        let (low, mark) = (4.0, 1.5);
        if pattern.page[0] >= RULER + 2.0 * left {
            let line = |points: Vec<[f64; 2]>| Line { layer: Layer::Page, points, closed: false };
            self.lines.push(line(vec![[left, low], [left + RULER, low]]));
            for tick in 0..=10 {
                let x = left + f64::from(tick) * RULER / 10.0;
                let up = if tick % 5 == 0 { mark } else { mark / 2.0 };
                self.lines.push(line(vec![[x, low], [x, low + up]]));
            }
            self.lettered("100 mm", [left + RULER + 1.5, low], 2.0, Layer::Page);
        }
        let text = format!("{number}/{}", pattern.pages);
        let wide = 2.5 * strokes(&text).1;
        self.lettered(&text, [pattern.page[0] - left - wide, low], 2.5, Layer::Page);
    }

    pub(crate) fn lettered(&mut self, text: &str, at: [f64; 2], height: f64, layer: Layer) {
        let before = self.lines.len();
        self.text(text, at, [1.0, 0.0], height);
        self.lines[before..].iter_mut().for_each(|line| line.layer = layer);
    }

    fn text(&mut self, text: &str, at: [f64; 2], along: [f64; 2], height: f64) {
        for stroke in strokes(text).0 {
            let place = |[x, y]: [f64; 2]| {
                let (x, y) = (x * height, y * height);
                [at[0] + along[0] * x - along[1] * y, at[1] + along[1] * x + along[0] * y]
            };
            let points = stroke.into_iter().map(place).collect();
            self.lines.push(Line { layer: Layer::Label, points, closed: false });
        }
    }
}

/// True where a point is inside a polygon.
pub(crate) fn holds(polygon: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let sides = polygon.iter().zip(polygon.iter().cycle().skip(1));
    let crossings = sides.filter(|(a, b)| {
        (a[1] > y) != (b[1] > y) && x < a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1])
    });
    crossings.count() % 2 == 1
}

fn point(spot: Spot) -> [f64; 2] {
    spot.map(millimetres)
}
