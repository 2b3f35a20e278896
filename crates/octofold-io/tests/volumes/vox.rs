//! Scenes of MagicaVoxel, made by hand, and our own files through another reader.

use super::{read, read_with_findings, refusal, samples, written};
use octofold::Placement;
use octofold::volume::{Block, DenseVolume, Label};
use octofold_io::Source;

pub(crate) fn chunk(id: &[u8; 4], content: &[u8]) -> Vec<u8> {
    [&id[..], &words(&[content.len() as u32, 0]), content].concat()
}

pub(crate) fn words(numbers: &[u32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

fn dict(entries: &[(&str, &str)]) -> Vec<u8> {
    let mut out = words(&[entries.len() as u32]);
    for text in entries.iter().flat_map(|&(key, value)| [key, value]) {
        out.extend(words(&[text.len() as u32]));
        out.extend(text.as_bytes());
    }
    out
}

pub(crate) fn model(size: [u32; 3], voxels: &[[u8; 4]]) -> Vec<u8> {
    let content = [&words(&[voxels.len() as u32])[..], voxels.as_flattened()].concat();
    [chunk(b"SIZE", &words(&size)), chunk(b"XYZI", &content)].concat()
}

pub(crate) fn transform(id: u32, child: u32, layer: u32, frame: &[(&str, &str)]) -> Vec<u8> {
    let content =
        [words(&[id]), dict(&[("_name", "n")]), words(&[child, u32::MAX, layer, 1]), dict(frame)];
    chunk(b"nTRN", &content.concat())
}

pub(crate) fn group(id: u32, children: &[u32]) -> Vec<u8> {
    chunk(b"nGRP", &[words(&[id, 0, children.len() as u32]), words(children)].concat())
}

pub(crate) fn shape(id: u32, model: u32) -> Vec<u8> {
    chunk(b"nSHP", &words(&[id, 0, 1, model, 0]))
}

pub(crate) fn file(chunks: &[Vec<u8>]) -> Vec<u8> {
    let children = chunks.concat();
    let mut out = b"VOX ".to_vec();
    out.extend(words(&[200]));
    out.extend(b"MAIN");
    out.extend(words(&[0, children.len() as u32]));
    out.extend(children);
    out
}

/// A small scene with everything in it.
pub(crate) fn scene() -> Vec<u8> {
    file(&[
        model([2, 1, 1], &[[0, 0, 0, 1], [1, 0, 0, 2]]),
        model([1, 1, 1], &[[0, 0, 0, 79]]),
        transform(0, 1, u32::MAX, &[]),
        group(1, &[2, 4, 6]),
        transform(2, 3, 0, &[("_t", "1 0 0")]),
        shape(3, 0),
        // A quarter turn about z, as rows (0 -1 0), (1 0 0), (0 0 1).
        transform(4, 5, 0, &[("_r", "17"), ("_t", "3 0 0")]),
        shape(5, 0),
        transform(6, 7, 1, &[("_t", "100 100 100")]),
        shape(7, 1),
        chunk(b"LAYR", &[words(&[1]), dict(&[("_hidden", "1")]), words(&[u32::MAX])].concat()),
        chunk(b"RGBA", &(0..=255).flat_map(|i| [i, 7, 8, 255]).collect::<Vec<u8>>()),
    ])
}

#[test]
fn a_scene_is_placed_turned_and_coloured() {
    let (volume, codes) = read_with_findings(&Source::from_bytes("x.vox", scene()));
    // Model 0 covers x from 0 to 2, and turned y from -1 to 1 left of x = 3.
    assert_eq!(volume.dims(), [3, 2, 1]);
    assert_eq!(samples(&*volume), Block::U8(vec![0, 0, 1, 1, 2, 2].into()));
    assert_eq!(volume.placement().origin, [0.5, -0.5, 0.5]);
    let label = |value, r| Label { value, name: String::new(), colour: [r, 7, 8, 255] };
    assert_eq!(volume.labels(), [label(1, 0), label(2, 1)]);
    assert_eq!(codes, ["hidden-nodes"]);
}

#[test]
fn a_file_without_scene_lies_at_the_origin() {
    let volume = read("x.vox", file(&[model([3, 2, 2], &[[2, 1, 1, 255]])])).unwrap();
    assert_eq!(volume.dims(), [3, 2, 2]);
    assert_eq!(volume.placement().origin, [0.5; 3]);
    assert_eq!(samples(&*volume).value(11), 255.0);
    assert_eq!(volume.labels()[0].colour, [0x11, 0x11, 0x11, 255]);
}

#[test]
fn damaged_scenes_are_refused_in_words() {
    let cube = || model([1, 1, 1], &[[0, 0, 0, 1]]);
    for (chunks, says) in [
        (vec![], "no voxels"),
        (vec![model([1, 1, 1], &[[1, 0, 0, 1]])], "not in its model"),
        (vec![model([0, 1, 1], &[])], "size 0"),
        (vec![chunk(b"XYZI", &words(&[0]))], "before its size"),
        (vec![cube(), transform(0, 0, 0, &[])], "met twice"),
        (vec![cube(), transform(0, 9, 0, &[])], "no node 9"),
        (vec![cube(), transform(0, 1, 0, &[]), shape(1, 5)], "names model 5"),
        (vec![cube(), transform(0, 1, 0, &[("_r", "0")]), shape(1, 0)], "node 0 is damaged"),
        (vec![cube(), transform(0, 1, 0, &[("_t", "1 2")]), shape(1, 0)], "node 0 is damaged"),
        (vec![cube(), group(0, &[1, 1]), shape(1, 0)], "met twice"),
        (
            vec![
                cube(),
                group(0, &[1, 2]),
                transform(1, 3, 0, &[("_t", "2000000000 2000000000 0")]),
                transform(2, 4, 0, &[("_t", "-2000000000 0 -2000000000")]),
                shape(3, 0),
                shape(4, 0),
            ],
            "closer together",
        ),
    ] {
        let said = refusal(&Source::from_bytes("x.vox", file(&chunks)));
        assert!(said.contains(says), "{said}");
    }
}

#[test]
fn large_volumes_become_several_models_that_another_reader_reads() {
    let dims = [300, 2, 260];
    let mut samples_in = vec![0u8; 300 * 2 * 260];
    for (i, index) in [(0, 1), (299, 2), (300 * 2 * 259 + 299, 255), (300 * 2 * 258 + 40, 9)] {
        samples_in[i] = index;
    }
    let placement = Placement { origin: [-9.5, 0.5, 3.5], ..Placement::default() };
    let volume = DenseVolume::new(dims, samples_in, placement).unwrap();
    let bytes = written(&volume, "v.vox");
    let theirs = dot_vox::load_bytes(&bytes).unwrap();
    assert_eq!(theirs.models.len(), 4);
    assert_eq!(theirs.models.iter().map(|m| m.voxels.len()).sum::<usize>(), 4);
    assert_eq!(theirs.scenes.len(), 2 + 2 * 4);
    let back = read("v.vox", bytes).unwrap();
    assert_eq!(back.dims(), dims);
    assert_eq!(back.placement(), placement);
    assert_eq!(samples(&*back), samples(&volume));
}
