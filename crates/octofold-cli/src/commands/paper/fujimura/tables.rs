//! The figures of all trials: means over shapes, growth, and each shape.

use super::super::table::{Table, count, digits};
use super::PUBLISHED;
use super::trial::{Position, Seconds, Trial};
use octofold::network::compress::Reading;
use serde::Serialize;

/// A time, by name.
type Timed = (&'static str, fn(&Seconds) -> Option<f64>);

/// What is timed.
pub const TIMES: [Timed; 5] = [
    ("network", |s| Some(s.network)),
    ("network, compressed", |s| Some(s.network + s.compression)),
    ("octree of runs", |s| Some(s.octree)),
    ("octree of voxels", |s| s.octree_of_voxels),
    ("file, fast", |s| Some(s.fast)),
];

/// Growth is told from here on: coarser grids are but overhead.
const GROWN: usize = 128;

/// The grid whose shapes are told one by one, or the finest below.
const TOLD: usize = 256;

/// Means over the shapes in one position at one resolution.
#[derive(Debug, Clone, Serialize)]
pub struct Mean {
    position: Position,
    resolution: usize,
    reading: Reading,
    /// Planes, edges and voxels as a share of all nodes of the octree.
    of_octree_nodes: f64,
    /// With loops and chains, as a share of its mixed nodes.
    of_octree_items: f64,
    /// Bytes in plain records as a share of an octree without pointers.
    of_octree_bytes: f64,
}

/// How a time grows: like the resolution to the power of `exponent`.
#[derive(Debug, Clone, Serialize)]
pub struct Growth {
    what: &'static str,
    position: Position,
    exponent: f64,
}

/// The mean of a value over the shapes in one position at one resolution.
pub fn mean(
    trials: &[Trial],
    position: Position,
    resolution: usize,
    value: impl Fn(&Trial) -> Option<f64>,
) -> Option<f64> {
    let here = trials.iter().filter(|t| t.position == position && t.resolution == resolution);
    let values: Vec<f64> = here.filter_map(value).collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn resolutions(trials: &[Trial]) -> Vec<usize> {
    let mut found: Vec<usize> = trials.iter().map(|t| t.resolution).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// All means.
pub fn means(trials: &[Trial]) -> Vec<Mean> {
    let mut means = Vec::new();
    for position in Position::ALL {
        for resolution in resolutions(trials) {
            for reading in Reading::ALL {
                let of = |value: fn(&octofold::network::census::Compression) -> f64| {
                    mean(trials, position, resolution, |t| t.compression(reading).map(value))
                };
                let shares = [
                    of(|c| c.of_octree_nodes),
                    of(|c| c.of_octree_items),
                    of(|c| c.of_octree_bytes),
                ];
                let [Some(of_octree_nodes), Some(of_octree_items), Some(of_octree_bytes)] = shares
                else {
                    continue;
                };
                means.push(Mean {
                    position,
                    resolution,
                    reading,
                    of_octree_nodes,
                    of_octree_items,
                    of_octree_bytes,
                });
            }
        }
    }
    means
}

/// How times grow, by a straight line through their logarithms.
pub fn growth(trials: &[Trial]) -> Vec<Growth> {
    let mut found = Vec::new();
    for (what, value) in TIMES {
        for position in Position::ALL {
            let point = |&n: &usize| {
                let seconds = mean(trials, position, n, |t| value(&t.seconds))?;
                Some([(n as f64).ln(), seconds.ln()])
            };
            let grown = resolutions(trials);
            let points: Vec<[f64; 2]> =
                grown.iter().filter(|&&n| n >= GROWN).filter_map(point).collect();
            found.extend(slope(&points).map(|exponent| Growth { what, position, exponent }));
        }
    }
    found
}

/// Slope of the straight line that fits best.
fn slope(points: &[[f64; 2]]) -> Option<f64> {
    let count = points.len() as f64;
    let middle = [0, 1].map(|i| points.iter().map(|p| p[i]).sum::<f64>() / count);
    let product =
        |i: usize| -> f64 { points.iter().map(|p| (p[0] - middle[0]) * (p[i] - middle[i])).sum() };
    (points.len() > 1).then(|| product(1) / product(0))
}

/// All tables.
pub fn all(trials: &[Trial]) -> Vec<Table> {
    let resolutions = resolutions(trials);
    let told = resolutions.iter().copied().filter(|&n| n <= TOLD).max();
    let told = told.or(resolutions.first().copied()).unwrap_or(TOLD);
    let mut tables = vec![shares(trials), times(trials)];
    if !growth(trials).is_empty() {
        tables.push(exponents(trials));
    }
    tables.extend(Position::ALL.map(|position| shapes(trials, position, told)));
    tables.extend(Position::ALL.map(|position| files(trials, position)));
    tables.into_iter().map(Table::without_blanks).collect()
}

fn percent(share: f64) -> String {
    format!("{:.1}", 100.0 * share)
}

fn shares(trials: &[Trial]) -> Table {
    let mut rows = Vec::new();
    let [low, high] = PUBLISHED.map(|share| format!("{:.0}", 100.0 * share));
    let mut published = vec![format!("published: {low} to {high}")];
    published.resize(1 + 3 * Reading::ALL.len(), count::<u8>(None));
    rows.push(published);
    let means = means(trials);
    for position in Position::ALL {
        for resolution in resolutions(trials) {
            let cells = Reading::ALL.into_iter().flat_map(|reading| {
                let found = means.iter().find(|m| {
                    (m.position, m.resolution, m.reading) == (position, resolution, reading)
                });
                let share = |of: fn(&Mean) -> f64| count(found.map(|m| percent(of(m))));
                [
                    share(|m| m.of_octree_nodes),
                    share(|m| m.of_octree_items),
                    share(|m| m.of_octree_bytes),
                ]
            });
            let name = format!("{}, {resolution}", position.name());
            rows.push([name].into_iter().chain(cells).collect());
        }
    }
    let columns = |r: Reading| ["nodes", "items", "bytes"].map(|c| format!("{} {c}", r.name()));
    let head = ["mean over the shapes".to_string()];
    Table {
        caption: "Data in percent of the octree's, by what counts as a link (Fig. 4 of the paper)"
            .into(),
        head: head.into_iter().chain(Reading::ALL.into_iter().flat_map(columns)).collect(),
        rows,
    }
}

fn times(trials: &[Trial]) -> Table {
    let mut rows = Vec::new();
    for position in Position::ALL {
        for resolution in resolutions(trials) {
            let cells = TIMES.map(|(_, value)| {
                count(mean(trials, position, resolution, |t| value(&t.seconds)).map(digits))
            });
            let name = format!("{}, {resolution}", position.name());
            rows.push([name].into_iter().chain(cells).collect());
        }
    }
    let head = ["mean over the shapes"].into_iter().chain(TIMES.map(|t| t.0));
    Table {
        caption: "Seconds, from runs of voxels unless told (Fig. 4 of the paper)".into(),
        head: head.map(String::from).collect(),
        rows,
    }
}

fn exponents(trials: &[Trial]) -> Table {
    let growth = growth(trials);
    let row = |(what, _): (&str, _)| {
        let of = |position: Position| {
            let found = growth.iter().find(|g| (g.what, g.position) == (what, position));
            count(found.map(|g| format!("{:.2}", g.exponent)))
        };
        [what.to_string()].into_iter().chain(Position::ALL.map(of)).collect()
    };
    let head = ["time of"].into_iter().chain(Position::ALL.map(Position::name));
    Table {
        caption: format!("Exponents of growth with the resolution, from {GROWN} on"),
        head: head.map(String::from).collect(),
        rows: TIMES.map(row).to_vec(),
    }
}

fn shapes(trials: &[Trial], position: Position, resolution: usize) -> Table {
    let here = trials.iter().filter(|t| t.position == position && t.resolution == resolution);
    let row = |t: &Trial| {
        let cells = Reading::ALL.into_iter().flat_map(|reading| {
            let found = t.compression(reading);
            let data = found.map(|c| {
                let d = c.data;
                [d.planes, d.edges, d.voxels].map(|n| n.to_string()).join(" / ")
            });
            [count(data), count(found.map(|c| percent(c.of_octree_nodes)))]
        });
        let counts = [t.surface_voxels.to_string(), t.octree.nodes.to_string()];
        [t.shape.name().to_string()].into_iter().chain(counts).chain(cells).collect()
    };
    let head = ["shape", "surface voxels", "octree nodes"].map(String::from);
    let columns =
        |r: Reading| [format!("{}: planes / edges / voxels", r.name()), format!("{} %", r.name())];
    Table {
        caption: format!("Each shape, {}, at {resolution}", position.name()),
        head: head.into_iter().chain(Reading::ALL.into_iter().flat_map(columns)).collect(),
        rows: here.map(row).collect(),
    }
}

fn files(trials: &[Trial], position: Position) -> Table {
    let resolutions = resolutions(trials);
    let bits = |t: &Trial, bytes: usize| 8.0 * bytes as f64 / t.surface_voxels.max(1) as f64;
    let geometric = |n: usize, value: &dyn Fn(&Trial) -> Option<f64>| {
        count(mean(trials, position, n, |t| value(t).map(f64::ln)).map(|m| digits(m.exp())))
    };
    let row = |&n: &usize| {
        vec![
            n.to_string(),
            geometric(n, &|t| Some(bits(t, t.files.fast))),
            geometric(n, &|t| t.files.archive.map(|bytes| bits(t, bytes))),
            geometric(n, &|t| Some(bits(t, t.octree.bytes as usize))),
        ]
    };
    let head = ["resolution", "file, fast", "file, archive", "octree without pointers"];
    Table {
        caption: format!(
            "Bits for each surface voxel, geometric means over the shapes, {}",
            position.name()
        ),
        head: head.map(String::from).to_vec(),
        rows: resolutions.iter().map(row).collect(),
    }
}

/// Every trial in a line.
pub fn csv(trials: &[Trial]) -> String {
    let mut head = "shape,position,resolution,voxels,surface_voxels,octree_mixed,octree_nodes,\
                    octree_bytes,fast_bytes,archive_bytes,network_seconds,compression_seconds,\
                    octree_seconds,octree_of_voxels_seconds,fast_seconds,archive_seconds"
        .to_string();
    for reading in Reading::ALL {
        for column in ["planes", "edges", "voxels", "loops", "chain", "nodes", "items", "bytes"] {
            head += &format!(",{}_{column}", reading.name());
        }
    }
    let blank = |value: Option<String>| value.unwrap_or_default();
    let line = |t: &Trial| {
        let s = t.seconds;
        let mut cells = vec![
            t.shape.name().to_string(),
            t.position.name().to_string(),
            t.resolution.to_string(),
            t.voxels.to_string(),
            t.surface_voxels.to_string(),
            t.octree.mixed.to_string(),
            t.octree.nodes.to_string(),
            t.octree.bytes.to_string(),
            t.files.fast.to_string(),
            blank(t.files.archive.map(|n| n.to_string())),
            s.network.to_string(),
            s.compression.to_string(),
            s.octree.to_string(),
            blank(s.octree_of_voxels.map(|n| n.to_string())),
            s.fast.to_string(),
            blank(s.archive.map(|n| n.to_string())),
        ];
        for c in &t.compressed {
            let d = c.data;
            let data = [d.planes, d.edges, d.voxels, d.loops, d.chain, c.nodes, c.items, c.bytes];
            cells.extend(data.map(|n| n.to_string()));
        }
        cells.join(",")
    };
    let lines: Vec<String> = std::iter::once(head).chain(trials.iter().map(line)).collect();
    lines.join("\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::slope;

    #[test]
    fn a_power_is_found_again() {
        let points: Vec<[f64; 2]> =
            (5..9).map(|i| f64::from(1 << i)).map(|n| [n.ln(), (3.0 * n * n).ln()]).collect();
        assert!((slope(&points).unwrap() - 2.0).abs() < 1e-9);
        assert_eq!(slope(&points[..1]), None);
    }
}
