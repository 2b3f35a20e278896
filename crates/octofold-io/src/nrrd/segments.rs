//! The `Segment…` keys of segmentations, as 3D Slicer writes them.

use octofold::volume::Label;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Names and colours of the segments of the first layer, by segment number.
pub(super) fn labels(pairs: &[(String, String)]) -> Vec<Label> {
    let mut segments: BTreeMap<u32, Segment<'_>> = BTreeMap::new();
    for (key, value) in pairs {
        let Some((number, property)) =
            key.strip_prefix("Segment").and_then(|rest| rest.split_once('_'))
        else {
            continue;
        };
        let Ok(number) = number.parse() else { continue };
        let segment = segments.entry(number).or_default();
        match property {
            "Name" => segment.name = Some(value),
            "Color" => segment.colour = colour(value),
            "LabelValue" => segment.value = value.trim().parse().ok(),
            "Layer" => segment.layer = value.trim().parse().unwrap_or(0),
            _ => {}
        }
    }
    segments
        .into_values()
        .filter(|segment| segment.layer == 0)
        .filter_map(|segment| {
            Some(Label {
                value: segment.value?,
                name: segment.name.unwrap_or_default().to_owned(),
                colour: segment.colour.unwrap_or([255; 4]),
            })
        })
        .collect()
}

#[derive(Default)]
struct Segment<'a> {
    name: Option<&'a str>,
    colour: Option<[u8; 4]>,
    value: Option<u32>,
    layer: u32,
}

/// Three parts from 0 to 1.
fn colour(text: &str) -> Option<[u8; 4]> {
    let mut parts = text.split_whitespace().map(|part| part.parse::<f64>());
    let mut next = || Some((parts.next()?.ok()? * 255.0).round() as u8);
    Some([next()?, next()?, next()?, 255])
}

/// Writes labels as the segments of one layer.
pub(super) fn write(labels: &[Label], text: &mut String) {
    for (i, label) in labels.iter().enumerate() {
        let [r, g, b, _] = label.colour.map(|part| f64::from(part) / 255.0);
        let name = label.name.replace('\\', "\\\\").replace('\n', "\\n").replace('\r', " ");
        // Writing into a string cannot fail.
        let _ = write!(
            text,
            "Segment{i}_ID:=Segment_{i}\nSegment{i}_Name:={name}\n\
             Segment{i}_Color:={r:.6} {g:.6} {b:.6}\nSegment{i}_LabelValue:={}\n\
             Segment{i}_Layer:=0\n",
            label.value
        );
    }
}
