//! The page of the demo: pictures, measures and the commands that make them.

use crate::page::{self, escape};
use serde_json::{Map, Value};
use std::fmt::Write;

/// One way from an input to an output.
pub struct Scene {
    /// Heading.
    pub title: &'static str,
    /// What happens.
    pub text: &'static str,
    /// What went in, what lies between, and what came out.
    pub panels: Vec<Panel>,
    /// Commands that make the same files.
    pub commands: Vec<String>,
}

/// One file.
pub struct Panel {
    /// Its name in the folder.
    pub file: String,
    /// The name of its picture.
    pub picture: String,
    /// Its measures.
    pub measures: Value,
}

/// The whole page.
pub fn html(scenes: &[Scene]) -> String {
    let body: String = scenes.iter().map(scene).collect();
    page::document(
        "Octofold demo",
        &format!(
            "<h1>Octofold</h1>\n<p>Turns a 3D shape from any form into any other useful form, \
             through the octree. Each row below starts from a built-in shape; all files lie beside \
             this page, measured and drawn as read back from disk.</p>\n{body}"
        ),
    )
}

/// Measures that the tables show, in their order.
const ROWS: [&str; 16] = [
    "dims",
    "scalar_type",
    "range",
    "nonzero",
    "points",
    "triangles",
    "components",
    "boundary_edges",
    "nonmanifold_edges",
    "misoriented_edges",
    "duplicate_triangles",
    "self_intersections",
    "closed",
    "manifold",
    "volume",
    "area",
];

fn scene(scene: &Scene) -> String {
    let mut out = String::new();
    let Scene { title, text, panels, commands } = scene;
    let figures: String = panels.iter().map(figure).collect();
    let commands = escape(&commands.join("\n"));
    // Writing to a string does not fail.
    let _ = write!(
        out,
        "<section>\n<h2>{}</h2>\n<p>{}</p>\n<div class=\"panels\">\n{figures}</div>\n{}\
         <pre>{commands}</pre>\n</section>\n",
        escape(title),
        escape(text),
        table(panels),
    );
    out
}

fn figure(panel: &Panel) -> String {
    let (file, picture) = (escape(&panel.file), escape(&panel.picture));
    format!(
        "<figure><img src=\"{picture}\" alt=\"{file}\">\
         <figcaption><a href=\"{file}\">{file}</a></figcaption></figure>\n"
    )
}

/// A row per measure that any panel has, a column per panel.
fn table(panels: &[Panel]) -> String {
    let empty = Map::new();
    let columns: Vec<_> = panels.iter().map(|p| p.measures.as_object().unwrap_or(&empty)).collect();
    let known = |key: &&&str| columns.iter().any(|c| c.get(**key).is_some_and(|v| !v.is_null()));
    let head: String = panels.iter().map(|p| format!("<th>{}</th>", escape(&p.file))).collect();
    let rows: String = ROWS
        .iter()
        .filter(known)
        .map(|key| {
            let cells: String =
                columns.iter().map(|c| format!("<td>{}</td>", cell(c.get(*key)))).collect();
            format!("<tr><th>{}</th>{cells}</tr>\n", key.replace('_', " "))
        })
        .collect();
    format!("<table>\n<tr><th></th>{head}</tr>\n{rows}</table>\n")
}

fn cell(value: Option<&Value>) -> String {
    match value {
        None | Some(Value::Null) => "–".into(),
        Some(Value::Bool(true)) => "yes".into(),
        Some(Value::Bool(false)) => "no".into(),
        Some(Value::String(text)) => escape(text),
        Some(Value::Array(items)) => {
            items.iter().map(|v| cell(Some(v))).collect::<Vec<_>>().join(", ")
        }
        Some(Value::Number(number)) => match number.as_f64() {
            Some(x) if number.is_f64() => format!("{x:.5}"),
            _ => number.to_string(),
        },
        Some(Value::Object(_)) => "…".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_page_shows_every_panel_and_escapes_text() {
        let panel = Panel {
            file: "a&b.ply".into(),
            picture: "a&b.ply.png".into(),
            measures: json!({"closed": true, "volume": 0.25, "genus": null}),
        };
        let scenes =
            [Scene { title: "<t>", text: "x", panels: vec![panel], commands: vec!["run".into()] }];
        let page = html(&scenes);
        assert!(page.contains("&lt;t&gt;") && page.contains("src=\"a&amp;b.ply.png\""));
        assert!(page.contains("<tr><th>closed</th><td>yes</td></tr>"));
        assert!(page.contains("<td>0.25000</td>") && !page.contains("genus"));
        assert!(!page.contains("http"));
    }
}
