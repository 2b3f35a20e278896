//! The palette of files that bring none.

/// Colours of the indices 1 to 255: a cube of six steps a channel, from white down with blue
/// fastest and without black, then ten steps each of red, green, blue and gray.
pub(super) fn default() -> [[u8; 4]; 255] {
    const STEPS: [u8; 6] = [0xff, 0xcc, 0x99, 0x66, 0x33, 0];
    const RAMP: [u8; 10] = [0xee, 0xdd, 0xbb, 0xaa, 0x88, 0x77, 0x55, 0x44, 0x22, 0x11];
    let mut colours = [[0, 0, 0, 255]; 255];
    for (i, colour) in colours.iter_mut().enumerate() {
        let [r, g, b] = if i < 215 {
            [STEPS[i / 36], STEPS[i / 6 % 6], STEPS[i % 6]]
        } else {
            let (channel, step) = ((i - 215) / 10, RAMP[(i - 215) % 10]);
            std::array::from_fn(|c| if channel == 3 || c == channel { step } else { 0 })
        };
        colour[..3].copy_from_slice(&[r, g, b]);
    }
    colours
}

#[cfg(test)]
mod tests {
    #[test]
    fn it_is_the_palette_of_another_reader() {
        let known = dot_vox::DEFAULT_PALETTE.iter().map(<[u8; 4]>::from);
        for (i, (ours, theirs)) in super::default().into_iter().zip(known).enumerate() {
            assert_eq!(ours, theirs, "colour {i}");
        }
    }
}
