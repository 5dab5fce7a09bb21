//! Reading little-endian binary files: every read is checked, and every error names the byte.

use crate::DataError;
use std::path::Path;

/// A position in the bytes of a file.
#[derive(Clone, Copy)]
pub(crate) struct Bytes<'a> {
    path: &'a Path,
    all: &'a [u8],
    at: usize,
}

impl<'a> Bytes<'a> {
    /// The start of a file's content.
    pub fn new(path: &'a Path, all: &'a [u8]) -> Self {
        Self { path, all, at: 0 }
    }

    /// Number of bytes that are left.
    pub fn left(&self) -> usize {
        self.all.len() - self.at
    }

    /// The error that something else was expected here.
    pub fn damaged(&self, found: String, expected: &'static str) -> DataError {
        DataError::Damaged { path: self.path.to_owned(), at: format!("byte {}", self.at), found, expected }
    }

    /// The next `n` bytes.
    pub fn take(&mut self, n: usize, expected: &'static str) -> Result<&'a [u8], DataError> {
        let left = self.left();
        if n > left {
            return Err(self.damaged(format!("{left} bytes to the end of the file"), expected));
        }
        self.at += n;
        Ok(&self.all[self.at - n..self.at])
    }

    /// Skips `count` records of `size` bytes; a count that cannot be true is an error, not an allocation.
    pub fn skip(&mut self, count: u64, size: usize, expected: &'static str) -> Result<(), DataError> {
        self.check_count(count, size, expected)?;
        self.at += count as usize * size;
        Ok(())
    }

    /// Checks that `count` records of at least `size` bytes can follow.
    pub fn check_count(&self, count: u64, size: usize, expected: &'static str) -> Result<(), DataError> {
        let fits =
            usize::try_from(count).ok().and_then(|n| n.checked_mul(size)).is_some_and(|n| n <= self.left());
        let left = self.left();
        fits.then_some(())
            .ok_or_else(|| self.damaged(format!("a count of {count} with {left} bytes left"), expected))
    }

    fn array<const N: usize>(&mut self, expected: &'static str) -> Result<[u8; N], DataError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N, expected)?);
        Ok(array)
    }

    /// The next u32.
    pub fn u32(&mut self, expected: &'static str) -> Result<u32, DataError> {
        self.array(expected).map(u32::from_le_bytes)
    }

    /// The next u64.
    pub fn u64(&mut self, expected: &'static str) -> Result<u64, DataError> {
        self.array(expected).map(u64::from_le_bytes)
    }

    /// The next `N` f64.
    pub fn f64s<const N: usize>(&mut self, expected: &'static str) -> Result<[f64; N], DataError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.array(expected).map(f64::from_le_bytes)?;
        }
        Ok(values)
    }

    /// The bytes before the next NUL, which is consumed; bytes that are not UTF-8 are an error.
    pub fn text(&mut self, expected: &'static str) -> Result<String, DataError> {
        let rest = &self.all[self.at..];
        let Some(length) = rest.iter().position(|b| *b == 0) else {
            return Err(self.damaged("no end of the text".into(), expected));
        };
        let text = std::str::from_utf8(&rest[..length]).map_err(|e| self.damaged(e.to_string(), expected))?;
        let text = text.to_owned();
        self.at += length + 1;
        Ok(text)
    }
}
