//! What a stage asks of the device beyond memory: capabilities, and rays that are traced. Enters: SPIR-V. Leaves: what the device was
//! not opened with: drivers crash over it, or say that something is wrong without a word of what.

use spirq::spirv::Capability;

use super::fault::ShaderFault;
use super::sources::Source;
use super::spirv::instructions;
use crate::error::{RendererError, Result};

const OP_CAPABILITY: u32 = 17;
const OP_TRACE_RAY: u32 = 4445;

/// Those of Vulkan 1.3 without a feature, with its groups of invocations, and of the features that devices are opened with
/// (`renderer/gpu/src/device_choice.rs`).
const CAPABILITIES: [Capability; 25] = [
    Capability::Matrix,
    Capability::Shader,
    Capability::Geometry,
    Capability::Int64,
    Capability::Sampled1D,
    Capability::Image1D,
    Capability::SampledBuffer,
    Capability::ImageBuffer,
    Capability::StorageImageExtendedFormats,
    Capability::ImageQuery,
    Capability::DerivativeControl,
    Capability::GroupNonUniform,
    Capability::GroupNonUniformVote,
    Capability::GroupNonUniformArithmetic,
    Capability::GroupNonUniformBallot,
    Capability::GroupNonUniformShuffle,
    Capability::GroupNonUniformShuffleRelative,
    Capability::GroupNonUniformClustered,
    Capability::GroupNonUniformQuad,
    Capability::RayTracingKHR,
    Capability::ShaderNonUniform,
    Capability::RuntimeDescriptorArray,
    Capability::SampledImageArrayNonUniformIndexing,
    Capability::PhysicalStorageBufferAddresses,
    Capability::DemoteToHelperInvocation,
];

/// Holds a stage against what devices are opened with.
///
/// # Errors
/// [`RendererError::Compile`] naming what is too much.
pub(super) fn check(source: &Source, words: &[u32]) -> Result<()> {
    let mut faults = Vec::new();
    let mut traces = false;
    for instruction in instructions(words) {
        match instruction {
            (OP_CAPABILITY, [_, number]) => {
                let known = Capability::from_u32(*number);
                if known.is_none_or(|capability| !CAPABILITIES.contains(&capability)) {
                    let name =
                        known.map_or_else(|| number.to_string(), |capability| format!("{capability:?}"));
                    let message = format!("capability {name}: devices are opened without it");
                    faults.push(ShaderFault::at(source, &["#extension"], message));
                }
            }
            (OP_TRACE_RAY, _) => traces = true,
            _ => {}
        }
    }
    if traces && !source.file.ends_with(".rgen") {
        let message =
            "rays are traced by ray generation shaders alone: pipelines are made for a depth of one";
        faults.push(ShaderFault::at(source, &["traceRayEXT("], message));
    }
    if faults.is_empty() { Ok(()) } else { Err(RendererError::Compile { file: source.file.clone(), faults }) }
}
