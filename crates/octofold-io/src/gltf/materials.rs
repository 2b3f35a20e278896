//! Materials of a glTF file: base colour, its image, and where on the image.

use super::buffers::{Buffers, resolve};
use crate::{Source, colour};
use ::gltf::json;
use json::{Index, Root};
use octofold::attributes::Texture;
use octofold::{Finding, Material, Run};
use rustc_hash::FxHashMap;

/// The materials that were met, in order.
pub(super) struct Materials<'a> {
    root: &'a Root,
    used: Vec<Material>,
    known: Vec<Option<Skin>>,
    /// Images that were read, by number.
    images: FxHashMap<usize, Texture>,
}

/// What a primitive needs to know of its material.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Skin {
    /// Place among the used materials.
    pub(super) material: Option<u32>,
    /// Number of the texture coordinates that the image goes by.
    pub(super) uv_set: u32,
    moved: Option<Moved>,
}

/// KHR_texture_transform: scale, then rotation, then offset.
#[derive(Debug, Clone, Copy)]
struct Moved {
    offset: [f32; 2],
    rotation: f32,
    scale: [f32; 2],
}

impl Skin {
    /// Where on the image a texture coordinate stands.
    pub(super) fn place(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let Some(Moved { offset, rotation, scale }) = self.moved else { return [u, v] };
        let [u, v] = [u * scale[0], v * scale[1]];
        let (sin, cos) = rotation.sin_cos();
        [cos * u + sin * v + offset[0], cos * v - sin * u + offset[1]]
    }
}

impl<'a> Materials<'a> {
    pub(super) fn new(root: &'a Root) -> Self {
        Self {
            root,
            used: Vec::new(),
            known: vec![None; root.materials.len()],
            images: FxHashMap::default(),
        }
    }

    /// The materials that were met.
    pub(super) fn into_used(self) -> Vec<Material> {
        self.used
    }

    /// What stands for a primitive's material; nothing where it has none.
    pub(super) fn of(
        &mut self,
        index: Option<Index<json::Material>>,
        buffers: &Buffers<'_>,
        source: &Source,
        run: &Run,
    ) -> Skin {
        let Some(index) = index else { return Skin::default() };
        let Some(material) = self.root.get(index) else { return Skin::default() };
        if let Some(skin) = self.known[index.value()] {
            return skin;
        }
        let extensions = material.extensions.as_ref();
        let older = extensions.and_then(|e| e.pbr_specular_glossiness.as_ref());
        let (factor, info) = match older {
            Some(older) => (older.diffuse_factor.0, older.diffuse_texture.as_ref()),
            None => {
                let pbr = &material.pbr_metallic_roughness;
                (pbr.base_color_factor.0, pbr.base_color_texture.as_ref())
            }
        };
        let name = material.name.clone().unwrap_or_default();
        let texture = info.and_then(|info| {
            let found = self.image(info.index, buffers, source);
            if let Err(fact) = &found {
                let text = format!("material {name} is left without its image: {fact}");
                run.finding(Finding::warning("missing-image", text));
            }
            found.ok()
        });
        let transform = info.and_then(|info| info.extensions.as_ref()?.texture_transform.as_ref());
        let skin = Skin {
            material: Some(self.used.len() as u32),
            uv_set: transform
                .and_then(|t| t.tex_coord)
                .or(info.map(|info| info.tex_coord))
                .unwrap_or(0),
            moved: transform.map(|t| Moved {
                offset: t.offset.0,
                rotation: t.rotation.0,
                scale: t.scale.0,
            }),
        };
        self.used.push(Material { name, colour: colour::srgb_of_linear(factor), texture });
        self.known[index.value()] = Some(skin);
        skin
    }

    fn image(
        &mut self,
        texture: Index<json::Texture>,
        buffers: &Buffers<'_>,
        source: &Source,
    ) -> Result<Texture, String> {
        let number = self.root.get(texture).map(|texture| texture.source);
        let found = number.and_then(|number| Some((number.value(), self.root.get(number)?)));
        let (number, image) = found.ok_or("there is none that can be shown")?;
        if let Some(texture) = self.images.get(&number) {
            return Ok(texture.clone());
        }
        let texture = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => {
                let bytes = resolve(uri, &*source.files).map_err(|error| error.to_string())?;
                colour::texture(&bytes)
            }
            (None, Some(view)) => {
                let (bytes, _) = buffers.view(view).map_err(|error| error.to_string())?;
                colour::texture(bytes)
            }
            (None, None) => return Err("it has no data".into()),
        };
        let texture = texture.ok_or("it is neither PNG nor JPEG")?;
        self.images.insert(number, texture.clone());
        Ok(texture)
    }
}
