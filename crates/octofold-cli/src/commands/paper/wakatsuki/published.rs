//! The figures of Wakatsuki et al. 2003, section 4: an SGI VWS320 with a Pentium III at 550 MHz.

use serde::Serialize;

/// The side of the root cube in the paper's unit.
pub const SIDE: f64 = 256.0;
/// The paper's last level: a finest cell is its unit of length.
pub const LEVEL: u32 = 8;
/// Bytes of the model for patches as a share of that for marching cubes: 17 of 28 megabytes.
pub const DATA_SHARE: f64 = 17.0 / 28.0;
/// Seconds of the conversion.
pub const CONVERSION: f64 = 180.0;
/// Milliseconds for drawing the original.
pub const ORIGINAL: f64 = 180.0;

/// Tables 1 and 2 at one distance: first of patches, then of marching cubes with stitched cracks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Row {
    /// From the eye.
    pub distance: f64,
    /// Patches.
    pub patches: f64,
    /// Mean distance from the original.
    pub mean: [f64; 2],
    /// Its standard deviation.
    pub deviation: [f64; 2],
    /// Mean area of a patch.
    pub area: [f64; 2],
    /// Its standard deviation.
    pub area_deviation: [f64; 2],
}

/// All three distances.
pub const ROWS: [Row; 3] = [
    Row {
        distance: 1000.0,
        patches: 24_200.0,
        mean: [0.284, 0.295],
        deviation: [0.228, 2.12],
        area: [6.09, 6.11],
        area_deviation: [4.17, 5.80],
    },
    Row {
        distance: 2000.0,
        patches: 8_600.0,
        mean: [0.424, 0.428],
        deviation: [0.360, 2.33],
        area: [17.1, 17.2],
        area_deviation: [11.0, 15.2],
    },
    Row {
        distance: 4000.0,
        patches: 3_900.0,
        mean: [0.843, 0.834],
        deviation: [0.694, 1.16],
        area: [37.2, 37.6],
        area_deviation: [35.3, 45.1],
    },
];
