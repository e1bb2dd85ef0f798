//! The Vulkan layer of Caustica: thin, safe wrappers over ash, one object a file.
//! It knows buffers, images, pipelines and queues; it knows neither scenes nor passes.
//! The only package with `unsafe`: every object owns an `Arc` of the device that made it, and every dropped
//! object goes through the device's retire queue, so that it outlives the work that uses it.

mod accel;
mod background;
mod barrier;
mod buffer;
mod context;
mod debug;
mod descriptors;
mod device_choice;
mod error;
mod frames;
mod hang;
mod image;
mod instance;
mod interface;
mod memory;
mod pipeline;
mod recorder;
mod retire;
mod sampler;
mod sbt;
mod staging;
mod swapchain;
mod texture_set;
mod timers;

pub use accel::{
    AccelBuild, AccelGeometry, AccelStructure, BOX_STRIDE, BoxGeometry, BuildMode, BuildPreference,
    BuildSizes, TlasInstances, TriangleGeometry, pack_instance,
};
pub use ash;
pub use background::{Background, BackgroundWork, Ticket};
pub use barrier::{Access, Barrier, ResourceId, Stage, Tracker};
pub use buffer::{Buffer, BufferUse, Location};
pub use context::{Device, DeviceOptions, Limits};
pub use descriptors::{SceneLayout, SceneSet};
pub use device_choice::{Candidate, DeviceKind, Requirements, list_devices};
pub use error::GpuError;
pub use frames::{FrameResult, Frames};
pub use hang::leave_process;
pub use image::{Format, Image, ImageDesc, ImageUse};
pub use instance::{Instance, InstanceOptions, Message};
pub use interface::{Bind, BindSort, Binding, BindingKind, Interface};
pub use memory::{MemoryBudget, MemoryUse};
pub use pipeline::{
    ColorTarget, ComputePipeline, CullMode, GraphicsDesc, GraphicsPipeline, HitGroup, MAX_LINKED_PAYLOAD,
    RayGroup, RayGroupDesc, RayTracingDesc, RayTracingPipeline, ShaderModule, Specialization,
};
pub use recorder::{Draw, Recorder, Use};
pub use sampler::{Filter, Sampler, SamplerDesc, WrapMode};
pub use swapchain::{Acquired, Swapchain};
pub use texture_set::{TextureSet, UploadQueue};
pub use timers::PassTime;

/// Result of this package.
pub type Result<T> = std::result::Result<T, GpuError>;
