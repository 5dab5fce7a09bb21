//! Arrays whose first element starts a cache line.

use crate::pages;
use std::ops::{Deref, DerefMut};

/// Size of a cache line and of the widest vector register [byte].
const LINE: usize = 64;

/// An array of fixed length that starts at a multiple of 64 bytes, so that a voxel padded to whole cache lines touches no
/// more lines than it fills. Used for per-voxel data; reads and writes as a slice.
#[derive(Debug, Default)]
pub struct AlignedVec<T> {
    /// The elements with some spare ones before and behind.
    storage: Vec<T>,
    /// Index of the first element, the one that is aligned.
    first: usize,
    len: usize,
}

impl<T: Copy> AlignedVec<T> {
    /// `len` copies of `value`.
    pub fn filled(len: usize, value: T) -> Self {
        let per_line = LINE / size_of::<T>().clamp(1, LINE);
        let storage = vec![value; len + per_line];
        pages::expect(&storage); // zeros are not written yet
        // align_offset may decline (usize::MAX); unaligned is then only slower.
        let first = storage.as_ptr().align_offset(LINE).min(per_line);
        Self { storage, first, len }
    }

    /// Asks the system to move what was written in small pages into pages of 2 MiB. It may take seconds per GiB.
    pub fn enlarge_pages(&self) {
        pages::enlarge(&self.storage);
    }

    /// A copy of a slice. Empty for an empty slice.
    pub fn from_slice(values: &[T]) -> Self {
        let Some(&any) = values.first() else { return Self { storage: Vec::new(), first: 0, len: 0 } };
        let mut out = Self::filled(values.len(), any);
        out.copy_from_slice(values);
        out
    }
}

impl<T: Copy> Clone for AlignedVec<T> {
    fn clone(&self) -> Self {
        Self::from_slice(self)
    }
}

impl<T: PartialEq> PartialEq for AlignedVec<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T> Deref for AlignedVec<T> {
    type Target = [T];
    #[inline(always)]
    fn deref(&self) -> &[T] {
        &self.storage[self.first..self.first + self.len]
    }
}

impl<T> DerefMut for AlignedVec<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.storage[self.first..self.first + self.len]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_start_on_a_cache_line_and_survive_cloning() {
        for len in [0, 1, 31, 1000] {
            let mut v = AlignedVec::filled(len, 1.5_f32);
            v.iter_mut().enumerate().for_each(|(i, x)| *x = i as f32);
            let copy = v.clone();
            assert_eq!(copy[..], v[..]);
            assert_eq!(v.len(), len);
            assert!(len == 0 || (v.as_ptr() as usize).is_multiple_of(LINE));
            assert!(len == 0 || (copy.as_ptr() as usize).is_multiple_of(LINE));
        }
    }
}
