//! Files of solids: round trips, pinned bytes, damage, and what reads only parts.

use super::*;
use octofold::volume::DenseVolume;

pub(super) const LAYOUTS: [Layout; 3] = [
    Layout { mode: Mode::Fast, bricks: false },
    Layout { mode: Mode::Archive, bricks: false },
    Layout { mode: Mode::Fast, bricks: true },
];

/// A ball with a hole, as dense samples.
fn ball(dims: [usize; 3], placement: Placement) -> DenseVolume<u8> {
    let mut samples = Vec::new();
    for z in 0..dims[2] {
        for y in 0..dims[1] {
            for x in 0..dims[0] {
                let off = [x, y, z].map(|i| (2 * i) as i64 - dims[2] as i64);
                let inside = off.iter().map(|v| v * v).sum::<i64>() < (dims[2] * dims[2]) as i64;
                samples.push(u8::from(inside && (x > 5 || y != 7)));
            }
        }
    }
    let mut volume = DenseVolume::new(dims, samples, placement).unwrap();
    volume.binary = true;
    volume
}

fn written(volume: &dyn Volume, layout: Layout) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_as(volume, layout, &mut Sink::new(&mut bytes, "x"), &Run::default()).unwrap();
    bytes
}

fn open(bytes: &[u8]) -> Result<File, ReadError> {
    File::open(&Source::from_bytes("x.ofn", bytes), &Run::default())
}

fn samples(volume: &dyn Volume, region: Region) -> Vec<f64> {
    let block = volume.read(region).unwrap();
    (0..block.len()).map(|i| block.value(i)).collect()
}

#[test]
fn every_layout_keeps_everything() {
    let turned = Placement {
        axes: [[0.0, 2.0, 0.0], [-2.0, 0.0, 0.0], [0.0, 0.0, 3.5]],
        origin: [1.0, -2.0, 0.25],
        unit: Some(LengthUnit::Metre),
    };
    let upright = Placement { origin: [0.1; 3], ..Placement::spacing([0.5; 3]) };
    let in_feet = Placement { unit: Some(LengthUnit::Foot), ..Placement::default() };
    for (dims, placement) in [
        ([70, 66, 65], turned),
        ([67, 67, 67], upright),
        ([130, 3, 9], in_feet),
        ([1, 1, 1], Placement::default()),
    ] {
        let volume = ball(dims, placement);
        for layout in LAYOUTS {
            let bytes = written(&volume, layout);
            let file = open(&bytes).unwrap();
            assert_eq!(
                (file.dims(), file.layout(), file.size()),
                (dims, layout, bytes.len() as u64)
            );
            assert_eq!(file.placement(), placement);
            let run = Run::default();
            let solid = file.solid(&run).unwrap();
            assert_eq!(solid.placement, placement);
            assert_eq!(samples(&solid, Region::all(dims)), samples(&volume, Region::all(dims)));
            let start = dims.map(|n| n / 3);
            let region = Region { start, end: dims.map(|n| (n / 3 + 20).min(n)) };
            let part = file.region(region, &run).unwrap();
            let all = Region::all(region.dims());
            assert_eq!(samples(&part, all), samples(&volume, region));
            assert_eq!(part.placement.place([0.0; 3]), placement.place(start.map(|i| i as f64)));
            for at in [[0; 3], start, dims.map(|n| n - 1), dims] {
                let expected = solid.contains(at.map(|i| i as u32));
                assert_eq!(file.contains(at, &run).unwrap(), expected, "{at:?}");
            }
        }
    }
}

#[test]
fn files_are_pinned_byte_for_byte() {
    let upright = Placement { origin: [0.0, 1.0, 0.0], ..Placement::spacing([0.5; 3]) };
    let hex = |layout| -> String {
        let bytes = written(&ball([9, 8, 8], upright), layout);
        bytes.iter().map(|b| format!("{b:02x}")).collect()
    };
    let pinned = [
        concat!(
            "4f464e0118090808000000000000e03f0000000000000000000000000000f03f00000000",
            "000000002b038eecbfbaa866735eaf2294f38ac0d0f66030db8e3302",
        ),
        concat!(
            "4f464e0119090808000000000000e03f0000000000000000000000000000f03f00000000",
            "000000002b038ee8abcdc35db1e5f135a1846518a05ce935723f",
        ),
        concat!(
            "4f464e031a090808000000000000e03f0000000000000000000000000000f03f00000000",
            "000000002b0203c0c6b296f95199780ba215e4351e0dfb8093f5700e",
        ),
    ];
    assert_eq!(LAYOUTS.map(hex), pinned);
}

#[test]
fn bricks_of_the_first_versions_are_read() {
    // Four bricks, the last two of them nearly empty.
    let written = concat!(
        "4f464e0102461442c70603d0012b3fd96ec3ae7a97140eb5f52c0754cacf1ab11e762f4e",
        "b48e5f7309f5ee9983371938ded6c65e8f6218add3babb7e8d8897e2989b58273503cd38",
        "10425e53422ff1babfe2118d091c402838ecb2faafa5b95988562edb43b345ec086994a2",
        "10d3dce02e5441fce3596f9e5c32df2868293d371b9ff1206cca7e706dbf6ec8459d404b",
        "fa938421ffaa3d989e1072d0e6b0683806d3f161ac4e839c3ddbc09946de6f17bfa119fb",
        "090f3f9022608a954f85c0315c5f4120a9f5f0cb8562738c633e4b1f2241ba0e00255822",
        "8ac3bade03fcd9f2b32e1c8956563e37547e2b5b972ed5fff8aae6a5f21dcb6a82f97810",
        "becd1ef3aa5f60a001a503fd81caac1e94a536decf0312df51e3629ac066e18e68d50627",
        "27902c11063d54fcdbe5aad3efdfd4db9cd4e11c2a69ad9c74ad25daef56a16277cb7091",
        "a2f20e96289b25c87c6fc5ea6dd9475a",
    );
    let bytes: Vec<u8> = written
        .as_bytes()
        .chunks(2)
        .map(|two| u8::from_str_radix(std::str::from_utf8(two).unwrap(), 16).unwrap())
        .collect();
    let expected = ball([70, 20, 66], Placement::default());
    let all = Region::all(expected.dims());
    let file = open(&bytes).unwrap();
    let run = Run::default();
    assert_eq!(samples(&file.solid(&run).unwrap(), all), samples(&expected, all));
    for end in 0..bytes.len() {
        let read = open(&bytes[..end]).and_then(|file| file.solid(&run).map(|_| ()));
        assert!(read.is_err(), "{end}");
    }
}

#[test]
fn damage_is_an_error_even_where_sums_are_mended() {
    let volume = ball([70, 20, 66], Placement::spacing([2.0; 3]));
    let mut random = crate::dice::dice();
    for layout in LAYOUTS {
        let bytes = written(&volume, layout);
        let sums = sums(&bytes);
        for round in 0..120 {
            let mut damaged = bytes.clone();
            for _ in 0..1 + random() % 3 {
                // Headers more often than streams.
                let end = if round % 2 == 0 { 60 } else { bytes.len() };
                let at = random() % end.min(bytes.len());
                damaged[at] = random() as u8;
            }
            let read = |bytes: &[u8]| {
                let run = Run::default();
                let file = open(bytes)?;
                // A damaged count may ask for more work than a test should do.
                let slabs = file.slabs(&run)?.next_slab(&run)?;
                file.contains([3, 4, 5], &run)?;
                Ok::<_, ReadError>(slabs)
            };
            if damaged != bytes && !layout.bricks {
                assert!(read(&damaged).is_err(), "a sum must tell");
            }
            for (range, at) in &sums {
                let sum = crc32c(&damaged[range.clone()]);
                damaged[*at..at + SUM].copy_from_slice(&sum.to_le_bytes());
            }
            let _ = read(&damaged);
        }
    }
}

/// Where sums stand, and of which bytes.
fn sums(bytes: &[u8]) -> Vec<(Range<usize>, usize)> {
    match &open(bytes).unwrap().body {
        Body::Stream(range) => vec![(0..range.end, range.end)],
        Body::Bricks(_, stored) => stored.sums.clone(),
    }
}

#[test]
fn absurd_headers_are_refused() {
    let summed = |mut bytes: Vec<u8>| {
        put_sum(&mut bytes);
        bytes
    };
    let head = |flags: u8, rest: &[u8]| summed([MAGIC, &[flags], rest].concat());
    for (bytes, says) in [
        (b"OFN\x05....".to_vec(), "version 5"),
        (summed([MAGIC_BRICKS[0], &[CUBE, 1, 1]].concat()), "no bricks"),
        (b"VOX ".to_vec(), "does not begin"),
        (head(CUBE, &[0]), "no voxels"),
        (head(CUBE, &[0x81, 0x80, 0x04]), "65537 voxels"),
        (head(CUBE, &[255; 12]), "does not end"),
        (head(CUBE | 7 << 5, &[1, 1]), "no such unit"),
        (head(CUBE, &[1, 255, 255, 255, 255, 15]), "runs of voxels"),
        (head(CUBE | PLACED, &[1, 1]), "cut off"),
        (head(CUBE | BRICKS, &[128, 128, 4, 1, 0]), "damaged"),
        (head(CUBE | BRICKS, &[1, 1, 100]), "cut off"),
    ] {
        let error = open(&bytes).err().unwrap().to_string();
        assert!(error.contains(says), "{error}");
    }
    // 65536 voxels along each axis, and nothing in them.
    let empty = open(&head(CUBE, &[128, 128, 4, 0])).unwrap();
    assert_eq!(empty.dims(), [1 << 16; 3]);
    assert!(open(&summed(MAGIC.to_vec())).is_err());
    assert_eq!(crc32c(b"123456789"), 0xE306_9283);
}
