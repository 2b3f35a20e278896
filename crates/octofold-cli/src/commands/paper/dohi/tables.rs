//! The figures of all trials as tables.

use super::super::table::{Table, count, digits};
use super::{Mode, Repaired, Trial};

/// All tables.
pub fn all(trials: &[Trial]) -> Vec<Table> {
    vec![inputs(trials), repairs(trials), papers(trials)]
}

fn cells(names: &[&str]) -> Vec<String> {
    names.iter().map(ToString::to_string).collect()
}

fn inputs(trials: &[Trial]) -> Table {
    let row = |t: &Trial| {
        let m = &t.input;
        let counts = [
            m.triangles,
            m.components,
            m.boundary_edges,
            m.nonmanifold_edges,
            m.misoriented_edges,
            m.duplicate_triangles,
            m.self_intersections,
        ];
        [t.model.to_string()].into_iter().chain(counts.map(|n| n.to_string())).collect()
    };
    Table {
        caption: "The models as they came".into(),
        head: cells(&[
            "model",
            "triangles",
            "parts",
            "open edges",
            "edges of three or more",
            "misoriented edges",
            "repeated triangles",
            "pairs that meet",
        ]),
        rows: trials.iter().map(row).collect(),
    }
}

/// Name of a row for one mode.
fn named(trial: &Trial, repaired: &Repaired) -> String {
    format!("{}, {}", trial.model, repaired.mode.name())
}

fn repairs(trials: &[Trial]) -> Table {
    let row = |t: &Trial, r: &Repaired| {
        let sheets = r.account.sheets.as_ref();
        let m = &r.measures;
        vec![
            named(t, r),
            m.triangles.to_string(),
            count(r.area.map(|area| format!("{area:.3}"))),
            count(sheets.map(|s| s.patches)),
            m.boundary_edges.to_string(),
            m.nonmanifold_edges.to_string(),
            // Nothing summed up is -0.
            count(sheets.map(|s| digits(s.junction_length + 0.0))),
            m.self_intersections.to_string(),
            m.closed.to_string(),
            digits(r.seconds),
        ]
    };
    let rows = trials.iter().flat_map(|t| t.repaired.iter().map(move |r| row(t, r)));
    Table {
        caption:
            "Repaired: closed, to sheets as published (dohi), and to sheets by our rule. Area is \
                  a share of that of the sheets that the model stands for: doubled walls are 2"
                .into(),
        head: cells(&[
            "model, mode",
            "triangles",
            "area",
            "patches",
            "open edges",
            "edges of three or more",
            "junctions",
            "pairs that meet",
            "closed",
            "s",
        ]),
        rows: rows.collect(),
    }
}

fn papers(trials: &[Trial]) -> Table {
    let row = |t: &Trial| {
        let (u, p) = (&t.paper.unfold, &t.paper);
        vec![
            t.model.to_string(),
            u.faces.to_string(),
            count(p.area.map(|area| format!("{area:.3}"))),
            u.pieces.to_string(),
            u.pages.to_string(),
            u.seams.to_string(),
            u.strips.to_string(),
            format!("{:.1e}", p.refolded),
            digits(p.seconds),
        ]
    };
    Table {
        caption:
            "On paper, 150 mm long on A4; folded again is how far a corner is off at most, in mm"
                .into(),
        head: cells(&[
            "model",
            "faces",
            "area",
            "pieces",
            "pages",
            "seams",
            "strips",
            "folded again",
            "s",
        ]),
        rows: trials.iter().map(row).collect(),
    }
}

/// Every repair in a line, with what its model came to on paper beside our sheets.
pub fn csv(trials: &[Trial]) -> String {
    let head = "model,mode,triangles,area_share,patches,boundary_edges,nonmanifold_edges,\
                junction_length,self_intersections,closed,seconds,paper_faces,paper_area_share,pieces,\
                pages,seams,strips,refold_error_mm,paper_seconds\n";
    let blank = |text: Option<String>| text.unwrap_or_default();
    let line = |t: &Trial, r: &Repaired| {
        let (m, sheets, p) = (&r.measures, r.account.sheets.as_ref(), &t.paper);
        let paper = if r.mode == Mode::Sheets {
            format!(
                "{},{},{},{},{},{},{},{}",
                p.unfold.faces,
                blank(p.area.map(|a| a.to_string())),
                p.unfold.pieces,
                p.unfold.pages,
                p.unfold.seams,
                p.unfold.strips,
                p.refolded,
                p.seconds
            )
        } else {
            ",".repeat(7)
        };
        format!(
            "{},{},{},{},{},{},{},{},{},{},{},{paper}\n",
            t.model,
            r.mode.name(),
            m.triangles,
            blank(r.area.map(|a| a.to_string())),
            blank(sheets.map(|s| s.patches.to_string())),
            m.boundary_edges,
            m.nonmanifold_edges,
            blank(sheets.map(|s| (s.junction_length + 0.0).to_string())),
            m.self_intersections,
            m.closed,
            r.seconds
        )
    };
    let lines = trials.iter().flat_map(|t| t.repaired.iter().map(move |r| line(t, r)));
    lines.fold(head.to_string(), |text, line| text + &line)
}
