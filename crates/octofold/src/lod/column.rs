//! Columns that are owned, or lie in bytes that somebody else holds, such as a mapped file.

use bytemuck::Pod;
use std::ops::{Deref, Range};
use std::sync::Arc;

/// Bytes that are shared.
type Shared = Arc<dyn Deref<Target = [u8]> + Send + Sync>;

/// A read-only table of equal items.
#[derive(Clone)]
pub struct Column<T>(Held<T>);

#[derive(Clone)]
enum Held<T> {
    Owned(Vec<T>),
    Shared(Shared, Range<usize>),
}

impl<T: Pod> Column<T> {
    /// The items in `range` of `bytes`. `None` where the range does not lie inside, is not a whole
    /// number of items, or is not aligned for them.
    pub fn shared(bytes: Shared, range: Range<usize>) -> Option<Self> {
        bytemuck::try_cast_slice::<u8, T>(bytes.get(range.clone())?).ok()?;
        Some(Self(Held::Shared(bytes, range)))
    }
}

impl<T> From<Vec<T>> for Column<T> {
    fn from(items: Vec<T>) -> Self {
        Self(Held::Owned(items))
    }
}

impl<T: Pod> Deref for Column<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        match &self.0 {
            Held::Owned(items) => items,
            Held::Shared(bytes, range) => bytemuck::cast_slice(&bytes[range.clone()]),
        }
    }
}

impl<T: Pod + PartialEq> PartialEq for Column<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: Pod + std::fmt::Debug> std::fmt::Debug for Column<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}
