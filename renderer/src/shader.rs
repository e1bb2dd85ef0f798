//! Shaders: sources and their includes, compilation with a cache, reflection, modules ready for pipelines.
//! Enters: GLSL files, embedded in the binary or from a folder. Leaves: modules and interfaces.

mod compile;
mod library;
mod reflect;
mod sources;
mod twins;

pub use compile::{SpirvCache, compile};
pub use library::{Compiled, ShaderLibrary, merge_interfaces};
pub use reflect::{Reflection, reflect};
pub use sources::{ShaderSources, Source};
