//! Papercraft sheets as DXF R12, for cutters: polylines in millimetres, a layer for each tool.

use crate::drawing::{Drawing, Layer, Stroke};
use std::fmt::Write;

/// The text of a page.
pub(crate) fn page(drawing: &Drawing) -> String {
    let mut text = String::new();
    groups(&mut text, "0 SECTION 2 HEADER 9 $ACADVER 1 AC1009 9 $MEASUREMENT 70 1 0 ENDSEC");
    groups(&mut text, "0 SECTION 2 TABLES 0 TABLE 2 LTYPE 70 1 0 LTYPE 2 CONTINUOUS 70 64");
    // The line type's description is empty, which is a line of its own.
    text.push_str("3\n\n");
    groups(&mut text, "72 65 73 0 40 0.0 0 ENDTAB 0 TABLE 2 LAYER 70 6");
    for layer in Layer::ALL {
        let (name, colour) = (name(layer), colour(layer));
        groups(&mut text, &format!("0 LAYER 2 {name} 70 0 62 {colour} 6 CONTINUOUS"));
    }
    groups(&mut text, "0 ENDTAB 0 ENDSEC 0 SECTION 2 ENTITIES");
    for line in &drawing.lines {
        let (name, closed) = (name(line.layer), u8::from(line.closed));
        if let ([a, b], false) = (&line.points[..], line.closed) {
            groups(&mut text, &format!("0 LINE 8 {name}"));
            point(&mut text, 0, a);
            point(&mut text, 1, b);
            continue;
        }
        groups(&mut text, &format!("0 POLYLINE 8 {name} 66 1 70 {closed}"));
        point(&mut text, 0, &[0.0; 2]);
        for p in &line.points {
            groups(&mut text, &format!("0 VERTEX 8 {name}"));
            point(&mut text, 0, p);
        }
        groups(&mut text, &format!("0 SEQEND 8 {name}"));
    }
    groups(&mut text, "0 ENDSEC 0 EOF");
    crate::seal::sealed("999\n", "", &text)
}

/// Writes pairs of a code and a value, each on a line of its own.
fn groups(text: &mut String, pairs: &str) {
    for word in pairs.split(' ') {
        text.push_str(word);
        text.push('\n');
    }
}

/// Writes the coordinates of the first or second point of an entity.
fn point(text: &mut String, place: u8, [x, y]: &[f64; 2]) {
    // Writing to a string cannot fail.
    let _ = write!(text, "1{place}\n{x:.6}\n2{place}\n{y:.6}\n3{place}\n0.0\n");
}

fn name(layer: Layer) -> &'static str {
    match layer {
        Layer::Cut => "CUT",
        Layer::Mountain => "MOUNTAIN",
        Layer::Valley => "VALLEY",
        Layer::Tab => "TAB",
        Layer::Label => "ENGRAVE",
        Layer::Page => "PAGE",
    }
}

/// The nearest of AutoCAD's first seven colours.
fn colour(layer: Layer) -> u8 {
    const COLOURS: [[u8; 3]; 7] = [
        [255, 0, 0],
        [255, 255, 0],
        [0, 255, 0],
        [0, 255, 255],
        [0, 0, 255],
        [255, 0, 255],
        [0, 0, 0],
    ];
    let Stroke { colour, .. } = layer.stroke();
    let far = |c: &[u8; 3]| -> u32 {
        c.iter().zip(colour).map(|(a, b)| u32::from(a.abs_diff(b)).pow(2)).sum()
    };
    (1..).zip(&COLOURS).min_by_key(|(_, c)| far(c)).map_or(7, |(number, _)| number)
}
