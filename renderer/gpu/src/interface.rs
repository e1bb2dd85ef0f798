//! What a pipeline binds in set 1, as reflected from its SPIR-V, and what the host gives for each name.

use ash::vk;

use crate::accel::AccelStructure;
use crate::barrier::Access;
use crate::buffer::Buffer;
use crate::image::{Format, Image};
use crate::sampler::Sampler;

/// What kind of descriptor a binding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingKind {
    /// `texture2D`: fetched without a sampler.
    SampledImage,
    /// `sampler2D`.
    CombinedImage,
    /// `image2D`, with what the shader does to it.
    StorageImage(Access),
    /// Storage buffer, with what the shader does to it.
    StorageBuffer(Access),
    /// Acceleration structure.
    AccelStructure,
}

impl BindingKind {
    pub(crate) fn descriptor(self) -> vk::DescriptorType {
        match self {
            Self::SampledImage => vk::DescriptorType::SAMPLED_IMAGE,
            Self::CombinedImage => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
            Self::StorageImage(_) => vk::DescriptorType::STORAGE_IMAGE,
            Self::StorageBuffer(_) => vk::DescriptorType::STORAGE_BUFFER,
            Self::AccelStructure => vk::DescriptorType::ACCELERATION_STRUCTURE_KHR,
        }
    }

    pub(crate) fn access(self) -> Access {
        match self {
            Self::SampledImage | Self::CombinedImage => Access::Sampled,
            Self::StorageImage(access) | Self::StorageBuffer(access) => access,
            Self::AccelStructure => Access::AccelTrace,
        }
    }
}

/// One variable of set 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binding {
    /// Name in GLSL.
    pub name: String,
    /// Its number.
    pub binding: u32,
    /// Its kind.
    pub kind: BindingKind,
    /// Of a storage image: the format that the shader declares, if it does.
    pub format: Option<Format>,
    /// Of an image without a format: whether the shader reads unsigned integers.
    pub reads_uint: bool,
}

/// What a pipeline needs from the host.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Interface {
    /// Set 1, by name.
    pub bindings: Vec<Binding>,
    /// Whether the pipeline uses set 0, the scene.
    pub uses_scene: bool,
    /// Bytes of push constants.
    pub push_bytes: u32,
}

/// What sort of thing the host gives for a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindSort {
    /// See [`Bind::Image`].
    Image(Format),
    /// See [`Bind::Combined`].
    Combined,
    /// See [`Bind::Buffer`].
    Buffer,
    /// See [`Bind::Accel`].
    Accel,
}

impl BindingKind {
    /// Whether the host's thing can be bound here.
    pub fn accepts(self, sort: BindSort) -> bool {
        match self {
            Self::SampledImage | Self::StorageImage(_) => matches!(sort, BindSort::Image(_)),
            Self::CombinedImage => sort == BindSort::Combined,
            Self::StorageBuffer(_) => sort == BindSort::Buffer,
            Self::AccelStructure => sort == BindSort::Accel,
        }
    }
}

impl Bind<'_> {
    /// What sort of thing it is.
    pub fn sort(&self) -> BindSort {
        match self {
            Self::Image(image) => BindSort::Image(image.desc().format),
            Self::Combined(..) => BindSort::Combined,
            Self::Buffer(_) => BindSort::Buffer,
            Self::Accel(_) => BindSort::Accel,
        }
    }
}

/// What the host gives for a binding.
#[derive(Clone, Copy)]
pub enum Bind<'a> {
    /// An image, for `texture2D` or `image2D`.
    Image(&'a Image),
    /// An image with a sampler, for `sampler2D`.
    Combined(&'a Image, &'a Sampler),
    /// A whole buffer.
    Buffer(&'a Buffer),
    /// An acceleration structure.
    Accel(&'a AccelStructure),
}
