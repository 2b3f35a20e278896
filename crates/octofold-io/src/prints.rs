//! What is printed on faces: the colours and textures of the model that they stand for.

use crate::drawing::holds;
use crate::images::decode;
use octofold::attributes::Attributes;
use octofold::image::Image;
use octofold::measure::Nearest;
use octofold::picture::Picture;
use octofold::unfold::pattern::{Pattern, Tile, millimetres};
use octofold::{Cancelled, Mesh, Run, par};

/// The colour of a model at any place near it.
pub struct ModelColours<'a> {
    mesh: &'a Mesh,
    nearest: Nearest,
    /// Images of the materials, where they are of a kind that is read.
    images: Vec<Option<Image>>,
}

/// What is printed on a page, rows from the top, three bytes a dot.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Print {
    pub width: usize,
    pub height: usize,
    pub rgb: Vec<u8>,
}

/// Dots for each millimetre.
pub(crate) const DOTS: f64 = 5.0;

/// How far colours go beyond faces, in dots, so that a cut beside its line shows no white.
const BLEED: f64 = 2.0;

/// Dots along a block that is looked at as a whole first.
const BLOCK: usize = 8;

impl<'a> ModelColours<'a> {
    /// The colours of a model; `None` where there is but one.
    pub fn new(mesh: &'a Mesh) -> Option<Self> {
        let a = &mesh.attributes;
        let images: Vec<Option<Image>> =
            a.materials.iter().map(|m| m.texture.as_ref().and_then(decode)).collect();
        let textured = a.corner_uvs.is_some() && images.iter().any(Option::is_some);
        let plain = |t: usize| face_colour(a, t);
        let several = || (1..mesh.triangles.len()).any(|t| plain(t) != plain(0));
        let of_points = || a.point_colours.as_ref().is_some_and(|c| c.iter().any(|x| *x != c[0]));
        let any = textured || several() || of_points();
        any.then(|| Self { mesh, nearest: Nearest::new(mesh), images })
    }

    /// The same triangles, each in the colour of its middle.
    pub fn painted(&self) -> Mesh {
        let middle = |t: usize| {
            let corners = self.mesh.corners(t);
            self.at(std::array::from_fn(|x| corners.iter().map(|p| p[x]).sum::<f64>() / 3.0))
        };
        let numbers: Vec<usize> = (0..self.mesh.triangles.len()).collect();
        let mut mesh = self.mesh.map(|p| p);
        mesh.attributes.face_colours = Some(par::map(&numbers, |&t| {
            let [r, g, b] = middle(t);
            [r, g, b, 255]
        }));
        mesh
    }

    /// The colour of the model next to a place.
    fn at(&self, place: [f64; 3]) -> [u8; 3] {
        let Some(hit) = self.nearest.nearest(place) else { return [255; 3] };
        let (t, a) = (hit.triangle as usize, &self.mesh.attributes);
        let shares = shares(self.mesh.corners(t), hit.point);
        let [r, g, b, _] = face_colour(a, t).unwrap_or_else(|| match &a.point_colours {
            Some(colours) => {
                let corners = self.mesh.triangles[t].map(|p| colours[p as usize]);
                std::array::from_fn(|c| {
                    (0..3).map(|i| shares[i] * f64::from(corners[i][c])).sum::<f64>().round() as u8
                })
            }
            None => [255; 4],
        });
        let material = a.face_materials.as_ref().map(|m| m[t] as usize);
        let image = material.and_then(|m| self.images.get(m)).and_then(Option::as_ref);
        let (Some(image), Some(uvs)) = (image, &a.corner_uvs) else { return [r, g, b] };
        let uv = std::array::from_fn(|i| {
            (0..3).map(|k| shares[k] * f64::from(uvs[3 * t + k][i])).sum::<f64>()
        });
        let [x, y, z, _] = image.texel(uv);
        let [own, texel] = [[r, g, b], [x, y, z]].map(|c| c.map(u16::from));
        std::array::from_fn(|c| (own[c] * texel[c] / 255) as u8)
    }
}

/// The colour of a triangle, where it has one of its own.
fn face_colour(a: &Attributes, t: usize) -> Option<[u8; 4]> {
    if let Some(colours) = &a.face_colours {
        return Some(colours[t]);
    }
    let material = a.face_materials.as_ref().map(|m| m[t])?;
    a.materials.get(material as usize).map(|m| m.colour)
}

/// What is printed on each page.
pub(crate) fn prints(
    pattern: &Pattern,
    colours: &ModelColours<'_>,
    run: &Run,
) -> Result<Vec<Print>, Cancelled> {
    let pages = par::blocks(run, pattern.pages as usize, 1, |range| {
        let page = range.start as u32;
        let mut print = Print::blank(pattern.page);
        let pieces = || pattern.pieces.iter().filter(|piece| piece.page == page);
        for inner in [false, true] {
            for tile in pieces().flat_map(|piece| &piece.tiles) {
                print.tile(pattern, tile, colours, inner);
            }
        }
        print
    })?;
    Ok(pages)
}

impl Print {
    /// A white page.
    pub fn blank(page: [f64; 2]) -> Self {
        let [width, height] = page.map(|x| (x * DOTS).ceil() as usize);
        Self { width, height, rgb: vec![255; 3 * width * height] }
    }

    /// Puts a picture on the page, its upper left corner at a dot.
    pub fn put(&mut self, picture: &Picture, [left, top]: [usize; 2]) {
        let across = (picture.width as usize).min(self.width.saturating_sub(left));
        let rows = picture.rgba.chunks_exact(4 * picture.width.max(1) as usize);
        for (row, pixels) in rows.enumerate().take(self.height.saturating_sub(top)) {
            let at = 3 * ((top + row) * self.width + left);
            let dots = self.rgb[at..at + 3 * across].chunks_exact_mut(3);
            for (dot, pixel) in dots.zip(pixels.chunks_exact(4)) {
                dot.copy_from_slice(&pixel[..3]);
            }
        }
    }

    /// Prints the inner dots of a tile, or those beside it.
    fn tile(&mut self, pattern: &Pattern, tile: &Tile, colours: &ModelColours<'_>, inner: bool) {
        let in_space = pattern.in_space(tile);
        let colour = |x: f64, y: f64| {
            let up = pattern.page[1] - y / DOTS;
            colours.at(pattern.mesh.in_model(in_space([x / DOTS, up])))
        };
        let dots: Vec<[f64; 2]> = tile
            .corners
            .iter()
            .map(|c| c.at.map(millimetres))
            .map(|[x, y]| [x * DOTS, (pattern.page[1] - y) * DOTS])
            .collect();
        let span = |axis: usize, most: usize| {
            let values = || dots.iter().map(|p| p[axis]);
            let low = values().fold(f64::INFINITY, f64::min) - BLEED;
            let high = values().fold(0.0, f64::max) + BLEED;
            (low.max(0.0) as usize)..(high.ceil().max(0.0) as usize).min(most)
        };
        let (columns, rows) = (span(0, self.width), span(1, self.height));
        for top in rows.clone().step_by(BLOCK) {
            for left in columns.clone().step_by(BLOCK) {
                let (right, bottom) = (left + BLOCK, top + BLOCK);
                let wanted: Vec<[usize; 2]> = (top..bottom.min(rows.end))
                    .flat_map(|y| (left..right.min(columns.end)).map(move |x| [x, y]))
                    .filter(|&[x, y]| {
                        let p = [x as f64 + 0.5, y as f64 + 0.5];
                        if inner { holds(&dots, p) } else { !holds(&dots, p) && is_near(&dots, p) }
                    })
                    .collect();
                if wanted.is_empty() {
                    continue;
                }
                let corner = |x: usize, y: usize| colour(x as f64, y as f64);
                let first = corner((left + right) / 2, (top + bottom) / 2);
                let ends = [[left, top], [right, top], [left, bottom], [right, bottom]];
                let even = ends.into_iter().all(|[x, y]| corner(x, y) == first);
                for [x, y] in wanted {
                    let own = if even { first } else { colour(x as f64 + 0.5, y as f64 + 0.5) };
                    let at = 3 * (y * self.width + x);
                    self.rgb[at..at + 3].copy_from_slice(&own);
                }
            }
        }
    }
}

/// True where a point is no further than the bleed from a side of a polygon.
fn is_near(polygon: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let mut sides = polygon.iter().zip(polygon.iter().cycle().skip(1));
    sides.any(|(a, b)| {
        let [u, v] = [b[0] - a[0], b[1] - a[1]];
        let way = ((x - a[0]) * u + (y - a[1]) * v) / (u * u + v * v).max(f64::MIN_POSITIVE);
        let way = way.clamp(0.0, 1.0);
        (a[0] + way * u - x).hypot(a[1] + way * v - y) <= BLEED
    })
}

/// Barycentric coordinates of a point of a triangle, none below zero.
fn shares([a, b, c]: [[f64; 3]; 3], p: [f64; 3]) -> [f64; 3] {
    let area = |q: [f64; 3], r: [f64; 3]| {
        let [u, v]: [[f64; 3]; 2] = [q, r].map(|q| std::array::from_fn(|i| q[i] - p[i]));
        let cross =
            [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        cross.iter().map(|x| x * x).sum::<f64>().sqrt()
    };
    let parts = [area(b, c), area(c, a), area(a, b)];
    let sum: f64 = parts.iter().sum();
    if sum > 0.0 { parts.map(|x| x / sum) } else { [1.0, 0.0, 0.0] }
}
