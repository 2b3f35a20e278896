//! The figures as tables: beside those of the paper, and what must hold.

use super::super::table::{Table, count, digits};
use super::published::{self, ROWS};
use super::trial::{Method, Trial};
use super::{Results, Rules, Sight};

/// All tables.
pub fn all(results: &Results) -> Vec<Table> {
    vec![
        claims(results),
        errors(results),
        areas(results),
        data(results),
        times(results),
        cracks(results),
        following(results),
    ]
}

fn cells<const N: usize>(names: [&str; N]) -> Vec<String> {
    names.map(String::from).into()
}

fn trial(sight: &Sight, method: Method) -> Option<&Trial> {
    sight.trials.iter().find(|t| t.method == method)
}

/// What must hold: its name, what is asked, what was found, and whether that is enough.
fn claims(results: &Results) -> Table {
    let mut rows = Vec::new();
    let mut claim = |name: String, asked: String, found: f64, holds: bool| {
        let holds = if holds { "yes" } else { "no" };
        rows.push(vec![name, asked, digits(found), holds.into()]);
    };
    for sight in &results.sights {
        let (Some(mp), Some(cs)) = (trial(sight, Method::Patches), trial(sight, Method::Stitched))
        else {
            continue;
        };
        let at = format!("at {}, rules {}", sight.distance, sight.rules.name());
        let share = mp.milliseconds / cs.milliseconds;
        claim(format!("time of MP by that of CS, {at}"), "0.5".into(), share, share <= 0.5);
        let share = mp.error.deviation / cs.error.deviation;
        let name = format!("deviation of the error, MP by CS, {at}");
        claim(name, "below 1".into(), share, share < 1.0);
        let asked = match sight.rules {
            Rules::Published => [0.07, 0.22, 0.57],
            Rules::Ours => [0.05, 0.115, 0.215],
        };
        if let Some(row) = ROWS.iter().position(|row| row.distance == sight.distance) {
            let (asked, found) = (asked[row], mp.error.mean);
            claim(format!("mean error of MP, {at}"), digits(asked), found, found <= asked);
        }
        let share = mp.area.deviation / cs.area.deviation;
        let name = format!("deviation of areas, MP by CS, {at}");
        claim(name, "below 1".into(), share, share < 1.0);
    }
    for model in &results.models {
        let rules = model.rules.name();
        let most = digits(published::DATA_SHARE);
        for (what, bytes) in [
            ("twelve crossings an octant", model.cubes_published),
            ("as held", model.cubes_held),
            ("packed", model.cubes_packed),
        ] {
            let share = model.bytes as f64 / bytes as f64;
            let name = format!("data of MP by that of CS, {what}, rules {rules}");
            claim(name, most.clone(), share, share <= published::DATA_SHARE + 0.005);
        }
        let name = format!("seconds of the conversion on a processor, rules {rules}");
        let seconds = model.processor_seconds.unwrap_or(model.seconds);
        claim(name, "0.5".into(), seconds, seconds < 0.5);
    }
    let [mean, ..] = results.following.step_ms;
    claim("milliseconds of a frame at half a degree".into(), "2".into(), mean, mean <= 2.0);
    let whole = results.following.select_ms + results.following.patches_ms;
    let name = "milliseconds from the root down, memory used again".into();
    claim(name, "8".into(), whole, whole <= 8.0);
    Table {
        caption: format!("What must hold (of the bunny; this is {})", results.model),
        head: cells(["claim", "at most", "found", "holds"]),
        rows,
    }
}

/// Rows of one figure of both methods: as published, and found.
fn compared(
    results: &Results,
    caption: &str,
    published: [fn(&published::Row) -> [f64; 2]; 2],
    found: [fn(&Trial) -> f64; 3],
) -> Table {
    let mut rows = Vec::new();
    for row in &ROWS {
        let [means, deviations] = published.map(|of| of(row));
        for (i, name) in ["MP", "CS"].into_iter().enumerate() {
            rows.push(vec![
                format!("{}, {name}, published", row.distance),
                digits(row.patches),
                digits(means[i]),
                digits(deviations[i]),
                count::<u8>(None),
            ]);
        }
        for sight in results.sights.iter().filter(|s| s.distance == row.distance) {
            for trial in &sight.trials {
                let [mean, deviation, max] = found.map(|of| digits(of(trial)));
                let name = trial.method.name();
                rows.push(vec![
                    format!("{}, {name}, rules {}", row.distance, sight.rules.name()),
                    trial.patches.to_string(),
                    mean,
                    deviation,
                    max,
                ]);
            }
        }
    }
    let head = cells(["distance", "patches", "mean", "deviation", "largest"]);
    Table { caption: caption.into(), head, rows }
}

fn errors(results: &Results) -> Table {
    compared(
        results,
        "Table 1: distance of the original along its normals, in finest cells of level 8",
        [|row| row.mean, |row| row.deviation],
        [|t| t.error.mean, |t| t.error.deviation, |t| t.error.max],
    )
}

fn areas(results: &Results) -> Table {
    compared(
        results,
        "Table 2: areas of patches",
        [|row| row.area, |row| row.area_deviation],
        [|t| t.area.mean, |t| t.area.deviation, |t| t.area.max],
    )
}

fn data(results: &Results) -> Table {
    let row = |m: &super::Model| {
        let megabytes = |bytes: usize| digits(bytes as f64 / 1e6);
        vec![
            m.rules.name().into(),
            m.octants.to_string(),
            megabytes(m.bytes),
            megabytes(m.cubes_published),
            megabytes(m.cubes_held),
            megabytes(m.cubes_packed),
            digits(m.processor_seconds.unwrap_or(m.seconds)),
        ]
    };
    let published = ["published", "–", "17", "28", "–", "–"].map(String::from);
    let published = [&published[..], &[digits(published::CONVERSION)]].concat();
    Table {
        caption:
            "Data in megabytes and seconds of the conversion: for CS with twelve crossings an \
                  octant as published, as held here, and with only the crossings that there are"
                .into(),
        head: cells(["rules", "octants", "MP", "CS", "CS held", "CS packed", "s"]),
        rows: [published].into_iter().chain(results.models.iter().map(row)).collect(),
    }
}

fn times(results: &Results) -> Table {
    let row = |t: &super::Timing| {
        vec![
            format!("{}, rules {}", t.distance, t.rules.name()),
            t.patches.to_string(),
            t.cubes.to_string(),
            digits(t.select_ms),
            digits(t.patches_ms),
            digits(t.stitched_ms),
            digits(t.open_ms),
            digits(t.patches_ms / t.stitched_ms),
        ]
    };
    let [original, near] = results.drawing_ms.map(digits);
    Table {
        caption: format!(
            "Fig. 10: milliseconds on one thread, in memory that is used again. Drawing in software \
             takes {original} for the original and {near} for the patches at 1000 (published: {} for \
             the original)",
            published::ORIGINAL
        ),
        head: cells([
            "distance",
            "MP",
            "CS",
            "select ms",
            "MP ms",
            "CS ms",
            "cubes alone ms",
            "MP by CS",
        ]),
        rows: results.timings.iter().map(row).collect(),
    }
}

fn cracks(results: &Results) -> Table {
    let mut rows = Vec::new();
    for sight in &results.sights {
        for trial in &sight.trials {
            let Some(gaps) = &trial.gaps else { continue };
            let name = trial.method.name();
            rows.push(vec![
                format!("{}, {name}, rules {}", sight.distance, sight.rules.name()),
                gaps.count.to_string(),
                digits(gaps.area),
                digits(gaps.largest),
                trial.undecided.to_string(),
            ]);
        }
    }
    Table {
        caption:
            "Cracks that stay open between octants of marching cubes, their area, and octants \
                  that are left out at borders"
                .into(),
        head: cells(["distance", "cracks", "area", "largest", "octants left out"]),
        rows,
    }
}

fn following(results: &Results) -> Table {
    let f = &results.following;
    let [mean, median, slowest] = f.step_ms;
    let rows = [
        ("patches", f.patches as f64),
        ("pixels", f.pixels),
        ("choosing octants, ms", f.select_ms),
        ("making all patches, ms", f.patches_ms),
        ("both, in new memory, ms", f.first_ms),
        ("a frame, mean ms", mean),
        ("a frame, median ms", median),
        ("the slowest frame, ms", slowest),
        ("octants that change in a frame", f.changed),
        ("octants whose patches are made anew", f.remade),
    ];
    Table {
        caption: "An eye that goes round the model by half a degree a frame".into(),
        head: cells(["what", "found"]),
        rows: rows.map(|(name, value)| vec![name.into(), digits(value)]).into(),
    }
}

/// Shares of all patches by the middles of their steps of area, in percent.
pub fn shares(areas: &[u32]) -> Vec<(f64, f64)> {
    let all = f64::from(areas.iter().sum::<u32>()).max(1.0);
    let share = |(i, &n): (usize, &u32)| ((i as f64 + 0.5) / 10.0, 100.0 * f64::from(n) / all);
    areas.iter().enumerate().map(share).collect()
}

/// Every trial in a line.
pub fn csv(results: &Results) -> String {
    let head = "rules,distance,method,octants,patches,triangles,milliseconds,mean_error,\
                deviation_of_error,largest_error,missed,mean_area,deviation_of_area,cracks,\
                area_of_cracks\n";
    let mut text = head.to_string();
    for sight in &results.sights {
        for t in &sight.trials {
            let gaps = t.gaps.map(|g| (g.count.to_string(), g.area.to_string()));
            let (cracks, area) = gaps.unwrap_or_default();
            text += &format!(
                "{},{},{},{},{},{},{},{},{},{},{},{},{},{cracks},{area}\n",
                sight.rules.name(),
                sight.distance,
                t.method.name(),
                sight.octants,
                t.patches,
                t.triangles,
                t.milliseconds,
                t.error.mean,
                t.error.deviation,
                t.error.max,
                t.missed,
                t.area.mean,
                t.area.deviation
            );
        }
    }
    text
}
