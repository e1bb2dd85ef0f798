//! A renderer with one view. Enters: a delta, a camera, settings. Leaves: mean radiance, the display image, figures.

use std::path::Path;
use std::sync::Arc;

use caustica_renderer::delta::{Camera, SceneDelta};
use caustica_renderer::{
    AccelPolicy, Accumulated, Renderer, RendererOptions, Statistics, View, ViewId, ViewSettings, WakeFn,
};

use crate::gpu::{Session, session, session_within};
use crate::shaders_under_test;

/// A renderer, one view, and the device's attention for one test.
pub struct Studio {
    /// The renderer.
    pub renderer: Renderer,
    /// Its view.
    pub view: ViewId,
    /// The session. Dropped last: it looks whether the layer has said anything.
    pub session: Session,
}

impl Studio {
    /// A renderer with an empty scene and a view of `extent`.
    ///
    /// # Panics
    /// When the device cannot.
    pub fn new(extent: [u32; 2], settings: ViewSettings) -> Self {
        Self::with_window(extent, settings, false)
    }

    /// The same; `window`: the view also fills a window image.
    ///
    /// # Panics
    /// When the device cannot.
    pub fn with_window(extent: [u32; 2], settings: ViewSettings, window: bool) -> Self {
        Self::make(session(), extent, settings, window, AccelPolicy::default())
    }

    /// A studio with this scene, whose acceleration structures follow a policy.
    ///
    /// # Panics
    /// When the device cannot.
    pub fn with_policy(
        extent: [u32; 2],
        settings: ViewSettings,
        policy: AccelPolicy,
        scene: &SceneDelta,
        camera: Camera,
    ) -> Self {
        let mut studio = Self::make(session(), extent, settings, false, policy);
        studio.view_mut().set_camera(camera);
        studio.apply(scene);
        studio
    }

    /// A studio on a device that gives out no more memory than this.
    ///
    /// # Panics
    /// When the device cannot.
    pub fn within(memory_limit_bytes: u64, extent: [u32; 2], settings: ViewSettings) -> Self {
        Self::make(session_within(memory_limit_bytes), extent, settings, false, AccelPolicy::default())
    }

    /// A studio whose shaders are those of a folder and are edited while it runs.
    ///
    /// # Panics
    /// When the device cannot.
    pub fn editing(folder: &Path, extent: [u32; 2], settings: ViewSettings) -> Self {
        let (shaders, watch_shaders) = (Some(folder.to_owned()), Some(WakeFn(Arc::new(|| ()))));
        let options = RendererOptions { shaders, watch_shaders, ..RendererOptions::default() };
        Self::with_options(session(), extent, settings, true, &options)
    }

    fn make(
        session: Session,
        extent: [u32; 2],
        settings: ViewSettings,
        window: bool,
        acceleration: AccelPolicy,
    ) -> Self {
        let options =
            RendererOptions { shaders: shaders_under_test(), acceleration, ..RendererOptions::default() };
        Self::with_options(session, extent, settings, window, &options)
    }

    fn with_options(
        mut session: Session,
        extent: [u32; 2],
        settings: ViewSettings,
        window: bool,
        options: &RendererOptions,
    ) -> Self {
        let mut renderer = Renderer::new(&session.device, &mut session.frames, options).expect("a renderer");
        let view = renderer.create_view(extent, settings, window).expect("a view");
        Self { renderer, view, session }
    }

    /// A studio with this scene, seen by this camera.
    ///
    /// # Panics
    /// When the device cannot.
    pub fn of(extent: [u32; 2], settings: ViewSettings, scene: &SceneDelta, camera: Camera) -> Self {
        let mut studio = Self::new(extent, settings);
        studio.view_mut().set_camera(camera);
        studio.apply(scene);
        studio
    }

    /// The view.
    ///
    /// # Panics
    /// When it was removed.
    pub fn view(&self) -> &View {
        self.renderer.view(self.view).expect("the view")
    }

    /// The view, to be changed.
    ///
    /// # Panics
    /// When it was removed.
    pub fn view_mut(&mut self) -> &mut View {
        self.renderer.view_mut(self.view).expect("the view")
    }

    /// Changes the settings of the view.
    pub fn set(&mut self, change: impl FnOnce(&mut ViewSettings)) {
        let mut settings = self.view().settings().clone();
        change(&mut settings);
        self.view_mut().set_settings(settings);
    }

    /// Applies a delta without rendering.
    ///
    /// # Panics
    /// When the renderer refuses.
    pub fn apply(&mut self, delta: &SceneDelta) {
        let mut recorder = self.session.frames.begin().expect("a frame");
        self.renderer.apply(&mut recorder, delta).expect("the delta applies");
        self.session.frames.submit(recorder, None).expect("a submission");
    }

    /// One frame as the editor makes it: apply, render, submit.
    ///
    /// # Panics
    /// When the renderer refuses.
    pub fn frame(&mut self, delta: &SceneDelta) {
        let mut recorder = self.session.frames.begin().expect("a frame");
        self.renderer.apply(&mut recorder, delta).expect("the delta applies");
        self.renderer.render(&mut recorder, self.view).expect("the frame renders");
        self.session.frames.submit(recorder, None).expect("a submission");
    }

    /// Renders frames without any change.
    pub fn frames(&mut self, count: u32) {
        for _ in 0..count {
            self.frame(&SceneDelta::default());
        }
    }

    /// Renders at least one frame, and more until `samples` samples are accumulated; reads their mean.
    ///
    /// # Panics
    /// When the device fails.
    pub fn mean(&mut self, samples: u64) -> Accumulated {
        self.frames(1);
        while self.view().samples() < samples {
            self.frames(1);
        }
        self.read()
    }

    /// Shows another scene whose ids are those of the one before, or some of them: pipelines stay, which is faster
    /// than a new studio.
    ///
    /// # Panics
    /// When the device fails.
    pub fn restage(&mut self, scene: &SceneDelta, camera: Camera) {
        self.view_mut().set_camera(camera);
        self.apply(scene);
    }

    /// Reads the mean of what was rendered.
    ///
    /// # Panics
    /// When the device fails.
    pub fn read(&mut self) -> Accumulated {
        self.renderer.read_back(&mut self.session.frames, self.view).expect("a read-back")
    }

    /// Reads the radiance of the last frame, denoised where that frame was.
    ///
    /// # Panics
    /// When the device fails.
    pub fn read_frame(&mut self) -> Vec<[f32; 3]> {
        self.renderer.read_frame(&mut self.session.frames, self.view).expect("a read-back")
    }

    /// Reads the tone-mapped, linear image.
    ///
    /// # Panics
    /// When the device fails.
    pub fn display(&mut self) -> Vec<[f32; 4]> {
        self.renderer.read_display(&mut self.session.frames, self.view).expect("a read-back")
    }

    /// Figures of the last frame.
    ///
    /// # Panics
    /// When the view was removed.
    pub fn statistics(&self) -> Statistics {
        self.renderer.statistics(self.view).expect("the view").clone()
    }
}
