//! Numbers and a few letters as strokes, for pens and knives as well as for print: no font needed.

/// Strokes of a text whose capitals are 1 high, from the origin along x, and its width.
pub(crate) fn strokes(text: &str) -> (Vec<Vec<[f64; 2]>>, f64) {
    let mut strokes = Vec::new();
    let mut at = 0.0;
    for c in text.chars() {
        let (width, glyph) = glyph(c);
        for stroke in glyph.split(' ').filter(|s| !s.is_empty()) {
            let point = |pair: &[u8]| {
                [at + f64::from(pair[0] - b'0') / 6.0, f64::from(pair[1] - b'0') / 6.0]
            };
            strokes.push(stroke.as_bytes().chunks_exact(2).map(point).collect());
        }
        at += (width + 2.0) / 6.0;
    }
    (strokes, (at - 2.0 / 6.0).max(0.0))
}

/// Width of a character in sixths of its height, and its strokes: pairs of digits, x and y in
/// sixths.
fn glyph(c: char) -> (f64, &'static str) {
    match c {
        '0' => (4.0, "1030414536160501"),
        '0'..='9' => digit(c),
        '/' => (3.0, "0036"),
        '.' => (0.0, "0001"),
        '-' => (3.0, "0333"),
        'A' => (4.0, "002640 1232"),
        'B' => (3.0, "00062635332303 23323020100"),
        'm' => (4.0, "0004 03142320 23343430"),
        'x' => (3.0, "0034 0430"),
        _ => (2.0, ""),
    }
}

fn digit(c: char) -> (f64, &'static str) {
    match c {
        '1' => (2.0, "042620"),
        '2' => (4.0, "05163645440040"),
        '3' => (4.0, "05163645443313 334241301001"),
        '4' => (4.0, "36024232 3630"),
        '5' => (4.0, "46060413344241301001"),
        '6' => (4.0, "45361605011030414233130201"),
        '7' => (4.0, "064610"),
        '8' => (4.0, "1333444536160504130201103041423313"),
        _ => (4.0, "01103041453616050413334445"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_character_stays_in_its_box() {
        for c in "0123456789/.-ABmx".chars() {
            let (strokes, width) = strokes(&c.to_string());
            assert!(!strokes.is_empty(), "{c}");
            for [x, y] in strokes.into_iter().flatten() {
                assert!((0.0..=width.max(0.01)).contains(&x) && (0.0..=1.0).contains(&y), "{c}");
            }
        }
    }

    #[test]
    fn characters_follow_each_other() {
        let (one, two) = (strokes("7").1, strokes("77").1);
        assert!((two - 2.0 * one - 2.0 / 6.0).abs() < 1e-12);
    }
}
