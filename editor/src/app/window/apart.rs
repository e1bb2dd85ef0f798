//! On a processor as the device: panels are drawn and shown by a device of their own, so that they answer while the renderer's queue
//! compiles shaders, which such drivers do at the first use, or renders. Enters: frames of the renderer's device. Leaves: its last
//! finished picture on the panels' device.

use std::sync::Arc;

use anyhow::Context as _;
use caustica_renderer::gpu::{
    Acquired, Buffer, BufferUse, Device, DeviceOptions, Frames, GpuError, Image, ImageDesc, ImageUse,
    Location, MemoryUse, Recorder, Requirements,
};

use crate::session::Session;

/// The device of the panels and what it shows of the other one.
pub(super) struct Apart {
    frames: Frames,
    /// Where the renderer's device copies its picture to, and what the picture is.
    copied: Option<(Buffer, ImageDesc)>,
    /// The last submission copies a picture, which was not fetched yet.
    pending: bool,
    /// Samples of the picture that is shown.
    samples: u64,
    /// The picture, on the panels' device.
    shown: Option<Image>,
    device: Arc<Device>,
}

impl Apart {
    /// Opens another device of the same kind.
    pub(super) fn new(renderer: &Arc<Device>) -> anyhow::Result<Self> {
        let requirements = Requirements { device: Some(renderer.name().to_owned()), present: true };
        let device =
            Device::new(renderer.instance(), &DeviceOptions { requirements, memory_limit_bytes: None })
                .context("opening a device for the panels")?;
        let frames = Frames::new(&device)?;
        Ok(Self { frames, copied: None, pending: false, samples: 0, shown: None, device })
    }

    /// The panels' device.
    pub(super) fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// The picture, once there is one.
    pub(super) fn picture(&self) -> Option<&Image> {
        self.shown.as_ref()
    }

    /// Whether the renderer's device has a picture, or will have, that is not shown.
    pub(super) fn is_pending(&self) -> bool {
        self.pending
    }

    /// Whether as many samples are shown.
    pub(super) fn shows(&self, samples: u64) -> bool {
        self.samples == samples
    }

    /// Submits a frame of the renderer, whose device must have finished the one before, with a copy of its picture.
    pub(super) fn submit_picture(
        &mut self,
        session: &mut Session,
        mut recorder: Recorder,
    ) -> anyhow::Result<()> {
        if let Err(error) = self.copy(session, &mut recorder) {
            // Memory may be free again for the next one; the picture before stays.
            tracing::warn!("the picture cannot be shown: {error}");
            self.copied = None;
        }
        self.pending = true;
        session.submit(recorder, None)
    }

    /// Copies the picture to where it can be fetched.
    fn copy(&mut self, session: &Session, recorder: &mut Recorder) -> Result<(), GpuError> {
        let Some(image) = session.window_image() else { return Ok(()) };
        let desc = *image.desc();
        if self.copied.as_ref().is_none_or(|(_, copied)| *copied != desc) {
            let (size, kind) = (bytes_of(&desc), MemoryUse::Staging);
            let (general, location) = (BufferUse::General, Location::ReadBack);
            let buffer = Buffer::new(session.device(), "window", size, general, location, kind)?;
            self.copied = Some((buffer, desc));
        }
        match &self.copied {
            Some((buffer, _)) => recorder.copy_to_buffer(image, [0, 0], desc.extent, buffer, 0),
            None => Ok(()),
        }
    }

    /// Starts a frame of the panels; with the newest picture, where the renderer's device has finished it.
    pub(super) fn begin(&mut self, session: &mut Session) -> anyhow::Result<Recorder> {
        let mut recorder = self.frames.begin()?;
        if !self.pending || !session.device().has_finished()? {
            return Ok(recorder);
        }
        // Waits for nothing, and takes the times over.
        session.finish()?;
        self.pending = false;
        self.samples = session.samples();
        let Some((buffer, copied)) = &self.copied else { return Ok(recorder) };
        let wanted = ImageDesc { usage: ImageUse::Texture, mip_levels: 1, ..*copied };
        let image = match self.shown.take().filter(|image| *image.desc() == wanted) {
            Some(image) => image,
            None => Image::new(&self.device, "window", wanted)?,
        };
        let texels = buffer.mapped().get(..bytes_of(&wanted) as usize).unwrap_or_default();
        recorder.upload_image(&image, texels)?;
        self.shown = Some(image);
        Ok(recorder)
    }

    /// Submits a frame of the panels.
    pub(super) fn submit(&mut self, recorder: Recorder, window: Option<&Acquired>) -> anyhow::Result<()> {
        self.frames.submit(recorder, window)?;
        Ok(())
    }
}

fn bytes_of(desc: &ImageDesc) -> u64 {
    let [width, height] = desc.extent.map(u64::from);
    width * height * desc.format.texel_bytes()
}
