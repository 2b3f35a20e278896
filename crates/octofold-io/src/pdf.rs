//! Papercraft sheets as PDF: vector lines in true size, one page a sheet.
//!
//! Lengths are written in millimetres under one scale, in single precision: about 1e-5 mm. Viewers are
//! asked to print without scaling; the ruler on each page tells whether they did.

use crate::drawing::{Drawing, HALO, Layer, Stroke};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use octofold::unfold::Pattern;
use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, TextStr};
use std::io::Write;

/// Points of 1/72 inch in a millimetre.
const POINTS: f64 = 72.0 / 25.4;

/// The bytes of a document.
pub(crate) fn document(
    pattern: &Pattern,
    drawings: &[Drawing],
    title: &str,
) -> std::io::Result<Vec<u8>> {
    let mut pdf = Pdf::new();
    let (catalog, tree, info) = (Ref::new(1), Ref::new(2), Ref::new(3));
    let page_ref = |page: usize| Ref::new(4 + 3 * page as i32);
    let content_ref = |page: usize| Ref::new(5 + 3 * page as i32);
    let print_ref = |page: usize| Ref::new(6 + 3 * page as i32);
    let mut root = pdf.catalog(catalog);
    root.pages(tree);
    root.viewer_preferences().pair(Name(b"PrintScaling"), Name(b"None"));
    root.finish();
    pdf.document_info(info).title(TextStr(title)).producer(TextStr("Octofold"));
    pdf.pages(tree).kids((0..drawings.len()).map(page_ref)).count(drawings.len() as i32);
    let [width, height] = pattern.page.map(|x| (x * POINTS) as f32);
    for (number, drawing) in drawings.iter().enumerate() {
        let mut page = pdf.page(page_ref(number));
        page.parent(tree).media_box(Rect::new(0.0, 0.0, width, height));
        page.contents(content_ref(number));
        if drawing.print.is_some() {
            page.resources().x_objects().pair(PRINT, print_ref(number));
        } else {
            page.resources();
        }
        page.finish();
        let content = packed(&content(drawing, pattern.page))?;
        pdf.stream(content_ref(number), &content).filter(Filter::FlateDecode);
        if let Some(print) = &drawing.print {
            let bytes = packed(&print.rgb)?;
            let mut image = pdf.image_xobject(print_ref(number), &bytes);
            image.filter(Filter::FlateDecode);
            image.width(print.width as i32).height(print.height as i32).bits_per_component(8);
            image.color_space().device_rgb();
        }
    }
    Ok(pdf.finish())
}

/// The name of a page's print.
const PRINT: Name<'static> = Name(b"Print");

fn packed(bytes: &[u8]) -> std::io::Result<Vec<u8>> {
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::default());
    packed.write_all(bytes)?;
    packed.finish()
}

fn content(drawing: &Drawing, page: [f64; 2]) -> Vec<u8> {
    let mut content = Content::new();
    let scale = POINTS as f32;
    content.transform([scale, 0.0, 0.0, scale, 0.0, 0.0]);
    content.set_line_cap(LineCapStyle::RoundCap).set_line_join(LineJoinStyle::RoundJoin);
    if drawing.print.is_some() {
        let [width, height] = page.map(|x| x as f32);
        content.save_state().transform([width, 0.0, 0.0, height, 0.0, 0.0]);
        content.x_object(PRINT).restore_state();
        content.set_stroke_rgb(1.0, 1.0, 1.0).set_line_width(HALO as f32);
        for line in drawing.lines.iter().filter(|line| line.layer == Layer::Label) {
            trace(&mut content, &line.points);
            content.stroke();
        }
    }
    let unit = |c: u8| f32::from(c) / 255.0;
    for fill in &drawing.fills {
        let [r, g, b] = fill.colour.map(unit);
        content.set_fill_rgb(r, g, b);
        trace(&mut content, &fill.points);
        content.close_path().fill_nonzero();
    }
    for layer in Layer::ALL {
        let Stroke { colour, width, dashes } = layer.stroke();
        let [r, g, b] = colour.map(unit);
        content.set_stroke_rgb(r, g, b).set_line_width(width as f32);
        content.set_dash_pattern(dashes.iter().map(|&d| d as f32), 0.0);
        for line in drawing.lines.iter().filter(|line| line.layer == layer) {
            trace(&mut content, &line.points);
            if line.closed {
                content.close_path();
            }
            content.stroke();
        }
    }
    content.finish().to_vec()
}

fn trace(content: &mut Content, points: &[[f64; 2]]) {
    for (i, p) in points.iter().enumerate() {
        let [x, y] = p.map(|x| x as f32);
        if i == 0 {
            content.move_to(x, y);
        } else {
            content.line_to(x, y);
        }
    }
}
