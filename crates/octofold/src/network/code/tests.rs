//! Tests of solids as bytes: nothing is lost, whatever the solid, and damaged bytes are an error.

use super::bricks::{self, Bricks, Content};
use super::*;
use crate::network::tests::noise;
use crate::volume::Region;
use proptest::prelude::*;

const MODES: [Mode; 2] = [Mode::Fast, Mode::Archive];

fn written(solid: &Spans, mode: Mode) -> (Vec<u8>, u64) {
    let [width, height, _] = solid.dims();
    let mut writer = Writer::new([width, height], mode);
    writer.push(solid, &Run::default()).unwrap();
    writer.finish()
}

fn read(dims: [usize; 3], mode: Mode, bytes: &[u8], most: u64) -> Result<Spans, CodeError> {
    let [width, height, depth] = dims;
    Reader::new([width, height], mode, bytes, most).pull(depth, &Run::default())
}

fn dims() -> impl Strategy<Value = [usize; 3]> {
    (1usize..150, 1usize..20, 1usize..12).prop_map(|(x, y, z)| [x, y, z])
}

proptest! {
    #![proptest_config(crate::sweep::cases(60))]

    #[test]
    fn streams_lose_nothing(
        dims in dims(),
        seed in any::<u64>(),
        coarse in 1usize..30,
        percent in 0u64..=100,
        slab in 1usize..5,
    ) {
        let solid = noise(dims, seed, coarse, percent);
        for mode in MODES {
            let (bytes, runs) = written(&solid, mode);
            prop_assert_eq!(&read(dims, mode, &bytes, runs).unwrap(), &solid);
            // Slab after slab it is the same.
            let mut reader = Reader::new([dims[0], dims[1]], mode, &bytes, runs);
            let depths = (0..dims[2]).step_by(slab).map(|z| slab.min(dims[2] - z));
            let slabs: Vec<Spans> =
                depths.map(|depth| reader.pull(depth, &Run::default()).unwrap()).collect();
            let mut writer = Writer::new([dims[0], dims[1]], mode);
            slabs.iter().for_each(|slab| writer.push(slab, &Run::default()).unwrap());
            prop_assert_eq!(writer.finish(), (bytes.clone(), runs));
            prop_assert_eq!(Spans::stack([dims[0], dims[1]], solid.placement, slabs), solid.clone());
            if runs > 0 {
                let refused = read(dims, mode, &bytes, runs - 1);
                prop_assert_eq!(refused, Err(CodeError::TooMany(runs - 1)));
            }
        }
    }

    #[test]
    fn damaged_streams_end(
        dims in dims(),
        seed in any::<u64>(),
        coarse in 1usize..30,
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        cut in any::<prop::sample::Index>(),
    ) {
        let solid = noise(dims, seed, coarse, 40);
        for mode in MODES {
            let (mut bytes, runs) = written(&solid, mode);
            bytes.truncate(cut.index(bytes.len() + 1));
            for (at, value) in &flips {
                if !bytes.is_empty() {
                    let at = at.index(bytes.len());
                    bytes[at] = *value;
                }
            }
            // An error or another solid, but no more than was promised.
            if let Ok(solid) = read(dims, mode, &bytes, runs) {
                let mut count = 0;
                solid.for_each_row(|_, row| count += row.len() as u64);
                prop_assert!(count <= runs);
            }
        }
    }
}

proptest! {
    #![proptest_config(crate::sweep::cases(40))]

    #[test]
    fn bricks_lose_nothing_and_are_read_alone(
        dims in (1usize..150, 1usize..140, 1usize..80),
        seed in any::<u64>(),
        coarse in 4usize..100,
        percent in 0u64..=100,
        corners in prop::array::uniform2(prop::array::uniform3(any::<prop::sample::Index>())),
    ) {
        let dims = [dims.0, dims.1, dims.2];
        let solid = noise(dims, seed, coarse, percent);
        let run = Run::default();
        let (cut, streams) = bricks::encode(&solid, &run).unwrap();
        let index = cut.to_bytes();
        let most = streams.iter().map(|s| s.len() as u64).sum();
        prop_assert_eq!(&Bricks::from_bytes(dims, &index, most).unwrap(), &cut);
        let stream = |i: u32| Ok::<_, CodeError>(&streams[i as usize][..]);
        let whole = cut.region(Region::all(dims), stream, &run).unwrap();
        prop_assert_eq!(&whole, &solid);
        let corners = corners.map(|c| std::array::from_fn::<usize, 3, _>(|a| c[a].index(dims[a])));
        let region = Region {
            start: std::array::from_fn(|a| corners[0][a].min(corners[1][a])),
            end: std::array::from_fn(|a| corners[0][a].max(corners[1][a]) + 1),
        };
        let part = cut.region(region, stream, &run).unwrap();
        let all = Region::all(part.dims());
        prop_assert_eq!(part.dims(), region.dims());
        prop_assert_eq!(part.read(all).unwrap(), solid.read(region).unwrap());
        for at in corners {
            prop_assert_eq!(cut.is_filled(at, stream).unwrap(), solid.contains(at.map(|i| i as u32)));
        }
        prop_assert!(!cut.is_filled([dims[0], 0, 0], stream).unwrap());
        // Damage is an error or another solid.
        for end in 0..index.len() {
            let _ = Bricks::from_bytes(dims, &index[..end], most);
        }
        let half = |i: u32| Ok::<_, CodeError>(&streams[i as usize][..streams[i as usize].len() / 2]);
        let _ = cut.is_filled(corners[0], half);
        let _ = cut.region(region, half, &run);
    }

    #[test]
    fn what_goes_on_goes_on_in_parts(
        tilt in prop::array::uniform3(-9i32..10),
        at in prop::array::uniform3(0i32..130),
        count in prop::array::uniform3(1usize..3),
    ) {
        // Half-spaces in boxes whose last bricks are cut off.
        let dims = count.map(|n| 64 * n - 7 * (n % 3));
        let solid = crate::network::tests::solid(dims, |p| {
            (0..3).map(|a| tilt[a] * (p[a] as i32 - at[a])).sum::<i32>() < 0
        });
        let run = Run::default();
        let (cut, streams) = bricks::encode(&solid, &run).unwrap();
        let stream = |i: u32| Ok::<_, CodeError>(&streams[i as usize][..]);
        prop_assert_eq!(&cut.region(Region::all(dims), stream, &run).unwrap(), &solid);
    }
}

#[test]
fn what_is_the_same_is_kept_once() {
    // A plate as high as a brick and twenty bricks long: its end differs, all else does not.
    let solid = crate::network::tests::solid([1280, 64, 64], |[x, y, _]| x < 1270 && y < 10);
    let (cut, streams) = bricks::encode(&solid, &Run::default()).unwrap();
    // Eight bricks twice, and four.
    assert_eq!(streams.len(), 2);
    assert_eq!(cut.contents()[..8], [Content::Part(0); 8]);
    assert_eq!(cut.contents()[8..16], [Content::Part(1); 8]);
    assert!(cut.to_bytes().len() < 8);
}

#[test]
fn bricks_of_the_first_versions_are_read() {
    let ball = ball();
    let stream = concat!(
        "0c09ec3f8cc364c4da2e68e99bb3ab26c1441b7d7fda1986a21798ac7e267e425135327c5faf4f16",
        "9d5265b4f7c0d915895ae806ff1df5320f654d26997cd5010889f191a2ea36690913f0b6a0f30c6f",
        "157e646bbc6df09f2a0a454417c993dc2a3b4289cebeb4d1e0cfda075402fb76461b00bb096cef76",
        "e865537987f11e2d266e6a002b0121ec609824b022ea885c0087a0",
    );
    let stream: Vec<u8> = stream
        .as_bytes()
        .chunks(2)
        .map(|two| u8::from_str_radix(std::str::from_utf8(two).unwrap(), 16).unwrap())
        .collect();
    let read = Bricks::from_first_bytes(ball.dims(), &[0xc0, 0x75, 0x80], 1000).unwrap();
    assert!(read.lengths().eq([stream.len() as u32]));
    let stream = |_| Ok::<_, CodeError>(&stream[..]);
    let all = Region::all(ball.dims());
    assert_eq!(read.region(all, stream, &Run::default()).unwrap(), ball);
    for at in [[0; 3], [12; 3], [11, 2, 13], [23, 12, 12]] {
        let expected = ball.contains(at.map(|i| i as u32));
        assert_eq!(read.is_filled(at, stream).unwrap(), expected);
    }
}

/// A ball of 24 voxels.
fn ball() -> Spans {
    crate::network::tests::solid([24; 3], |at| {
        at.iter().map(|&i| (2 * i as i32 - 23).pow(2)).sum::<i32>() < 400
    })
}

#[test]
fn absurd_boxes_are_refused() {
    let refused = Bricks::from_bytes([1 << 16; 3], &[0; 40], 1 << 40);
    assert_eq!(refused, Err(CodeError::Damaged));
    // Nothing but zeros says little about a large box, and ends.
    let empty = read([1 << 16, 64, 64], Mode::Fast, &[0; 4], 1 << 20);
    assert!(empty.is_err() || empty.is_ok_and(|solid| solid.count() < 1 << 40));
}

#[test]
fn bytes_are_pinned() {
    let ball = ball();
    let [fast, archive] = MODES.map(|mode| written(&ball, mode));
    assert_eq!((fast.1, archive.1), (316, 316));
    assert_eq!(
        hex(&fast.0),
        concat!(
            "08c8ef74f3d7f7466817e5b332a078bff54d003f0abd7c25dfe4eebaa6325fc5fed0c2b4d8d207fe",
            "aeebb538d5acdeb5b143b5f83aee5c7674961c6068b02d16d32377a3072b60f4bd8486bcc0812241",
            "e3412b1b9479dda7e6224b139f592b27f59d51ae6f2702cf16f93a95003f3a6df4abe8f7dce1f213",
            "1584dcb7a1722304dab8fc21145eb4e2a4c3010208a0",
        )
    );
    assert_eq!(
        hex(&archive.0),
        concat!(
            "08c8ef297d7f6b6c3a5ed5ee0764e3bf43ff42389fac5c607f533a55be4bf02f2b4be1b3256471eb",
            "1c246c5f933b722603775e5a51d46c87d902b46db82e9101364c9300d55c4cff4684f05017d48e48",
            "46534f508c3aeceeedbaf231ece3707499820116c64a290acc5c13f16bdb069f638cac4d3f4895d0",
        )
    );
    let (cut, streams) = bricks::encode(&ball, &Run::default()).unwrap();
    assert_eq!(hex(&cut.to_bytes()), "007d80");
    assert_eq!(streams.len(), 1);
    assert_eq!(
        hex(&streams[0]),
        concat!(
            "c784fb872a25c43d76ecc41fdd25c38f288c833843058edd14b5e35e30ac7240038ab59509f039eb",
            "7f8f779ed3f9dac10dd2256d86a10f0920e934fb0a707c7686320ef309dba8b4ce8e8405d9cf8fe9",
            "d01e2e7e7cc2105f70cff1712786986ca4784033b3c3fe7089f7f4597bdaa4822316bda5aba6a868",
            "9d304044b6a7fbf271bea0",
        )
    );
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
