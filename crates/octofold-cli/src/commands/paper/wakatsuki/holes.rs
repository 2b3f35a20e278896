//! Holes of a mesh closed by fans, since marching cubes must know inside from outside.

use octofold::Mesh;
use std::collections::BTreeMap;

/// Closes every border that runs through each of its points once, and tells how many there were.
pub fn close(mesh: &Mesh) -> (Mesh, usize) {
    let mut sides: BTreeMap<[u32; 2], i32> = BTreeMap::new();
    for &[a, b, c] in &mesh.triangles {
        for [p, q] in [[a, b], [b, c], [c, a]] {
            *sides.entry([p, q]).or_default() += 1;
            *sides.entry([q, p]).or_default() -= 1;
        }
    }
    // The way back along a border, by where it starts.
    let back = |(&[p, q], &n): (&[u32; 2], &i32)| (n > 0).then_some((q, p));
    let mut onward: BTreeMap<u32, u32> = sides.iter().filter_map(back).collect();
    let mut closed = Mesh { attributes: Default::default(), ..mesh.clone() };
    let mut holes = 0;
    while let Some((start, mut at)) = onward.pop_first() {
        let mut border = vec![start];
        while at != start {
            border.push(at);
            let Some(next) = onward.remove(&at) else { break };
            at = next;
        }
        if at != start || border.len() < 3 {
            continue;
        }
        holes += 1;
        let count = border.len() as f64;
        let mean =
            |a: usize| border.iter().map(|&p| mesh.points[p as usize][a]).sum::<f64>() / count;
        let middle = closed.points.len() as u32;
        closed.points.push(std::array::from_fn(mean));
        let next = border.iter().cycle().skip(1);
        closed.triangles.extend(border.iter().zip(next).map(|(&p, &q)| [p, q, middle]));
    }
    (closed, holes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use octofold::Run;
    use octofold::measure::{Weld, measure};
    use octofold::samples::Sample;

    #[test]
    fn a_sphere_with_holes_is_closed_again() {
        let mut mesh = Sample::Sphere.polygons(40).map(|s| s.triangulate()).unwrap();
        mesh.triangles.remove(700);
        mesh.triangles.drain(0..20);
        let (closed, holes) = close(&mesh);
        let measures = measure(&closed, Weld::Off, &Run::default()).unwrap();
        assert!(measures.closed && measures.oriented && holes >= 2, "{holes}");
        assert_eq!(close(&closed).1, 0);
    }
}
