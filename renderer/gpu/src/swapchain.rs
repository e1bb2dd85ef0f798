//! The window's images: resize, minimise, out of date. Enters: raw window handles. Leaves: an image to draw into.
//! The format is UNORM: the user interface and the view are encoded before they arrive here.

use std::sync::Arc;

use ash::vk;
use raw_window_handle::{RawDisplayHandle, RawWindowHandle};

use crate::Result;
use crate::context::Device;
use crate::error::{Context, GpuError};
use crate::frames::Frames;
use crate::recorder::Recorder;
use crate::retire::Garbage;

/// A window surface with its swapchain.
pub struct Swapchain {
    device: Arc<Device>,
    surface: vk::SurfaceKHR,
    raw: vk::SwapchainKHR,
    images: Vec<vk::Image>,
    views: Vec<vk::ImageView>,
    available: Vec<vk::Semaphore>,
    rendered: Vec<vk::Semaphore>,
    format: vk::SurfaceFormatKHR,
    extent: [u32; 2],
    next: usize,
}

/// An image of the window, to be drawn and presented.
pub struct Acquired {
    pub(crate) available: vk::Semaphore,
    pub(crate) rendered: vk::Semaphore,
    image: vk::Image,
    view: vk::ImageView,
    index: u32,
}

impl Swapchain {
    /// Makes a surface for the window and a swapchain of `extent` pixels.
    ///
    /// # Errors
    /// When the device cannot present to the window.
    pub fn new(
        device: &Arc<Device>,
        display: RawDisplayHandle,
        window: RawWindowHandle,
        extent: [u32; 2],
    ) -> Result<Self> {
        let instance = device.instance();
        // SAFETY: the caller keeps the window alive longer than the swapchain.
        let surface =
            unsafe { ash_window::create_surface(&instance.entry, &instance.raw, display, window, None) }
                .during("creating the window surface")?;
        let mut swapchain = Self {
            device: Arc::clone(device),
            surface,
            raw: vk::SwapchainKHR::null(),
            images: Vec::new(),
            views: Vec::new(),
            available: Vec::new(),
            rendered: Vec::new(),
            format: vk::SurfaceFormatKHR::default(),
            extent: [0, 0],
            next: 0,
        };
        swapchain.check_support()?;
        swapchain.format = swapchain.choose_format()?;
        for _ in 0..Frames::in_flight() {
            let semaphore = swapchain.create_semaphore()?;
            swapchain.available.push(semaphore);
        }
        swapchain.resize(extent)?;
        Ok(swapchain)
    }

    /// Size in pixels; zero while the window is minimised.
    pub fn extent(&self) -> [u32; 2] {
        self.extent
    }

    /// Format of the images, for the one user-interface renderer that takes raw handles.
    pub fn raw_format(&self) -> vk::Format {
        self.format.format
    }

    /// Makes the images anew; `extent` zero (minimised) gives the old ones back and draws nothing.
    ///
    /// # Errors
    /// Refusals of the driver.
    pub fn resize(&mut self, extent: [u32; 2]) -> Result<()> {
        let capabilities = self.capabilities()?;
        let fixed = capabilities.current_extent;
        let asked = if fixed.width == u32::MAX { extent } else { [fixed.width, fixed.height] };
        if asked.contains(&0) {
            self.extent = [0, 0];
            return Ok(());
        }
        let (low, high) = (capabilities.min_image_extent, capabilities.max_image_extent);
        self.extent = [asked[0].clamp(low.width, high.width), asked[1].clamp(low.height, high.height)];
        let most = if capabilities.max_image_count == 0 { u32::MAX } else { capabilities.max_image_count };
        let alpha = [vk::CompositeAlphaFlagsKHR::OPAQUE, vk::CompositeAlphaFlagsKHR::INHERIT]
            .into_iter()
            .find(|flag| capabilities.supported_composite_alpha.contains(*flag))
            .unwrap_or(vk::CompositeAlphaFlagsKHR::OPAQUE);
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(self.surface)
            .min_image_count((capabilities.min_image_count + 1).min(most))
            .image_format(self.format.format)
            .image_color_space(self.format.color_space)
            .image_extent(vk::Extent2D { width: self.extent[0], height: self.extent[1] })
            .image_array_layers(1)
            .image_usage(vk::ImageUsageFlags::COLOR_ATTACHMENT)
            .pre_transform(capabilities.current_transform)
            .composite_alpha(alpha)
            .present_mode(vk::PresentModeKHR::FIFO)
            .clipped(true)
            .old_swapchain(self.raw);
        let fns = self.fns()?;
        // SAFETY: the surface is alive; the old swapchain is retired below.
        let raw = unsafe { fns.create_swapchain(&info, None) }.during("vkCreateSwapchainKHR")?;
        // SAFETY: `raw` was just made.
        let images = unsafe { fns.get_swapchain_images(raw) }.during("vkGetSwapchainImagesKHR")?;
        self.retire_images();
        self.raw = raw;
        for &image in &images {
            let view = self.create_view(image)?;
            self.views.push(view);
            let semaphore = self.create_semaphore()?;
            self.rendered.push(semaphore);
        }
        self.images = images;
        Ok(())
    }

    /// Gets the next image to draw into; `None` while the window is minimised.
    ///
    /// # Errors
    /// [`GpuError::SurfaceOutOfDate`]: call [`Self::resize`] and try again.
    pub fn acquire(&mut self) -> Result<Option<Acquired>> {
        if self.extent.contains(&0) || self.raw == vk::SwapchainKHR::null() {
            return Ok(None);
        }
        let available = self.available[self.next];
        // SAFETY: the semaphore was waited for by the frame before last, which has finished.
        let answer =
            unsafe { self.fns()?.acquire_next_image(self.raw, 1_000_000_000, available, vk::Fence::null()) };
        let (index, _suboptimal) = match answer {
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => return Ok(None),
            other => other.during("vkAcquireNextImageKHR")?,
        };
        self.next = (self.next + 1) % self.available.len();
        let at = index as usize;
        Ok(Some(Acquired {
            available,
            rendered: self.rendered[at],
            image: self.images[at],
            view: self.views[at],
            index,
        }))
    }

    /// Opens a rendering scope on the window's image, cleared to `clear` (encoded values).
    pub fn begin_rendering(&self, recorder: &Recorder, acquired: &Acquired, clear: [f32; 4]) {
        let (old, new) = (vk::ImageLayout::UNDEFINED, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
        self.transition(recorder, acquired, old, new);
        let attachment = [vk::RenderingAttachmentInfo::default()
            .image_view(acquired.view)
            .image_layout(new)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(vk::ClearValue { color: vk::ClearColorValue { float32: clear } })];
        let area =
            vk::Rect2D::default().extent(vk::Extent2D { width: self.extent[0], height: self.extent[1] });
        let info =
            vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&attachment);
        // SAFETY: the image was acquired and is in the layout named.
        unsafe { self.device.raw.cmd_begin_rendering(recorder.raw_command(), &info) };
    }

    /// Closes the scope and makes the image ready to be presented.
    pub fn end_rendering(&self, recorder: &Recorder, acquired: &Acquired) {
        // SAFETY: closes the scope opened by `begin_rendering`.
        unsafe { self.device.raw.cmd_end_rendering(recorder.raw_command()) };
        self.transition(
            recorder,
            acquired,
            vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            vk::ImageLayout::PRESENT_SRC_KHR,
        );
    }

    /// Shows the image once the submission that drew it has finished.
    ///
    /// # Errors
    /// [`GpuError::SurfaceOutOfDate`]: call [`Self::resize`].
    pub fn present(&self, acquired: Acquired) -> Result<()> {
        let (semaphores, swapchains, indices) = ([acquired.rendered], [self.raw], [acquired.index]);
        let info = vk::PresentInfoKHR::default()
            .wait_semaphores(&semaphores)
            .swapchains(&swapchains)
            .image_indices(&indices);
        let queue = self.device.queue.lock().map_err(|_| GpuError::SurfaceOutOfDate)?;
        // SAFETY: the queue is locked; the image was acquired and submitted.
        match unsafe { self.fns()?.queue_present(*queue, &info) }.during("vkQueuePresentKHR")? {
            true => Err(GpuError::SurfaceOutOfDate),
            false => Ok(()),
        }
    }

    fn transition(
        &self,
        recorder: &Recorder,
        acquired: &Acquired,
        old: vk::ImageLayout,
        new: vk::ImageLayout,
    ) {
        let output = vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT;
        let barrier = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(output)
            .src_access_mask(vk::AccessFlags2::COLOR_ATTACHMENT_WRITE)
            .dst_stage_mask(output)
            .dst_access_mask(
                vk::AccessFlags2::COLOR_ATTACHMENT_WRITE | vk::AccessFlags2::COLOR_ATTACHMENT_READ,
            )
            .old_layout(old)
            .new_layout(new)
            .image(acquired.image)
            .subresource_range(
                vk::ImageSubresourceRange::default()
                    .aspect_mask(vk::ImageAspectFlags::COLOR)
                    .level_count(1)
                    .layer_count(1),
            )];
        let info = vk::DependencyInfo::default().image_memory_barriers(&barrier);
        // SAFETY: the command buffer is being recorded outside of a rendering scope.
        unsafe { self.device.raw.cmd_pipeline_barrier2(recorder.raw_command(), &info) };
    }

    fn fns(&self) -> Result<&ash::khr::swapchain::Device> {
        self.device.swapchain_fns.as_ref().ok_or(GpuError::Vulkan {
            call: "VK_KHR_swapchain",
            result: vk::Result::ERROR_EXTENSION_NOT_PRESENT,
        })
    }

    fn surface_fns(&self) -> Result<&ash::khr::surface::Instance> {
        self.device.instance().surface_fns.as_ref().ok_or(GpuError::Vulkan {
            call: "VK_KHR_surface",
            result: vk::Result::ERROR_EXTENSION_NOT_PRESENT,
        })
    }

    fn capabilities(&self) -> Result<vk::SurfaceCapabilitiesKHR> {
        let (physical, surface) = (self.device.physical(), self.surface);
        // SAFETY: the surface is alive.
        unsafe { self.surface_fns()?.get_physical_device_surface_capabilities(physical, surface) }
            .during("vkGetPhysicalDeviceSurfaceCapabilitiesKHR")
    }

    fn check_support(&self) -> Result<()> {
        let (physical, family) = (self.device.physical(), self.device.queue_family());
        // SAFETY: the surface is alive.
        let supported = unsafe {
            self.surface_fns()?.get_physical_device_surface_support(physical, family, self.surface)
        }
        .during("vkGetPhysicalDeviceSurfaceSupportKHR")?;
        if supported {
            return Ok(());
        }
        Err(GpuError::NoDevice { refusals: format!("{} cannot present to this window", self.device.name()) })
    }

    fn choose_format(&self) -> Result<vk::SurfaceFormatKHR> {
        let (physical, surface) = (self.device.physical(), self.surface);
        // SAFETY: the surface is alive.
        let formats = unsafe { self.surface_fns()?.get_physical_device_surface_formats(physical, surface) }
            .during("vkGetPhysicalDeviceSurfaceFormatsKHR")?;
        let wanted = [vk::Format::B8G8R8A8_UNORM, vk::Format::R8G8B8A8_UNORM];
        let found = wanted.into_iter().find_map(|format| formats.iter().find(|f| f.format == format));
        found.or(formats.first()).copied().ok_or(GpuError::SurfaceOutOfDate)
    }

    fn create_view(&self, image: vk::Image) -> Result<vk::ImageView> {
        let info = vk::ImageViewCreateInfo::default()
            .image(image)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(self.format.format)
            .subresource_range(
                vk::ImageSubresourceRange::default()
                    .aspect_mask(vk::ImageAspectFlags::COLOR)
                    .level_count(1)
                    .layer_count(1),
            );
        // SAFETY: the image belongs to the live swapchain.
        unsafe { self.device.raw.create_image_view(&info, None) }.during("vkCreateImageView")
    }

    fn create_semaphore(&self) -> Result<vk::Semaphore> {
        // SAFETY: plain creation; destroyed through the retire queue.
        unsafe { self.device.raw.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) }
            .during("vkCreateSemaphore")
    }

    fn retire_images(&mut self) {
        self.device.retire(Garbage::ImageViews(std::mem::take(&mut self.views)));
        for semaphore in self.rendered.drain(..) {
            self.device.retire(Garbage::Semaphore(semaphore));
        }
        if self.raw != vk::SwapchainKHR::null() {
            self.device.retire(Garbage::Swapchain(self.raw));
        }
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        if self.device.is_given_up() {
            return;
        }
        if let Err(error) = self.device.wait_idle() {
            tracing::error!("waiting before closing the window failed: {error}");
        }
        self.retire_images();
        for semaphore in self.available.drain(..) {
            self.device.retire(Garbage::Semaphore(semaphore));
        }
        if let Err(error) = self.device.wait_idle() {
            tracing::error!("waiting before closing the window failed: {error}");
        }
        if let Ok(fns) = self.surface_fns() {
            // SAFETY: the swapchain on it was destroyed by the wait above.
            unsafe { fns.destroy_surface(self.surface, None) };
        }
    }
}
