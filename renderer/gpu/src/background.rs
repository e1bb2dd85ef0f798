//! Work beside the frames: first builds, size queries and compaction, on a queue of its own where the device has one,
//! else between the frames. Enters: structures and buffers that no frame writes meanwhile. Leaves: tickets, and
//! compacted sizes once a ticket is finished. What to build and when is the renderer's business.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use ash::vk;

use crate::Result;
use crate::accel::{AccelBuild, AccelStructure, record_builds, record_compaction};
use crate::buffer::Buffer;
use crate::context::Device;
use crate::error::{Context, GpuError};
use crate::retire::Garbage;

/// Name of this work where an error names a pass.
const LABEL: &str = "background";

/// One piece of background work. Within a submission copies come first, then builds, then queries and compactions,
/// in whatever order they are given.
#[derive(Clone, Copy)]
pub enum BackgroundWork<'a> {
    /// Copies the first `size` bytes of a buffer. No frame may write `from` before the ticket is finished; a snapshot
    /// of something that frames do write is taken by a frame ([`crate::Recorder::copy_buffer`]).
    Copy {
        /// Source.
        from: &'a Buffer,
        /// Target.
        to: &'a Buffer,
        /// Bytes.
        size: u64,
    },
    /// A build. The builds of one submission run side by side: their scratch regions lie apart.
    Build(AccelBuild<'a>),
    /// Asks for the compacted size of a BLAS built with [`crate::BuildPreference::FastTrace`], in this submission or
    /// earlier.
    QuerySize(&'a AccelStructure),
    /// Copies a BLAS, built earlier, into a structure of the size that was asked for.
    Compact {
        /// Source, as it was built.
        from: &'a AccelStructure,
        /// Target, of the compacted size.
        to: &'a AccelStructure,
    },
}

/// Names a submission of a [`Background`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Ticket(u64);

/// Commands and queries of one submission; reused.
struct Slot {
    pool: vk::CommandPool,
    command: vk::CommandBuffer,
    queries: Option<(vk::QueryPool, u32)>,
    asked: u32,
    value: u64,
    /// The value of the frames that it waits for.
    frames: u64,
    since: Instant,
}

/// Submits background work. Owned by the thread that owns [`crate::Frames`].
///
/// What is dropped while the background uses it lives until the background is done with it, as with frames. What the
/// background writes must not be read, and what it reads must not be written, before the ticket is finished.
pub struct Background {
    device: Arc<Device>,
    running: Vec<Slot>,
    idle: Vec<Slot>,
}

impl Background {
    /// Makes a background without work.
    ///
    /// # Errors
    /// When the driver refuses.
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let first = create_slot(device)?;
        Ok(Self { device: Arc::clone(device), running: Vec::new(), idle: vec![first] })
    }

    /// Submits work, which starts once the device has finished the frames submitted so far, so that what they upload
    /// is there.
    ///
    /// # Errors
    /// [`GpuError::Limit`] when a buffer is too small for its copy; [`GpuError::DeviceLost`] and other refusals of
    /// the driver.
    pub fn submit(&mut self, work: &[BackgroundWork<'_>]) -> Result<Ticket> {
        check_copies(work)?;
        let mut slot = match self.idle.pop() {
            Some(slot) => slot,
            None => create_slot(&self.device)?,
        };
        let result = record(&self.device, &mut slot, work).and_then(|()| send(&self.device, slot.command));
        match result {
            Ok((value, frames)) => {
                (slot.value, slot.frames, slot.since) = (value, frames, Instant::now());
                self.running.push(slot);
                Ok(Ticket(value))
            }
            Err(error) => {
                self.idle.push(slot);
                Err(self.name_the_work(error, None))
            }
        }
    }

    /// `None` while the work runs; then, once, the compacted sizes in bytes, in order of the
    /// [`BackgroundWork::QuerySize`] entries. Later calls for the same ticket answer with an empty list.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`]; [`GpuError::Timeout`] when it has run for so long that the device counts as hung.
    pub fn finished(&mut self, ticket: Ticket) -> Result<Option<Vec<u64>>> {
        let completed = self.device.background_completed();
        if completed.map_err(|error| self.name_the_work(error, Some(ticket)))? >= ticket.0 {
            return self.take(ticket).map(Some);
        }
        let seconds = self.device.hung_after_s();
        let hung = |slot: &Slot| slot.value == ticket.0 && slot.since.elapsed().as_secs() >= seconds;
        if self.running.iter().any(hung) {
            self.device.give_up();
            return Err(self.name_the_work(self.device.overdue(seconds), Some(ticket)));
        }
        Ok(None)
    }

    /// Waits for the work and answers as [`Self::finished`] does.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`] or [`GpuError::Timeout`].
    pub fn wait(&mut self, ticket: Ticket) -> Result<Vec<u64>> {
        let timeline = self.device.background.semaphore;
        let waited = self.device.wait_on(timeline, ticket.0, self.device.hung_after_s());
        let completed = waited.and_then(|()| self.device.background_completed());
        completed.map_err(|error| self.name_the_work(error, Some(ticket)))?;
        self.take(ticket)
    }

    /// Says in an error about a lost or hung device which pass of a frame the work waits for, or else that it was this work.
    fn name_the_work(&self, error: GpuError, ticket: Option<Ticket>) -> GpuError {
        let slot = self.running.iter().find(|slot| Some(Ticket(slot.value)) == ticket);
        // A device that is lost tells no value.
        let waits = slot.is_some_and(|slot| self.device.completed().is_ok_and(|value| value < slot.frames));
        let own = || (String::from("unknown"), String::from(LABEL));
        match error {
            GpuError::Timeout { .. } if waits => self.device.name_the_pass(error),
            GpuError::Timeout { seconds, .. } => {
                let (last_pass, next_pass) = own();
                GpuError::Timeout { seconds, last_pass, next_pass }
            }
            GpuError::DeviceLost { .. } => {
                let named = self.device.name_the_pass(error);
                let is_known =
                    named.unfinished_pass().is_some_and(|pass| !["none", "unknown"].contains(&pass));
                let (last_pass, next_pass) = own();
                if is_known { named } else { GpuError::DeviceLost { last_pass, next_pass } }
            }
            other => other,
        }
    }

    /// Takes the results of a finished submission.
    fn take(&mut self, ticket: Ticket) -> Result<Vec<u64>> {
        let Some(index) = self.running.iter().position(|slot| slot.value == ticket.0) else {
            return Ok(Vec::new());
        };
        let slot = self.running.swap_remove(index);
        let mut sizes = vec![0_u64; slot.asked as usize];
        let read = match slot.queries {
            // SAFETY: the submission has finished, and the slice holds one 64-bit word a query that it wrote.
            Some((pool, _)) if slot.asked > 0 => unsafe {
                let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
                self.device.raw.get_query_pool_results(pool, 0, &mut sizes, flags)
            },
            _ => Ok(()),
        };
        self.idle.push(slot);
        read.during("vkGetQueryPoolResults")?;
        Ok(sizes)
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        for slot in self.running.iter().chain(&self.idle) {
            self.device.retire(Garbage::CommandPool(slot.pool));
            if let Some((pool, _)) = slot.queries {
                self.device.retire(Garbage::QueryPool(pool));
            }
        }
    }
}

impl Device {
    /// The value that the background's timeline has reached. The frames may use what was finished by then: they wait
    /// for it on the device.
    pub(crate) fn background_completed(&self) -> Result<u64> {
        // SAFETY: the semaphore lives as long as the device.
        let value = unsafe { self.raw.get_semaphore_counter_value(self.background.semaphore) }
            .during("vkGetSemaphoreCounterValue")?;
        self.background.seen.fetch_max(value, Ordering::AcqRel);
        Ok(value)
    }
}

fn check_copies(work: &[BackgroundWork<'_>]) -> Result<()> {
    for piece in work {
        if let BackgroundWork::Copy { from, to, size } = *piece {
            let limit = from.size().min(to.size());
            if size > limit {
                return Err(GpuError::Limit { what: String::from("background copy"), asked: size, limit });
            }
        }
    }
    Ok(())
}

fn record(device: &Arc<Device>, slot: &mut Slot, work: &[BackgroundWork<'_>]) -> Result<()> {
    let queried: Vec<_> = work
        .iter()
        .filter_map(|piece| if let BackgroundWork::QuerySize(of) = piece { Some(of.raw) } else { None })
        .collect();
    prepare_queries(device, slot, queried.len() as u32)?;
    let (raw, command) = (&device.raw, slot.command);
    // SAFETY: the submission that used the pool before has finished.
    unsafe {
        raw.reset_command_pool(slot.pool, vk::CommandPoolResetFlags::empty()).during("vkResetCommandPool")?;
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        raw.begin_command_buffer(command, &info).during("vkBeginCommandBuffer")?;
    }
    full_barrier(device, command);
    for piece in work {
        if let BackgroundWork::Copy { from, to, size } = *piece {
            let region = [vk::BufferCopy { src_offset: 0, dst_offset: 0, size }];
            // SAFETY: the sizes were checked; both buffers are retired after this submission at the earliest.
            unsafe { raw.cmd_copy_buffer(command, from.raw, to.raw, &region) };
        }
    }
    full_barrier(device, command);
    let builds: Vec<_> = work
        .iter()
        .filter_map(|piece| if let BackgroundWork::Build(build) = piece { Some(*build) } else { None })
        .collect();
    if !builds.is_empty() {
        record_builds(device, command, &builds);
    }
    full_barrier(device, command);
    if let (Some((pool, _)), false) = (slot.queries, queried.is_empty()) {
        // SAFETY: the pool has room for all of them and was reset; the structures were built for compaction.
        unsafe {
            device.accel_fns.cmd_write_acceleration_structures_properties(
                command,
                &queried,
                vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR,
                pool,
                0,
            );
        }
    }
    for piece in work {
        if let BackgroundWork::Compact { from, to } = piece {
            record_compaction(device, command, from, to);
        }
    }
    // SAFETY: recording was begun above.
    unsafe { raw.end_command_buffer(command) }.during("vkEndCommandBuffer")
}

/// Orders everything before it with everything after it. The tracker follows the queue of the frames only, and is not
/// needed here: until its ticket is finished nothing else touches what a submission uses, so the few steps of one
/// submission, and submissions among themselves, are all there is to order.
fn full_barrier(device: &Device, command: vk::CommandBuffer) {
    let barrier = [vk::MemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
        .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)];
    // SAFETY: the command buffer is being recorded.
    unsafe {
        device.raw.cmd_pipeline_barrier2(command, &vk::DependencyInfo::default().memory_barriers(&barrier));
    }
}

/// Submits after the frames so far; returns the value that the background's timeline will reach, and that of the frames.
fn send(device: &Device, command: vk::CommandBuffer) -> Result<(u64, u64)> {
    let at = |semaphore, value| {
        vk::SemaphoreSubmitInfo::default()
            .semaphore(semaphore)
            .value(value)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
    };
    // The value is chosen and submitted under the lock, so that the timeline only ever rises.
    let queue = device.background_queue().lock().map_err(|_| lost())?;
    let value = device.background.submitted.load(Ordering::Acquire) + 1;
    let frames = device.submitted.load(Ordering::Acquire);
    let waits = [at(device.timeline, frames)];
    let signals = [at(device.background.semaphore, value)];
    let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(command)];
    let info = [vk::SubmitInfo2::default()
        .wait_semaphore_infos(&waits)
        .signal_semaphore_infos(&signals)
        .command_buffer_infos(&commands)];
    // SAFETY: the queue is locked, the command buffer is complete, the semaphores live as long as the device.
    unsafe { device.raw.queue_submit2(*queue, &info, vk::Fence::null()) }.during("vkQueueSubmit2")?;
    device.background.submitted.store(value, Ordering::Release);
    Ok((value, frames))
}

/// Makes room for `count` queries and resets them.
fn prepare_queries(device: &Arc<Device>, slot: &mut Slot, count: u32) -> Result<()> {
    slot.asked = count;
    if count == 0 {
        return Ok(());
    }
    if let Some((pool, _)) = slot.queries.take_if(|(_, capacity)| *capacity < count) {
        device.retire(Garbage::QueryPool(pool));
    }
    let (pool, capacity) = match slot.queries {
        Some(queries) => queries,
        None => {
            let capacity = count.next_power_of_two();
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR)
                .query_count(capacity);
            // SAFETY: plain creation; destroyed through the retire queue.
            let pool = unsafe { device.raw.create_query_pool(&info, None) }.during("vkCreateQueryPool")?;
            (pool, capacity)
        }
    };
    slot.queries = Some((pool, capacity));
    // SAFETY: the submission that used the pool before has finished; hostQueryReset is on.
    unsafe { device.raw.reset_query_pool(pool, 0, capacity) };
    Ok(())
}

fn create_slot(device: &Arc<Device>) -> Result<Slot> {
    let info = vk::CommandPoolCreateInfo::default()
        .queue_family_index(device.background_family())
        .flags(vk::CommandPoolCreateFlags::TRANSIENT);
    // SAFETY: plain creation; destroyed through the retire queue.
    let pool = unsafe { device.raw.create_command_pool(&info, None) }.during("vkCreateCommandPool")?;
    let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
    // SAFETY: the pool is alive; the buffer dies with it.
    match unsafe { device.raw.allocate_command_buffers(&info) }.during("vkAllocateCommandBuffers") {
        Ok(commands) => Ok(Slot {
            pool,
            command: commands[0],
            queries: None,
            asked: 0,
            value: 0,
            frames: 0,
            since: Instant::now(),
        }),
        Err(error) => {
            device.retire(Garbage::CommandPool(pool));
            Err(error)
        }
    }
}

fn lost() -> GpuError {
    GpuError::DeviceLost { last_pass: String::from("unknown"), next_pass: String::from(LABEL) }
}
