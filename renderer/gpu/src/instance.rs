//! The Vulkan instance: loader, layers, and the messages of the validation layer, which are collected so that a test
//! can fail on any of them.

use std::borrow::Cow;
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};

use ash::{ext, khr, vk};
use raw_window_handle::RawDisplayHandle;

use crate::Result;
use crate::error::{Context, GpuError};

/// How to make an [`Instance`].
#[derive(Clone, Copy, Debug, Default)]
pub struct InstanceOptions {
    /// Load the validation layer with synchronisation validation, if it is installed.
    pub validation: bool,
    /// The display whose windows will be drawn to; `None`: headless.
    pub display: Option<RawDisplayHandle>,
}

/// One message of the validation layer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// The message's id, such as `VUID-...`.
    pub id: String,
    /// Its text.
    pub text: String,
}

/// A Vulkan instance.
pub struct Instance {
    pub(crate) entry: ash::Entry,
    pub(crate) raw: ash::Instance,
    pub(crate) surface_fns: Option<khr::surface::Instance>,
    pub(crate) debug_utils: bool,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    messages: Arc<Messages>,
    validation: bool,
}

/// Where the debug callback puts what it is told.
#[derive(Default)]
struct Messages(Mutex<Vec<Message>>);

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Messages that are the layer's own ignorance, each with its reason.
const LAYER_IGNORANCE: &[(&str, &str)] = &[
    // The layer of Debian 12 (1.3.239) does not know the feature and property structures of Vulkan 1.4 and later
    // extensions that a driver reports; it says so about our query, which is legal.
    ("VUID-VkPhysicalDeviceProperties2-pNext-pNext", "layer older than the driver"),
    ("VUID-VkPhysicalDeviceFeatures2-pNext-pNext", "layer older than the driver"),
];

impl Instance {
    /// Loads Vulkan and makes an instance of API version 1.3.
    ///
    /// # Errors
    /// [`GpuError::NoLoader`] without a loader; [`GpuError::Vulkan`] when the instance is refused.
    pub fn new(options: InstanceOptions) -> Result<Arc<Self>> {
        // SAFETY: the library stays loaded for the life of the entry, which the instance owns.
        let entry = unsafe { ash::Entry::load() }
            .map_err(|error| GpuError::NoLoader { reason: error.to_string() })?;
        let available = extension_names(&entry)?;
        let mut extensions: Vec<&CStr> = Vec::new();
        if let Some(display) = options.display {
            let wanted =
                ash_window::enumerate_required_extensions(display).during("enumerate surface extensions")?;
            for &name in wanted {
                // SAFETY: ash-window returns static, NUL-terminated names.
                extensions.push(unsafe { CStr::from_ptr(name) });
            }
        }
        let debug_utils = available.iter().any(|name| name == ext::debug_utils::NAME);
        if debug_utils {
            extensions.push(ext::debug_utils::NAME);
        }
        let validation = options.validation && has_layer(&entry, VALIDATION_LAYER)?;
        if options.validation && !validation {
            tracing::warn!("the validation layer is not installed (vulkan-validationlayers)");
        }
        let raw = create(&entry, &extensions, validation)?;
        let messages = Arc::new(Messages::default());
        let messenger = if debug_utils { Some(create_messenger(&entry, &raw, &messages)?) } else { None };
        let surface_fns = options.display.map(|_| khr::surface::Instance::new(&entry, &raw));
        Ok(Arc::new(Self { entry, raw, surface_fns, debug_utils, messenger, messages, validation }))
    }

    /// Whether the validation layer is loaded.
    pub fn validation_is_on(&self) -> bool {
        self.validation
    }

    /// The raw instance, for the one user-interface renderer that takes raw handles.
    pub fn raw(&self) -> &ash::Instance {
        &self.raw
    }

    /// Takes the validation messages collected so far.
    pub fn take_messages(&self) -> Vec<Message> {
        self.messages.0.lock().map(|mut messages| std::mem::take(&mut *messages)).unwrap_or_default()
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let Some((fns, messenger)) = self.messenger.take() {
            // SAFETY: made by this instance and destroyed once, before it.
            unsafe { fns.destroy_debug_utils_messenger(messenger, None) };
        }
        // SAFETY: devices hold an Arc of this instance, so none is left.
        unsafe { self.raw.destroy_instance(None) };
    }
}

fn extension_names(entry: &ash::Entry) -> Result<Vec<std::ffi::CString>> {
    // SAFETY: a plain query.
    let properties = unsafe { entry.enumerate_instance_extension_properties(None) }
        .during("vkEnumerateInstanceExtensionProperties")?;
    Ok(properties.iter().filter_map(|p| p.extension_name_as_c_str().ok().map(CStr::to_owned)).collect())
}

fn has_layer(entry: &ash::Entry, layer: &CStr) -> Result<bool> {
    // SAFETY: a plain query.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }
        .during("vkEnumerateInstanceLayerProperties")?;
    Ok(layers.iter().any(|l| l.layer_name_as_c_str() == Ok(layer)))
}

fn create(entry: &ash::Entry, extensions: &[&CStr], validation: bool) -> Result<ash::Instance> {
    let application = vk::ApplicationInfo::default()
        .application_name(c"caustica")
        .application_version(vk::make_api_version(0, 0, 1, 0))
        .engine_name(c"caustica")
        .api_version(vk::API_VERSION_1_3);
    let mut names: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
    let layers: Vec<_> = if validation { vec![VALIDATION_LAYER.as_ptr()] } else { Vec::new() };
    let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
    let mut info = vk::InstanceCreateInfo::default().application_info(&application);
    if validation {
        names.push(ext::validation_features::NAME.as_ptr());
        info = info.push_next(&mut features);
    }
    info = info.enabled_extension_names(&names).enabled_layer_names(&layers);
    // SAFETY: every pointer in `info` lives until the call returns.
    unsafe { entry.create_instance(&info, None) }.during("vkCreateInstance")
}

fn create_messenger(
    entry: &ash::Entry,
    raw: &ash::Instance,
    messages: &Arc<Messages>,
) -> Result<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)> {
    let fns = ext::debug_utils::Instance::new(entry, raw);
    let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(
            vk::DebugUtilsMessageSeverityFlagsEXT::ERROR | vk::DebugUtilsMessageSeverityFlagsEXT::WARNING,
        )
        .message_type(
            vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
        )
        .pfn_user_callback(Some(on_message))
        .user_data(Arc::as_ptr(messages).cast_mut().cast());
    // SAFETY: `messages` is owned by the Instance, which destroys the messenger before it is dropped.
    let messenger =
        unsafe { fns.create_debug_utils_messenger(&info, None) }.during("vkCreateDebugUtilsMessengerEXT")?;
    Ok((fns, messenger))
}

/// Collects a message of the validation layer.
// SAFETY: called by the loader with valid pointers for the duration of the call; `user_data` is the `Messages` that
// the instance keeps alive for as long as the messenger.
unsafe extern "system" fn on_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user_data: *mut c_void,
) -> vk::Bool32 {
    if data.is_null() || user_data.is_null() {
        return vk::FALSE;
    }
    // SAFETY: not null, and valid during the call (see above).
    let (data, messages) = unsafe { (&*data, &*user_data.cast::<Messages>()) };
    // SAFETY: the loader passes NUL-terminated strings or null.
    let (id, text) = unsafe { (text_of(data.p_message_id_name), text_of(data.p_message)) };
    if LAYER_IGNORANCE.iter().any(|(known, _reason)| id == *known) {
        return vk::FALSE;
    }
    tracing::warn!("validation: {id}: {text}");
    if let Ok(mut messages) = messages.0.lock() {
        messages.push(Message { id: id.into_owned(), text: text.into_owned() });
    }
    vk::FALSE
}

/// Reads a C string; null is the empty one.
///
/// # Safety
/// `pointer` is null or points to a NUL-terminated string that outlives the result.
unsafe fn text_of<'a>(pointer: *const std::ffi::c_char) -> Cow<'a, str> {
    if pointer.is_null() {
        return Cow::Borrowed("");
    }
    // SAFETY: by the contract of this function.
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy()
}
