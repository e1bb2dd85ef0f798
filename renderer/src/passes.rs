//! The passes. Each is one struct with its pipelines, a `record`, and a shader folder of the same name.
//! This file holds what they share: how pipelines are built, and what a pass may touch.

mod accumulate;
mod blas_surface;
mod deferred;
mod deform;
mod denoise;
mod gbuffer;
mod instance_descriptors;
mod light_shadow;
mod path_trace;
mod post;
mod shading;
mod shadow;
mod shape_boxes;
mod temporal;

use std::ops::Range;
use std::sync::Arc;

use caustica_gpu::{
    Bind, ComputePipeline, Device, HitGroup, RayTracingDesc, RayTracingPipeline, Recorder, SceneSet,
    Specialization, Stage, Use,
};

pub(crate) use accumulate::Accumulate;
pub(crate) use blas_surface::BlasSurface;
pub(crate) use deferred::Deferred;
pub(crate) use deform::Deform;
pub(crate) use denoise::{Denoise, Moving};
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
use crate::shader::{Compiled, ShaderLibrary, merge_interfaces};
use crate::tables::Tables;

/// Builds pipelines for one set of needs.
pub(crate) struct Builder<'a> {
    pub(crate) device: &'a Arc<Device>,
    pub(crate) library: &'a mut ShaderLibrary,
    pub(crate) set: &'a SceneSet,
    pub(crate) needs: Needs,
    pub(crate) specialization: Specialization,
}

impl Builder<'_> {
    fn compute(&mut self, label: &str, file: &str) -> Result<ComputePipeline> {
        let stage = self.library.stage(file)?;
        let set = Some(self.set);
        Ok(ComputePipeline::new(
            self.device,
            label,
            &stage.module,
            &stage.interface,
            &self.specialization,
            set,
        )?)
    }

    /// A ray-tracing pipeline around one ray generation shader; the other stages are the same for all.
    fn rays(&mut self, label: &str, file: &str) -> Result<RayTracingPipeline> {
        let generation = self.library.stage(file)?;
        let surface_miss = self.library.stage("passes/rays/surface.rmiss")?;
        let shadow_miss = self.library.stage("passes/rays/shadow.rmiss")?;
        let surface_hit = self.library.stage("passes/rays/surface.rchit")?;
        let surface_any = self.optional(self.needs.any_hit, "passes/rays/surface.rahit")?;
        let shadow_any = self.optional(self.needs.any_hit, "passes/rays/shadow.rahit")?;
        let shape_hit = self.optional(self.needs.shapes, "passes/rays/shape.rchit")?;
        let shape_intersection = self.optional(self.needs.shapes, "passes/rays/shape.rint")?;
        let mut stages = vec![&*generation, &*surface_miss, &*shadow_miss, &*surface_hit];
        for stage in [&surface_any, &shadow_any, &shape_hit, &shape_intersection] {
            stages.extend(stage.as_deref());
        }
        let interface = merge_interfaces(&stages)?;
        let [surface_any, shadow_any, shape_hit, shape_intersection] =
            [&surface_any, &shadow_any, &shape_hit, &shape_intersection]
                .map(|stage| stage.as_deref().map(|stage| &stage.module));
        // In the order of RAY_SURFACE and RAY_SHADOW; then the same for shapes (RAY_SHAPES).
        let of_kind = |closest_hit, intersection| {
            [(closest_hit, surface_any), (None, shadow_any)].map(|(closest_hit, any_hit)| HitGroup {
                closest_hit,
                any_hit,
                intersection,
            })
        };
        let mut hit_groups = of_kind(Some(&surface_hit.module), None).to_vec();
        if shape_intersection.is_some() {
            hit_groups.extend(of_kind(shape_hit, shape_intersection));
        }
        let desc = RayTracingDesc {
            name: label,
            ray_generation: &generation.module,
            misses: &[&surface_miss.module, &shadow_miss.module],
            hit_groups: &hit_groups,
        };
        Ok(RayTracingPipeline::new(self.device, &desc, &interface, &self.specialization, Some(self.set))?)
    }

    fn optional(&mut self, wanted: bool, file: &str) -> Result<Option<Arc<Compiled>>> {
        wanted.then(|| self.library.stage(file)).transpose()
    }
}

/// Builds a pass that works on tables alone: no scene set, no needs.
fn table_pass(
    device: &Arc<Device>,
    library: &mut ShaderLibrary,
    label: &str,
    file: &str,
) -> Result<ComputePipeline> {
    let stage = library.stage(file)?;
    let general = Specialization::default();
    Ok(ComputePipeline::new(device, label, &stage.module, &stage.interface, &general, None)?)
}

/// Groups of 64 that go through `count` entries of a table; the shader takes several steps where they are too few.
fn table_groups(count: u32) -> [u32; 3] {
    /// What every device allows (Vulkan 1.3, maxComputeWorkGroupCount).
    const MOST_GROUPS: u32 = 65535;
    [count.div_ceil(64).min(MOST_GROUPS), 1, 1]
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
        pipeline: &ComputePipeline,
        binds: &[(&str, Bind<'_>)],
        uses: &[Use<'_>],
        argument0: u32,
    ) -> Result<()> {
        let mut all = uses.to_vec();
        if pipeline.interface().uses_scene {
            all.extend(self.tables.uses(Stage::Compute));
        }
        let groups = [self.extent[0].div_ceil(8), self.extent[1].div_ceil(8), 1];
        let push = self.push(argument0, 0);
        recorder.pass(label, |recorder| {
            recorder.dispatch(pipeline, Some(self.set), binds, &all, bytemuck::bytes_of(&push), groups)
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
        pipeline: &RayTracingPipeline,
        binds: &[(&str, Bind<'_>)],
        uses: &[Use<'_>],
        argument0: u32,
    ) -> Result<()> {
        let mut all = uses.to_vec();
        all.extend(self.tables.uses(Stage::RayTracing));
        all.extend(self.accel.uses());
        let push = self.push(argument0, self.rows.start);
        let size = [self.extent[0], self.rows.end - self.rows.start];
        recorder.pass(label, |recorder| {
            recorder.trace_rays(pipeline, Some(self.set), binds, &all, bytemuck::bytes_of(&push), size)
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
    pub(crate) fn new(device: &Arc<Device>, library: &mut ShaderLibrary) -> Result<Self> {
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
}

impl PassSet {
    pub(crate) fn new(builder: &mut Builder<'_>) -> Result<Self> {
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
        })
    }

    /// Makes what a view asks for and was not asked for before.
    pub(crate) fn prepare(&mut self, builder: &mut Builder<'_>, show: Show, window: bool) -> Result<()> {
        if show == Show::Shadow && builder.needs.shadow_rays && self.light_shadow.is_none() {
            self.light_shadow = Some(LightShadow::new(builder)?);
        }
        self.post.prepare(builder, show, window)
    }
}
