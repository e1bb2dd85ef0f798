//! The size of the view where device memory is short. Enters: a frame that found no room. Leaves: a coarser view in a
//! window, which grows back when there is room; for pictures of a set size, words about what would fit.

use caustica_renderer::gpu::{GpuError, MemoryBudget, MemoryUse};
use caustica_renderer::{Accumulated, RendererError};

use super::Session;
use super::room::{mib, more_memory};

/// Coarsest view that is tried: one pixel for so many in each direction.
const COARSEST: u32 = 8;

/// How coarse the view has to be.
#[derive(Debug)]
pub(super) struct ViewSize {
    /// One pixel for so many in each direction; 1: the view has room.
    pub(super) divisor: u32,
    /// What was said of it last.
    told: u32,
    /// Bytes that were there when a finer view was tried in vain; 0: never.
    too_few_bytes: u64,
}

impl Default for ViewSize {
    fn default() -> Self {
        Self { divisor: 1, told: 1, too_few_bytes: 0 }
    }
}

pub(super) fn is_out_of_memory(error: &anyhow::Error) -> bool {
    error.downcast_ref::<RendererError>().is_some_and(RendererError::is_out_of_memory)
}

impl Session {
    /// One pixel is rendered for so many of the view in each direction, at least, as there is no memory for more; 1 as a rule.
    pub fn least_divisor(&self) -> u32 {
        self.view_size.divisor
    }

    /// One pixel was rendered for so many of the view in each direction in the last frame.
    pub fn divisor(&self) -> u32 {
        self.renderer.view(self.view).map_or(1, |view| view.divisor())
    }

    /// After a frame that found no room: textures give up half, then the view lets go of what the frames before have left,
    /// then it gets coarser where it is one in a window. False: nothing is left to be done.
    pub(super) fn make_room(&mut self, has_let_go: &mut bool) -> bool {
        if self.renderer.give_up_textures() {
            return true;
        }
        let Ok(view) = self.renderer.view_mut(self.view) else { return false };
        if !std::mem::replace(has_let_go, true) && view.let_go() {
            return true;
        }
        let coarser = self.view_size.divisor * 2;
        if !view.is_for_window() || coarser > COARSEST {
            return false;
        }
        view.set_divisor(coarser);
        view.let_go();
        self.view_size.divisor = coarser;
        true
    }

    /// Tries a finer view where there is room for it by now.
    pub(super) fn grow_back(&mut self) {
        let divisor = self.view_size.divisor;
        if divisor == 1 || self.divisor() != divisor {
            return;
        }
        let (targets, free) = (self.bytes_of(MemoryUse::Targets), self.bytes_to_be_had());
        // All four times as large, beside the coarse ones, which are freed once the frames that read them have finished.
        if free < targets.saturating_mul(4) || free / 9 <= self.view_size.too_few_bytes / 8 {
            return;
        }
        // Should that fail, the device is lost, and the frame says so.
        if self.frames.trim().is_ok()
            && let Ok(view) = self.renderer.view_mut(self.view)
        {
            view.set_divisor(divisor / 2);
            self.view_size.divisor = divisor / 2;
            self.view_size.too_few_bytes = free;
        }
    }

    /// A frame has found room: says so when the view has another size than was told.
    pub(super) fn note_size(&mut self) {
        let size = &mut self.view_size;
        if size.divisor < size.told {
            size.too_few_bytes = 0;
        }
        if size.divisor == size.told {
            return;
        }
        size.told = size.divisor;
        match size.divisor {
            1 => tracing::info!("there is device memory for the view at its full size again"),
            n => tracing::warn!("the view is shown at 1/{n} of its size, {}", self.shortage()),
        }
    }

    /// Why the view is coarse, and what would help.
    pub fn shortage(&self) -> String {
        let budget = self.device.memory_budget();
        let [used, there] = [budget.used_bytes, budget.budget_bytes].map(mib);
        let lacking = mib(self.bytes_of(MemoryUse::Targets)) * f64::from(self.view_size.divisor.pow(2) - 1);
        let lacking =
            (lacking >= 1.0).then(|| format!(", and the whole view takes about {lacking:.0} MiB more"));
        format!(
            "as device memory is short ({used:.0} of {there:.0} MiB are in use{}); a smaller window, fewer or simpler meshes, or {} \
             would help",
            lacking.unwrap_or_default(),
            more_memory(budget)
        )
    }

    /// Adds to a frame's error what would help, in a window.
    pub(super) fn advise(&self, error: anyhow::Error) -> anyhow::Error {
        let in_window = self.renderer.view(self.view).is_ok_and(|view| view.is_for_window());
        if !in_window || !is_out_of_memory(&error) {
            return error;
        }
        error.context(format!("it has no room even at 1/{COARSEST} of the view's size, {}", self.shortage()))
    }

    /// Adds to an error of a picture of a set size, when memory has run out, what size fits and what the wanted one takes. The
    /// session shows other sizes afterwards.
    pub fn advise_size(&mut self, extent_px: [u32; 2], error: anyhow::Error) -> anyhow::Error {
        if !is_out_of_memory(&error) {
            return error;
        }
        let budget = self.device.memory_budget();
        let [width, height] = extent_px;
        let is_limit = budget.is_limit;
        match self.what_fits(extent_px) {
            Some((smaller, needed)) => {
                let needed_mib = needed.div_ceil(1 << 20);
                let more = if is_limit { format!("--memory-budget {needed_mib}") } else { more_memory(budget).to_owned() };
                error.context(format!(
                    "{width}x{height} takes about {needed_mib} MiB of device memory, and there are {:.0}; --size {}x{} has room, \
                     as would {more}",
                    mib(budget.budget_bytes),
                    smaller[0],
                    smaller[1],
                ))
            }
            None => error.context(format!(
                "the scene has no room in {:.0} MiB of device memory, not even at one pixel of {width}x{height}; fewer or simpler \
                 meshes would help, or {}",
                mib(budget.budget_bytes),
                more_memory(budget)
            )),
        }
    }

    /// The largest part of a size that can be rendered and read, by rendering it, and about how many bytes the whole takes.
    fn what_fits(&mut self, extent_px: [u32; 2]) -> Option<([u32; 2], u64)> {
        let mut divisor = 2;
        // Down to a pixel.
        while divisor / 2 < extent_px[0].max(extent_px[1]) {
            if let Ok(accumulated) = self.try_at(extent_px, divisor) {
                let times = u64::from(divisor).pow(2);
                let targets = self.bytes_of(MemoryUse::Targets);
                let others = self.device.memory_budget().used_bytes.saturating_sub(targets);
                let read_back = self.renderer.read_back_bytes(self.view).unwrap_or(0);
                let needed = others + (targets + read_back) * times;
                return Some((accumulated.extent, needed + needed / 8));
            }
            divisor *= 2;
        }
        None
    }

    fn try_at(&mut self, extent_px: [u32; 2], divisor: u32) -> anyhow::Result<Accumulated> {
        let view = self.renderer.view_mut(self.view)?;
        view.set_divisor(divisor);
        view.let_go();
        self.resync = true;
        self.render_frame(extent_px)?;
        self.read_back()
    }

    /// Makes sure that a memory budget has room to read the samples back once they are taken.
    ///
    /// # Errors
    /// When there is none, or no frame yet.
    pub fn check_read_back(&mut self) -> anyhow::Result<()> {
        let needed = self.renderer.read_back_bytes(self.view)?;
        let lacks =
            |budget: MemoryBudget| budget.is_limit && budget.budget_bytes < budget.used_bytes + needed;
        if lacks(self.device.memory_budget()) {
            self.frames.trim()?;
        }
        let budget = self.device.memory_budget();
        if !lacks(budget) {
            return Ok(());
        }
        Err(RendererError::Gpu(GpuError::OutOfMemory {
            what: String::from("reading the picture back"),
            requested_mib: mib(needed),
            used_mib: mib(budget.used_bytes),
            budget_mib: mib(budget.budget_bytes),
        })
        .into())
    }

    fn bytes_of(&self, kind: MemoryUse) -> u64 {
        let by_use = self.device.memory_by_use();
        by_use.iter().find(|(known, _)| *known == kind).map_or(0, |(_, bytes)| *bytes)
    }

    /// Bytes that are free, or that textures give up and staging memory that is kept for the next upload gives back.
    fn bytes_to_be_had(&self) -> u64 {
        let MemoryBudget { budget_bytes, used_bytes, .. } = self.device.memory_budget();
        let gives_way = self.bytes_of(MemoryUse::Textures) + self.bytes_of(MemoryUse::Staging);
        budget_bytes.saturating_sub(used_bytes.saturating_sub(gives_way))
    }
}
