//! Parts by label, and one palette for everything that colours a face.

use octofold::{Attributes, Material};
use rustc_hash::FxHashMap;

/// Names of labels: their own where they have one.
pub(crate) struct LabelNames<'a>(FxHashMap<u32, &'a str>);

impl<'a> LabelNames<'a> {
    pub(crate) fn new(attributes: &'a Attributes) -> Self {
        let named = attributes.label_names.iter().filter(|(_, name)| !name.trim().is_empty());
        Self(named.map(|(label, name)| (*label, name.as_str())).collect())
    }

    pub(crate) fn of(&self, label: u32) -> String {
        self.0.get(&label).map_or_else(|| format!("label {label}"), |name| (*name).to_owned())
    }
}

/// Faces of one label.
pub(crate) struct Part {
    /// Name, where there are labels.
    pub(crate) name: Option<String>,
    /// The faces, in order.
    pub(crate) faces: Vec<u32>,
}

/// The faces by label, lowest label first; one part without a name where there are no labels.
pub(crate) fn parts(attributes: &Attributes, faces: usize) -> Vec<Part> {
    let Some(labels) = &attributes.face_labels else {
        return vec![Part { name: None, faces: (0..faces as u32).collect() }];
    };
    let mut distinct = labels.clone();
    distinct.sort_unstable();
    distinct.dedup();
    let names = LabelNames::new(attributes);
    let mut parts: Vec<_> = distinct
        .iter()
        .map(|&label| Part { name: Some(names.of(label)), faces: Vec::new() })
        .collect();
    for (face, label) in labels.iter().enumerate() {
        if let Ok(part) = distinct.binary_search(label) {
            parts[part].faces.push(face as u32);
        }
    }
    parts
}

/// Numbers the names of parts while a reader meets them, from 1, in order of first use.
#[derive(Default)]
pub(crate) struct Labels(FxHashMap<String, u32>);

impl Labels {
    /// The label of `name`.
    pub(crate) fn of(&mut self, name: &str) -> u32 {
        if let Some(&label) = self.0.get(name) {
            return label;
        }
        let label = self.0.len() as u32 + 1;
        self.0.insert(name.into(), label);
        label
    }

    /// All names, by label.
    pub(crate) fn into_names(self) -> Vec<(u32, String)> {
        let mut names: Vec<_> = self.0.into_iter().map(|(name, label)| (label, name)).collect();
        names.sort_unstable();
        names
    }
}

/// Materials for formats that colour faces through materials alone: a face colour becomes a
/// material, or a variant of the face's own. `None` where no face has either.
pub(crate) fn palette(attributes: &Attributes) -> Option<(Vec<Material>, Vec<u32>)> {
    let Some(colours) = &attributes.face_colours else {
        return Some((attributes.materials.clone(), attributes.face_materials.clone()?));
    };
    let mut materials = Vec::new();
    let mut known = FxHashMap::default();
    let of_face = colours.iter().enumerate().map(|(face, &colour)| {
        let base = attributes.face_materials.as_ref().map_or(Attributes::NO_MATERIAL, |m| m[face]);
        *known.entry((base, colour)).or_insert_with(|| {
            let own = attributes.materials.get(base as usize);
            let [r, g, b, a] = colour;
            let name = format!("{r:02x}{g:02x}{b:02x}{a:02x}");
            materials.push(own.map_or_else(
                || Material { name: name.clone(), colour, texture: None },
                |m| Material { name: format!("{} {name}", m.name), colour, ..m.clone() },
            ));
            materials.len() as u32 - 1
        })
    });
    let of_face = of_face.collect();
    Some((materials, of_face))
}
