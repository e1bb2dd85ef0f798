//! Compiled stages by file, each compiled once. Enters: file names. Leaves: modules with their interfaces.

use std::collections::HashMap;
use std::sync::Arc;

use caustica_gpu::{Device, Interface, ShaderModule};

use super::compile::{SpirvCache, compile};
use super::reflect::reflect;
use super::sources::ShaderSources;
use crate::error::{RendererError, Result};

/// A stage, ready for a pipeline.
pub struct Compiled {
    /// The module.
    pub module: ShaderModule,
    /// What it binds.
    pub interface: Interface,
    /// Main file.
    pub file: String,
}

/// All stages compiled so far.
pub struct ShaderLibrary {
    device: Arc<Device>,
    sources: ShaderSources,
    cache: SpirvCache,
    stages: HashMap<String, Arc<Compiled>>,
}

impl ShaderLibrary {
    /// An empty library.
    pub fn new(device: &Arc<Device>, sources: ShaderSources, cache: SpirvCache) -> Self {
        Self { device: Arc::clone(device), sources, cache, stages: HashMap::new() }
    }

    /// The stage of a main file; compiled at the first call.
    ///
    /// # Errors
    /// When a file is missing, does not compile, or binds what the host does not offer.
    pub fn stage(&mut self, file: &str) -> Result<Arc<Compiled>> {
        if let Some(stage) = self.stages.get(file) {
            return Ok(Arc::clone(stage));
        }
        let words = compile(&self.sources.load(file)?, &self.cache)?;
        let interface = reflect(file, &words)?.interface;
        let module = ShaderModule::new(&self.device, file, &words)?;
        let stage = Arc::new(Compiled { module, interface, file: file.to_owned() });
        self.stages.insert(file.to_owned(), Arc::clone(&stage));
        Ok(stage)
    }
}

/// The interface of a pipeline made of several stages: the same name must be the same binding everywhere.
///
/// # Errors
/// [`RendererError::Interface`] naming both stages.
pub fn merge_interfaces(stages: &[&Compiled]) -> Result<Interface> {
    let mut merged = Interface::default();
    let mut origin: HashMap<u32, &str> = HashMap::new();
    for stage in stages {
        merged.uses_scene |= stage.interface.uses_scene;
        merged.push_bytes = merged.push_bytes.max(stage.interface.push_bytes);
        for binding in &stage.interface.bindings {
            match merged.bindings.iter().find(|known| known.binding == binding.binding) {
                None => {
                    origin.insert(binding.binding, &stage.file);
                    merged.bindings.push(binding.clone());
                }
                Some(known) if known == binding => {}
                Some(known) => {
                    let other = origin.get(&binding.binding).copied().unwrap_or("another stage");
                    return Err(RendererError::Interface {
                        file: stage.file.clone(),
                        reason: format!(
                            "binding {} of set 1 is '{}' ({:?}) here and '{}' ({:?}) in {other}",
                            binding.binding, binding.name, binding.kind, known.name, known.kind
                        ),
                    });
                }
            }
        }
    }
    merged.bindings.sort_by_key(|binding| binding.binding);
    Ok(merged)
}
