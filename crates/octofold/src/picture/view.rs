//! From where a shape is seen, and what of it lands on which pixel.

use crate::mesh::Mesh;
use crate::par;
use crate::run::{Cancelled, Run};
use glam::{DVec2, DVec3};

/// How far things look smaller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Not at all: parallel lines stay parallel.
    Orthographic,
    /// As through a lens of this field of view, in degrees, that just takes in the shape.
    Perspective {
        /// Angle that the whole shape takes up, in degrees.
        degrees: f64,
    },
}

/// From where a shape is seen. It is always moved and scaled to fill the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Pixels in a row, and rows.
    pub size: [u32; 2],
    /// From the eye into the scene.
    pub direction: [f64; 3],
    /// What points up in the picture.
    pub up: [f64; 3],
    /// How far things look smaller.
    pub projection: Projection,
    /// Share of the picture that stays free at each side.
    pub margin: f64,
    /// The box to fit instead of the mesh, so that several meshes are seen alike. Faces that
    /// reach behind the eye are not drawn.
    pub frame: Option<[[f64; 3]; 2]>,
}

impl Default for View {
    /// From the front, the right and above, with z up.
    fn default() -> Self {
        Self {
            size: [800, 600],
            direction: [-0.62, 1.0, -0.58],
            up: [0.0, 0.0, 1.0],
            projection: Projection::Perspective { degrees: 28.0 },
            margin: 0.06,
            frame: None,
        }
    }
}

impl View {
    /// The same view of a shape whose y axis points up.
    #[must_use]
    pub fn y_up(self) -> Self {
        let [x, y, z] = self.direction;
        Self { direction: [x, z, -y], up: [0.0, 1.0, 0.0], ..self }
    }

    /// The same view in another size.
    #[must_use]
    pub fn sized(self, width: u32, height: u32) -> Self {
        Self { size: [width, height], ..self }
    }
}

/// A point on the picture.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Projected {
    /// Position in pixels, y down.
    pub at: DVec2,
    /// Grows towards the eye, linearly over the picture.
    pub near: f64,
    /// Weight of the point when something is interpolated over the picture; 0 behind the eye.
    pub weight: f64,
}

/// A view that is fitted to a shape.
pub(super) struct Camera {
    pub size: [u32; 2],
    /// Unit vectors to the right, up and towards the eye.
    pub right: DVec3,
    pub up: DVec3,
    pub back: DVec3,
    centre: DVec3,
    /// Distance of the eye from the centre; `None` for orthographic views.
    distance: Option<f64>,
    /// Pixels per unit of the projection plane through the centre.
    pub scale: f64,
    shift: DVec2,
    /// The mesh's points.
    pub points: Vec<Projected>,
}

/// Points in one unit of work.
const BLOCK: usize = 1 << 16;

impl Camera {
    /// Fits `view` to the mesh, or to its frame.
    pub fn new(mesh: &Mesh, view: &View, run: &Run) -> Result<Self, Cancelled> {
        let back = (-DVec3::from(view.direction)).try_normalize().unwrap_or(DVec3::Z);
        let right = DVec3::from(view.up)
            .cross(back)
            .try_normalize()
            .unwrap_or_else(|| back.any_orthonormal_vector());
        let up = back.cross(right);
        let [low, high] = view.frame.or(mesh.bounds()).unwrap_or([[0.0; 3], [1.0; 3]]);
        let (low, high) = (DVec3::from(low), DVec3::from(high));
        let radius = (high - low).length() / 2.0;
        let distance = match view.projection {
            Projection::Perspective { degrees } if radius > 0.0 => {
                Some(radius / (degrees.clamp(1.0, 120.0).to_radians() / 2.0).sin())
            }
            _ => None,
        };
        let centre = (low + high) / 2.0;
        let mut camera = Self {
            size: view.size,
            right,
            up,
            back,
            centre,
            distance,
            scale: 1.0,
            shift: DVec2::ZERO,
            points: Vec::new(),
        };
        let bounds = match view.frame {
            Some(_) => {
                let corner = |i: usize| {
                    DVec3::from(std::array::from_fn(
                        |a| if i >> a & 1 == 1 { high[a] } else { low[a] },
                    ))
                };
                let corners: Vec<DVec3> = (0..8).map(corner).collect();
                camera.bounds_of(corners.iter().copied())
            }
            None => {
                let blocks = par::blocks(run, mesh.points.len(), BLOCK, |range| {
                    camera.bounds_of(mesh.points[range].iter().map(|&p| p.into()))
                })?;
                blocks.into_iter().fold(EMPTY, |a, b| [a[0].min(b[0]), a[1].max(b[1])])
            }
        };
        camera.fit(bounds, view.margin);
        camera.points = par::map(&mesh.points, |&p| camera.project(p.into()));
        Ok(camera)
    }

    /// Lowest and highest position of points on the picture.
    fn bounds_of(&self, points: impl Iterator<Item = DVec3>) -> [DVec2; 2] {
        points
            .map(|p| self.project(p))
            .filter(|p| p.weight > 0.0)
            .fold(EMPTY, |[low, high], p| [low.min(p.at), high.max(p.at)])
    }

    /// Scales and moves the picture such that `bounds` fill it up to a margin.
    fn fit(&mut self, [low, high]: [DVec2; 2], margin: f64) {
        let size = DVec2::new(f64::from(self.size[0]), f64::from(self.size[1]));
        let room = size * (1.0 - 2.0 * margin.clamp(0.0, 0.45));
        let extent = high - low;
        if extent.min_element() < 0.0 {
            return;
        }
        let scale = (room / extent).min_element();
        self.scale = if scale.is_finite() { scale } else { 1.0 };
        self.shift = size / 2.0 - (low + high) / 2.0 * self.scale;
    }

    fn project(&self, p: DVec3) -> Projected {
        let q = p - self.centre;
        let flat = DVec2::new(q.dot(self.right), -q.dot(self.up));
        let towards = q.dot(self.back);
        match self.distance {
            None => Projected { at: flat * self.scale + self.shift, near: towards, weight: 1.0 },
            Some(distance) => {
                let depth = 1.0 - towards / distance;
                if depth <= 1e-6 {
                    return Projected::default();
                }
                let weight = 1.0 / depth;
                Projected { at: flat * weight * self.scale + self.shift, near: weight, weight }
            }
        }
    }

    /// How much nearer a point comes that moves by one pixel towards the eye, at the centre.
    pub fn pixel_depth(&self) -> f64 {
        1.0 / (self.scale * self.distance.unwrap_or(1.0))
    }

    /// The direction from a point towards the eye.
    pub fn towards_eye(&self, p: DVec3) -> DVec3 {
        match self.distance {
            None => self.back,
            Some(distance) => (self.centre + self.back * distance - p).normalize_or(self.back),
        }
    }
}

/// Bounds of nothing.
const EMPTY: [DVec2; 2] = [DVec2::INFINITY, DVec2::NEG_INFINITY];
