//! Columns that ride along with points, corners and faces (structure of arrays), and materials.

/// Metres per unit of a file's coordinates, where the file says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LengthUnit {
    /// 1e-6 m.
    Micrometre,
    /// 1e-3 m: NIfTI, 3MF, most STL files.
    Millimetre,
    /// 1e-2 m.
    Centimetre,
    /// 0.0254 m.
    Inch,
    /// 0.3048 m.
    Foot,
    /// 1 m: glTF.
    Metre,
}

impl LengthUnit {
    /// Length of one unit in metres.
    pub fn metres(self) -> f64 {
        match self {
            Self::Micrometre => 1e-6,
            Self::Millimetre => 1e-3,
            Self::Centimetre => 1e-2,
            Self::Inch => 0.0254,
            Self::Foot => 0.3048,
            Self::Metre => 1.0,
        }
    }

    /// What lengths in `from` are multiplied by to be in `to`; 1 where one of them is not known.
    pub fn scale(from: Option<Self>, to: Option<Self>) -> f64 {
        match (from, to) {
            (Some(from), Some(to)) if from != to => from.metres() / to.metres(),
            _ => 1.0,
        }
    }
}

/// An image as it stood in the file, still encoded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Texture {
    /// Media type, `image/png` or `image/jpeg`.
    pub media_type: String,
    /// The encoded bytes.
    pub bytes: std::sync::Arc<[u8]>,
}

/// What a face is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name in the file, may be empty.
    pub name: String,
    /// Base colour, sRGB with straight alpha, 0 to 255.
    pub colour: [u8; 4],
    /// Base colour image, sampled by the corner's uv and multiplied by `colour`.
    pub texture: Option<Texture>,
}

impl Default for Material {
    fn default() -> Self {
        Self { name: String::new(), colour: [204, 204, 204, 255], texture: None }
    }
}

/// Numbers of points under a name of their own.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PointColumn {
    /// Name: capital letters, digits and underscores.
    pub name: String,
    /// Numbers for each point, 1 to 4.
    pub width: usize,
    /// The numbers, those of a point side by side.
    pub values: Vec<f32>,
}

impl PointColumn {
    /// The numbers of some points, in their order.
    #[must_use]
    pub fn pick(&self, points: &[usize]) -> Self {
        let of = |&p: &usize| &self.values[p * self.width..(p + 1) * self.width];
        let values = points.iter().flat_map(of).copied().collect();
        Self { name: self.name.clone(), width: self.width, values }
    }
}

/// Optional columns beside a [`crate::Soup`] or a [`crate::Mesh`].
///
/// A column is either absent or has exactly one entry per point, corner or face. Corners are
/// counted in face order: corner `i` of face `f` of a mesh is entry `3 f + i`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Attributes {
    /// sRGB with straight alpha, per point.
    pub point_colours: Option<Vec<[u8; 4]>>,
    /// Unit normals, per point.
    pub point_normals: Option<Vec<[f32; 3]>>,
    /// Texture coordinates per corner, origin at the image's lower left (as in OBJ).
    pub corner_uvs: Option<Vec<[f32; 2]>>,
    /// Unit normals per corner.
    pub corner_normals: Option<Vec<[f32; 3]>>,
    /// sRGB with straight alpha, per face.
    pub face_colours: Option<Vec<[u8; 4]>>,
    /// Index into `materials`, per face; [`Attributes::NO_MATERIAL`] for none.
    pub face_materials: Option<Vec<u32>>,
    /// Label or part number, per face.
    pub face_labels: Option<Vec<u32>>,
    /// The materials that `face_materials` names.
    pub materials: Vec<Material>,
    /// Further numbers of points. They are written to glTF and PLY, and not read.
    pub point_columns: Vec<PointColumn>,
    /// Names of parts that `face_labels` numbers, where known.
    pub label_names: Vec<(u32, String)>,
}

impl Attributes {
    /// The entry of `face_materials` for a face without material.
    pub const NO_MATERIAL: u32 = u32::MAX;

    /// The columns of some points and triangles of a mesh, in the order that these are named in.
    pub(crate) fn of(&self, points: &[u32], triangles: &[u32]) -> Self {
        fn picked<T: Copy>(column: &Option<Vec<T>>, entries: &[u32]) -> Option<Vec<T>> {
            column.as_ref().map(|c| entries.iter().map(|&i| c[i as usize]).collect())
        }
        let corners: Vec<u32> = triangles.iter().flat_map(|&t| 3 * t..3 * t + 3).collect();
        let order: Vec<usize> = points.iter().map(|&p| p as usize).collect();
        Self {
            point_colours: picked(&self.point_colours, points),
            point_normals: picked(&self.point_normals, points),
            corner_uvs: picked(&self.corner_uvs, &corners),
            corner_normals: picked(&self.corner_normals, &corners),
            face_colours: picked(&self.face_colours, triangles),
            face_materials: picked(&self.face_materials, triangles),
            face_labels: picked(&self.face_labels, triangles),
            materials: self.materials.clone(),
            point_columns: self.point_columns.iter().map(|c| c.pick(&order)).collect(),
            label_names: self.label_names.clone(),
        }
    }

    /// The first column whose length does not fit, by name.
    pub(crate) fn misfit(
        &self,
        points: usize,
        corners: usize,
        faces: usize,
    ) -> Option<&'static str> {
        fn bad<T>(column: &Option<Vec<T>>, len: usize) -> bool {
            column.as_ref().is_some_and(|c| c.len() != len)
        }
        let count = self.materials.len() as u32;
        let unknown = |&m: &u32| m != Self::NO_MATERIAL && m >= count;
        let mut further = self.point_columns.iter();
        if further.any(|c| !(1..=4).contains(&c.width) || c.values.len() != c.width * points) {
            Some("point_columns")
        } else if bad(&self.point_colours, points) {
            Some("point_colours")
        } else if bad(&self.point_normals, points) {
            Some("point_normals")
        } else if bad(&self.corner_uvs, corners) {
            Some("corner_uvs")
        } else if bad(&self.corner_normals, corners) {
            Some("corner_normals")
        } else if bad(&self.face_colours, faces) {
            Some("face_colours")
        } else if bad(&self.face_materials, faces)
            || self.face_materials.as_ref().is_some_and(|c| c.iter().any(unknown))
        {
            Some("face_materials")
        } else if bad(&self.face_labels, faces) {
            Some("face_labels")
        } else {
            None
        }
    }
}
