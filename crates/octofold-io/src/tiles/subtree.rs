//! Subtrees of implicit tiles: which tiles there are, and what is known of each, in a few levels.
//!
//! A subtree file is a head of 24 bytes, JSON, and binary data: bits for tiles in Morton order, level by
//! level, for contents, and for the subtrees below; then a table of errors and boxes of the tiles that
//! there are. Source: OGC 3D Tiles 1.1 (22-025r4), sections 6.4 and 6.5, and 3D Metadata.

use octofold::octree::key::morton;
use serde_json::{Value, json};

/// Levels of one subtree.
pub(super) const LEVELS: u32 = 4;

/// What is told of a tile.
#[derive(Debug, Clone, Copy)]
pub(super) struct Told {
    pub level: u32,
    pub place: [u32; 3],
    pub error: f64,
    /// Middle and half axes.
    pub shape: [f64; 12],
    /// It has content.
    pub shown: bool,
}

impl Told {
    /// Place of the tile's bit in its subtree.
    fn bit(&self) -> usize {
        let level = self.level % LEVELS;
        let place = self.place.map(|x| x & ((1 << level) - 1));
        before(level) + morton(place) as usize
    }

    /// Level and place of the root of its subtree.
    pub fn root(&self) -> (u32, [u32; 3]) {
        let level = self.level % LEVELS;
        (self.level - level, self.place.map(|x| x >> level))
    }
}

/// Octants above a level.
fn before(level: u32) -> usize {
    ((1 << (3 * level)) - 1) / 7
}

/// Bits, the first in the lowest place of the first byte.
struct Bits(Vec<u8>, usize);

impl Bits {
    fn new(count: usize) -> Self {
        Self(vec![0; count.div_ceil(8)], 0)
    }

    fn set(&mut self, bit: usize) {
        self.1 += usize::from(self.0[bit / 8] >> (bit % 8) & 1 == 0);
        self.0[bit / 8] |= 1 << (bit % 8);
    }
}

/// The views of a subtree's data while they grow.
#[derive(Default)]
struct Views {
    views: Vec<Value>,
    data: Vec<u8>,
}

impl Views {
    fn add(&mut self, bytes: &[u8]) -> usize {
        let offset = self.data.len();
        self.views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }));
        self.data.extend(bytes);
        self.data.resize(self.data.len().next_multiple_of(8), 0);
        self.views.len() - 1
    }

    fn bits(&mut self, bits: &Bits) -> Value {
        if bits.1 == 0 {
            return json!({ "constant": 0 });
        }
        json!({ "bitstream": self.add(&bits.0), "availableCount": bits.1 })
    }

    fn numbers<'a>(&mut self, numbers: impl Iterator<Item = &'a f64>) -> usize {
        let bytes: Vec<u8> = numbers.flat_map(|x| x.to_le_bytes()).collect();
        self.add(&bytes)
    }
}

/// A subtree file of these tiles, all of one subtree; `below` are tiles at the roots of subtrees under
/// it.
pub(super) fn file(tiles: &[Told], below: &[Told]) -> Vec<u8> {
    let mut tiles = tiles.to_vec();
    tiles.sort_unstable_by_key(Told::bit);
    let mut there = Bits::new(before(LEVELS));
    let mut shown = Bits::new(before(LEVELS));
    for tile in &tiles {
        there.set(tile.bit());
        if tile.shown {
            shown.set(tile.bit());
        }
    }
    let mut further = Bits::new(1 << (3 * LEVELS));
    for tile in below {
        further.set(morton(tile.place.map(|x| x & ((1 << LEVELS) - 1))) as usize);
    }
    let mut views = Views::default();
    let [there, shown, further] = [there, shown, further].map(|bits| views.bits(&bits));
    let errors = views.numbers(tiles.iter().map(|t| &t.error));
    let boxes = views.numbers(tiles.iter().flat_map(|t| &t.shape));
    let document = json!({
        "buffers": [{ "byteLength": views.data.len() }],
        "bufferViews": views.views,
        "propertyTables": [{
            "class": "tile",
            "count": tiles.len(),
            "properties": { "error": { "values": errors }, "box": { "values": boxes } },
        }],
        "tileAvailability": there,
        "contentAvailability": [shown],
        "childSubtreeAvailability": further,
        "tileMetadata": 0,
    });
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(8), b' ');
    let mut file = b"subt\x01\0\0\0".to_vec();
    file.extend((text.len() as u64).to_le_bytes());
    file.extend((views.data.len() as u64).to_le_bytes());
    file.extend(text);
    file.extend(views.data);
    file
}

/// The schema of what is told of tiles.
pub(super) fn schema() -> Value {
    json!({
        "id": "octofold",
        "classes": { "tile": { "properties": {
            "error": {
                "type": "SCALAR",
                "componentType": "FLOAT64",
                "required": true,
                "semantic": "TILE_GEOMETRIC_ERROR",
            },
            "box": {
                "type": "SCALAR",
                "componentType": "FLOAT64",
                "array": true,
                "count": 12,
                "required": true,
                "semantic": "TILE_BOUNDING_BOX",
            },
        } } },
    })
}
