//! What is known of solids before the first voxel: a regression on the sixteen nearest voxels.
//!
//! Fitted once, to 6 million voxels at the surfaces of 400 random solids of 64 voxels a side (boxes,
//! balls, cylinders and half-spaces, aligned and turned, united, intersected and cut, and rough balls).
//! The numbers belong to the file format.

/// Logarithms of odds, in parts of 256, for each of the sixteen voxels, as they stand in a context.
pub const WEIGHTS: [i32; 16] =
    [-161, 677, 107, 569, 320, -214, -207, -24, -133, -29, 413, 214, 53, 233, 125, -301];

/// What does not depend on voxels.
pub const CONSTANT: i32 = 39;

/// The odds that a voxel is filled.
pub fn odds(near: u32) -> i32 {
    let weigh = |(i, &weight): (usize, &i32)| if near >> i & 1 == 1 { weight } else { -weight };
    WEIGHTS.iter().enumerate().map(weigh).sum::<i32>() + CONSTANT
}
