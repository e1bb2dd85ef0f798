//! Builds that may come later: first builds past the frame's budget, rebuilds of what refits have loosened, structures
//! to be traced fast once an edit rests, compaction. One batch at a time. It is prepared in a frame (which takes a copy of
//! what later frames may write), submitted at the next one, and taken into use by the frame that finds it finished.

use std::sync::Arc;

use caustica_gpu::{
    AccelStructure, Background, BackgroundWork, Buffer, BufferUse, BuildMode, Device, Location, MemoryUse,
    Recorder, Ticket,
};

use super::blas::{BlasTable, Built, Form};
use super::build::{Job, batch, job_of};
use super::policy::{AccelPolicy, REST_FRAMES};
use crate::error::{RendererError, Result};
use crate::tables::{Snapshot, Tables};

/// Triangles of one batch of builds, unless a single mesh has more.
const BATCH_TRIANGLES: u64 = 2_000_000;
/// Bytes that one batch of compactions may copy: for so long both copies take memory.
const BATCH_BYTES: u64 = 256 << 20;

/// A BLAS that is built or copied in the background.
struct Item {
    number: u32,
    version: u64,
    content: u64,
    structure: Arc<AccelStructure>,
    form: Form,
    boxes: Vec<(glam::Vec3, glam::Vec3)>,
    /// What the background reads.
    _snapshot: Option<Snapshot>,
}

enum Batch {
    Builds(Vec<Job>, Vec<Item>),
    /// Numbers, versions and structures of which the compacted size is asked for.
    Sizes(Vec<(u32, u64, Arc<AccelStructure>)>),
    Copies(Vec<(Arc<AccelStructure>, Item)>),
}

/// What a step of the background brought into use.
#[derive(Debug, Default)]
pub(crate) struct Adopted {
    /// Numbers whose structure is another now.
    pub(crate) swapped: Vec<u32>,
    /// Those of them that had none before.
    pub(crate) appeared: Vec<u32>,
    /// Built from what has changed since: to be refitted in this frame.
    pub(crate) to_refit: Vec<u32>,
    /// How many were compacted.
    pub(crate) compacted: u64,
}

/// The background's work.
pub(crate) struct Later {
    device: Arc<Device>,
    queue: Background,
    /// What to submit, once the frame at this value of the timeline has been.
    prepared: Option<(u64, Batch)>,
    running: Option<(Ticket, Batch, Option<Buffer>)>,
}

impl Later {
    pub(crate) fn new(device: &Arc<Device>) -> Result<Self> {
        Ok(Self {
            device: Arc::clone(device),
            queue: Background::new(device)?,
            prepared: None,
            running: None,
        })
    }

    /// Whether a batch is prepared or running.
    pub(crate) fn is_busy(&self) -> bool {
        self.prepared.is_some() || self.running.is_some()
    }

    /// BLASes in the batch that is prepared or running.
    pub(crate) fn len(&self) -> usize {
        let prepared = self.prepared.as_ref().map(|(_, batch)| batch);
        let batch = self.running.as_ref().map(|(_, batch, _)| batch).or(prepared);
        match batch {
            None | Some(Batch::Sizes(_)) => 0,
            Some(Batch::Builds(_, items)) => items.len(),
            Some(Batch::Copies(copies)) => copies.len(),
        }
    }

    /// Submits what the last frame prepared, and takes into use what has finished.
    pub(crate) fn step(&mut self, blases: &mut BlasTable, policy: &AccelPolicy) -> Result<Adopted> {
        // A scene may be taken in twice in one frame: its copies are then not on their way yet.
        let recording = self.device.recording();
        if let Some((_, batch)) = self.prepared.take_if(|(value, _)| *value < recording) {
            self.submit(batch)?;
        }
        let Some((ticket, _, _)) = &self.running else { return Ok(Adopted::default()) };
        let sizes =
            if policy.wait { Some(self.queue.wait(*ticket)?) } else { self.queue.finished(*ticket)? };
        let (Some(sizes), Some((_, batch, _))) = (sizes.as_ref(), self.running.take_if(|_| sizes.is_some()))
        else {
            return Ok(Adopted::default());
        };
        let mut adopted = Adopted::default();
        match batch {
            Batch::Builds(_, items) => {
                for item in items {
                    adopt(item, blases, &mut adopted);
                }
            }
            Batch::Sizes(asked) => {
                for ((number, version, _), size) in asked.into_iter().zip(sizes) {
                    if let Some(blas) = blases.get_mut(number).filter(|blas| blas.version == version) {
                        blas.compacted_size = Some(*size);
                    }
                }
            }
            Batch::Copies(copies) => {
                for (_, item) in copies {
                    let before = adopted.swapped.len();
                    adopt(item, blases, &mut adopted);
                    adopted.compacted += (adopted.swapped.len() - before) as u64;
                }
            }
        }
        Ok(adopted)
    }

    fn submit(&mut self, prepared: Batch) -> Result<()> {
        let mut scratch = None;
        let mut work = Vec::new();
        match &prepared {
            Batch::Builds(jobs, _) => {
                let alignment = self.device.limits().scratch_alignment.max(1);
                let size = jobs.iter().map(Job::scratch).sum::<u64>() + alignment;
                let (usage, kind) = (BufferUse::General, MemoryUse::AccelerationStructures);
                let buffer =
                    Buffer::new(&self.device, "background scratch", size, usage, Location::Device, kind)?;
                let base = buffer.address().next_multiple_of(alignment);
                work.extend(batch(jobs, base, size - alignment).into_iter().map(BackgroundWork::Build));
                scratch = Some(buffer);
            }
            Batch::Sizes(asked) => {
                work.extend(asked.iter().map(|(_, _, structure)| BackgroundWork::QuerySize(structure)));
            }
            Batch::Copies(copies) => work.extend(
                copies.iter().map(|(from, item)| BackgroundWork::Compact { from, to: &item.structure }),
            ),
        }
        let ticket = self.queue.submit(&work)?;
        drop(work);
        self.running = Some((ticket, prepared, scratch));
        Ok(())
    }

    /// Chooses the next batch when nothing is under way: what is missing first, then what is loose, then what rests, then
    /// compaction.
    pub(crate) fn prepare(
        &mut self,
        recorder: &mut Recorder,
        tables: &Tables,
        blases: &BlasTable,
        policy: &AccelPolicy,
        frame: u64,
    ) -> Result<()> {
        if self.prepared.is_some() || self.running.is_some() {
            return Ok(());
        }
        let rests = |number: &u32| {
            blases.get(*number).is_some_and(|blas| frame.saturating_sub(blas.changed_at) >= REST_FRAMES)
        };
        let first: Vec<u32> = blases.waiting.iter().copied().collect();
        let loose: Vec<u32> = blases.decayed.iter().copied().collect();
        let resting: Vec<u32> = blases.lively.iter().copied().filter(rests).collect();
        let fast = Form::Static { compacted: false };
        let builds = [(first, fast), (loose, Form::Dynamic), (resting, fast)];
        let mut lacking = None;
        for (numbers, form) in builds {
            let batch = self.builds(recorder, tables, blases, (&numbers, form), policy);
            if self.take(batch, &mut lacking)? {
                return Ok(());
            }
        }
        if policy.compact && !blases.uncompacted.is_empty() {
            let batch = self.compactions(blases);
            self.take(batch, &mut lacking)?;
        }
        if self.prepared.is_some() { Ok(()) } else { lacking.map_or(Ok(()), Err) }
    }

    /// True: this is the next batch. Where memory lacks for it, the next kind of work may still do, compaction above all.
    fn take(&mut self, batch: Result<Option<Batch>>, lacking: &mut Option<RendererError>) -> Result<bool> {
        match batch {
            Ok(batch) => {
                self.prepared = batch.map(|batch| (self.device.recording(), batch));
                Ok(self.prepared.is_some())
            }
            Err(error) if error.is_out_of_memory() => {
                *lacking = Some(error);
                Ok(false)
            }
            Err(error) => Err(error),
        }
    }

    /// As many of them as a batch takes; those that memory lacks for are passed over while others fit.
    fn builds(
        &self,
        recorder: &mut Recorder,
        tables: &Tables,
        blases: &BlasTable,
        (numbers, form): (&[u32], Form),
        policy: &AccelPolicy,
    ) -> Result<Option<Batch>> {
        let (mut jobs, mut items) = (Vec::<Job>::new(), Vec::new());
        let (mut triangles, mut scratch) = (0, 0);
        let mut lacking = None;
        for number in numbers {
            let Some(blas) = blases.get(*number) else { continue };
            let made = tables.snapshot(recorder, blas.key.mesh, blas.key.deforming).and_then(|snapshot| {
                let (what, how) = ((*number, &blas.key), (form, BuildMode::Build));
                Ok((job_of(&self.device, tables, what, how, None, Some(&snapshot))?, snapshot))
            });
            let (job, snapshot) = match made {
                Err(error) if error.is_out_of_memory() => {
                    lacking = Some(error);
                    continue;
                }
                made => made?,
            };
            triangles += job.element_count();
            scratch += job.scratch();
            // A batch runs side by side: what does not fit is left to the next one.
            if !jobs.is_empty() && (triangles > BATCH_TRIANGLES || scratch > policy.background_scratch) {
                break;
            }
            items.push(Item {
                number: *number,
                version: blas.version,
                content: blas.content,
                structure: Arc::clone(&job.structure),
                form,
                boxes: super::boxes_of(tables, blas.key.mesh),
                _snapshot: Some(snapshot),
            });
            jobs.push(job);
        }
        match lacking {
            Some(error) if jobs.is_empty() => Err(error),
            _ => Ok((!jobs.is_empty()).then_some(Batch::Builds(jobs, items))),
        }
    }

    /// Asks for sizes as long as some are unknown, then copies.
    fn compactions(&self, blases: &BlasTable) -> Result<Option<Batch>> {
        let all = || blases.uncompacted.iter().filter_map(|number| Some((*number, blases.get(*number)?)));
        let unknown: Vec<_> = all()
            .filter(|(_, blas)| blas.compacted_size.is_none())
            .filter_map(|(number, blas)| {
                Some((number, blas.version, Arc::clone(&blas.built.as_ref()?.structure)))
            })
            .collect();
        if !unknown.is_empty() {
            return Ok(Some(Batch::Sizes(unknown)));
        }
        let (mut copies, mut bytes) = (Vec::new(), 0);
        for (number, blas) in all() {
            let (Some(size), Some(built)) = (blas.compacted_size, &blas.built) else { continue };
            if !copies.is_empty() && bytes + size > BATCH_BYTES {
                break;
            }
            bytes += size;
            let structure = Arc::new(AccelStructure::new(&self.device, "compacted blas", size, false)?);
            let item = Item {
                number,
                version: blas.version,
                content: blas.content,
                structure,
                form: Form::Static { compacted: true },
                boxes: built.boxes.clone(),
                _snapshot: None,
            };
            copies.push((Arc::clone(&built.structure), item));
        }
        Ok((!copies.is_empty()).then_some(Batch::Copies(copies)))
    }
}

/// Takes a structure into use where it still fits. When only places of vertices and primitives have changed since, a dynamic
/// one can be refitted, and where nothing was built before a static one is at least made anew in this frame.
fn adopt(item: Item, blases: &mut BlasTable, adopted: &mut Adopted) {
    let Some(blas) = blases.get(item.number) else { return };
    let current = blas.version == item.version;
    let first = blas.built.is_none();
    let useful = blas.content == item.content && (first || item.form == Form::Dynamic);
    if !current && !useful {
        return;
    }
    adopted.appeared.extend(first.then_some(item.number));
    adopted.swapped.push(item.number);
    if !current {
        adopted.to_refit.push(item.number);
    }
    blases.adopt(item.number, Built { structure: item.structure, form: item.form, boxes: item.boxes });
}
