//! Errors of the renderer, in words.

use caustica_gpu::GpuError;

use crate::shader::{ShaderFault, listed};

/// What can go wrong between a scene and an image.
#[derive(Debug, thiserror::Error)]
pub enum RendererError {
    /// The Vulkan layer refused.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A shader does not compile; the message holds one line an error, each with file:line.
    #[error("{file} does not compile:\n{}", listed(faults))]
    Compile {
        /// Main file of the stage, relative to the shader folder.
        file: String,
        /// What the compiler says.
        faults: Vec<ShaderFault>,
    },
    /// A shader file is missing or unreadable.
    #[error("{file}: {reason}")]
    Source {
        /// File, relative to the shader folder.
        file: String,
        /// Why it could not be read.
        reason: String,
    },
    /// A shader's interface is not what the host offers.
    #[error("{file}: {reason}")]
    Interface {
        /// Main file of the stage.
        file: String,
        /// Expected against found.
        reason: String,
    },
    /// The scene asks for more than the device or the tables allow.
    #[error("{what}: {asked} is more than the {limit} that this device allows")]
    Limit {
        /// What.
        what: String,
        /// How many were asked for.
        asked: u64,
        /// How many are allowed.
        limit: u64,
    },
    /// How a mesh deforms, or the pose of one of its instances, does not fit.
    #[error("mesh '{mesh}' cannot be posed: {reason}")]
    Deformation {
        /// Name of the mesh.
        mesh: String,
        /// What does not fit.
        reason: String,
    },
    /// The shapes of a mesh are none.
    #[error("mesh '{mesh}' cannot hold its shapes: {reason}")]
    Shapes {
        /// Name of the mesh.
        mesh: String,
        /// What is wrong with them.
        reason: String,
    },
    /// An instance has not one material for each geometry of its mesh.
    #[error("an instance has {found} materials, its mesh {mesh} has {geometry_count} primitives")]
    Materials {
        /// Id of the mesh.
        mesh: u64,
        /// Number of materials.
        found: usize,
        /// Number of geometries.
        geometry_count: u32,
    },
    /// An id that is not in the tables.
    #[error("{what} {id} is not in the scene")]
    Unknown {
        /// Kind of id.
        what: &'static str,
        /// The id.
        id: String,
    },
    /// What is on the device is not what the host believes.
    #[error("the tables contradict each other: {reason}")]
    Contradiction {
        /// What was found.
        reason: String,
    },
    /// A picture is none, or not of the size of another.
    #[error("{0}")]
    Picture(String),
    /// A device was not measured, or its profile was not written.
    #[error("{what}: {reason}")]
    Profile {
        /// A file, or what was measured.
        what: String,
        /// Why.
        reason: String,
    },
}

impl RendererError {
    /// Whether memory ran out: less of it may do.
    pub fn is_out_of_memory(&self) -> bool {
        matches!(self, Self::Gpu(GpuError::OutOfMemory { .. }))
    }
}

/// Result of this package.
pub type Result<T> = std::result::Result<T, RendererError>;
