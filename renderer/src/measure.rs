//! What the renderer tells of itself: times, counts, memory, what was left out; and what it measures of a device.

mod accel_bench;
mod device_profile;
mod error;
mod flip;
mod live;
mod noise;
mod primary_bench;
mod split;
mod statistics;

pub use accel_bench::{AccelBench, BareStructure, BlasTimes, TlasTimes};
pub use device_profile::{DeviceProfile, PrimaryTimes, ProfileInForce};
pub use error::{ErrorMetrics, Radiance, relative_error_map};
pub use flip::{Flip, flip_hdr, flip_ldr};
pub use live::{Against, LiveError};
pub use noise::{Estimate, Noise};
pub use split::{Halves, Split};
pub use statistics::{AccelStatistics, LeftOut, Statistics, TlasWork};
