//! Timestamps around passes, and events at their ends. Enters: labels in order. Leaves: milliseconds a label once the frame has
//! finished, and before that how far the device has come.

use std::sync::Arc;

use ash::vk;

use crate::Result;
use crate::context::Device;
use crate::error::Context;
use crate::hang::Passes;
use crate::retire::Garbage;

/// Most passes in a frame that are timed.
const CAPACITY: u32 = 128;

/// Time of one pass.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTime {
    /// Label of the pass, such as `shadow.trace`.
    pub label: String,
    /// Milliseconds on the device.
    pub ms: f64,
}

/// Timestamps of one frame in flight.
pub(crate) struct Timers {
    device: Arc<Device>,
    pool: vk::QueryPool,
    labels: Arc<Vec<String>>,
    /// One a pass, which its end sets. Unlike timestamps they can be asked for by every driver while the device is at work.
    events: Vec<vk::Event>,
    open: bool,
}

impl Timers {
    pub(crate) fn new(device: &Arc<Device>) -> Result<Self> {
        let info =
            vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(CAPACITY * 2);
        // SAFETY: plain creation; destroyed through the retire queue.
        let pool = unsafe { device.raw.create_query_pool(&info, None) }.during("vkCreateQueryPool")?;
        let timers = Self {
            device: Arc::clone(device),
            pool,
            labels: Arc::default(),
            events: Vec::new(),
            open: false,
        };
        timers.reset_pool();
        Ok(timers)
    }

    fn reset_pool(&self) {
        // SAFETY: the frame that used the pool has finished; hostQueryReset is on.
        unsafe { self.device.raw.reset_query_pool(self.pool, 0, CAPACITY * 2) };
    }

    /// Starts anew; the frame that used these timers has finished.
    pub(crate) fn reset(&mut self) {
        self.device.watched.end(self.pool);
        for event in self.events.iter().take(self.labels.len()) {
            // SAFETY: the frame that used the event has finished, and nobody asks for it any more.
            if let Err(error) = unsafe { self.device.raw.reset_event(*event) } {
                tracing::debug!("an event stays set: {error}");
            }
        }
        self.labels = Arc::default();
        self.open = false;
        self.reset_pool();
    }

    pub(crate) fn begin(&mut self, command: vk::CommandBuffer, label: &str) {
        let index = self.labels.len();
        if (index as u32) < CAPACITY && self.event(index).is_some() {
            self.write(command, self.labels.len() as u32 * 2);
            Arc::make_mut(&mut self.labels).push(label.to_owned());
            self.open = true;
        }
    }

    pub(crate) fn end(&mut self, command: vk::CommandBuffer) {
        if self.open {
            self.write(command, self.labels.len() as u32 * 2 - 1);
            self.open = false;
            self.mark(command, self.labels.len() - 1);
        }
    }

    fn write(&self, command: vk::CommandBuffer, query: u32) {
        // SAFETY: the command buffer is being recorded and the query index is below the pool's size.
        unsafe {
            self.device.raw.cmd_write_timestamp2(
                command,
                vk::PipelineStageFlags2::ALL_COMMANDS,
                self.pool,
                query,
            );
        }
    }

    /// Has the event of a pass set when the pass is through.
    fn mark(&self, command: vk::CommandBuffer, index: usize) {
        let Some(event) = self.events.get(index) else { return };
        let stages = vk::PipelineStageFlags2::ALL_COMMANDS;
        let memory = [vk::MemoryBarrier2::default().src_stage_mask(stages).dst_stage_mask(stages)];
        let after = vk::DependencyInfo::default().memory_barriers(&memory);
        // SAFETY: the command buffer is being recorded outside of a rendering scope, and the event was reset.
        unsafe { self.device.raw.cmd_set_event2(command, *event, &after) };
    }

    /// Reads the times of a finished frame; passes of the same label are added up.
    pub(crate) fn read(&self) -> Vec<PassTime> {
        let mut ticks = vec![[0_u64; 2]; self.labels.len() * 2];
        if ticks.is_empty() {
            return Vec::new();
        }
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
        // SAFETY: the slice holds two 64-bit words a query.
        if unsafe { self.device.raw.get_query_pool_results(self.pool, 0, &mut ticks, flags) }.is_err() {
            return Vec::new();
        }
        let period_ns = f64::from(self.device.limits().timestamp_period_ns);
        let mut times: Vec<PassTime> = Vec::new();
        for (label, pair) in self.labels.iter().zip(ticks.chunks_exact(2)) {
            if pair[0][1] == 0 || pair[1][1] == 0 {
                continue;
            }
            let ticks = pair[1][0].wrapping_sub(pair[0][0]) & self.device.limits().timestamp_mask;
            let ms = ticks as f64 * period_ns * 1e-6;
            match times.iter_mut().find(|time| time.label == *label) {
                Some(time) => time.ms += ms,
                None => times.push(PassTime { label: label.clone(), ms }),
            }
        }
        times
    }

    /// The passes are about to be submitted.
    pub(crate) fn watch(&self, value: u64) {
        let events = self.events.iter().copied().take(self.labels.len()).collect();
        self.device.watched.begin(Passes {
            value,
            pool: self.pool,
            labels: Arc::clone(&self.labels),
            events,
        });
    }

    /// They were not submitted after all.
    pub(crate) fn forget(&self) {
        self.device.watched.end(self.pool);
    }

    /// The event that the end of a pass sets.
    fn event(&mut self, index: usize) -> Option<vk::Event> {
        if index == self.events.len() {
            let info = vk::EventCreateInfo::default();
            // SAFETY: plain creation; destroyed through the retire queue.
            let made = unsafe { self.device.raw.create_event(&info, None) };
            self.events.extend(made.inspect_err(|error| tracing::debug!("no event: {error}")));
        }
        self.events.get(index).copied()
    }
}

impl Drop for Timers {
    fn drop(&mut self) {
        self.device.watched.end(self.pool);
        self.device.retire(Garbage::Events(std::mem::take(&mut self.events)));
        self.device.retire(Garbage::QueryPool(self.pool));
    }
}
