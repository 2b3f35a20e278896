//! `octofold net move`: a solid turned, scaled and shifted.

use super::{LayoutArgs, numbers};
use crate::files::{InputArgs, OutputArgs};
use crate::job::{Job, Outcome};
use anyhow::{Result, ensure};
use octofold::Step;
use octofold::network::motion::Motion;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    layout: LayoutArgs,
    /// Turn about an axis, counter-clockwise seen from its tip; several go one after the other
    #[arg(long, value_name = "x|y|z=DEGREES", value_parser = turn)]
    rotate: Vec<Turn>,
    /// Scale before turning, alike along all axes or along each
    #[arg(long, value_name = "S|X,Y,Z", value_parser = factors)]
    scale: Option<Factors>,
    /// Shift afterwards, in units of the world
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<3>, allow_hyphen_values = true)]
    translate: Option<[f64; 3]>,
    /// The point that turning and scaling leave in its place; the middle of the solid unless told
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<3>, allow_hyphen_values = true)]
    about: Option<[f64; 3]>,
}

const AFTER_HELP: &str = "\
A voxel of the result is filled where the voxel that holds its centre's preimage is: there are no
holes, and quarter turns and shifts by whole voxels are exact. Any other motion loses a little: keep
the original, and do not turn what was turned.

Example:
  octofold net move part.ofn turned.ofn --rotate x=90 --rotate z=12.5 --translate 0,0,40";

/// A turn about an axis.
#[derive(Debug, Clone, Copy)]
struct Turn {
    axis: usize,
    degrees: f64,
}

/// A factor for each axis; a type of its own because clap takes an array for a list.
#[derive(Debug, Clone, Copy)]
struct Factors([f64; 3]);

impl Args {
    /// Validates, moves and writes.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let Factors(scale) = self.scale.unwrap_or(Factors([1.0; 3]));
        ensure!(scale.iter().all(|&s| s != 0.0), "--scale by 0 leaves nothing");
        let mut linear: [[f64; 3]; 3] =
            std::array::from_fn(|i| std::array::from_fn(|j| if i == j { scale[i] } else { 0.0 }));
        for turn in &self.rotate {
            linear = linear.map(|column| turn.of(column));
        }
        let shift = self.translate.unwrap_or_default();
        let step = Step::Move(Motion { linear, about: self.about, shift });
        let output = self.output.check()?.in_layout(self.layout.into())?;
        job.convert(&self.input.check()?, vec![step], &output)
    }
}

impl Turn {
    /// A vector after the turn.
    fn of(self, v: [f64; 3]) -> [f64; 3] {
        // Quarter turns are exact.
        let (sin, cos) = match self.degrees.rem_euclid(360.0) {
            0.0 => (0.0, 1.0),
            90.0 => (1.0, 0.0),
            180.0 => (0.0, -1.0),
            270.0 => (-1.0, 0.0),
            degrees => degrees.to_radians().sin_cos(),
        };
        let [a, b] = [(self.axis + 1) % 3, (self.axis + 2) % 3];
        let mut turned = v;
        (turned[a], turned[b]) = (cos * v[a] - sin * v[b], sin * v[a] + cos * v[b]);
        turned
    }
}

fn turn(text: &str) -> Result<Turn, String> {
    let parts = text.split_once('=').and_then(|(axis, degrees)| {
        let axis = ["x", "y", "z"].iter().position(|name| *name == axis)?;
        let degrees = degrees.parse().ok().filter(|d: &f64| d.is_finite())?;
        Some(Turn { axis, degrees })
    });
    parts.ok_or_else(|| "an axis and degrees are asked for, such as z=30".into())
}

fn factors(text: &str) -> Result<Factors, String> {
    let factors = if text.contains(',') { numbers(text) } else { numbers(text).map(|[s]| [s; 3]) };
    factors.map(Factors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_go_counter_clockwise() {
        assert_eq!(turn("z=90").unwrap().of([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
        assert_eq!(turn("x=-270").unwrap().of([0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
        assert_eq!(turn("y=180").unwrap().of([1.0, 2.0, 3.0]), [-1.0, 2.0, -3.0]);
        for bad in ["w=1", "z", "z=", "z=nan"] {
            assert!(turn(bad).is_err(), "{bad}");
        }
        assert_eq!(factors("2").unwrap().0, [2.0; 3]);
        assert_eq!(factors("1,2,-3").unwrap().0, [1.0, 2.0, -3.0]);
        assert!(factors("1,2").is_err());
    }
}
