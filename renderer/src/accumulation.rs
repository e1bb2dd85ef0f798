//! The frame counter: how many samples a view has accumulated, and why it last started again.
//! The only writer: every reset goes through [`Accumulation::invalidate`].

use crate::delta::Invalidation;

/// Samples of one stream that are summed in plain floats before they are folded into the compensated pair.
pub const BLOCK_SAMPLES: u64 = 32;

/// Where the next sample stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    /// Index in the whole sample set, from the offset on.
    pub index: u64,
    /// 0: stream A (even samples), 1: stream B.
    pub stream: u32,
    /// Which block of its stream.
    pub block: u64,
    /// It opens its block.
    pub opens_block: bool,
    /// It closes its block.
    pub closes_block: bool,
}

/// The frame counter of one view.
#[derive(Clone, Debug)]
pub struct Accumulation {
    samples: u64,
    offset: u64,
    moving_frames: u64,
    pending: Invalidation,
    reason: String,
    resets: u64,
}

impl Default for Accumulation {
    fn default() -> Self {
        Self {
            samples: 0,
            offset: 0,
            moving_frames: 0,
            pending: Invalidation::Everything,
            reason: String::from("first frame"),
            resets: 0,
        }
    }
}

impl Accumulation {
    /// Starts the sample set at `offset`, for images that are rendered in parts. Resets.
    pub fn set_offset(&mut self, offset: u64) {
        self.offset = offset;
        self.invalidate(Invalidation::Everything, "sample offset");
    }

    /// Samples in the accumulator.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Why the last reset happened.
    pub fn reason(&self) -> &str {
        &self.reason
    }

    /// Number of resets.
    pub fn resets(&self) -> u64 {
        self.resets
    }

    /// Says what happened since the last frame. The one function that resets the counter.
    pub fn invalidate(&mut self, what: Invalidation, reason: &str) {
        if what == Invalidation::Nothing {
            return;
        }
        if what > self.pending {
            reason.clone_into(&mut self.reason);
        }
        // Several events between two frames begin one picture.
        self.resets += u64::from(self.pending == Invalidation::Nothing);
        self.pending = self.pending.max(what);
        self.samples = 0;
    }

    /// What happened since the last frame.
    pub(crate) fn pending(&self) -> Invalidation {
        self.pending
    }

    /// What happened since the last frame; a new frame begins.
    pub(crate) fn take_pending(&mut self) -> Invalidation {
        std::mem::take(&mut self.pending)
    }

    /// Where the next accumulated sample stands.
    pub fn next_sample(&self) -> Sample {
        let index = self.offset + self.samples;
        let within = index / 2;
        Sample {
            index,
            stream: (index % 2) as u32,
            block: within / BLOCK_SAMPLES,
            opens_block: within.is_multiple_of(BLOCK_SAMPLES),
            closes_block: within % BLOCK_SAMPLES == BLOCK_SAMPLES - 1,
        }
    }

    /// A sample was accumulated.
    pub(crate) fn advance(&mut self) {
        self.samples += 1;
    }

    /// A frame was shown without accumulating. Returns a sample index of its own for it, far from every still sample,
    /// so that moving frames differ from each other.
    pub(crate) fn next_moving_index(&mut self) -> u64 {
        self.moving_frames += 1;
        (1 << 48) + self.moving_frames
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_of_both_streams_open_and_close() {
        let mut counter = Accumulation::default();
        let mut opened = [0, 0];
        let mut closed = [0, 0];
        for _ in 0..BLOCK_SAMPLES * 2 * 3 {
            let sample = counter.next_sample();
            opened[sample.stream as usize] += u32::from(sample.opens_block);
            closed[sample.stream as usize] += u32::from(sample.closes_block);
            counter.advance();
        }
        assert_eq!((opened, closed), ([3, 3], [3, 3]));
        assert_eq!(counter.next_sample().block, 3);
    }

    #[test]
    fn nothing_keeps_the_samples_and_anything_else_drops_them() {
        let mut counter = Accumulation::default();
        counter.take_pending();
        counter.advance();
        counter.invalidate(Invalidation::Nothing, "exposure");
        assert_eq!((counter.samples(), counter.resets()), (1, 0));
        counter.invalidate(Invalidation::Camera, "camera");
        assert_eq!((counter.samples(), counter.resets(), counter.reason()), (0, 1, "camera"));
    }

    #[test]
    fn the_largest_of_several_events_gives_the_reason() {
        let mut counter = Accumulation::default();
        counter.take_pending();
        counter.invalidate(Invalidation::Scene, "moved Chair");
        counter.invalidate(Invalidation::Camera, "camera");
        assert_eq!(counter.reason(), "moved Chair");
        assert_eq!(counter.take_pending(), Invalidation::Scene);
    }

    #[test]
    fn a_change_of_size_gives_the_reason_only_when_it_is_alone() {
        let camera = (Invalidation::Camera, "camera");
        let size = (Invalidation::Resize, "size of the view");
        for (events, expected) in
            [(vec![size, camera], camera), (vec![camera, size], camera), (vec![size], size)]
        {
            let mut counter = Accumulation::default();
            counter.take_pending();
            events.iter().for_each(|(what, reason)| counter.invalidate(*what, reason));
            assert_eq!((counter.take_pending(), counter.reason()), expected);
        }
    }
}
