//! Names for debuggers and validation messages.

use std::ffi::CString;

use ash::vk;

use crate::context::Device;

impl Device {
    /// Gives a Vulkan object a name; does nothing without VK_EXT_debug_utils.
    pub(crate) fn set_name<H: vk::Handle>(&self, handle: H, name: &str) {
        let (Some(debug), Ok(name)) = (&self.debug_utils, CString::new(name)) else {
            return;
        };
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        // SAFETY: the handle belongs to this device and is alive: the caller has just made it.
        if let Err(error) = unsafe { debug.set_debug_utils_object_name(&info) } {
            tracing::debug!("naming an object failed: {error}");
        }
    }
}
