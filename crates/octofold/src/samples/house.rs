//! A house as architects draw it: single sheets that meet or cross, and no solid anywhere.
//!
//! The walls stand open on the ground, the roof overhangs them, and the chimney, open at both
//! ends, pierces the roof. After the test of Dohi et al.

use crate::attributes::Material;
use crate::soup::SoupBuilder;

const WALL: u32 = 0;
const ROOF: u32 = 1;
const BRICK: u32 = 2;
const WOOD: u32 = 3;
const GLASS: u32 = 4;

/// Heights of the ground, the eaves' walls and the ridge.
const GROUND: f64 = 0.06;
const WALL_TOP: f64 = 0.42;
const RIDGE: f64 = 0.74;
/// Outer faces of the walls.
const X: [f64; 2] = [0.2, 0.8];
const Y: [f64; 2] = [0.14, 0.86];
const MIDDLE: f64 = 0.5;

/// Polygons so far and what each is made of.
struct House {
    soup: SoupBuilder,
    materials: Vec<u32>,
}

impl House {
    fn face(&mut self, material: u32, corners: &[[f64; 3]]) {
        let points = &mut self.soup.points;
        let indices: Vec<u32> = corners
            .iter()
            .map(|corner| {
                // Sheets share a point where they have one and the same corner.
                let at = points.iter().position(|p| p == corner).unwrap_or(points.len());
                if at == points.len() {
                    points.push(*corner);
                }
                at as u32
            })
            .collect();
        self.soup.face(&indices);
        self.materials.push(material);
    }
}

/// The polygons, with materials.
pub(super) fn house() -> SoupBuilder {
    let mut house = House { soup: SoupBuilder::default(), materials: Vec::new() };
    front_and_back(&mut house);
    side(&mut house, X[0], false);
    side(&mut house, X[1], true);
    roof(&mut house);
    chimney(&mut house);
    let House { mut soup, materials } = house;
    soup.attributes.face_materials = Some(materials);
    soup.attributes.materials = [
        ("wall", [236, 222, 196]),
        ("roof", [178, 66, 48]),
        ("brick", [126, 74, 60]),
        ("wood", [92, 62, 40]),
        ("glass", [128, 176, 204]),
    ]
    .map(|(name, [r, g, b])| Material { name: name.into(), colour: [r, g, b, 255], texture: None })
    .into();
    soup
}

/// The two gables, the front one around a door.
fn front_and_back(house: &mut House) {
    let [left, right] = X;
    let [front, back] = Y;
    let (jambs, lintel) = ([0.43, 0.57], 0.28);
    let at = |x, z| [x, front, z];
    house.face(
        WALL,
        &[
            at(left, GROUND),
            at(jambs[0], GROUND),
            at(jambs[0], lintel),
            at(jambs[1], lintel),
            at(jambs[1], GROUND),
            at(right, GROUND),
            at(right, WALL_TOP),
            at(MIDDLE, RIDGE),
            at(left, WALL_TOP),
        ],
    );
    house.face(
        WOOD,
        &[at(jambs[0], GROUND), at(jambs[1], GROUND), at(jambs[1], lintel), at(jambs[0], lintel)],
    );
    let at = |x, z| [x, back, z];
    house.face(
        WALL,
        &[
            at(right, GROUND),
            at(left, GROUND),
            at(left, WALL_TOP),
            at(MIDDLE, RIDGE),
            at(right, WALL_TOP),
        ],
    );
}

/// A long wall in two halves, each four frames around a window, so that the wall's ends are whole
/// edges as those of the gables are.
fn side(house: &mut House, x: f64, right: bool) {
    let halves = [([Y[0], MIDDLE], [0.24, 0.40]), ([MIDDLE, Y[1]], [0.60, 0.76])];
    for (wall, window) in halves {
        let ring = |[y0, y1]: [f64; 2], [z0, z1]: [f64; 2]| {
            [[x, y0, z0], [x, y1, z0], [x, y1, z1], [x, y0, z1]]
        };
        let (outer, inner) = (ring(wall, [GROUND, WALL_TOP]), ring(window, [0.18, 0.32]));
        let mut face = |material, mut corners: [[f64; 3]; 4]| {
            if !right {
                corners.reverse();
            }
            house.face(material, &corners);
        };
        for i in 0..4 {
            let j = (i + 1) % 4;
            face(WALL, [outer[i], outer[j], inner[j], inner[i]]);
        }
        face(GLASS, inner);
    }
}

/// Two sheets along the ridge that reach beyond the walls on all sides.
fn roof(house: &mut House) {
    let (overhang, [front, back]) = (0.07, [Y[0] - 0.06, Y[1] + 0.06]);
    let slope = (RIDGE - WALL_TOP) / (MIDDLE - X[0]);
    let eaves = WALL_TOP - slope * overhang;
    let [left, right] = [X[0] - overhang, X[1] + overhang];
    let ridge = [[MIDDLE, front, RIDGE], [MIDDLE, back, RIDGE]];
    house.face(ROOF, &[[left, back, eaves], [left, front, eaves], ridge[0], ridge[1]]);
    house.face(ROOF, &[[right, front, eaves], [right, back, eaves], ridge[1], ridge[0]]);
}

/// Four bricked sheets from under the roof to above the ridge.
fn chimney(house: &mut House) {
    let [x0, x1, y0, y1, low, high] = [0.60, 0.71, 0.56, 0.68, 0.40, 0.90];
    let ring = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
    for i in 0..4 {
        let ([ax, ay], [bx, by]) = (ring[i], ring[(i + 1) % 4]);
        house.face(BRICK, &[[ax, ay, low], [bx, by, low], [bx, by, high], [ax, ay, high]]);
    }
}
