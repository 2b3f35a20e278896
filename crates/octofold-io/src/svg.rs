//! Papercraft sheets as SVG, one file a page, in millimetres.
//!
//! What is drawn stands in one layer for each tool (cut, fold, label). A hidden group holds the net
//! in numbers of eight decimals, so that anyone can check it: faces with their edges and folds, tabs
//! and strips. The mesh that it folds into is written beside it as OBJ.

use crate::drawing::{Drawing, HALO, Layer, Stroke};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use octofold::unfold::pattern::{Fold, Pattern, STEPS, Spot, Tile, steps};
use std::fmt::Write;

/// The text of page `page` of a pattern.
pub(crate) fn page(pattern: &Pattern, drawing: &Drawing, page: u32) -> String {
    let [width, height] = pattern.page.map(|x| decimals(steps(x)));
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" \
         xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" \
         width=\"{width}mm\" height=\"{height}mm\" viewBox=\"0 0 {width} {height}\">\n"
    );
    let flip = |[x, y]: [f64; 2]| [x, pattern.page[1] - y];
    if !drawing.fills.is_empty() {
        open(&mut text, "image", "");
        for fill in &drawing.fills {
            let [r, g, b] = fill.colour;
            let points = short(&fill.points.iter().map(|&p| flip(p)).collect::<Vec<_>>());
            line(
                &mut text,
                format_args!(
                    "<path d=\"M{points}Z\" fill=\"#{r:02x}{g:02x}{b:02x}\" stroke=\"#{r:02x}{g:02x}{b:02x}\" stroke-width=\"0.05\"/>"
                ),
            );
        }
        line(&mut text, format_args!("</g>"));
    }
    if let Some(print) = &drawing.print {
        // A picture that cannot be encoded is none: its size is that of the page.
        let png = crate::png::encode_rgb(print.width as u32, print.height as u32, &print.rgb);
        let png = STANDARD.encode(png.unwrap_or_default());
        open(&mut text, "image", "");
        line(
            &mut text,
            format_args!(
                "<image x=\"0\" y=\"0\" width=\"{width}\" height=\"{height}\" \
                 preserveAspectRatio=\"none\" href=\"data:image/png;base64,{png}\"/>"
            ),
        );
        line(&mut text, format_args!("</g>"));
        let halo = format!(
            " fill=\"none\" stroke=\"#ffffff\" stroke-width=\"{HALO}\" stroke-linejoin=\"round\" \
             stroke-linecap=\"round\""
        );
        open(&mut text, "halo", &halo);
        for own in drawing.lines.iter().filter(|line| line.layer == Layer::Label) {
            let points = short(&own.points.iter().map(|&p| flip(p)).collect::<Vec<_>>());
            line(&mut text, format_args!("<path d=\"M{points}\"/>"));
        }
        line(&mut text, format_args!("</g>"));
    }
    for layer in Layer::ALL {
        let Stroke { colour: [r, g, b], width, dashes } = layer.stroke();
        let dashes = dashes.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        let dashes = match dashes.as_str() {
            "" => String::new(),
            dashes => format!(" stroke-dasharray=\"{dashes}\""),
        };
        let style = format!(
            " fill=\"none\" stroke=\"#{r:02x}{g:02x}{b:02x}\" stroke-width=\"{width}\" \
             stroke-linejoin=\"round\" stroke-linecap=\"round\"{dashes}"
        );
        open(&mut text, layer.name(), &style);
        for own in drawing.lines.iter().filter(|line| line.layer == layer) {
            let points = short(&own.points.iter().map(|&p| flip(p)).collect::<Vec<_>>());
            let end = if own.closed { "Z" } else { "" };
            line(&mut text, format_args!("<path d=\"M{points}{end}\"/>"));
        }
        line(&mut text, format_args!("</g>"));
    }
    net(&mut text, pattern, page);
    text.push_str("</svg>\n");
    crate::seal::sealed("<!-- ", " -->", &text)
}

/// The hidden group with the net in numbers.
fn net(text: &mut String, pattern: &Pattern, page: u32) {
    let height = steps(pattern.page[1]);
    let points = |spots: &mut dyn Iterator<Item = Spot>| {
        let point = |[x, y]: Spot| format!("{},{}", decimals(x), decimals(height - y));
        spots.map(point).collect::<Vec<_>>().join(" ")
    };
    line(text, format_args!("<g id=\"net\" display=\"none\">"));
    for (number, piece) in (1..).zip(&pattern.pieces).filter(|(_, piece)| piece.page == page) {
        for tile in &piece.tiles {
            let Tile { face, corners } = tile;
            let list = |word: &dyn Fn(usize) -> String| {
                (0..corners.len()).map(word).collect::<Vec<_>>().join(" ")
            };
            let vertices = list(&|i| corners[i].point.to_string());
            let edges = list(&|i| corners[i].edge.to_string());
            let folds = list(&|i| match corners[i].fold {
                Fold::Hinge(degrees) => format!("{degrees:.8}"),
                Fold::Seam => "cut".into(),
                Fold::Border => "free".into(),
            });
            let spots = points(&mut corners.iter().map(|c| c.at));
            line(
                text,
                format_args!(
                    "<polygon class=\"face\" data-face=\"{face}\" data-piece=\"{number}\" \
                     data-vertices=\"{vertices}\" data-edges=\"{edges}\" data-folds=\"{folds}\" \
                     points=\"{spots}\"/>"
                ),
            );
        }
        for tab in &piece.tabs {
            let spots = points(&mut tab.outline.iter().copied());
            line(
                text,
                format_args!(
                    "<polygon class=\"tab\" data-piece=\"{number}\" data-edge=\"{}\" \
                     points=\"{spots}\"/>",
                    tab.edge
                ),
            );
        }
    }
    for strip in pattern.strips.iter().filter(|strip| strip.page == page) {
        let spots = points(&mut strip.outline.iter().copied());
        line(
            text,
            format_args!(
                "<polygon class=\"strip\" data-edge=\"{}\" points=\"{spots}\"/>",
                strip.edge
            ),
        );
    }
    line(text, format_args!("</g>"));
}

fn open(text: &mut String, name: &str, style: &str) {
    line(
        text,
        format_args!(
            "<g id=\"{name}\" inkscape:groupmode=\"layer\" inkscape:label=\"{name}\"{style}>"
        ),
    );
}

fn line(text: &mut String, arguments: std::fmt::Arguments<'_>) {
    // Writing to a string cannot fail.
    let _ = text.write_fmt(arguments);
    text.push('\n');
}

/// Points with the four decimals that a plotter can make use of.
fn short(points: &[[f64; 2]]) -> String {
    points.iter().map(|[x, y]| format!("{x:.4},{y:.4}")).collect::<Vec<_>>().join(" ")
}

/// Steps as millimetres, every decimal of them.
fn decimals(steps: i64) -> String {
    let (whole, rest) = (steps.unsigned_abs() / STEPS as u64, steps.unsigned_abs() % STEPS as u64);
    let sign = if steps < 0 { "-" } else { "" };
    if rest == 0 { format!("{sign}{whole}") } else { format!("{sign}{whole}.{rest:08}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_written_whole() {
        let texts = [0, 210 * STEPS, 1, -1, -150_000_000].map(decimals);
        assert_eq!(texts, ["0", "210", "0.00000001", "-0.00000001", "-1.50000000"]);
    }
}
