//! The order of the passes, from top to bottom. Enters: a view and the scene. Leaves: its display image.

use caustica_gpu::Recorder;
use glam::{Mat4, Vec2};

use crate::accel::Accel;
use crate::delta::Invalidation;
use crate::error::Result;
use crate::gpu_types::{
    self, FRAME_DENOISED, FRAME_HALF_REFLECTIONS, FRAME_HISTORY, FRAME_MOVING, FRAME_OPAQUE_GLASS,
    FRAME_ORTHOGRAPHIC, FRAME_PATHS_BEND, FRAME_SHADOWS_KNOWN, FRAME_STEADY, FrameCounters,
};
use crate::needs::Needs;
use crate::passes::{Moving, PassSet, Radiance, Scope, Shown};
use crate::settings::{Pipeline, ReflectionRate, Show, ToneMap, ViewSettings};
use crate::tables::Tables;
use crate::view::{CameraMatrices, Targets, View};

/// Records one frame of a view.
///
/// # Errors
/// When memory runs out or a pass and its shader disagree.
pub(crate) fn record(
    recorder: &mut Recorder,
    view: &mut View,
    tables: &Tables,
    accel: &Accel,
    passes: &PassSet,
    needs: Needs,
) -> Result<()> {
    view.prepare_targets(needs)?;
    view.prepare_measuring(recorder)?;
    let what = view.accumulation.take_pending();
    if what != Invalidation::Nothing {
        view.bands.abandon();
    }
    if what == Invalidation::Everything {
        view.forget_light();
    }
    let plan = Plan::of(view, what, passes.radiance.denoises());
    let band = view.bands.next(view.extent()[1], plan.moved || plan.denoised);
    recorder.set_tag(view.bands.tag(&band));
    let matrices = CameraMatrices::of(view.camera(), view.extent());
    let constants = frame_constants(view, tables, &matrices, &plan);
    let frame_address = recorder.stage_bytes(bytemuck::bytes_of(&constants))?;
    let scope = Scope {
        tables,
        accel,
        set: tables.textures.set_of(recorder.slot()),
        frame_address,
        extent: view.extent(),
        rows: band.rows.clone(),
    };
    if band.first {
        // Dropped samples are counted since the last reset, rays, where they are counted, in each frame anew.
        let rays = std::mem::offset_of!(FrameCounters, shadow_rays) as u64;
        let from = (constants.accumulated == 0).then_some(0).or(needs.known_shadows.then_some(rays));
        if let Some(from) = from {
            recorder.clear_buffer(&view.counters.device, from..view.counters.device.size());
        }
    }
    let parity = (view.frame_count % 2) as usize;
    view.seen = Some(parity);
    let (Some((_, targets)), Some(accumulator)) = (&view.targets, &view.accumulator) else {
        return Ok(());
    };

    if band.first {
        passes.gbuffer.record(recorder, &scope, targets, parity)?;
    }
    let filled = view.history.map_or(0, |filled| 1 - filled);
    let half_reflections = half_reflections(view.settings());
    let moving =
        plan.denoised.then_some(Moving { filled, counters: &view.counters.device, half_reflections });
    match &passes.radiance {
        Radiance::Path(path) => path.record(recorder, &scope, targets, parity, moving)?,
        Radiance::Deferred(deferred) => deferred.record(recorder, &scope, targets, parity, moving)?,
    }
    if band.last && !plan.moving {
        passes.accumulate.record(recorder, &scope, targets, accumulator, &view.counters.device)?;
        if let (Some(pass), Some(blocks)) = (&passes.error, view.measuring.blocks(scope.extent)) {
            let reference = view.measuring.reference(scope.extent);
            pass.record(recorder, &scope, accumulator, reference, blocks)?;
            let (samples, resets) = (view.accumulation.samples() + 1, view.accumulation.resets());
            view.measuring.copy(recorder, samples, resets)?;
        }
    }
    let shown_history = if plan.denoised { filled } else { view.history.unwrap_or(filled) };
    // In the middle of a sample the display is made again only when the way it is shown has changed.
    let display = view.display_key();
    let mut displayed = None;
    let has_samples = view.accumulation.samples() > 0;
    let shown_anew = view.displayed.as_ref() != Some(&display);
    if band.last || (has_samples && shown_anew) {
        let fresh = shown_anew || plan.moving || constants.accumulated == 0;
        let light_shadow = record_light_shadow(recorder, &scope, view.settings(), targets, passes, fresh)?;
        let shown = Shown {
            show: view.settings().show,
            light_shadow,
            parity,
            history: shown_history,
            added: band.last && !plan.moving,
            reference: view.measuring.reference(scope.extent),
        };
        passes.post.record(recorder, &scope, targets, accumulator, &shown)?;
        displayed = Some(display);
    }
    let counters = &view.counters;
    let host = &counters.host[recorder.slot() % counters.host.len()];
    recorder.copy_buffer(&counters.device, host, counters.device.size())?;

    if let Some(display) = displayed {
        view.set_displayed(display);
    }
    if !band.last {
        return Ok(());
    }
    if !plan.moving {
        view.accumulation.advance();
    }
    view.complete(matrices, plan.denoised.then_some(filled));
    Ok(())
}

/// Traces the shadow of a light when it is what is shown. False: there is none, as no such light shines or no rays
/// are cast. `fresh`: it does not go on with that of the frames before.
fn record_light_shadow(
    recorder: &mut Recorder,
    scope: &Scope<'_>,
    settings: &ViewSettings,
    targets: &Targets,
    passes: &PassSet,
    fresh: bool,
) -> Result<bool> {
    let (Show::Shadow, Some(pass), Some(image)) =
        (settings.show, &passes.light_shadow, &targets.light_shadow)
    else {
        return Ok(false);
    };
    let Some(light) = scope.tables.lights.index_of(settings.show_light) else { return Ok(false) };
    pass.record(recorder, scope, (&targets.id, image), light, fresh)?;
    Ok(true)
}

/// What kind of frame this is.
struct Plan {
    /// The camera or the scene moved: the frame must be whole, or a drag would never show one.
    moved: bool,
    /// Light is denoised: something moved, or stills are denoised too.
    denoised: bool,
    /// Shown and not accumulated.
    moving: bool,
    /// The past belongs to the last frame and may be reprojected.
    history: bool,
    /// What shadow rays met in the last frame they would meet now.
    shadows_known: bool,
}

impl Plan {
    fn of(view: &View, what: Invalidation, denoises: bool) -> Self {
        // A view that was resized goes on with the light it had, as one that moves does.
        let resized = what == Invalidation::Resize && view.history.is_some();
        let moved = resized || matches!(what, Invalidation::Camera | Invalidation::Scene);
        let denoised = (moved || view.settings().denoise_stills) && denoises;
        let history = denoised && view.history.is_some() && view.previous.is_some();
        // Whatever moves casts its shadow elsewhere; pixels of another size have nothing to look up.
        let shadows_known = history && matches!(what, Invalidation::Camera | Invalidation::Nothing);
        Self { moved, denoised, moving: moved && denoised, history, shadows_known }
    }
}

fn frame_constants(
    view: &mut View,
    tables: &Tables,
    matrices: &CameraMatrices,
    plan: &Plan,
) -> gpu_types::Frame {
    let extent = view.extent();
    let sample = view.accumulation.next_sample();
    let sample_index = if plan.moving { view.accumulation.next_moving_index() } else { sample.index };
    let (selection, selection_count) = view.selection();
    let settings = view.settings();
    let jitter =
        if settings.jitter { view.sampling().jitter_px(settings.seed, sample_index) } else { Vec2::ZERO };
    let previous: Mat4 =
        view.previous.map_or(matrices.clip_from_render, |previous| previous.clip_from_render);
    let path = settings.pipeline == Pipeline::Path;
    let mut flags = 0;
    for (set, flag) in [
        (matrices.orthographic, FRAME_ORTHOGRAPHIC),
        (plan.denoised, FRAME_DENOISED),
        (plan.denoised && half_reflections(settings), FRAME_HALF_REFLECTIONS),
        (plan.shadows_known, FRAME_SHADOWS_KNOWN),
        (plan.moving, FRAME_MOVING),
        (plan.history, FRAME_HISTORY),
        (settings.opaque_glass_shadows, FRAME_OPAQUE_GLASS),
        (path, FRAME_PATHS_BEND),
        (!plan.moved, FRAME_STEADY),
    ] {
        flags |= if set { flag } else { 0 };
    }
    gpu_types::Frame {
        clip_from_render: matrices.jittered(jitter, extent).to_cols_array(),
        clip_from_render_unjittered: matrices.clip_from_render.to_cols_array(),
        previous_clip_from_render: previous.to_cols_array(),
        render_from_camera: matrices.render_from_camera,
        half_extent: matrices.half_extent.to_array(),
        jitter_px: jitter.to_array(),
        extent_px: extent,
        near_m: matrices.near_m,
        exposure: settings.exposure_ev.clamp(-40.0, 40.0).exp2(),
        scene: tables.address(),
        counters: view.counters.device.address(),
        accumulator: view.accumulator.as_ref().map_or(0, caustica_gpu::Buffer::address),
        sample_index,
        selection,
        reference: view.measuring.reference(extent).map_or(0, caustica_gpu::Buffer::address),
        error_blocks: view.measuring.blocks(extent).map_or(0, caustica_gpu::Buffer::address),
        ggx_albedo: if settings.multiple_scattering { tables.ggx_albedo_address() } else { 0 },
        seed: settings.seed,
        flags,
        light_samples: settings.light_samples.max(1),
        shadow_rays: settings.shadow_rays.max(1),
        max_depth: if path { settings.path_depth.unwrap_or(u32::MAX) } else { settings.max_depth },
        tone_map: match settings.tone_map {
            ToneMap::Linear => gpu_types::TONE_MAP_LINEAR,
            ToneMap::Aces => gpu_types::TONE_MAP_ACES,
            ToneMap::Agx => gpu_types::TONE_MAP_AGX,
            ToneMap::Neutral => gpu_types::TONE_MAP_NEUTRAL,
        },
        reflection_roughness_max: settings.reflection_roughness_max,
        temporal_max_history: settings.temporal_max_history.max(1.0),
        block_index: sample.block as u32,
        block_start: u32::from(sample.opens_block),
        block_end: u32::from(sample.closes_block),
        accumulated: view.accumulation.samples().min(u64::from(u32::MAX)) as u32,
        selection_count,
        pad0: 0,
    }
}

/// One pixel of each 2 x 2 traces reflected light in frames that are denoised.
fn half_reflections(settings: &ViewSettings) -> bool {
    settings.reflection_rate == ReflectionRate::Half && settings.pipeline != Pipeline::Path
}

/// Reads the counters that a finished frame of this slot has left.
pub(crate) fn read_counters(view: &mut View, slot: usize) {
    let host = &view.counters.host[slot % view.counters.host.len()];
    if let Some(bytes) = host.mapped().get(..size_of::<FrameCounters>()) {
        let counters: FrameCounters = bytemuck::pod_read_unaligned(bytes);
        view.statistics.non_finite = u64::from(counters.non_finite);
        view.statistics.shadow_rays = u64::from(counters.shadow_rays);
    }
    view.note_error(slot);
}
