//! The figures of all trials as tables: as the paper has them, and what it does not tell.

use super::super::table::{Table, count, digits};
use super::{PARTS, PRODUCTS, Trial, published};
use octofold::samples::Sample;
use octofold::surface::{Certificate, Method};

/// A figure that charts show over levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Curve {
    /// Triangles before cracks are filled.
    Triangles,
    /// Octants.
    Octants,
    /// Time.
    Seconds,
}

/// What charts show, with their titles.
pub const CURVES: [(Curve, &str); 3] =
    [(Curve::Triangles, "Triangles"), (Curve::Octants, "Octants"), (Curve::Seconds, "Seconds")];

impl Curve {
    /// Its name in file names.
    pub fn name(self) -> &'static str {
        match self {
            Self::Triangles => "triangles",
            Self::Octants => "octants",
            Self::Seconds => "seconds",
        }
    }

    /// The value of one trial, where its method has one.
    pub fn value(self, trial: &Trial) -> Option<f64> {
        match self {
            Self::Triangles => Some(trial.triangles() as f64),
            Self::Octants => trial.octants().map(|n| n as f64),
            Self::Seconds => Some(trial.seconds),
        }
    }

    /// The published value.
    pub fn published(self, row: published::Row) -> f64 {
        match self {
            Self::Triangles => row.triangles.into(),
            Self::Octants => row.octants.into(),
            Self::Seconds => row.seconds,
        }
    }
}

/// The level of the paper's products.
const PRODUCT_LEVEL: u32 = 8;

/// All tables.
pub fn all(trials: &[Trial]) -> Vec<Table> {
    let level = trials.iter().map(|t| t.level).filter(|&l| l <= PRODUCT_LEVEL).max();
    let level = level.or_else(|| trials.iter().map(|t| t.level).min()).unwrap_or(PRODUCT_LEVEL);
    let tables = [
        parts(trials),
        products(trials, level),
        volumes(trials, level),
        octants(trials),
        defects(trials),
    ];
    tables.map(Table::without_blanks).into()
}

fn find(trials: &[Trial], shape: Sample, level: u32, method: Method) -> Option<&Trial> {
    trials.iter().find(|t| t.shape == shape && t.level == level && t.method == method)
}

/// Levels that were asked for.
fn levels(trials: &[Trial]) -> Vec<u32> {
    let mut levels: Vec<u32> = trials.iter().map(|t| t.level).collect();
    levels.sort_unstable();
    levels.dedup();
    levels
}

/// Columns for each method; those that it has nothing to tell in are left out.
const COLUMNS: [&str; 4] = ["triangles", "raw triangles", "octants", "s"];

fn conversion_head(first: &str) -> Vec<String> {
    let columns = |m: Method| COLUMNS.map(|column| format!("{} {column}", m.name()));
    [first.to_string()].into_iter().chain(Method::ALL.into_iter().flat_map(columns)).collect()
}

fn conversion_row(name: String, trials: &[Trial], shape: Sample, level: u32) -> Vec<String> {
    let columns = |method: Method| match find(trials, shape, level, method) {
        None => COLUMNS.map(|_| count::<u8>(None)),
        Some(t) => [
            t.triangles().to_string(),
            count(t.octant_triangles()),
            count(t.octants()),
            digits(t.seconds),
        ],
    };
    [name].into_iter().chain(Method::ALL.into_iter().flat_map(columns)).collect()
}

/// The same columns, filled from the paper.
fn published_row(name: String, of: impl Fn(Method) -> Option<published::Row>) -> Vec<String> {
    let columns = |method: Method| match of(method) {
        None => COLUMNS.map(|_| count::<u8>(None)),
        Some(row) => [
            row.triangles.to_string(),
            count::<u8>(None),
            row.octants.to_string(),
            digits(row.seconds),
        ],
    };
    [name].into_iter().chain(Method::ALL.into_iter().flat_map(columns)).collect()
}

fn parts(trials: &[Trial]) -> Table {
    let mut rows = Vec::new();
    for level in levels(trials) {
        if let Some(&(_, amc, tel)) = published::PART.iter().find(|row| row.0 == level) {
            rows.push(published_row(format!("level {level}, published"), |method| match method {
                Method::Adaptive => Some(amc),
                Method::Tel => Some(tel),
                _ => None,
            }));
        }
        for shape in PARTS {
            rows.push(conversion_row(
                format!("level {level}, {}", shape.name()),
                trials,
                shape,
                level,
            ));
        }
    }
    let caption = "Experiment 1: a machine part (table 1 of the paper)".into();
    Table { caption, head: conversion_head("part"), rows }
}

fn products(trials: &[Trial], level: u32) -> Table {
    let mut rows = Vec::new();
    for (shape, row) in published::PRODUCTS {
        let name = format!("{}, published, level {PRODUCT_LEVEL}", shape.name());
        rows.push(published_row(name, |method| (method == Method::Tel).then_some(row)));
        rows.push(conversion_row(format!("{}, level {level}", shape.name()), trials, shape, level));
    }
    let caption = "Experiment 2: products (table 2 of the paper)".into();
    Table { caption, head: conversion_head("product"), rows }
}

fn volumes(trials: &[Trial], level: u32) -> Table {
    let others = || Method::ALL.into_iter().filter(|&m| m != Method::Cubes);
    let mut rows = Vec::new();
    for (shape, amc, tel) in published::VOLUMES {
        let known = |method: Method| match method {
            Method::Adaptive => format!("{amc:.4}"),
            Method::Tel => format!("{tel:.4}"),
            _ => count::<u8>(None),
        };
        let name = format!("{}, published, level {PRODUCT_LEVEL}", shape.name());
        let known = |method| [known(method), count::<u8>(None)];
        rows.push([name].into_iter().chain(others().flat_map(known)).collect());
        let measured = |method: Method| {
            let found = find(trials, shape, level, method);
            let errors =
                [found.and_then(|t| t.volume_error), found.and_then(|t| t.octant_volume_error)];
            errors.map(|error| count(error.map(|e| format!("{e:+.4}"))))
        };
        let name = format!("{}, level {level}", shape.name());
        rows.push([name].into_iter().chain(others().flat_map(measured)).collect());
    }
    let columns = |m: Method| [m.name().to_string(), format!("{} raw", m.name())];
    let head = ["product".to_string()].into_iter().chain(others().flat_map(columns));
    let caption =
        "Experiment 3: volume against marching cubes in percent (table 3 of the paper); raw is \
                   before the collapse, which evens the volume"
            .into();
    Table { caption, head: head.collect(), rows }
}

/// Octants of certified TEL.
fn octants(trials: &[Trial]) -> Table {
    let certified = || trials.iter().filter_map(|t| Some((t, t.certificate()?)));
    let sizes = certified().map(|(_, c)| c.octants.len()).max().unwrap_or(0);
    let row = |(t, c): (&Trial, &Certificate)| {
        let of_size = |size: usize| c.octants.get(size).copied().unwrap_or(0).to_string();
        let name = format!("{}, level {}", t.shape.name(), t.level);
        let raw = [count(t.octants()), c.octant_triangles.to_string()];
        [name].into_iter().chain(raw).chain((0..sizes).map(of_size)).collect()
    };
    let head = ["shape", "octants", "raw triangles"].map(String::from);
    let size = |size: usize| format!("of {}", 1u64 << size);
    Table {
        caption:
            "Octants of ctel, their triangles before the collapse, and how many octants there \
                  are of each size in cells"
                .into(),
        head: head.into_iter().chain((0..sizes).map(size)).collect(),
        rows: certified().map(row).collect(),
    }
}

fn defects(trials: &[Trial]) -> Table {
    let columns = |m: Method| {
        ["triangles", "defects", "Euler"].map(|column| format!("{} {column}", m.name()))
    };
    let head = ["shape".to_string()].into_iter().chain(Method::ALL.into_iter().flat_map(columns));
    let mut rows = Vec::new();
    for shape in PARTS.into_iter().chain(PRODUCTS) {
        for level in levels(trials) {
            let cells = |method: Method| {
                let found = find(trials, shape, level, method).map(|t| &t.measures);
                let defects = found.map(|m| {
                    let defects = [m.boundary_edges, m.nonmanifold_edges, m.self_intersections];
                    defects.map(|n| n.to_string()).join(" / ")
                });
                [count(found.map(|m| m.triangles)), count(defects), count(found.map(|m| m.euler))]
            };
            let name = format!("{}, level {level}", shape.name());
            rows.push([name].into_iter().chain(Method::ALL.into_iter().flat_map(cells)).collect());
        }
    }
    let caption =
        "After cracks are filled: triangles, defects (edges with one triangle / edges with \
                   more than two / pairs of triangles that meet), Euler number"
            .into();
    Table { caption, head: head.collect(), rows }
}

/// Every trial in a line.
pub fn csv(trials: &[Trial]) -> String {
    let head = "shape,level,method,octants,triangles_before_filling,triangles,points,\
                boundary_edges,nonmanifold_edges,self_intersections,euler,volume,\
                volume_error_percent,seconds,octants_by_size,triangles_before_collapse,\
                volume_error_before_collapse_percent\n";
    let line = |t: &Trial| {
        let m = &t.measures;
        let blank = |text: Option<String>| text.unwrap_or_default();
        format!(
            "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n",
            t.shape.name(),
            t.level,
            t.method.name(),
            blank(t.octants().map(|n| n.to_string())),
            t.triangles(),
            m.triangles,
            m.points,
            m.boundary_edges,
            m.nonmanifold_edges,
            m.self_intersections,
            m.euler,
            t.volume,
            blank(t.volume_error.map(|e| e.to_string())),
            t.seconds,
            blank(t.certificate().map(|c| spaced(&c.octants))),
            blank(t.octant_triangles().map(|n| n.to_string())),
            blank(t.octant_volume_error.map(|e| e.to_string()))
        )
    };
    trials.iter().map(line).fold(head.to_string(), |text, line| text + &line)
}

fn spaced(numbers: &[u64]) -> String {
    numbers.iter().map(u64::to_string).collect::<Vec<_>>().join(" ")
}
