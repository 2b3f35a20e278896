//! Line charts over levels, as SVG.

use anyhow::{Result, anyhow};
use plotters::prelude::*;
use std::ops::Range;

/// Pixels across and down.
const SIZE: (u32, u32) = (520, 340);
const INK: RGBColor = RGBColor(40, 48, 58);
const GRID: RGBColor = RGBColor(226, 230, 235);

/// One line.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// sRGB.
    pub colour: [u8; 3],
    /// Dashed, for figures that are not ours.
    pub published: bool,
    /// Level and value; values that are not above 0 are left out.
    pub points: Vec<(u32, f64)>,
}

/// A chart with a logarithmic axis of values; `None` where there is nothing to draw.
pub fn chart(title: &str, series: &[Series]) -> Result<Option<String>> {
    let points = || series.iter().flat_map(|s| &s.points).filter(|p| p.1 > 0.0);
    let Some(levels) = span(points().map(|p| f64::from(p.0))) else { return Ok(None) };
    let Some(values) = span(points().map(|p| p.1)) else { return Ok(None) };
    let mut svg = String::new();
    draw(&mut svg, title, series, levels, values).map_err(|e| anyhow!("chart `{title}`: {e}"))?;
    Ok(Some(svg))
}

/// Least and greatest value.
fn span(values: impl Iterator<Item = f64>) -> Option<Range<f64>> {
    values.fold(None, |range, v| {
        Some(range.map_or(v..v, |r: Range<f64>| r.start.min(v)..r.end.max(v)))
    })
}

fn draw(
    svg: &mut String,
    title: &str,
    series: &[Series],
    levels: Range<f64>,
    values: Range<f64>,
) -> Result<(), Box<dyn std::error::Error>> {
    let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let text = |size: u32| ("sans-serif", size).into_font().color(&INK);
    // Room above for the legend, on the scale of the axis.
    let room = (values.end / values.start).powf(0.65).max(2.0);
    let values = values.start / 1.6..values.end * room;
    let mut chart = ChartBuilder::on(&area)
        .caption(title, text(16))
        .margin(14)
        .x_label_area_size(34)
        .y_label_area_size(58)
        .build_cartesian_2d(levels.start - 0.15..levels.end + 0.15, values.log_scale())?;
    let whole = |level: &f64| {
        let near = level.round();
        if (level - near).abs() < 1e-6 { format!("{near}") } else { String::new() }
    };
    chart
        .configure_mesh()
        .disable_x_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(INK)
        .label_style(text(12))
        .x_desc("level")
        .x_labels((levels.end - levels.start) as usize + 2)
        .x_label_formatter(&whole)
        .y_label_formatter(&|v| scaled(*v))
        .draw()?;
    for line in series {
        let [r, g, b] = line.colour;
        let colour = RGBColor(r, g, b);
        let style = colour.stroke_width(2);
        let points: Vec<(f64, f64)> =
            line.points.iter().filter(|p| p.1 > 0.0).map(|p| (f64::from(p.0), p.1)).collect();
        let drawn = if line.published {
            chart.draw_series(DashedLineSeries::new(points.iter().copied(), 5, 4, style))?
        } else {
            chart.draw_series(LineSeries::new(points.iter().copied(), style))?
        };
        let dash = line.published;
        drawn.label(&line.name).legend(move |(x, y)| {
            let end = if dash { x + 8 } else { x + 18 };
            PathElement::new([(x, y), (end, y)], style)
        });
        chart.draw_series(points.iter().map(|&p| Circle::new(p, 3, colour.filled())))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .label_font(text(12))
        .background_style(WHITE.mix(0.85))
        .draw()?;
    area.present()?;
    Ok(())
}

/// A value in short: 12k, 3M, 0.05.
fn scaled(value: f64) -> String {
    match value {
        v if v >= 1e6 => format!("{}M", v / 1e6),
        v if v >= 1e3 => format!("{}k", v / 1e3),
        v => format!("{}", (v * 1e6).round() / 1e6),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_series_is_named_and_drawn() {
        let line = |name: &str, published| Series {
            name: name.into(),
            colour: [10, 20, 30],
            published,
            points: vec![(4, 10.0), (5, 0.0), (6, 2000.0)],
        };
        let svg = chart("Triangles", &[line("ours", false), line("theirs", true)]).unwrap();
        let svg = svg.unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        assert!(svg.contains("ours") && svg.contains("theirs") && svg.contains("Triangles"));
        assert_eq!(svg.matches("<circle").count(), 4);
        assert!(chart("nothing", &[]).unwrap().is_none());
    }

    #[test]
    fn labels_are_short() {
        assert_eq!([0.05, 100.0, 12_000.0, 3e6].map(scaled), ["0.05", "100", "12k", "3M"]);
    }
}
