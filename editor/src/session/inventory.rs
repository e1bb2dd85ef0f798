//! What the renderer holds, compared with what the document says, and the way back to the order of a fresh load. Leaves:
//! inventories by id, which know no slots and no addresses. It renders nothing.

use std::sync::Arc;

use caustica_renderer::{Inventory, Renderer, RendererOptions};
use caustica_scene::Document;

use super::Session;
use crate::sync::Sync;

impl Session {
    /// What is on the device since the last frame. Waits for the device. One frame without a change after the last edit
    /// lets everything come to rest: until then it is known where things were before.
    ///
    /// # Errors
    /// When tables contradict each other, or the device is lost.
    pub fn inventory(&mut self) -> anyhow::Result<Inventory> {
        Ok(self.renderer.inventory(&mut self.frames)?)
    }

    /// What would be on the device had the document as it is now been opened in a renderer of its own. Waits for the
    /// device; costs the whole scene.
    ///
    /// # Errors
    /// When memory runs out or the device is lost.
    pub fn fresh_inventory(&mut self) -> anyhow::Result<Inventory> {
        let mut document = Document::clone(&self.scene.document);
        document.mark_all_added("inventory");
        let delta = Sync::new().delta(&mut document, self.camera.world_from_camera.translation);
        let mut renderer = Renderer::new(&self.device, &mut self.frames, &RendererOptions::default())?;
        let mut recorder = self.frames.begin()?;
        let applied = renderer.apply(&mut recorder, &delta);
        self.frames.submit(recorder, None)?;
        applied?;
        Ok(renderer.inventory(&mut self.frames)?)
    }

    /// Empties the renderer; the next frame gives it the whole scene again, in order of id. Tables and structures then lie
    /// as after a fresh load, whatever was done before.
    ///
    /// # Errors
    /// When the driver refuses; the next frame tries again.
    pub fn rebuild_scene(&mut self) -> anyhow::Result<()> {
        Arc::make_mut(&mut self.scene.document).mark_all_added("rebuilt acceleration structures");
        self.selection_changed = true;
        self.scene.picture_revision += 1;
        self.empty_renderer().inspect_err(|_| self.resync = true)
    }

    /// Takes everything out of the renderer.
    pub(super) fn empty_renderer(&mut self) -> anyhow::Result<()> {
        let emptied = std::mem::take(&mut self.sync).clear();
        let mut recorder = self.frames.begin()?;
        let applied = self.renderer.apply(&mut recorder, &emptied);
        self.frames.submit(recorder, None)?;
        Ok(applied?)
    }
}
