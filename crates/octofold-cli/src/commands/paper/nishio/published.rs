//! The published figures: tables 1 to 3 of Nishio, Kobori and Kutsuwa 1997.
//!
//! Taken on an SGI Indy (R4400, 150 MHz). The part of table 1 is shown in Fig. 11 without
//! dimensions; the products of tables 2 and 3 were converted at level 8.

use octofold::samples::Sample;

/// One row of one method.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Row {
    /// Triangles, counted before cracks are filled.
    pub triangles: u32,
    /// Octants that carry them.
    pub octants: u32,
    /// Time of the conversion.
    pub seconds: f64,
}

const fn row(triangles: u32, octants: u32, seconds: f64) -> Row {
    Row { triangles, octants, seconds }
}

/// Table 1: level, adaptive marching cubes, TEL.
pub const PART: [(u32, Row, Row); 4] = [
    (4, row(424, 216, 0.13), row(133, 56, 0.13)),
    (5, row(1016, 512, 0.35), row(192, 56, 0.29)),
    (6, row(3064, 1536, 1.17), row(268, 80, 0.74)),
    (7, row(5872, 2940, 2.64), row(488, 194, 2.53)),
];

/// Table 2: TEL at level 8.
pub const PRODUCTS: [(Sample, Row); 3] = [
    (Sample::HairDryer, row(1699, 513, 9.06)),
    (Sample::Kettle, row(1415, 403, 11.13)),
    (Sample::TapeCutter, row(1164, 344, 8.29)),
];

/// Table 3: error of the volume against marching cubes in percent, of adaptive marching cubes and
/// of TEL at level 8.
pub const VOLUMES: [(Sample, f64, f64); 3] = [
    (Sample::HairDryer, 0.7908, 0.3119),
    (Sample::Kettle, 0.4524, 0.0307),
    (Sample::TapeCutter, 0.6504, 0.5174),
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Facts that the specification draws from the tables.
    #[test]
    fn the_tables_are_copied_without_a_slip() {
        for (_, amc, tel) in PART {
            assert_eq!(amc.triangles, 2 * amc.octants - 8);
            assert!(tel.triangles > 2 * tel.octants);
        }
        let odd = PRODUCTS.iter().filter(|p| p.1.triangles % 2 == 1).count();
        assert_eq!((odd, PART[0].2.triangles % 2), (2, 1));
    }
}
