//! Bins: the triangles of a box by the places that they are near, to ask what is in the way.

use glam::DVec3;

/// Most bins along an edge of the box.
const MOST: f64 = 32.0;

/// Bins along the edges of a cube, each with the numbers of the triangles whose boxes touch it.
pub struct Bins {
    corner: DVec3,
    /// Bins to one sample's distance.
    scale: f64,
    count: usize,
    lists: Vec<Vec<u32>>,
}

impl Bins {
    /// For a cube of `size` at `corner` and triangles of about `extent`.
    pub fn new(corner: DVec3, size: f64, extent: f64) -> Self {
        let count = (size / (2.0 * extent)).clamp(1.0, MOST).ceil();
        let scale = count / size;
        let count = count as usize;
        Self { corner, scale, count, lists: vec![Vec::new(); count * count * count] }
    }

    /// Adds a triangle by its box; what lies outside of the cube is at its border.
    pub fn enter(&mut self, number: u32, span: [DVec3; 2]) {
        self.visit(span, |list| {
            list.push(number);
            true
        });
    }

    /// Calls `see` with the triangles near a box, some of them more than once, until it gives
    /// false; then gives false. Those for which `is_there` is false are forgotten.
    pub fn near(
        &mut self,
        span: [DVec3; 2],
        is_there: impl Fn(u32) -> bool,
        mut see: impl FnMut(u32) -> bool,
    ) -> bool {
        self.visit(span, |list| {
            list.retain(|&number| is_there(number));
            list.iter().all(|&number| see(number))
        })
    }

    fn visit(&mut self, span: [DVec3; 2], mut see: impl FnMut(&mut Vec<u32>) -> bool) -> bool {
        let most = self.count as f64 - 1.0;
        let [first, last] = span.map(|p| {
            let at = ((p - self.corner) * self.scale).clamp(DVec3::ZERO, DVec3::splat(most));
            at.to_array().map(|x| x as usize)
        });
        for z in first[2]..=last[2] {
            for y in first[1]..=last[1] {
                let row = (z * self.count + y) * self.count;
                for list in &mut self.lists[row + first[0]..=row + last[0]] {
                    if !see(list) {
                        return false;
                    }
                }
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_entered_is_found_until_it_is_gone() {
        let mut bins = Bins::new(DVec3::splat(8.0), 64.0, 3.0);
        let span = |x: f64| [DVec3::splat(x), DVec3::splat(x + 5.0)];
        for i in 0..20u32 {
            bins.enter(i, span(4.0 * f64::from(i)));
        }
        let mut found = Vec::new();
        bins.near(
            span(30.0),
            |i| i != 7,
            |i| {
                found.push(i);
                true
            },
        );
        for i in 0..20 {
            let x = 4.0 * f64::from(i);
            let overlaps = x <= 35.0 && x + 5.0 >= 30.0;
            assert!(!overlaps || i == 7 || found.contains(&i), "{i}");
        }
        assert!(!found.contains(&7) && !found.contains(&0));
    }
}
