//! 3D Manufacturing Format 3MF: core, with base materials, colour groups and the production
//! extension's parts.
//!
//! Build items and components are put in place; each mesh that is shown becomes a label. After
//! the 3MF core specification 1.3.

mod model;
mod package;
mod write;

pub use write::write;

use crate::budget::Budget;
use crate::columns::{NO_COLOUR, finish, put};
use crate::{At, ReadError, Source};
use glam::{DMat4, DVec3};
use model::{Group, Model, Object, Reference};
use octofold::{Attributes, Finding, Run, Soup, SoupBuilder};
use package::Package;
use rustc_hash::FxHashMap;

const FORMAT: &str = "3mf";

/// How deep components may nest.
const DEPTH: usize = 64;

/// Reads polygons.
pub fn read(source: &Source, run: &Run) -> Result<Soup, ReadError> {
    let mut package = Package::open(&source.bytes)?;
    let root = package.root()?;
    let mut models = Models::default();
    models.take_name(&root);
    while let Some(name) = models.names.get(models.models.len()) {
        let model = package.model(name, run)?;
        models.take_names(&model);
        models.models.push(model);
    }
    let mut build = Build {
        builder: SoupBuilder::default(),
        budget: Budget::new(FORMAT, source.bytes.len()),
        models: &models,
        trail: Vec::new(),
        materials: FxHashMap::default(),
        run,
    };
    let root = &models.models[0];
    build.builder.unit = root.unit;
    for item in &root.items {
        build.show(0, item, &DMat4::IDENTITY)?;
    }
    if root.items.is_empty() && !root.objects.is_empty() {
        run.finding(Finding::warning("nothing-built", "no object is to be built; all are shown"));
        let mut all: Vec<_> = root.objects.keys().copied().collect();
        all.sort_unstable();
        for object in all {
            if !root.objects[&object].triangles.is_empty() {
                let item = Reference { path: None, object, transform: DMat4::IDENTITY };
                build.show(0, &item, &DMat4::IDENTITY)?;
            }
        }
    }
    let skipped: Vec<_> = models.models.iter().flat_map(|m| m.skipped.iter().copied()).collect();
    if !skipped.is_empty() {
        let text = format!("these parts of the model are not read: {}", skipped.join(", "));
        run.finding(Finding::warning("skipped-resources", text).of(skipped.len() as u64));
    }
    build.finish()
}

/// The model parts of a package, the one with the build first.
#[derive(Default)]
struct Models {
    names: Vec<String>,
    /// Places by name without case.
    places: FxHashMap<String, usize>,
    models: Vec<Model>,
}

impl Models {
    /// Notes the parts that a model names.
    fn take_names(&mut self, model: &Model) {
        let mut objects: Vec<_> = model.objects.iter().collect();
        objects.sort_unstable_by_key(|(id, _)| **id);
        let components = objects.iter().flat_map(|(_, object)| &object.components);
        for path in model.items.iter().chain(components).filter_map(|r| r.path.as_ref()) {
            self.take_name(path);
        }
    }

    fn take_name(&mut self, path: &str) {
        let next = self.names.len();
        if *self.places.entry(package::key(path)).or_insert(next) == next {
            self.names.push(path.to_owned());
        }
    }

    fn place(&self, path: &str) -> Option<usize> {
        self.places.get(&package::key(path)).copied()
    }
}

/// Puts objects in place.
struct Build<'a> {
    builder: SoupBuilder,
    budget: Budget,
    models: &'a Models,
    /// Objects that are being put together, outermost first.
    trail: Vec<(usize, u32)>,
    /// Where the materials of a group begin in the shape's own, by model and group.
    materials: FxHashMap<(usize, u32), u32>,
    run: &'a Run,
}

impl Build<'_> {
    fn show(&mut self, model: usize, what: &Reference, to: &DMat4) -> Result<(), ReadError> {
        let place = what.path.as_ref().map_or(Some(model), |path| self.models.place(path));
        let malformed = |fact| ReadError::malformed(FORMAT, At::File, fact);
        let id = what.object;
        let found = place.and_then(|p| Some((p, self.models.models[p].objects.get(&id)?)));
        let Some((place, object)) = found else {
            return Err(malformed(format!("object {id} is named, but it is not there")));
        };
        if self.trail.contains(&(place, id)) {
            return Err(malformed(format!("object {id} is a component of itself")));
        }
        if self.trail.len() >= DEPTH {
            return Err(malformed(format!("components nest deeper than {DEPTH}")));
        }
        self.run.check()?;
        self.budget.spend(1)?;
        let to = *to * what.transform;
        if !object.triangles.is_empty() {
            self.mesh(place, id, object, &to)?;
        }
        self.trail.push((place, id));
        for component in &object.components {
            self.show(place, component, &to)?;
        }
        self.trail.pop();
        Ok(())
    }

    fn mesh(
        &mut self,
        model: usize,
        id: u32,
        object: &Object,
        to: &DMat4,
    ) -> Result<(), ReadError> {
        self.budget.spend((object.points.len() + object.triangles.len()) as u64)?;
        let base = self.builder.points.len();
        if base + object.points.len() >= u32::MAX as usize {
            let source = octofold::ShapeError::TooMany("points");
            return Err(ReadError::Shape { format: FORMAT, source });
        }
        let base = base as u32;
        self.builder.points.extend(object.points.iter().map(|&p| {
            if *to == DMat4::IDENTITY { p } else { to.transform_point3(DVec3::from(p)).to_array() }
        }));
        let names = &mut self.builder.attributes.label_names;
        let label = names.len() as u32 + 1;
        let name =
            if object.name.is_empty() { format!("object {id}") } else { object.name.clone() };
        names.push((label, name));
        let mirrored = to.determinant() < 0.0;
        for (t, &[a, b, c]) in object.triangles.iter().enumerate() {
            let face = self.builder.faces();
            let corners = if mirrored { [a, c, b] } else { [a, b, c] };
            self.builder.face(&corners.map(|p| base + p));
            put(&mut self.builder.attributes.face_labels, face, 0, label);
            let paint = object.paints.get(&(t as u32)).copied().or(object.paint);
            if let Some((group, index)) = paint {
                self.paint(face, model, group, index);
            }
        }
        Ok(())
    }

    fn paint(&mut self, face: usize, model: usize, group: u32, index: u32) {
        let a = &mut self.builder.attributes;
        match self.models.models[model].groups.get(&group) {
            Some(Group::Colours(colours)) => {
                if let Some(&colour) = colours.get(index as usize) {
                    put(&mut a.face_colours, face, NO_COLOUR, colour);
                }
            }
            Some(Group::Materials(materials)) if (index as usize) < materials.len() => {
                let first = *self.materials.entry((model, group)).or_insert_with(|| {
                    a.materials.extend_from_slice(materials);
                    (a.materials.len() - materials.len()) as u32
                });
                put(&mut a.face_materials, face, Attributes::NO_MATERIAL, first + index);
            }
            _ => {}
        }
    }

    fn finish(mut self) -> Result<Soup, ReadError> {
        let a = &mut self.builder.attributes;
        if a.label_names.len() < 2 {
            a.label_names.clear();
            a.face_labels = None;
        }
        finish(self.builder, FORMAT)
    }
}
