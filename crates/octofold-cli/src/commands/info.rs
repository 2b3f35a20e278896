//! `octofold info`: what a file holds, and what is wrong with it.

use crate::files::InputArgs;
use crate::job::{Account, Job, Outcome};
use crate::picture;
use anyhow::Result;
use octofold::report::{Answer, ShapeMeasures};
use serde_json::Value;
use std::path::PathBuf;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(flatten)]
    input: InputArgs,
    /// Also draw it: a mesh from two sides, a volume as slices
    #[arg(long, value_name = "OUT.png")]
    picture: Option<PathBuf>,
}

const AFTER_HELP: &str = "\
Meshes are triangulated, and points at the same position count as one; volumes are read whole.

Examples:
  octofold info bunny.ply
  octofold info brain.nii.gz --picture brain.png
  octofold info head.raw --dims 256x256x113 --dtype u16 --json";

impl Args {
    /// Reads and tells.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let shape = self.input.check()?.open()?.read(&job.run)?;
        let measures = ShapeMeasures::of(&shape, &job.run)?;
        if let Some(path) = &self.picture {
            picture::draw(&shape, path, &job.run)?;
        }
        if !job.json {
            job.answer(&table(&serde_json::to_value(&measures)?))?;
        }
        let answer = Some(Answer::Measures(Box::new(measures.clone())));
        job.finish(Account { answer, input: Some(measures), ..Account::default() })?;
        Ok(Outcome::Holds)
    }
}

/// The entries of an object for people, one a line.
pub fn table(value: &Value) -> String {
    let Value::Object(entries) = value else { return phrase(value) };
    let lines = entries.iter().filter(|(_, v)| !v.is_null()).map(|(key, v)| {
        let key = key.replace('_', " ");
        match v {
            Value::Array(rows) if rows.iter().any(Value::is_object) => {
                let rows: Vec<_> = rows.iter().map(|r| format!("\n  {}", phrase(r))).collect();
                format!("{key}{}", rows.concat())
            }
            _ => format!("{key:<22} {}", phrase(v)),
        }
    });
    lines.collect::<Vec<_>>().join("\n")
}

fn phrase(value: &Value) -> String {
    let list =
        |items: &Vec<Value>, between| items.iter().map(phrase).collect::<Vec<_>>().join(between);
    match value {
        Value::Null => "none".into(),
        Value::Bool(true) => "yes".into(),
        Value::Bool(false) => "no".into(),
        Value::String(text) => text.clone(),
        Value::Number(number) => number.to_string(),
        Value::Array(items) if items.iter().any(Value::is_array) => list(items, "  to  "),
        Value::Array(items) => list(items, ", "),
        Value::Object(entries) => {
            let known = entries.iter().filter(|(_, v)| !v.is_null());
            let pairs = known.map(|(k, v)| format!("{} {}", k.replace('_', " "), phrase(v)));
            pairs.collect::<Vec<_>>().join(", ")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn tables_leave_out_what_does_not_apply() {
        let text = table(&json!({"kind": "mesh", "genus": null, "bounds": [[0, 1], [2, 3]]}));
        assert_eq!(text, "kind                   mesh\nbounds                 0, 1  to  2, 3");
    }

    #[test]
    fn lists_of_objects_stand_on_lines_of_their_own() {
        let text = table(&json!({"values": [{"value": 3, "name": "left"}, {"value": 4}]}));
        assert_eq!(text, "values\n  value 3, name left\n  value 4");
    }
}
