//! glTF 2.0, as `.gltf` and as `.glb`.
//!
//! All primitives of triangles in all nodes of the scene, in world space and metres. Normals and
//! colours of points, texture coordinates, base colours and base-colour images are kept; points
//! and lines, skins, morphs and animations are not. After the Khronos specification, 2.0.1; the
//! JSON is parsed by the `gltf` crate, every number in it is checked here.

mod buffers;
mod container;
mod materials;
mod write;

pub use write::{write_chain, write_glb, write_gltf};

use crate::budget::Budget;
use crate::columns::{NO_COLOUR, finish, put};
use crate::{At, ReadError, Source, colour};
use ::gltf::json;
use buffers::Buffers;
use glam::{DMat3, DMat4, DQuat, DVec3};
use json::accessor::Accessor;
use json::mesh::{Mode, Primitive, Semantic};
use json::validation::Checked;
use json::{Index, Root};
use materials::{Materials, Skin};
use octofold::{Attributes, Finding, LengthUnit, Run, Soup, SoupBuilder};
use rustc_hash::FxHashMap;

const FORMAT: &str = "gltf";

/// Extensions without which nothing is lost that is kept here, or that are read.
const HARMLESS: [&str; 4] =
    ["KHR_mesh_quantization", "KHR_texture_transform", "KHR_texture_basisu", "EXT_texture_webp"];

/// Reads polygons from either form.
pub fn read(source: &Source, run: &Run) -> Result<Soup, ReadError> {
    let (text, chunk) = container::split(&source.bytes)?;
    let root = parse(&text)?;
    check_extensions(&root, run)?;
    let budget = Budget::new(FORMAT, source.bytes.len());
    let buffers = Buffers::open(&root, chunk, &*source.files, budget);
    let materials = Materials::new(&root);
    let mut reader = Reader {
        source,
        run,
        root: &root,
        buffers,
        materials,
        builder: SoupBuilder::default(),
        skipped: 0,
        skinned: 0,
    };
    reader.scene()?;
    reader.finish()
}

fn parse(text: &[u8]) -> Result<Root, ReadError> {
    Root::from_slice(text).or_else(|error| {
        with_empty_scenes(text).ok_or_else(|| {
            let at = if error.line() > 0 { At::Line(error.line() as u64) } else { At::File };
            ReadError::malformed(FORMAT, at, format!("its JSON is not that of glTF 2.0: {error}"))
        })
    })
}

/// The same once more for files with a scene that shows nothing, which the parser does not know.
fn with_empty_scenes(text: &[u8]) -> Option<Root> {
    let mut root: serde_json::Value = serde_json::from_slice(text).ok()?;
    for scene in root.get_mut("scenes")?.as_array_mut()? {
        scene.as_object_mut()?.entry("nodes").or_insert_with(|| serde_json::json!([]));
    }
    serde_json::from_value(root).ok()
}

fn check_extensions(root: &Root, run: &Run) -> Result<(), ReadError> {
    for name in &root.extensions_required {
        match name.as_str() {
            "KHR_draco_mesh_compression"
            | "EXT_meshopt_compression"
            | "KHR_meshopt_compression"
            | "EXT_mesh_gpu_instancing" => {
                let fact = format!(
                    "its geometry is packed by {name}, which is not read; save it again without \
                     that extension"
                );
                return Err(ReadError::unsupported(FORMAT, fact));
            }
            name if HARMLESS.contains(&name) || name.starts_with("KHR_materials") => {}
            name => {
                let text = format!("it requires the extension {name}, which is not known here");
                run.finding(Finding::warning("unknown-extension", text));
            }
        }
    }
    Ok(())
}

fn malformed(fact: impl Into<String>) -> ReadError {
    ReadError::malformed(FORMAT, At::File, fact)
}

struct Reader<'a> {
    source: &'a Source,
    run: &'a Run,
    root: &'a Root,
    buffers: Buffers<'a>,
    materials: Materials<'a>,
    builder: SoupBuilder,
    skipped: u64,
    skinned: u64,
}

/// A node that shows a mesh, and where it stands in the world.
struct Instance {
    node: usize,
    mesh: Index<json::Mesh>,
    world: DMat4,
}

impl<'a> Reader<'a> {
    fn scene(&mut self) -> Result<(), ReadError> {
        let instances = self.instances()?;
        let several = instances.len() > 1;
        for (i, instance) in instances.iter().enumerate() {
            self.run.check()?;
            let node = &self.root.nodes[instance.node];
            let mesh = self.root.get(instance.mesh).ok_or_else(|| {
                malformed(format!("node {} shows a mesh that is not there", instance.node))
            })?;
            self.skinned += u64::from(node.skin.is_some());
            let label = several.then_some(i as u32 + 1);
            let first = self.builder.faces();
            let mut known = FxHashMap::default();
            for (p, primitive) in mesh.primitives.iter().enumerate() {
                let place = format!("mesh {} primitive {p}", instance.mesh.value());
                self.primitive(primitive, &place, &instance.world, label, &mut known)?;
            }
            if let Some(label) = label.filter(|_| self.builder.faces() > first) {
                let name = node.name.as_ref().or(mesh.name.as_ref());
                let name = name.cloned().unwrap_or_else(|| format!("node {}", instance.node));
                self.builder.attributes.label_names.push((label, name));
            }
        }
        Ok(())
    }

    /// Nodes with a mesh, in order of the tree.
    fn instances(&self) -> Result<Vec<Instance>, ReadError> {
        let nodes = &self.root.nodes;
        let scene = self.root.scene.unwrap_or(Index::new(0));
        let roots: Vec<usize> = match self.root.get(scene) {
            Some(scene) => scene.nodes.iter().map(Index::value).collect(),
            None => {
                // Without a scene, everything that hangs on nothing is shown.
                let children = nodes.iter().flat_map(|n| n.children.iter().flatten());
                let mut hangs = vec![false; nodes.len()];
                for child in children {
                    if let Some(hangs) = hangs.get_mut(child.value()) {
                        *hangs = true;
                    }
                }
                (0..nodes.len()).filter(|&n| !hangs[n]).collect()
            }
        };
        let mut seen = vec![false; nodes.len()];
        let mut instances = Vec::new();
        let mut open: Vec<_> = roots.into_iter().rev().map(|n| (n, DMat4::IDENTITY)).collect();
        while let Some((n, parent)) = open.pop() {
            let Some(node) = nodes.get(n) else {
                return Err(malformed(format!("node {n} is named, but there are {}", nodes.len())));
            };
            if std::mem::replace(&mut seen[n], true) {
                return Err(malformed(format!("node {n} stands in two places of the tree")));
            }
            let world = parent * local(node);
            if let Some(mesh) = node.mesh {
                instances.push(Instance { node: n, mesh, world });
            }
            open.extend(node.children.iter().flatten().rev().map(|c| (c.value(), world)));
        }
        Ok(instances)
    }

    fn primitive(
        &mut self,
        primitive: &Primitive,
        place: &str,
        world: &DMat4,
        label: Option<u32>,
        known: &mut FxHashMap<[Option<usize>; 3], u32>,
    ) -> Result<(), ReadError> {
        self.buffers.budget.spend(1)?;
        let Checked::Valid(mode) = primitive.mode else {
            return Err(malformed(format!("{place} has an unknown mode")));
        };
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
        let Some(positions) = attribute(Semantic::Positions) else {
            self.skipped += 1;
            return Ok(());
        };
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            self.skipped += 1;
            return Ok(());
        }
        let skin = self.materials.of(primitive.material, &self.buffers, self.source, self.run);
        let normals = attribute(Semantic::Normals);
        let colours = attribute(Semantic::Colors(0));
        let uvs = attribute(Semantic::TexCoords(skin.uv_set));
        // Primitives of a mesh often share their points.
        let key = [Some(positions), normals, colours].map(|a| a.map(|a| a.value()));
        let count = self.count(positions, place)?;
        let base = match known.get(&key) {
            Some(&base) => base,
            None => {
                let base = self.builder.points.len();
                if base + count >= u32::MAX as usize {
                    let source = octofold::ShapeError::TooMany("points");
                    return Err(ReadError::Shape { format: FORMAT, source });
                }
                let base = base as u32;
                self.points(positions, world, place)?;
                if let Some(normals) = normals {
                    self.normals(normals, world, base, count, place)?;
                }
                if let Some(colours) = colours {
                    self.colours(colours, base, count, place)?;
                }
                known.insert(key, base);
                base
            }
        };
        let corners = match primitive.indices {
            Some(indices) => self.buffers.integers(indices, place)?,
            None => (0..count as u32).collect(),
        };
        if let Some(index) = corners.iter().find(|&&i| i as usize >= count) {
            let fact = format!("{place} names vertex {index}, but there are {count}");
            return Err(malformed(fact));
        }
        let mirrored = world.determinant() < 0.0;
        let first = (self.builder.faces(), self.builder.corners.len());
        let mut locals = Vec::new();
        each_triangle(mode, &corners, |[a, b, c]| {
            locals.push(if mirrored { [a, c, b] } else { [a, b, c] });
        });
        self.buffers.budget.spend(locals.len() as u64)?;
        for t in &locals {
            self.builder.face(&t.map(|i| base + i));
        }
        if let Some(uvs) = uvs {
            self.uvs(uvs, &skin, &locals, first.1, count, place)?;
        }
        let a = &mut self.builder.attributes;
        for face in first.0..first.0 + locals.len() {
            if let Some(material) = skin.material {
                put(&mut a.face_materials, face, Attributes::NO_MATERIAL, material);
            }
            if let Some(label) = label {
                put(&mut a.face_labels, face, 0, label);
            }
        }
        Ok(())
    }

    /// Number of points of a primitive.
    fn count(&self, positions: Index<Accessor>, place: &str) -> Result<usize, ReadError> {
        let count = self.root.get(positions).map(|a| a.count.0);
        let count = count.and_then(|c| u32::try_from(c).ok());
        count.map(|c| c as usize).ok_or_else(|| malformed(format!("{place} has no positions")))
    }

    fn points(
        &mut self,
        accessor: Index<Accessor>,
        world: &DMat4,
        place: &str,
    ) -> Result<(), ReadError> {
        let points = self.buffers.floats(accessor, &[3], place)?;
        self.builder.points.extend(points.chunks_exact(3).map(|p| {
            let p = DVec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]));
            if *world == DMat4::IDENTITY { p } else { world.transform_point3(p) }.to_array()
        }));
        Ok(())
    }

    fn normals(
        &mut self,
        accessor: Index<Accessor>,
        world: &DMat4,
        base: u32,
        count: usize,
        place: &str,
    ) -> Result<(), ReadError> {
        let turn = DMat3::from_mat4(*world).inverse().transpose();
        let normals = self.buffers.floats(accessor, &[3], place)?;
        for (i, n) in normals.chunks_exact(3).take(count).enumerate() {
            let n = DVec3::new(f64::from(n[0]), f64::from(n[1]), f64::from(n[2]));
            let n = if *world == DMat4::IDENTITY { n } else { (turn * n).normalize_or_zero() };
            let column = &mut self.builder.attributes.point_normals;
            put(column, base as usize + i, [0.0; 3], n.to_array().map(|x| x as f32));
        }
        Ok(())
    }

    fn colours(
        &mut self,
        accessor: Index<Accessor>,
        base: u32,
        count: usize,
        place: &str,
    ) -> Result<(), ReadError> {
        let channels = self.buffers.width(accessor);
        let colours = self.buffers.floats(accessor, &[3, 4], place)?;
        for (i, c) in colours.chunks_exact(channels).take(count).enumerate() {
            let alpha = c.get(3).copied().unwrap_or(1.0);
            let colour = colour::srgb_of_linear([c[0], c[1], c[2], alpha]);
            let column = &mut self.builder.attributes.point_colours;
            put(column, base as usize + i, NO_COLOUR, colour);
        }
        Ok(())
    }

    fn uvs(
        &mut self,
        accessor: Index<Accessor>,
        skin: &Skin,
        triangles: &[[u32; 3]],
        first: usize,
        count: usize,
        place: &str,
    ) -> Result<(), ReadError> {
        let uvs = self.buffers.floats(accessor, &[2], place)?;
        if uvs.len() < 2 * count {
            let fact = format!("{place} has fewer texture coordinates than vertices");
            return Err(malformed(fact));
        }
        for (i, &corner) in triangles.as_flattened().iter().enumerate() {
            let at = 2 * corner as usize;
            let [u, v] = skin.place([uvs[at], uvs[at + 1]]);
            let column = &mut self.builder.attributes.corner_uvs;
            // The image's origin is its upper left here, its lower left in all else.
            put(column, first + i, [0.0; 2], [u, 1.0 - v]);
        }
        Ok(())
    }

    fn finish(mut self) -> Result<Soup, ReadError> {
        if self.skipped > 0 {
            let text = format!("{} primitives of points or lines are skipped", self.skipped);
            self.run.finding(Finding::warning("skipped-points-lines", text).of(self.skipped));
        }
        if self.skinned > 0 {
            let text = format!("{} meshes with a skin stand as modelled, unposed", self.skinned);
            self.run.finding(Finding::note("unposed", text).of(self.skinned));
        }
        self.builder.unit = Some(LengthUnit::Metre);
        self.builder.attributes.materials = self.materials.into_used();
        finish(self.builder, FORMAT)
    }
}

/// The transform of a node against its parent.
fn local(node: &json::Node) -> DMat4 {
    if let Some(matrix) = node.matrix {
        return DMat4::from_cols_array(&matrix.map(decimal));
    }
    let rotation = node.rotation.map_or([0.0, 0.0, 0.0, 1.0], |r| r.0);
    let rotation = DQuat::from_array(rotation.map(decimal));
    let rotation =
        if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
    DMat4::from_scale_rotation_translation(
        node.scale.unwrap_or([1.0; 3]).map(decimal).into(),
        rotation,
        node.translation.unwrap_or([0.0; 3]).map(decimal).into(),
    )
}

/// The number as it stands in the text: a scale of 0.001 is meant, not the `f32` nearest to it.
fn decimal(x: f32) -> f64 {
    x.to_string().parse().unwrap_or(f64::from(x))
}

/// Triangles of a list, strip or fan. Strips turn every other triangle round; those that name a
/// point twice only lead the strip elsewhere and are no triangles.
fn each_triangle(mode: Mode, corners: &[u32], mut emit: impl FnMut([u32; 3])) {
    match mode {
        Mode::TriangleStrip => {
            for (i, w) in corners.windows(3).enumerate() {
                let [a, b, c] = [w[0], w[1], w[2]];
                if a != b && b != c && c != a {
                    emit(if i % 2 == 1 { [b, a, c] } else { [a, b, c] });
                }
            }
        }
        Mode::TriangleFan => {
            if let [hub, rim @ ..] = corners {
                rim.windows(2).for_each(|w| emit([*hub, w[0], w[1]]));
            }
        }
        _ => corners.as_chunks().0.iter().copied().for_each(emit),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_turn_every_other_triangle_and_fans_share_the_first_point() {
        let all = |mode, corners: &[u32]| {
            let mut triangles = Vec::new();
            each_triangle(mode, corners, |t| triangles.push(t));
            triangles
        };
        assert_eq!(all(Mode::TriangleStrip, &[0, 1, 2, 3, 3, 4]), [[0, 1, 2], [2, 1, 3]]);
        assert_eq!(all(Mode::TriangleFan, &[7, 1, 2, 3]), [[7, 1, 2], [7, 2, 3]]);
        assert_eq!(all(Mode::Triangles, &[0, 1, 2, 3, 4]), [[0, 1, 2]]);
        assert!(all(Mode::TriangleFan, &[]).is_empty());
    }

    #[test]
    fn numbers_mean_what_stands_in_the_text() {
        assert_eq!([0.001f32, 0.0254, 1.0, -2.5].map(decimal), [0.001, 0.0254, 1.0, -2.5]);
    }
}
