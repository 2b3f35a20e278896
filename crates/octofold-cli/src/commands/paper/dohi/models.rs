//! Models that are broken as those of the web are, and what is known of them.

use octofold::Mesh;
use octofold::samples::Sample;

/// A model with defects that were put in on purpose.
pub struct Model {
    /// Its name, for files too.
    pub name: &'static str,
    /// What is wrong with it.
    pub about: &'static str,
    /// The model.
    pub mesh: Mesh,
    /// Area of the single sheets that it stands for, where that is known.
    pub sheet: Option<f64>,
}

/// All models.
pub fn all() -> Vec<Model> {
    let model = |name, about, mesh, sheet| Model { name, about, mesh, sheet };
    let house = house();
    let area = area(&house);
    vec![
        model(
            "house",
            "the house of the paper: sheets without thickness, and a chimney that pierces the roof",
            house.clone(),
            Some(area),
        ),
        model(
            "house-gaps",
            "the same with every face shrunk by half a percent, so that none meets another",
            shrunk(&house, 0.995),
            Some(area),
        ),
        model(
            "house-flipped",
            "the same with every third face turned over and every fourth one there twice",
            flipped(&house),
            Some(area),
        ),
        model(
            "house-thick",
            "the same with a front and a back to every face, half a percent apart: doubled walls",
            thickened(&house, 0.005),
            Some(area),
        ),
        model("fold", "one sheet, folded by 90 degrees", sheets(&FOLD), Some(0.96)),
        model("t-junction", "a sheet that stands on another one", sheets(&JUNCTION), Some(0.96)),
        model(
            "cross",
            "two sheets through each other, without a common edge",
            sheets(&CROSS),
            Some(1.28),
        ),
        model(
            "plate",
            "a closed plate, a hundredth as thick as it is wide",
            plate(0.008),
            Some(0.64),
        ),
    ]
}

fn house() -> Mesh {
    Sample::House.polygons(1).unwrap_or_default().triangulate()
}

fn area(mesh: &Mesh) -> f64 {
    let area = |t| {
        let [a, b, c] = mesh.corners(t);
        let [u, v]: [[f64; 3]; 2] = [b, c].map(|p| std::array::from_fn(|axis| p[axis] - a[axis]));
        let cross =
            [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        cross.iter().map(|x| x * x).sum::<f64>().sqrt() / 2.0
    };
    (0..mesh.triangles.len()).map(area).sum()
}

/// Triangles without a common point, each drawn to its middle.
fn shrunk(mesh: &Mesh, share: f64) -> Mesh {
    let mut apart = Mesh { attributes: mesh.attributes.clone(), ..Mesh::default() };
    for t in 0..mesh.triangles.len() {
        let corners = mesh.corners(t);
        let middle: [f64; 3] =
            std::array::from_fn(|axis| corners.iter().map(|p| p[axis]).sum::<f64>() / 3.0);
        let first = apart.points.len() as u32;
        apart.points.extend(corners.map(|p| {
            std::array::from_fn::<f64, 3, _>(|axis| middle[axis] + share * (p[axis] - middle[axis]))
        }));
        apart.triangles.push([first, first + 1, first + 2]);
    }
    apart
}

fn flipped(mesh: &Mesh) -> Mesh {
    let mut flipped = mesh.clone();
    for (t, triangle) in flipped.triangles.iter_mut().enumerate().filter(|(t, _)| t % 3 == 0) {
        triangle.swap(t % 2, 2);
    }
    for t in (0..mesh.triangles.len()).step_by(4) {
        flipped.triangles.push(flipped.triangles[t]);
        if let Some(materials) = &mut flipped.attributes.face_materials {
            materials.push(materials[t]);
        }
    }
    flipped
}

/// Every face twice, apart along its normal, the second one turned over.
fn thickened(mesh: &Mesh, apart: f64) -> Mesh {
    let mut thick = shrunk(mesh, 1.0);
    let count = thick.triangles.len();
    for t in 0..count {
        let corners @ [a, b, c] = thick.corners(t);
        let [u, v]: [[f64; 3]; 2] = [b, c].map(|p| std::array::from_fn(|axis| p[axis] - a[axis]));
        let normal =
            [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let first = thick.points.len() as u32;
        thick.points.extend(corners.map(|p| {
            std::array::from_fn::<f64, 3, _>(|axis| p[axis] - apart * normal[axis] / length)
        }));
        thick.triangles.push([first, first + 2, first + 1]);
        if let Some(materials) = &mut thick.attributes.face_materials {
            materials.push(materials[t]);
        }
    }
    thick
}

/// A rectangle by one corner and two sides.
type Rectangle = [[f64; 3]; 3];

const FOLD: [Rectangle; 2] = [
    [[0.1, 0.1, 0.2], [0.6, 0.0, 0.0], [0.0, 0.8, 0.0]],
    [[0.1, 0.1, 0.2], [0.0, 0.8, 0.0], [0.0, 0.0, 0.6]],
];
const JUNCTION: [Rectangle; 2] = [
    [[0.1, 0.1, 0.2], [0.8, 0.0, 0.0], [0.0, 0.8, 0.0]],
    [[0.1, 0.47, 0.2], [0.8, 0.0, 0.0], [0.0, 0.0, 0.4]],
];
const CROSS: [Rectangle; 2] = [
    [[0.1, 0.1, 0.5], [0.8, 0.0, 0.0], [0.0, 0.8, 0.0]],
    [[0.1, 0.5, 0.1], [0.8, 0.0, 0.0], [0.0, 0.0, 0.8]],
];

fn sheets(rectangles: &[Rectangle]) -> Mesh {
    let mut mesh = Mesh::default();
    for &[corner, u, v] in rectangles {
        let first = mesh.points.len() as u32;
        let at =
            |s: f64, t: f64| std::array::from_fn(|axis| corner[axis] + s * u[axis] + t * v[axis]);
        mesh.points.extend([at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]);
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    mesh
}

fn plate(thickness: f64) -> Mesh {
    let cube = Sample::Cube.polygons(1).unwrap_or_default().triangulate();
    let side = |x: f64, size: f64| 0.5 + (x - 0.5) / 0.7 * size;
    cube.map(|[x, y, z]| [side(x, 0.8), side(y, 0.8), side(z, thickness)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_are_sound_data_with_the_area_that_they_tell() {
        for model in all() {
            assert_eq!(model.mesh.check(), Ok(()), "{}", model.name);
            let (own, sheet) = (area(&model.mesh), model.sheet.unwrap());
            let sides = match model.name {
                "house-thick" => 2.0,
                "house-flipped" => own / sheet,
                "plate" => 2.0 + 4.0 * 0.8 * 0.008 / 0.64,
                "house-gaps" => 0.995f64.powi(2),
                _ => 1.0,
            };
            assert!((own / sheet - sides).abs() < 1e-6, "{}: {own} for {sheet}", model.name);
        }
    }
}
