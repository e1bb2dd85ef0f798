//! The renderer of Caustica: a flat scene in, an image out. It knows no hierarchy, no file format and no window.
//! Start at [`Renderer`]; the order of the passes is in `frame.rs`.

mod accel;
mod accumulation;
pub mod delta;
mod error;
mod frame;
pub mod gpu_types;
mod inventory;
mod measure;
mod needs;
mod passes;
mod renderer;
mod sampling;
mod settings;
pub mod shader;
mod summary;
mod tables;
mod view;

pub use accel::AccelPolicy;
pub use accumulation::{Accumulation, BLOCK_SAMPLES, Sample};
pub use caustica_gpu as gpu;
pub use error::{RendererError, Result};
pub use inventory::{EnvironmentEntry, InstanceEntry, Inventory, Layout, MaterialEntry, MeshEntry, Place};
pub use measure::{
    AccelBench, AccelStatistics, Against, BareStructure, BlasTimes, DeviceProfile, ErrorMetrics, Estimate,
    Flip, Halves, LeftOut, LiveError, Noise, PrimaryTimes, ProfileInForce, Radiance, Split, Statistics,
    TlasTimes, TlasWork, flip_hdr, flip_ldr, relative_error_map,
};
pub use needs::{Needs, SceneSummary, SurfaceSummary};
pub use renderer::{Accumulated, PickHit, Renderer, RendererOptions, WakeFn};
pub use sampling::Sampling;
pub use settings::{
    NeedsMode, Pipeline, Primary, ReflectionRate, Sampler, ShadowRate, Show, ToneMap, ViewSettings,
};
pub use tables::sheen_albedo_table;
pub use view::{View, ViewId};
