//! Pass `post`: exposure and tone map, or an intermediate target made visible; then the window's encoding with the
//! outline of the selection. Enters: the accumulated mean. Leaves: `display` (linear) and `window` (encoded).

use caustica_gpu::{Access, Bind, Buffer, ComputePipeline, Image, Recorder, Stage, Use};

use super::{Builder, Scope};
use crate::error::Result;
use crate::gpu_types as constants;
use crate::settings::Show;
use crate::view::Targets;

/// The pass.
pub(crate) struct Post {
    image: ComputePipeline,
    /// Made when a target is shown for the first time.
    show: Option<ComputePipeline>,
    /// Made for the first view with a window.
    window: Option<ComputePipeline>,
}

impl Post {
    pub(crate) fn new(builder: &mut Builder<'_>) -> Result<Self> {
        Ok(Self { image: builder.compute("post", "passes/post/post.comp")?, show: None, window: None })
    }

    /// Makes what a view asks for and was not asked for before.
    pub(crate) fn prepare(&mut self, builder: &mut Builder<'_>, show: Show, window: bool) -> Result<()> {
        if show != Show::Image && self.show.is_none() {
            self.show = Some(builder.compute("post.show", "passes/post/show.comp")?);
        }
        if window && self.window.is_none() {
            self.window = Some(builder.compute("post.window", "passes/post/window.comp")?);
        }
        Ok(())
    }

    /// Fills `display`, and `window` where the view has one. `parity` and `filled`: which normal and depth images, and
    /// which history images, are this frame's.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        scope: &Scope<'_>,
        targets: &Targets,
        (parity, filled): (usize, usize),
        accumulator: &Buffer,
        show: Show,
    ) -> Result<()> {
        let unused = scope.tables.textures.white();
        match self.show.as_ref().zip(shown(show, targets, parity, filled)) {
            None => {
                let uses = [Use::Buffer(accumulator, Stage::Compute, Access::StorageRead)];
                let binds =
                    [("shaded", Bind::Image(&targets.shaded)), ("display", Bind::Image(&targets.display))];
                scope.compute(recorder, "post", &self.image, &binds, &uses, 0)?;
            }
            Some((pipeline, (kind, source))) => {
                let (float, integer) = match source {
                    Source::Float(image) => (image.unwrap_or(unused), &targets.id),
                    Source::Integer(image) => (unused, image),
                };
                let binds = [
                    ("source", Bind::Image(float)),
                    ("source_uint", Bind::Image(integer)),
                    ("display", Bind::Image(&targets.display)),
                ];
                scope.compute(recorder, "post.show", pipeline, &binds, &[], kind)?;
            }
        }
        if let (Some(window), Some(pipeline)) = (&targets.window, &self.window) {
            let binds = [
                ("display", Bind::Image(&targets.display)),
                ("gbuffer_id", Bind::Image(&targets.id)),
                ("window", Bind::Image(window)),
            ];
            scope.compute(recorder, "post.window", pipeline, &binds, &[], 0)?;
        }
        Ok(())
    }
}

/// An image that can be shown; a float one may not exist, and is white then.
enum Source<'a> {
    Float(Option<&'a Image>),
    Integer(&'a Image),
}

/// What `show.comp` is told, and the image it reads.
fn shown<'a>(show: Show, targets: &'a Targets, parity: usize, filled: usize) -> Option<(u32, Source<'a>)> {
    let normal = &targets.normal[parity % targets.normal.len()];
    let depth = &targets.depth[parity % targets.depth.len()];
    let history = targets.history.as_ref();
    Some(match show {
        Show::Image => return None,
        Show::BaseColor => (constants::SHOW_BASE_COLOR, Source::Float(Some(&targets.base_color))),
        Show::Normal => (constants::SHOW_NORMAL, Source::Integer(normal)),
        Show::GeometricNormal => (constants::SHOW_GEOMETRIC_NORMAL, Source::Integer(normal)),
        Show::Depth => (constants::SHOW_DEPTH, Source::Float(Some(depth))),
        Show::Metallic => (constants::SHOW_METALLIC, Source::Float(Some(&targets.material))),
        Show::Roughness => (constants::SHOW_ROUGHNESS, Source::Float(Some(&targets.material))),
        Show::Motion => (constants::SHOW_MOTION, Source::Float(Some(&targets.motion))),
        Show::Emissive => (constants::SHOW_EMISSIVE, Source::Float(targets.emissive.as_ref())),
        Show::Instance => (constants::SHOW_INSTANCE, Source::Integer(&targets.id)),
        Show::Material => (constants::SHOW_MATERIAL, Source::Integer(&targets.id)),
        Show::Triangle => (constants::SHOW_TRIANGLE, Source::Integer(&targets.id)),
        Show::DirectDiffuse => (constants::SHOW_LIGHT, Source::Float(targets.direct_diffuse.as_ref())),
        Show::DirectSpecular => (constants::SHOW_LIGHT, Source::Float(targets.direct_specular.as_ref())),
        Show::History => {
            (constants::SHOW_HISTORY, Source::Float(history.map(|history| &history.diffuse[filled])))
        }
    })
}
