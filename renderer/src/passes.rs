//! The passes. Each is one struct with its pipelines, a `record`, and a shader folder of the same name.
//! This file holds what they share: how pipelines are built, and what a pass may touch.

mod accumulate;
mod blas_surface;
mod deferred;
mod deform;
mod denoise;
mod error;
mod gbuffer;
mod instance_descriptors;
mod light_shadow;
mod path_trace;
mod post;
mod ray_pipeline;
mod shading;
mod shadow;
mod shape_boxes;
mod temporal;

use std::ops::Range;
use std::sync::{Arc, Mutex};

use caustica_gpu::{
    Bind, ColorTarget, ComputePipeline, Device, Format, GraphicsDesc, GraphicsPipeline, RayTracingPipeline,
    Recorder, SceneLayout, SceneSet, Specialization, Stage, Use,
};

pub(crate) use accumulate::Accumulate;
pub(crate) use blas_surface::BlasSurface;
pub(crate) use deferred::Deferred;
pub(crate) use deform::Deform;
pub(crate) use denoise::{Denoise, Moving};
pub(crate) use error::MeasureError;
pub(crate) use gbuffer::GBuffer;
pub(crate) use instance_descriptors::{DescriptorAddresses, InstanceDescriptors};
pub(crate) use light_shadow::LightShadow;
pub(crate) use path_trace::PathTrace;
pub(crate) use post::{Post, Shown};
pub(crate) use shading::Shading;
pub(crate) use shadow::Shadow;
pub(crate) use shape_boxes::ShapeBoxes;
pub(crate) use temporal::Temporal;

use crate::accel::Accel;
use crate::error::Result;
use crate::gpu_types::Push;
use crate::needs::Needs;
use crate::settings::Show;
use crate::shader::{Live, Owner, ShaderLibrary, StageOf, check_varyings, merge_interfaces};
use crate::tables::Tables;
use crate::view::View;
use ray_pipeline::RayFiles;

/// Invocations of a workgroup of the passes that go over pixels, and of those that go through tables.
const PIXEL_GROUP: [u32; 3] = [8, 8, 1];
const TABLE_GROUP: [u32; 3] = [64, 1, 1];

/// Builds pipelines for one set of needs.
pub(crate) struct Builder<'a> {
    pub(crate) device: &'a Arc<Device>,
    pub(crate) library: &'a Arc<ShaderLibrary>,
    pub(crate) layout: &'a Arc<SceneLayout>,
    pub(crate) needs: Needs,
    pub(crate) specialization: Specialization,
    pub(crate) owner: Arc<Owner>,
}

/// What a pipeline is made with, again whenever its shaders change.
#[derive(Clone)]
struct Frame {
    label: &'static str,
    device: Arc<Device>,
    layout: Option<Arc<SceneLayout>>,
    specialization: Specialization,
}

impl Frame {
    fn scene(&self) -> Option<&SceneLayout> {
        self.layout.as_deref()
    }
}

impl Builder<'_> {
    fn frame(&self, label: &'static str) -> Frame {
        let (device, layout) = (Arc::clone(self.device), Some(Arc::clone(self.layout)));
        Frame { label, device, layout, specialization: self.specialization.clone() }
    }

    fn compute(&self, label: &'static str, file: &'static str) -> Result<Live<ComputePipeline>> {
        compute(self.library, &self.owner, self.frame(label), file, PIXEL_GROUP)
    }

    fn raster(
        &self,
        label: &'static str,
        vertex_file: &'static str,
        fragment_file: &'static str,
    ) -> Result<Live<GraphicsPipeline>> {
        let frame = self.frame(label);
        let make = move |stage: StageOf<'_>| {
            let (vertex, fragment) = (stage(vertex_file)?, stage(fragment_file)?);
            let interface = merge_interfaces(&[&vertex, &fragment])?;
            let target = Format::Rgba32Uint;
            check_varyings(&vertex, &fragment, &[target])?;
            let desc = GraphicsDesc {
                name: frame.label,
                vertex: &vertex.module,
                fragment: &fragment.module,
                colors: &[ColorTarget { format: target }],
                depth: Some(Format::Depth32),
            };
            Ok(GraphicsPipeline::new(&frame.device, &desc, &interface, &frame.specialization, frame.scene())?)
        };
        self.library.live(&[vertex_file, fragment_file], &self.owner, Box::new(make))
    }

    /// A ray-tracing pipeline around one ray generation shader; the other stages are the same for all.
    fn rays(&self, label: &'static str, generation: &'static str) -> Result<Live<RayTracingPipeline>> {
        let frame = self.frame(label);
        let files = RayFiles::of(generation, self.needs);
        let linked = (self.library.is_edited() && self.device.links_pipelines()).then(Mutex::default);
        let make = move |stage: StageOf<'_>| ray_pipeline::make(&frame, &files, linked.as_ref(), stage);
        self.library.live(&files.all(), &self.owner, Box::new(make))
    }
}

fn compute(
    library: &Arc<ShaderLibrary>,
    owner: &Arc<Owner>,
    frame: Frame,
    file: &'static str,
    group: [u32; 3],
) -> Result<Live<ComputePipeline>> {
    let make = move |stage: StageOf<'_>| {
        let stage = stage(file)?;
        stage.check_dispatched(group)?;
        let Frame { label, device, specialization, .. } = &frame;
        let (module, interface) = (&stage.module, &stage.interface);
        Ok(ComputePipeline::new(device, label, module, interface, specialization, frame.scene())?)
    };
    library.live(&[file], owner, Box::new(make))
}

/// Builds a pass that works on tables alone: no scene set, no needs.
fn table_pass(
    device: &Arc<Device>,
    library: &Arc<ShaderLibrary>,
    label: &'static str,
    file: &'static str,
) -> Result<Live<ComputePipeline>> {
    let owner = Arc::new(Owner::of_tables());
    let device = Arc::clone(device);
    let frame = Frame { label, device, layout: None, specialization: Specialization::default() };
    let live = compute(library, &owner, frame, file, TABLE_GROUP)?;
    // Nothing is bound beside the tables: known before the first frame that needs the pass.
    live.get(&[])?;
    Ok(live)
}

/// Workgroups that go through `count` entries of a table; the shader takes several steps where they are too few.
fn table_groups(count: u32) -> [u32; 3] {
    /// What every device allows (Vulkan 1.3, maxComputeWorkGroupCount).
    const MOST_GROUPS: u32 = 65535;
    [count.div_ceil(TABLE_GROUP[0]).min(MOST_GROUPS), 1, 1]
}

/// What the passes of one frame may touch.
pub(crate) struct Scope<'a> {
    pub(crate) tables: &'a Tables,
    pub(crate) accel: &'a Accel,
    pub(crate) set: &'a SceneSet,
    pub(crate) frame_address: u64,
    pub(crate) extent: [u32; 2],
    /// Rows of the image that the ray passes of this frame cover.
    pub(crate) rows: Range<u32>,
}

impl Scope<'_> {
    fn push(&self, argument0: u32, first_row: u32) -> Push {
        Push { frame_address: self.frame_address, argument0, argument1: first_row }
    }

    /// Runs a compute pass over every pixel.
    fn compute(
        &self,
        recorder: &mut Recorder,
        label: &str,
        pipeline: &Live<ComputePipeline>,
        binds: &[(&str, Bind<'_>)],
        uses: &[Use<'_>],
        argument0: u32,
    ) -> Result<()> {
        let mut all = uses.to_vec();
        let pipeline = pipeline.get(binds)?;
        if pipeline.interface().uses_scene {
            all.extend(self.tables.uses(Stage::Compute));
        }
        let [width, height] = self.extent;
        let groups = [width.div_ceil(PIXEL_GROUP[0]), height.div_ceil(PIXEL_GROUP[1]), 1];
        let push = self.push(argument0, 0);
        recorder.pass(label, |recorder| {
            recorder.dispatch(&pipeline, Some(self.set), binds, &all, bytemuck::bytes_of(&push), groups)
        })?;
        Ok(())
    }

    /// The same with all rows.
    fn whole(&self) -> Self {
        Self { rows: 0..self.extent[1], ..*self }
    }

    /// Launches one ray generation shader a pixel of `rows`.
    fn rays(
        &self,
        recorder: &mut Recorder,
        label: &str,
        pipeline: &Live<RayTracingPipeline>,
        binds: &[(&str, Bind<'_>)],
        uses: &[Use<'_>],
        argument0: u32,
    ) -> Result<()> {
        let mut all = uses.to_vec();
        let pipeline = pipeline.get(binds)?;
        all.extend(self.tables.uses(Stage::RayTracing));
        all.extend(self.accel.uses());
        let push = self.push(argument0, self.rows.start);
        let size = [self.extent[0], self.rows.end - self.rows.start];
        recorder.pass(label, |recorder| {
            recorder.trace_rays(&pipeline, Some(self.set), binds, &all, bytemuck::bytes_of(&push), size)
        })?;
        Ok(())
    }
}

/// The passes that bring the scene itself up to date, whatever the views show.
pub(crate) struct ScenePasses {
    pub(crate) blas_surface: BlasSurface,
    pub(crate) deform: Deform,
    pub(crate) instance_descriptors: InstanceDescriptors,
    pub(crate) shape_boxes: ShapeBoxes,
}

impl ScenePasses {
    pub(crate) fn new(device: &Arc<Device>, library: &Arc<ShaderLibrary>) -> Result<Self> {
        Ok(Self {
            blas_surface: BlasSurface::new(device, library)?,
            deform: Deform::new(device, library)?,
            instance_descriptors: InstanceDescriptors::new(device, library)?,
            shape_boxes: ShapeBoxes::new(device, library)?,
        })
    }
}

/// How light gets from the first surfaces to the camera.
pub(crate) enum Radiance {
    /// Direct light, then shading with its rays.
    Deferred(Box<Deferred>),
    /// One path a pixel.
    Path(Box<PathTrace>),
}

impl Radiance {
    /// Whether frames are denoised while something moves.
    pub(crate) fn denoises(&self) -> bool {
        match self {
            Self::Deferred(deferred) => deferred.denoise.is_some(),
            Self::Path(path) => path.denoise.is_some(),
        }
    }
}

/// The passes of one pipeline for one set of needs.
pub(crate) struct PassSet {
    pub(crate) gbuffer: GBuffer,
    pub(crate) radiance: Radiance,
    pub(crate) accumulate: Accumulate,
    /// Made when it is shown for the first time.
    pub(crate) light_shadow: Option<LightShadow>,
    pub(crate) post: Post,
    /// Made when something is measured for the first time.
    pub(crate) error: Option<MeasureError>,
    /// Of all its pipelines.
    pub(crate) owner: Arc<Owner>,
}

impl PassSet {
    pub(crate) fn new(builder: &Builder<'_>) -> Result<Self> {
        Ok(Self {
            gbuffer: GBuffer::new(builder)?,
            radiance: if builder.needs.paths {
                Radiance::Path(Box::new(PathTrace::new(builder)?))
            } else {
                Radiance::Deferred(Box::new(Deferred::new(builder)?))
            },
            accumulate: Accumulate::new(builder)?,
            light_shadow: None,
            post: Post::new(builder)?,
            error: None,
            owner: Arc::clone(&builder.owner),
        })
    }

    /// Makes what a view asks for and was not asked for before.
    pub(crate) fn prepare(&mut self, builder: &Builder<'_>, view: &View) -> Result<()> {
        let show = view.settings().show;
        if view.measuring.wanted && self.error.is_none() {
            self.error = Some(MeasureError::new(builder)?);
        }
        if show == Show::Shadow && builder.needs.shadow_rays && self.light_shadow.is_none() {
            self.light_shadow = Some(LightShadow::new(builder)?);
        }
        self.post.prepare(builder, show, view.is_for_window())
    }
}
