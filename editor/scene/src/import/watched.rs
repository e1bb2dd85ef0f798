//! Bytes that remember how far they were read, so that the error of a decoder can name a place.

use std::cell::Cell;
use std::io::{BufRead, Cursor, Read, Result, Seek, SeekFrom};

/// A reader of bytes in memory.
pub(super) struct Watched<'a> {
    bytes: Cursor<&'a [u8]>,
    at: &'a Cell<u64>,
}

impl<'a> Watched<'a> {
    /// `at` is where the reading is.
    pub fn new(bytes: &'a [u8], at: &'a Cell<u64>) -> Self {
        Self { bytes: Cursor::new(bytes), at }
    }

    fn note<T>(&self, result: T) -> T {
        self.at.set(self.bytes.position());
        result
    }
}

impl Read for Watched<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        let read = self.bytes.read(buffer);
        self.note(read)
    }
}

impl BufRead for Watched<'_> {
    fn fill_buf(&mut self) -> Result<&[u8]> {
        self.bytes.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        self.bytes.consume(count);
        self.note(());
    }
}

impl Seek for Watched<'_> {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        let at = self.bytes.seek(to);
        self.note(at)
    }
}
