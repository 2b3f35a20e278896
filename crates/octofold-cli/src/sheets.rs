//! Sheets of paper as commands take them: how they are laid out, and the files that they go to.

use crate::files::Input;
use anyhow::{Context, Result, ensure};
use octofold::picture::{Background, Shading, Style, View, render};
use octofold::unfold::{self, MOST_EFFORT, Pattern, Scale, UnfoldAccount, UnfoldOptions, Up};
use octofold::{Mesh, Run};
use octofold_io::{Cover, Dress, ModelColours, SheetFormat, write_sheets};
use std::path::{Path, PathBuf};

/// What names sheets, as typed.
#[derive(Debug, clap::Args)]
pub struct SheetOutputArgs {
    /// File to write, its format by its ending: pdf, svg, dxf or fold
    #[arg(value_name = "OUT")]
    output: PathBuf,
    /// For a cutting machine (Cricut, Silhouette): svg or dxf with one colour to an operation, unbroken
    /// lines, 72 units to the inch, nothing hidden, and a square of 50 mm to try it with
    #[arg(long)]
    cutter: bool,
}

/// Where sheets go.
pub struct SheetOutput {
    path: PathBuf,
    format: SheetFormat,
    cutter: bool,
}

/// How sheets are laid out, as typed.
#[derive(Debug, clap::Args)]
pub struct SheetArgs {
    /// Longest side of the model's box [default: 150mm]
    #[arg(long, value_name = "LENGTH", value_parser = parse_length, group = "scaling")]
    size: Option<f64>,
    /// Height of the model
    #[arg(long, value_name = "LENGTH", value_parser = parse_length, group = "scaling")]
    height: Option<f64>,
    /// Millimetres on paper for each unit of the model
    #[arg(long, value_name = "S", group = "scaling")]
    scale: Option<f64>,
    /// Axis along which the model stands: y in glTF and OBJ, z in other formats
    #[arg(long, value_enum, value_name = "AXIS")]
    up: Option<UpArg>,
    /// Page: a3, a4, a5, letter, legal, tabloid, with -landscape if wide, or WIDTHxHEIGHT
    #[arg(long, value_name = "PAGE", default_value = "a4", value_parser = parse_page)]
    page: Page,
    /// Left free at each side of a page
    #[arg(long, value_name = "LENGTH", default_value = "10mm", value_parser = parse_length)]
    margin: f64,
    /// Height of the tabs
    #[arg(long, value_name = "LENGTH", default_value = "5mm", value_parser = parse_length)]
    tab: f64,
    /// Thickness of the paper or card: closed parts keep their size outside
    #[arg(long, value_name = "LENGTH", default_value = "0mm", value_parser = parse_length)]
    thickness: f64,
    /// How long to look for fewer pieces; each step doubles the number of tries [default: unfold 3,
    /// craft 1]
    #[arg(long, value_name = "N",
        value_parser = clap::value_parser!(u32).range(0..=i64::from(MOST_EFFORT)))]
    effort: Option<u32>,
    /// Where the random numbers begin: the same seed gives the same sheets
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// Width and height; a type of its own because clap takes an array for a list.
#[derive(Debug, Clone, Copy)]
struct Page([f64; 2]);

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum UpArg {
    X,
    Y,
    Z,
}

impl SheetOutputArgs {
    /// Where sheets of `input` go, or why that makes no sense.
    pub fn check(self, input: &Input) -> Result<SheetOutput> {
        let path = self.output;
        let name = path.display().to_string();
        let format = SheetFormat::of_name(&name).with_context(|| {
            let known = SheetFormat::ALL.map(SheetFormat::name).join(", ");
            format!("{name}: the name does not tell a format of sheets: {known}")
        })?;
        ensure!(
            !self.cutter || matches!(format, SheetFormat::Svg | SheetFormat::Dxf),
            "{name}: cutting machines take svg or dxf: choose one of these with --cutter"
        );
        if format == SheetFormat::Svg {
            let beside = path.with_extension("obj");
            let same = |a: &Path, b: &Path| match (a.canonicalize(), b.canonicalize()) {
                (Ok(a), Ok(b)) => a == b,
                _ => false,
            };
            ensure!(
                !same(input.path(), &beside),
                "{name}: the unfolded model would be written over the input {}: choose another name",
                beside.display()
            );
        }
        Ok(SheetOutput { path, format, cutter: self.cutter })
    }
}

impl SheetOutput {
    /// Writes sheets, printed in the colours of the model that they fold into.
    pub fn write(&self, pattern: &Pattern, model: &Mesh, up: Up, run: &Run) -> Result<()> {
        let colours = ModelColours::new(model);
        let cover = match self.format {
            SheetFormat::Pdf => Some(cover(pattern, model, colours.as_ref(), up, run)?),
            _ => None,
        };
        run.stage("write");
        let dress = Dress { colours, cover, cutter: self.cutter };
        Ok(write_sheets(pattern, &dress, &self.path, self.format, run)?)
    }

    /// What was written, in a line.
    pub fn line(&self, account: &UnfoldAccount, seconds: f64) -> String {
        let count = |n: usize, one: &str| format!("{n} {one}{}", if n == 1 { "" } else { "s" });
        format!(
            "{}: {}, {}, {}, {} ({} with loose strips), {seconds:.2} s",
            self.path.display(),
            count(account.faces, "face"),
            count(account.pieces, "piece"),
            count(account.pages as usize, "page"),
            count(account.seams, "seam"),
            account.strips,
        )
    }
}

/// Pictures of a model and of its pieces.
fn cover(
    pattern: &Pattern,
    model: &Mesh,
    colours: Option<&ModelColours<'_>>,
    up: Up,
    run: &Run,
) -> Result<Cover> {
    let palette = Cover::palette(pattern.pieces.len());
    let mut pieces = pattern.folded().mesh;
    let labels = pieces.attributes.face_labels.take().unwrap_or_default();
    let colour = |&label: &u32| {
        let [r, g, b] = palette[label as usize - 1];
        [r, g, b, 255]
    };
    pieces.attributes.face_colours = Some(labels.iter().map(colour).collect());
    let style = Style {
        shading: Shading::Flat,
        back: None,
        background: Background::Plain([255; 3]),
        ..Style::default()
    };
    let [width, height] = Cover::picture_size(pattern.page);
    let view = View::default().sized(width, height);
    let view = if up == Up::Y { view.y_up() } else { view };
    let painted = colours.map(ModelColours::painted);
    let pictures = [
        render(painted.as_ref().unwrap_or(model), &view, &style, run)?,
        render(&pieces, &view, &Style { boundary: Some(Style::INK), ..style }, run)?,
    ];
    Ok(Cover { pictures, colours: palette })
}

impl SheetArgs {
    /// True where the model's size was not named.
    pub fn is_free(&self) -> bool {
        self.scale.is_none() && self.height.is_none() && self.size.is_none()
    }

    /// The options of a model that stands along y, or along z; looking for pieces takes `effort`
    /// where that is not named.
    pub fn options(&self, stands_along_y: bool, effort: u32) -> UnfoldOptions {
        let scale = match (self.scale, self.height, self.size) {
            (Some(factor), _, _) => Scale::Factor(factor),
            (_, Some(height), _) => Scale::Height(height),
            (_, _, size) => Scale::Size(size.unwrap_or(150.0)),
        };
        let up = match self.up {
            Some(UpArg::X) => Up::X,
            Some(UpArg::Y) => Up::Y,
            Some(UpArg::Z) => Up::Z,
            None if stands_along_y => Up::Y,
            None => Up::Z,
        };
        UnfoldOptions {
            scale,
            up,
            page: self.page.0,
            margin: self.margin,
            tab: self.tab,
            thickness: self.thickness,
            effort: self.effort.unwrap_or(effort),
            seed: self.seed,
            ..UnfoldOptions::default()
        }
    }
}

/// A length in millimetres, with or without a unit.
pub fn parse_length(text: &str) -> Result<f64, String> {
    let units = [("mm", 1.0), ("cm", 10.0), ("in", 25.4), ("m", 1000.0)];
    let (number, unit) = units
        .iter()
        .find_map(|&(unit, size)| Some((text.strip_suffix(unit)?, size)))
        .unwrap_or((text, 1.0));
    match number.trim().parse::<f64>() {
        Ok(x) if x.is_finite() && x >= 0.0 => Ok(x * unit),
        _ => Err("a length is asked for, such as 180mm, 18cm or 7in".into()),
    }
}

fn parse_page(text: &str) -> Result<Page, String> {
    let lower = text.to_ascii_lowercase();
    let (name, wide) = match lower.strip_suffix("-landscape") {
        Some(name) => (name, true),
        None => (lower.as_str(), false),
    };
    let [width, height] = match name {
        "a3" => [297.0, 420.0],
        "a4" => unfold::A4,
        "a5" => [148.0, 210.0],
        "letter" => [215.9, 279.4],
        "legal" => [215.9, 355.6],
        "tabloid" => [279.4, 431.8],
        size => {
            let sides = size.split_once('x').ok_or("a page is asked for, such as a4 or 297x420")?;
            [parse_length(sides.0)?, parse_length(sides.1)?]
        }
    };
    Ok(Page(if wide { [height, width] } else { [width, height] }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_units() {
        let lengths = ["180", "180mm", "18 cm", "1m"].map(|t| parse_length(t).unwrap());
        assert_eq!(lengths, [180.0, 180.0, 180.0, 1000.0]);
        assert_eq!(parse_length("2in").unwrap(), 50.8);
        for bad in ["", "mm", "-1", "inf", "1ft", "NaN"] {
            assert!(parse_length(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn pages_have_names_or_sizes() {
        assert_eq!(parse_page("A4").unwrap().0, [210.0, 297.0]);
        assert_eq!(parse_page("letter-landscape").unwrap().0, [279.4, 215.9]);
        assert_eq!(parse_page("30cmx12in").unwrap().0, [300.0, 12.0 * 25.4]);
        assert!(parse_page("b5").is_err() && parse_page("10x").is_err());
    }
}
