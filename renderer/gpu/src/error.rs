//! What can go wrong on the device, in words. Enters: Vulkan results. Leaves: `GpuError`.

use ash::vk;

/// An error of the Vulkan layer.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// No Vulkan loader on this machine.
    #[error("no Vulkan loader: {reason}. Install libvulkan1 (Debian, Ubuntu) or vulkan-loader")]
    NoLoader {
        /// What the dynamic linker said.
        reason: String,
    },
    /// No device fits; each refusal is named.
    #[error("no suitable Vulkan device: {refusals}")]
    NoDevice {
        /// One sentence a device.
        refusals: String,
    },
    /// A memory heap is full.
    #[error(
        "out of device memory: {what} needs {requested_mib:.1} MiB; {used_mib:.0} of {budget_mib:.0} MiB are in use"
    )]
    OutOfMemory {
        /// What was being made.
        what: String,
        /// Size asked for.
        requested_mib: f64,
        /// In use before.
        used_mib: f64,
        /// What the driver allows.
        budget_mib: f64,
    },
    /// What is to be shown takes more memory than there is, whatever else is on the device.
    #[error(
        "out of device memory: {what} take at least {needed_mib:.1} MiB, and there are {budget_mib:.0}; {remedy}"
    )]
    NoRoom {
        /// What it is, in the plural.
        what: String,
        /// What it takes.
        needed_mib: f64,
        /// What the driver or the user allows.
        budget_mib: f64,
        /// What would help.
        remedy: String,
    },
    /// The device no longer answers.
    #[error("the device was lost; the last pass that finished was '{last_pass}', then came '{next_pass}'")]
    DeviceLost {
        /// Label of the last pass known to have finished.
        last_pass: String,
        /// Label of the pass after it, the likely culprit.
        next_pass: String,
    },
    /// The device did not finish in time.
    #[error(
        "the device did not finish within {seconds} s; the last pass that finished was '{last_pass}', then came '{next_pass}'"
    )]
    Timeout {
        /// How long was waited.
        seconds: u64,
        /// Label of the last pass known to have finished.
        last_pass: String,
        /// Label of the pass after it, the likely culprit.
        next_pass: String,
    },
    /// The surface must be made again at its present size.
    #[error("the window surface is out of date")]
    SurfaceOutOfDate,
    /// A shader's interface and what the host binds disagree.
    #[error("{pipeline}: {reason}")]
    Interface {
        /// Which pipeline.
        pipeline: String,
        /// Expected against found.
        reason: String,
    },
    /// Something is larger than the device allows.
    #[error("{what}: {asked} is more than this device allows ({limit})")]
    Limit {
        /// What.
        what: String,
        /// Asked for.
        asked: u64,
        /// Largest allowed.
        limit: u64,
    },
    /// Any other refusal of the driver.
    #[error("{call} failed: {result}")]
    Vulkan {
        /// Which call.
        call: &'static str,
        /// What the driver answered.
        result: vk::Result,
    },
}

impl GpuError {
    /// The pass that did not finish, when the device is lost or hung; else `None`.
    pub fn unfinished_pass(&self) -> Option<&str> {
        match self {
            Self::DeviceLost { next_pass, .. } | Self::Timeout { next_pass, .. } => Some(next_pass),
            _ => None,
        }
    }
}

/// Adds the name of the call to a Vulkan result.
pub(crate) trait Context<T> {
    /// Names the call.
    fn during(self, call: &'static str) -> Result<T, GpuError>;
}

impl<T> Context<T> for std::result::Result<T, vk::Result> {
    fn during(self, call: &'static str) -> Result<T, GpuError> {
        self.map_err(|result| match result {
            vk::Result::ERROR_DEVICE_LOST => GpuError::DeviceLost {
                last_pass: String::from("unknown"),
                next_pass: String::from("unknown"),
            },
            vk::Result::ERROR_OUT_OF_DATE_KHR => GpuError::SurfaceOutOfDate,
            result => GpuError::Vulkan { call, result },
        })
    }
}
