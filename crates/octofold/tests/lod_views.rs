//! What an eye sees of levels of detail: the error in pixels keeps its bound, and nothing jumps when
//! octants are divided or united.
//!
//! Every run takes a few eyes and frames of built-in shapes; `cargo xtask sweep lod-views` takes all,
//! and real models where `OCTOFOLD_DATA` has them.

#![allow(clippy::unwrap_used)]

use octofold::lod::{
    BuildOptions, Criterion, Cut, Diagonal, Drawn, Eye, Lod, Mode, build, drawn, patches,
};
use octofold::measure::Nearest;
use octofold::picture::{Background, Picture, Projection, Shading, Style, View, render};
use octofold::samples::Sample;
use octofold::surface::{Inside, Method, SurfaceOptions, surface};
use octofold::{Mesh, Run};

/// Field of view from the lower to the upper border, in radians, and rows of pixels.
const FOV: f64 = 0.8;
const ROWS: f64 = 480.0;

fn is_sweep() -> bool {
    std::env::var_os("OCTOFOLD_SWEEP").is_some_and(|v| v == "full")
}

fn of_field(sample: Sample, resolution: usize) -> Mesh {
    let options = SurfaceOptions {
        method: Method::Cubes,
        iso: Some(0.0),
        inside: Inside::Below,
        ..SurfaceOptions::default()
    };
    surface(&sample.volume(resolution).unwrap(), &options, &Run::default()).unwrap().mesh
}

/// What of a mesh is on one side of a plane that is askew: its border is ragged.
fn opened(mut mesh: Mesh) -> Mesh {
    let (middle, radius) = ball(&mesh);
    let points = mesh.points.clone();
    let is_kept = |t: &[u32; 3]| {
        let height = |p: u32| dot(add(points[p as usize], middle, -1.0), [0.5, 0.7, 0.4]);
        t.iter().map(|&p| height(p)).sum::<f64>() < 0.4 * radius
    };
    mesh.triangles.retain(is_kept);
    mesh
}

/// Positions and triangles of an OBJ file.
fn of_file(name: &str) -> Option<Mesh> {
    let Some(folder) = std::env::var_os("OCTOFOLD_DATA") else {
        println!("skipped {name}: OCTOFOLD_DATA does not name a folder");
        return None;
    };
    let path = std::path::Path::new(&folder).join(name);
    let Ok(text) = std::fs::read_to_string(&path) else {
        println!("skipped {name}: it is not in OCTOFOLD_DATA");
        return None;
    };
    let mut mesh = Mesh::default();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let at: Vec<f64> = words.map(|w| w.parse().unwrap()).collect();
                mesh.points.push([at[0], at[1], at[2]]);
            }
            Some("f") => {
                let first = |w: &str| w.split('/').next().unwrap().parse::<u32>().unwrap() - 1;
                let corners: Vec<u32> = words.map(first).collect();
                let fan = corners[1..].windows(2).map(|w| [corners[0], w[0], w[1]]);
                mesh.triangles.extend(fan);
            }
            _ => {}
        }
    }
    Some(mesh)
}

/// Numbers from 0 to 1 that are the same in every run.
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn direction(&mut self) -> [f64; 3] {
        loop {
            let v = [0; 3].map(|_| 2.0 * self.roll() - 1.0);
            let length = dot(v, v).sqrt();
            if (0.1..1.0).contains(&length) {
                return v.map(|x| x / length);
            }
        }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

fn add(a: [f64; 3], b: [f64; 3], factor: f64) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + factor * b[i])
}

fn away(a: [f64; 3], b: [f64; 3]) -> f64 {
    let d = add(a, b, -1.0);
    dot(d, d).sqrt()
}

fn built(mesh: &Mesh, level: u32) -> Lod {
    let options = BuildOptions { level, ..BuildOptions::default() };
    build(mesh, &options, &Run::default()).unwrap()
}

fn made(lod: &Lod, cut: &Cut) -> Drawn {
    let run = Run::default();
    let found = patches(lod, cut, Mode::Any, &run).unwrap();
    drawn(lod, cut, &found, Mode::Any, Diagonal::Fixed, &run).unwrap()
}

/// The middle of a mesh, and half its diagonal.
fn ball(mesh: &Mesh) -> ([f64; 3], f64) {
    let [low, high] = mesh.bounds().unwrap();
    (std::array::from_fn(|a| (low[a] + high[a]) / 2.0), away(low, high) / 2.0)
}

/// Whether even the octants without children are as fine as an eye asks.
fn suffices(lod: &Lod, cut: &Cut, eye: &Eye) -> bool {
    cut.places().filter(|&place| cut.is_front(place)).all(|place| {
        let octant = cut.octant(place);
        let half = f64::from(octant.size) / 2.0;
        let middle = lod.world(octant.corner.map(|c| f64::from(c) + half).into());
        let error = lod.error(octant.node) * lod.stretch();
        let nearest = away(middle, eye.position) - half * 3f64.sqrt() * lod.stretch() - error;
        error <= eye.pixels * pixel(eye) * nearest
    })
}

/// The size of a pixel in the corner of a square picture at distance 1.
fn pixel(eye: &Eye) -> f64 {
    let slope = (eye.fov / 2.0).tan();
    2.0 * slope / eye.height / (1.0 + 2.0 * slope * slope)
}

/// How far from each other the samples are that an eye sees of either mesh.
fn worst(
    eye: &Eye,
    trees: [&Nearest; 2],
    (middle, radius): ([f64; 3], f64),
    rays: u32,
    dice: &mut Dice,
) -> Seen {
    let mut all = Seen::default();
    for _ in 0..rays {
        let target = add(middle, dice.direction(), radius * dice.roll());
        let ray = add(target, eye.position, -1.0);
        for (seen, other) in [(0, 1), (1, 0)] {
            let Some(at) = trees[seen].crossing(eye.position, ray, 10.0).filter(|t| *t > 0.0)
            else {
                continue;
            };
            let place = add(eye.position, ray, at);
            let off = trees[other].nearest(place).unwrap().distance_squared.sqrt();
            let share = off / (eye.pixels * pixel(eye) * away(place, eye.position));
            all.most[seen] = all.most[seen].max(share);
            all.over += u32::from(share > 1.0);
            all.samples += 1;
        }
    }
    all
}

/// What samples tell.
#[derive(Default)]
struct Seen {
    samples: u32,
    /// Samples beyond the bound.
    over: u32,
    /// How many times the bound the furthest is off: of the original, and of what is drawn.
    most: [f64; 2],
}

/// For each sample that an eye sees of the original or of what is drawn for it, the other is no
/// further away than the bound at that distance: so silhouettes and depths differ by no more.
#[test]
fn samples_of_both_pictures_are_within_the_bound() {
    let (eyes, rays) = if is_sweep() { (200, 500) } else { (3, 400) };
    let mut models = vec![
        ("torus", Sample::Torus.polygons(60).unwrap().triangulate(), 7),
        ("opened torus", opened(Sample::Torus.polygons(60).unwrap().triangulate()), 7),
        ("kettle", of_field(Sample::Kettle, 48), 6),
        ("gear", of_field(Sample::Gear, 48), 6),
        ("opened gear", opened(of_field(Sample::Gear, 48)), 7),
    ];
    if is_sweep() {
        for name in ["stanford-bunny", "armadillo", "spot"] {
            let file = of_file(&format!("scans/{name}.obj"));
            models.extend(file.map(|mesh| (name, mesh, 8)));
        }
    }
    for (name, mesh, level) in models {
        let lod = built(&mesh, level);
        let (middle, radius) = ball(&mesh);
        let tree = Nearest::new(&mesh);
        let mut dice = Dice(7);
        for pixels in [1.0, 2.0, 4.0] {
            let (mut all, mut triangles) = (Seen::default(), 0);
            for _ in 0..eyes {
                let mut far = radius * (1.2 + 12.0 * dice.roll() * dice.roll());
                let direction = dice.direction();
                // The last level cannot be finer than it is: a nearer eye would ask too much of it.
                let (eye, cut) = loop {
                    let position = add(middle, direction, far);
                    let eye = Eye { position, fov: FOV, height: ROWS, pixels };
                    let cut = Cut::select(&lod, &Criterion::Pixels(eye), &Run::default()).unwrap();
                    if suffices(&lod, &cut, &eye) {
                        break (eye, cut);
                    }
                    far *= 1.2;
                };
                let out = made(&lod, &cut);
                triangles += out.mesh.triangles.len();
                let trees = [&tree, &Nearest::new(&out.mesh)];
                let found = worst(&eye, trees, (middle, radius), rays, &mut dice);
                all.samples += found.samples;
                all.over += found.over;
                all.most = std::array::from_fn(|i| all.most[i].max(found.most[i]));
            }
            let share = f64::from(all.over) / f64::from(all.samples);
            println!(
                "{name}, {pixels} px: {} samples of {eyes} eyes, {} triangles each, {share:.6} beyond \
                 the bound, furthest {:.3} of it from the original and {:.3} to it",
                all.samples,
                triangles / eyes as usize,
                all.most[0],
                all.most[1]
            );
            let most = all.most[0].max(all.most[1]);
            assert!(most <= 1.0, "{name}, {pixels} px: {share} {most}");
        }
    }
}

/// A way round a model and towards it.
fn place(middle: [f64; 3], radius: f64, at: f64) -> [f64; 3] {
    let turn = 0.02 * at;
    let far = radius * (3.0 + 1.6 * (0.031 * at).cos());
    add(middle, [turn.sin() * 0.9, 0.4, turn.cos() * 0.9], far)
}

fn picture(mesh: &Mesh, middle: [f64; 3], eye: &Eye) -> Picture {
    let degrees = 34.0;
    let radius = away(middle, eye.position) * f64::to_radians(degrees / 2.0).sin();
    let half = radius / 3f64.sqrt();
    let view = View {
        size: [160, 128],
        direction: add(middle, eye.position, -1.0),
        up: [0.0, 1.0, 0.0],
        projection: Projection::Perspective { degrees },
        margin: 0.0,
        frame: Some([middle.map(|x| x - half), middle.map(|x| x + half)]),
    };
    let style = Style {
        shading: Shading::Smooth { crease: 180.0 },
        back: None,
        background: Background::Plain([0; 3]),
        ..Style::default()
    };
    render(mesh, &view, &style, &Run::default()).unwrap()
}

#[test]
fn pictures_before_and_after_a_switch_are_the_same() {
    let frames = if is_sweep() { 500 } else { 12 };
    let mesh = of_field(Sample::Kettle, 64);
    let lod = built(&mesh, 6);
    let (middle, radius) = ball(&mesh);
    let eye =
        |at: f64| Eye { position: place(middle, radius, at), fov: 0.6, height: 128.0, pixels: 0.5 };
    let chosen = |at: f64| {
        let mut cut = Cut::default();
        cut.reselect(&lod, &Criterion::Pixels(eye(at)));
        cut
    };
    let (mut switches, mut worst, mut jumps) = (0u32, 0u8, 0u32);
    for frame in 0..frames {
        let (mut at, end) = (f64::from(frame), f64::from(frame + 1));
        let (mut before, last) = (chosen(at), chosen(end));
        while before != last {
            // The next switch on the way, as near as numbers can tell.
            let (mut low, mut high, mut after) = (at, end, last.clone());
            while low + 1e-13 * high < high {
                let between = low + (high - low) / 2.0;
                if between <= low || between >= high {
                    break;
                }
                let cut = chosen(between);
                if cut == before {
                    low = between;
                } else {
                    (high, after) = (between, cut);
                }
            }
            let view = eye(high);
            let [first, second] = [&before, &after].map(|cut| {
                let mut out = made(&lod, cut);
                out.morph(&lod, cut, &view);
                picture(&out.mesh, middle, &view)
            });
            let differences = first.rgba.iter().zip(&second.rgba).map(|(a, b)| a.abs_diff(*b));
            let most = differences.max().unwrap();
            assert!(first.rgba.iter().any(|&c| c != first.rgba[0]), "there is nothing to see");
            worst = worst.max(most);
            jumps += u32::from(most > 1);
            switches += 1;
            (at, before) = (high, after);
        }
    }
    println!("{switches} switches in {frames} frames, {jumps} seen, largest difference {worst}");
    assert!(switches > 0 && worst <= 1, "{jumps} of {switches} switches, {worst}");
}
