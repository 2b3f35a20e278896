//! A bound on what instances may multiply: a few bytes of a file can ask for any number of copies.

use crate::ReadError;

/// Points and faces that may still be made.
pub(crate) struct Budget {
    format: &'static str,
    left: u64,
    limit: u64,
}

impl Budget {
    /// A budget that grows with the file: 16 million for any file, and 64 more for each byte.
    pub(crate) fn new(format: &'static str, bytes: usize) -> Self {
        let limit = (1 << 24) + 64 * bytes as u64;
        Self { format, left: limit, limit }
    }

    /// Takes `count` points, faces or instances.
    pub(crate) fn spend(&mut self, count: u64) -> Result<(), ReadError> {
        match self.left.checked_sub(count) {
            Some(left) => {
                self.left = left;
                Ok(())
            }
            None => Err(ReadError::unsupported(
                self.format,
                format!(
                    "its instances make more than {} points and faces, which no honest file of \
                     its size does; split it if it is one",
                    self.limit
                ),
            )),
        }
    }
}
