//! What the frames of a session did, added up. Enters: the figures of each frame. Leaves: sums since the start, the last
//! frame that built anything, the last reasons to begin anew. It measures nothing itself.

use std::collections::VecDeque;

use caustica_renderer::{AccelStatistics, Statistics, TlasWork};

/// Reasons that are kept.
const REASONS: usize = 8;

/// Sums over all frames.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Frames with a picture.
    pub frames: u64,
    /// Bytes uploaded.
    pub uploaded_bytes: u64,
    /// The last frame that built, refitted or swapped a structure, if any.
    pub last_work: Option<AccelStatistics>,
    /// Bytes uploaded in that frame.
    pub last_work_bytes: u64,
    /// Why the picture was begun anew, newest first, each with the number of times in a row.
    pub reasons: VecDeque<(String, u64)>,
    resets: u64,
}

impl Tally {
    /// Takes in the figures of a frame.
    pub(super) fn note(&mut self, statistics: &Statistics) {
        self.frames += 1;
        self.uploaded_bytes += statistics.uploaded_bytes;
        if has_work(&statistics.acceleration) {
            self.last_work = Some(statistics.acceleration.clone());
            self.last_work_bytes = statistics.uploaded_bytes;
        }
        let new = statistics.resets.saturating_sub(self.resets);
        self.resets = statistics.resets;
        if new == 0 {
            return;
        }
        match self.reasons.front_mut() {
            Some((reason, times)) if *reason == statistics.reset_reason => *times += new,
            _ => self.reasons.push_front((statistics.reset_reason.clone(), new)),
        }
        self.reasons.truncate(REASONS);
    }
}

fn has_work(frame: &AccelStatistics) -> bool {
    frame.blas_built + frame.blas_refit + frame.blas_swapped > 0 || frame.tlas != TlasWork::Kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(resets: u64, reason: &str, blas_built: u64) -> Statistics {
        Statistics {
            resets,
            reset_reason: reason.to_owned(),
            uploaded_bytes: 100,
            acceleration: AccelStatistics { blas_built, ..AccelStatistics::default() },
            ..Statistics::default()
        }
    }

    #[test]
    fn bytes_add_up_and_the_last_work_stays() {
        let mut tally = Tally::default();
        for built in [2, 0, 0] {
            tally.note(&frame(1, "opened a file", built));
        }
        assert_eq!((tally.frames, tally.uploaded_bytes, tally.last_work_bytes), (3, 300, 100));
        assert_eq!(tally.last_work.map(|work| work.blas_built), Some(2));
    }

    #[test]
    fn a_refitted_tlas_alone_is_work() {
        let mut still = frame(0, "", 0);
        assert!(!has_work(&still.acceleration));
        still.acceleration.tlas = TlasWork::Refit;
        assert!(has_work(&still.acceleration));
    }

    #[test]
    fn reasons_are_kept_newest_first_and_repeats_are_counted() {
        let mut tally = Tally::default();
        let frames = [
            (1, "opened a file"),
            (1, "opened a file"),
            (2, "moved Chair"),
            (4, "moved Chair"),
            (5, "camera"),
        ];
        for (resets, reason) in frames {
            tally.note(&frame(resets, reason, 0));
        }
        let expected = [("camera", 1), ("moved Chair", 3), ("opened a file", 1)];
        let kept: Vec<_> = tally.reasons.iter().map(|(reason, times)| (reason.as_str(), *times)).collect();
        assert_eq!(kept, expected);
        (6..30).for_each(|resets| tally.note(&frame(resets, &format!("reason {resets}"), 0)));
        assert_eq!(tally.reasons.len(), REASONS);
    }
}
