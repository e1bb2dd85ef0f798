//! Where the host's time of a frame goes. Enters: the moments between its steps. Leaves: milliseconds.

use std::time::Instant;

/// Milliseconds of the host in the last `begin_frame`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HostTimes {
    /// Waiting for the frame before last, and taking its memory back.
    pub begin_ms: f64,
    /// Draining the document and flattening what changed.
    pub sync_ms: f64,
    /// Taking the change into tables and acceleration structures.
    pub apply_ms: f64,
    /// Recording the passes of the view.
    pub render_ms: f64,
}

/// A stop watch that tells the time since it was last asked.
pub struct Lap(Instant);

impl Lap {
    /// Starts it.
    pub fn start() -> Self {
        Self(Instant::now())
    }

    /// Milliseconds since the start or the last call.
    pub fn ms(&mut self) -> f64 {
        let now = Instant::now();
        now.duration_since(std::mem::replace(&mut self.0, now)).as_secs_f64() * 1e3
    }
}
