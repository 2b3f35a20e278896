//! From placed pieces to a pattern: corners that pieces share, edges numbered, all rounded to steps.

use super::facets::Facets;
use super::packing;
use super::pattern::{Corner, Fold, Pattern, PatternMesh, Piece, Spot, Strip, Tab, Tile, steps};
use super::plane::Motion;
use super::seams::{self, Held, Joint};
use super::sets::Sets;
use super::tabs::{self, Placed};
use glam::DVec2;

/// What is on the pages, and where.
pub(super) struct Layout<'a> {
    /// The facets.
    pub mesh: &'a Facets,
    /// Their pieces.
    pub placed: &'a Placed,
    /// What holds each edge.
    pub held: &'a [Held],
    /// What is glued.
    pub joints: &'a [Joint],
    /// The tabs.
    pub tabs: &'a [tabs::Tab],
    /// The strips.
    pub strips: &'a [tabs::Strip],
    /// Where each piece, and then each strip, goes.
    pub spots: &'a [packing::Spot],
    /// Width and height of a page, and the place of the room on it.
    pub page: [f64; 2],
    /// Lower left corner of the room that is packed.
    pub origin: DVec2,
    /// How many pages there are.
    pub pages: u32,
}

/// Corners of facets that are one spot on paper.
struct Spots {
    first: Vec<u32>,
    of: Vec<Spot>,
}

impl Layout<'_> {
    /// The pattern.
    pub fn pattern(&self) -> Pattern {
        let numbers = self.numbers();
        let spots = self.spots();
        let seams = self.joints.iter().map(|j| numbers[j.edge as usize]).max().unwrap_or(0);
        let mut inner = self.mesh.edges.len() as u32;
        let mut pieces: Vec<Piece> = Vec::with_capacity(self.placed.pieces.len());
        for (number, facets) in self.placed.pieces.iter().enumerate() {
            let tiles = facets.iter().flat_map(|&f| self.tiles(f, &spots, &numbers, &mut inner));
            let tiles = tiles.collect();
            pieces.push(Piece { page: self.spots[number].0, tiles, tabs: Vec::new() });
        }
        for tab in self.tabs {
            let [(facet, side), _] = tab.way;
            let piece = self.placed.piece[facet as usize] as usize;
            let motion = self.on_page(piece);
            let ends = self.mesh.facets[facet as usize].sides[side as usize];
            let base = [ends[1], ends[0]].map(|c| spots.at(facet, c));
            let outside = tab.shape[2..].iter().map(|&p| rounded(motion.at(p)));
            let edge = numbers[self.joints[tab.joint as usize].edge as usize];
            let outline = base.into_iter().chain(outside).collect();
            let fold = seams::tab_fold(self.mesh, tab.way).to_degrees();
            pieces[piece].tabs.push(Tab { edge, outline, fold });
        }
        let strip = |(i, strip): (usize, &tabs::Strip)| {
            let number = self.placed.pieces.len() + i;
            let motion = self.on_page(number);
            Strip {
                edge: numbers[self.joints[strip.joint as usize].edge as usize],
                page: self.spots[number].0,
                outline: strip.shape.iter().map(|&p| rounded(motion.at(p))).collect(),
                fold: strip.fold.map(|p| rounded(motion.at(p))),
            }
        };
        Pattern {
            mesh: self.faces(),
            page: self.page,
            pages: self.pages,
            pieces,
            strips: self.strips.iter().enumerate().map(strip).collect(),
            seams,
        }
    }

    /// Numbers of edges from 1 on: seams, then all others.
    fn numbers(&self) -> Vec<u32> {
        let mut glued = vec![false; self.mesh.edges.len()];
        self.joints.iter().for_each(|j| glued[j.edge as usize] = true);
        let mut order: Vec<usize> = (0..glued.len()).collect();
        order.sort_by_key(|&e| !glued[e]);
        let mut numbers = vec![0; glued.len()];
        (1..).zip(order).for_each(|(number, e)| numbers[e] = number);
        numbers
    }

    fn on_page(&self, item: usize) -> Motion {
        Motion::shift(self.origin).after(&self.spots[item].1)
    }

    fn spots(&self) -> Spots {
        let mut first = vec![0];
        for facet in &self.mesh.facets {
            first.push(first[first.len() - 1] + facet.corners.len() as u32);
        }
        let mut sets = Sets::singles(first[first.len() - 1] as usize);
        for held in self.held {
            let Some((pair, _)) = held.hinge else { continue };
            let [[a, b], [c, d]] = pair.map(|(f, side)| {
                let ends = self.mesh.facets[f as usize].sides[side as usize];
                ends.map(|corner| first[f as usize] + corner)
            });
            sets.join(a, d);
            sets.join(b, c);
        }
        let mut of = vec![Spot::default(); first[first.len() - 1] as usize];
        for (f, facet) in self.mesh.facets.iter().enumerate() {
            let piece = self.placed.piece[f] as usize;
            let motion = self.on_page(piece).after(&self.placed.place[f]);
            for (c, &p) in facet.flat.iter().enumerate() {
                let own = first[f] as usize + c;
                let root = sets.find(own as u32).0 as usize;
                of[own] = if root == own { rounded(motion.at(p)) } else { of[root] };
            }
        }
        Spots { first, of }
    }

    fn tiles(&self, f: u32, spots: &Spots, numbers: &[u32], inner: &mut u32) -> Vec<Tile> {
        let facet = &self.mesh.facets[f as usize];
        // Sides of the border by their ends; other sides of tiles are inside.
        let mut border: Vec<([u32; 2], u32)> =
            facet.sides.iter().zip(0..).map(|(&ends, number)| (ends, number)).collect();
        border.sort_unstable();
        let mut crossed: Vec<([u32; 2], u32)> = Vec::new();
        let mut tiles = Vec::with_capacity(facet.tiles.len());
        for tile in &facet.tiles {
            let mut corners = Vec::with_capacity(tile.len());
            for (i, &c) in tile.iter().enumerate() {
                let ends = [c, tile[(i + 1) % tile.len()]];
                let side = border.binary_search_by_key(&ends, |(ends, _)| *ends);
                let (edge, fold) = match side {
                    Ok(place) => self.fold(f, border[place].1, numbers),
                    Err(_) => {
                        let back = [ends[1], ends[0]];
                        let known = crossed.iter().find(|(ends, _)| *ends == back);
                        let number = known.map_or_else(
                            || {
                                *inner += 1;
                                *inner
                            },
                            |(_, n)| *n,
                        );
                        crossed.push((ends, number));
                        (number, Fold::Hinge(0.0))
                    }
                };
                let point = facet.corners[c as usize];
                corners.push(Corner { point, at: spots.at(f, c), edge, fold });
            }
            tiles.push(Tile { face: f, corners });
        }
        tiles
    }

    /// Number of the edge at a side, and what happens there.
    fn fold(&self, facet: u32, side: u32, numbers: &[u32]) -> (u32, Fold) {
        let edge = self.edge_at(facet, side);
        let held = &self.held[edge];
        let sides = self.mesh.edges.sides(edge);
        let slit = sides.iter().filter(|s| s.face == facet).count() > 1;
        let fold = match held.hinge {
            Some((pair, fold)) if pair.contains(&(facet, side)) => Fold::Hinge(fold.to_degrees()),
            _ if slit => Fold::Hinge(0.0),
            _ if sides.len() > 1 => Fold::Seam,
            _ => Fold::Border,
        };
        (numbers[edge], fold)
    }

    fn edge_at(&self, facet: u32, side: u32) -> usize {
        let own = &self.mesh.facets[facet as usize];
        let [a, b] = own.sides[side as usize].map(|c| own.corners[c as usize]);
        self.mesh.edges.find([a, b]).unwrap_or(0)
    }

    fn faces(&self) -> PatternMesh {
        let face = |facet: &super::facets::Facet| match &facet.tiles[..] {
            [tile] => tile.iter().map(|&c| facet.corners[c as usize]).collect(),
            tiles => {
                super::tour::tour(tiles).into_iter().map(|c| facet.corners[c as usize]).collect()
            }
        };
        PatternMesh {
            points: self.mesh.points.iter().map(|p| p.to_array()).collect(),
            faces: self.mesh.facets.iter().map(face).collect(),
            triangles: self.mesh.facets.iter().map(|f| f.triangles.clone()).collect(),
            ..PatternMesh::default()
        }
    }
}

impl Spots {
    fn at(&self, facet: u32, corner: u32) -> Spot {
        self.of[(self.first[facet as usize] + corner) as usize]
    }
}

fn rounded(p: DVec2) -> Spot {
    [steps(p.x), steps(p.y)]
}
