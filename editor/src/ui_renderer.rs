//! The one file that takes raw handles: egui's triangles into the window's image by egui-ash-renderer.
//! Enters: egui's output, the view's image. Leaves: draw commands. It knows no panel and no scene.

use std::sync::Arc;

use anyhow::Context as _;
use caustica_renderer::gpu::{
    Device, Frames, Image, Recorder, ResourceId, Swapchain, TextureSet, UploadQueue, ash::vk,
};
use egui::TextureId;
use egui::epaint::textures::TexturesDelta;
use egui::epaint::{ClippedPrimitive, Primitive};
use egui_ash_renderer::allocator::GpuAllocator;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer};

/// The id under which panels paint the view; the renderer puts the present image in its place.
pub const VIEW_TEXTURE: TextureId = TextureId::User(u64::MAX);

/// Draws the user interface.
pub struct UiRenderer {
    /// `None` only while the program ends: it has to go before the device's allocator.
    renderer: Option<Renderer<GpuAllocator>>,
    upload: UploadQueue,
    view: Option<ViewTexture>,
    /// Textures that egui let go of, with the number of frames that may still use them.
    freed: Vec<(TextureId, usize)>,
    device: Arc<Device>,
}

struct ViewTexture {
    image: ResourceId,
    id: TextureId,
    /// Owns the descriptor set behind `id`.
    _set: TextureSet,
}

impl UiRenderer {
    /// Makes pipelines for the window's format.
    ///
    /// # Errors
    /// When the driver refuses.
    pub fn new(device: &Arc<Device>, swapchain: &Swapchain) -> anyhow::Result<Self> {
        let mode = RenderMode::DynamicRendering(DynamicRendering {
            color_attachment_format: swapchain.raw_format(),
            depth_attachment_format: None,
            stencil_attachment_format: None,
        });
        let options = Options { in_flight_frames: Frames::in_flight(), ..Options::default() };
        let renderer = Renderer::with_gpu_allocator(device.allocator(), device.raw().clone(), mode, options)
            .context("making the user-interface renderer")?;
        let upload = UploadQueue::new(device)?;
        Ok(Self {
            renderer: Some(renderer),
            upload,
            view: None,
            freed: Vec::new(),
            device: Arc::clone(device),
        })
    }

    /// Takes in new and changed textures, the font atlas among them. Waits for the queue when there are any.
    ///
    /// # Errors
    /// When the driver refuses.
    pub fn set_textures(&mut self, mut delta: TexturesDelta) -> anyhow::Result<()> {
        let (set, free) = (std::mem::take(&mut delta.set), std::mem::take(&mut delta.free));
        let Some(renderer) = &mut self.renderer else { return Ok(()) };
        let mut later = Vec::new();
        for (id, frames) in self.freed.drain(..) {
            if frames == 0 {
                renderer.free_texture(id).context("freeing a texture of the user interface")?;
            } else {
                later.push((id, frames - 1));
            }
        }
        self.freed = later;
        for (id, changes) in &set {
            for change in changes {
                self.upload
                    .with(|queue, pool| renderer.set_texture(queue, pool, *id, change))?
                    .context("uploading a texture of the user interface")?;
            }
        }
        self.freed.extend(free.into_iter().map(|id| (id, Frames::in_flight())));
        Ok(())
    }

    /// Makes `image` the one behind [`VIEW_TEXTURE`].
    ///
    /// # Errors
    /// When the driver refuses.
    pub fn set_view(&mut self, image: &Image) -> anyhow::Result<()> {
        if self.view.as_ref().is_some_and(|view| view.image == image.id()) {
            return Ok(());
        }
        let Some(renderer) = &mut self.renderer else { return Ok(()) };
        let set = TextureSet::new(&self.device, image)?;
        if let Some(old) = self.view.take() {
            // The old set is retired when it is dropped: frames in flight may still use it.
            renderer.remove_user_texture(old.id);
        }
        let id = renderer.add_user_texture(set.raw());
        self.view = Some(ViewTexture { image: image.id(), id, _set: set });
        Ok(())
    }

    /// Records the triangles into the open rendering scope.
    ///
    /// # Errors
    /// When the driver refuses a buffer.
    pub fn draw(
        &mut self,
        recorder: &Recorder,
        extent_px: [u32; 2],
        pixels_per_point: f32,
        mut primitives: Vec<ClippedPrimitive>,
    ) -> anyhow::Result<()> {
        let Some(renderer) = &mut self.renderer else { return Ok(()) };
        let view = self.view.as_ref().map(|view| view.id);
        primitives.retain_mut(|primitive| match &mut primitive.primitive {
            Primitive::Mesh(mesh) if mesh.texture_id == VIEW_TEXTURE => {
                mesh.texture_id = view.unwrap_or_default();
                view.is_some()
            }
            Primitive::Mesh(_) => true,
            Primitive::Callback(_) => false,
        });
        let extent = vk::Extent2D { width: extent_px[0], height: extent_px[1] };
        renderer
            .cmd_draw(recorder.raw_command(), extent, pixels_per_point, &primitives)
            .context("drawing the user interface")
    }
}

impl Drop for UiRenderer {
    fn drop(&mut self) {
        if self.device.is_given_up() {
            std::mem::forget(self.renderer.take());
            return;
        }
        if let Err(error) = self.device.wait_idle() {
            tracing::error!("waiting for the device before closing the window failed: {error}");
        }
        drop(self.renderer.take());
    }
}
