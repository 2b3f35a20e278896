//! Line charts, as SVG.

use anyhow::{Result, anyhow};
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;
use std::ops::Range;

/// Pixels across and down.
const SIZE: (u32, u32) = (520, 340);
/// Most points of a line that are marked.
const MOST_BEADS: usize = 30;
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
    /// Where it is and its value; values that are not above 0 are left out.
    pub points: Vec<(f64, f64)>,
}

/// What runs along the axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axes {
    /// Whole levels, and values by their magnitude.
    Levels,
    /// Something else, of this name, and values from 0 on.
    Along(&'static str),
}

/// A chart; `None` where there is nothing to draw.
pub fn chart(title: &str, axes: Axes, series: &[Series]) -> Result<Option<String>> {
    let points = || series.iter().flat_map(|s| &s.points).filter(|p| p.1 > 0.0);
    let Some(across) = span(points().map(|p| p.0)) else { return Ok(None) };
    let Some(values) = span(points().map(|p| p.1)) else { return Ok(None) };
    let mut svg = String::new();
    let done = match axes {
        Axes::Levels => {
            // Room above for the legend, on the scale of the axis.
            let room = (values.end / values.start).powf(0.65).max(4.0);
            let values = values.start / 1.6..values.end * room;
            let across = across.start - 0.15..across.end + 0.15;
            draw(&mut svg, title, axes, series, across, values.log_scale())
        }
        Axes::Along(_) => draw(&mut svg, title, axes, series, across, 0.0..values.end * 1.15),
    };
    done.map_err(|e| anyhow!("chart `{title}`: {e}"))?;
    Ok(Some(svg))
}

/// Least and greatest value.
fn span(values: impl Iterator<Item = f64>) -> Option<Range<f64>> {
    values.fold(None, |range, v| {
        Some(range.map_or(v..v, |r: Range<f64>| r.start.min(v)..r.end.max(v)))
    })
}

fn draw<Y>(
    svg: &mut String,
    title: &str,
    axes: Axes,
    series: &[Series],
    across: Range<f64>,
    values: Y,
) -> Result<(), Box<dyn std::error::Error>>
where
    Y: AsRangedCoord<Value = f64>,
    Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let text = |size: u32| ("sans-serif", size).into_font().color(&INK);
    let (name, labels, legend) = match axes {
        Axes::Levels => {
            ("level", (across.end - across.start) as usize + 2, SeriesLabelPosition::UpperLeft)
        }
        Axes::Along(name) => (name, 9, SeriesLabelPosition::UpperRight),
    };
    let mut chart = ChartBuilder::on(&area)
        .caption(title, text(16))
        .margin(14)
        .x_label_area_size(34)
        .y_label_area_size(58)
        .build_cartesian_2d(across, values)?;
    let whole = |level: &f64| {
        let near = level.round();
        let shown = axes != Axes::Levels || (level - near).abs() < 1e-6;
        if shown { scaled(*level) } else { String::new() }
    };
    chart
        .configure_mesh()
        .disable_x_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(INK)
        .label_style(text(12))
        .x_desc(name)
        .x_labels(labels)
        .x_label_formatter(&whole)
        .y_label_formatter(&|v| scaled(*v))
        .draw()?;
    for line in series {
        let [r, g, b] = line.colour;
        let colour = RGBColor(r, g, b);
        let style = colour.stroke_width(2);
        let points: Vec<(f64, f64)> = line.points.iter().copied().filter(|p| p.1 > 0.0).collect();
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
        // Beads that would touch are left out.
        if points.len() <= MOST_BEADS {
            chart.draw_series(points.iter().map(|&p| Circle::new(p, 3, colour.filled())))?;
        }
    }
    chart
        .configure_series_labels()
        .position(legend)
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
            points: vec![(4.0, 10.0), (5.0, 0.0), (6.0, 2000.0)],
        };
        for axes in [Axes::Levels, Axes::Along("distance")] {
            let lines = [line("ours", false), line("theirs", true)];
            let svg = chart("Triangles", axes, &lines).unwrap().unwrap();
            assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
            assert!(svg.contains("ours") && svg.contains("theirs") && svg.contains("Triangles"));
            assert_eq!(svg.matches("<circle").count(), 4);
            assert!(chart("nothing", axes, &[]).unwrap().is_none());
        }
    }

    #[test]
    fn labels_are_short() {
        assert_eq!([0.05, 100.0, 12_000.0, 3e6].map(scaled), ["0.05", "100", "12k", "3M"]);
    }
}
