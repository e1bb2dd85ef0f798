//! A pipeline that may be replaced while it is in use. Enters: the stages it is made of. Leaves: the pipeline to record with;
//! the one before lives until the last frame that uses it has finished.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, Weak};

use caustica_gpu::{Bind, BindSort, Binding, BindingKind};

use super::library::{Compiled, ShaderLibrary, lock};
use crate::error::Result;

/// Gives the stage of a main file.
pub(crate) type StageOf<'a> = &'a dyn Fn(&str) -> Result<Arc<Compiled>>;
/// Makes a pipeline.
pub(crate) type Make<P> = Box<dyn Fn(StageOf<'_>) -> Result<P> + Send + Sync>;
/// Puts a pipeline that was made in the place of the one before.
pub(crate) type Swap = Box<dyn FnOnce() + Send>;

/// What pipelines belong to: one set of passes. Pipelines of a set that no view shows are not made anew, the set is.
#[derive(Debug, Default)]
pub(crate) struct Owner {
    used: AtomicU64,
    outdated: AtomicBool,
    /// What it makes is kept in the tables, and is made again when a pipeline was replaced.
    pub(super) fills_tables: bool,
}

/// A set that was not used in so many frames is shown by no view.
const FRESH_FRAMES: u64 = 8;

impl Owner {
    /// Of passes that fill tables.
    pub(crate) fn of_tables() -> Self {
        Self { fills_tables: true, ..Self::default() }
    }

    /// Notes that the frame of this number uses it.
    pub(crate) fn set_used(&self, frame: u64) {
        self.used.store(frame, Ordering::Relaxed);
    }

    /// Whether it is shown; `frame`: the number of the frame that comes next.
    pub(super) fn is_fresh(&self, frame: u64) -> bool {
        self.fills_tables || self.used.load(Ordering::Relaxed).saturating_add(FRESH_FRAMES) >= frame
    }

    pub(super) fn set_outdated(&self) {
        self.outdated.store(true, Ordering::Relaxed);
    }

    /// Shaders have changed while it was not used.
    pub(crate) fn is_outdated(&self) -> bool {
        self.outdated.load(Ordering::Relaxed)
    }
}

/// See the head of the file.
pub(crate) struct Live<P>(Arc<Slot<P>>);

struct Slot<P> {
    files: Vec<&'static str>,
    library: Weak<ShaderLibrary>,
    owner: Arc<Owner>,
    make: Make<P>,
    current: Mutex<Current<P>>,
    /// What the host binds, once it has.
    offered: OnceLock<Vec<(String, BindSort)>>,
}

/// A [`Live`] pipeline of any kind, as the thread sees it that makes pipelines anew.
pub(crate) trait Replaceable: Send + Sync {
    fn files(&self) -> &[&'static str];
    fn owner(&self) -> &Owner;
    /// Whether it is made of these stages.
    fn is_of(&self, stage: &dyn Fn(&str) -> Option<Arc<Compiled>>) -> bool;
    /// Makes it of other stages. Nothing changes before the result is called.
    fn prepare(self: Arc<Self>, stage: StageOf<'_>) -> Result<Swap>;
}

impl<P: Send + Sync + 'static> Live<P> {
    pub(super) fn new(
        files: &[&'static str],
        owner: &Arc<Owner>,
        make: Make<P>,
        library: &Arc<ShaderLibrary>,
    ) -> Result<Self> {
        let made = made(files, &make, library).or_else(|error| {
            library.fall_back(files, error)?;
            made(files, &make, library)
        });
        Ok(Self(Arc::new(Slot {
            files: files.to_vec(),
            library: Arc::downgrade(library),
            owner: Arc::clone(owner),
            make,
            current: Mutex::new(made?),
            offered: OnceLock::new(),
        })))
    }

    pub(super) fn as_replaceable(&self) -> Weak<dyn Replaceable> {
        let slot: Weak<Slot<P>> = Arc::downgrade(&self.0);
        slot
    }

    /// The pipeline to record with. `binds`: what the host gives it, the same every time.
    ///
    /// # Errors
    /// At the first call, where the shaders bind something else and are not edited.
    pub(crate) fn get(&self, binds: &[(&str, Bind<'_>)]) -> Result<Arc<P>> {
        if self.0.offered.get().is_none() {
            let offered = || binds.iter().map(|(name, bind)| ((*name).to_owned(), bind.sort())).collect();
            self.0.hold_against(self.0.offered.get_or_init(offered))?;
        }
        Ok(Arc::clone(&lock(&self.0.current).0))
    }
}

type Current<P> = (Arc<P>, Vec<Arc<Compiled>>);

fn made<P>(files: &[&'static str], make: &Make<P>, library: &ShaderLibrary) -> Result<Current<P>> {
    let stage = |file: &str| library.stage(file);
    Ok((Arc::new(make(&stage)?), stages_of(files, &stage)?))
}

fn stages_of(files: &[&'static str], stage: StageOf<'_>) -> Result<Vec<Arc<Compiled>>> {
    files.iter().map(|file| stage(file)).collect()
}

impl<P> Slot<P> {
    /// Before it is used: built-in shaders take the place of those that bind what the host does not give.
    fn hold_against(&self, offered: &[(String, BindSort)]) -> Result<()> {
        let stages = lock(&self.current).1.clone();
        let Err(error) = stages.iter().try_for_each(|stage| check_offered(stage, offered)) else {
            return Ok(());
        };
        let Some(library) = self.library.upgrade() else { return Err(error) };
        library.fall_back(&self.files, error)?;
        *lock(&self.current) = made(&self.files, &self.make, &library)?;
        Ok(())
    }
}

impl<P: Send + Sync + 'static> Replaceable for Slot<P> {
    fn files(&self) -> &[&'static str] {
        &self.files
    }

    fn owner(&self) -> &Owner {
        &self.owner
    }

    fn is_of(&self, stage: &dyn Fn(&str) -> Option<Arc<Compiled>>) -> bool {
        let stages = lock(&self.current).1.clone();
        stages
            .iter()
            .zip(&self.files)
            .all(|(known, file)| stage(file).is_some_and(|now| Arc::ptr_eq(known, &now)))
    }

    fn prepare(self: Arc<Self>, stage: StageOf<'_>) -> Result<Swap> {
        let stages = stages_of(&self.files, stage)?;
        match self.offered.get() {
            Some(offered) => stages.iter().try_for_each(|stage| check_offered(stage, offered))?,
            // The pass has not run yet: what it bound so far is known to be given.
            None => {
                let before = lock(&self.current).1.clone();
                stages.iter().try_for_each(|stage| check_known(stage, &before))?;
            }
        }
        let pipeline = Arc::new((self.make)(stage)?);
        Ok(Box::new(move || *lock(&self.current) = (pipeline, stages)))
    }
}

/// Whether a stage binds only what stages before it have bound.
fn check_known(stage: &Compiled, before: &[Arc<Compiled>]) -> Result<()> {
    let known = || before.iter().flat_map(|stage| &stage.interface.bindings);
    let is_known = |binding: &&Binding| known().any(|k| k.name == binding.name && k.kind == binding.kind);
    let Some(new) = stage.interface.bindings.iter().find(|binding| !is_known(binding)) else { return Ok(()) };
    let known: Vec<&str> = known().map(|binding| binding.name.as_str()).collect();
    let reason = format!(
        "binding '{}': the pass has not run yet, and expected are only those that it had before ({})",
        new.name,
        known.join(", ")
    );
    Err(stage.refuse(&new.name, reason))
}

/// Whether the host gives everything that a stage binds.
fn check_offered(stage: &Compiled, offered: &[(String, BindSort)]) -> Result<()> {
    for binding in &stage.interface.bindings {
        let name = &binding.name;
        let refuse = |reason: String| Err(stage.refuse(name, reason));
        let Some((_, sort)) = offered.iter().find(|(known, _)| known == name) else {
            let known: Vec<&str> = offered.iter().map(|(known, _)| known.as_str()).collect();
            let expected = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            return refuse(format!(
                "binding '{name}': expected one of what the host gives ({expected}), found '{name}'"
            ));
        };
        if !binding.kind.accepts(*sort) {
            return refuse(format!(
                "binding '{name}': the host gives {sort:?}, the shader has {:?}",
                binding.kind
            ));
        }
        if let (BindSort::Image(given), Some(declared)) = (sort, binding.format)
            && *given != declared
        {
            return refuse(format!("binding '{name}': expected an image of {given:?}, found {declared:?}"));
        }
        if let (BindSort::Image(given), BindingKind::SampledImage) = (sort, binding.kind)
            && given.is_uint() != binding.reads_uint
        {
            let kind = if given.is_uint() { "utexture2D" } else { "texture2D" };
            return refuse(format!("binding '{name}': expected a {kind}, as the host gives {given:?}"));
        }
    }
    Ok(())
}
