//! How much what is read of a file may take in memory. In: the size of the file and the bytes that are about to be taken.
//! Out: leave, or a reason; nothing is taken before. Knows no file format.
//!
//! Counted are the lists that are decoded and those that the scene holds of them, each time that they are made: what many
//! name is made once and shared where that is cheap, and counted as often as it is made where it is not.

use std::fmt;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Any file may be read to this many bytes: half of the 256 MiB that an import may take, as much again being there only
/// while it is read.
const FREE_BYTES: usize = 128 << 20;
/// What a byte of a file may become. The most that a sound file needs is 14.5: positions without normals and indices of
/// 16 bits, where every corner gets a vertex of its own with a normal and a tangent.
const TIMES_FILE: usize = 16;
/// What a file of any size may describe without data, bytes: most of the 256 MiB of a small one, as the program takes some itself.
const FREE_DESCRIBED: usize = 240 << 20;
/// What a byte of a compressed stream may become beyond that.
const TIMES_COMPRESSED: usize = 240;

/// The bytes that one file may still take.
#[derive(Debug)]
pub(crate) struct Room {
    limit: usize,
    file: usize,
    left: AtomicUsize,
}

/// What does not fit, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NoRoom {
    wanted: usize,
    left: usize,
    limit: usize,
}

impl fmt::Display for NoRoom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { wanted, left, limit } = self;
        write!(
            f,
            "it becomes {wanted} bytes in memory; of {limit} that a file of this size may become, {left} are left"
        )
    }
}

impl Room {
    /// For a file of `bytes`, with what it names, of which `compressed` are streams of a codec.
    pub fn new(bytes: usize, compressed: usize) -> Self {
        let limit = bytes
            .saturating_mul(TIMES_FILE)
            .saturating_add(compressed.min(bytes).saturating_mul(TIMES_COMPRESSED))
            .max(FREE_BYTES);
        Self { limit, file: bytes, left: AtomicUsize::new(limit) }
    }

    /// Whether what the file describes without any data, its text and what its lists make, may become `wanted` bytes in all:
    /// `times` its size, or most of what a small file may take.
    pub fn require(&self, wanted: usize, times: usize) -> Result<(), NoRoom> {
        let limit = self.file.saturating_mul(times).max(FREE_DESCRIBED);
        if wanted <= limit { Ok(()) } else { Err(NoRoom { wanted, left: limit, limit }) }
    }

    /// Most bytes that the file may take.
    pub const fn limit(&self) -> usize {
        self.limit
    }

    /// Whether `count` things of `size` bytes fit, which are taken later.
    pub fn peek(&self, count: usize, size: usize) -> Result<(), NoRoom> {
        let (wanted, left) = (count.saturating_mul(size), self.left.load(Ordering::Relaxed));
        if wanted <= left { Ok(()) } else { Err(NoRoom { wanted, left, limit: self.limit }) }
    }

    /// Says that `count` things of `size` bytes are about to be made.
    pub fn take(&self, count: usize, size: usize) -> Result<(), NoRoom> {
        let wanted = count.saturating_mul(size);
        let taken =
            self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(wanted));
        taken.map(|_| ()).map_err(|left| NoRoom { wanted, left, limit: self.limit })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fits_is_given_and_what_does_not_takes_nothing() {
        let room = Room::new(FREE_BYTES / TIMES_FILE + 1, 0);
        assert_eq!(room.limit(), FREE_BYTES + TIMES_FILE);
        assert_eq!(room.take(FREE_BYTES, 1), Ok(()));
        let limit = room.limit();
        assert_eq!(room.take(usize::MAX, 3), Err(NoRoom { wanted: usize::MAX, left: TIMES_FILE, limit }));
        assert_eq!(room.take(TIMES_FILE, 1), Ok(()));
        assert_eq!(Room::new(1, 0).limit(), FREE_BYTES);
        assert!(Room::new(1 << 20, usize::MAX).limit() > FREE_BYTES);
    }
}
