//! Pass `post`: exposure and tone map, or what a debug view shows instead; then the window's encoding with the
//! outline of the selection. Enters: the accumulated mean. Leaves: `display` (linear) and `window` (encoded).

use caustica_gpu::{Access, Bind, Buffer, ComputePipeline, Image, Recorder, Stage, Use};

use super::{Builder, Scope};
use crate::error::Result;
use crate::gpu_types as constants;
use crate::settings::Show;
use crate::shader::Live;
use crate::view::Targets;

/// The pass.
pub(crate) struct Post {
    image: Live<ComputePipeline>,
    /// Made when a target is shown for the first time.
    target: Option<Live<ComputePipeline>>,
    /// Made when edges or barycentric coordinates are shown for the first time.
    surface: Option<Live<ComputePipeline>>,
    /// Made when dropped samples are shown for the first time.
    non_finite: Option<Live<ComputePipeline>>,
    /// Made when noise or error is shown for the first time.
    error_map: Option<Live<ComputePipeline>>,
    /// Made for the first view with a window.
    window: Option<Live<ComputePipeline>>,
}

/// What a frame shows.
pub(crate) struct Shown<'a> {
    pub(crate) show: Show,
    /// The shadow of a light was traced.
    pub(crate) light_shadow: bool,
    /// Which normal and depth images are this frame's.
    pub(crate) parity: usize,
    /// Which history images are this frame's.
    pub(crate) history: usize,
    /// This frame's sample is in the accumulator.
    pub(crate) added: bool,
    /// What the picture is compared with.
    pub(crate) reference: Option<&'a Buffer>,
}

/// How a view is made visible.
enum Way<'a> {
    /// The finished image.
    Image,
    /// `show.comp` reads one image; a float one may not exist, and is black then.
    Float(u32, Option<&'a Image>),
    /// The same with integers.
    Integer(u32, &'a Image),
    /// `show_surface.comp` looks at the triangles again.
    Surface(u32),
    /// `non_finite.comp`.
    NonFinite,
    /// `error_map.comp`; against a reference, or not.
    ErrorMap(bool),
}

impl Post {
    pub(crate) fn new(builder: &Builder<'_>) -> Result<Self> {
        let image = builder.compute("post", "passes/post/post.comp")?;
        Ok(Self { image, target: None, surface: None, non_finite: None, error_map: None, window: None })
    }

    /// Makes what a view asks for and was not asked for before.
    pub(crate) fn prepare(&mut self, builder: &Builder<'_>, show: Show, window: bool) -> Result<()> {
        let (pipeline, label, file) = match show {
            Show::Image => (None, "", ""),
            Show::Wireframe | Show::Barycentric => {
                (Some(&mut self.surface), "post.show_surface", "passes/post/show_surface.comp")
            }
            Show::NonFinite => (Some(&mut self.non_finite), "post.non_finite", "passes/post/non_finite.comp"),
            Show::Noise | Show::Error => {
                (Some(&mut self.error_map), "post.error_map", "passes/post/error_map.comp")
            }
            _ => (Some(&mut self.target), "post.show", "passes/post/show.comp"),
        };
        if let Some(pipeline @ None) = pipeline {
            *pipeline = Some(builder.compute(label, file)?);
        }
        if window && self.window.is_none() {
            self.window = Some(builder.compute("post.window", "passes/post/window.comp")?);
        }
        Ok(())
    }

    /// Fills `display`, and `window` where the view has one.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        scope: &Scope<'_>,
        targets: &Targets,
        accumulator: &Buffer,
        shown: &Shown<'_>,
    ) -> Result<()> {
        let unused = scope.tables.textures.white();
        let read_sums = [Use::Buffer(accumulator, Stage::Compute, Access::StorageRead)];
        let display = ("display", Bind::Image(&targets.display));
        match way(shown, targets) {
            Way::Image => {
                let binds = [("shaded", Bind::Image(&targets.shaded)), display];
                scope.compute(recorder, "post", &self.image, &binds, &read_sums, 0)?;
            }
            Way::Float(kind, source) => {
                let source = source.unwrap_or(unused);
                show_target(recorder, scope, self.target.as_ref(), kind, [source, &targets.id], display)?;
            }
            Way::Integer(kind, source) => {
                show_target(recorder, scope, self.target.as_ref(), kind, [unused, source], display)?;
            }
            Way::Surface(kind) => {
                let binds = [("gbuffer_id", Bind::Image(&targets.id)), display];
                if let Some(pipeline) = &self.surface {
                    scope.compute(recorder, "post.show_surface", pipeline, &binds, &[], kind)?;
                }
            }
            Way::ErrorMap(against_reference) => {
                if let Some(pipeline) = &self.error_map {
                    let mut uses = read_sums.to_vec();
                    uses.extend(
                        shown
                            .reference
                            .map(|buffer| Use::Buffer(buffer, Stage::Compute, Access::StorageRead)),
                    );
                    let kind = u32::from(against_reference);
                    scope.compute(recorder, "post.error_map", pipeline, &[display], &uses, kind)?;
                }
            }
            Way::NonFinite => {
                let [emissive, diffuse, specular] =
                    [&targets.emissive, &targets.direct_diffuse, &targets.direct_specular]
                        .map(|image| Bind::Image(image.as_ref().unwrap_or(unused)));
                let binds = [
                    ("shaded", Bind::Image(&targets.shaded)),
                    display,
                    ("gbuffer_base_color", Bind::Image(&targets.base_color)),
                    ("gbuffer_material", Bind::Image(&targets.material)),
                    ("gbuffer_emissive", emissive),
                    ("direct_diffuse", diffuse),
                    ("direct_specular", specular),
                ];
                if let Some(pipeline) = &self.non_finite {
                    let added = u32::from(shown.added);
                    scope.compute(recorder, "post.non_finite", pipeline, &binds, &read_sums, added)?;
                }
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

/// `sources`: of floats and of integers, of which `kind` reads one.
fn show_target(
    recorder: &mut Recorder,
    scope: &Scope<'_>,
    pipeline: Option<&Live<ComputePipeline>>,
    kind: u32,
    [float, integer]: [&Image; 2],
    display: (&str, Bind<'_>),
) -> Result<()> {
    let Some(pipeline) = pipeline else { return Ok(()) };
    let binds = [("source", Bind::Image(float)), ("source_uint", Bind::Image(integer)), display];
    scope.compute(recorder, "post.show", pipeline, &binds, &[], kind)
}

fn way<'a>(shown: &Shown<'_>, targets: &'a Targets) -> Way<'a> {
    let normal = &targets.normal[shown.parity % targets.normal.len()];
    let depth = &targets.depth[shown.parity % targets.depth.len()];
    let history = targets.history.as_ref().map(|history| &history.diffuse[shown.history]);
    match shown.show {
        Show::Image => Way::Image,
        Show::BaseColor => Way::Float(constants::SHOW_BASE_COLOR, Some(&targets.base_color)),
        Show::Normal => Way::Integer(constants::SHOW_NORMAL, normal),
        Show::GeometricNormal => Way::Integer(constants::SHOW_GEOMETRIC_NORMAL, normal),
        Show::Facing => Way::Integer(constants::SHOW_FACING, &targets.id),
        Show::Depth => Way::Float(constants::SHOW_DEPTH, Some(depth)),
        Show::Metallic => Way::Float(constants::SHOW_METALLIC, Some(&targets.material)),
        Show::Roughness => Way::Float(constants::SHOW_ROUGHNESS, Some(&targets.material)),
        Show::Occlusion => Way::Float(constants::SHOW_OCCLUSION, Some(&targets.base_color)),
        Show::Motion => Way::Float(constants::SHOW_MOTION, Some(&targets.motion)),
        Show::Emissive => Way::Float(constants::SHOW_EMISSIVE, targets.emissive.as_ref()),
        Show::Instance => Way::Integer(constants::SHOW_INSTANCE, &targets.id),
        Show::Primitive => Way::Integer(constants::SHOW_PRIMITIVE, &targets.id),
        Show::Material => Way::Integer(constants::SHOW_MATERIAL, &targets.id),
        Show::Triangle => Way::Integer(constants::SHOW_TRIANGLE, &targets.id),
        Show::Wireframe => Way::Surface(constants::SHOW_WIREFRAME),
        Show::Barycentric => Way::Surface(constants::SHOW_BARYCENTRIC),
        Show::DirectDiffuse => Way::Float(constants::SHOW_LIGHT, targets.direct_diffuse.as_ref()),
        Show::DirectSpecular => Way::Float(constants::SHOW_LIGHT, targets.direct_specular.as_ref()),
        Show::Shadow => {
            let traced = targets.light_shadow.as_ref().filter(|_| shown.light_shadow);
            Way::Float(constants::SHOW_SHADOW, traced)
        }
        Show::RayDepth => Way::Integer(constants::SHOW_RAY_DEPTH, &targets.ray_depth),
        Show::History => Way::Float(constants::SHOW_HISTORY, history),
        Show::NonFinite => Way::NonFinite,
        Show::Noise => Way::ErrorMap(false),
        Show::Error => Way::ErrorMap(true),
    }
}
