//! Compiled stages by file, each compiled once, and the pipelines made of them, which may be replaced while they are in use.
//! Enters: file names. Leaves: stages with their interfaces, and [`Live`] pipelines.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

use caustica_gpu::{Device, Interface, ShaderModule};

use super::abilities;
use super::compile::{SpirvCache, compile};
use super::fault::ShaderFault;
use super::limits::{self, GroupSize};
use super::live::{Live, Make, Owner, Replaceable};
use super::payloads::RayInterface;
use super::reflect::{Reflection, Varying, reflect};
use super::sources::{ShaderSources, Source};
use super::suspects::{HeldShader, Suspects};
use crate::error::{RendererError, Result};

/// A stage, ready for a pipeline.
pub struct Compiled {
    /// The module.
    pub module: ShaderModule,
    /// What it binds.
    pub interface: Interface,
    /// What the stage before hands over, and what it hands over.
    pub(super) inputs: Vec<Varying>,
    pub(super) outputs: Vec<Varying>,
    /// Size of its workgroups, if it has them.
    group: Option<GroupSize>,
    pub(super) rays: RayInterface,
    pub(super) source: Source,
}

impl Compiled {
    /// Compiles a main file with everything it includes, or takes an earlier result from the cache.
    ///
    /// # Errors
    /// When it does not compile, takes more than the device has, or binds what the host does not offer.
    pub fn new(device: &Arc<Device>, source: Source, cache: &SpirvCache) -> Result<Self> {
        let words = compile(&source, cache)?;
        let placed = |error| ShaderFault::placed(&source, error);
        let Reflection { interface, inputs, outputs } = reflect(&source.file, &words).map_err(placed)?;
        abilities::check(&source, &words)?;
        let group = limits::check(&source, &words, device.limits())?;
        let module = ShaderModule::new(device, &source.file, &words)?;
        Ok(Self { module, interface, inputs, outputs, group, rays: RayInterface::of(&words), source })
    }

    /// Whether its workgroups are those that the host counts with.
    ///
    /// # Errors
    /// [`RendererError::Compile`] with the place: expected against found.
    pub(crate) fn check_dispatched(&self, expected: GroupSize) -> Result<()> {
        limits::check_dispatched(&self.source, self.group, expected)
    }

    /// Why it is not used, at the first line with a word.
    pub(super) fn refuse(&self, word: &str, reason: impl Into<String>) -> RendererError {
        let faults = vec![ShaderFault::at(&self.source, &[word], reason)];
        RendererError::Compile { file: self.source.file.clone(), faults }
    }

    /// Its name without the folder.
    pub(super) fn name(&self) -> &str {
        self.file().rsplit('/').next().unwrap_or_default()
    }

    /// Main file.
    pub fn file(&self) -> &str {
        &self.source.file
    }
}

/// Main files, each with every file that it includes.
pub type ShaderFiles = BTreeMap<String, Vec<String>>;

/// All stages compiled so far, and the pipelines in use. Shared with the thread that compiles what was edited.
pub struct ShaderLibrary {
    pub(super) device: Arc<Device>,
    sources: Mutex<ShaderSources>,
    pub(super) cache: SpirvCache,
    /// Shaders are edited: one that is broken when it is needed for the first time is replaced by the built-in one.
    edited: AtomicBool,
    stages: Mutex<HashMap<String, Arc<Compiled>>>,
    /// What [`Self::files`] says, until there is another stage.
    listed: Mutex<Option<Arc<ShaderFiles>>>,
    replaced: Mutex<Vec<ShaderFault>>,
    suspects: Mutex<Suspects>,
    live: Mutex<Vec<Weak<dyn Replaceable>>>,
}

impl ShaderLibrary {
    /// An empty library. `edited`: a stage that is broken when it is needed first is replaced by the built-in one.
    pub fn new(device: &Arc<Device>, sources: ShaderSources, cache: SpirvCache, edited: bool) -> Self {
        let device = Arc::clone(device);
        let (stages, listed, replaced, suspects, live) = Default::default();
        let (sources, edited) = (Mutex::new(sources), AtomicBool::new(edited));
        Self { device, sources, cache, edited, stages, listed, replaced, suspects, live }
    }

    /// The stage of a main file; compiled at the first call.
    ///
    /// # Errors
    /// When a file is missing, does not compile, or binds what the host does not offer.
    pub fn stage(&self, file: &str) -> Result<Arc<Compiled>> {
        if let Some(stage) = self.known(file) {
            return Ok(stage);
        }
        let stage = match self.compiled(file, &self.sources()) {
            Ok(stage) => stage,
            Err(error) => {
                self.fall_back(&[file], error)?;
                return self.stage(file);
            }
        };
        if self.is_edited() {
            let built_in = ShaderSources::default().load(file).map(|source| source.texts).unwrap_or_default();
            self.suspect(&stage, &built_in);
        }
        let stage = Arc::new(stage);
        self.insert(&stage);
        Ok(stage)
    }

    fn compiled(&self, file: &str, sources: &ShaderSources) -> Result<Compiled> {
        Compiled::new(&self.device, sources.load(file)?, &self.cache)
    }

    fn insert(&self, stage: &Arc<Compiled>) {
        lock(&self.stages).insert(stage.file().to_owned(), Arc::clone(stage));
        *lock(&self.listed) = None;
    }

    /// Puts the built-in stages in the place of those that cannot be used together, or with what the host gives.
    ///
    /// # Errors
    /// With the reason, where shaders are not edited, or these are the built-in ones.
    pub(super) fn fall_back(&self, files: &[&str], error: RendererError) -> Result<()> {
        let mut is_another = false;
        for file in files.iter().filter(|_| self.is_edited()) {
            let Ok(built_in) = self.compiled(file, &ShaderSources::default()) else { continue };
            if self.known(file).is_none_or(|known| known.source != built_in.source) {
                self.insert(&Arc::new(built_in));
                is_another = true;
            }
        }
        if !is_another {
            return Err(error);
        }
        lock(&self.replaced).extend(ShaderFault::of_error(error));
        Ok(())
    }

    /// The stage is used from the next frame on, in the place of these texts.
    fn suspect(&self, stage: &Compiled, before: &BTreeMap<String, String>) {
        let frame = self.device.recording();
        lock(&self.suspects).note(stage.file(), before, &stage.source.texts, frame);
    }

    /// Shaders that came into use lately and may be why a pass did not finish, which was waited for so long. May be called on
    /// any thread, like [`Self::held`].
    pub fn blamed(&self, pass: &str, waited: Duration) -> Vec<HeldShader> {
        let sources = self.sources();
        // Of a lost device it is not known how far it came.
        let done = self.device.completed().unwrap_or(u64::MAX);
        let mut blamed = lock(&self.suspects).blamed(pass, done, waited);
        for held in sources.held() {
            // What took its place did not finish either.
            if let Some(shader) = blamed.iter_mut().find(|shader| shader.file == held.file) {
                shader.bad.clone_from(&held.bad);
            }
        }
        blamed
    }

    /// Shaders that did not finish earlier, and are in their files still.
    pub fn held(&self) -> Vec<HeldShader> {
        self.sources().held().cloned().collect()
    }

    /// Whether a shader came into use so lately that it has not proven itself.
    pub fn has_suspects(&self) -> bool {
        lock(&self.suspects).are_new(self.device.recording())
    }

    /// Files that hold a shader which did not finish, and what is done about it.
    pub(super) fn held_faults(&self) -> Vec<ShaderFault> {
        let fault = |held: &HeldShader| {
            let message = format!(
                "did not finish (pass {}): the shader before is shown; edit and save the file to try again",
                held.pass
            );
            ShaderFault::whole(&held.file, message)
        };
        self.sources().held().map(fault).collect()
    }

    /// What was wrong with stages that were needed for the first time, since this was asked last.
    pub(super) fn take_replaced(&self) -> Vec<ShaderFault> {
        std::mem::take(&mut *lock(&self.replaced))
    }

    /// Where shaders come from.
    pub(super) fn sources(&self) -> ShaderSources {
        lock(&self.sources).clone()
    }

    /// The folder that shaders come from.
    pub fn folder(&self) -> Option<PathBuf> {
        lock(&self.sources).folder().map(Path::to_owned)
    }

    /// Whether shaders are edited while they are in use.
    pub(crate) fn is_edited(&self) -> bool {
        self.edited.load(Ordering::Relaxed)
    }

    /// Shaders come from a folder from now on, and are edited there.
    pub(crate) fn edit(&self, folder: &Path) {
        *lock(&self.sources) = ShaderSources::new(Some(folder.to_owned()));
        self.edited.store(true, Ordering::Relaxed);
    }

    /// Every stage compiled so far.
    pub(super) fn all_stages(&self) -> Vec<Arc<Compiled>> {
        lock(&self.stages).values().cloned().collect()
    }

    /// The main files of all stages compiled so far, each with every file that it includes. Cheap: asked for in every frame.
    pub fn files(&self) -> Arc<ShaderFiles> {
        // Held meanwhile: a stage that comes after the stages were looked at takes the list away again.
        let mut listed = lock(&self.listed);
        let includes = |stage: &Compiled| {
            stage.source.texts.keys().filter(|file| *file != stage.file()).cloned().collect()
        };
        let list = || {
            let stages = self.all_stages();
            Arc::new(stages.iter().map(|stage| (stage.file().to_owned(), includes(stage))).collect())
        };
        Arc::clone(listed.get_or_insert_with(list))
    }

    pub(super) fn known(&self, file: &str) -> Option<Arc<Compiled>> {
        lock(&self.stages).get(file).cloned()
    }

    /// Makes a pipeline of these main files that is made anew when they change.
    pub(crate) fn live<P: Send + Sync + 'static>(
        self: &Arc<Self>,
        files: &[&'static str],
        owner: &Arc<Owner>,
        make: Make<P>,
    ) -> Result<Live<P>> {
        let live = Live::new(files, owner, make, self)?;
        let mut all = lock(&self.live);
        all.retain(|other| other.strong_count() > 0);
        all.push(live.as_replaceable());
        Ok(live)
    }

    /// The pipelines in use.
    pub(super) fn all_live(&self) -> Vec<Arc<dyn Replaceable>> {
        lock(&self.live).iter().filter_map(Weak::upgrade).collect()
    }

    /// Takes over stages that were compiled anew. What was made of the old ones and is not in use is made anew when it is.
    pub(super) fn put(&self, stages: Vec<Arc<Compiled>>) {
        let files: BTreeSet<String> = stages.iter().map(|stage| stage.file().to_owned()).collect();
        for stage in &stages {
            if let Some(before) = self.known(stage.file()) {
                self.suspect(stage, &before.source.texts);
            }
        }
        lock(&self.stages).extend(stages.into_iter().map(|stage| (stage.file().to_owned(), stage)));
        *lock(&self.listed) = None;
        for live in self.all_live() {
            let stale = live.files().iter().any(|file| files.contains(*file))
                && !live.is_of(&|file| self.known(file));
            if stale {
                live.owner().set_outdated();
            }
        }
    }
}

pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
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
                    origin.insert(binding.binding, stage.file());
                    merged.bindings.push(binding.clone());
                }
                Some(known) if known == binding => {}
                Some(known) => {
                    let other = origin.get(&binding.binding).copied().unwrap_or("another stage");
                    return Err(RendererError::Interface {
                        file: stage.file().to_owned(),
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
