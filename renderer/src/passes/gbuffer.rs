//! Pass `gbuffer`: what is seen through every pixel. Enters: instances, materials. Leaves: ids, normals, material,
//! motion, depth. By raster (ids first, then resolved once a pixel) or by rays, with the same result.

use std::sync::Arc;

use caustica_gpu::{
    Bind, ComputePipeline, CullMode, Draw, GraphicsPipeline, Image, RayTracingPipeline, Recorder, Stage,
};

use super::{Builder, Scope};
use crate::error::Result;
use crate::gpu_types::{Push, SHAPE_VERTICES};
use crate::shader::Live;
use crate::tables::Batch;
use crate::view::Targets;

/// The pass.
pub(crate) enum GBuffer {
    Raster {
        opaque: Live<GraphicsPipeline>,
        alpha: Option<Live<GraphicsPipeline>>,
        shapes: Option<Live<GraphicsPipeline>>,
        resolve: Live<ComputePipeline>,
    },
    Rays {
        trace: Live<RayTracingPipeline>,
    },
}

impl GBuffer {
    pub(crate) fn new(builder: &Builder<'_>) -> Result<Self> {
        if builder.needs.primary_rays {
            return Ok(Self::Rays { trace: builder.rays("gbuffer.trace", "passes/gbuffer/gbuffer.rgen")? });
        }
        let needs = builder.needs;
        let triangles = "passes/gbuffer/visibility.vert";
        Ok(Self::Raster {
            opaque: builder.raster("gbuffer.raster", triangles, "passes/gbuffer/visibility.frag")?,
            alpha: needs
                .alpha
                .then(|| {
                    builder.raster("gbuffer.raster alpha", triangles, "passes/gbuffer/visibility_alpha.frag")
                })
                .transpose()?,
            shapes: needs
                .shapes
                .then(|| {
                    builder.raster(
                        "gbuffer.raster shapes",
                        "passes/gbuffer/shape.vert",
                        "passes/gbuffer/shape.frag",
                    )
                })
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
            Self::Rays { trace } => scope.whole().rays(recorder, "gbuffer.trace", trace, &binds, &[], 1),
            Self::Raster { opaque, alpha, shapes, resolve } => {
                let get = |live: Option<&Live<GraphicsPipeline>>| live.map(|live| live.get(&[])).transpose();
                let pipelines = [get(Some(opaque))?, get(alpha.as_ref())?, get(shapes.as_ref())?];
                draw(recorder, scope, pipelines, &targets.id, depth)?;
                scope.compute(recorder, "gbuffer.resolve", resolve, &binds, &[], 0)
            }
        }
    }
}

/// `pipelines`: of opaque triangles, of triangles with alpha, of shapes.
fn draw(
    recorder: &mut Recorder,
    scope: &Scope<'_>,
    pipelines: [Option<Arc<GraphicsPipeline>>; 3],
    id: &Image,
    depth: &Image,
) -> Result<()> {
    let batches: Vec<Batch> = scope.tables.draws.batches().collect();
    let pushes: Vec<Push> = batches.iter().map(|batch| scope.push(batch.key.geometry, 0)).collect();
    let mut lists: [Vec<Draw<'_>>; 3] = Default::default();
    for (batch, push) in batches.iter().zip(&pushes) {
        let draw = draw_of(scope, batch, push)?;
        let list = if draw.indices.is_none() { 2 } else { usize::from(batch.key.alpha) };
        lists[list].push(draw);
    }
    let pipelines: Vec<(&GraphicsPipeline, &[Draw<'_>])> = pipelines
        .iter()
        .zip(&lists)
        .filter_map(|(pipeline, list)| Some((pipeline.as_deref()?, &**list)))
        .collect();
    let uses = scope.tables.uses(Stage::Raster);
    recorder.pass("gbuffer.raster", |recorder| {
        recorder.draw(&pipelines, Some(scope.set), &[], &uses, &[id], Some(depth), scope.extent)
    })?;
    Ok(())
}

fn draw_of<'a>(scope: &Scope<'a>, batch: &Batch, push: &'a Push) -> Result<Draw<'a>> {
    let mesh = scope.tables.meshes.get(batch.key.mesh)?;
    let geometry = &mesh.host.geometries[batch.key.geometry as usize];
    let mut draw = Draw {
        indices: Some(&mesh.vertices.indices),
        first_index: geometry.first_index,
        index_count: geometry.index_count,
        first_instance: batch.first_instance,
        instance_count: batch.instance_count,
        cull: batch.key.cull,
        clockwise: batch.key.mirrored,
        push: bytemuck::bytes_of(push),
    };
    if mesh.shapes.is_some() {
        draw.indices = None;
        draw.first_index = 0;
        draw.index_count = geometry.index_count.saturating_mul(SHAPE_VERTICES);
        draw.cull = CullMode::Back; // of the box around a shape: which sides are seen, the fragment stage decides
    }
    Ok(draw)
}
