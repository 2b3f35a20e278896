//! Writing glTF: one node and mesh per label, one primitive per material.
//!
//! Points are split where corners differ in texture coordinate, normal or face colour, since glTF
//! knows points only. Colours are 16 bits a channel in linear light, so that all sRGB bytes come
//! back.

use super::{FORMAT, container};
use crate::columns::{single, sink_error};
use crate::parts::parts;
use crate::{Sink, WriteError, colour};
use base64::Engine;
use octofold::attributes::Texture;
use octofold::{Attributes, Material, Mesh, Run, Soup};
use serde_json::{Value, json};

/// Kinds of buffer views, after OpenGL.
const POINTS: u32 = 34962;
const INDICES: u32 = 34963;

/// Types of components, after OpenGL.
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;

/// Writes triangles as one binary file.
pub fn write_glb(soup: &Soup, sink: &mut Sink<'_>, run: &Run) -> Result<(), WriteError> {
    Document::of(soup, run)?.write(sink)
}

/// Writes shapes that stand for each other, the finest first, as one binary file with the extension
/// `MSFT_lod`. Each comes with the share of the screen down to which it is shown. Viewers that do not know
/// the extension show the first.
pub fn write_chain(
    shapes: &[(Soup, f64)],
    sink: &mut Sink<'_>,
    run: &Run,
) -> Result<(), WriteError> {
    let mut document = Document::default();
    for (soup, share) in shapes {
        let first = document.nodes.len();
        document.add(soup, run)?;
        if document.nodes.len() != first + 1 {
            let fact = "each shape must have triangles, and one part; write them one by one".into();
            return Err(WriteError::Unfit { format: "a chain of shapes", fact });
        }
        document.shares.push(*share);
    }
    document.write(sink)
}

/// Writes triangles as one JSON file, with its data embedded.
pub fn write_gltf(soup: &Soup, sink: &mut Sink<'_>, run: &Run) -> Result<(), WriteError> {
    let document = Document::of(soup, run)?;
    let data = base64::engine::general_purpose::STANDARD.encode(&document.data);
    let json = document.json(Some(format!("data:application/octet-stream;base64,{data}")));
    sink.out.write_all(json.to_string().as_bytes()).map_err(sink_error)
}

/// The tables of a file while they grow, and its binary data.
#[derive(Default)]
struct Document {
    nodes: Vec<Value>,
    meshes: Vec<Value>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    materials: Vec<Value>,
    textures: Vec<Value>,
    images: Vec<Value>,
    /// Textures that are written, in order of their numbers.
    written: Vec<Texture>,
    /// Shares of the screen down to which nodes are shown that stand for each other.
    shares: Vec<f64>,
    data: Vec<u8>,
}

impl Document {
    fn of(soup: &Soup, run: &Run) -> Result<Self, WriteError> {
        let mut document = Self::default();
        document.add(soup, run)?;
        Ok(document)
    }

    fn write(self, sink: &mut Sink<'_>) -> Result<(), WriteError> {
        let bytes = container::join(self.json(None).to_string().as_bytes(), &self.data)
            .ok_or(WriteError::Unfit { format: "glb", fact: "more than 4 GiB; use ply".into() })?;
        sink.out.write_all(&bytes).map_err(sink_error)
    }

    /// Adds a shape: a node for each of its parts.
    fn add(&mut self, soup: &Soup, run: &Run) -> Result<(), WriteError> {
        let mesh = soup.triangulate();
        let points = single(&mesh.points, FORMAT, run)?;
        let a = &mesh.attributes;
        let materials = self.materials.len();
        self.all_materials(a);
        let scale = mesh.unit.map(|unit| unit.metres()).filter(|&metres| metres != 1.0);
        let mut splitter = Splitter::new(&mesh);
        for part in parts(a, mesh.triangles.len()) {
            let mut primitives = Vec::new();
            for (material, faces) in by_material(a, &part.faces) {
                run.check()?;
                splitter.split(&faces);
                let mut primitive = self.primitive(&points, &splitter);
                primitive["material"] = json!(materials + material);
                primitives.push(primitive);
            }
            if primitives.is_empty() {
                continue;
            }
            let mut mesh = json!({ "primitives": primitives });
            let mut node = json!({ "mesh": self.meshes.len() });
            if let Some(name) = part.name {
                mesh["name"] = json!(name);
                node["name"] = json!(name);
            }
            if let Some(scale) = scale {
                node["scale"] = json!([scale, scale, scale]);
            }
            self.meshes.push(mesh);
            self.nodes.push(node);
        }
        Ok(())
    }

    fn json(&self, uri: Option<String>) -> Value {
        let mut root = json!({ "asset": { "version": "2.0", "generator": "Octofold" } });
        let (mut nodes, mut shown) = (self.nodes.clone(), self.nodes.len());
        if self.shares.len() > 1 && shown > 1 {
            // The first stands for the others, which hang on nothing.
            let coarser: Vec<usize> = (1..shown).collect();
            root["extensionsUsed"] = json!(["MSFT_lod"]);
            nodes[0]["extensions"] = json!({ "MSFT_lod": { "ids": coarser } });
            nodes[0]["extras"] = json!({ "MSFT_screencoverage": self.shares });
            shown = 1;
        }
        if shown > 0 {
            root["scene"] = json!(0);
            root["scenes"] = json!([{ "nodes": (0..shown).collect::<Vec<_>>() }]);
        }
        // Empty tables are not allowed.
        let tables = [
            ("nodes", &nodes),
            ("meshes", &self.meshes),
            ("accessors", &self.accessors),
            ("bufferViews", &self.views),
            ("materials", &self.materials),
            ("textures", &self.textures),
            ("images", &self.images),
        ];
        for (name, table) in tables {
            if !table.is_empty() {
                root[name] = json!(table);
            }
        }
        if !self.data.is_empty() {
            root["buffers"] = json!([{ "byteLength": self.data.len() }]);
            if let Some(uri) = uri {
                root["buffers"][0]["uri"] = json!(uri);
            }
        }
        root
    }

    /// Adds all materials in order, and behind them one for faces without where there are any.
    fn all_materials(&mut self, a: &Attributes) {
        let coloured = a.point_colours.is_some() || a.face_colours.is_some();
        let mut plain = Material { name: "plain".into(), ..Material::default() };
        if coloured {
            plain.colour = [255; 4];
        }
        let clear = |column: &Option<Vec<[u8; 4]>>| column.iter().flatten().any(|c| c[3] != 255);
        let blend = clear(&a.point_colours) || clear(&a.face_colours);
        let of_face = a.face_materials.as_deref().unwrap_or_default();
        let unpainted = of_face.is_empty() || of_face.contains(&Attributes::NO_MATERIAL);
        let all: Vec<_> = a.materials.iter().filter(|_| !of_face.is_empty()).collect();
        for material in all.into_iter().chain(unpainted.then_some(&plain)) {
            let value = self.material(material, blend);
            self.materials.push(value);
        }
    }

    fn material(&mut self, material: &Material, blend: bool) -> Value {
        let [r, g, b, alpha] = material.colour;
        let [r, g, b] = [r, g, b].map(colour::linear);
        let mut value = json!({
            "name": material.name,
            "doubleSided": true,
            "pbrMetallicRoughness": {
                "baseColorFactor": [r, g, b, f32::from(alpha) / 255.0],
                "metallicFactor": 0,
                "roughnessFactor": 0.9,
            },
        });
        if blend || alpha != 255 {
            value["alphaMode"] = json!("BLEND");
        }
        if let Some(texture) = &material.texture {
            let index = self.texture(texture);
            value["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": index });
        }
        value
    }

    /// Number of a texture, which is written once.
    fn texture(&mut self, texture: &Texture) -> usize {
        if let Some(known) = self.written.iter().position(|written| written == texture) {
            return known;
        }
        let view = self.view(&texture.bytes, None);
        self.images.push(json!({ "bufferView": view, "mimeType": texture.media_type }));
        self.textures.push(json!({ "source": self.images.len() - 1 }));
        self.written.push(texture.clone());
        self.written.len() - 1
    }

    fn primitive(&mut self, points: &[[f32; 3]], split: &Splitter<'_>) -> Value {
        let a = &split.mesh.attributes;
        let positions: Vec<_> = split.points.iter().map(|&p| points[p as usize]).collect();
        let mut attributes = json!({ "POSITION": self.positions(&positions) });
        if a.corner_normals.is_some() || a.point_normals.is_some() {
            let normals: Vec<_> = split.corners.iter().map(|&c| unit(split.normal(c))).collect();
            let bytes = bytemuck::cast_slice(&normals);
            attributes["NORMAL"] = json!(self.accessor(bytes, F32, "VEC3", normals.len()));
        }
        if let Some(uvs) = &a.corner_uvs {
            // The image's origin is its upper left here, its lower left in all else.
            let uv = |&c: &u32| [uvs[c as usize][0], 1.0 - uvs[c as usize][1]];
            let uvs: Vec<_> = split.corners.iter().map(uv).collect();
            let bytes = bytemuck::cast_slice(&uvs);
            attributes["TEXCOORD_0"] = json!(self.accessor(bytes, F32, "VEC2", uvs.len()));
        }
        if a.point_colours.is_some() || a.face_colours.is_some() {
            let colours: Vec<_> = split.corners.iter().map(|&c| wide(split.colour(c))).collect();
            let bytes = bytemuck::cast_slice(&colours);
            let accessor = self.accessor(bytes, U16, "VEC4", colours.len());
            self.accessors[accessor]["normalized"] = json!(true);
            attributes["COLOR_0"] = json!(accessor);
        }
        for column in &a.point_columns {
            let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][column.width.clamp(1, 4) - 1];
            let of = |&p: &u32| &column.values[p as usize * column.width..][..column.width];
            let values: Vec<f32> = split.points.iter().flat_map(of).copied().collect();
            let count = split.points.len();
            let accessor = match shorts(&values).filter(|_| column.width % 2 == 0) {
                Some(words) => self.accessor(bytemuck::cast_slice(&words), U16, kind, count),
                None => self.accessor(bytemuck::cast_slice(&values), F32, kind, count),
            };
            attributes[format!("_{}", column.name)] = json!(accessor);
        }
        // The highest index of a kind stands for a break.
        let (view, component) = if split.points.len() < usize::from(u16::MAX) {
            let short: Vec<u16> = split.indices.iter().map(|&i| i as u16).collect();
            (self.view(bytemuck::cast_slice(&short), Some(INDICES)), U16)
        } else {
            (self.view(bytemuck::cast_slice(&split.indices), Some(INDICES)), U32)
        };
        self.accessors.push(json!({
            "bufferView": view,
            "componentType": component,
            "type": "SCALAR",
            "count": split.indices.len(),
        }));
        json!({ "attributes": attributes, "indices": self.accessors.len() - 1 })
    }

    fn positions(&mut self, positions: &[[f32; 3]]) -> usize {
        let mut bounds = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        for p in positions {
            for axis in 0..3 {
                bounds[0][axis] = bounds[0][axis].min(p[axis]);
                bounds[1][axis] = bounds[1][axis].max(p[axis]);
            }
        }
        let bytes = bytemuck::cast_slice(positions);
        let accessor = self.accessor(bytes, F32, "VEC3", positions.len());
        self.accessors[accessor]["min"] = json!(bounds[0]);
        self.accessors[accessor]["max"] = json!(bounds[1]);
        accessor
    }

    fn accessor(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize) -> usize {
        let view = self.view(bytes, Some(POINTS));
        self.accessors.push(json!({
            "bufferView": view,
            "componentType": component,
            "type": kind,
            "count": count,
        }));
        self.accessors.len() - 1
    }

    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        let mut view =
            json!({ "buffer": 0, "byteOffset": self.data.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.data.extend(bytes);
        self.views.push(view);
        self.views.len() - 1
    }
}

/// Faces by material, each with the material's place; those without stand behind all others.
fn by_material(a: &Attributes, faces: &[u32]) -> Vec<(usize, Vec<u32>)> {
    let material = |&face: &u32| match &a.face_materials {
        Some(of_face) => (of_face[face as usize] as usize).min(a.materials.len()),
        None => 0,
    };
    let mut faces = faces.to_vec();
    faces.sort_by_key(material);
    let same = |a: &u32, b: &u32| material(a) == material(b);
    faces.chunk_by(same).map(|group| (material(&group[0]), group.to_vec())).collect()
}

/// Points of some faces, one for each distinct set of corner values.
struct Splitter<'a> {
    mesh: &'a Mesh,
    /// First vertex that was made of each point, and the next one of the same point.
    first: Vec<u32>,
    next: Vec<u32>,
    /// Point and an example corner of each vertex.
    points: Vec<u32>,
    corners: Vec<u32>,
    indices: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl<'a> Splitter<'a> {
    fn new(mesh: &'a Mesh) -> Self {
        Self {
            mesh,
            first: vec![NONE; mesh.points.len()],
            next: Vec::new(),
            points: Vec::new(),
            corners: Vec::new(),
            indices: Vec::new(),
        }
    }

    fn split(&mut self, faces: &[u32]) {
        self.points.iter().for_each(|&p| self.first[p as usize] = NONE);
        self.next.clear();
        self.points.clear();
        self.corners.clear();
        self.indices.clear();
        for &face in faces {
            for (i, &point) in self.mesh.triangles[face as usize].iter().enumerate() {
                let vertex = self.vertex(point, 3 * face + i as u32);
                self.indices.push(vertex);
            }
        }
    }

    fn vertex(&mut self, point: u32, corner: u32) -> u32 {
        let mut vertex = self.first[point as usize];
        while vertex != NONE {
            if self.same(corner, self.corners[vertex as usize]) {
                return vertex;
            }
            vertex = self.next[vertex as usize];
        }
        let vertex = self.points.len() as u32;
        self.points.push(point);
        self.corners.push(corner);
        self.next.push(std::mem::replace(&mut self.first[point as usize], vertex));
        vertex
    }

    /// True where two corners at one point differ in nothing.
    fn same(&self, a: u32, b: u32) -> bool {
        let (a, b) = (a as usize, b as usize);
        let columns = &self.mesh.attributes;
        let normals = columns.corner_normals.as_ref().is_none_or(|c| c[a] == c[b]);
        let uvs = columns.corner_uvs.as_ref().is_none_or(|c| c[a] == c[b]);
        let colours = columns.face_colours.as_ref().is_none_or(|c| c[a / 3] == c[b / 3]);
        normals && uvs && colours
    }

    fn point(&self, corner: u32) -> usize {
        self.mesh.triangles[corner as usize / 3][corner as usize % 3] as usize
    }

    fn normal(&self, corner: u32) -> [f32; 3] {
        let a = &self.mesh.attributes;
        match (&a.corner_normals, &a.point_normals) {
            (Some(normals), _) => normals[corner as usize],
            (None, Some(normals)) => normals[self.point(corner)],
            (None, None) => [0.0; 3],
        }
    }

    /// The face's colour, else the point's.
    fn colour(&self, corner: u32) -> [u8; 4] {
        let a = &self.mesh.attributes;
        match (&a.face_colours, &a.point_colours) {
            (Some(colours), _) => colours[corner as usize / 3],
            (None, Some(colours)) => colours[self.point(corner)],
            (None, None) => [255; 4],
        }
    }
}

/// A unit vector, as glTF demands; up where there is no direction.
fn unit(normal: [f32; 3]) -> [f32; 3] {
    glam::Vec3::from(normal).normalize_or(glam::Vec3::Z).to_array()
}

/// Numbers in half the bytes, where all of them are whole and small enough.
fn shorts(values: &[f32]) -> Option<Vec<u16>> {
    let short = |&x: &f32| Some(x as u16).filter(|&word| f32::from(word) == x);
    values.iter().map(short).collect()
}

/// A colour in linear light, 16 bits a channel.
fn wide([r, g, b, a]: [u8; 4]) -> [u16; 4] {
    let word = |c: u8| (colour::linear(c) * 65535.0).round() as u16;
    [word(r), word(g), word(b), u16::from(a) * 257]
}
