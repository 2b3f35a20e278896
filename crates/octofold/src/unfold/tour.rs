//! One closed line round all tiles of a face with holes, which passes some sides twice.

/// Goes round tiles that hang together across sides: tiles are taken in one after the other, each
/// at a side that the line already passes, so that the line encloses all of them once.
pub(super) fn tour(tiles: &[Vec<u32>]) -> Vec<u32> {
    let mut line: Vec<u32> = tiles[0].clone();
    let mut left: Vec<&Vec<u32>> = tiles[1..].iter().collect();
    while !left.is_empty() {
        let n = line.len();
        let found = (0..n).find_map(|i| {
            let back = [line[(i + 1) % n], line[i]];
            let side = |tile: &Vec<u32>| {
                (0..tile.len()).find(|&k| [tile[k], tile[(k + 1) % tile.len()]] == back)
            };
            left.iter().enumerate().find_map(|(j, tile)| Some((i, j, side(tile)?)))
        });
        let Some((i, j, k)) = found else { break };
        let tile = left.remove(j);
        // Between the ends of the side come all other corners of the tile.
        let others = (2..tile.len()).map(|step| tile[(k + step) % tile.len()]);
        line.splice(i + 1..i + 1, others);
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_gone_round_once() {
        // A square ring in eight triangles: outer corners 0 to 3, inner ones 4 to 7.
        let mut tiles = Vec::new();
        for k in 0..4u32 {
            let next = (k + 1) % 4;
            tiles.push(vec![k, next, 4 + next]);
            tiles.push(vec![k, 4 + next, 4 + k]);
        }
        let line = tour(&tiles);
        assert_eq!(line.len(), 10);
        let n = line.len();
        let steps: Vec<[u32; 2]> = (0..n).map(|i| [line[i], line[(i + 1) % n]]).collect();
        let twice = steps.iter().filter(|[a, b]| steps.contains(&[*b, *a])).count();
        assert_eq!(twice, 2);
    }
}
