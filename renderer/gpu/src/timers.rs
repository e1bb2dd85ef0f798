//! Timestamps around passes. Enters: labels in order. Leaves: milliseconds a label once the frame has finished.

use std::sync::Arc;

use ash::vk;

use crate::Result;
use crate::context::Device;
use crate::error::Context;
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
    open: bool,
}

impl Timers {
    pub(crate) fn new(device: &Arc<Device>) -> Result<Self> {
        let info =
            vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(CAPACITY * 2);
        // SAFETY: plain creation; destroyed through the retire queue.
        let pool = unsafe { device.raw.create_query_pool(&info, None) }.during("vkCreateQueryPool")?;
        let timers = Self { device: Arc::clone(device), pool, labels: Arc::default(), open: false };
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
        self.labels = Arc::default();
        self.open = false;
        self.reset_pool();
    }

    pub(crate) fn begin(&mut self, command: vk::CommandBuffer, label: &str) {
        if (self.labels.len() as u32) < CAPACITY {
            self.write(command, self.labels.len() as u32 * 2);
            Arc::make_mut(&mut self.labels).push(label.to_owned());
            self.open = true;
        }
    }

    pub(crate) fn end(&mut self, command: vk::CommandBuffer) {
        if self.open {
            self.write(command, self.labels.len() as u32 * 2 - 1);
            self.open = false;
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

    /// These timestamps are about to be submitted.
    pub(crate) fn watch(&self, value: u64) {
        self.device.watched.begin(value, self.pool, Arc::clone(&self.labels));
    }

    /// They were not submitted after all.
    pub(crate) fn forget(&self) {
        self.device.watched.end(self.pool);
    }
}

/// Labels of the last pass whose end was reached and of the one after it.
pub(crate) fn last_finished(device: &Device, pool: vk::QueryPool, labels: &[String]) -> (String, String) {
    if labels.is_empty() {
        return (String::from("none"), String::from("none"));
    }
    let mut ticks = vec![[0_u64; 2]; labels.len() * 2];
    let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
    // SAFETY: the slice holds two 64-bit words a query, and whoever resets or destroys the pool waits until it is not watched
    // any more. NOT_READY fills the availability words all the same.
    let result = unsafe { device.raw.get_query_pool_results(pool, 0, &mut ticks, flags) };
    if matches!(result, Err(error) if error != vk::Result::NOT_READY) {
        return (String::from("unknown"), labels.join(", or "));
    }
    let done = ticks.chunks_exact(2).take_while(|pair| pair[1][1] != 0).count();
    let name = |i: usize| labels.get(i).cloned().unwrap_or_else(|| String::from("none"));
    (if done == 0 { String::from("none") } else { name(done - 1) }, name(done))
}

impl Drop for Timers {
    fn drop(&mut self) {
        self.device.watched.end(self.pool);
        self.device.retire(Garbage::QueryPool(self.pool));
    }
}
