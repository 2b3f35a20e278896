//! Text of mesh files: encodings, statements, words and numbers.

use std::borrow::Cow;

/// The text as bytes of UTF-8: a byte-order mark is dropped, UTF-16 with one is decoded.
///
/// Text without a mark is taken as it is, since the keywords of all formats are ASCII.
pub(crate) fn decoded(bytes: &[u8]) -> Cow<'_, [u8]> {
    match encoding_rs::Encoding::for_bom(bytes) {
        Some((encoding, mark)) if encoding == encoding_rs::UTF_8 => Cow::Borrowed(&bytes[mark..]),
        Some((encoding, mark)) => {
            let (text, _) = encoding.decode_without_bom_handling(&bytes[mark..]);
            Cow::Owned(text.into_owned().into_bytes())
        }
        None => Cow::Borrowed(bytes),
    }
}

/// A name or path from a file, whatever its encoding.
pub(crate) fn name(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes.trim_ascii()).into_owned()
}

/// The number that `word` is, whole.
pub(crate) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// The number that `word` starts with, as C's `strtod` reads it; `1.#IND` and its kin are NaN.
pub(crate) fn leading_number(word: &[u8]) -> Option<f64> {
    if word.contains(&b'#') {
        return Some(f64::NAN);
    }
    let digits = |from: usize| word[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let sign = usize::from(matches!(word.first(), Some(b'+' | b'-')));
    if word[sign..].len() >= 3 && word[sign..sign + 3].eq_ignore_ascii_case(b"nan") {
        return Some(f64::NAN);
    }
    let mut end = sign + digits(sign);
    if word.get(end) == Some(&b'.') {
        end += 1 + digits(end + 1);
    }
    if matches!(word.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(word.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits(end + 1 + sign);
        if exponent > 0 {
            end += 1 + sign + exponent;
        }
    }
    number(&word[..end])
}

/// A coordinate in the fewest digits that read back as the same `f64`.
pub(crate) struct Shortest(pub f64);

impl std::fmt::Display for Shortest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let size = self.0.abs();
        if size == 0.0 || (1e-5..1e16).contains(&size) {
            write!(f, "{}", self.0)
        } else {
            write!(f, "{:e}", self.0)
        }
    }
}

/// A name that stands on one line without being taken for anything else.
pub(crate) fn plain(name: &str) -> String {
    name.trim().replace(|c: char| c.is_control() || c == '\\' || c == '#', "_")
}

/// Splits off the first word of a statement.
pub(crate) fn split_word(text: &[u8]) -> (&[u8], &[u8]) {
    let text = text.trim_ascii_start();
    let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
    text.split_at(end)
}

/// The words of one statement.
pub(crate) fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty())
}

/// Length of the line ending at the start of `bytes`: `\n`, `\r\n`, or `\r` alone.
fn line_ending(bytes: &[u8]) -> usize {
    match bytes {
        [b'\r', b'\n', ..] => 2,
        [b'\r' | b'\n', ..] => 1,
        _ => 0,
    }
}

/// Lines of OBJ and MTL: any line ending, and lines that end in a backslash go on in the next.
pub(crate) struct Statements<'a> {
    bytes: &'a [u8],
    at: usize,
    line: u64,
    joined: Vec<u8>,
}

impl<'a> Statements<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, line: 0, joined: Vec::new() }
    }

    /// The next line with its number, counted from 1.
    pub(crate) fn next(&mut self) -> Option<(u64, &[u8])> {
        if self.at >= self.bytes.len() {
            return None;
        }
        let (first, line) = (self.line + 1, self.line());
        let Some(head) = continued(line) else { return Some((first, line)) };
        self.joined.clear();
        self.joined.extend_from_slice(head);
        while self.at < self.bytes.len() {
            let line = self.line();
            self.joined.push(b' ');
            match continued(line) {
                Some(head) => self.joined.extend_from_slice(head),
                None => {
                    self.joined.extend_from_slice(line);
                    break;
                }
            }
        }
        Some((first, &self.joined))
    }

    fn line(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(rest.len());
        self.at += end + line_ending(&rest[end..]);
        self.line += 1;
        &rest[..end]
    }
}

/// What stands before the backslash of a line that goes on.
fn continued(line: &[u8]) -> Option<&[u8]> {
    match line.trim_ascii_end() {
        [head @ .., b'\\'] => Some(head),
        _ => None,
    }
}

/// Words of a text that is read across lines.
#[derive(Clone)]
pub(crate) struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Line of the word that was read last, counted from 1.
    pub(crate) line: u64,
    comment: Option<u8>,
}

impl<'a> Words<'a> {
    /// Words of `bytes`; from `comment` to the end of its line is skipped.
    pub(crate) fn new(bytes: &'a [u8], comment: Option<u8>) -> Self {
        Self { bytes, at: 0, line: 1, comment }
    }

    /// Bytes that are left.
    pub(crate) fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The next word.
    pub(crate) fn next(&mut self) -> Option<&'a [u8]> {
        while let [first, ..] = &self.bytes[self.at..] {
            match first {
                b'\r' | b'\n' => {
                    self.at += line_ending(&self.bytes[self.at..]);
                    self.line += 1;
                }
                b if b.is_ascii_whitespace() => self.at += 1,
                b if Some(*b) == self.comment => {
                    self.rest_of_line();
                }
                _ => return Some(self.word()),
            }
        }
        None
    }

    /// The next word if it stands on the same line as the last.
    pub(crate) fn next_on_line(&mut self) -> Option<&'a [u8]> {
        while let [first, ..] = &self.bytes[self.at..] {
            match first {
                b'\r' | b'\n' => return None,
                b if b.is_ascii_whitespace() => self.at += 1,
                b if Some(*b) == self.comment => return None,
                _ => return Some(self.word()),
            }
        }
        None
    }

    /// What is left of the line, comments too.
    pub(crate) fn rest_of_line(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(rest.len());
        self.at += end;
        &rest[..end]
    }

    fn word(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        let stop = |b: &u8| b.is_ascii_whitespace() || Some(*b) == self.comment;
        let end = rest.iter().position(stop).unwrap_or(rest.len());
        self.at += end;
        &rest[..end]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_far_as_they_go() {
        let cases: [(&[u8], f64); 6] = [
            (b"3.1+e2", 3.1),
            (b"+2.", 2.0),
            (b"-1e-2x", -0.01),
            (b".5", 0.5),
            (b"1e", 1.0),
            (b"1e5", 1e5),
        ];
        for (word, value) in cases {
            assert_eq!(leading_number(word), Some(value));
        }
        assert!(leading_number(b"-1.#IND").is_some_and(f64::is_nan));
        assert!(leading_number(b"-nan(ind)").is_some_and(f64::is_nan));
        for word in [&b"x"[..], b"", b"-", b"+e5", b"."] {
            assert_eq!(leading_number(word), None);
        }
    }

    #[test]
    fn shortest_reads_back() {
        for x in [0.0, -0.0, 0.1, 1e300, -1e-300, 1.0 / 3.0, f64::MIN_POSITIVE, 16777217.0] {
            let text = Shortest(x).to_string();
            assert_eq!(number(text.as_bytes()).map(f64::to_bits), Some(x.to_bits()), "{text}");
        }
    }

    #[test]
    fn statements_end_in_any_way_and_go_on_after_a_backslash() {
        let mut statements = Statements::new(b"a\r\nb \\\r\n c\rd\n\\");
        let mut seen = Vec::new();
        while let Some((line, text)) = statements.next() {
            seen.push((line, text.to_vec()));
        }
        let expected = [(1, &b"a"[..]), (2, b"b   c"), (4, b"d"), (5, b"")];
        assert_eq!(seen, expected.map(|(n, t)| (n, t.to_vec())));
    }

    #[test]
    fn words_count_lines_and_skip_comments() {
        let mut words = Words::new(b"a # x\r\n b#c\rd", Some(b'#'));
        assert_eq!(words.next(), Some(&b"a"[..]));
        assert_eq!(words.next_on_line(), None);
        assert_eq!((words.next(), words.line), (Some(&b"b"[..]), 2));
        assert_eq!((words.next(), words.line), (Some(&b"d"[..]), 3));
        assert_eq!(words.next(), None);
    }
}
