//! The material files that an OBJ names: diffuse colour, opacity and diffuse image.

use crate::colour;
use crate::text::{Statements, decoded, leading_number, name, split_word, words};
use crate::{Files, ReadError};
use octofold::attributes::Texture;
use octofold::{Finding, Material, Run};
use rustc_hash::{FxHashMap, FxHashSet};

/// All materials of the files that were found, by name.
#[derive(Default)]
pub(super) struct Library {
    materials: FxHashMap<Vec<u8>, Material>,
    /// Images that were read, by name.
    images: FxHashMap<Vec<u8>, Texture>,
}

impl Library {
    /// Reads the files of `mtllib` statements. What is missing is told as a finding: the shape is
    /// sound without it.
    pub(super) fn load(named: &[Vec<u8>], files: &dyn Files, run: &Run) -> Self {
        let mut library = Self::default();
        let mut seen = FxHashSet::default();
        for statement in named.iter().filter(|&statement| seen.insert(statement)) {
            match open(statement, files) {
                Ok(found) => found.iter().for_each(|b| library.read(b, files, run)),
                Err(error) => run.finding(Finding::warning(
                    "missing-materials",
                    format!("its materials are left plain: {error}"),
                )),
            }
        }
        library
    }

    /// The material of that name, plain where no file defines it.
    pub(super) fn material(&self, name: &[u8]) -> Material {
        self.materials
            .get(name)
            .cloned()
            .unwrap_or_else(|| Material { name: crate::text::name(name), ..Material::default() })
    }

    fn read(&mut self, bytes: &[u8], files: &dyn Files, run: &Run) {
        let text = decoded(bytes);
        let mut statements = Statements::new(&text);
        let mut current = None;
        while let Some((_, text)) = statements.next() {
            let (keyword, rest) = split_word(text);
            if keyword == b"newmtl" {
                let key = rest.trim_ascii().to_vec();
                let plain = Material { name: name(&key), ..Material::default() };
                self.materials.insert(key.clone(), plain);
                current = Some(key);
                continue;
            }
            let Some(material) = current.as_ref().and_then(|key| self.materials.get_mut(key))
            else {
                continue;
            };
            let mut values = words(rest).map_while(leading_number);
            match keyword {
                b"Kd" => {
                    if let Some(r) = values.next() {
                        let g = values.next().unwrap_or(r);
                        let rgb = [r, g, values.next().unwrap_or(g)].map(colour::byte);
                        material.colour[..3].copy_from_slice(&rgb);
                    }
                }
                b"d" => {
                    if let Some(opacity) = values.next() {
                        material.colour[3] = colour::byte(opacity);
                    }
                }
                b"Tr" => {
                    if let Some(transparency) = values.next() {
                        material.colour[3] = colour::byte(1.0 - transparency);
                    }
                }
                b"map_Kd" => paint(material, file_name(rest), &mut self.images, files, run),
                _ => {}
            }
        }
    }
}

/// Gives `material` its image. Exporters write a black `Kd` beside an image that is meant alone.
fn paint(
    material: &mut Material,
    file: &[u8],
    images: &mut FxHashMap<Vec<u8>, Texture>,
    files: &dyn Files,
    run: &Run,
) {
    let image = match images.get(file) {
        Some(image) => Ok(image.clone()),
        None => open_named(&name(file), files).map_err(|error| error.to_string()).and_then(|b| {
            let strange = || format!("{} is neither PNG nor JPEG", name(file));
            colour::texture(&b).ok_or_else(strange)
        }),
    };
    match image {
        Ok(image) => {
            images.insert(file.to_vec(), image.clone());
            material.texture = Some(image);
            if material.colour[..3] == [0; 3] {
                material.colour[..3].fill(255);
            }
        }
        Err(fact) => {
            let text = format!("material {} is left without its image: {fact}", material.name);
            run.finding(Finding::warning("missing-image", text));
        }
    }
}

/// The files of one statement: one name that may hold spaces, or several names.
fn open(statement: &[u8], files: &dyn Files) -> Result<Vec<crate::Bytes>, ReadError> {
    let whole = open_named(&name(statement), files);
    if whole.is_err() && words(statement).nth(1).is_some() {
        let each = words(statement).map(|word| open_named(&name(word), files));
        if let Ok(found) = each.collect() {
            return Ok(found);
        }
    }
    Ok(vec![whole?])
}

/// A file by its name, or by the last part of it where the path leads nowhere from here.
fn open_named(name: &str, files: &dyn Files) -> Result<crate::Bytes, ReadError> {
    let slashed = name.trim_matches('"').replace('\\', "/");
    files.open(&slashed).or_else(|error| match slashed.rsplit_once('/') {
        Some((_, last)) => files.open(last).map_err(|_| error),
        None => Err(error),
    })
}

/// What a texture statement names behind its options.
fn file_name(mut rest: &[u8]) -> &[u8] {
    loop {
        let (word, after) = split_word(rest);
        let counted = match word {
            b"-blendu" | b"-blendv" | b"-boost" | b"-cc" | b"-clamp" | b"-texres" | b"-imfchan"
            | b"-bm" | b"-type" => Some(1),
            b"-mm" => Some(2),
            b"-o" | b"-s" | b"-t" => None,
            _ => return rest.trim_ascii(),
        };
        rest = after;
        // Offsets, scales and turbulence have one to three numbers.
        for _ in 0..counted.unwrap_or(3) {
            let (value, after) = split_word(rest);
            if counted.is_none() && crate::text::number(value).is_none() {
                break;
            }
            rest = after;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_stand_before_the_file_name() {
        assert_eq!(file_name(b" -s 1 2 3 -bm 0.5 my wood.png "), b"my wood.png");
        assert_eq!(file_name(b"-o 0.5 -clamp on a.png"), b"a.png");
        assert_eq!(file_name(b"-s 1"), b"");
    }
}
