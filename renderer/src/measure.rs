//! What the renderer tells of itself: times, counts, memory, what was left out.

mod statistics;

pub use statistics::{AccelStatistics, LeftOut, Statistics, TlasWork};
