//! TEL as published (Nishio, Kobori and Kutsuwa 1997): triangulation with edge loops.
//!
//! A historical method, kept to be compared with; it guarantees nothing. An octant at any level
//! gets the closed loop in which the surface crosses its six faces ([`trace`]); the loop becomes a
//! polygon, face by face ([`polyline`]); the polygon is cut into triangles between its own points,
//! by the share of gray voxels along each chord ([`chords`]); and where a gray voxel lies further
//! than one voxel from the triangles, the octant is divided. Cracks between octants of different
//! size are filled in the end ([`crack`]).
//!
//! Voxels are the cells of the lattice: white where all eight samples are outside, black where all
//! are inside, else gray. An octant of n voxels at o is read with the layer behind its high faces,
//! from o to o + n: neighbours share planes of voxels, and points of loops are centres of gray
//! voxels. The paper leaves gaps; the repairs are those of the specification (A.1 to A.6, G1 to
//! G34) that the method cannot run without, listed in `docs/methods.md`.

mod chords;
mod crack;
mod polyline;
mod trace;

use super::account::{OctreeAccount, Rejection};
use super::cubes::CubesOptions;
use super::descent::{Descent, Fate, RingPoint, Sheet, Woven};
use super::digital::DigitalSurface;
use super::prism::Prism;
use crate::mesh::Mesh;
use crate::octree::{CellKey, VertexName};
use crate::run::{Finding, Run};
use crate::volume::{Volume, VolumeError};

/// A voxel, by the low corner of its cell.
type Voxel = [u32; 3];

/// How far a gray voxel's centre may lie from its octant's triangles, in voxels: W in the paper.
const TOLERANCE: f64 = 1.0;

/// Octants of so many voxels are accepted without a test.
const UNTESTED: u32 = 2;

/// Loops of more points are not tried in pairs.
const MOST_POINTS: usize = 30;

/// Extracts the surface of a volume, closed at its border, as a mesh in world coordinates; `open`
/// is not used.
pub fn tel(
    volume: &dyn Volume,
    options: &CubesOptions,
    run: &Run,
) -> Result<(Mesh, OctreeAccount), VolumeError> {
    // White voxels must be seen on both sides of the surface.
    let surface = DigitalSurface::of(volume, options, 1, run)?;
    let descent = Descent::of(&surface, run, |octant| Ok(visit(&surface, octant)))?;
    run.stage("cracks");
    let raw = Woven::new(&descent.triangles())?.tally(run)?;
    let filled = crack::fill(&descent.sheets, surface.levels());
    let woven = Woven::new(&filled.triangles)?;
    let account = OctreeAccount {
        seams: filled.seams,
        unmatched_chains: filled.unmatched_chains,
        points_inserted: filled.points_inserted,
        points_moved: filled.moved.len(),
        closed: woven.tally(run)?,
        ..descent.account(raw)
    };
    let defects = account.closed.defects();
    let left = defects.map_or_else(String::new, |d| format!("; here it leaves {d}"));
    run.finding(Finding::warning(
        "historical-method",
        format!("tel is the method of 1997, kept for comparison and without guarantee{left}"),
    ));
    let position = |v| filled.moved.get(&v).map_or_else(|| surface.position(v), |&at| Ok(at));
    let mesh = woven.mesh(&surface, position, run)?;
    Ok((mesh, account))
}

fn visit(surface: &DigitalSurface, octant: CellKey) -> Fate {
    let size = octant.size(surface.levels());
    let low = octant.corner();
    let high = low.map(|i| i + size);
    if surface.all_between(low, high, |_| false) {
        return Fate::Skipped;
    }
    let loops = trace::loops(surface, low, size);
    if size == 1 {
        let sheets: Vec<Sheet> = loops
            .iter()
            .filter_map(|pieces| {
                let ring = polyline::whole(pieces);
                let triangles = (ring.len() >= 3).then(|| {
                    chords::split(&ring, surface).unwrap_or_else(|| chords::fan(ring.len()))
                })?;
                Some(sheet(octant, &ring, triangles))
            })
            .collect();
        return if sheets.is_empty() { Fate::Skipped } else { Fate::Accepted(sheets) };
    }
    let pieces = match loops.as_slice() {
        [] => return Fate::Divided(Rejection::NoLoop),
        [pieces] => pieces,
        _ => return Fate::Divided(Rejection::SeveralLoops),
    };
    let ring = polyline::simplified(pieces);
    if ring.len() < 3 {
        return Fate::Divided(Rejection::FewPoints);
    }
    if ring.len() > MOST_POINTS {
        return Fate::Divided(Rejection::ManyPoints);
    }
    if polyline::meets_itself(&ring) {
        return Fate::Divided(Rejection::MeetingSides);
    }
    let triangles = match chords::split(&ring, surface) {
        Some(triangles) => triangles,
        None if size <= UNTESTED => chords::fan(ring.len()),
        None => return Fate::Divided(Rejection::NoChord),
    };
    if size > UNTESTED && !is_near(surface, [low, high], &ring, &triangles) {
        return Fate::Divided(Rejection::Distance);
    }
    Fate::Accepted(vec![sheet(octant, &ring, triangles)])
}

/// Whether every gray voxel of an octant lies in the prism round one of the triangles.
fn is_near(
    surface: &DigitalSurface,
    [low, high]: [Voxel; 2],
    ring: &[polyline::Point],
    triangles: &[[u32; 3]],
) -> bool {
    let prisms: Vec<Prism> = triangles
        .iter()
        .filter_map(|t| Prism::new(t.map(|i| ring[i as usize].voxel.map(f64::from)), TOLERANCE))
        .collect();
    surface.all_between(low, high, |cell| {
        let centre = cell.low.map(f64::from);
        prisms.iter().any(|p| p.contains(centre))
    })
}

fn sheet(octant: CellKey, ring: &[polyline::Point], triangles: Vec<[u32; 3]>) -> Sheet {
    let named =
        |p: &polyline::Point| RingPoint { vertex: VertexName::in_cell(p.voxel), face: p.face };
    Sheet { octant, ring: ring.iter().map(named).collect(), triangles }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::Sample;
    use crate::surface::Inside;

    const BELOW: CubesOptions = CubesOptions { iso: 0.0, inside: Inside::Below, open: false };

    fn of(sample: Sample, level: u32) -> (Mesh, OctreeAccount) {
        tel(&sample.volume(1 << level).unwrap(), &BELOW, &Run::default()).unwrap()
    }

    const MASK: CubesOptions = CubesOptions { iso: 0.5, inside: Inside::Above, open: false };

    /// Octants and triangles before cracks are filled, of the prototype with its gaps left open
    /// that do not show on these parts.
    #[test]
    fn counts_are_those_of_the_prototype() {
        for (sample, level, octants, triangles) in [
            (Sample::PartA, 4, 126, 278),
            (Sample::PartA, 5, 125, 334),
            (Sample::PartA, 6, 213, 572),
            (Sample::PartA, 7, 325, 892),
            (Sample::PartC, 6, 259, 623),
            (Sample::PartC, 7, 598, 1393),
            (Sample::PartE, 6, 292, 796),
            (Sample::PartE, 7, 580, 1526),
        ] {
            let (_, found) = of(sample, level);
            let ratios = [
                found.octants as f64 / f64::from(octants),
                found.raw.triangles as f64 / f64::from(triangles),
            ];
            let near = ratios.iter().all(|r| (0.97..1.03).contains(r));
            assert!(near, "{} {level}: {ratios:?}", sample.name());
        }
    }

    /// Its volume tends to the exact one, and no crack is left.
    #[test]
    fn part_a_is_closed() {
        for level in 4..=7 {
            let (mesh, found) = of(Sample::PartA, level);
            assert_eq!((found.closed.defects(), found.closed.euler), (None, 2), "{level}");
            let extent = crate::measure::Extent::of(&mesh, &Run::default()).unwrap();
            let exact = 0.86 * 0.86 * 0.38 + std::f64::consts::PI * 0.28 * 0.28 * 0.48;
            let error = extent.volume / exact - 1.0;
            assert!(error.abs() < 0.8 / f64::from(1 << (level - 2)), "{level}: {error}");
        }
    }

    /// The method as published loses it (G11).
    #[test]
    fn a_single_sample_becomes_a_closed_solid() {
        for at in 0..64 {
            let samples = (0..64).map(|i| u8::from(i == at)).collect();
            let volume = crate::volume::DenseVolume::new([4; 3], samples, Default::default());
            let (mesh, found) = tel(&volume.unwrap(), &MASK, &Run::default()).unwrap();
            assert_eq!((found.closed.defects(), found.closed.euler), (None, 2), "{at}");
            let extent = crate::measure::Extent::of(&mesh, &Run::default()).unwrap();
            assert!(0.1 < extent.volume && extent.volume <= 1.0 + 1e-9, "{at}: {}", extent.volume);
        }
    }

    #[test]
    fn nothing_becomes_nothing() {
        let volume = crate::volume::DenseVolume::new([5; 3], vec![0u8; 125], Default::default());
        let (mesh, found) = tel(&volume.unwrap(), &MASK, &Run::default()).unwrap();
        assert!(mesh.points.is_empty() && found.octants == 0);
    }
}
