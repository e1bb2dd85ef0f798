//! Pass `gbuffer`: what is seen through every pixel. Enters: instances, materials. Leaves: ids, normals, material,
//! motion, depth. By raster (ids first, then resolved once a pixel) or by rays, with the same result.

use caustica_gpu::{
    Bind, ColorTarget, ComputePipeline, Draw, Format, GraphicsDesc, GraphicsPipeline, Image,
    RayTracingPipeline, Recorder, Stage,
};

use super::{Builder, Scope};
use crate::error::Result;
use crate::gpu_types::Push;
use crate::shader::merge_interfaces;
use crate::tables::Batch;
use crate::view::Targets;

/// The pass.
pub(crate) enum GBuffer {
    Raster { opaque: GraphicsPipeline, alpha: Option<GraphicsPipeline>, resolve: ComputePipeline },
    Rays { trace: RayTracingPipeline },
}

impl GBuffer {
    pub(crate) fn new(builder: &mut Builder<'_>) -> Result<Self> {
        if builder.needs.primary_rays {
            return Ok(Self::Rays { trace: builder.rays("gbuffer.trace", "passes/gbuffer/gbuffer.rgen")? });
        }
        let alpha = builder.needs.alpha;
        Ok(Self::Raster {
            opaque: raster(builder, "gbuffer.raster", "passes/gbuffer/visibility.frag")?,
            alpha: alpha
                .then(|| raster(builder, "gbuffer.raster alpha", "passes/gbuffer/visibility_alpha.frag"))
                .transpose()?,
            resolve: builder.compute("gbuffer.resolve", "passes/gbuffer/resolve.comp")?,
        })
    }

    /// Fills the G-buffer; `parity` chooses among the two normal and depth images.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        scope: &Scope<'_>,
        targets: &Targets,
        parity: usize,
    ) -> Result<()> {
        let depth = &targets.depth[parity % targets.depth.len()];
        let binds = [
            ("gbuffer_id", Bind::Image(&targets.id)),
            ("gbuffer_normal", Bind::Image(&targets.normal[parity % targets.normal.len()])),
            ("gbuffer_base_color", Bind::Image(&targets.base_color)),
            ("gbuffer_material", Bind::Image(&targets.material)),
            ("gbuffer_motion", Bind::Image(&targets.motion)),
            ("gbuffer_depth", Bind::Image(depth)),
            // Never written without emission, but something of the kind has to be bound.
            ("gbuffer_emissive", Bind::Image(targets.emissive.as_ref().unwrap_or(&targets.shaded))),
        ];
        match self {
            Self::Rays { trace } => {
                scope.rays(recorder, "gbuffer.trace", trace, &binds, 0..scope.extent[1], 1)
            }
            Self::Raster { opaque, alpha, resolve } => {
                draw(recorder, scope, opaque, alpha.as_ref(), &targets.id, depth)?;
                scope.compute(recorder, "gbuffer.resolve", resolve, &binds, &[], 0)
            }
        }
    }
}

fn raster(builder: &mut Builder<'_>, label: &str, fragment_file: &str) -> Result<GraphicsPipeline> {
    let vertex = builder.library.stage("passes/gbuffer/visibility.vert")?;
    let fragment = builder.library.stage(fragment_file)?;
    let interface = merge_interfaces(&[&vertex, &fragment])?;
    let desc = GraphicsDesc {
        name: label,
        vertex: &vertex.module,
        fragment: &fragment.module,
        colors: &[ColorTarget { format: Format::Rgba32Uint }],
        depth: Some(Format::Depth32),
    };
    Ok(GraphicsPipeline::new(builder.device, &desc, &interface, &builder.specialization, Some(builder.set))?)
}

fn draw(
    recorder: &mut Recorder,
    scope: &Scope<'_>,
    opaque: &GraphicsPipeline,
    alpha: Option<&GraphicsPipeline>,
    id: &Image,
    depth: &Image,
) -> Result<()> {
    let batches: Vec<Batch> = scope.tables.draws.batches().collect();
    let pushes: Vec<Push> = batches.iter().map(|batch| scope.push(batch.key.geometry, 0)).collect();
    let mut solid = Vec::new();
    let mut holes = Vec::new();
    for (batch, push) in batches.iter().zip(&pushes) {
        let list = if batch.key.alpha { &mut holes } else { &mut solid };
        list.push(draw_of(scope, batch, push)?);
    }
    let mut pipelines: Vec<(&GraphicsPipeline, &[Draw<'_>])> = vec![(opaque, &solid)];
    if let Some(alpha) = alpha {
        pipelines.push((alpha, &holes));
    }
    let uses = scope.tables.uses(Stage::Raster);
    recorder.pass("gbuffer.raster", |recorder| {
        recorder.draw(&pipelines, Some(scope.set), &[], &uses, &[id], Some(depth), scope.extent)
    })?;
    Ok(())
}

fn draw_of<'a>(scope: &Scope<'a>, batch: &Batch, push: &'a Push) -> Result<Draw<'a>> {
    let mesh = scope.tables.meshes.get(batch.key.mesh)?;
    let geometry = &mesh.host.geometries[batch.key.geometry as usize];
    Ok(Draw {
        indices: &mesh.vertices.indices,
        first_index: geometry.first_index,
        index_count: geometry.index_count,
        first_instance: batch.first_instance,
        instance_count: batch.instance_count,
        cull: batch.key.cull,
        clockwise: batch.key.mirrored,
        push: bytemuck::bytes_of(push),
    })
}
