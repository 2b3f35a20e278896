//! Unfolding: a mesh becomes pieces of paper that fold and glue back into it.
//!
//! Triangles in one plane become one face ([`UnfoldOptions::flatness`] bounds how far points move for
//! that). Each connected part is laid out as a tree of faces in which no two lie on one another: a
//! tabu search finds one piece for almost every part, and cuts what it cannot. Pieces that do not
//! fit the page are bitten apart. Tabs, loose hinges and places on pages follow; at last a proof in
//! whole numbers makes sure that nothing on a page lies on anything else, or there is no result.
//!
//! Any mesh will do: open or closed, with any number of faces at an edge, in several parts, with one
//! side only. Where a face ends at others that go on, it is cut and glued there.
//!
//! Sources: Dohi, Mitani, Nishihara and Fukui, the paper end of it; Zawallich and Pajarola 2024;
//! Schlickenrieder 1997; Straub and Prautzsch 2011; specification of papercraft (C2 to C4, E).

mod division;
mod edges;
mod facets;
mod flatten;
mod folded;
mod grid;
mod hanging;
mod hinges;
mod inset;
mod opening;
mod orientation;
mod packing;
mod patch;
pub mod pattern;
mod pieces;
mod plane;
mod proof;
mod regions;
mod room;
mod seams;
mod search;
mod sets;
mod sheets;
mod tabs;
mod tabu;
mod tour;
mod trees;

pub use flatten::{FlattenAccount, FlattenOptions, Flattened, flatten};
pub use folded::Folded;
pub use pattern::Pattern;

use crate::attributes::Attributes;
use crate::measure::sew;
use crate::mesh::{Mesh, bounds};
use crate::run::{Cancelled, Finding, Run};
use division::Division;
use edges::Edges;
use facets::{Facet, Facets, gathered};
use glam::DVec2;
use hinges::Hinges;
use packing::Item;
use patch::Patch;
use plane::{Bounds, Motion, hull};
use regions::{Flatness, Regions};
use room::Room;
use tabs::{Placed, TabSize};

/// How large the model is made.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// Millimetres on paper for each unit of the mesh.
    Factor(f64),
    /// The model's height, in millimetres.
    Height(f64),
    /// The longest side of the model's box, in millimetres.
    Size(f64),
}

/// The axis along which a model stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum Up {
    X,
    Y,
    Z,
}

/// How a mesh is unfolded. Lengths are in millimetres on paper.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct UnfoldOptions {
    /// How large the model is.
    pub scale: Scale,
    /// Along which axis its height is measured.
    pub up: Up,
    /// Width and height of a page.
    pub page: [f64; 2],
    /// Left free at each side of a page.
    pub margin: f64,
    /// Height of the tabs.
    pub tab: f64,
    /// How far points may move so that faces become flat.
    pub flatness: f64,
    /// Thickness of the paper: what is folded is the middle of the sheet, so that closed parts keep
    /// their size outside.
    pub thickness: f64,
    /// Faces that are larger than a page are cut across, where all faces together are no larger than
    /// [`MOST_PAGES`]; else they are refused.
    pub divide: bool,
    /// How long to look for fewer pieces: each step doubles the number of tries.
    pub effort: u32,
    /// Where the random numbers begin.
    pub seed: u64,
}

/// Width and height of an A4 page in millimetres.
pub const A4: [f64; 2] = [210.0, 297.0];

impl Default for UnfoldOptions {
    fn default() -> Self {
        Self {
            scale: Scale::Size(150.0),
            up: Up::Z,
            page: A4,
            margin: 10.0,
            tab: 5.0,
            flatness: 0.01,
            thickness: 0.0,
            divide: true,
            effort: 3,
            seed: 1,
        }
    }
}

/// The largest [`UnfoldOptions::effort`].
pub const MOST_EFFORT: u32 = 10;

/// Faces that are unfolded at most.
pub const MOST_FACES: usize = 10_000;

/// Pages that all faces together may be as large as where some are cut across.
pub const MOST_PAGES: f64 = 1000.0;

/// Why a mesh could not be unfolded.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum UnfoldError {
    /// There is nothing to unfold.
    #[error("there are no faces to unfold")]
    Empty,
    /// More faces than anybody would fold.
    #[error("{0} faces are more than the {MOST_FACES} that are unfolded: simplify the model first")]
    TooMany(usize),
    /// A length makes no sense.
    #[error("{name} is {value} mm: choose a number {bounds}")]
    Length {
        /// The option.
        name: &'static str,
        /// What it is.
        value: f64,
        /// What it may be.
        bounds: &'static str,
    },
    /// The model has no extent in the direction that is to be scaled.
    #[error("the model has no height to scale: name a scale or a size instead")]
    Flat,
    /// A face is larger than a page.
    #[error(
        "a face is {width:.0} x {height:.0} mm and the page has room for {room_width:.0} x \
         {room_height:.0} mm: choose a smaller scale or a larger page"
    )]
    LargeFace {
        /// Width of the face.
        width: f64,
        /// Its height.
        height: f64,
        /// Width that is left between the margins and tabs.
        room_width: f64,
        /// Height that is left.
        room_height: f64,
    },
    /// The result is not what it should be, which is a fault of this program.
    #[error("page {page} would have parts on one another near {x:.3}, {y:.3} mm")]
    Overlap {
        /// The page, counted from 1.
        page: u32,
        /// Where, from the left.
        x: f64,
        /// Where, from the bottom.
        y: f64,
    },
    /// The work was interrupted.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What unfolding tells of its own work. Lengths are in millimetres on paper.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct UnfoldAccount {
    /// Millimetres for each unit of the mesh.
    pub scale: f64,
    /// Triangles that were unfolded.
    pub triangles: usize,
    /// Flat faces that they became.
    pub faces: usize,
    /// Cuts across faces that were larger than a page.
    pub divided: u32,
    /// Parts of the model that hang together by hinges.
    pub parts: usize,
    /// Pieces before any was cut to fit the page.
    pub pieces_unlimited: usize,
    /// Pieces to cut out.
    pub pieces: usize,
    /// Pages.
    pub pages: u32,
    /// Share of the pages' room that is covered.
    pub filled: f64,
    /// Joints to glue.
    pub seams: usize,
    /// Joints without a printed tab, which have a loose strip.
    pub strips: usize,
    /// Length of all joints.
    pub seam_length: f64,
    /// Length of those without a printed tab.
    pub strip_length: f64,
    /// The furthest that a point moved so that faces are flat.
    pub moved: f64,
    /// Climbs of the tabu search.
    pub climbs: usize,
}

/// An unfolded mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Unfolded {
    /// What goes on paper.
    pub pattern: Pattern,
    /// How it came about.
    pub account: UnfoldAccount,
}

/// Unfolds a mesh.
pub fn unfold(mesh: &Mesh, options: &UnfoldOptions, run: &Run) -> Result<Unfolded, UnfoldError> {
    options.check()?;
    run.stage("faces");
    let room = options.room();
    let inner = Room { size: room.size - 2.0 * options.tab };
    let Faces { facets, divided, placement: [scale, x, y, z], triangles } =
        faces(mesh, options, &inner, run)?;
    let hinges = Hinges::new(&facets);
    run.stage("unfold");
    let groups = hinges.components();
    let found = crate::par::blocks(run, groups.len(), 1, |range| {
        let patch = Patch::new(&facets, &hinges, &groups[range.start]);
        let found = search::search(&facets, &hinges, &patch, &inner, options, run)?;
        Ok::<_, Cancelled>((patch, found))
    })?;
    let mut kept = vec![false; hinges.hinges.len()];
    let mut placed = Placed {
        piece: vec![0; facets.facets.len()],
        place: vec![Motion::REST; facets.facets.len()],
        pieces: Vec::new(),
    };
    let (mut climbs, mut pieces_unlimited) = (0, 0);
    for result in found {
        let (patch, found) = result?;
        climbs += found.climbs;
        pieces_unlimited += found.unlimited;
        for piece in found.pieces {
            for &h in &piece.tree {
                kept[patch.hinges[h as usize] as usize] = true;
            }
            for (f, motion) in patch.spread(piece.facets[0], &piece.tree) {
                let facet = patch.facets[f as usize] as usize;
                placed.piece[facet] = placed.pieces.len() as u32;
                placed.place[facet] = motion;
            }
            let facets = piece.facets.iter().map(|&f| patch.facets[f as usize]).collect();
            placed.pieces.push(facets);
        }
    }
    close(&facets, &hinges, &placed, &mut kept);
    put_in_order(&facets, &hinges, &mut placed);
    run.stage("tabs");
    let held = seams::held(&facets, &hinges, &kept);
    let joints = seams::joints(&facets, &held);
    let size = TabSize { height: options.tab, least: (options.tab / 5.0).min(1.0) };
    let (tabs, strips) = tabs::tabs(&facets, &placed, &joints, size, run)?;
    run.stage("pages");
    let items = items(&facets, &placed, &tabs, &strips);
    let (pages, spots) = packing::pack(&items, &room, run)?;
    let Some(spots) = spots.into_iter().collect::<Option<Vec<_>>>() else {
        return Err(misfit(&items, &room));
    };
    let layout = sheets::Layout {
        mesh: &facets,
        placed: &placed,
        held: &held,
        joints: &joints,
        tabs: &tabs,
        strips: &strips,
        spots: &spots,
        page: options.page,
        origin: DVec2::splat(options.margin),
        pages,
    };
    let mut pattern = layout.pattern();
    pattern.mesh.colours = colours(&mesh.attributes, &facets);
    (pattern.mesh.scale, pattern.mesh.middle) = (scale, [x, y, z]);
    run.stage("prove");
    if let Some(overlap) = proof::first_overlap(&pattern) {
        let [x, y] = overlap.at.map(pattern::millimetres);
        return Err(UnfoldError::Overlap { page: overlap.page + 1, x, y });
    }
    let length = |joint: &seams::Joint| {
        let (facet, side) = joint.ways[0][0];
        let [a, b] = facets.facets[facet as usize].side(side);
        a.distance(b)
    };
    let covered: f64 = items.iter().map(Item::area).sum();
    let account = UnfoldAccount {
        scale,
        triangles,
        faces: facets.facets.len(),
        divided,
        parts: groups.len(),
        pieces_unlimited,
        pieces: placed.pieces.len(),
        pages,
        filled: covered / (f64::from(pages) * room.area()),
        seams: joints.len(),
        strips: strips.len(),
        seam_length: joints.iter().map(length).sum(),
        // An empty sum is minus zero.
        strip_length: strips.iter().map(|s| length(&joints[s.joint as usize])).sum::<f64>() + 0.0,
        moved: facets.moved,
        climbs,
    };
    tell(&facets, divided, run);
    Ok(Unfolded { pattern, account })
}

impl UnfoldOptions {
    fn check(&self) -> Result<(), UnfoldError> {
        let (Scale::Factor(size) | Scale::Height(size) | Scale::Size(size)) = self.scale;
        let lengths = [
            ("the scale", size, 1e-9, 1e9, "above 0"),
            ("the page's width", self.page[0], 20.0, 10_000.0, "from 20 to 10000"),
            ("the page's height", self.page[1], 20.0, 10_000.0, "from 20 to 10000"),
            ("the margin", self.margin, 2.0, 1000.0, "from 2 to a quarter of the page"),
            ("the tabs' height", self.tab, 1.0, 50.0, "from 1 to 50"),
            ("the flatness", self.flatness, 0.0, 1.0, "from 0 to 1"),
            ("the thickness", self.thickness, 0.0, 5.0, "from 0 to 5"),
        ];
        for (name, value, least, most, bounds) in lengths {
            if !(least..=most).contains(&value) {
                return Err(UnfoldError::Length { name, value, bounds });
            }
        }
        let shorter = self.page[0].min(self.page[1]);
        if self.margin > shorter / 4.0 {
            let bounds = "from 2 to a quarter of the page";
            return Err(UnfoldError::Length { name: "the margin", value: self.margin, bounds });
        }
        if self.room().size.min_element() < 3.0 * self.tab {
            let bounds = "that leaves room between the margins";
            return Err(UnfoldError::Length { name: "the tabs' height", value: self.tab, bounds });
        }
        Ok(())
    }

    fn room(&self) -> Room {
        Room { size: DVec2::from_array(self.page) - 2.0 * self.margin }
    }
}

/// The faces of a model at its size on paper.
struct Faces {
    facets: Facets,
    /// Cuts across faces that were too large.
    divided: u32,
    /// How the model was scaled, and the point that came to lie at the origin.
    placement: [f64; 4],
    /// Triangles of the model.
    triangles: usize,
}

fn faces(
    mesh: &Mesh,
    options: &UnfoldOptions,
    room: &Room,
    run: &Run,
) -> Result<Faces, UnfoldError> {
    let sewn = sew(mesh, run)?;
    sewn.tell(run);
    let mut welded = sewn.mesh;
    let attributes = std::mem::take(&mut welded.attributes);
    let [low, high] = bounds(&welded.points).ok_or(UnfoldError::Empty)?;
    let extent: [f64; 3] = std::array::from_fn(|a| high[a] - low[a]);
    let factor = match options.scale {
        Scale::Factor(factor) => factor,
        Scale::Height(height) => height / extent[options.up as usize],
        Scale::Size(size) => size / extent.iter().copied().fold(0.0, f64::max),
    };
    if !factor.is_finite() {
        return Err(UnfoldError::Flat);
    }
    let middle = [0, 1, 2].map(|a| (low[a] + high[a]) / 2.0);
    for p in &mut welded.points {
        *p = std::array::from_fn(|a| (p[a] - middle[a]) * factor);
    }
    let sources = distinct(&welded.triangles, run);
    if sources.is_empty() {
        return Err(UnfoldError::Empty);
    }
    let mut triangles: Vec<[u32; 3]> =
        sources.iter().map(|&t| welded.triangles[t as usize]).collect();
    orientation::orient(&welded.points, &mut triangles);
    let paint = paint(&attributes);
    let flat = Flatness { distance: options.flatness, angle: 0.5f64.to_radians() };
    let count = triangles.len();
    if options.thickness > 0.0 {
        thicken(
            &mut welded.points,
            &triangles,
            &|t| (paint(sources[t as usize]), 0),
            flat,
            options.thickness,
            run,
        )?;
    }
    let mut division = Division::new(welded.points, triangles);
    let mut facets = loop {
        let of = |t: u32| {
            let source = division.sources[t as usize];
            (paint(sources[source as usize]), division.parts[t as usize])
        };
        let facets = Facets::new(division.points.clone(), &division.triangles, &of, flat);
        match facets.facets.len() {
            0 => return Err(UnfoldError::Empty),
            many if many > MOST_FACES => return Err(UnfoldError::TooMany(many)),
            _ => {}
        }
        let area: f64 = facets.facets.iter().map(Facet::area).sum();
        if !options.divide || area > MOST_PAGES * room.area() {
            fits(&facets, room)?;
            break facets;
        }
        run.check()?;
        if !division.cut(&facets.facets, &facets.points, room) {
            break facets;
        }
    };
    for t in facets.facets.iter_mut().flat_map(|f| &mut f.triangles) {
        *t = sources[division.sources[*t as usize] as usize];
    }
    let [x, y, z] = middle;
    let (placement, divided) = ([factor, x, y, z], division.cuts());
    Ok(Faces { facets, divided, placement, triangles: count })
}

/// Makes room for the thickness of the paper.
fn thicken(
    points: &mut Vec<[f64; 3]>,
    triangles: &[[u32; 3]],
    paint: &dyn Fn(u32) -> regions::Paint,
    flat: Flatness,
    thickness: f64,
    run: &Run,
) -> Result<(), Cancelled> {
    let edges = Edges::of_triangles(triangles);
    let regions = Regions::new(points, triangles, &edges, paint, flat);
    let stuck = inset::inset(points, triangles, &edges, &regions, thickness / 2.0, run)?;
    if stuck > 0 {
        let text = format!("{stuck} corners are too narrow for paper of {thickness} mm");
        run.finding(Finding::warning("thickness", text).of(stuck as u64));
    }
    Ok(())
}

/// Triangles on three points each, the first on each three.
fn distinct(triangles: &[[u32; 3]], run: &Run) -> Vec<u32> {
    let mut keyed: Vec<([u32; 3], u32)> = Vec::with_capacity(triangles.len());
    for (number, t) in triangles.iter().enumerate() {
        let mut key = *t;
        key.sort_unstable();
        if key[0] != key[1] && key[1] != key[2] {
            keyed.push((key, number as u32));
        }
    }
    keyed.sort_unstable();
    let before = keyed.len();
    keyed.dedup_by_key(|(key, _)| *key);
    let repeated = (before - keyed.len()) as u64;
    if repeated > 0 {
        let text = format!("{repeated} repeated faces are printed once");
        run.finding(Finding::note("repeated-faces", text).of(repeated));
    }
    let mut numbers: Vec<u32> = keyed.into_iter().map(|(_, number)| number).collect();
    numbers.sort_unstable();
    numbers
}

/// What a triangle is painted with: only triangles of one paint become one face.
fn paint(a: &Attributes) -> impl Fn(u32) -> u64 + '_ {
    move |t: u32| {
        let material = a.face_materials.as_ref().map_or(0, |m| m[t as usize]);
        let colour = a.face_colours.as_ref().map_or([0; 4], |c| c[t as usize]);
        u64::from(material) << 32 | u64::from(u32::from_le_bytes(colour))
    }
}

/// The colour of each face; a face has one paint only.
fn colours(a: &Attributes, facets: &Facets) -> Option<Vec<[u8; 3]>> {
    let of_material = |t: usize| {
        let material = a.face_materials.as_ref().map(|m| m[t])?;
        Some(a.materials.get(material as usize)?.colour)
    };
    let known = a.face_colours.is_some() || a.face_materials.is_some();
    let colour = |t: u32| match &a.face_colours {
        Some(colours) => colours[t as usize],
        None => of_material(t as usize).unwrap_or([255; 4]),
    };
    let rgb = |[r, g, b, _]: [u8; 4]| [r, g, b];
    known.then(|| facets.facets.iter().map(|f| rgb(colour(f.triangles[0]))).collect())
}

/// Makes sure that every face fits a page.
fn fits(facets: &Facets, room: &Room) -> Result<(), UnfoldError> {
    for facet in &facets.facets {
        let hull = hull(&mut facet.flat.clone());
        let (excess, along) = room.best_turn(&hull);
        if excess > 1.0 {
            let turn = Motion::turn(-along.to_angle());
            let turned: Vec<DVec2> = hull.iter().map(|&p| turn.at(p)).collect();
            let size = Bounds::of(&turned).size();
            return Err(UnfoldError::LargeFace {
                width: size.x,
                height: size.y,
                room_width: room.size.x,
                room_height: room.size.y,
            });
        }
    }
    Ok(())
}

fn misfit(items: &[Item], room: &Room) -> UnfoldError {
    let sizes = items.iter().map(|item| Bounds::of(&item.parts.concat()).size());
    let largest = sizes.fold(DVec2::ZERO, DVec2::max);
    UnfoldError::LargeFace {
        width: largest.x,
        height: largest.y,
        room_width: room.size.x,
        room_height: room.size.y,
    }
}

/// Keeps every hinge whose facets lie side by side anyway: nothing need be cut there.
fn close(facets: &Facets, hinges: &Hinges, placed: &Placed, kept: &mut [bool]) {
    for (hinge, kept) in hinges.hinges.iter().zip(kept).filter(|(_, kept)| !**kept) {
        let [f, g] = hinge.facets.map(|f| f as usize);
        if placed.piece[f] != placed.piece[g] {
            continue;
        }
        let beside = placed.place[f].after(&hinge.motion);
        let other = &facets.facets[g];
        let apart = |p: &DVec2| beside.at(*p).distance(placed.place[g].at(*p));
        *kept = other.flat.iter().all(|p| apart(p) <= pattern::STEP);
    }
}

/// Orders pieces as they are put together: the largest first, then always the one with the longest
/// seams to those before it.
fn put_in_order(facets: &Facets, hinges: &Hinges, placed: &mut Placed) {
    let count = placed.pieces.len();
    let area =
        |piece: &Vec<u32>| -> f64 { piece.iter().map(|&f| facets.facets[f as usize].area()).sum() };
    let areas: Vec<f64> = placed.pieces.iter().map(area).collect();
    let mut seams: Vec<Vec<(u32, f64)>> = vec![Vec::new(); count];
    for hinge in &hinges.hinges {
        let [p, q] = hinge.facets.map(|f| placed.piece[f as usize]);
        if p != q {
            seams[p as usize].push((q, hinge.length));
            seams[q as usize].push((p, hinge.length));
        }
    }
    let (mut order, mut common) = (Vec::with_capacity(count), vec![0.0f64; count]);
    let mut waits = vec![true; count];
    while order.len() < count {
        let open = (0..count).filter(|&p| waits[p]);
        let best = open.max_by(|&p, &q| {
            let common = common[p].total_cmp(&common[q]);
            common.then(areas[p].total_cmp(&areas[q])).then(q.cmp(&p))
        });
        let Some(best) = best else { break };
        waits[best] = false;
        order.push(best);
        seams[best].iter().for_each(|&(p, length)| common[p as usize] += length);
    }
    let mut numbers = vec![0; count];
    order.iter().zip(0..).for_each(|(&p, number)| numbers[p] = number);
    placed.piece.iter_mut().for_each(|p| *p = numbers[*p as usize]);
    placed.pieces = order.iter().map(|&p| std::mem::take(&mut placed.pieces[p])).collect();
}

/// What goes on pages: pieces with their tabs, then strips.
fn items(
    facets: &Facets,
    placed: &Placed,
    tabs: &[tabs::Tab],
    strips: &[tabs::Strip],
) -> Vec<Item> {
    let mut items: Vec<Item> = placed
        .pieces
        .iter()
        .map(|own| {
            let parts = own.iter().flat_map(|&f| {
                let (facet, place) = (&facets.facets[f as usize], &placed.place[f as usize]);
                let polygon = |part: &Vec<u32>| {
                    gathered(part, &facet.flat).into_iter().map(|p| place.at(p)).collect()
                };
                facet.parts.iter().map(polygon).collect::<Vec<Vec<DVec2>>>()
            });
            Item { parts: parts.collect(), turns: 7 }
        })
        .collect();
    for tab in tabs {
        let piece = placed.piece[tab.way[0].0 as usize] as usize;
        items[piece].parts.push(tab.shape.clone());
    }
    items.extend(strips.iter().map(|s| Item { parts: vec![s.shape.clone()], turns: 1 }));
    items
}

/// What may surprise.
fn tell(facets: &Facets, divided: u32, run: &Run) {
    if divided > 0 {
        let text = format!("faces larger than a page are cut across in {divided} places");
        run.finding(Finding::note("large-faces", text).of(u64::from(divided)));
    }
    if facets.lost > 0 {
        let text = format!("{} faces have no area and are not printed", facets.lost);
        run.finding(Finding::note("flat-faces", text).of(facets.lost as u64));
    }
}

#[cfg(test)]
mod tests;
