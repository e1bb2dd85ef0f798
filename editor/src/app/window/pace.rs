//! How fast the window answers while edited shaders come into use. Enters: when it did what. Leaves: a line in the log.

use std::time::{Duration, Instant};

/// The longest answer of a stretch of time.
#[derive(Debug, Default)]
pub(super) struct Pace {
    /// How long it took to draw the last frame.
    last: Duration,
    /// The longest time that two frames in a row took: an input that comes when the first has begun is answered at the end of the
    /// second.
    longest: Duration,
    frames: u32,
    counts: bool,
}

impl Pace {
    /// A frame was drawn, from `start` until now. `counts`: shaders are being compiled or used for the first times. At the end of such
    /// a stretch: the longest answer in it, and its frames.
    pub(super) fn drawn(&mut self, start: Instant, counts: bool) -> Option<(Duration, u32)> {
        let before = std::mem::replace(&mut self.last, start.elapsed());
        let ended = self.counts && !counts;
        if counts && !self.counts {
            (self.longest, self.frames) = Default::default();
        }
        if counts {
            self.longest = self.longest.max(before + self.last);
            self.frames += 1;
        }
        self.counts = counts;
        ended.then_some((self.longest, self.frames))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_may_wait_for_two_frames() {
        let mut pace = Pace::default();
        let ago = |ms| Instant::now().checked_sub(Duration::from_millis(ms)).unwrap_or_else(Instant::now);
        assert_eq!(pace.drawn(ago(900), false), None);
        assert_eq!(pace.drawn(ago(30), true), None);
        assert_eq!(pace.drawn(ago(500), true), None);
        assert_eq!(pace.drawn(ago(20), true), None);
        let (longest, frames) = pace.drawn(ago(1000), false).unwrap_or_default();
        assert_eq!(frames, 3);
        assert!((930..990).contains(&longest.as_millis()), "{longest:?}");
        assert_eq!(pace.drawn(ago(1), false), None);
    }
}
