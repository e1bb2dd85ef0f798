//! Frames in flight on the one queue. Enters: recorded commands. Leaves: timeline values and pass times.
//! The thread that owns `Frames` owns submission.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use ash::vk;

use crate::Result;
use crate::context::Device;
use crate::error::{Context, GpuError};
use crate::recorder::Recorder;
use crate::retire::Garbage;
use crate::staging::Staging;
use crate::swapchain::Acquired;
use crate::timers::{PassTime, Timers};

/// How many frames the host may be ahead of the device.
const IN_FLIGHT: usize = 2;

struct Slot {
    pool: vk::CommandPool,
    command: vk::CommandBuffer,
    value: u64,
    staging: Option<Staging>,
    timers: Option<Timers>,
    tag: u64,
    /// Its times are in the sum.
    counted: bool,
}

/// What a finished frame tells.
#[derive(Clone, Debug, Default)]
pub struct FrameResult {
    /// Milliseconds of each pass, in order of their first use.
    pub passes: Vec<PassTime>,
    /// What the recorder was tagged with; 0: nothing.
    pub tag: u64,
}

/// The ring of frames in flight.
pub struct Frames {
    device: Arc<Device>,
    slots: Vec<Slot>,
    next: usize,
    finished: FrameResult,
    total_ms: f64,
}

impl Frames {
    /// Makes the ring.
    ///
    /// # Errors
    /// When the driver refuses.
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let slots = (0..IN_FLIGHT).map(|_| create_slot(device)).collect::<Result<Vec<_>>>()?;
        Ok(Self {
            device: Arc::clone(device),
            slots,
            next: 0,
            finished: FrameResult::default(),
            total_ms: 0.0,
        })
    }

    /// How many frames may be in flight; `Recorder::slot` is below it.
    pub fn in_flight() -> usize {
        IN_FLIGHT
    }

    /// Waits until the slot of the frame before last is free and starts to record.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`] or [`GpuError::Timeout`], both with the last pass that finished.
    pub fn begin(&mut self) -> Result<Recorder> {
        let index = self.next;
        let device = Arc::clone(&self.device);
        self.finished = FrameResult::default();
        self.finish_slot(index)?;
        let slot = &mut self.slots[index];
        let mut staging = slot.staging.take().unwrap_or_else(|| Staging::new(&device));
        let mut timers = match slot.timers.take() {
            Some(timers) => timers,
            None => Timers::new(&device)?,
        };
        staging.reset();
        timers.reset();
        device.collect_retired()?;
        // SAFETY: the frame that used the pool has finished.
        unsafe {
            device
                .raw
                .reset_command_pool(slot.pool, vk::CommandPoolResetFlags::empty())
                .during("vkResetCommandPool")?;
            let info =
                vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
            device.raw.begin_command_buffer(slot.command, &info).during("vkBeginCommandBuffer")?;
        }
        Ok(Recorder::new(device, slot.command, index, staging, timers))
    }

    /// Submits what was recorded; returns the timeline value it will reach. `window`: wait for and signal its image.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`] and other refusals of the driver.
    pub fn submit(&mut self, recorder: Recorder, window: Option<&Acquired>) -> Result<u64> {
        let tag = recorder.tag();
        let (command, index, staging, timers) = recorder.finish()?;
        let device = &self.device;
        let value = device.submitted.load(Ordering::Acquire) + 1;
        let mut signals = vec![
            vk::SemaphoreSubmitInfo::default()
                .semaphore(device.timeline)
                .value(value)
                .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS),
        ];
        let mut waits = Vec::new();
        let background = device.background.seen.load(Ordering::Acquire);
        if background > 0 {
            // Signalled already: the wait costs nothing and lets this queue see what the background has written.
            waits.push(
                vk::SemaphoreSubmitInfo::default()
                    .semaphore(device.background.semaphore)
                    .value(background)
                    .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS),
            );
        }
        if let Some(window) = window {
            waits.push(
                vk::SemaphoreSubmitInfo::default()
                    .semaphore(window.available)
                    .stage_mask(vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT),
            );
            signals.push(
                vk::SemaphoreSubmitInfo::default()
                    .semaphore(window.rendered)
                    .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS),
            );
        }
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(command)];
        let info = [vk::SubmitInfo2::default()
            .wait_semaphore_infos(&waits)
            .signal_semaphore_infos(&signals)
            .command_buffer_infos(&commands)];
        timers.watch(value);
        let slot = &mut self.slots[index];
        slot.staging = Some(staging);
        slot.timers = Some(timers);
        slot.tag = tag;
        let queue = device.queue.lock().map_err(|_| lost("unknown", "submission"))?;
        // SAFETY: the queue is locked, the command buffer is complete, the semaphores are alive.
        let submitted = unsafe { device.raw.queue_submit2(*queue, &info, vk::Fence::null()) };
        drop(queue);
        if let Err(error) = submitted.during("vkQueueSubmit2") {
            if let Ok(mut tracker) = device.tracker.lock() {
                tracker.roll_back();
            }
            let error = device.name_the_pass(error);
            self.slots[index].timers.iter().for_each(Timers::forget);
            return Err(error);
        }
        if let Ok(mut tracker) = device.tracker.lock() {
            tracker.commit();
        }
        device.submitted.store(value, Ordering::Release);
        (self.slots[index].value, self.slots[index].counted) = (value, false);
        self.next = (index + 1) % IN_FLIGHT;
        Ok(value)
    }

    /// Waits for everything submitted so far; for read-back and the end of a headless run.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`] or [`GpuError::Timeout`], both with the last pass that finished.
    pub fn finish(&mut self) -> Result<()> {
        // The newest slot last, so that its times are the ones kept.
        for step in 0..IN_FLIGHT {
            self.finish_slot((self.next + step) % IN_FLIGHT)?;
        }
        self.device.collect_retired()?;
        Ok(())
    }

    /// Waits like [`Frames::finish`] and gives back the staging memory that is kept for the next uploads.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn trim(&mut self) -> Result<()> {
        self.finish()?;
        self.slots.iter_mut().for_each(|slot| slot.staging = None);
        Ok(())
    }

    /// Pass times of the newest frame known to have finished.
    pub fn finished(&self) -> &FrameResult {
        &self.finished
    }

    /// Milliseconds of all passes of all submits known to have finished.
    pub fn total_ms(&self) -> f64 {
        self.total_ms
    }

    fn finish_slot(&mut self, index: usize) -> Result<()> {
        let value = self.slots[index].value;
        if value == 0 {
            return Ok(());
        }
        let waited = self.device.wait_for(value, self.device.hung_after_s());
        waited.map_err(|error| self.device.name_the_pass(error))?;
        if let Some(timers) = &self.slots[index].timers {
            let passes = timers.read();
            if !std::mem::replace(&mut self.slots[index].counted, true) {
                self.total_ms += passes.iter().map(|pass| pass.ms).sum::<f64>();
            }
            if !passes.is_empty() {
                self.finished = FrameResult { passes, tag: self.slots[index].tag };
            }
        }
        Ok(())
    }
}

impl Drop for Frames {
    fn drop(&mut self) {
        for slot in &self.slots {
            self.device.retire(Garbage::CommandPool(slot.pool));
        }
    }
}

fn lost(last: &str, next: &str) -> GpuError {
    GpuError::DeviceLost { last_pass: last.to_owned(), next_pass: next.to_owned() }
}

fn create_slot(device: &Arc<Device>) -> Result<Slot> {
    let info = vk::CommandPoolCreateInfo::default()
        .queue_family_index(device.queue_family())
        .flags(vk::CommandPoolCreateFlags::TRANSIENT);
    // SAFETY: plain creation; destroyed through the retire queue.
    let pool = unsafe { device.raw.create_command_pool(&info, None) }.during("vkCreateCommandPool")?;
    let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
    // SAFETY: the pool is alive; the buffer dies with it.
    let command =
        unsafe { device.raw.allocate_command_buffers(&info) }.during("vkAllocateCommandBuffers")?[0];
    Ok(Slot { pool, command, value: 0, staging: None, timers: None, tag: 0, counted: false })
}
