//! Sheets for cutting machines: what programs such as Cricut Design Space and Silhouette Studio take for
//! strokes of a pen, of a scoring tip and of a blade.
//!
//! These programs tell operations apart by colour, cut whatever they find (dashes one by one, hidden
//! groups as well) and count 72 units to the inch where they do not read the unit. So there is one
//! colour to an operation, unbroken lines, nothing else, and coordinates in points. What is drawn
//! comes first and what is cut comes last, while the paper still holds together.

use crate::drawing::{Drawing, Layer, Line};
use std::fmt::Write;

/// What a machine does, in its order: the name, the colour, and the layers that it stands for.
const OPERATIONS: [(&str, &str, &[Layer]); 4] = [
    ("draw", "#00a000", &[Layer::Label]),
    ("score-mountain", "#ff0000", &[Layer::Mountain, Layer::Tab]),
    ("score-valley", "#0000ff", &[Layer::Valley]),
    ("cut", "#000000", &[Layer::Cut]),
];

/// Points in a millimetre.
const POINTS: f64 = 72.0 / 25.4;

/// Side of the square that shows whether a program has read the unit, in millimetres.
const SQUARE: f64 = 50.0;

/// What of a page a machine works on, in its order.
pub(crate) fn worked(drawing: &Drawing) -> Drawing {
    let of = |layers: &'static [Layer]| {
        let lines = drawing.lines.iter().filter(move |line| layers.contains(&line.layer));
        lines.map(move |line| Line { layer: layers[0], ..line.clone() })
    };
    let lines = OPERATIONS.iter().flat_map(|(_, _, layers)| of(layers)).collect();
    Drawing { lines, ..Drawing::default() }
}

/// A square to cut from scrap first: where it is not as large as it should be, the program scales.
pub(crate) fn square() -> ([f64; 2], Drawing) {
    let (low, high) = (5.0, 5.0 + SQUARE);
    let points = vec![[low, low], [high, low], [high, high], [low, high]];
    let mut drawing = Drawing::default();
    drawing.lines.push(Line { layer: Layer::Cut, points, closed: true });
    drawing.lettered(&format!("{SQUARE} mm"), [15.0, 28.0], 5.0, Layer::Label);
    ([SQUARE + 10.0; 2], worked(&drawing))
}

/// A page of `width` and `height` millimetres as SVG.
pub(crate) fn svg([width, height]: [f64; 2], drawing: &Drawing) -> String {
    let [wide, high] = [width, height].map(|x| format!("{:.4}", x * POINTS));
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{wide}pt\" height=\"{high}pt\" \
         viewBox=\"0 0 {wide} {high}\">\n"
    );
    for (name, colour, layers) in OPERATIONS {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "<g id=\"{name}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"0.5\">"
        );
        for line in drawing.lines.iter().filter(|line| layers.contains(&line.layer)) {
            let point =
                |[x, y]: &[f64; 2]| format!("{:.4},{:.4}", x * POINTS, (height - y) * POINTS);
            let points = line.points.iter().map(point).collect::<Vec<_>>().join(" ");
            let end = if line.closed { "Z" } else { "" };
            let _ = writeln!(text, "<path d=\"M{points}{end}\"/>");
        }
        text.push_str("</g>\n");
    }
    text.push_str("</svg>\n");
    crate::seal::sealed("<!-- ", " -->", &text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_of_fifty_millimetres_is_so_in_points() {
        let (page, drawing) = square();
        let text = svg(page, &drawing);
        let cut = text.split("id=\"cut\"").nth(1).unwrap();
        let path = cut.split("d=\"M").nth(1).unwrap().split('Z').next().unwrap();
        let corner = |k: usize| -> [f64; 2] {
            let mut xy = path.split(' ').nth(k).unwrap().split(',').map(|x| x.parse().unwrap());
            [xy.next().unwrap(), xy.next().unwrap()]
        };
        let side = corner(1)[0] - corner(0)[0];
        assert!((side - 50.0 / 25.4 * 72.0).abs() < 1e-3, "{side}");
        assert!((corner(0)[1] - corner(2)[1] - side).abs() < 1e-3);
    }

    #[test]
    fn machines_get_whole_lines_and_no_ruler() {
        let line = |layer| Line { layer, points: vec![[0.0; 2], [1.0; 2]], closed: false };
        let drawing = Drawing { lines: Layer::ALL.map(line).to_vec(), ..Drawing::default() };
        let worked = worked(&drawing);
        let layers: Vec<Layer> = worked.lines.iter().map(|line| line.layer).collect();
        use Layer::{Cut, Label, Mountain, Valley};
        assert_eq!(layers, [Label, Mountain, Mountain, Valley, Cut]);
        let text = svg([100.0; 2], &worked);
        assert_eq!(text.matches("<path").count(), 5);
        assert!(!text.contains("dash") && !text.contains("display"));
    }
}
