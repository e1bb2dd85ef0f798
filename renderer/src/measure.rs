//! What the renderer tells of itself: times, counts, memory, what was left out; and what it measures of a device.

mod accel_bench;
mod device_profile;
mod primary_bench;
mod statistics;

pub use accel_bench::{AccelBench, BareStructure, BlasTimes, TlasTimes};
pub use device_profile::{DeviceProfile, PrimaryTimes, ProfileInForce};
pub use statistics::{AccelStatistics, LeftOut, Statistics, TlasWork};
