//! Shaders: sources and their includes, compilation with a cache, reflection, and pipelines that are made anew when a file changes.
//! Enters: GLSL files, embedded in the binary or from a folder. Leaves: stages, pipelines, and what is wrong with a file.

mod abilities;
mod compile;
mod constants;
mod fault;
mod library;
mod limits;
mod live;
mod payloads;
mod reflect;
mod reload;
mod sources;
mod spirv;
mod suspects;
mod twins;
mod varyings;
mod watch;
mod worker;

pub use compile::{SpirvCache, compile};
pub use fault::ShaderFault;
pub use library::{Compiled, ShaderFiles, ShaderLibrary, merge_interfaces};
pub use reflect::{Reflection, Varying, reflect};
pub use reload::{Reload, ShaderStatus, Wake};
pub use sources::{ShaderSources, Source};
pub use suspects::HeldShader;
pub use watch::Watching;

pub(crate) use fault::listed;
pub(crate) use live::{Live, Owner, StageOf};
pub(crate) use payloads::check_payloads;
pub(crate) use reload::{Reloader, TakenOver};
pub(crate) use varyings::check_varyings;
